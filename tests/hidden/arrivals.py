#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""arrivals.py --seed N [--family F] --out DIR --truth FILE: sixteen more machines; needs numpy.

Joint whose friction grows with its load, harmonic drive, sounding rocket in wind, car that coasts and brakes, multirotor with drag of its rotors, heated
plate, hydraulic motor, lift with a counterweight, pump and pipe, spindle whose oil thins, stage with an encoder, diving vehicle, scooter
whose command comes late, wrist with an unknown payload, bicycle in head wind, and a converter with nothing wrong. The truth was
declared before any of them was diagnosed. Shares no code with the engine; of the other drawers the writer and the courses of commands. What
each logs, with the columns of the true form, from which channels.py computes what least squares would leave."""
import numpy as np
from neighbours import E, nz, stairs, wave
from newcomers import asked, put

M = {}
def machine(f): M[f.__name__] = f; return f
def near(rng, a=.7, b=1.4): return rng.uniform(a, b)
def sd(c, **of):
    """Stated standard deviations beside the channels."""
    return {**c, **{"sd." + k: np.full(len(c["t_s"]), v) for k, v in of.items()}}

# joint of an industrial arm: Coulomb friction that grows with the load of the gear, and viscous friction; inertia and gravity are predicted
@machine
def loaded_joint(rng):
    dt = .008; fc, fl, fv = 4.5 * near(rng), .10 * near(rng), 9. * near(rng); other = 12.
    def log(j, n):
        q = .9 * wave(rng, n, dt, 7, 2); v = np.gradient(q, dt); a = np.gradient(v, dt); q2 = .8 * wave(rng, n, dt, 6, 2); v2 = np.gradient(q2, dt)
        g = 60 * np.cos(q) + other * np.cos(q + q2); tau = 5.5 * a + g; fr = (fc + fl * np.abs(tau)) * np.tanh(v / .01) + fv * v
        vm, am = v + nz(rng, .003, n), a + nz(rng, .05, n); m = 5.5 * am + g; s = np.sign(vm)
        c = {"t_s": np.arange(n) * dt, "x.q2_rad": q, "x.qd2_radps": vm, "x.qdd2_radps2": am, "x.q3_rad": q2, "x.qd3_radps": v2 + nz(rng, .003, n), "z.tau2_Nm": tau + fr + nz(rng, 1.2, n), "m.tau2_Nm": m}
        return sd(c, tau2_Nm=1.3), {"tau2_Nm": [s, s * np.abs(m), vm]}
    return dict(log=log, n=[2200, 1700, 2600], channels=["tau2_Nm"], effects=[E("tau2_Nm", "coulomb_friction"), E("tau2_Nm", "load_friction", "product"), E("tau2_Nm", "viscous_friction")])

# harmonic drive: friction that falls from rest (Stribeck), viscous, and an error of the teeth twice a turn of the wave generator
@machine
def harmonic(rng):
    dt = .005; J, kt = 2.4e-3, .08; fc, fs, ws, fv, ripple = .05 * near(rng), .04 * near(rng), 25., 4.5e-4 * near(rng), .022 * near(rng); ph = rng.uniform(0, 6.28)
    def log(j, n):
        w = 95 * wave(rng, n, dt, 6, 1.5); q = np.cumsum(w) * dt; a = np.gradient(w, dt); wm, am = w + nz(rng, .8, n), a + nz(rng, 9, n)
        tau = J * a + (fc + fs * np.exp(-(w / ws) ** 2)) * np.tanh(w / 1.) + fv * w + ripple * np.sin(2 * q + ph)
        c = {"t_s": np.arange(n) * dt, "x.motor_angle_rad": q, "x.motor_speed_degps": np.degrees(wm), "x.motor_accel": am, "z.current_A": tau / kt + nz(rng, .1, n), "m.current_A": J * am / kt}
        s = np.sign(wm)
        return c, {"current_A": [s, s * np.exp(-(wm / ws) ** 2), wm, np.sin(2 * q), np.cos(2 * q)]}
    return dict(log=log, n=[2600, 2000, 2300], channels=["current_A"],
                effects=[E("current_A", "coulomb_friction"), E("current_A", "viscous_friction"), E("current_A", "periodic", "slope")])

# sounding rockets: drag in air that thins, of another size in every flight; a wind that nobody logs pushes sideways, the sideways channel is predicted well but for it
@machine
def sounding_wind(rng):
    dt = .25; cd = rng.uniform(2.2e-4, 5.2e-4, 4)
    def log(j, n):
        burn, T = 9 + 3 * rng.random(), 62 + 10 * rng.random(); h, v, H, V, A = 100., 5., [], [], []
        for k in range(n):
            th = T if k * dt < burn else 0.; H.append(h); V.append(v); A.append(th)
            for _ in range(5):
                acc = th - 9.81 - cd[j % 4] * np.exp(-h / 7600) * v * abs(v); v += dt / 5 * acc; h += dt / 5 * v
        H, V, A = map(np.array, (H, V, A)); vm = V + nz(rng, .25, n); hm = H + nz(rng, 4, n)
        c = {"t_s": np.arange(n - 1) * dt, "u.thrust_mps2": A[:-1], "x.altitude_m": hm[:-1], "x.climb_mps": vm[:-1], "z.dclimb_mps": (V[1:] - V[:-1] + nz(rng, .1, n - 1)), "m.dclimb_mps": dt * (A[:-1] - 9.81),
             "z.roll_degps": 20 * wave(rng, n, dt, 30, 5)[:-1]}
        c["m.roll_degps"] = c["z.roll_degps"]; c["z.roll_degps"] = c["z.roll_degps"] + nz(rng, .5, n - 1)
        return c, {"dclimb_mps": [(np.exp(-hm / 7600) * vm * np.abs(vm))[:-1]], "roll_degps": []}
    return dict(log=log, n=[320, 280, 350], channels=["dclimb_mps", "roll_degps"], effects=[E("dclimb_mps", "quadratic_drag")])

# car: engine and brake forces are predicted, the air and the tyres are not; the brakes bite by a share less than the model says
@machine
def coasting_car(rng):
    dt = .1; m = 1450.; ca, cr, fade = .42 * near(rng), .013 * near(rng), .15 * near(rng)
    def log(j, n):
        v, V, F, B = 22., [], np.zeros(n), np.zeros(n); want = np.clip(22 + 11 * wave(rng, n, dt, 60, 12), 3, 45); gr = .02 * wave(rng, n, dt, 80, 20)
        for k in range(n):
            u = 1800 * (want[k] - v); F[k], B[k] = np.clip(u, 0, 5500), np.clip(-u, 0, 9000); V.append(v)
            for _ in range(3): v = max(.5, v + dt / 3 * ((F[k] - (1 - fade) * B[k] - ca * v * v - cr * m * 9.81) / m - 9.81 * gr[k]))
        V = np.array(V); acc = (F - (1 - fade) * B - ca * V * V - cr * m * 9.81) / m - 9.81 * gr; vm = V + nz(rng, .1, n)
        c = {"t_s": np.arange(n) * dt, "u.engine_N": F, "u.brake_N": B, "x.wheel_kmh": vm * 3.6, "x.grade_pct": 100 * gr, "z.accel_mps2": acc + nz(rng, .08, n), "m.accel_mps2": (F - B) / m - 9.81 * gr}
        return c, {"accel_mps2": [vm ** 2, np.ones(n), B]}
    return dict(log=log, n=[1500, 1100, 1900], channels=["accel_mps2"],
                effects=[E("accel_mps2", "quadratic_drag"), E("accel_mps2", "bias", "coulomb_friction", "viscous_friction"), E("accel_mps2", "coupling")])

# multirotor: rotors drag in proportion to the airspeed, both horizontal axes; predicted a step ahead from the estimator's noisy velocity; the climb is well
@machine
def rotor_drag(rng):
    dt = .02; kx, ky = .32 * near(rng), .5 * near(rng)
    def log(j, n):
        p, r, w = .25 * wave(rng, n, dt, 5, 1.2), .25 * wave(rng, n, dt, 5, 1.2), .8 * wave(rng, n, dt, 8, 2); vx = vy = vz = 0.; X, Y, Z = [], [], []
        for k in range(n):
            X.append(vx); Y.append(vy); Z.append(vz)
            for _ in range(2): vx += dt / 2 * (9.81 * np.tan(p[k]) - kx * vx); vy += dt / 2 * (-9.81 * np.tan(r[k]) - ky * vy); vz += dt / 2 * (w[k] - .6 * vz)
        X, Y, Z = (np.array(a) for a in (X, Y, Z)); xm, ym, zm = X + nz(rng, .01, n), Y + nz(rng, .01, n), Z + nz(rng, .01, n)
        c = {"t_s": np.arange(1, n) * dt, "x.pitch_rad": p[:-1], "x.roll_rad": r[:-1], "x.vx_mps": xm[:-1], "x.vy_mps": ym[:-1], "x.vz_mps": zm[:-1], "x.battery_V": (16 - .8 * np.arange(n) / n + nz(rng, .02, n))[:-1],
             "z.vx_mps": xm[1:], "m.vx_mps": (xm + dt * 9.81 * np.tan(p))[:-1], "z.vy_mps": ym[1:], "m.vy_mps": (ym - dt * 9.81 * np.tan(r))[:-1], "z.vz_mps": zm[1:], "m.vz_mps": (zm + dt * (w - .6 * zm))[:-1]}
        return c, {"vx_mps": [xm[:-1]], "vy_mps": [ym[:-1]], "vz_mps": []}
    return dict(log=log, n=[2600, 2000, 1800], channels=["vx_mps", "vy_mps", "vz_mps"], effects=[E("vx_mps", "viscous_friction", "gain_of_change"), E("vy_mps", "viscous_friction")])

# plate on a heater: what it loses to the room and to a cooled clamp is not predicted; a step ahead from a noisy reading
@machine
def plate(rng):
    dt = 5.; C, hl, hc = 420., 1.6 * near(rng), 2.4 * near(rng)
    def log(j, n):
        P = np.clip(stairs(rng, n, dt, 260, 0, 320), 0, None); room = 20 + 3 * wave(rng, n, dt, 3000, 700); clamp = 12 + 3 * wave(rng, n, dt, 1500, 300); T, TT = 40., []
        for k in range(n):
            TT.append(T)
            for _ in range(3): T += dt / 3 * (P[k] - hl * (T - room[k]) - hc * (T - clamp[k])) / C
        TT = np.array(TT); tm = TT + nz(rng, .04, n)
        c = {"t_s": np.arange(1, n) * dt, "u.heater_W": P[:-1], "x.plate_degC": tm[:-1], "x.room_degC": (room + nz(rng, .05, n))[:-1], "x.clamp_degC": (clamp + nz(rng, .05, n))[:-1], "z.plate_degC": tm[1:], "m.plate_degC": (tm + dt * P / C)[:-1]}
        return c, {"plate_degC": [tm[:-1], room[:-1], clamp[:-1]]}
    return dict(log=log, n=[900, 1200, 800], channels=["plate_degC"], effects=[E("plate_degC", "viscous_friction", "gain", "coupling"), E("plate_degC", "coupling", "bias")])

# hydraulic motor: torque from the pressure difference; its pistons rub, the more the higher the pressure, and churn the oil
@machine
def hydromotor(rng):
    dt = .02; D = 9.5e-6; fc, fp, fv = 3.6 * near(rng), .055 * near(rng), .09 * near(rng)
    def log(j, n):
        w = 55 * wave(rng, n, dt, 10, 2); T = 70 * wave(rng, n, dt, 9, 2); dp = (T + fc * np.tanh(w / .8) + fv * w) / (D - 0 * w); dp = (dp * D + fp * np.abs(dp * D) * np.tanh(w / .8)) / D
        pm, wm = dp / 1e5 + nz(rng, .5, n), w + nz(rng, .3, n); m = D * pm * 1e5; s = np.sign(wm)
        c = {"t_s": np.arange(n) * dt, "x.shaft_rpm": wm * 9.5493, "x.dp_bar": pm, "x.oil_degC": 48 + 4 * wave(rng, n, dt, 200, 60), "z.shaft_Nm": T + nz(rng, .7, n), "m.shaft_Nm": m}
        return c, {"shaft_Nm": [s, s * np.abs(m), wm]}
    return dict(log=log, n=[2000, 1500, 1800], channels=["shaft_Nm"], effects=[E("shaft_Nm", "coulomb_friction"), E("shaft_Nm", "load_friction", "product", "coulomb_friction"), E("shaft_Nm", "viscous_friction")])

# lift: the motor's model knows inertia alone; load against counterweight, guide shoes that rub, and the wind of the shaft
@machine
def counterweight(rng):
    dt = .1; R = .3; fc, fv = 160 * near(rng), 55 * near(rng); balance = 480 * near(rng, .9, 1.1)
    def log(j, n):
        load = np.round(stairs(rng, n, dt, 30, 0, 900) / 5) * 5; v = np.clip(1.9 * wave(rng, n, dt, 22, 8), -1.8, 1.8); v[np.abs(v) < .25] = 0.; a = np.clip(np.gradient(v, dt), -1.2, 1.2)
        F = 2800 * a + (load - balance) * 9.81 + fc * np.sign(v) + fv * v; vm, am = np.where(v == 0, 0, v + nz(rng, .01, n)), a + nz(rng, .02, n)
        c = {"t_s": np.arange(n) * dt, "x.cab_load_kg": load, "x.cab_speed": vm, "x.cab_accel": am, "x.floor": np.round(np.cumsum(v) * dt / 3), "z.motor_Nm": R * F + nz(rng, 12, n), "m.motor_Nm": R * 2800 * am}
        return c, {"motor_Nm": [load, np.ones(n), np.sign(vm), vm]}
    return dict(log=log, n=[1500, 1300, 1700], channels=["motor_Nm"],
                effects=[E("motor_Nm", "coupling"), E("motor_Nm", "bias", "coupling"), E("motor_Nm", "coulomb_friction"), E("motor_Nm", "viscous_friction", "coulomb_friction")])

# pump and pipe: the pump's curve is predicted; the pipe takes the square of the flow off, the far tank stands higher; the motor's power is well
@machine
def pipe(rng):
    dt = 1.; k, head = 9e-4 * near(rng), .35 * near(rng)
    def log(j, n):
        q = np.clip(34 + 15 * wave(rng, n, dt, 120, 25), 4, 80); rpm = 1450 + 90 * wave(rng, n, dt, 90, 20); p = 4.2 * (rpm / 1450) ** 2 - 3e-4 * q * q
        c = {"t_s": np.arange(n) * dt, "x.flow_m3ph": q + nz(rng, .25, n), "x.pump_rpm": rpm + nz(rng, 2, n), "x.water_degC": 14 + 2 * wave(rng, n, dt, 600, 200), "z.outlet_bar": p - k * q * q - head + nz(rng, .03, n), "m.outlet_bar": p,
             "z.power_kW": 2 + .11 * q + nz(rng, .12, n), "m.power_kW": 2 + .11 * q}
        return c, {"outlet_bar": [q * q, np.ones(n)], "power_kW": []}
    return dict(log=log, n=[1300, 1100, 1200], channels=["outlet_bar", "power_kW"], effects=[E("outlet_bar", "quadratic_drag", "product", "unknown"), E("outlet_bar", "bias")])

# spindle that turns one way: its oil drags in proportion to the speed, less as it warms; the seal rubs
@machine
def spindle(rng):
    dt = .5; fv, kt, fc = 4.2e-4 * near(rng), .012 * near(rng), .16 * near(rng)
    def log(j, n):
        w = np.clip(620 + 310 * wave(rng, n, dt, 60, 15), 60, 1500); T = 24 + 26 * (1 - np.exp(-np.arange(n) / (.35 * n))) + 1.5 * wave(rng, n, dt, 120, 40); a = np.gradient(w, dt)
        tau = .004 * a + fc + fv * w * (1 - kt * (T - 20)); wm, am = w + nz(rng, 2, n), a + nz(rng, 2., n)
        c = {"t_s": np.arange(n) * dt, "x.spindle_radps": wm, "x.spindle_radps2": am, "x.bearing_degC": T + nz(rng, .2, n), "x.coolant_degC": 20 + .5 * wave(rng, n, dt, 300, 90), "z.torque_Nm": tau + nz(rng, .02, n), "m.torque_Nm": .004 * am}
        return c, {"torque_Nm": [np.ones(n), wm, wm * T]}
    return dict(log=log, n=[1400, 1200, 1600], channels=["torque_Nm"],
                effects=[E("torque_Nm", "viscous_friction"), E("torque_Nm", "product", "coupling"), E("torque_Nm", "bias", "coulomb_friction")])

# stage: its speed a step ahead from a speed that is the difference of encoder counts; Coulomb and viscous friction are not predicted
@machine
def encoder_stage(rng):
    dt = .01; m = 6.5; fc, fv = 5.5 * near(rng), 14 * near(rng); count = 2e-5
    def log(j, n):
        F = 24 * wave(rng, n, dt, 4, .8); x = v = 0.; X, V = [], []
        for k in range(n):
            X.append(x); V.append(v)
            for _ in range(5): v += dt / 5 * (F[k] - fc * np.tanh(v / .003) - fv * v) / m; x += dt / 5 * v
        X, V = np.array(X), np.array(V); vm = np.gradient(np.round(X / count) * count, dt)
        c = {"t_s": np.arange(1, n) * dt, "u.force_N": F[:-1], "x.position": X[:-1], "x.rate": vm[:-1], "z.rate": vm[1:], "m.rate": (vm + dt * F / m)[:-1]}
        return c, {"rate": [np.sign(vm)[:-1], vm[:-1]]}
    return dict(log=log, n=[2200, 1800, 2600], channels=["rate"], effects=[E("rate", "coulomb_friction"), E("rate", "viscous_friction")])

# diving vehicle: heave acceleration by its thrusters; it is a little light, and the water drags by the square; its depth sensor is well
@machine
def diver(rng):
    dt = .2; m = 42.; b, c2 = 5. * near(rng), 70 * near(rng)
    def log(j, n):
        u = 34 * wave(rng, n, dt, 25, 5); w, W, A = 0., [], []
        for k in range(n):
            W.append(w); A.append((u[k] - b - c2 * w * abs(w)) / m)
            for _ in range(4): w += dt / 4 * (u[k] - b - c2 * w * abs(w)) / m
        W, A = np.array(W), np.array(A); wm = W + nz(rng, .012, n); d = 60 + np.cumsum(W) * dt
        c = {"t_s": np.arange(n) * dt, "u.thruster_N": u, "x.heave_knots": wm / .514444, "x.surge_knots": (.6 + .3 * wave(rng, n, dt, 40, 10)) / .514444, "z.heave_accel": A + nz(rng, .03, n), "m.heave_accel": u / m,
             "z.depth_kPa": 10.05 * d + nz(rng, .8, n), "m.depth_kPa": 10.05 * d}
        return c, {"heave_accel": [wm * np.abs(wm), np.ones(n)], "depth_kPa": []}
    return dict(log=log, n=[1300, 1000, 1500], channels=["heave_accel", "depth_kPa"], effects=[E("heave_accel", "quadratic_drag"), E("heave_accel", "bias")])

# scooter: its yaw command comes late and through a lag, and turns it by a share less; its speed is well
@machine
def scooter(rng):
    dt = .05; tau, late, gain = .22 * near(rng), 3, 1 - .12 * near(rng)
    def log(j, n):
        w = np.clip(.9 * wave(rng, n, dt, 7, 1.5), -1.2, 1.2); v = np.clip(2.2 + .8 * wave(rng, n, dt, 15, 4), .2, 4); y, Y = w[0], []
        for k in range(n): Y.append(y); y += (w[max(0, k - late)] - y) * -np.expm1(-dt / tau)
        Y = np.array(Y)
        c = {"t_s": np.arange(n) * dt, "u.turn_radps": w, "u.speed_mps": v, "x.tilt_deg": 3 * wave(rng, n, dt, 4, .8), "z.turn_radps": gain * Y + nz(rng, .02, n), "m.turn_radps": w, "z.speed_mps": v + nz(rng, .03, n), "m.speed_mps": v}
        return c, {"turn_radps": [w, Y], "speed_mps": []}
    return dict(log=log, n=[1800, 1400, 1600], channels=["turn_radps", "speed_mps"], effects=[E("turn_radps", "lag", "delay"), E("turn_radps", "gain")])

# wrist of an arm that holds a payload nobody told it of: gravity of it, and its inertia; and the gear's friction
@machine
def wrist_payload(rng):
    dt = .01; mg, I, fc = 6. * near(rng), .35 * near(rng), 1.6 * near(rng); ph = rng.uniform(-.4, .4)
    def log(j, n):
        q = 1.3 * wave(rng, n, dt, 6, 1.6); v = np.gradient(q, dt); a = np.gradient(v, dt); vm, am = v + nz(rng, .005, n), a + nz(rng, .06, n)
        c = {"t_s": np.arange(n) * dt, "x.wrist_rad": q, "x.wrist_radps": vm, "x.wrist_radps2": am, "x.tool_degC": 30 + 2 * wave(rng, n, dt, 20, 8), "z.wrist_Nm": .6 * a + mg * np.cos(q + ph) + I * a + fc * np.tanh(v / .01) + nz(rng, .3, n), "m.wrist_Nm": .6 * am}
        return c, {"wrist_Nm": [np.cos(q), np.sin(q), am, np.sign(vm)]}
    return dict(log=log, n=[2000, 1600, 1900], channels=["wrist_Nm"],
                effects=[E("wrist_Nm", "periodic", "slope"), E("wrist_Nm", "gain", "coupling"), E("wrist_Nm", "coulomb_friction")])

# bicycle in a head wind that a vane measures: the air drags by the square of the sum; its tyres roll hard; the rider's mass is another in every log
@machine
def bicycle(rng):
    dt = .5; ca, cr = .19 * near(rng), .006 * near(rng)
    def log(j, n):
        m = 78 + 10 * (j % 3); P = np.clip(210 + 110 * wave(rng, n, dt, 60, 12), 20, 600); wind = 2.2 + 1.6 * wave(rng, n, dt, 80, 20); gr = .015 * wave(rng, n, dt, 120, 30); v, V, A = 7., [], []
        for k in range(n):
            V.append(v)
            for _ in range(5):
                f = P[k] / max(v, 1.5) - ca * (v + wind[k]) * abs(v + wind[k]) - m * 9.81 * (cr + gr[k]); v = max(1., v + dt / 5 * f / m)
        V = np.array(V); F = ca * (V + wind) * np.abs(V + wind) + m * 9.81 * cr; vm, wm = V + nz(rng, .05, n), wind + nz(rng, .15, n)
        c = {"t_s": np.arange(n) * dt, "u.pedal_W": P, "x.road_kmh": vm * 3.6, "x.head_wind_kmh": wm * 3.6, "x.grade": gr, "z.push_N": m * np.gradient(V, dt) + F + m * 9.81 * gr + nz(rng, 1.2, n), "m.push_N": m * (np.gradient(V, dt) + 9.81 * gr)}
        return c, {"push_N": [(vm + wm) * np.abs(vm + wm), np.ones(n)]}
    return dict(log=log, n=[1300, 1500, 1100], channels=["push_N"], effects=[E("push_N", "quadratic_drag"), E("push_N", "bias", "coulomb_friction")])

# converter with nothing wrong: a ripple that its model knows, a current a step ahead from a noisy and coarse reading, and heavy tails
@machine
def converter(rng):
    dt = .002
    def log(j, n):
        u = .5 + .25 * wave(rng, n, dt, 1, .1); ld = stairs(rng, n, dt, .4, 1, 6); i, I = 3., []
        for k in range(n): I.append(i); i += dt * (40 * (48 * u[k] - 24) - 60 * (i - ld[k]))
        I = np.array(I); im = np.round((I + nz(rng, .05, n)) / .05) * .05; v = 24 - .03 * I + .05 * np.sin(2 * np.pi * 50 * np.arange(n) * dt)
        c = {"t_s": np.arange(1, n) * dt, "u.duty": u[:-1], "x.load_A": ld[:-1], "x.current_A": im[:-1], "x.case_degC": (35 + np.cumsum(nz(rng, .01, n)))[:-1], "z.current_A": im[1:], "m.current_A": (im + dt * (40 * (48 * u - 24) - 60 * (im - ld)))[:-1],
             "z.out_V": (v + .01 * rng.standard_t(3, n))[1:], "m.out_V": v[1:]}
        return c, {"current_A": [], "out_V": []}
    return dict(log=log, n=[2000, 1700, 2300], channels=["current_A", "out_V"], effects=[])

def main():
    o = asked(M)
    mac = M[o.family](np.random.default_rng(o.seed * 9973 + 41))
    put(o, mac, [mac["log"](j, n) for j, n in enumerate(mac["n"])], mac["log"](len(mac["n"]), mac["n"][0]))
if __name__ == "__main__": main()
