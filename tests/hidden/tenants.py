#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""tenants.py --seed N [--family F] --out DIR --truth FILE: twenty-seven more machines; needs numpy.

Shoulder and wrist of two arms, hatchback along and across, booster, leg of a dog, cable robot, pick-and-place gantry, moment gyro, climate chamber,
lifting screw, catamaran, balance of a wind tunnel, forging press, feed drive, balloon, distillation column, web of paper, loudspeaker, knee of an
exoskeleton, robot that balances, turbofan, vessel that keeps its place, stirrer, endoscope, plough, and two with nothing wrong: a shaker under
control and a mast. Each machine's own physics is integrated by Runge and Kutta in finer steps than are logged. The truth was declared before any of
them was diagnosed. Shares no code with the engine; of the other drawers the writer and the courses of commands. What each logs, with the columns of
the true form, from which channels.py computes what least squares would leave."""
import numpy as np
from arrivals import near, sd
from lodgers import lagged
from neighbours import E, nz, stairs, wave
from newcomers import asked, put

M = {}
def machine(f): M[f.__name__] = f; return f
def rk(f, y, h, k=3):
    """What y' = f(y) is after h, in k steps."""
    d = h / k
    for _ in range(k): a = f(y); b = f(y + d / 2 * a); c = f(y + d / 2 * b); y = y + d / 6 * (a + 2 * b + 2 * c + f(y + d * c))
    return y
def run(f, y, n, dt, k=3):
    """The states of y' = f(i, y) at n rows, the input of row i held over it."""
    y, Y = np.array(y, float), []
    for i in range(n): Y.append(y); y = rk(lambda s, i=i: np.array(f(i, s)), y, dt, k)
    return np.array(Y).T
def red(rng, s, n, rho=.85):
    """Noise of deviation s that remembers."""
    e, y, E1 = rng.standard_normal(n), 0., []
    for a in e: y = rho * y + np.sqrt(1 - rho * rho) * a; E1.append(s * y)
    return np.array(E1)
def grain(x, q): return np.round(x / q) * q
def late(x, s, dt):
    """What x was s seconds before."""
    t = np.arange(len(x)) * dt
    return np.interp(t - s, t, x)
def moves(rng, n, dt, lo, hi, go, rest):
    """Smooth moves (their fifth powers) between places, with rests: place, speed, acceleration."""
    q, v, a, i, at = np.zeros(n), np.zeros(n), np.zeros(n), 0, rng.uniform(lo, hi)
    while i < n:
        T = rng.uniform(.7, 1.5) * go; to = rng.uniform(lo, hi); k = min(n - i, max(2, int(T / dt))); s = np.arange(k) * dt / T; d = to - at
        q[i:i + k], v[i:i + k], a[i:i + k] = at + d * (10 * s ** 3 - 15 * s ** 4 + 6 * s ** 5), d / T * (30 * s ** 2 - 60 * s ** 3 + 30 * s ** 4), d / T ** 2 * (60 * s - 180 * s ** 2 + 120 * s ** 3)
        i += k; r = int(rng.uniform(.4, 1.6) * rest / dt); q[i:i + r] = to; i += r; at = to
    return q, v, a

# shoulder of an arm that moves and rests: rigid bodies are predicted; not the friction of the gear, nor what the hand carries
@machine
def shoulder(rng):
    dt = .01; fc, fv, p = 6.2 * near(rng), 10.5 * near(rng), 2.1 * near(rng)
    def log(j, n):
        q, v, a = moves(rng, n, dt, -1.2, 1.3, 1.4, .4); qm, vm, am = grain(q, 2e-4), v + nz(rng, .004, n), a + nz(rng, .08, n)
        tau = 3.8 * a + 42 * np.cos(q) + p * (.49 * a + 9.81 * .7 * np.cos(q)) + fc * np.tanh(v / .008) + fv * v; m = 3.8 * am + 42 * np.cos(qm)
        c = {"t_s": np.arange(n) * dt, "x.q2_rad": qm, "x.qd2_radps": vm, "x.qdd2_radps2": am, "x.bus_V": 47.6 + red(rng, .15, n), "z.tau2_Nm": tau + red(rng, .8, n, .6), "m.tau2_Nm": m}
        return c, {"tau2_Nm": [np.sign(v), v, np.cos(qm), am]}
    return dict(log=log, n=[2400, 2000, 2600], channels=["tau2_Nm"],
                effects=[E("tau2_Nm", "coulomb_friction"), E("tau2_Nm", "viscous_friction"), E("tau2_Nm", "gain", "periodic", "slope", "unknown", "product")])

# wrist of another arm on a course of sines: friction whose viscous part falls as the grease warms; the joint beside it is predicted well
@machine
def wrist_roll(rng):
    dt = .01; fc, fv = 1.7 * near(rng), 1.5 * near(rng)
    def log(j, n):
        q = 1.1 * wave(rng, n, dt, 6, 1.2); v = np.gradient(q, dt); a = np.gradient(v, dt); T = 24 + 5 * j + 14 * (1 - np.exp(-np.arange(n) / (.7 * n))); p = .8 * wave(rng, n, dt, 5, 1.5); b = np.gradient(np.gradient(p, dt), dt)
        qe = grain(q, 5e-4); vm = lagged(np.gradient(qe, dt), .02, dt); m = .35 * a + 2.8 * np.sin(qe); f = fv * np.exp(-(T - 30) / 22)
        c = {"t_s": np.arange(n) * dt, "x.q4_rad": qe, "x.qd4": v + nz(rng, .015, n), "x.qd4_filtered": vm, "x.case_degC": grain(T, .1), "x.q5": p, "z.tau4": m + fc * np.tanh(v / .02) + f * v + nz(rng, .22, n), "m.tau4": m, "z.tau5": .2 * b + 1.4 * np.cos(p) + red(rng, .1, n), "m.tau5": .2 * b + 1.4 * np.cos(p)}
        return c, {"tau4": [np.sign(v), v, v * T], "tau5": []}
    return dict(log=log, n=[2200, 1900, 2300], channels=["tau4", "tau5"], effects=[E("tau4", "coulomb_friction"), E("tau4", "viscous_friction", "product", "unknown")])

