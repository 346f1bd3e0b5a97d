#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""boarders.py --seed N [--family F] --out DIR --truth FILE: twenty-one more machines; needs numpy.

Aeroplane in pitch, tyre that lets go, underwater vehicle that turns, drone in a wind, inertial unit off the axis, orifice, compass, pump that
cavitates, two-link arm, fuel cell, machine tool's axis, forklift with a load of its own in every log, satellite that librates, piezo stage, rolling
mill's gauge, hub motor, railcar in curves, weir, arm whose joint gives, and two with nothing wrong: a loop that is closed and a scale. The truth
was declared before any of them was diagnosed. Shares no code with the engine; of the other drawers the writer and the courses of commands. What
each logs, with the columns of the true form, from which channels.py computes what least squares would leave."""
import numpy as np
from arrivals import near, sd
from lodgers import lagged
from neighbours import E, nz, stairs, wave
from newcomers import asked, put

M = {}
def machine(f): M[f.__name__] = f; return f

# aeroplane in pitch: the elevator's moment by the dynamic pressure is predicted; that the tail rights it, and damps, is not
@machine
def pitching(rng):
    dt = .02; ma, mq, me = .011 * near(rng), .032 * near(rng), .02
    def log(j, n):
        V = np.clip(28 + 5 * wave(rng, n, dt, 30, 6), 14, 45); e = .1 * wave(rng, n, dt, 5, .8); a = q = 0.; A, Q, D = [], [], []
        for k in range(n):
            A.append(a); Q.append(q); D.append(me * V[k] ** 2 * e[k] - ma * V[k] ** 2 * a - mq * V[k] * q)
            for _ in range(5): q += dt / 5 * (me * V[k] ** 2 * e[k] - ma * V[k] ** 2 * a - mq * V[k] * q); a += dt / 5 * (q - .09 * V[k] * a)
        A, Q, D = map(np.array, (A, Q, D)); am, qm, Vm = A + nz(rng, .002, n), Q + nz(rng, .004, n), V + nz(rng, .2, n)
        c = {"t_s": np.arange(n) * dt, "u.elevator_rad": e, "x.airspeed_mps": Vm, "x.alpha_rad": am, "x.pitch_radps": qm, "x.fuel_pct": 80 - .002 * np.arange(n), "z.pitch_radps2": D + nz(rng, .05, n), "m.pitch_radps2": me * Vm ** 2 * e}
        return c, {"pitch_radps2": [-Vm ** 2 * am, -Vm * qm]}
    return dict(log=log, n=[1800, 1500, 2100], channels=["pitch_radps2"],
                effects=[E("pitch_radps2", "unknown", "product", "coupling", "slope"), E("pitch_radps2", "viscous_friction", "product")])

# tyre on a rig: its side force is predicted in proportion to the slip angle; it lets go, at an angle that does not depend on the load's small changes
@machine
def letting_go(rng):
    dt = .02; C, B = 1150., .16 * near(rng, .8, 1.25)
    def log(j, n):
        s = 6.5 * wave(rng, n, dt, 5, 1); N = 4.2 + .25 * wave(rng, n, dt, 9, 2); F = C * np.sin(1.4 * np.arctan(B * s)) / (1.4 * B)
        c = {"t_s": np.arange(n) * dt, "u.slip_deg": s, "x.load_kN": N + nz(rng, .02, n), "x.tread_degC": 45 + 9 * wave(rng, n, dt, 40, 12), "z.side_N": F + nz(rng, 90, n), "m.side_N": C * s,
             "z.rolling_N": 40 * N + nz(rng, 3, n), "m.rolling_N": 40 * N}
        return c, {"side_N": [F - C * s], "rolling_N": []}
    return dict(log=log, n=[1600, 1500, 1300], channels=["side_N", "rolling_N"], effects=[E("side_N", "saturation", "unknown", "hinge", "product")])

# underwater vehicle: its turn rate a step ahead from a noisy reading; water turns with it (more inertia than is known) and drags by the square
@machine
def turning_rov(rng):
    dt = .1; I, Ia, d = 9., 5.5 * near(rng), 14 * near(rng)
    def log(j, n):
        u = 7 * wave(rng, n, dt, 18, 4); w, W = 0., []
        for k in range(n):
            W.append(w)
            for _ in range(4): w += dt / 4 * (u[k] - d * w * abs(w)) / (I + Ia)
        W = np.array(W); wm = W + nz(rng, .006, n)
        c = {"t_s": np.arange(1, n) * dt, "u.yaw_Nm": u[:-1], "x.yaw_radps": wm[:-1], "x.depth_m": (22 + 3 * wave(rng, n, dt, 60, 15))[:-1], "z.yaw_radps": wm[1:], "m.yaw_radps": (wm + dt * u / I)[:-1]}
        return c, {"yaw_radps": [u[:-1], (wm * np.abs(wm))[:-1]]}
    return dict(log=log, n=[1800, 1500, 1600], channels=["yaw_radps"], effects=[E("yaw_radps", "gain", "coupling"), E("yaw_radps", "quadratic_drag", "viscous_friction")])

# drone in a steady wind: its speed over ground along its nose is predicted as its airspeed; the climb is well
@machine
def windy(rng):
    dt = .2; W, d = 3.4 * near(rng), rng.uniform(-3.1, 3.1)
    def log(j, n):
        V = 12 + 2 * wave(rng, n, dt, 40, 8); h = np.cumsum(.35 * wave(rng, n, dt, 30, 6)) * dt + rng.uniform(-3, 3); cl = 1.2 * wave(rng, n, dt, 20, 5); hw = (h + np.pi) % (2 * np.pi) - np.pi
        c = {"t_s": np.arange(n) * dt, "x.airspeed_mps": V, "x.heading_rad": hw + nz(rng, .01, n), "x.battery_V": 15.8 - 1.2 * np.arange(n) / n, "z.along_mps": V + W * np.cos(h - d) + nz(rng, .35, n), "m.along_mps": V,
             "z.climb_mps": cl + nz(rng, .1, n), "m.climb_mps": cl}
        return c, {"along_mps": [np.cos(h), np.sin(h)], "climb_mps": []}
    return dict(log=log, n=[1500, 1200, 1700], channels=["along_mps", "climb_mps"], effects=[E("along_mps", "slope", "periodic")])

# inertial unit that stands off the axis of turning: it feels the square of the turn rate, and its change; the other axis feels that change alone
@machine
def off_axis(rng):
    dt = .01; r, s = .22 * near(rng), .13 * near(rng)
    def log(j, n):
        w = 2.6 * wave(rng, n, dt, 4, .8); a = np.gradient(w, dt); ax, ay = 1.5 * wave(rng, n, dt, 5, 1), 1.5 * wave(rng, n, dt, 6, 1); wm, am = w + nz(rng, .01, n), a + nz(rng, .1, n)
        c = {"t_s": np.arange(n) * dt, "x.turn_radps": wm, "x.turn_radps2": am, "x.unit_degC": 35 + np.cumsum(nz(rng, .01, n)), "z.ax_mps2": ax - r * w ** 2 + s * a + nz(rng, .08, n), "m.ax_mps2": ax,
             "z.ay_mps2": ay + r * a + nz(rng, .08, n), "m.ay_mps2": ay}
        return c, {"ax_mps2": [wm ** 2, am], "ay_mps2": [am]}
    return dict(log=log, n=[2000, 1800, 2200], channels=["ax_mps2", "ay_mps2"],
                effects=[E("ax_mps2", "product", "unknown", "quadratic_drag"), E("ax_mps2", "coupling"), E("ay_mps2", "coupling")])

# orifice: the flow by the valve's opening at a pressure that is taken for constant; it goes with the root of what there is
@machine
def orifice(rng):
    dt = .1; k, p0 = 3.2, 60 * near(rng, .8, 1.2)
    def log(j, n):
        u = np.clip(.5 + .28 * wave(rng, n, dt, 12, 2.5), .02, 1); p = np.clip(p0 + 26 * wave(rng, n, dt, 16, 4), 4, None); pm = p + nz(rng, .5, n)
        c = {"t_s": np.arange(n) * dt, "u.opening": u, "x.drop_bar": pm, "x.oil_degC": 42 + 3 * wave(rng, n, dt, 100, 30), "z.flow_lpm": k * u * np.sqrt(p) + nz(rng, .25, n), "m.flow_lpm": k * u * np.sqrt(60)}
        return c, {"flow_lpm": [u, u * np.sqrt(pm)]}
    return dict(log=log, n=[1500, 1700, 1300], channels=["flow_lpm"], effects=[E("flow_lpm", "product", "unknown", "gain")])

# compass of a ship: the deviation of its iron, once and twice a turn; the log's speed is well
@machine
def compass(rng):
    dt = 1.; b, c1, d2 = 2.2 * near(rng) * rng.choice([-1, 1]), 1.5 * near(rng), 1.3 * near(rng)
    def log(j, n):
        h = rng.uniform(0, 360) + np.cumsum(1.6 * wave(rng, n, dt, 120, 25)) * dt; a = np.radians(h); v = 5 + wave(rng, n, dt, 100, 20)
        dev = b * np.sin(a) + c1 * np.cos(a) + d2 * np.sin(2 * a)
        c = {"t_s": np.arange(n) * dt, "x.heading_rad": (a + np.pi) % (2 * np.pi) - np.pi, "x.roll_deg": 4 * wave(rng, n, dt, 12, 5), "x.turn_degps": np.gradient(h, dt), "z.compass_deg": h + dev + nz(rng, .5, n), "m.compass_deg": h,
             "z.log_mps": v + nz(rng, .08, n), "m.log_mps": v}
        return c, {"compass_deg": [np.sin(a), np.cos(a), np.sin(2 * a)], "log_mps": []}
    return dict(log=log, n=[1400, 1200, 1500], channels=["compass_deg", "log_mps"], effects=[E("compass_deg", "slope", "periodic"), E("compass_deg", "periodic")])

# pump that cavitates: its head falls where the suction is below a level, and nowhere else; its power is well
@machine
def cavitating(rng):
    dt = .5; lv, k = 38 * near(rng, .85, 1.15), .32 * near(rng)
    def log(j, n):
        q = np.clip(40 + 14 * wave(rng, n, dt, 60, 10), 5, 80); s = 52 + 17 * wave(rng, n, dt, 45, 9); m = 78 - .006 * q ** 2
        c = {"t_s": np.arange(n) * dt, "x.flow_m3ph": q + nz(rng, .3, n), "x.suction_kPa": s + nz(rng, .4, n), "x.water_degC": 18 + 1.5 * wave(rng, n, dt, 300, 100), "z.head_m": m - k * np.maximum(0, lv - s) + nz(rng, .6, n), "m.head_m": m,
             "z.power_kW": 6 + .2 * q + nz(rng, .2, n), "m.power_kW": 6 + .2 * q}
        return c, {"head_m": [np.maximum(0, lv - s)], "power_kW": []}
    return dict(log=log, n=[1500, 1300, 1600], channels=["head_m", "power_kW"], effects=[E("head_m", "hinge", "unknown")])

# two-link arm: the inertia of each joint is predicted, not what the links' speeds do to each other; both gears rub
@machine
def two_links(rng):
    dt = .01; h, f1, f2, v1 = 2.4 * near(rng), 2.6 * near(rng), 1.3 * near(rng), 1.6 * near(rng)
    def log(j, n):
        q1, q2 = 1.2 * wave(rng, n, dt, 6, 1.5), .25 + .75 * wave(rng, n, dt, 5, 1.3); a1, a2 = np.gradient(q1, dt), np.gradient(q2, dt); b1, b2 = np.gradient(a1, dt), np.gradient(a2, dt)
        w1, w2 = a1 + nz(rng, .01, n), a2 + nz(rng, .01, n); m1, m2 = 5 * b1 + 1.2 * b2, 1.2 * b1 + 1.5 * b2; s = h * np.sin(q2)
        c = {"t_s": np.arange(n) * dt, "x.q1_rad": q1, "x.q2_rad": q2, "x.q1_radps": w1, "x.q2_radps": w2, "z.tau1_Nm": m1 - s * (2 * a1 * a2 + a2 ** 2) + f1 * np.tanh(a1 / .02) + v1 * a1 + nz(rng, .5, n), "m.tau1_Nm": m1,
             "z.tau2_Nm": m2 + s * a1 ** 2 + f2 * np.tanh(a2 / .02) + nz(rng, .3, n), "m.tau2_Nm": m2}
        return c, {"tau1_Nm": [s * (2 * w1 * w2 + w2 ** 2), np.sign(w1), w1], "tau2_Nm": [s * w1 ** 2, np.sign(w2)]}
    return dict(log=log, n=[2200, 1900, 2400], channels=["tau1_Nm", "tau2_Nm"],
                effects=[E("tau1_Nm", "coulomb_friction"), E("tau1_Nm", "viscous_friction"), E("tau1_Nm", "product", "unknown"), E("tau2_Nm", "coulomb_friction"), E("tau2_Nm", "product", "unknown")])

# fuel cell: its voltage at no current is predicted; what reaction and resistance take, by the logarithm and in proportion, is not
@machine
def fuel_cell(rng):
    dt = 1.; A, R = 1.9 * near(rng), .055 * near(rng)
    def log(j, n):
        i = np.clip(55 + 36 * wave(rng, n, dt, 60, 12), 1.5, 160); V = 46 + .4 * wave(rng, n, dt, 400, 80)
        c = {"t_s": np.arange(n) * dt, "u.load_A": i, "x.stack_degC": 64 + 2 * wave(rng, n, dt, 300, 90), "x.air_bar": 1.4 + .1 * wave(rng, n, dt, 50, 12), "z.stack_V": V - A * np.log(i / .8) - R * i + nz(rng, .15, n), "m.stack_V": V}
        return c, {"stack_V": [np.log(i), np.ones(n), i]}
    return dict(log=log, n=[1300, 1500, 1200], channels=["stack_V"], effects=[E("stack_V", "unknown", "coupling", "hinge", "bias")])

# axis of a machine tool: its screw grows as it warms, by a share of the place; its nut has play; the other axis is well
@machine
def screw_axis(rng):
    dt = .1; g, play = .011 * near(rng), 14 * near(rng)
    def log(j, n):
        x = 240 + 160 * wave(rng, n, dt, 20, 5); T = 21 + 9 * (1 - np.exp(-np.arange(n) / (.4 * n))); e, s = [], x[0]
        for a in x * 1e3: s = min(max(s, a - play / 2), a + play / 2) if e else a; e.append(s - a)
        e = np.array(e); y = 90 * wave(rng, n, dt, 15, 4)
        c = {"t_s": np.arange(n) * dt, "u.feed_mmps": np.gradient(x, dt), "x.place_mm": x, "x.screw_degC": T + nz(rng, .05, n), "z.error_um": g * x * (T - 20) + e + nz(rng, 2, n), "m.error_um": 0 * x,
             "z.cross_mm": y + nz(rng, .004, n), "m.cross_mm": y}
        return c, {"error_um": [x * T, x, np.sign(np.gradient(x))], "cross_mm": []}
    return dict(log=log, n=[1600, 1400, 1700], channels=["error_um", "cross_mm"], effects=[E("error_um", "product", "coupling"), E("error_um", "coulomb_friction", "backlash", "hysteresis", "unknown")])

# forklift: its acceleration by the mass of the empty truck; it carries another load in every log, its wheels roll hard on both ways
@machine
def forklift(rng):
    dt = .05; load = rng.uniform(.12, .55, 4); cr = .14 * near(rng)
    def log(j, n):
        F = 1.1 * wave(rng, n, dt, 8, 1.6); k = 1 / (1 + load[j % 4]); v, V, A = 0., [], []
        for i in range(n):
            V.append(v); A.append(k * F[i] - cr * np.tanh(v / .02))
            for _ in range(8): v += dt / 8 * (k * F[i] - cr * np.tanh(v / .02))
        V, A = np.array(V), np.array(A); vm = V + nz(rng, .01, n)
        c = {"t_s": np.arange(n) * dt, "u.drive_kN": 3.2 * F, "x.wheel_mps": vm, "x.mast_m": np.clip(1 + .6 * wave(rng, n, dt, 30, 8), 0, 3), "z.accel_mps2": A + nz(rng, .05, n), "m.accel_mps2": F}
        return c, {"accel_mps2": [F, np.sign(vm)]}
    return dict(log=log, n=[1500, 1300, 1600], channels=["accel_mps2"], effects=[E("accel_mps2", "gain", "coupling"), E("accel_mps2", "coulomb_friction")])

# satellite that librates: the change of its pitch rate by its wheel; the gradient of gravity rights it twice a turn, the sun pushes steadily
@machine
def librating(rng):
    dt = 20.; g, b = 2.6e-6 * near(rng), 5e-7 * near(rng)
    def log(j, n):
        u = 2.5e-6 * wave(rng, n, dt, 2500, 500); a, w, A, D = rng.uniform(-1, 1), 0., [], []
        for k in range(n):
            A.append(a); D.append(u[k] - g * np.sin(2 * a) + b)
            for _ in range(4): w += dt / 4 * (u[k] - g * np.sin(2 * a) + b); a += dt / 4 * w
        A, D = np.array(A), np.array(D)
        c = {"t_s": np.arange(n) * dt, "u.wheel_urps2": 1e6 * u, "x.pitch_rad": (A + np.pi) % (2 * np.pi) - np.pi + nz(rng, .004, n), "x.panel_degC": 30 + 25 * wave(rng, n, dt, 5400, 4000), "z.pitch_urps2": 1e6 * D + nz(rng, .35, n), "m.pitch_urps2": 1e6 * u}
        return c, {"pitch_urps2": [np.sin(2 * A), np.ones(n)]}
    return dict(log=log, n=[1100, 900, 1200], channels=["pitch_urps2"], effects=[E("pitch_urps2", "periodic", "slope", "unknown"), E("pitch_urps2", "bias")])

# piezo stage: its place in proportion to the voltage; its ceramics remember, in plays of many widths; the strain of its frame is well
@machine
def piezo(rng):
    dt = .01; w = .14 * near(rng, .8, 1.25)
    def log(j, n):
        u = 50 + 24 * wave(rng, n, dt, 4, .8); P = np.zeros(n)
        for r in (4., 10., 18., 30.):
            s, S = u[0], []
            for a in u: s = min(max(s, a - r), a + r); S.append(s)
            P += w / 4 * (np.array(S) - u)
        fr = 3 + .05 * u
        c = {"t_s": np.arange(n) * dt, "u.amplifier_V": u, "x.frame_degC": 24 + np.cumsum(nz(rng, .003, n)), "z.place_um": .15 * (u + P) + nz(rng, .02, n), "m.place_um": .15 * u, "z.strain": fr + nz(rng, .05, n), "m.strain": fr}
        return c, {"place_um": [P], "strain": []}
    return dict(log=log, n=[2000, 1700, 1900], channels=["place_um", "strain"], effects=[E("place_um", "backlash", "hysteresis", "lag", "unknown", "delay")])

# rolling mill: its gauge stands a length behind the gap, so that what it reads is late, by less the faster the strip runs; the force is well
@machine
def mill_gauge(rng):
    dt = .05; L = 1.6 * near(rng)
    def log(j, n):
        v = np.clip(3 + 1.2 * wave(rng, n, dt, 25, 6), .6, 6); g = 2 + .08 * wave(rng, n, dt, 6, 1); s = np.cumsum(v) * dt; h = np.interp(s - L, s, g); F = 900 + 60 * wave(rng, n, dt, 5, 1)
        c = {"t_s": np.arange(n) * dt, "u.gap_mm": g, "x.strip_mps": v, "x.coolant_degC": 33 + wave(rng, n, dt, 90, 20), "z.gauge_mm": h + nz(rng, .012, n), "m.gauge_mm": g, "z.force_kN": F + nz(rng, 8, n), "m.force_kN": F}
        return c, {"gauge_mm": [h - g], "force_kN": []}
    return dict(log=log, n=[1600, 1400, 1800], channels=["gauge_mm", "force_kN"], effects=[E("gauge_mm", "delay", "lag")])

# hub motor: the torque that is asked for is predicted; the battery's voltage cannot give it at speed, where the motor's own rises
@machine
def hub_motor(rng):
    dt = .05; T0, w0 = 62 * near(rng, .9, 1.1), 78 * near(rng, .9, 1.1)
    def log(j, n):
        w = np.clip(38 + 19 * wave(rng, n, dt, 15, 3), 1, 76); u = np.clip(24 + 22 * wave(rng, n, dt, 6, 1.2), -45, 75); top = T0 * (1 - w / w0) + 4; y = np.minimum(u, top)
        c = {"t_s": np.arange(n) * dt, "u.asked_Nm": u, "x.wheel_radps": w + nz(rng, .2, n), "x.winding_degC": 60 + 5 * wave(rng, n, dt, 120, 30), "z.hub_Nm": y + nz(rng, .9, n), "m.hub_Nm": u}
        return c, {"hub_Nm": [y - u]}
    return dict(log=log, n=[1700, 1500, 1900], channels=["hub_Nm"], effects=[E("hub_Nm", "saturation", "unknown", "hinge", "product")])

# railcar: the force of its motors is predicted; curves to either side, the air, and its bearings hold it back; it runs one way
@machine
def railcar(rng):
    dt = .5; m = 48e3; cc, ca, c0 = 5200 * near(rng), 7.5 * near(rng), 900 * near(rng)
    def log(j, n):
        k = np.clip(stairs(rng, n, dt, 18, -1.6, 1.6), -1.2, 1.2); k[np.abs(k) < .35] = 0; k = lagged(k, 2., dt); v, V, A, want = 15., [], [], np.clip(16 + 7 * wave(rng, n, dt, 120, 30), 4, 32); F = np.zeros(n)
        for i in range(n):
            F[i] = np.clip(2.6e4 * (want[i] - v) + 3000, -6e4, 6e4); r = c0 + cc * abs(k[i]) + ca * v * v; V.append(v); A.append((F[i] - r) / m); v = max(1, v + dt * A[-1])
        V, A = np.array(V), np.array(A); vm = V + nz(rng, .08, n)
        c = {"t_s": np.arange(n) * dt, "u.motor_kN": F / 1e3, "x.run_kmh": 3.6 * vm, "x.curvature": k + nz(rng, .02, n), "z.accel_mps2": A + nz(rng, .025, n), "m.accel_mps2": F / m}
        return c, {"accel_mps2": [np.abs(k), vm ** 2, np.ones(n)]}
    return dict(log=log, n=[1500, 1300, 1400], channels=["accel_mps2"],
                effects=[E("accel_mps2", "coupling", "product"), E("accel_mps2", "quadratic_drag", "viscous_friction"), E("accel_mps2", "bias", "coulomb_friction")])

# basin behind a weir: what its level gains a row by what flows in; over the weir goes the power of three halves of what stands above its edge
@machine
def weir(rng):
    dt = 10.; k, edge = 2.4e-3 * near(rng), .8 * near(rng, .8, 1.2)
    def log(j, n):
        q = np.clip(.012 * (.55 + .5 * wave(rng, n, dt, 900, 150)), 0, None) * .08; h, H = edge + .1, []
        for i in range(n):
            H.append(h)
            for _ in range(4): h += dt / 4 * (q[i] - k * max(0, h - edge) ** 1.5)
        H = np.array(H); hm = H + nz(rng, .002, n); o = np.maximum(0, H - edge) ** 1.5
        c = {"t_s": np.arange(1, n) * dt, "u.inlet_lps": 1e3 * q[:-1], "x.level_m": hm[:-1], "x.rain_mmph": np.clip(wave(rng, n, dt, 900, 200), 0, None)[:-1], "z.rise_mm": 1e3 * np.diff(H) + nz(rng, .25, n - 1), "m.rise_mm": 1e3 * dt * q[:-1]}
        return c, {"rise_mm": [o[:-1]]}
    return dict(log=log, n=[1300, 1100, 1500], channels=["rise_mm"], effects=[E("rise_mm", "unknown", "hinge", "coupling", "viscous_friction")])

# arm whose joint gives: the place of its tip by its motor's; the load winds it up; the motor's temperature is well
@machine
def giving_arm(rng):
    dt = .02; k = 2.2e-4 * near(rng); c2 = .35 * near(rng)
    def log(j, n):
        q = .9 * wave(rng, n, dt, 6, 1.5); tau = 35 * np.cos(q) + 4 * np.gradient(np.gradient(q, dt), dt) + 6 * wave(rng, n, dt, 5, 1); tm = tau + nz(rng, .8, n); w = k * tau + c2 * k * 1e-3 * tau ** 3 / 3; T = 41 + 4 * wave(rng, n, dt, 60, 15)
        c = {"t_s": np.arange(n) * dt, "x.motor_rad": q, "x.shaft_Nm": tm, "x.room_degC": 20 + wave(rng, n, dt, 80, 30), "z.tip_rad": q - w + nz(rng, 9e-4, n), "m.tip_rad": q, "z.case_degC": T + nz(rng, .2, n), "m.case_degC": T}
        return c, {"tip_rad": [tm, tm ** 3], "case_degC": []}
    return dict(log=log, n=[1700, 1500, 1900], channels=["tip_rad", "case_degC"], effects=[E("tip_rad", "coupling", "unknown", "product")])

# loop with nothing wrong: a speed under control whose command answers its noise, a gust that nobody logs, and a flow in coarse grains
@machine
def closed_loop(rng):
    dt = .05
    def log(j, n):
        want = 4 + 2 * stairs(rng, n, dt, 6, -1, 1); g = lagged(nz(rng, .25, n), .4, dt); v, i, V, Vm, U = 4., 0., [], [], []
        for k in range(n):
            y = v + .04 * rng.standard_normal(); i += dt * (want[k] - y); u = 2.2 * (want[k] - y) + 1.1 * i; V.append(v); Vm.append(y); U.append(u); v += dt * (1.5 * u - .5 * v + g[k])
        V, Vm, U = map(np.array, (V, Vm, U)); q = 12 + 3 * wave(rng, n, dt, 10, 2)
        c = {"t_s": np.arange(1, n) * dt, "u.drive": U[:-1], "u.want_mps": want[:-1], "x.speed_mps": Vm[:-1], "x.oil_degC": (44 + np.cumsum(nz(rng, .02, n)))[:-1], "z.speed_mps": Vm[1:], "m.speed_mps": (Vm + dt * (1.5 * U - .5 * Vm))[:-1],
             "z.flow": (np.round((q + nz(rng, .05, n)) / .2) * .2)[1:], "m.flow": q[1:]}
        return c, {"speed_mps": [], "flow": []}
    return dict(log=log, n=[1700, 1500, 1900], channels=["speed_mps", "flow"], effects=[])

# weighing scale with nothing wrong: noise that beats with the mains, more of it while the belt moves (stated), and a spike now and then
@machine
def scale(rng):
    dt = .1
    def log(j, n):
        b = np.clip(stairs(rng, n, dt, 8, -.6, 1), 0, None); w = 40 + 12 * stairs(rng, n, dt, 3, -1, 1); s = .05 + .12 * b; e = s * rng.standard_normal(n) + np.where(rng.random(n) < .004, 6 * s * rng.standard_normal(n), 0)
        c = {"t_s": np.arange(n) * dt, "u.belt_mps": b, "x.hall_degC": 18 + np.cumsum(nz(rng, .01, n)), "x.hum_pct": 50 + np.cumsum(nz(rng, .05, n)), "z.weight_kg": w + e, "m.weight_kg": w, "sd.weight_kg": s, "z.belt_mps": b + nz(rng, .01, n), "m.belt_mps": b}
        return sd(c, belt_mps=.01), {"weight_kg": [], "belt_mps": []}
    return dict(log=log, n=[1800, 1500, 1600], channels=["weight_kg", "belt_mps"], effects=[])

def main():
    o = asked(M)
    mac = M[o.family](np.random.default_rng(o.seed * 5431 + 17))
    put(o, mac, [mac["log"](j, n) for j, n in enumerate(mac["n"])], mac["log"](len(mac["n"]), mac["n"][0]))
if __name__ == "__main__": main()
