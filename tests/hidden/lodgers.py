#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""lodgers.py --seed N [--family F] --out DIR --truth FILE: sixteen more machines, most of them after published test beds; needs numpy.

Coupled drives, cascaded tanks, a hysteretic mount (Bouc-Wen), a spring that stiffens (Silverbox), a filter with a limit inside
(Wiener-Hammerstein), greenhouse, tracked vehicle, syringe pump, gimbal with cables, motor with play in its gear, diving glider in pitch,
fermenter, solenoid, ventilation duct, thermometer that warms itself, and a dynamometer with nothing wrong. The truth was declared before any
of them was diagnosed. Shares no code with the engine; of the other drawers the writer and the courses of commands. What each logs, with the
columns of the true form, from which channels.py computes what least squares would leave."""
import numpy as np
from arrivals import near, sd
from neighbours import E, nz, stairs, wave
from newcomers import asked, put

M = {}
def machine(f): M[f.__name__] = f; return f

def lagged(x, tau, dt):
    """Through a first-order lag, from the first value on."""
    y, k = np.empty(len(x)), -np.expm1(-dt / tau); s = x[0]
    for i, a in enumerate(x): y[i] = s; s += k * (a - s)
    return y

# two motors on one belt: the mean of their currents drives it; the bearings' friction is not predicted; a step ahead from a noisy pulse count
@machine
def coupled_drives(rng):
    dt = .02; J = .011; fc, fv = .035 * near(rng), .018 * near(rng); kt = .09
    def log(j, n):
        a, b = 1.2 * wave(rng, n, dt, 5, .9), 1.2 * wave(rng, n, dt, 6, 1.1); w, W = 0., []
        for k in range(n):
            W.append(w)
            for _ in range(8): w += dt / 8 * (kt * (a[k] + b[k]) - fc * np.tanh(w / .02) - fv * w) / J
        W = np.array(W); wm = W + nz(rng, .05, n)
        c = {"t_s": np.arange(1, n) * dt, "u.left_A": a[:-1], "u.right_A": b[:-1], "x.belt_radps": wm[:-1], "x.tension_N": (40 + 3 * wave(rng, n, dt, 9, 2))[:-1], "z.belt_radps": wm[1:],
             "m.belt_radps": (wm + dt * kt * (a + b) / J)[:-1]}
        return c, {"belt_radps": [np.sign(wm)[:-1], wm[:-1]]}
    return dict(log=log, n=[2200, 1800, 2000], channels=["belt_radps"], effects=[E("belt_radps", "coulomb_friction"), E("belt_radps", "viscous_friction")])

# cascaded tanks: what the lower one gains in a row; the model knows what flows in from the upper one, not what flows out by its own head
@machine
def tanks(rng):
    dt = 4.; k1, k2 = .11, .10 * near(rng, .8, 1.2)
    def log(j, n):
        u = np.clip(stairs(rng, n, dt, 200, 1, 9), 0, None); h1, h2, H1, H2 = 5., 6., [], []
        for k in range(n):
            H1.append(h1); H2.append(h2)
            for _ in range(4):
                h1 = np.clip(h1 + dt / 4 * (.055 * u[k] - k1 * np.sqrt(h1)), .05, 30); h2 = np.clip(h2 + dt / 4 * (k1 * np.sqrt(h1) - k2 * np.sqrt(h2)), .05, 40)
        H1, H2 = np.array(H1), np.array(H2); a, b = H1 + nz(rng, .02, n), H2 + nz(rng, .02, n)
        c = {"t_s": np.arange(1, n) * dt, "u.pump_V": u[:-1], "x.upper_cm": a[:-1], "x.lower_cm": b[:-1], "z.gain_cm": np.diff(H2) + nz(rng, .03, n - 1), "m.gain_cm": (dt * k1 * np.sqrt(np.clip(a, 0, None)))[:-1]}
        return c, {"gain_cm": [np.sqrt(np.clip(b, 0, None))[:-1]]}
    return dict(log=log, n=[900, 1100, 800], channels=["gain_cm"], effects=[E("gain_cm", "unknown", "coupling", "hinge")])

# mount of wire rope: its force is predicted as a spring; its wires slip, so that part of the force depends on the way it came (Bouc-Wen)
@machine
def wire_mount(rng):
    dt = .005; k, alpha, xy = 9000., 240 * near(rng), 1.2e-3 * near(rng)
    def log(j, n):
        x = 9e-3 * wave(rng, n, dt, 2.5, .4); v = np.gradient(x, dt); s, S = 0., []
        for i in range(n):
            S.append(s)
            for _ in range(4): s += dt / 4 * (v[i] / xy - .5 / xy * abs(v[i]) * s - .5 / xy * v[i] * abs(s))
        S = np.array(S)
        c = {"t_s": np.arange(n) * dt, "x.stroke_m": x + nz(rng, 2e-5, n), "x.stroke_mps": v + nz(rng, 2e-3, n), "x.mount_degC": 22 + np.cumsum(nz(rng, .01, n)), "z.force_N": k * x + alpha * S + nz(rng, 12, n), "m.force_N": k * x}
        return c, {"force_N": [S]}
    return dict(log=log, n=[2400, 2000, 2200], channels=["force_N"], effects=[E("force_N", "coulomb_friction", "backlash", "hysteresis", "unknown", "lag")])

# oscillator whose spring stiffens with the cube of the deflection and whose damping is not predicted; by its acceleration
@machine
def silver_box(rng):
    dt = .01; k, k3, d = 160., 95 * near(rng), 1.4 * near(rng)
    def log(j, n):
        u = 70 * wave(rng, n, dt, 1.5, .3); x = v = 0.; X, V, A = [], [], []
        for i in range(n):
            X.append(x); V.append(v); A.append(u[i] - k * x - k3 * x ** 3 - d * v)
            for _ in range(8): v += dt / 8 * (u[i] - k * x - k3 * x ** 3 - d * v); x += dt / 8 * v
        X, V, A = map(np.array, (X, V, A)); xm, vm = X + nz(rng, .002, n), V + nz(rng, .03, n)
        c = {"t_s": np.arange(n) * dt, "u.push": u, "x.deflection": xm, "x.speed": vm, "z.accel": A + nz(rng, 1.2, n), "m.accel": u - k * xm}
        return c, {"accel": [xm ** 3, vm]}
    return dict(log=log, n=[2000, 1600, 2400], channels=["accel"], effects=[E("accel", "unknown", "product", "hinge"), E("accel", "viscous_friction")])

# two filters with a limit between them; the simulation has the static gain alone; the second outlet is well
@machine
def limited_filter(rng):
    dt = .02; t1, t2, lim = .25 * near(rng), .12 * near(rng), 1.5 * near(rng, .8, 1.2)
    def log(j, n):
        u = 1.3 * wave(rng, n, dt, 12, 2.5); y = lagged(np.clip(lagged(u, t1, dt), -lim, lim), t2, dt)
        c = {"t_s": np.arange(n) * dt, "u.in_V": u, "x.board_degC": 31 + wave(rng, n, dt, 30, 10), "z.out_V": y + nz(rng, .02, n), "m.out_V": u, "z.monitor_V": .5 * u + nz(rng, .02, n), "m.monitor_V": .5 * u}
        return c, {"out_V": [y - u], "monitor_V": []}
    return dict(log=log, n=[2200, 1900, 2400], channels=["out_V", "monitor_V"], effects=[E("out_V", "lag", "delay"), E("out_V", "saturation", "hinge", "saturation_before")])

# greenhouse: its air by the heater alone; the sun through the glass and what goes out through it are not predicted; its moisture is well
@machine
def greenhouse(rng):
    dt = 60.; C, g, h = 3.2e5, 9. * near(rng), 62 * near(rng)
    def log(j, n):
        t = np.arange(n) * dt; sun = np.clip(520 * np.sin(2 * np.pi * t / 86400 + rng.uniform(-1, 1)) + 160 * wave(rng, n, dt, 20000, 2500), 0, None); out = 8 + 6 * np.sin(2 * np.pi * t / 86400 - .9) + 1.5 * wave(rng, n, dt, 40000, 9000)
        heat = np.clip(stairs(rng, n, dt, 5400, -1500, 4000), 0, None); T, TT = 17., []
        for k in range(n): TT.append(T); T += dt * (heat[k] + g * sun[k] - h * (T - out[k])) / C
        TT = np.array(TT); tm = TT + nz(rng, .02, n)
        c = {"t_s": t[:-1], "u.heater_W": heat[:-1], "x.sun_Wpm2": (sun + nz(rng, 8, n))[:-1], "x.outside_degC": (out + nz(rng, .05, n))[:-1], "x.air_degC": tm[:-1], "z.air_degC": tm[1:], "m.air_degC": (tm + dt * heat / C)[:-1],
             "z.moist_pct": (70 - .8 * (TT - 17) + nz(rng, .6, n))[1:], "m.moist_pct": (70 - .8 * (TT - 17))[1:]}
        return c, {"air_degC": [sun[:-1], tm[:-1], out[:-1]], "moist_pct": []}
    return dict(log=log, n=[1500, 1800, 1400], channels=["air_degC", "moist_pct"], effects=[E("air_degC", "coupling"), E("air_degC", "coupling", "viscous_friction", "gain")])

# tracked vehicle: its turn by the difference of its tracks; they skid, by a share that grows with the speed; its speed along is well
@machine
def tracks(rng):
    dt = .1; B = 1.4; chi, s = .78 * near(rng, .9, 1.1), .09 * near(rng)
    def log(j, n):
        v = np.clip(1.6 + .9 * wave(rng, n, dt, 25, 5), .1, 4); w = .5 * wave(rng, n, dt, 12, 2); l, r = v - B / 2 * w, v + B / 2 * w
        c = {"t_s": np.arange(n) * dt, "u.left_track_mps": l, "u.right_track_mps": r, "x.pitch_rad": .05 * wave(rng, n, dt, 20, 4), "x.speed_mps": v, "z.yaw_radps": w * chi * (1 - s * v) + nz(rng, .012, n), "m.yaw_radps": w, "z.along_mps": v + nz(rng, .04, n), "m.along_mps": v}
        return c, {"yaw_radps": [w, w * v], "along_mps": []}
    return dict(log=log, n=[1600, 1300, 1500], channels=["yaw_radps", "along_mps"], effects=[E("yaw_radps", "gain", "product"), E("yaw_radps", "product", "gain")])

# syringe pump: its line gives, so that the flow follows the plunger slowly, and its seal leaks by the pressure at the outlet
@machine
def syringe(rng):
    dt = .5; tau, leak = 4.5 * near(rng), .012 * near(rng)
    def log(j, n):
        u = np.clip(stairs(rng, n, dt, 40, -2, 12), 0, None); p = np.clip(30 + 18 * wave(rng, n, dt, 90, 20), 0, None)
        c = {"t_s": np.arange(n) * dt, "u.plunger_mLpmin": u, "x.outlet_kPa": p + nz(rng, .4, n), "x.room_degC": 22 + .4 * wave(rng, n, dt, 500, 100), "z.flow_mLpmin": lagged(u, tau, dt) - leak * p + nz(rng, .08, n), "m.flow_mLpmin": u}
        return c, {"flow_mLpmin": [lagged(u, tau, dt) - u, p]}
    return dict(log=log, n=[1200, 1000, 1400], channels=["flow_mLpmin"], effects=[E("flow_mLpmin", "lag", "delay"), E("flow_mLpmin", "coupling")])

# gimbal: the torque of its motor by inertia; cables pull it back to the middle, its bearing rubs; the other axis is well
@machine
def cable_gimbal(rng):
    dt = .004; J, k, q0, fc = .012, .35 * near(rng), .3 * rng.uniform(-1, 1), .03 * near(rng)
    def log(j, n):
        q = .7 * wave(rng, n, dt, 4, .8); v = np.gradient(q, dt); a = np.gradient(v, dt); p = .01 * wave(rng, n, dt, 3, .5); am = a + nz(rng, .5, n); vm = v + nz(rng, .01, n)
        c = {"t_s": np.arange(n) * dt, "x.pan_rad": q, "x.pan_radps": vm, "x.pan_radps2": am, "z.pan_Nm": J * a + k * (q - q0) + fc * np.tanh(v / .01) + nz(rng, .012, n), "m.pan_Nm": J * am, "z.tilt_Nm": p + nz(rng, .004, n), "m.tilt_Nm": p}
        return c, {"pan_Nm": [q, np.ones(n), np.sign(vm)], "tilt_Nm": []}
    return dict(log=log, n=[2400, 2100, 2500], channels=["pan_Nm", "tilt_Nm"], effects=[E("pan_Nm", "coupling", "slope", "periodic"), E("pan_Nm", "bias", "coupling"), E("pan_Nm", "coulomb_friction")])

# motor with play in its gear: the load's angle from the motor's; the motor's current is well
@machine
def loose_gear(rng):
    dt = .01; play = .03 * near(rng)
    def log(j, n):
        q = .5 * wave(rng, n, dt, 4, .7); y, Y = q[0], []
        for a in q: y = min(max(y, a - play / 2), a + play / 2); Y.append(y)
        i = 1.8 * wave(rng, n, dt, 5, .8)
        c = {"t_s": np.arange(n) * dt, "u.armature_A": i, "x.motor_degC": 40 + np.cumsum(nz(rng, .01, n)), "z.load_rad": np.array(Y) + nz(rng, 8e-4, n), "m.load_rad": q, "z.current_A": i + nz(rng, .05, n), "m.current_A": i}
        return c, {"load_rad": [np.array(Y) - q], "current_A": []}
    return dict(log=log, n=[2000, 1700, 2200], channels=["load_rad", "current_A"], effects=[E("load_rad", "backlash")])

# diving glider in pitch: its moment by the shifted mass; that it hangs below its centre of buoyancy rights it, and the water damps it by the square
@machine
def sea_glider(rng):
    dt = .5; a, b = .11 * near(rng), 2.2 * near(rng)
    def log(j, n):
        u = .06 * wave(rng, n, dt, 60, 12); q = w = 0.; Q, W, A = [], [], []
        for k in range(n):
            Q.append(q); W.append(w); A.append(u[k] - a * np.sin(q) - b * w * abs(w))
            for _ in range(6): w += dt / 6 * (u[k] - a * np.sin(q) - b * w * abs(w)); q += dt / 6 * w
        Q, W, A = map(np.array, (Q, W, A)); wm = W + nz(rng, .001, n)
        c = {"t_s": np.arange(n) * dt, "u.mass_shift": u, "x.pitch_rad": Q + nz(rng, .003, n), "x.pitch_radps": wm, "x.depth_m": 80 + np.cumsum(.2 * np.sin(Q)), "z.pitch_radps2": A + nz(rng, .002, n), "m.pitch_radps2": u}
        return c, {"pitch_radps2": [np.sin(Q), wm * np.abs(wm)]}
    return dict(log=log, n=[1500, 1300, 1600], channels=["pitch_radps2"], effects=[E("pitch_radps2", "slope", "periodic", "coupling"), E("pitch_radps2", "quadratic_drag", "viscous_friction")])

# fermenter: what its cells gain in a row, in proportion to them; that they starve where the sugar is low is not predicted
@machine
def fermenter(rng):
    dt = 300.; mu, K = 9e-5, 1.1 * near(rng)
    def log(j, n):
        S = np.clip(2.4 + 2 * wave(rng, n, dt, 40000, 9000), .02, None); X = np.clip(6 + 2.5 * wave(rng, n, dt, 60000, 15000), .5, None); g = dt * mu * X
        c = {"t_s": np.arange(n) * dt, "x.cells_gpL": X, "x.sugar_gpL": S + nz(rng, .01, n), "x.broth_degC": 30 + .3 * wave(rng, n, dt, 30000, 5000), "z.growth_gpL": g * S / (K + S) + nz(rng, .004, n), "m.growth_gpL": g}
        return c, {"growth_gpL": [g * S / (K + S) - g]}
    return dict(log=log, n=[1100, 900, 1200], channels=["growth_gpL"], effects=[E("growth_gpL", "product", "unknown", "gain")])

# solenoid: its pull by the square of the current; that it falls with the square of the gap is not predicted, only its value at a middle gap
@machine
def solenoid(rng):
    dt = .005; k, g0 = 3.2, 1.6 * near(rng, .8, 1.2)
    def log(j, n):
        i = np.clip(1.6 + .8 * wave(rng, n, dt, 2, .4), 0, 4); gap = np.clip(2 + 1. * wave(rng, n, dt, 3, .6), .1, None); ref = k * i ** 2 / (1 + 2 / g0) ** 2
        c = {"t_s": np.arange(n) * dt, "u.coil_A": i, "x.gap_mm": gap + nz(rng, .01, n), "x.coil_degC": 55 + np.cumsum(nz(rng, .02, n)), "z.pull_N": k * i ** 2 / (1 + gap / g0) ** 2 + nz(rng, .04, n), "m.pull_N": ref}
        return c, {"pull_N": [k * i ** 2 / (1 + gap / g0) ** 2 - ref]}
    return dict(log=log, n=[2000, 1600, 1900], channels=["pull_N"], effects=[E("pull_N", "product", "unknown", "gain")])

# ventilation duct: the fan's pressure by its speed; bends take the square of the flow off, and the filter clogs from log to log and within one
@machine
def duct(rng):
    dt = 2.; b, cl = 4.5e-5 * near(rng), 9e-3 * near(rng)
    def log(j, n):
        rpm = 1200 + 350 * wave(rng, n, dt, 240, 40); q = np.clip(900 + 420 * wave(rng, n, dt, 300, 50), 50, None); t = np.arange(n) * dt
        c = {"t_s": t, "u.fan_rpm": rpm, "x.flow_m3ph": q + nz(rng, 5, n), "x.air_degC": 21 + 2 * wave(rng, n, dt, 2000, 500), "z.rise_Pa": 2.2e-4 * rpm ** 2 - b * q ** 2 - cl * t + nz(rng, 2.5, n), "m.rise_Pa": 2.2e-4 * rpm ** 2}
        return c, {"rise_Pa": [q ** 2, t]}
    return dict(log=log, n=[1300, 1100, 1500], channels=["rise_Pa"], effects=[E("rise_Pa", "product", "unknown", "quadratic_drag"), E("rise_Pa", "drift")])

# thermometer in a bath: it follows slowly, and its own current warms it by the square; the bath's level is well
@machine
def thermometer(rng):
    dt = 1.; tau, r = 14 * near(rng), .35 * near(rng)
    def log(j, n):
        T = 40 + 9 * wave(rng, n, dt, 260, 60); i = np.clip(stairs(rng, n, dt, 80, .2, 3), 0, None); lv = 300 + 4 * wave(rng, n, dt, 90, 20)
        c = {"t_s": np.arange(n) * dt, "u.probe_mA": i, "x.stirrer_rpm": 120 + 5 * wave(rng, n, dt, 60, 15), "z.probe_degC": lagged(T, tau, dt) + r * i ** 2 + nz(rng, .12, n), "m.probe_degC": T, "z.level_mm": lv + nz(rng, .5, n), "m.level_mm": lv}
        return c, {"probe_degC": [lagged(T, tau, dt) - T, i ** 2], "level_mm": []}
    return dict(log=log, n=[1500, 1300, 1600], channels=["probe_degC", "level_mm"], effects=[E("probe_degC", "lag", "delay"), E("probe_degC", "product", "unknown")])

# dynamometer with nothing wrong: a speed a step ahead from a coarse reading, a torque with slow noise of its own, features that wander by chance
@machine
def dynamometer(rng):
    dt = .02
    def log(j, n):
        u = 20 * wave(rng, n, dt, 5, 1); ld = np.abs(stairs(rng, n, dt, 6, 0, 15)); w, W = 0., []
        for k in range(n): W.append(w); w += dt * (u[k] - .6 * w - .1 * ld[k] * np.tanh(w)) / .9
        W = np.array(W); wm = np.round((W + nz(rng, .05, n)) / .1) * .1; e = lagged(nz(rng, 1.5, n), .2, dt)
        c = {"t_s": np.arange(1, n) * dt, "u.drive_Nm": u[:-1], "x.load_Nm": ld[:-1], "x.speed_radps": wm[:-1], "x.oil_degC": (50 + np.cumsum(nz(rng, .03, n)))[:-1], "x.hall_pct": (40 + np.cumsum(nz(rng, .1, n)))[:-1], "z.speed_radps": wm[1:],
             "m.speed_radps": (wm + dt * (u - .6 * wm - .1 * ld * np.tanh(wm)) / .9)[:-1], "z.cell_Nm": (u + e)[1:], "m.cell_Nm": u[1:]}
        return sd(c, cell_Nm=.34), {"speed_radps": [], "cell_Nm": []}
    return dict(log=log, n=[2000, 1800, 1600], channels=["speed_radps", "cell_Nm"], effects=[])

def main():
    o = asked(M)
    mac = M[o.family](np.random.default_rng(o.seed * 6271 + 29))
    put(o, mac, [mac["log"](j, n) for j, n in enumerate(mac["n"])], mac["log"](len(mac["n"]), mac["n"][0]))
if __name__ == "__main__": main()