# hatchback: across, the turn rate by the angle that is asked for, without slip of its tyres; along, the acceleration that is asked for
@machine
def hatchback(rng):
    dt = .02; td, ts, tl, tw, g = .09 * near(rng), .10 * near(rng), .22 * near(rng), .28 * near(rng), rng.uniform(.78, .9); Cf = 6.6e4 * near(rng, .85, 1.15); L, a, b, m, Iz, Cr = 2.6, 1.15, 1.45, 1320., 2050., 9e4
    def log(j, n):
        V, A, U, v, act, want, bump = [], [], [], 14., 0., np.clip(15 + 5 * stairs(rng, n, dt, 9, -1.3, 1.6), 7, 26), .8 * stairs(rng, n, dt, 3, -1, 1)
        k = int(tl / dt)
        for i in range(n):
            U.append(np.clip(.45 * (want[i] - v), -3.2, 2.4) + bump[i]); drag = .13 + 5e-4 * v * v; V.append(v); A.append(act - drag)
            act = rk(lambda s: (g * U[max(0, i - k)] - s) / tw, act, dt); v = max(3., v + dt * A[-1])
        V, A, U = map(np.array, (V, A, U)); d = np.clip(.5 / V * (stairs(rng, n, dt, 2, -1.2, 1.2) + wave(rng, n, dt, 5, .9)), -.12, .12); dl = late(d, td, dt)
        def f(i, y):
            w, vy, r = y; F, R = Cf * (w - (vy + a * r) / V[i]), -Cr * (vy - b * r) / V[i]
            return (dl[i] - w) / ts, (F + R) / m - V[i] * r, (a * F - b * R) / Iz
        r = run(f, [0, 0, 0], n, dt)[2]; mr = V * d / L
        c = {"t_s": np.arange(n) * dt, "u.steer_rad": d, "u.accel_mps2": U, "x.speed_mps": V + nz(rng, .05, n), "x.coolant_degC": 88 + red(rng, .6, n, .99), "z.yaw_radps": r + nz(rng, .008, n), "m.yaw_radps": mr, "z.along_mps2": A + red(rng, .13, n, .5), "m.along_mps2": U}
        return c, {"yaw_radps": [r - mr], "along_mps2": [A - U]}
    return dict(log=log, n=[1900, 1700, 2000], channels=["yaw_radps", "along_mps2"], effects=[E("yaw_radps", "lag", "delay"), E("yaw_radps", "gain", "product"), E("along_mps2", "lag", "delay"), E("along_mps2", "gain"), E("along_mps2", "quadratic_drag", "viscous_friction", "bias")])

# booster through the air: its speed a row ahead from what it last read; drag in air that thins is not predicted; the tank's pressure is well
@machine
def booster(rng):
    dt = .1; S = .11 * near(rng); burn = 38.
    def log(j, n):
        u = np.clip(.85 + .12 * stairs(rng, n, dt, 6, -1, 1), .5, 1); t = np.arange(n) * dt; T = 24e3 * u * (t < burn); mass = 1250 - np.cumsum(17.5 * u * (t < burn)) * dt
        def f(i, y): return y[1], T[i] / mass[i] - 9.81 - .5 * 1.225 * np.exp(-y[0] / 7600) * S * y[1] * abs(y[1]) / mass[i]
        h, v = run(f, [rng.uniform(50, 1500), 2.], n, dt); vm, hm = v + nz(rng, .25, n), h + nz(rng, 4, n); p = 31 - 16 * (1 - np.exp(-np.cumsum(u * (t < burn)) * dt / 30))
        c = {"t_s": t[1:], "u.throttle": (u * (t < burn))[:-1], "x.altitude_m": hm[:-1], "x.speed_mps": vm[:-1], "x.mass_kg": mass[:-1], "z.speed_mps": vm[1:], "m.speed_mps": (vm + dt * (T / mass - 9.81))[:-1], "z.tank_bar": (p + red(rng, .08, n))[1:], "m.tank_bar": p[1:]}
        return c, {"speed_mps": [(np.exp(-h / 7600) * v * v / mass)[:-1]], "tank_bar": []}
    return dict(log=log, n=[640, 600, 620], channels=["speed_mps", "tank_bar"], effects=[E("speed_mps", "quadratic_drag")])

# leg of a robot dog that trots at many gaits: links and the foot's force are predicted; not the friction of either gear, nor the knee's rotor
@machine
def dog_leg(rng):
    dt = .004; kc, kv, J, hc, hv = .85 * near(rng), .11 * near(rng), .011 * near(rng), 1.1 * near(rng), .16 * near(rng)
    def log(j, n):
        ph = np.cumsum(2 * np.pi * np.clip(1.7 + .5 * wave(rng, n, dt, 4, 1.5), .8, 2.8)) * dt; A = 1 + .2 * wave(rng, n, dt, 3, 1); F = np.maximum(0, np.sin(ph)) ** .8 * (95 + 15 * wave(rng, n, dt, 3, .8))
        k = -1.3 + .42 * A * np.cos(ph) + .16 * np.sin(2 * ph); h = .7 + .3 * A * np.sin(ph + .6); d = lambda x: np.gradient(x, dt); vk, ak, vh, ah = d(k), d(d(k)), d(h), d(d(h)); vkm, akm, vhm = vk + nz(rng, .06, n), ak + nz(rng, 2, n), vh + nz(rng, .06, n)
        mk, mh = .016 * akm - .17 * F * np.sin(k / 2), .07 * ah + .11 * F * np.sin(h - .5)
        c = {"t_s": np.arange(n) * dt, "x.hip_rad": h, "x.knee_rad": k, "x.hip_radps": vhm, "x.knee_radps": vkm, "x.knee_radps2": akm, "x.foot_N": F + nz(rng, 2, n), "x.pack_V": 25.2 - .3 * np.arange(n) / n + red(rng, .1, n),
             "z.knee_Nm": mk + J * ak + kc * np.tanh(vk / .15) + kv * vk + nz(rng, .25, n), "m.knee_Nm": mk, "z.hip_Nm": mh + hc * np.tanh(vh / .15) + hv * vh + red(rng, .3, n, .5), "m.hip_Nm": mh}
        return c, {"knee_Nm": [np.sign(vkm), vkm, akm], "hip_Nm": [np.sign(vhm), vhm]}
    return dict(log=log, n=[2400, 2100, 2500], channels=["knee_Nm", "hip_Nm"],
                effects=[E("knee_Nm", "coulomb_friction"), E("knee_Nm", "viscous_friction"), E("knee_Nm", "coupling", "gain"), E("hip_Nm", "coulomb_friction"), E("hip_Nm", "viscous_friction")])

