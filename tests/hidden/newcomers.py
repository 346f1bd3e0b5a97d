#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""newcomers.py --seed N [--family F] --out DIR --truth FILE: nineteen more machines, as a laboratory logs them; needs numpy.

Hardly any has sd. columns or units; most predictions start from a noisy reading; logs differ in length. Motor by speed and by torque, a joint that
warms, cylinder, crane, quadcopter, underwater vehicle, truck, car that understeers, rockets of different drag, heat exchanger, slipping
wheels, play, oven that radiates, a pump with nothing wrong; and four drawn after what these showed was corrected: stage, boat, tank, train.
The physics is integrated in finer steps than the rows. Shares no code with the engine or the other drawers."""
import argparse, json, math, os
import numpy as np

def smooth(rng, n, dt, slow, fast, knots=7):
    """Sum of sines between two periods, rms 1."""
    t = np.arange(n) * dt
    w = 2 * np.pi / np.exp(rng.uniform(np.log(fast), np.log(slow), knots))
    a = rng.uniform(.4, 1, knots)
    y = (a[:, None] * np.sin(w[:, None] * t + rng.uniform(0, 6.28, knots)[:, None])).sum(0)
    return y / np.sqrt((a * a).sum() / 2)

def steps(rng, n, dt, hold, levels):
    y, i = np.zeros(n), 0
    while i < n:
        k = max(1, int(rng.uniform(.5, 1.6) * hold / dt)); y[i:i + k] = rng.choice(levels) if levels is not None else rng.uniform(-1, 1); i += k
    return y

def sgn(v): return np.sign(v)

# Every machine: (rng) -> parameters; log(rng, p, j, n) -> columns, basis {channel: [cols]}.
M = {}
def machine(f):
    M[f.__name__] = f
    return f


@machine
def dcmotor_speed(rng):
    J, kt, R, ke = 2e-3 * rng.uniform(.7, 1.5), .06, .8, .06
    tc, ts, ws, tg, dt = .02 * rng.uniform(.7, 1.4), .012 * rng.uniform(.8, 1.5), 4., .05 * rng.uniform(.6, 1.3), .01
    sw = .08
    def log(rng, j, n):
        V = 5 * smooth(rng, n, dt, 6, .6) * rng.uniform(.7, 1.1)
        w, q, W, Q = 0., 0., [], []
        for i in range(n):
            W.append(w); Q.append(q)
            for _ in range(10):
                fr = (tc + ts * math.exp(-(w / ws) ** 2)) * math.tanh(w / .05)
                a = (kt * (V[i] - ke * w) / R - fr - tg * math.sin(q)) / J
                w += a * dt / 10; q += w * dt / 10
        W, Q = np.array(W), np.array(Q)
        r = W + sw * rng.standard_normal(n); q = Q + .002 * rng.standard_normal(n)
        m = r[:-1] + dt / J * kt * (V[:-1] - ke * r[:-1]) / R
        k = dt / J
        c = {"t_s": np.arange(1, n) * dt, "u.armature_V": V[:-1], "x.shaft_speed": r[:-1], "x.shaft_angle": q[:-1], "z.shaft_speed": r[1:], "m.shaft_speed": m}
        v = r[:-1]
        return c, {"shaft_speed": [-k * sgn(v), -k * sgn(v) * np.exp(-(v / ws) ** 2), -k * np.sin(q[:-1])]}
    eff = [dict(channel="shaft_speed", cause="coulomb_friction", also=[], size=tc * dt / J), dict(channel="shaft_speed", cause="periodic", also=["slope"], size=None)]
    return dict(log=log, n=[2500, 1800, 2200], effects=eff, channels=["shaft_speed"])

@machine
def dcmotor_torque(rng):
    J, tc, tv, tg, off, dt = .012, .35 * rng.uniform(.7, 1.4), .06 * rng.uniform(.6, 1.5), .8 * rng.uniform(.5, 1.3), .05, .02
    def log(rng, j, n):
        q = 2.2 * smooth(rng, n, dt, 9, 1.5); v = np.gradient(q, dt); a = np.gradient(v, dt)
        z = J * a + tc * np.tanh(v / .02) + tv * v + tg * np.sin(q) + off + .05 * rng.standard_normal(n)
        vm, am, qm = v + .02 * rng.standard_normal(n), a + .4 * rng.standard_normal(n), q
        c = {"t_s": np.arange(n) * dt, "x.q_rad": qm, "x.qd_radps": vm, "x.qdd_radps2": am, "z.torque_Nm": z, "m.torque_Nm": J * am}
        return c, {"torque_Nm": [sgn(vm), vm, np.sin(qm), np.ones(n)]}
    ch = "torque_Nm"
    eff = [dict(channel=ch, cause="coulomb_friction", also=[], size=tc), dict(channel=ch, cause="viscous_friction", also=[], size=tv),
           dict(channel=ch, cause="periodic", also=["slope"], size=None), dict(channel=ch, cause="bias", also=[], size=None)]
    return dict(log=log, n=[1500, 2400], effects=eff, channels=[ch])

@machine
def joint6(rng):
    Ja, cp, cn, v0, vt, dt = .18, 1.1 * rng.uniform(.7, 1.3), .8 * rng.uniform(.7, 1.2), 1.6 * rng.uniform(.7, 1.3), -.022, .008
    def log(rng, j, n):
        q = 1.4 * smooth(rng, n, dt, 5, .9); v = np.gradient(q, dt); a = np.gradient(v, dt)
        T = 24 + (14 + 3 * j) * (1 - np.exp(-np.arange(n) * dt / (n * dt * .4)))
        f = np.where(v > 0, cp, -cn) * np.tanh(np.abs(v) / .01)
        z = Ja * a + f + (v0 + vt * (T - 25)) * v + .3 + .12 * rng.standard_normal(n)
        vm, am = v + .01 * rng.standard_normal(n), a + .3 * rng.standard_normal(n)
        c = {"t_s": np.arange(n) * dt, "x.j6_pos": q, "x.j6_vel": vm, "x.j6_acc": am, "x.housing_temp": T, "z.j6_current": z, "m.j6_current": Ja * am,
             "z.j5_current": .1 * am + .1 * rng.standard_normal(n), "m.j5_current": .1 * am}
        return c, {"j6_current": [vm > 0, vm < 0, vm, vm * T], "j5_current": []}
    ch = "j6_current"
    eff = [dict(channel=ch, cause="coulomb_friction", also=[], size=(cp + cn) / 2), dict(channel=ch, cause="viscous_friction", also=["product"], size=None),
           dict(channel=ch, cause="product", also=["viscous_friction"], size=None), dict(channel=ch, cause="bias", also=["coulomb_friction"], size=None)]
    return dict(log=log, n=[3000, 2000, 2600], effects=eff, channels=[ch, "j5_current"])

@machine
def cylinder(rng):
    k, ps, dt = .05 * rng.uniform(.7, 1.4), 140., .02
    def log(rng, j, n):
        u = np.clip(.5 * smooth(rng, n, dt, 8, 1), -1, 1)
        pl = 45 * smooth(rng, n, dt, 12, 2.5) + rng.uniform(-15, 15); pl = np.clip(pl, -120, 120)
        z = k * u * np.sqrt(np.maximum(ps - np.sign(u) * pl, 0) / ps) + .0012 * rng.standard_normal(n)
        plm = pl + .5 * rng.standard_normal(n)
        c = {"t_s": np.arange(n) * dt, "u.spool": u, "x.load_bar": plm, "x.oil_degC": 41 + .5 * rng.standard_normal(n).cumsum() * .02, "z.rod_mps": z, "m.rod_mps": k * u}
        return c, {"rod_mps": [k * u * (np.sqrt(np.maximum(ps - np.sign(u) * plm, 0) / ps) - 1)]}
    eff = [dict(channel="rod_mps", cause="unknown", also=["product"], size=None)]
    return dict(log=log, n=[1800, 1800, 900], effects=eff, channels=["rod_mps"])

@machine
def crane(rng):
    L, dq, dv, dt = 6 * rng.uniform(.7, 1.4), .09 * rng.uniform(.7, 1.5), .0, .05
    def log(rng, j, n):
        acc = .9 * steps(rng, n, dt, 2.5, [-1, 0, 0, 1])
        th, om, v = rng.uniform(-.4, .4), 0., 0.; TH, OM, VV, A = [], [], [], []
        for i in range(n):
            ac = acc[i] - .25 * v; TH.append(th); OM.append(om); VV.append(v); A.append(ac)
            for _ in range(10):
                om += dt / 10 * (-(9.81 * math.sin(th) + ac * math.cos(th)) / L - dq * 2.2 * om * abs(om)); th += om * dt / 10
            v += ac * dt
        TH, OM, VV, A = map(np.array, (TH, OM, VV, A))
        o, h, vv = OM + .003 * rng.standard_normal(n), TH + .002 * rng.standard_normal(n), VV + .01 * rng.standard_normal(n)
        m = o + dt * -(9.81 * np.sin(h + o * dt / 2) + A * np.cos(h)) / L
        c = {"t_s": np.arange(1, n) * dt, "u.trolley_acc": A[:-1], "x.trolley_vel": vv[:-1], "x.swing": h[:-1], "x.swing_rate": o[:-1],
             "z.swing_rate": o[1:], "m.swing_rate": m[:-1], "z.trolley_vel": vv[1:], "m.trolley_vel": (vv + A * dt)[:-1]}
        return c, {"swing_rate": [(-dt * o * np.abs(o))[:-1]], "trolley_vel": []}
    eff = [dict(channel="swing_rate", cause="quadratic_drag", also=["viscous_friction"], size=dq * 2.2 * dt)]
    return dict(log=log, n=[2400, 1600, 2000], effects=eff, channels=["swing_rate", "trolley_vel"])

@machine
def quad(rng):
    m_, d, dt = 1.4, .35 * rng.uniform(.7, 1.4), .02
    ks = .35 * rng.uniform(.7, 1.2)
    def log(rng, j, n):
        t = np.arange(n) * dt
        th = .25 * smooth(rng, n, dt, 8, 1.5)
        thr = m_ * 9.81 * (1 + .12 * smooth(rng, n, dt, 6, 1.2))
        V = 16.4 - 1.6 * t / t[-1] - .12 * (thr / m_ / 9.81 - 1) * 4 + .02 * rng.standard_normal(n)
        eff = 1 - ks * (16.4 - V) / 16.4
        vx, vz, X, Z = rng.uniform(-1, 1), 0., [], []
        for i in range(n):
            X.append(vx); Z.append(vz)
            T = thr[i] * eff[i]
            vx += dt * (T * math.sin(th[i]) / m_ - d * vx); vz += dt * (T * math.cos(th[i]) / m_ - 9.81 - .3 * (vz))
            thr[i:i + 1] += 0
        X, Z = np.array(X), np.array(Z)
        x, z = X + .01 * rng.standard_normal(n), Z + .01 * rng.standard_normal(n)
        mx, mz = x + dt * thr * np.sin(th) / m_, z + dt * (thr * np.cos(th) / m_ - 9.81 - .3 * z)
        c = {"t_s": t[1:], "u.thrust_N": thr[:-1], "u.pitch_rad": th[:-1], "x.battery_V": V[:-1], "x.vx_mps": x[:-1], "x.vz_mps": z[:-1],
             "z.vx_mps": x[1:], "m.vx_mps": mx[:-1], "z.vz_mps": z[1:], "m.vz_mps": mz[:-1]}
        return c, {"vx_mps": [(-dt * x)[:-1], (dt * thr * np.sin(th) * (16.4 - V))[:-1]], "vz_mps": [(-dt * thr * np.cos(th) * (16.4 - V))[:-1]]}
    eff = [dict(channel="vx_mps", cause="viscous_friction", also=[], size=d * dt),
           dict(channel="vz_mps", cause="product", also=["gain", "coupling", "drift"], size=None)]
    return dict(log=log, n=[2000, 2000, 1500], effects=eff, channels=["vx_mps", "vz_mps"])

@machine
def auv(rng):
    m0, ma, d, dt = 60., 60 * rng.uniform(.25, .5), 32 * rng.uniform(.7, 1.4), .2
    def log(rng, j, n):
        F = 60 * smooth(rng, n, dt, 60, 8) + rng.uniform(-5, 15)
        v, r, VV, RR = 0., 0., [], []
        rud = .3 * smooth(rng, n, dt, 30, 6)
        for i in range(n):
            VV.append(v); RR.append(r)
            for _ in range(40): v += dt / 40 * (F[i] - d * v * abs(v)) / (m0 + ma); r += dt / 40 * (.8 * rud[i] - .6 * r)
        VV, RR = np.array(VV), np.array(RR)
        v, r = VV + .006 * rng.standard_normal(n), RR + .004 * rng.standard_normal(n)
        dm = dt * F / m0
        c = {"t_s": np.arange(1, n) * dt, "u.thrust_N": F[:-1], "u.rudder_rad": rud[:-1], "x.surge": v[:-1], "x.yaw_rate": r[:-1], "z.surge": v[1:], "m.surge": (v + dm)[:-1],
             "z.yaw_rate": r[1:], "m.yaw_rate": (r * math.exp(-.6 * dt) + .8 / .6 * rud * (1 - math.exp(-.6 * dt)))[:-1]}
        return c, {"surge": [dm[:-1], (-dt * v * np.abs(v))[:-1]], "yaw_rate": []}
    eff = [dict(channel="surge", cause="quadratic_drag", also=[], size=d / (m0 + ma) * dt), dict(channel="surge", cause="gain", also=["coupling"], size=None)]
    return dict(log=log, n=[1500, 1100, 1300], effects=eff, channels=["surge", "yaw_rate"])

@machine
def truck(rng):
    m0, crr, cda, dt = 18000., .007 * rng.uniform(.8, 1.3), 6.5 * rng.uniform(.7, 1.3), .5
    def log(rng, j, n):
        grade = .025 * smooth(rng, n, dt, 200, 30)
        F, v, VV, FF = 0, 18. + rng.uniform(-3, 3), [], []
        target = 18 + 5 * steps(rng, n, dt, 60, None)
        for i in range(n):
            F = np.clip(m0 * .25 * (target[i] - v) + 3500, -20000, 26000); VV.append(v); FF.append(F)
            v += dt * (F - crr * m0 * 9.81 - .5 * 1.2 * cda * v * v - m0 * 9.81 * grade[i]) / m0; v = max(v, .5)
        VV, FF = np.array(VV), np.array(FF); v = VV + .03 * rng.standard_normal(n)
        g = grade + .001 * rng.standard_normal(n)
        c = {"t_s": np.arange(1, n) * dt, "u.traction_kN": FF[:-1] / 1e3, "x.speed": v[:-1], "x.road_grade": g[:-1], "x.gear": np.clip((v // 4), 1, 12)[:-1], "z.speed": v[1:], "m.speed": (v + dt * FF / m0)[:-1]}
        return c, {"speed": [-np.ones(n - 1), (-dt * v * v)[:-1], (-dt * g)[:-1]]}
    eff = [dict(channel="speed", cause="coupling", also=[], size=None), dict(channel="speed", cause="bias", also=["coulomb_friction"], size=None),
           dict(channel="speed", cause="quadratic_drag", also=[], size=.6 * cda * dt / m0)]
    return dict(log=log, n=[1600, 1200, 1000], effects=eff, channels=["speed"])

@machine
def car2(rng):
    L, K, tau, dl, dt = 2.7, .0035 * rng.uniform(.7, 1.3), .15 * rng.uniform(.7, 1.4), 3, .04
    def log(rng, j, n):
        st = .06 * smooth(rng, n, dt, 9, 1.2); v = 16 + 6 * smooth(rng, n, dt, 60, 15); v = np.clip(v, 4, 30)
        lat = np.concatenate([np.full(dl, st[0]), st[:-dl]])
        ss = v * lat / (L + K * v * v)
        r, R = ss[0], []
        for i in range(n): r += (1 - math.exp(-dt / tau)) * (ss[i] - r); R.append(r)
        z = np.array(R) + .004 * rng.standard_normal(n)
        vm = v + .05 * rng.standard_normal(n)
        c = {"t_s": np.arange(n) * dt, "u.steer_rad": st, "x.speed_mps": vm, "z.yaw_radps": z, "m.yaw_radps": vm * st / L,
             "z.wheel_radps": v / .31 + .2 * rng.standard_normal(n), "m.wheel_radps": vm / .31}
        ss = vm * lat / (L + K * vm * vm); r, R2 = ss[0], []
        for i in range(n): r += (1 - math.exp(-dt / tau)) * (ss[i] - r); R2.append(r)
        return c, {"yaw_radps": [np.array(R2) - vm * st / L], "wheel_radps": []}
    eff = [dict(channel="yaw_radps", cause="lag", also=["delay"], size=None), dict(channel="yaw_radps", cause="product", also=["gain", "hinge", "unknown"], size=None)]
    return dict(log=log, n=[2000, 2400, 1700], effects=eff, channels=["yaw_radps", "wheel_radps"])

@machine
def rockets2(rng):
    dt = .25
    k = 5e-4 * rng.uniform(.7, 1.4)
    ks = k * np.array([1., 1.5, 1.25]) * rng.uniform(.9, 1.1, 3)
    def log(rng, j, n):
        v, h, V, H, A = 30., 900., [], [], []
        burn = rng.uniform(3, 5)
        for i in range(n):
            V.append(v); H.append(h); a = rng.normal(62, .6) if i * dt < burn else 0.; A.append(a)
            for _ in range(10): v += dt / 10 * (a - 9.81 - ks[j] * math.exp(-h / 8500) * v * abs(v)); h += dt / 10 * v
        V, H, A = map(np.array, (V, H, A))
        v, h = V + .35 * rng.standard_normal(n), H + 3 * rng.standard_normal(n)
        c = {"t_s": np.arange(1, n) * dt, "u.thrust_acc": A[:-1], "x.height_m": h[:-1], "x.climb_mps": v[:-1], "z.climb_mps": v[1:], "m.climb_mps": (v + dt * (A - 9.81))[:-1]}
        return c, {"climb_mps": [(-dt * np.exp(-h / 8500) * v * np.abs(v))[:-1]]}
    eff = [dict(channel="climb_mps", cause="quadratic_drag", also=[], size=None)]
    return dict(log=log, n=[110, 100, 105], effects=eff, channels=["climb_mps"], differs=True)

@machine
def exchanger(rng):
    tau, foul, dt = 45 * rng.uniform(.7, 1.4), .82 * rng.uniform(.95, 1.06), 5.
    def log(rng, j, n):
        hot = 80 + 8 * steps(rng, n, dt, 300, None); cold = 18 + 2 * smooth(rng, n, dt, 3000, 600); fl = 1 + .4 * steps(rng, n, dt, 400, None)
        ideal = cold + (hot - cold) * (1 - np.exp(-.9 / fl)); real = cold + foul * (hot - cold) * (1 - np.exp(-.9 / fl))
        y, Y = real[0], []
        for i in range(n): y += (1 - math.exp(-dt / tau)) * (real[i] - y); Y.append(y)
        Y = np.array(Y); z = np.round((Y + .15 * rng.standard_normal(n)) / .1) * .1
        y, Y2 = real[0], []
        c = {"t_s": np.arange(n) * dt, "u.hot_in_degC": hot, "u.flow_kgps": fl, "x.cold_in_degC": cold + .1 * rng.standard_normal(n), "z.out_degC": z, "m.out_degC": ideal}
        return c, {"out_degC": [Y - ideal]}
    eff = [dict(channel="out_degC", cause="lag", also=["delay"], size=None), dict(channel="out_degC", cause="gain", also=["bias", "product", "coupling"], size=None)]
    return dict(log=log, n=[900, 700, 800], effects=eff, channels=["out_degC"])

@machine
def slip(rng):
    r, b, dt = .1, .42, .05
    k, wb = .10 * rng.uniform(.7, 1.4), 1.12 * rng.uniform(.98, 1.05)
    def log(rng, j, n):
        wl, wr = 8 + 4 * smooth(rng, n, dt, 20, 3), 8 + 4 * smooth(rng, n, dt, 20, 3)
        f, tn = r * (wl + wr) / 2, r * (wr - wl) / b
        z = f * (1 - k) + .01 * rng.standard_normal(n); w = tn / wb + .012 * rng.standard_normal(n)
        c = {"t_s": np.arange(n) * dt, "u.left_radps": wl, "u.right_radps": wr, "x.heading_rad": np.angle(np.exp(1j * np.cumsum(tn / wb) * dt)), "z.forward_mps": z, "m.forward_mps": f, "z.turn_radps": w, "m.turn_radps": tn}
        return c, {"forward_mps": [-f], "turn_radps": [-tn]}
    eff = [dict(channel="forward_mps", cause="gain", also=[], size=-k), dict(channel="turn_radps", cause="gain", also=[], size=1 / wb - 1)]
    return dict(log=log, n=[1500, 1500], effects=eff, channels=["forward_mps", "turn_radps"])

@machine
def backlash(rng):
    gap, dt = 3.0 * rng.uniform(.7, 1.5), .02
    def log(rng, j, n):
        q = 60 * smooth(rng, n, dt, 12, 3); out, o = [], q[0]
        for i in range(n): o = min(max(o, q[i] - gap / 2), q[i] + gap / 2); out.append(o)
        out = np.array(out); v = np.gradient(q, dt)
        c = {"t_s": np.arange(n) * dt, "u.motor_mm": q, "x.motor_speed": v + .5 * rng.standard_normal(n), "z.belt_mm": out + .2 * rng.standard_normal(n), "m.belt_mm": q}
        return c, {"belt_mm": [out - q]}
    eff = [dict(channel="belt_mm", cause="coulomb_friction", also=["unknown", "backlash", "hysteresis"], size=gap / 2)]
    return dict(log=log, n=[2000, 1600, 2200], effects=eff, channels=["belt_mm"])

@machine
def oven(rng):
    C, h, dt = 9000., 9., 10.
    er = 1.6e-8 * rng.uniform(.7, 1.3)
    def log(rng, j, n):
        T, TT, P = 300. + rng.uniform(0, 40), [], 6000 * (.5 + .5 * steps(rng, n, dt, 700, None))
        for i in range(n):
            TT.append(T)
            for _ in range(5): T += dt / 5 * (P[i] - h * (T - 295) - er * (T ** 4 - 295. ** 4)) / C
        TT = np.array(TT); T = TT + .3 * rng.standard_normal(n)
        c = {"t_s": np.arange(1, n) * dt, "u.heater_W": P[:-1], "x.chamber_K": T[:-1], "x.room_K": 295 + .2 * rng.standard_normal(n)[:-1], "z.chamber_K": T[1:], "m.chamber_K": (T + dt * (P - h * (T - 295)) / C)[:-1]}
        return c, {"chamber_K": [(-dt / C * (T ** 4 - 295. ** 4))[:-1]]}
    eff = [dict(channel="chamber_K", cause="unknown", also=["radiation"], size=None)]
    return dict(log=log, n=[900, 700, 800], effects=eff, channels=["chamber_K"])

@machine
def pump_null(rng):
    dt = .1
    def log(rng, j, n):
        s = 40 + 8 * steps(rng, n, dt, 8, None); p = .002 * s ** 2
        e = np.zeros(n); w = rng.standard_normal(n)
        for i in range(1, n): e[i] = .8 * e[i - 1] + .6 * w[i]
        z = np.round((p + .03 * e) / .01) * .01
        fl = 1.2 * s + .4 * rng.standard_t(5, n)
        c = {"t_s": np.arange(n) * dt, "u.pump_Hz": s, "x.valve": np.clip(.5 + .2 * smooth(rng, n, dt, 60, 10), 0, 1), "z.head_bar": z, "m.head_bar": p, "z.flow_Lpm": fl, "m.flow_Lpm": 1.2 * s}
        return c, {"head_bar": [], "flow_Lpm": []}
    return dict(log=log, n=[1500, 1500, 900], effects=[], channels=["head_bar", "flow_Lpm"])

@machine
def stage(rng):
    J, tc, tv, cog, n_, dt = .004, .12 * rng.uniform(.7, 1.4), .02 * rng.uniform(.6, 1.5), .08 * rng.uniform(.7, 1.3), 4, .004
    def log(rng, j, n):
        q = 9 * smooth(rng, n, dt, 8, 1.2); v = np.gradient(q, dt); a = np.gradient(v, dt)
        z = J * a + tc * np.tanh(v / .05) + tv * v + cog * np.sin(n_ * q + .7) + .02 * rng.standard_normal(n)
        c = {"t_s": np.arange(n) * dt, "x.motor_theta": q, "x.motor_vel": v + .05 * rng.standard_normal(n), "z.motor_torque": z, "m.motor_torque": J * (a + .5 * rng.standard_normal(n)),
             "z.bus_volt": 48 - .2 * np.abs(v) / 10 + .05 * rng.standard_normal(n), "m.bus_volt": 48 - .2 * np.abs(v) / 10}
        vm = c["x.motor_vel"]
        return c, {"motor_torque": [sgn(vm), vm, np.sin(n_ * q), np.cos(n_ * q)], "bus_volt": []}
    ch = "motor_torque"
    eff = [dict(channel=ch, cause="viscous_friction", also=[], size=tv), dict(channel=ch, cause="coulomb_friction", also=[], size=tc), dict(channel=ch, cause="periodic", also=["slope"], size=None)]
    return dict(log=log, n=[2600, 3100], effects=eff, channels=[ch, "bus_volt"])

@machine
def boat(rng):
    tau, dl, kd, dt = .8 * rng.uniform(.7, 1.4), .35 * rng.uniform(.7, 1.4), .09 * rng.uniform(.7, 1.4), .1
    def log(rng, j, n):
        ru, th = .5 * steps(rng, n, dt, 4, None), .6 + .4 * steps(rng, n, dt, 12, None)
        v, r, f, VV, RR = 2., 0., 0., [], []
        for i in range(n):
            VV.append(v); RR.append(r)
            for _ in range(20): f += dt / 20 * (ru[i] - f) / tau; r += dt / 20 * (dl * f * 2 - .7 * r); v += dt / 20 * (th[i] - kd * v * abs(v))
        v, r = np.array(VV) + .02 * rng.standard_normal(n), np.array(RR) + .008 * rng.standard_normal(n)
        e = math.exp(-.7 * dt); mr = r * e + dl * 2 / .7 * (1 - e) * ru; fl, f = [], 0.
        for i in range(n): fl.append(f + (ru[i] - f) * .5 * dt / tau); f += (1 - math.exp(-dt / tau)) * (ru[i] - f)
        c = {"t_s": np.arange(1, n) * dt, "u.rudder": ru[:-1], "u.throttle": th[:-1], "x.speed_through_water": v[:-1], "x.turn_rate": r[:-1], "z.turn_rate": r[1:], "m.turn_rate": mr[:-1],
             "z.speed_through_water": v[1:], "m.speed_through_water": (v + dt * th)[:-1]}
        return c, {"turn_rate": [(dl * 2 / .7 * (1 - e) * (np.array(fl) - ru))[:-1]], "speed_through_water": [(-dt * v * np.abs(v))[:-1]]}
    eff = [dict(channel="turn_rate", cause="lag", also=["delay"], size=None), dict(channel="speed_through_water", cause="quadratic_drag", also=[], size=kd * dt)]
    return dict(log=log, n=[1500, 1900, 1200], effects=eff, channels=["turn_rate", "speed_through_water"])

@machine
def tank(rng):
    A, k, dt = 2.2, .016 * rng.uniform(.7, 1.4), 2.
    def log(rng, j, n):
        q = .018 + .014 * steps(rng, n, dt, 120, None); h, H = rng.uniform(.6, 1.4), []
        for i in range(n):
            H.append(h)
            for _ in range(10): h = max(.02, h + dt / 10 * (q[i] - k * math.sqrt(h)) / A)
        h = np.array(H) + .0015 * rng.standard_normal(n)
        c = {"t_s": np.arange(1, n) * dt, "u.inflow_m3ps": q[:-1], "x.level": h[:-1], "z.level": h[1:], "m.level": (h + dt * q / A)[:-1], "z.inflow_kPa": (40 * q + .02 * rng.standard_normal(n))[1:], "m.inflow_kPa": (40 * q)[1:]}
        return c, {"level": [(-dt / A * np.sqrt(np.maximum(h, 0)))[:-1]], "inflow_kPa": []}
    eff = [dict(channel="level", cause="unknown", also=["hinge", "coupling"], size=None)]
    return dict(log=log, n=[900, 1100], effects=eff, channels=["level", "inflow_kPa"])

@machine
def train(rng):
    m0, a0, b0, c0, dt = 80., 1.3 * rng.uniform(.7, 1.4), .02 * rng.uniform(.7, 1.4), .004 * rng.uniform(.7, 1.4), 1.
    def log(rng, j, n):
        g = .006 * smooth(rng, n, dt, 300, 60); F = 9 * steps(rng, n, dt, 60, None); v, VV = 10., []
        for i in range(n):
            F[i] += .6 * (12 - abs(v)) * np.sign(v) * (abs(v) > 25); VV.append(v)
            for _ in range(10): v += dt / 10 * (F[i] - (a0 + b0 * abs(v) + c0 * v * v) * math.tanh(v / .05) - m0 * 9.81 * g[i]) / m0
        v = np.array(VV) + .01 * rng.standard_normal(n)
        acc = np.append(np.diff(np.array(VV)) / dt, 0) + .02 * rng.standard_normal(n)
        c = {"t_s": np.arange(n) * dt, "u.effort_kN": F, "x.v_kmph": v * 3.6, "x.slope_permil": 1000 * g, "z.accel": acc, "m.accel": F / m0}
        return {k: x[:-1] for k, x in c.items()}, {"accel": [x[:-1] for x in (sgn(v), v, v * np.abs(v), g)]}
    eff = [dict(channel="accel", cause="coupling", also=[], size=None), dict(channel="accel", cause="quadratic_drag", also=["viscous_friction"], size=None), dict(channel="accel", cause="coulomb_friction", also=[], size=None)]
    return dict(log=log, n=[1400, 1000], effects=eff, channels=["accel"])

def write(path, c):
    names = list(c)
    with open(path, "w") as f:
        f.write(",".join(names) + "\n")
        for row in zip(*(c[k] for k in names)): f.write(",".join("%.9g" % v for v in row) + "\n")

def asked(families):
    """What the command line asks for: its options, with family one of `families`; makes the folder."""
    p = argparse.ArgumentParser(); p.add_argument("--seed", type=int); p.add_argument("--family", default="each"); p.add_argument("--out"); p.add_argument("--truth")
    o = p.parse_args()
    if o.family in ("each", "any"): o.family = list(families)[o.seed % len(families)]
    os.makedirs(o.out, exist_ok=True)
    return o

def put(o, mac, logs, hold):
    """Writes the logs, the held-out one and the truth: with least squares over the right terms, the error that they leave."""
    for j, (c, b) in enumerate(logs): write("%s/run_%d.csv" % (o.out, j + 1), c)
    write(o.out + "/holdout_1.csv", hold[0])
    t = {"seed": o.seed, "family": o.family, "channels": [{"name": c} for c in mac["channels"]], "effects": mac["effects"], "holdout": {}}
    for ch in mac["channels"]:
        r = np.concatenate([c["z." + ch] - c["m." + ch] for c, b in logs]); rh = hold[0]["z." + ch] - hold[0]["m." + ch]
        d = {"rmse_before": float(np.sqrt(np.mean(rh ** 2)))}; d["rmse_true"] = d["rmse_before"]
        if hold[1][ch]:
            A = np.concatenate([np.column_stack(b[ch]) for c, b in logs]).astype(float); Ah = np.column_stack(hold[1][ch]).astype(float)
            w = np.linalg.lstsq(A, r, rcond=None)[0]
            d["rmse_least_squares"] = float(np.sqrt(np.mean((rh - Ah @ w) ** 2)))
        t["holdout"][ch] = d
    json.dump(t, open(o.truth, "w"), default=float)

def main():
    o = asked(M)
    rng = np.random.default_rng(o.seed * 7919 + 13)
    mac = M[o.family](rng)
    logs = [mac["log"](rng, j, n) for j, n in enumerate(mac["n"])]
    hold = logs.pop() if mac.get("differs") else mac["log"](rng, min(2, len(mac["n"])), mac["n"][0])
    put(o, mac, logs, hold)
if __name__ == "__main__": main()
