#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""neighbours.py --seed N [--family F] --out DIR --truth FILE: twenty-eight more machines; needs numpy.

Hydraulic cylinder by its two pressures, ram that leaks, winch whose load differs between logs, hovering over ground, heat exchanger, skid-steer
robot, ship in wind, pump, sounding rockets, steering gear that saturates before it lags, heated room, gear drive, car that coasts, actuator with
Stribeck friction, aircraft in roll, battery with a slow resistance, and one with nothing wrong. Drawn later: tyre, conveyor, levitation, reactor,
solar panel, brake, glider, telescope, ship in turns, stage with cables, and a mill with nothing wrong. Shares no code with the engine or the other
drawers. What each logs, with the columns of the true form, from which channels.py computes what least squares would leave."""
import math
import numpy as np
from newcomers import asked, put

def wave(rng, n, dt, slow, fast, k=6):
    t = np.arange(n) * dt
    w = 2 * np.pi / np.exp(rng.uniform(np.log(fast), np.log(slow), k)); a = rng.uniform(.4, 1, k)
    return (a[:, None] * np.sin(w[:, None] * t + rng.uniform(0, 6.28, k)[:, None])).sum(0) / np.sqrt((a * a).sum() / 2)

def stairs(rng, n, dt, hold, lo, hi):
    y, i = np.zeros(n), 0
    while i < n:
        k = max(1, int(rng.uniform(.5, 1.6) * hold / dt)); y[i:i + k] = rng.uniform(lo, hi); i += k
    return y

def nz(rng, s, n): return s * rng.standard_normal(n)
def E(ch, cause, *also): return {"channel": ch, "cause": cause, "also": list(also), "size": None}
M = {}
def machine(f): M[f.__name__] = f; return f

# hydraulic cylinder: force from load cell; nominal is pressures times areas; seal friction Coulomb + pressure dependent + viscous
@machine
def hydcyl(rng):
    dt = .01; A1, A2 = 1.26e-3, .76e-3
    fc, fp, fv = 220 * rng.uniform(.7, 1.4), 2.2e-5 * rng.uniform(.7, 1.4), 900 * rng.uniform(.6, 1.4)
    def log(j, n):
        x = .15 * wave(rng, n, dt, 6, 1.5); v = np.gradient(x, dt)
        F = 4000 * wave(rng, n, dt, 8, 2) + 3000
        p2 = 2e6 + 8e5 * wave(rng, n, dt, 10, 2)
        fr = (fc + fp * p2 * 1.0) * np.tanh(v / .002) + fv * v
        p1 = (F + fr + p2 * A2) / A1
        P1, P2 = p1 + nz(rng, 1.2e4, n), p2 + nz(rng, 1.2e4, n)
        z = F + nz(rng, 25, n); vm = v + nz(rng, .002, n)
        c = {"t_s": np.arange(n) * dt, "x.rod_mm": x * 1e3, "x.rod_mps": vm, "x.pA_bar": P1 / 1e5, "x.pB_bar": P2 / 1e5, "z.force_N": z, "m.force_N": P1 * A1 - P2 * A2}
        s = np.sign(vm)
        return c, {"force_N": [s, s * P2, vm]}
    return dict(log=log, n=[2400, 1800, 2000], effects=[E("force_N", "coulomb_friction"), E("force_N", "viscous_friction"), E("force_N", "load_friction", "product", "coulomb_friction")], channels=["force_N"])

# press: ram speed; nominal = flow/area; missing: leak with pressure, and compressibility (dp/dt)
@machine
def ram(rng):
    dt = .02; A = .008; kl = 4e-12 * rng.uniform(.7, 1.4); ck = 9e-12 * rng.uniform(.6, 1.3)
    def log(j, n):
        q = 4e-4 * np.clip(.5 + .6 * wave(rng, n, dt, 12, 2), -.2, 1.3)
        p = 6e6 + 4e6 * wave(rng, n, dt, 14, 3)
        z = (q - kl * p) / A + nz(rng, 6e-4, n)
        c = {"t_s": np.arange(n) * dt, "u.flow_lpm": q * 6e4, "x.p_MPa": p / 1e6 + nz(rng, .05, n), "x.oil_C": 45 + nz(rng, .1, n), "z.ram_mps": z, "m.ram_mps": q / A}
        return c, {"ram_mps": [p]}
    return dict(log=log, n=[1600, 1200, 1500], effects=[E("ram_mps", "coupling")], channels=["ram_mps"])

# winch: motor current; nominal = inertia only; gravity load (constant) with friction coulomb, viscous; load differs between logs
@machine
def winch(rng):
    dt = .02; J, kt = .9, 2.1; fc, fv = 3.4 * rng.uniform(.7, 1.4), 1.1 * rng.uniform(.6, 1.4); loads = rng.uniform(4, 12, 4)
    def log(j, n):
        v = 2.2 * wave(rng, n, dt, 9, 2); a = np.gradient(v, dt)
        i = (J * a + loads[j % 4] + fc * np.tanh(v / .03) + fv * v) / kt
        vm, am = v + nz(rng, .02, n), a + nz(rng, .15, n)
        c = {"t_s": np.arange(n) * dt, "x.drum_speed": vm, "x.drum_accel": am, "x.rope_m": 20 + np.cumsum(v) * dt * .2, "z.current_A": i + nz(rng, .12, n), "m.current_A": J * am / kt}
        return c, {"current_A": [np.sign(vm), vm, np.ones(n)]}
    return dict(log=log, n=[1800, 1500, 2000], effects=[E("current_A", "coulomb_friction"), E("current_A", "viscous_friction"), E("current_A", "bias")], channels=["current_A"])

# quadcopter vertical with ground effect and vertical drag; altitude rate predicted one step from noisy start
@machine
def hover(rng):
    dt = .02; m = 1.6; R = .25 * rng.uniform(.8, 1.3); d = .25 * rng.uniform(.7, 1.4); g = 9.81
    def log(j, n):
        ref = .9 + .6 * wave(rng, n, dt, 10, 3); ref = np.clip(ref, .25, 3)
        h, v, H, V, T = ref[0], 0., [], [], []
        for i in range(n):
            H.append(h); V.append(v); t = m * g + 8 * (ref[i] - h) - 5 * v + .6 * rng.standard_normal(); T.append(t)
            for _ in range(5):
                k = 1 / (1 - min(.6, (R / (4 * max(h, .15))) ** 2 * 6)); v += dt / 5 * (t * k / m - g - d * v); h = max(.1, h + dt / 5 * v)
        H, V, T = map(np.array, (H, V, T)); Hm, Vm = H + nz(rng, .005, n), V + nz(rng, .01, n)
        acc = (np.append(np.diff(V), 0) / dt)
        k = 1 / (1 - np.minimum(.6, (R / (4 * np.maximum(Hm, .15))) ** 2 * 6))
        c = {"t_s": np.arange(n) * dt, "u.thrust_N": T, "x.height_m": Hm, "x.climb_mps": Vm, "z.acc_mps2": acc + nz(rng, .08, n), "m.acc_mps2": T / m - g}
        return {a: b[:-1] for a, b in c.items()}, {"acc_mps2": [((k - 1) * T / m)[:-1], -Vm[:-1]]}
    return dict(log=log, n=[2500, 1800, 2200], effects=[E("acc_mps2", "unknown", "hinge", "product", "slope", "coupling"), E("acc_mps2", "viscous_friction")], channels=["acc_mps2"])

# heat exchanger: outlet temperature; nominal constant effectiveness; missing: effectiveness depends on flow (product), heat loss to ambient
@machine
def hex(rng):
    dt = 5.; e0 = .62; ke = .18 * rng.uniform(.7, 1.3); kl = .04 * rng.uniform(.7, 1.3)
    def log(j, n):
        f = 1 + .35 * wave(rng, n, dt, 1500, 150); f = np.clip(f, .3, 2); th = 75 + 6 * wave(rng, n, dt, 3000, 300); tc = 18 + 2 * wave(rng, n, dt, 6000, 900); ta = 15 + 6 * wave(rng, n, dt, 9000, 3000)
        z = th - (e0 - ke * (f - 1)) * (th - tc) - kl * (th - ta) + nz(rng, .15, n)
        c = {"t_s": np.arange(n) * dt, "u.flow_kgps": f + nz(rng, .005, n), "x.hot_in_degC": th + nz(rng, .05, n), "x.cold_in_degC": tc + nz(rng, .05, n), "x.ambient_degC": ta + nz(rng, .05, n), "z.hot_out_degC": z, "m.hot_out_degC": th - e0 * (th - tc)}
        return c, {"hot_out_degC": [f * (th - tc), th - tc, th - ta]}
    return dict(log=log, n=[900, 1300, 1000], effects=[E("hot_out_degC", "product", "unknown", "gain", "coupling", "hinge")], channels=["hot_out_degC"])

# wheeled robot: slip grows with accel command; turning scrub: yaw rate gain .93 ; encoder-based odom
@machine
def skid(rng):
    dt = .05; kg = .82 * rng.uniform(.92, 1.06); ks = .07 * rng.uniform(.7, 1.3)
    def log(j, n):
        v = .8 + .5 * wave(rng, n, dt, 10, 2); w = .8 * wave(rng, n, dt, 8, 1.5)
        vl, vr = v - .2 * w, v + .2 * w
        zv = v - ks * np.abs(w) * v + nz(rng, .015, n); zw = kg * w + nz(rng, .02, n)
        c = {"t_s": np.arange(n) * dt, "u.left_mps": vl, "u.right_mps": vr, "z.speed_mps": zv, "m.speed_mps": v, "z.yaw_rate_radps": zw, "m.yaw_rate_radps": w}
        return c, {"speed_mps": [-np.abs(w) * v], "yaw_rate_radps": [w]}
    return dict(log=log, n=[1400, 1000, 1600], effects=[E("speed_mps", "product", "unknown", "coupling"), E("yaw_rate_radps", "gain")], channels=["speed_mps", "yaw_rate_radps"])

# ship surge with quadratic drag and wind force proportional to (wind-v)|wind-v|
@machine
def ship(rng):
    dt = 1.; m = 1.2e6; d = 9e3 * rng.uniform(.7, 1.4); kw = 120 * rng.uniform(.6, 1.5)
    def log(j, n):
        F = 3.2e5 * (0.6 + .5 * wave(rng, n, dt, 500, 60)); W = 7 * wave(rng, n, dt, 600, 100)
        v, V = 4., []
        for i in range(n):
            V.append(v)
            for _ in range(4): r = W[i] - v; v += dt / 4 * (F[i] - d * v * abs(v) + kw * r * abs(r)) / m
        V = np.array(V); vm = V + nz(rng, .015, n); r = W - vm
        c = {"t_s": np.arange(1, n) * dt, "u.thrust_kN": F[:-1] / 1e3, "x.head_wind_mps": -W[:-1], "x.surge_mps": vm[:-1], "z.surge_mps": vm[1:], "m.surge_mps": (vm + F * dt / m)[:-1]}
        return c, {"surge_mps": [(-vm * np.abs(vm))[:-1], (r * np.abs(r))[:-1]]}
    return dict(log=log, n=[1800, 1400, 2000], effects=[E("surge_mps", "quadratic_drag"), ], channels=["surge_mps"])

# dc pump motor: speed with quadratic load; nominal linear; flow sensor fine
@machine
def pump(rng):
    dt = .02; J = .02; kq = 1.1e-4 * rng.uniform(.7, 1.4); tc = .12 * rng.uniform(.7, 1.4); kt = .12
    def log(j, n):
        i = 14 + 9 * wave(rng, n, dt, 8, 1); i = np.clip(i, 0, 40); w, W = 90., []
        for k in range(n):
            W.append(w)
            for _ in range(5): w += dt / 5 * (kt * i[k] - kq * w * abs(w) - tc * np.tanh(w / .5)) / J
        W = np.array(W); wm = W + nz(rng, .15, n)
        c = {"t_s": np.arange(1, n) * dt, "u.current": i[:-1], "x.omega": wm[:-1], "z.omega": wm[1:], "m.omega": (wm + kt * i * dt / J)[:-1],
             "z.flow": (.01 * W + nz(rng, .004, n))[1:], "m.flow": (.01 * W)[1:]}
        return c, {"omega": [(-wm * np.abs(wm))[:-1], np.ones(n - 1)], "flow": []}
    return dict(log=log, n=[1500, 1900, 1300], effects=[E("omega", "quadratic_drag"), E("omega", "bias", "coulomb_friction")], channels=["omega", "flow"])

# slender rocket: velocity change with drag exp density, thrust 4% low; different rockets
@machine
def sounding(rng):
    dt = .1; cds = 6e-4 * rng.uniform(.7, 1.4, 5); low = .95 * rng.uniform(.98, 1.02)
    def log(j, n):
        h, v, H, V, A = 0., 0., [], [], []; tb = 14 + 3 * rng.uniform(); a0 = 55 * rng.uniform(.9, 1.2)
        for k in range(n):
            H.append(h); V.append(v); a = a0 if k * dt < tb else 0.; A.append(a)
            for _ in range(4):
                v += dt / 4 * (a * low - 9.81 - cds[j % 5] * math.exp(-h / 8000) * v * abs(v)); h += dt / 4 * v
        H, V, A = map(np.array, (H, V, A)); vm, hm = V + nz(rng, .25, n), H + nz(rng, 2., n)
        c = {"t_s": np.arange(1, n) * dt, "u.thrust_mps2": A[:-1], "x.alt_m": hm[:-1], "x.climb_mps": vm[:-1], "z.climb_mps": vm[1:], "m.climb_mps": (vm + dt * (A - 9.81))[:-1]}
        return c, {"climb_mps": [(-dt * np.exp(-hm / 8000) * vm * np.abs(vm))[:-1], dt * A[:-1]]}
    return dict(log=log, n=[800, 700, 900], effects=[E("climb_mps", "quadratic_drag"), E("climb_mps", "coupling", "gain")], channels=["climb_mps"])

# servo position: backlash + lag, none else
@machine
def steergear(rng):
    dt = .02; tau = .12 * rng.uniform(.7, 1.4); lim = 22 * rng.uniform(.85, 1.1)
    def log(j, n):
        u = 16 * wave(rng, n, dt, 6, .8); y, Y = 0., []
        for k in range(n): Y.append(y); y += (np.clip(u[k], -lim, lim) - y) * (1 - math.exp(-dt / tau))
        z = np.array(Y) + nz(rng, .15, n)
        c = {"t_s": np.arange(n) * dt, "u.command_deg": u, "x.speed_kmh": 60 + 10 * wave(rng, n, dt, 30, 10), "z.rudder_deg": z, "m.rudder_deg": u}
        y, Y = 0., []
        for k in range(n): Y.append(y); y += (np.clip(u[k], -lim, lim) - y) * (1 - math.exp(-dt / tau))
        return c, {"rudder_deg": [np.array(Y) - u]}
    return dict(log=log, n=[1800, 1500, 1500], effects=[E("rudder_deg", "lag", "delay"), E("rudder_deg", "saturation")], channels=["rudder_deg"])

# building zone: temperature step per minute; missing solar gain and window loss
@machine
def room(rng):
    dt = 60.; C = 3e6; UA = 90 * rng.uniform(.7, 1.4); gs = 2.4 * rng.uniform(.6, 1.4)
    def log(j, n):
        q = 2500 * np.clip(wave(rng, n, dt, 30000, 4000), 0, 2); sun = 500 * np.clip(wave(rng, n, dt, 80000, 30000), 0, 2); to = 5 + 6 * wave(rng, n, dt, 86400, 30000)
        T, TT = 20., []
        for k in range(n): TT.append(T); T += dt / C * (q[k] + gs * sun[k] - UA * (T - to[k]))
        TT = np.array(TT); tm = TT + nz(rng, .004, n)
        c = {"t_s": np.arange(1, n) * dt, "u.heater_W": q[:-1], "x.sun_Wpm2": sun[:-1], "x.outside": to[:-1], "x.zone": tm[:-1], "z.zone": tm[1:], "m.zone": (tm + dt / C * q)[:-1]}
        return c, {"zone": [sun[:-1], (tm - to)[:-1]]}
    return dict(log=log, n=[1440, 2000, 1440], effects=[E("zone", "coupling"), E("zone", "coupling", "slope", "viscous_friction")], channels=["zone"])

# gear drive: torque sensor; periodic tooth error with motor angle, viscous with temperature
@machine
def geared(rng):
    dt = .01; J = .03; fv = .02 * rng.uniform(.7, 1.4); cog = .18 * rng.uniform(.7, 1.3); N = 1; eff = .88 * rng.uniform(.95, 1.04)
    def log(j, n):
        w = 30 + 20 * wave(rng, n, dt, 8, 2); th = np.cumsum(w) * dt; tin = 2 + 1.2 * wave(rng, n, dt, 6, 1)
        z = 5 * eff * tin - fv * w + nz(rng, .06, n)
        c = {"t_s": np.arange(n) * dt, "u.motor_Nm": tin, "x.motor_radps": w + nz(rng, .1, n), "x.motor_rad": np.mod(th, 2 * np.pi), "z.output_Nm": z, "m.output_Nm": 5 * tin}
        return c, {"output_Nm": [tin, w]}
    return dict(log=log, n=[1500, 2000, 1400], effects=[E("output_Nm", "gain"), E("output_Nm", "viscous_friction", "coupling")], channels=["output_Nm"])

# car longitudinal with grade unmeasured (AR noise), rolling resistance, aero; accel channel plus wheel speed ok
@machine
def coast(rng):
    dt = .1; c0, c2 = .15 * rng.uniform(.7, 1.4), 4.2e-4 * rng.uniform(.7, 1.4); tau = .35
    def log(j, n):
        u = 1.2 * wave(rng, n, dt, 30, 5); v, f, V, A = 20., 0., [], []
        for k in range(n):
            f += (u[k] - f) * (1 - math.exp(-dt / tau)); a = f - (c0 + c2 * v * v) * np.sign(v); V.append(v); A.append(a); v = v + a * dt + .01 * (20 - v) * dt
        V, A = np.array(V), np.array(A); F, f = [], 0.
        for k in range(n): f += (u[k] - f) * (1 - math.exp(-dt / tau)); F.append(f)
        vm = V + nz(rng, .05, n)
        c = {"t_s": np.arange(n) * dt, "u.pedal": u, "x.speed_mps": vm, "z.ax_mps2": A + nz(rng, .05, n), "m.ax_mps2": u, "z.wheel": V / .3 + nz(rng, .2, n), "m.wheel": vm / .3}
        return c, {"ax_mps2": [np.array(F) - u, np.ones(n), vm * vm], "wheel": []}
    return dict(log=log, n=[1800, 1500, 1500], effects=[E("ax_mps2", "lag", "delay"), E("ax_mps2", "quadratic_drag", "viscous_friction", "coupling"), ], channels=["ax_mps2", "wheel"])

# ball valve actuator: Stribeck friction torque vs current, differs by direction
@machine
def actuator(rng):
    dt = .005; fc, fs, vs, fv = 1.0 * rng.uniform(.7, 1.3), .9 * rng.uniform(.7, 1.4), .25, .35
    def log(j, n):
        w = 1.4 * wave(rng, n, dt, 5, 1.2); a = np.gradient(w, dt)
        fr = (fc + fs * np.exp(-(w / vs) ** 2)) * np.tanh(w / .01) + fv * w
        wm = w + nz(rng, .004, n); am = a + nz(rng, .2, n)
        c = {"t_s": np.arange(n) * dt, "x.w": wm, "x.alpha": am, "z.tau": .05 * a + fr + nz(rng, .06, n), "m.tau": .05 * am}
        return c, {"tau": [np.sign(wm), np.sign(wm) * np.exp(-(wm / vs) ** 2), wm]}
    return dict(log=log, n=[3000, 2200, 2600], effects=[E("tau", "coulomb_friction"), E("tau", "viscous_friction")], channels=["tau"])

# aircraft roll: roll rate one step; missing damping Lp p V, aileron effectiveness ~ V^2 modeled const
@machine
def roll(rng):
    dt = .02; lp = .18 * rng.uniform(.7, 1.3); la = .09 * rng.uniform(.8, 1.2)
    def log(j, n):
        V = 22 + 5 * wave(rng, n, dt, 20, 5); da = .15 * wave(rng, n, dt, 4, .8); p, P = 0., []
        for k in range(n):
            P.append(p)
            for _ in range(4): p += dt / 4 * (la * V[k] ** 2 * da[k] - lp * V[k] * p)
        P = np.array(P); pm = P + nz(rng, .01, n)
        c = {"t_s": np.arange(1, n) * dt, "u.aileron": da[:-1], "x.airspeed": (V + nz(rng, .2, n))[:-1], "x.p": pm[:-1], "z.p": pm[1:], "m.p": (pm + dt * la * V ** 2 * da)[:-1]}
        return c, {"p": [(-V * pm)[:-1]]}
    return dict(log=log, n=[1800, 1500, 2000], effects=[E("p", "product", "viscous_friction")], channels=["p"])

# battery: terminal voltage; missing internal resistance and slow drift of ocv; plus healthy temperature
@machine
def pack(rng):
    dt = 1.; R0 = .03 * rng.uniform(.7, 1.3); R1, tau = .025, 25. * rng.uniform(.7, 1.4)
    def log(j, n):
        I = np.clip(8 + 12 * wave(rng, n, dt, 120, 15), -10, 40); s, S = 0., []
        soc = .95 - np.cumsum(I) * dt / 3600 / 40; f, Fv = 0., []
        for k in range(n): f += (I[k] - f) * (1 - math.exp(-dt / tau)); Fv.append(f)
        ocv = 46 + 6 * soc; Fv = np.array(Fv)
        c = {"t_s": np.arange(n) * dt, "u.current_A": I, "x.soc": soc, "z.volt_V": ocv - R0 * I - R1 * Fv + nz(rng, .02, n), "m.volt_V": ocv,
             "z.cell_degC": 25 + nz(rng, .05, n), "m.cell_degC": np.full(n, 25.)}
        return c, {"volt_V": [I, Fv], "cell_degC": []}
    return dict(log=log, n=[1500, 1200, 1600], effects=[E("volt_V", "coupling", "lag")], channels=["volt_V", "cell_degC"])

# nothing wrong: closed-loop, AR(1) noise, start-noise
@machine
def nothing(rng):
    dt = .05
    def log(j, n):
        u = wave(rng, n, dt, 8, 1); v, V = 0., []
        for k in range(n): V.append(v); v += dt * (3 * u[k] - 1.2 * v)
        V = np.array(V); vm = V + nz(rng, .02, n); e = np.zeros(n); w = nz(rng, .1, n)
        for i in range(1, n): e[i] = .85 * e[i - 1] + w[i]
        p = 5 + 2 * u
        c = {"t_s": np.arange(1, n) * dt, "u.cmd": u[:-1], "x.v": vm[:-1], "z.v": vm[1:], "m.v": (vm + dt * (3 * u - 1.2 * vm))[:-1], "z.p": (p + e)[1:], "m.p": p[1:],
             "z.q": np.round((V * 3)[1:] / .25 + rng.uniform(-.4, .4, n - 1)) * .25, "m.q": V[1:] * 3}
        return c, {"v": [], "p": [], "q": []}
    return dict(log=log, n=[1800, 1200, 1500], effects=[], channels=["v", "p", "q"])

# bicycle: side force of a tyre builds up over a length rolled, not a time; nominal is stiffness times slip angle
@machine
def tyre(rng):
    dt = .02; C = 1500.; length = .5 * rng.uniform(.6, 1.5)
    def log(j, n):
        v = 7 + 3 * wave(rng, n, dt, 25, 8); v = np.clip(v, 2.5, 14); slip = .03 * wave(rng, n, dt, 5, .6); f, F = 0., []
        for k in range(n): F.append(f); f += (C * slip[k] - f) * (1 - math.exp(-v[k] * dt / length))
        F = np.array(F)
        c = {"t_s": np.arange(n) * dt, "u.slip_rad": slip, "x.road_mps": v + nz(rng, .05, n), "z.side_N": F + nz(rng, 1.5, n), "m.side_N": C * slip,
             "z.wheel_radps": v / .34 + nz(rng, .2, n), "m.wheel_radps": v / .34}
        return c, {"side_N": [F - C * slip], "wheel_radps": []}
    return dict(log=log, n=[1600, 1300, 1800], effects=[E("side_N", "lag", "delay")], channels=["side_N", "wheel_radps"])

# conveyor: belt slips on the drum with what lies on it; the motor's torque lacks the rolling resistance of belt and load
@machine
def conveyor(rng):
    dt = .1; s = 2.2e-4 * rng.uniform(.7, 1.4); c0, c1 = 60 * rng.uniform(.7, 1.4), .16 * rng.uniform(.7, 1.3)
    def log(j, n):
        d = np.clip(1.5 + .6 * wave(rng, n, dt, 40, 8), .4, 3); load = np.clip(350 + 180 * wave(rng, n, dt, 60, 12), 0, None); a = np.gradient(d, dt)
        c = {"t_s": np.arange(n) * dt, "u.drum_mps": d, "x.load_kg": load + nz(rng, 4, n), "z.belt_mps": d * (1 - s * load) + nz(rng, .01, n), "m.belt_mps": d,
             "z.motor_Nm": (800 + load) * a * .2 + c0 + c1 * load + nz(rng, 3, n), "m.motor_Nm": (800 + load) * a * .2}
        return c, {"belt_mps": [d * load], "motor_Nm": [np.ones(n), load]}
    return dict(log=log, n=[1400, 1100, 1500], channels=["belt_mps", "motor_Nm"],
                effects=[E("belt_mps", "product"), E("motor_Nm", "bias", "coulomb_friction"), E("motor_Nm", "coupling")])

# levitation: force by the square of current over gap; nominal is its tangent at the middle
@machine
def levitation(rng):
    dt = .002; m, g0, i0 = .5, .012, 1.8 * rng.uniform(.8, 1.2); K = m * 9.81 * (g0 / i0) ** 2
    def log(j, n):
        i = i0 * (1 + .16 * wave(rng, n, dt, 1, .15)); g = g0 * (1 + .14 * wave(rng, n, dt, 1.2, .2))
        a = 9.81 - K / m * (i / g) ** 2; nominal = -2 * 9.81 * (i / i0 - g / g0)
        c = {"t_s": np.arange(n) * dt, "u.coil_A": i, "x.gap_mm": (g + nz(rng, 2e-5, n)) * 1e3, "z.acc_mps2": a + nz(rng, .15, n), "m.acc_mps2": nominal}
        return c, {"acc_mps2": [a - nominal]}
    return dict(log=log, n=[1500, 1500, 1200], effects=[E("acc_mps2", "unknown", "product")], channels=["acc_mps2"])

# reactor with jacket: temperature a step ahead; nominal lacks the heat of the reaction, which grows with the temperature as Arrhenius says
@machine
def reactor(rng):
    dt = 10.; h = 3.5e-3 * rng.uniform(.7, 1.3); ke = 6500 * rng.uniform(.85, 1.15)
    def log(j, n):
        tj = 328 + 12 * wave(rng, n, dt, 6000, 900); con = np.clip(1.4 + .6 * wave(rng, n, dt, 5000, 700), .1, 3); T, TT, heat = 335., [], []
        for k in range(n):
            q = .008 * con[k] * math.exp(-ke * (1 / T - 1 / 335)); TT.append(T); heat.append(q * dt); T += dt * (h * 2 * (tj[k] - T) + q)
        TT, heat = np.array(TT), np.array(heat); tm = TT + nz(rng, .02, n)
        c = {"t_s": np.arange(1, n) * dt, "u.jacket_K": tj[:-1], "x.conc_molpl": (con + nz(rng, .01, n))[:-1], "x.bulk_K": tm[:-1], "z.bulk_K": tm[1:],
             "m.bulk_K": (tm + dt * h * 2 * (tj - tm))[:-1]}
        return c, {"bulk_K": [heat[:-1]]}
    return dict(log=log, n=[1500, 1200, 1400], effects=[E("bulk_K", "unknown", "product", "coupling")], channels=["bulk_K"])

# solar panel: less power the warmer its cells, and less through dust, of which every log has another share
@machine
def solar(rng):
    dt = 30.; k = .0042 * rng.uniform(.8, 1.2); dust = rng.uniform(.03, .12, 4)
    def log(j, n):
        G = np.clip(600 + 280 * wave(rng, n, dt, 9000, 300), 20, 1200); ta = 18 + 7 * wave(rng, n, dt, 20000, 4000); tc = ta + .03 * G
        c = {"t_s": np.arange(n) * dt, "x.sun_Wpm2": G, "x.cell_degC": tc + nz(rng, .3, n), "z.power_W": .3 * G * (1 - dust[j % 4]) * (1 - k * (tc - 25)) + nz(rng, 1.2, n),
             "m.power_W": .3 * G, "z.back_degC": tc + nz(rng, .5, n), "m.back_degC": ta + .03 * G}
        return c, {"power_W": [G, G * tc], "back_degC": []}
    return dict(log=log, n=[1300, 1500, 1200], channels=["power_W", "back_degC"], effects=[E("power_W", "gain", "coupling"), E("power_W", "product")])

# brake: pressure acts late, and the lining fades with the heat of the disc
@machine
def brake(rng):
    dt = .02; tau, fade = .09 * rng.uniform(.7, 1.4), 5.5e-4 * rng.uniform(.7, 1.4)
    def log(j, n):
        p = np.clip(25 + 22 * wave(rng, n, dt, 8, 1.2), 0, 80); w = 60 + 15 * wave(rng, n, dt, 20, 6); f, T, F, TT = 0., 120., [], []
        for k in range(n):
            F.append(f); TT.append(T); f += (p[k] - f) * (1 - math.exp(-dt / tau)); T += dt * (.04 * f * w[k] / 10 - .05 * (T - 25))
        F, TT = np.array(F), np.array(TT); z = 8 * F * (1 - fade * (TT - 100))
        c = {"t_s": np.arange(n) * dt, "u.pressure_bar": p, "x.wheel_radps": w + nz(rng, .3, n), "x.disc_degC": TT + nz(rng, 2, n), "z.brake_Nm": z + nz(rng, 5, n), "m.brake_Nm": 8 * p}
        return c, {"brake_Nm": [F - p, F, F * TT]}
    return dict(log=log, n=[1800, 1500, 1600], effects=[E("brake_Nm", "lag", "delay"), E("brake_Nm", "product", "unknown")], channels=["brake_Nm"])

# glider: along its path gravity alone is predicted; missing are the drag of its shape and that of its lift
@machine
def glider(rng):
    dt = .1; c0, c1 = 3.2e-4 * rng.uniform(.7, 1.3), 190 * rng.uniform(.7, 1.4)
    def log(j, n):
        v = np.clip(30 + 7 * wave(rng, n, dt, 40, 8), 18, 55); load = np.clip(1 + .35 * wave(rng, n, dt, 15, 3), .3, 2.2); path = -.06 + .05 * wave(rng, n, dt, 30, 6)
        c = {"t_s": np.arange(n) * dt, "x.airspeed_mps": v + nz(rng, .15, n), "x.load_g": load + nz(rng, .01, n), "x.path_rad": path, "z.along_mps2": -9.81 * np.sin(path) - c0 * v * v - c1 * (load / v) ** 2 + nz(rng, .05, n),
             "m.along_mps2": -9.81 * np.sin(path)}
        return c, {"along_mps2": [v * v, (load / v) ** 2]}
    return dict(log=log, n=[1500, 1800, 1300], effects=[E("along_mps2", "quadratic_drag"), E("along_mps2", "unknown", "product", "coupling")], channels=["along_mps2"])

# telescope: the worm of the drive is out of centre and its tooth bears twice a turn; its clock is a little fast
@machine
def telescope(rng):
    dt = .5; a, b, fast = 4.5 * rng.uniform(.7, 1.3), 2.2 * rng.uniform(.7, 1.3), .9 * rng.uniform(.7, 1.3); ph = rng.uniform(0, 6.28, 2)
    def log(j, n):
        rate = 15 * (1 + .25 * wave(rng, n, dt, 300, 60)); q = np.cumsum(rate) * dt * 2 * np.pi / 2160 + rng.uniform(0, 6.28)
        z = rate + fast + a * np.cos(q + ph[0]) + b * np.cos(2 * q + ph[1])
        c = {"t_s": np.arange(n) * dt, "u.rate_asps": rate, "x.worm_rad": np.mod(q, 2 * np.pi), "x.tube_degC": 8 + np.cumsum(nz(rng, .01, n)), "z.sky_asps": z + nz(rng, .8, n), "m.sky_asps": rate}
        return c, {"sky_asps": [np.ones(n), np.sin(q), np.cos(q), np.sin(2 * q), np.cos(2 * q)]}
    return dict(log=log, n=[1400, 1200, 1500], effects=[E("sky_asps", "periodic", "slope"), E("sky_asps", "bias")], channels=["sky_asps"])

# ship in turns: loses speed with the square of the turn rate, and turns less at large rudder than the linear law says
@machine
def turner(rng):
    dt = 1.; T, K, al, loss = 12., .05, 900 * rng.uniform(.7, 1.4), 22 * rng.uniform(.7, 1.4)
    def log(j, n):
        rud = .35 * wave(rng, n, dt, 300, 50); th = .08 * (1 + .3 * wave(rng, n, dt, 500, 150)); r, v, R, V = 0., 6., [], []
        for k in range(n):
            R.append(r); V.append(v)
            for _ in range(4): r += dt / 4 * (K * rud[k] - r - al * r ** 3) / T; v += dt / 4 * (th[k] - .0022 * v * abs(v) - loss * r * r)
        R, V = np.array(R), np.array(V); rm, vm = R + nz(rng, 5e-5, n), V + nz(rng, .004, n)
        c = {"t_s": np.arange(1, n) * dt, "u.rudder_rad": rud[:-1], "u.engine_mps2": th[:-1], "x.turn_radps": rm[:-1], "x.surge_mps": vm[:-1], "z.turn_radps": rm[1:], "m.turn_radps": (rm + dt * (K * rud - rm) / T)[:-1],
             "z.surge_mps": vm[1:], "m.surge_mps": (vm + dt * (th - .0022 * vm * np.abs(vm)))[:-1]}
        return c, {"turn_radps": [(rm ** 3)[:-1]], "surge_mps": [(rm * rm)[:-1]]}
    return dict(log=log, n=[1800, 1500, 1600], channels=["turn_radps", "surge_mps"],
                effects=[E("turn_radps", "unknown", "quadratic_drag", "product"), E("surge_mps", "product", "unknown")])

# linear stage: its cables pull it back and its guide rubs; the force of a second axis is well
@machine
def stage(rng):
    dt = .01; k, fc, x0 = 38 * rng.uniform(.7, 1.4), 4.5 * rng.uniform(.7, 1.4), .1 * rng.uniform(-1, 1)
    def log(j, n):
        x = .3 * wave(rng, n, dt, 7, 1.5); v = np.gradient(x, dt); a = np.gradient(v, dt); vm, am, b = v + nz(rng, .003, n), a + nz(rng, .05, n), 1.5 * wave(rng, n, dt, 3, .8)
        c = {"t_s": np.arange(n) * dt, "x.pos_m": x, "x.vel_mps": vm, "x.acc_mps2": am, "z.force_N": 12 * a + k * (x - x0) + fc * np.tanh(v / .004) + nz(rng, .5, n), "m.force_N": 12 * am,
             "z.cross_N": 5 * b + nz(rng, .3, n), "m.cross_N": 5 * b}
        return c, {"force_N": [x, np.ones(n), np.sign(vm)], "cross_N": []}
    return dict(log=log, n=[2000, 1500, 1800], channels=["force_N", "cross_N"],
                effects=[E("force_N", "coulomb_friction"), E("force_N", "coupling"), E("force_N", "bias", "coulomb_friction")])

# mill with nothing wrong: features that wander by chance, wild readings, noise that lasts, a start that is read with noise
@machine
def mill(rng):
    dt = .2
    def log(j, n):
        walk = lambda s: np.cumsum(nz(rng, s, n)); feed = 2 + .6 * wave(rng, n, dt, 60, 10); e = np.zeros(n); w, v, V = nz(rng, .05, n), 20., []
        for k in range(n): e[k] = (.97 * e[k - 1] if k else 0) + w[k]; V.append(v); v += dt * .5 * (10 * feed[k] - v)
        V = np.array(V); vm = V + nz(rng, .1, n); p = 30 + 12 * feed
        c = {"t_s": np.arange(1, n) * dt, "u.feed_kgps": feed[:-1], "x.drum_rpm": vm[:-1], "x.oil_degC": (40 + walk(.05))[:-1], "x.room_degC": (20 + walk(.02))[:-1], "z.drum_rpm": vm[1:],
             "m.drum_rpm": (vm + dt * .5 * (10 * feed - vm))[:-1], "z.power_kW": (p + .8 * rng.standard_t(4, n))[1:], "m.power_kW": p[1:], "z.shell_degC": (60 + 3 * feed + e)[1:], "m.shell_degC": (60 + 3 * feed)[1:]}
        return c, {"drum_rpm": [], "power_kW": [], "shell_degC": []}
    return dict(log=log, n=[1800, 1300, 1600], effects=[], channels=["drum_rpm", "power_kW", "shell_degC"])

def main():
    o = asked(M)
    mac = M[o.family](np.random.default_rng(o.seed * 6007 + 29))
    put(o, mac, [mac["log"](j, n) for j, n in enumerate(mac["n"])], mac["log"](len(mac["n"]), mac["n"][0]))
if __name__ == "__main__": main()