# robot on cables: the pull at its winch by the platform's weight and motion; the pulleys take a share of it; the cable gives, by its length
@machine
def cable_robot(rng):
    dt = .02; mu, fv, EA = .075 * near(rng), 9 * near(rng), 5.2e4 * near(rng)
    def log(j, n):
        x, vx, ax = moves(rng, n, dt, -1.1, 1.1, 2.2, .5); y, vy, ay = moves(rng, n, dt, .7, 2., 2.8, .6); l1, l2 = np.hypot(x + 2, y), np.hypot(2 - x, y); s1, s2, h1, h2 = (x + 2) / l1, (2 - x) / l2, y / l1, y / l2
        Fx, Fy = 7.5 * ax, 7.5 * (9.81 - ay); T = (Fy * s2 - Fx * h2) / (h1 * s2 + s1 * h2); v = np.gradient(l1, dt); vm = v + nz(rng, .002, n); T1 = T + mu * T * -np.tanh(v / .005) - fv * v
        c = {"t_s": np.arange(n) * dt, "x.cable_m": l1 + nz(rng, 1e-4, n), "x.cable_mps": vm, "x.platform_m": x, "x.drop_m": y, "x.hall_degC": 19 + red(rng, .2, n, .99), "z.pull_N": T1 + nz(rng, .5, n), "m.pull_N": T,
             "x.cell_N": T + nz(rng, .7, n), "z.paid_mm": 1e3 * (l1 - T * l1 / EA) + nz(rng, .3, n), "m.paid_mm": 1e3 * l1}
        return c, {"pull_N": [T * np.sign(v), v], "paid_mm": [T * l1]}
    return dict(log=log, n=[1900, 1700, 2100], channels=["pull_N", "paid_mm"], effects=[E("pull_N", "load_friction", "coulomb_friction", "product"), E("pull_N", "viscous_friction"), E("paid_mm", "product", "coupling", "gain")])

# gantry on linear motors: the drive's force by mass; rails rub, magnets cog; the bridge skews by what the carriage's place makes of acceleration
@machine
def pick_gantry(rng):
    dt = .005; fc, fv, cg, k = 24 * near(rng), 40 * near(rng), 11 * near(rng), 5.5 * near(rng); o = rng.uniform(0, 6)
    def log(j, n):
        x, v, a = moves(rng, n, dt, 0, .8, .55, .15); y, _, _ = moves(rng, n, dt, -.45, .45, .6, .2); ph = 2 * np.pi * x / .032; vm, am = v + nz(rng, .003, n), a + nz(rng, .1, n)
        c = {"t_s": np.arange(n) * dt, "x.x_m": x, "x.x_mps": vm, "x.x_mps2": am, "x.y_m": y, "x.pole_rad": (ph + np.pi) % (2 * np.pi) - np.pi, "x.air_bar": 6.1 + red(rng, .05, n), "z.drive_N": 38 * a + fc * np.tanh(v / .003) + fv * v + cg * np.sin(ph + o) + nz(rng, 4, n), "m.drive_N": 38 * am,
             "z.skew_um": k * a * y + red(rng, 1.5, n, .7), "m.skew_um": 0 * x}
        return c, {"drive_N": [np.sign(v), v, np.sin(ph), np.cos(ph)], "skew_um": [am * y]}
    return dict(log=log, n=[2400, 2000, 2600], channels=["drive_N", "skew_um"], effects=[E("drive_N", "coulomb_friction"), E("drive_N", "viscous_friction"), E("drive_N", "periodic", "slope"), E("skew_um", "product")])

# moment gyro: the torque of its gimbal by inertia; the spinning wheel against the craft's turn and the bearings are not predicted; its wheel, a row ahead, is not without drag
@machine
def moment_gyro(rng):
    dt = .02; Iw, fc = .011 * near(rng), .11 * near(rng); b0, b1 = .16 * near(rng), 1.1e-3 * near(rng)
    def log(j, n):
        w = .13 * wave(rng, n, dt, 9, 2.5); gd = .5 * wave(rng, n, dt, 5, 1.2); ga = np.gradient(gd, dt); u = np.clip(1.6 * wave(rng, n, dt, 20, 5) + .65, -3, 5)
        W = run(lambda i, y: (30 * u[i] - 30 * b0 - 30 * b1 * y[0],), [420], n, dt)[0]; wm = W + nz(rng, .25, n); h = Iw * W
        c = {"t_s": np.arange(1, n) * dt, "u.wheel_A": u[:-1], "x.wheel_radps": wm[:-1], "x.craft_radps": (w + nz(rng, .002, n))[:-1], "x.gimbal_radps": (gd + nz(rng, .006, n))[:-1], "x.tube_degC": (31 + red(rng, .3, n, .99))[:-1],
             "z.gimbal_Nm": (.09 * ga + h * w + fc * np.tanh(gd / .01) + nz(rng, .04, n))[:-1], "m.gimbal_Nm": (.09 * ga)[:-1], "z.wheel_radps": wm[1:], "m.wheel_radps": (wm + dt * 30 * u)[:-1]}
        return c, {"gimbal_Nm": [(wm * w)[:-1], np.sign(gd[:-1])], "wheel_radps": [wm[:-1], np.ones(n - 1)]}
    return dict(log=log, n=[1900, 1700, 2000], channels=["gimbal_Nm", "wheel_radps"], effects=[E("gimbal_Nm", "product", "coupling"), E("gimbal_Nm", "coulomb_friction"), E("wheel_radps", "viscous_friction", "bias", "coulomb_friction", "quadratic_drag")])

# climate chamber that ramps and soaks: the air a row ahead by its heater; what the walls take is not predicted; the humidity follows what is asked for slowly
@machine
def chamber(rng):
    dt = 10.; k1, tau = 2.2e-3 * near(rng), 95 * near(rng)
    def log(j, n):
        want = lagged(stairs(rng, n, dt, 1500, 0, 75), 300, dt); rh = stairs(rng, n, dt, 1200, 20, 85); lab = 22 + red(rng, .8, n, .995); T = np.array([25., 24.]); i2, A, Wl, U = 0., [], [], []
        for i in range(n):
            e = want[i] - T[0] - .05 * rng.standard_normal(); i2 = np.clip(i2 + dt * e / 900, -20, 20); u = np.clip(8 * e + 4 * i2, -100, 100); A.append(T[0]); Wl.append(T[1]); U.append(u)
            T = rk(lambda s: np.array([6e-4 * u - k1 * (s[0] - s[1]), 1.2e-3 * (s[0] - s[1]) - 4e-4 * (s[1] - lab[i])]), T, dt)
        A, Wl, U = map(np.array, (A, Wl, U)); Am = grain(A + nz(rng, .03, n), .01); H = lagged(rh, tau, dt)
        c = {"t_s": np.arange(1, n) * dt, "u.heat_pct": U[:-1], "x.air_degC": Am[:-1], "x.wall_degC": grain(Wl + nz(rng, .05, n), .1)[:-1], "x.lab_degC": grain(lab, .1)[:-1], "x.door": np.zeros(n - 1), "z.air_degC": Am[1:], "m.air_degC": (Am + dt * 6e-4 * U)[:-1], "z.rh_pct": (H + red(rng, .7, n, .6))[1:], "m.rh_pct": rh[1:]}
        return c, {"air_degC": [(Am - Wl)[:-1]], "rh_pct": [(H - rh)[1:]]}
    return dict(log=log, n=[1400, 1200, 1500], channels=["air_degC", "rh_pct"], effects=[E("air_degC", "coupling", "viscous_friction"), E("rh_pct", "lag", "delay")])

# screw that lifts, another load in every log: the motor's torque by inertia and the empty table; the load, and the nut's friction, are not predicted; the screw grows as it warms
@machine
def lift_screw(rng):
    dt = .01; load = rng.uniform(.5, 1.3, 5); fc, fv, al = .42 * near(rng), .012 * near(rng), 3.6 * near(rng)
    def log(j, n):
        x, v, a = moves(rng, n, dt, 0, .5, 1.1, .3); w = v * 2 * np.pi / .01; wa = a * 2 * np.pi / .01; wm = w + nz(rng, .5, n); T = 33 - 11 * np.exp(-np.arange(n) * dt / 11)
        m = .0021 * wa + .9; g = load[j % 5]
        c = {"t_s": np.arange(n) * dt, "x.screw_radps": wm, "x.height_m": x, "x.nut_degC": grain(T + nz(rng, .05, n), .1), "x.drive_V": 310 + red(rng, 2, n), "z.motor_Nm": m + g + g * 4e-4 * wa + fc * np.tanh(w / .8) + fv * w + nz(rng, .07, n), "m.motor_Nm": m,
             "z.table_um": 1e6 * x + al * (T - 22) + nz(rng, 2.5, n), "m.table_um": 1e6 * x}
        return c, {"motor_Nm": [np.ones(n), np.sign(w), w, wa], "table_um": [T, np.ones(n)]}
    return dict(log=log, n=[1900, 1700, 1800, 1600], channels=["motor_Nm", "table_um"], effects=[E("motor_Nm", "bias", "gain"), E("motor_Nm", "coulomb_friction"), E("motor_Nm", "viscous_friction"), E("table_um", "coupling", "hinge")])

# catamaran without a crew: its way a row ahead by its thrust alone; its turn rate by its steering at once, the way taken for constant
@machine
def catamaran(rng):
    dt = .2; d, K, tr = 17 * near(rng), .42 * near(rng, .8, 1.2), 1.3 * near(rng)
    def log(j, n):
        T = np.clip(45 + 32 * stairs(rng, n, dt, 14, -1.3, 1.3), 0, 110); s = np.clip(.45 * stairs(rng, n, dt, 7, -1, 1) + .2 * wave(rng, n, dt, 12, 3), -.7, .7)
        u, r = run(lambda i, y: ((T[i] - d * y[0] * abs(y[0])) / 62, (K * s[i] * y[0] / 1.7 - y[1]) / tr), [1.4, 0], n, dt); um = u + nz(rng, .012, n)
        c = {"t_s": np.arange(1, n) * dt, "u.thrust_N": T[:-1], "u.steer": s[:-1], "x.surge_mps": um[:-1], "x.water_degC": (14 + red(rng, .2, n, .99))[:-1], "x.roll_rad": red(rng, .04, n, .9)[:-1], "z.surge_mps": um[1:], "m.surge_mps": (um + dt * T / 62)[:-1], "z.turn_radps": (r + red(rng, .012, n, .6))[:-1], "m.turn_radps": (.42 * s)[:-1]}
        return c, {"surge_mps": [(um * np.abs(um))[:-1]], "turn_radps": [(r - .42 * s)[:-1]]}
    return dict(log=log, n=[1700, 1500, 1800], channels=["surge_mps", "turn_radps"], effects=[E("surge_mps", "quadratic_drag"), E("turn_radps", "lag", "delay"), E("turn_radps", "product", "gain")])

# balance of a wind tunnel, pitched and paused: lift in proportion to the angle is predicted, but the wing lets go; the axial force lacks what lift induces; the moment is well
@machine
def tunnel_balance(rng):
    dt = .1; S, a0, ind = .12, np.radians(11.5) * near(rng, .88, 1.12), .055 * near(rng)
    def log(j, n):
        al = np.radians(lagged(stairs(rng, n, dt, 2.5, -5, 17), .5, dt)); q = np.clip(lagged(stairs(rng, n, dt, 14, 250, 950), 2.5, dt), 100, None); x = al - a0; cl = 5.1 * al - 5.6 * np.log1p(np.exp(np.clip(x / .012, -40, 40))) * .012; am, qm = al + nz(rng, 4e-4, n), q + nz(rng, 4, n)
        c = {"t_s": np.arange(n) * dt, "x.alpha_rad": am, "x.dynamic_Pa": qm, "x.tunnel_degC": 24 + np.arange(n) * 2e-3 + red(rng, .1, n), "z.lift_N": q * S * cl + nz(rng, .7, n), "m.lift_N": qm * S * 5.1 * am,
             "z.axial_N": q * S * (.028 + ind * cl ** 2) + nz(rng, .15, n), "m.axial_N": qm * S * .028, "z.moment_Nm": -.02 * q * S + red(rng, .05, n), "m.moment_Nm": -.02 * q * S}
        return c, {"lift_N": [q * S * (cl - 5.1 * al)], "axial_N": [q * cl ** 2], "moment_Nm": []}
    return dict(log=log, n=[1700, 1500, 1800], channels=["lift_N", "axial_N", "moment_Nm"], effects=[E("lift_N", "saturation", "hinge", "unknown", "product"), E("axial_N", "product", "unknown", "coupling", "hinge")])

# forging press: the ram's force by its pressures; seals rub, more under pressure; the gap by its encoder, the frame stretches under force
@machine
def forge_press(rng):
    dt = .01; fc, fp, K = 16 * near(rng), .05 * near(rng), .9e3 * near(rng)
    def log(j, n):
        x, v, a = moves(rng, n, dt, .0, .22, .8, .25); soft = rng.uniform(.09, .15); F = 3.2e3 * np.maximum(0, x - soft) + 12 * a * .4; vm = v + nz(rng, .002, n); fr = (fc + fp * F) * np.tanh(v / .004) + 60 * v; P = F + fr
        back = 18 + 3 * wave(rng, n, dt, 4, 1); p1 = (P + back) / 2.1
        c = {"t_s": np.arange(n) * dt, "x.ram_mps": vm, "x.ram_m": grain(x, 1e-5), "x.p1_bar": p1 + nz(rng, .4, n), "x.p2_bar": back + nz(rng, .3, n), "x.oil_degC": 46 + red(rng, .4, n, .99), "z.ram_kN": F + nz(rng, 2.5, n), "m.ram_kN": P + 0 * x,
             "z.gap_mm": 300 - 1e3 * x + F / K + nz(rng, .02, n), "m.gap_mm": 300 - 1e3 * x}
        return c, {"ram_kN": [np.sign(v), F * np.sign(v), v], "gap_mm": [F]}
    return dict(log=log, n=[1900, 1700, 2100], channels=["ram_kN", "gap_mm"], effects=[E("ram_kN", "coulomb_friction"), E("ram_kN", "load_friction", "product", "viscous_friction", "unknown"), E("gap_mm", "coupling", "hinge", "product")])

# feed drive that cuts pockets: the torque by inertia alone; the screw rubs, the cutter pushes back; the place follows the command by the loop's gain
@machine
def feed_drive(rng):
    dt = .004; fc, fs, fv, kc, kv = 1.3 * near(rng), .5 * near(rng), 3.6 * near(rng), .5 * near(rng), .034 * near(rng)
    def log(j, n):
        q, _, _ = moves(rng, n, dt, 0, .18, .6, .12); q = q + .004 * np.sin(2 * np.pi * np.cumsum(3 + wave(rng, n, dt, 3, 1)) * dt) * (stairs(rng, n, dt, 1.2, -1, 1) > 0); y = run(lambda i, s: ((q[i] - s[0]) / kv, ), [q[0]], n, dt)[0]; v = np.gradient(y, dt); a = np.gradient(v, dt)
        P = np.clip(2.2 + 1.4 * stairs(rng, n, dt, .8, -1, 1), 0, None) + red(rng, .1, n); vm, am = v + nz(rng, .0015, n), lagged(a, .004, dt) + nz(rng, .1, n)
        tau = .55 * a + (fc + fs * np.exp(-(v / .015) ** 2)) * np.tanh(v / .002) + fv * v + kc * P
        c = {"t_s": np.arange(n) * dt, "u.command_mm": 1e3 * q, "x.axis_mps": vm, "x.axis_mps2": am, "x.spindle_kW": P, "x.coolant_lpm": 12 + red(rng, .2, n), "z.torque_Nm": tau + nz(rng, .18, n), "m.torque_Nm": .55 * am, "z.axis_mm": 1e3 * y + nz(rng, .004, n), "m.axis_mm": 1e3 * q}
        return c, {"torque_Nm": [np.sign(v), np.sign(v) * np.exp(-(v / .015) ** 2), v, P, am], "axis_mm": [1e3 * (y - q)]}
    return dict(log=log, n=[2400, 2100, 2600], channels=["torque_Nm", "axis_mm"], effects=[E("torque_Nm", "coulomb_friction"), E("torque_Nm", "viscous_friction"), E("torque_Nm", "coupling", "bias"), E("axis_mm", "lag", "delay")])

# balloon that vents and drops ballast: its climb a row ahead by its lift alone, in gusts that nobody logs; its gas is predicted as warm as the air, the sun warms it
@machine
def balloon(rng):
    dt = .5; S, w, tau = .8 * near(rng), 7.5e-3 * near(rng), 70 * near(rng)
    def log(j, n):
        F = np.clip(5 + 9 * wave(rng, n, dt, 120, 25), -18, 25); g = red(rng, .12, n, .9)
        h, v = run(lambda i, y: (y[1], (F[i] - .5 * 1.225 * np.exp(-y[0] / 7900) * S * (y[1] - g[i]) * abs(y[1] - g[i])) / 14), [rng.uniform(500, 5000), 3], n, dt); vm, hm = v + nz(rng, .05, n), h + nz(rng, 3, n); air = 15 - .0065 * h
        sun = np.clip(650 + 260 * stairs(rng, n, dt, 150, -1.5, 1.2), 30, None); sup = lagged(w * sun, tau, dt)
        c = {"t_s": np.arange(1, n) * dt, "u.lift_N": F[:-1], "x.altitude_m": hm[:-1], "x.climb_mps": vm[:-1], "x.sun_Wpm2": (sun + nz(rng, 8, n))[:-1], "x.radio_dBm": (-71 + red(rng, 2, n))[:-1], "z.climb_mps": vm[1:], "m.climb_mps": (vm + dt * F / 14)[:-1], "z.gas_degC": grain(air + sup + nz(rng, .15, n), .1)[:-1], "m.gas_degC": air[:-1]}
        return c, {"climb_mps": [(np.exp(-h / 7900) * vm * np.abs(vm))[:-1]], "gas_degC": [sup[:-1]]}
    return dict(log=log, n=[1800, 1600, 1900], channels=["climb_mps", "gas_degC"], effects=[E("climb_mps", "quadratic_drag"), E("gas_degC", "coupling", "lag")])

# distillation column: the top's temperature by the reflux at once; it comes late and slowly, and the feed's temperature counts; the pressure is well
@machine
def column(rng):
    dt = 5.; td, tau, kf = 45 * near(rng), 65 * near(rng), .3 * near(rng)
    def log(j, n):
        u = np.clip(3 + .7 * stairs(rng, n, dt, 260, -1, 1), .5, 6); F = 60 + 3 * wave(rng, n, dt, 900, 200); ul = late(u, td, dt); T = run(lambda i, y: ((-1.8 * (ul[i] - 3) - y[0]) / tau,), [0], n, dt)[0]; m = 78.5 - 1.8 * (u - 3); p = 101 + 1.2 * wave(rng, n, dt, 400, 60)
        c = {"t_s": np.arange(n) * dt, "u.reflux_lpm": u, "x.feed_degC": F + nz(rng, .15, n), "x.boiler_kW": 42 + 2 * wave(rng, n, dt, 500, 80), "z.top_degC": 78.5 + T + kf * (F - 60) + red(rng, .09, n, .7), "m.top_degC": m, "z.head_kPa": p + red(rng, .15, n, .9), "m.head_kPa": p}
        return c, {"top_degC": [78.5 + T - m, F, np.ones(n)], "head_kPa": []}
    return dict(log=log, n=[1700, 1500, 1600], channels=["top_degC", "head_kPa"], effects=[E("top_degC", "lag", "delay"), E("top_degC", "coupling")])

# web of paper between two rolls: its pull by their draw as in a steady state; the span fills as it runs, sooner the faster; the roll's size is well
@machine
def web(rng):
    dt = .05; L = 5.2 * near(rng)
    def log(j, n):
        v = np.clip(4 + 1.4 * stairs(rng, n, dt, 12, -1.3, 1.3), 1.2, 8); v = lagged(v, 1.5, dt); d = .8 * (1 + .35 * stairs(rng, n, dt, 3.5, -1, 1)); T = run(lambda i, y: ((260 * d[i] - y[0]) * v[i] / L,), [200], n, dt)[0]; R = 620 - .9 * np.cumsum(v) * dt
        c = {"t_s": np.arange(n) * dt, "u.draw_pct": d, "x.line_mps": v + nz(rng, .01, n), "x.moist_pct": 6 + red(rng, .1, n, .98), "z.web_N": T + red(rng, 4, n, .5), "m.web_N": 260 * d, "z.roll_mm": R + nz(rng, .6, n), "m.roll_mm": R}
        return c, {"web_N": [T - 260 * d], "roll_mm": []}
    return dict(log=log, n=[1800, 1600, 1700], channels=["web_N", "roll_mm"], effects=[E("web_N", "lag", "delay")])

# loudspeaker: the cone by its coil, spring and damper; the spring stiffens, the magnet's grip falls away from the middle; the coil's voltage lacks what motion induces
@machine
def loudspeaker(rng):
    dt = 4e-4; k3, b2, Bl = 2.4e7 * near(rng), 4.5e3 * near(rng), 6.8 * near(rng, .85, 1.15)
    def log(j, n):
        u = 1.9 * wave(rng, n, dt, .045, .012); f = lambda i, y: (y[1], (6.8 * u[i] * (1 - b2 * y[0] ** 2) - 2100 * y[0] - k3 * y[0] ** 3 - 3.2 * y[1]) / .021); x, v = run(f, [0, 0], n, dt, 4); a = np.array([f(i, (x[i], v[i]))[1] for i in range(n)])
        xm, vm = x + nz(rng, 2e-5, n), v + nz(rng, .006, n); m = (6.8 * u - 2100 * xm - 3.2 * vm) / .021
        c = {"t_s": np.arange(n) * dt, "u.coil_A": u, "x.cone_m": xm, "x.cone_mps": vm, "x.coil_degC": 52 + red(rng, .5, n, .995), "z.cone_mps2": a + nz(rng, 7, n), "m.cone_mps2": m, "z.coil_V": 3.6 * u + Bl * v + nz(rng, .12, n), "m.coil_V": 3.6 * u}
        return c, {"cone_mps2": [x ** 3, x * x * u], "coil_V": [vm]}
    return dict(log=log, n=[2200, 2000, 2400], channels=["cone_mps2", "coil_V"], effects=[E("cone_mps2", "unknown", "product", "hinge"), E("coil_V", "coupling", "viscous_friction")])

# knee of an exoskeleton, driven through a sheathed cable: its torque by the motor's; the sheath takes a share, against the motion; the angle is well
@machine
def exo_knee(rng):
    dt = .01; mu = .2 * near(rng); f0 = .5 * near(rng)
    def log(j, n):
        ph = np.cumsum(2 * np.pi * np.clip(.85 + .2 * wave(rng, n, dt, 9, 3), .3, 1.5)) * dt; A = 1 + .2 * wave(rng, n, dt, 6, 2); q = .5 + .35 * A * np.sin(ph) + .2 * np.sin(2 * ph + .6); v = np.gradient(q, dt); tau = 6 + 11 * A * np.sin(ph + 1.9) + 5 * np.sin(2 * ph) + 2 * wave(rng, n, dt, 3, .8); vm = v + nz(rng, .02, n); s = np.tanh(v / .05)
        c = {"t_s": np.arange(n) * dt, "x.knee_rad": q, "x.knee_radps": vm, "x.shank_mps2": 9.8 + red(rng, 1.5, n, .6), "z.knee_Nm": tau - s * (mu * np.abs(tau) + f0) + red(rng, .35, n, .5), "m.knee_Nm": tau, "z.strap_rad": q + .002 * rng.standard_normal(n), "m.strap_rad": q}
        return c, {"knee_Nm": [np.abs(tau) * np.sign(v), np.sign(v)], "strap_rad": []}
    return dict(log=log, n=[2100, 1900, 2300], channels=["knee_Nm", "strap_rad"], effects=[E("knee_Nm", "load_friction", "coulomb_friction", "product")])

# robot on two wheels that balances: the rate of its wheels a row ahead from its own noisy reading, without the gears' friction
@machine
def balancer(rng):
    dt = .01; fc, fv = .055 * near(rng), .009 * near(rng)
    def log(j, n):
        want = 4 * stairs(rng, n, dt, 2.5, -1, 1); th, td, w, TH, TD, W, Wm, U, wm = .02, 0., 0., [], [], [], [], [], 0.
        for i in range(n):
            wm = w + .05 * rng.standard_normal(); thm = th + .002 * rng.standard_normal(); u = np.clip(5.2 * thm + .75 * td + .055 * (wm - want[i]), -1, 1); TH.append(thm); TD.append(td); Wm.append(wm); U.append(u)
            def f(y):
                r = y[2] - y[1]; q = u - fc * np.tanh(r / .05) - fv * r
                return np.array([y[1], 55 * np.sin(y[0]) - 42 * q, 150 * q - 70 * np.sin(y[0])])
            th, td, w = rk(f, np.array([th, td, w]), dt, 4)
        TH, TD, Wm, U = map(np.array, (TH, TD, Wm, U)); rel = Wm - TD
        c = {"t_s": np.arange(1, n) * dt, "u.torque_Nm": U[:-1], "x.tilt_rad": TH[:-1], "x.tilt_radps": TD[:-1], "x.wheel_radps": Wm[:-1], "x.pack_V": (11.7 + red(rng, .05, n))[:-1], "z.wheel_radps": Wm[1:], "m.wheel_radps": (Wm + dt * (150 * U - 70 * np.sin(TH)))[:-1]}
        return c, {"wheel_radps": [np.sign(rel)[:-1], rel[:-1]]}
    return dict(log=log, n=[2200, 2000, 2300], channels=["wheel_radps"], effects=[E("wheel_radps", "coulomb_friction", "viscous_friction")])

# turbofan on a stand: its spool is predicted to obey the lever at once, its gas's temperature by the spool, read by a slow probe; the fuel is well
@machine
def turbofan(rng):
    dt = .1; t1, t2, ka = 1.1 * near(rng), 2.4 * near(rng), 2.6 * near(rng)
    def log(j, n):
        u = np.clip(70 + 18 * stairs(rng, n, dt, 11, -1.2, 1.2), 42, 100); N = run(lambda i, y: ((u[i] - y[0]) / t1,), [70], n, dt)[0]; air = 12 + 4 * wave(rng, n, dt, 60, 20); G = 210 + 5.6 * N; g = run(lambda i, y: ((G[i] + ka * (air[i] - 12) - y[0]) / t2,), [G[0]], n, dt)[0]
        c = {"t_s": np.arange(n) * dt, "u.lever_pct": u, "x.inlet_degC": air + nz(rng, .1, n), "x.oil_bar": 3.4 + red(rng, .04, n), "z.n1_pct": N + nz(rng, .25, n), "m.n1_pct": u, "z.egt_degC": grain(g + nz(rng, 2.2, n), 1), "m.egt_degC": G, "z.fuel_kgph": 9 * N + red(rng, 5, n, .7), "m.fuel_kgph": 9 * N}
        return c, {"n1_pct": [N - u], "egt_degC": [g - G], "fuel_kgph": []}
    return dict(log=log, n=[1600, 1500, 1800], channels=["n1_pct", "egt_degC", "fuel_kgph"], effects=[E("n1_pct", "lag"), E("egt_degC", "lag", "delay"), E("egt_degC", "coupling")])

# vessel that keeps its place: its change of way by its thrusters; the wind, by its square, and the water are not predicted; its heave is well
@machine
def keeper(rng):
    dt = 1.; kw, kd = 2.1e-4 * near(rng), .022 * near(rng)
    def log(j, n):
        W = np.clip(11 + 4.5 * wave(rng, n, dt, 150, 25), 1, None); b = .5 * wave(rng, n, dt, 300, 90); wx = W * np.cos(b + .3); want = 12 * stairs(rng, n, dt, 120, -1, 1); x = v = i2 = 0.; V, A, U = [], [], []; au = 0.
        for i in range(n):
            e = want[i] - x + .3 * rng.standard_normal(); i2 = np.clip(i2 + e * 1e-4, -.05, .05); u = np.clip(.0016 * e - .07 * v + i2, -.06, .06); acc = lambda s: u - kw * wx[i] * abs(wx[i]) - kd * s * abs(s) - .004 * s; V.append(v); U.append(u); A.append(acc(v)); v = rk(acc, v, dt); x += dt * v
        V, A, U = map(np.array, (V, A, U)); h = .6 * wave(rng, n, dt, 14, 7)
        c = {"t_s": np.arange(n) * dt, "u.thrust_mps2": U, "x.surge_mps": V + nz(rng, .01, n), "x.wind_mps": wx + nz(rng, .3, n), "x.sway_m": red(rng, .8, n, .98), "z.surge_mps2": A + nz(rng, .004, n), "m.surge_mps2": U, "z.heave_m": h + nz(rng, .03, n), "m.heave_m": h}
        return c, {"surge_mps2": [wx * np.abs(wx), V * np.abs(V), V], "heave_m": []}
    return dict(log=log, n=[1700, 1500, 1900], channels=["surge_mps2", "heave_m"], effects=[E("surge_mps2", "product", "unknown", "coupling", "quadratic_drag")])

# stirrer: its torque by its speed at the rated thickness of what it stirs, which thins as it warms; the speed is well
@machine
def stirrer(rng):
    dt = 1.; b = .032 * near(rng)
    def log(j, n):
        w = np.clip(60 + 28 * stairs(rng, n, dt, 60, -1.2, 1.2), 8, 130); w = lagged(w, 4, dt); T = 34 + 12 * wave(rng, n, dt, 900, 150); m = .11 * w; y = m * np.exp(-b * (T - 40))
        c = {"t_s": np.arange(n) * dt, "x.speed_rpm": w + nz(rng, .3, n), "x.batch_degC": grain(T + nz(rng, .1, n), .1), "x.level_pct": 71 + red(rng, .4, n, .99), "z.torque_Nm": y + red(rng, .13, n, .5), "m.torque_Nm": m, "z.speed_rpm": w + nz(rng, .5, n), "m.speed_rpm": w}
        return c, {"torque_Nm": [y - m], "speed_rpm": []}
    return dict(log=log, n=[1600, 1400, 1700], channels=["torque_Nm", "speed_rpm"], effects=[E("torque_Nm", "product", "unknown", "gain")])

# endoscope: the bend of its tip by its knob; the wires have play, and give
@machine
def endoscope(rng):
    dt = .02; play, g = 14 * near(rng), rng.uniform(.74, .88)
    def log(j, n):
        k, v, _ = moves(rng, n, dt, -75, 75, 1.3, .35); s, S = k[0], []
        for a in k: s = min(max(s, a - play / 2), a + play / 2); S.append(s)
        S = g * np.array(S)
        c = {"t_s": np.arange(n) * dt, "u.knob_deg": k, "x.insert_mm": 400 + 60 * wave(rng, n, dt, 25, 8), "x.lamp_W": 35 + red(rng, .3, n), "z.bend_deg": grain(S + nz(rng, .5, n), .1), "m.bend_deg": k}
        return c, {"bend_deg": [S - k]}
    return dict(log=log, n=[1900, 1700, 2000], channels=["bend_deg"], effects=[E("bend_deg", "backlash", "hysteresis"), E("bend_deg", "gain")])

# plough: the pull by its depth; soil that is thrown adds the square of speed; the way over ground is predicted as the wheels', which slip under the pull
@machine
def plough(rng):
    dt = .1; c2, sl = .085 * near(rng), .0055 * near(rng)
    def log(j, n):
        d = np.clip(.22 + .05 * wave(rng, n, dt, 18, 3), .06, .36); v = np.clip(2.1 + .7 * stairs(rng, n, dt, 12, -1.2, 1.2), .6, 3.4); v = lagged(v, 1.2, dt); F = 70 * d * (1 + c2 * v ** 2) + red(rng, .9, n, .6); w = v / (1 - sl * F)
        c = {"t_s": np.arange(n) * dt, "u.depth_m": d + nz(rng, .002, n), "x.wheel_mps": w + nz(rng, .01, n), "x.pull_kN": F + nz(rng, .2, n), "x.diesel_degC": 81 + red(rng, .8, n, .99), "z.draught_kN": F + nz(rng, .2, n), "m.draught_kN": 70 * d, "z.ground_mps": v + nz(rng, .025, n), "m.ground_mps": w}
        return c, {"draught_kN": [d * v * v], "ground_mps": [w * F]}
    return dict(log=log, n=[1600, 1500, 1800], channels=["draught_kN", "ground_mps"], effects=[E("draught_kN", "product", "coupling", "gain", "unknown"), E("ground_mps", "product", "gain", "viscous_friction", "coupling")])

# shaker with nothing wrong: under control, its noise long, the mains on top, its drive warm
@machine
def shaker(rng):
    dt = .005
    def log(j, n):
        t = np.arange(n) * dt; y = 3 * np.sin(2 * np.pi * np.cumsum(2 + 6 * t / t[-1]) * dt) * (1 + .3 * wave(rng, n, dt, 3, 1)); e = red(rng, .25, n, .93) + .1 * np.sin(2 * np.pi * 49.98 * t + rng.uniform(0, 6)); x = 4 * wave(rng, n, dt, 2, .4)
        u = y / 5 - .08 * np.concatenate([[0], (y + e)[:-1] - y[:-1]])
        c = {"t_s": t, "u.drive_V": u, "x.stroke_mm": x, "x.coil_degC": 30 + 12 * (1 - np.exp(-t / 6)), "z.table_mps2": y + e, "m.table_mps2": y, "z.stroke_mm": grain(x + red(rng, .03, n, .9), .05), "m.stroke_mm": x}
        return c, {"table_mps2": [], "stroke_mm": []}
    return dict(log=log, n=[2200, 2000, 2400], channels=["table_mps2", "stroke_mm"], effects=[])

# mast with nothing wrong: gusts scatter in proportion to the wind (stated), with spikes; the thermometer reads in half degrees
@machine
def mast(rng):
    dt = 1.
    def log(j, n):
        w = np.clip(8 + 3 * wave(rng, n, dt, 300, 40), .5, None); s = .05 * w + .1; e = s * (.8 * red(rng, 1, n, .6) + .6 * rng.standard_t(4, n) / np.sqrt(2)); d = 1.2 * wave(rng, n, dt, 600, 120); T = 9 + 3 * wave(rng, n, dt, 1200, 300)
        c = {"t_s": np.arange(n) * dt, "x.low_mps": w / 1.18 + nz(rng, .1, n), "x.vane_rad": d, "x.sky_hPa": 1006 + red(rng, 2, n, .999), "z.top_mps": w + e, "m.top_mps": w, "sd.top_mps": s, "z.air_degC": grain(T + red(rng, .12, n, .9), .5), "m.air_degC": T}
        return sd(c, air_degC=.2), {"top_mps": [], "air_degC": []}
    return dict(log=log, n=[1800, 1600, 2000], channels=["top_mps", "air_degC"], effects=[])

def main():
    o = asked(M)
    mac = M[o.family](np.random.default_rng(o.seed * 6211 + 29))
    put(o, mac, [mac["log"](j, n) for j, n in enumerate(mac["n"])], mac["log"](len(mac["n"]), mac["n"][0]))
if __name__ == "__main__": main()
