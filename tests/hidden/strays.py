#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""strays.py --seed N [--family F] --out DIR --truth FILE: thirteen more machines; needs numpy.

Propeller that loses thrust with speed, motor that cogs, strapdown sensors, aeroplane on the runway, yacht's rudder, damper strut, sonar in water that
warms, balance that creeps, mine hoist on a rope that stretches, eddy-current brake, survey vehicle whose antenna is off its axis and late, Peltier
cooler, and a buoy with nothing wrong. From textbooks of each trade. Shares no code with the engine; of the other drawers the writer and the
courses of commands. What each logs, with the columns of the true form, from which channels.py computes what least squares would leave."""
import numpy as np
from neighbours import E, nz, stairs, wave
from newcomers import asked, put

M = {}
def machine(f): M[f.__name__] = f; return f
def near(rng, a=.7, b=1.4): return rng.uniform(a, b)

def late(u, tau, dt, y=None):
    """First-order lag of u, from its first value or from y."""
    out, y = np.empty(len(u)), u[0] if y is None else y
    for k, v in enumerate(u): out[k] = y; y += (v - y) * -np.expm1(-dt / tau)
    return out

# propeller: thrust falls with the speed of advance times the revolutions, and with nothing else of the air; the bench model knows n^2 alone
@machine
def propeller(rng):
    dt = .05; a, b = 2.6e-3, 6.5e-3 * near(rng)
    def log(j, n):
        rps = np.clip(60 + 22 * wave(rng, n, dt, 9, 1.2), 10, 120); v = np.clip(9 + 6 * wave(rng, n, dt, 25, 5), 0, 25)
        c = {"t_s": np.arange(n) * dt, "u.prop_rps": rps, "x.airspeed_mps": v + nz(rng, .12, n), "x.battery_V": 22 - .0006 * np.arange(n) * dt * 10 - .02 * rps + nz(rng, .03, n),
             "z.thrust_N": a * rps ** 2 - b * rps * v + nz(rng, .15, n), "m.thrust_N": a * rps ** 2}
        return c, {"thrust_N": [-rps * v]}
    return dict(log=log, n=[1600, 1300, 1800], channels=["thrust_N"], effects=[E("thrust_N", "product", "unknown")])

# torque motor: teeth of the rotor are drawn to the slots, twelve times a turn, and the bearing rubs; the angle is unwrapped
@machine
def cogging(rng):
    dt = .004; J, kt = 2e-3, .11; cog, fc = .05 * near(rng), .035 * near(rng); ph = rng.uniform(0, 6.28)
    def log(j, n):
        w = 2.4 * wave(rng, n, dt, 4, .9); q = np.cumsum(w) * dt; a = np.gradient(w, dt); wm, am = w + nz(rng, .01, n), a + nz(rng, .6, n)
        c = {"t_s": np.arange(n) * dt, "x.rotor_rad": q, "x.rotor_radps": wm, "x.rotor_radps2": am, "z.amps": (J * a + fc * np.tanh(w / .02) + cog * np.sin(12 * q + ph)) / kt + nz(rng, .06, n), "m.amps": J * am / kt}
        return c, {"amps": [np.sign(wm), np.sin(12 * q), np.cos(12 * q)]}
    return dict(log=log, n=[3000, 2500, 2400], channels=["amps"], effects=[E("amps", "coulomb_friction"), E("amps", "periodic", "slope")])

# strapdown sensors on a shaker: the axis of one accelerometer is askew, its scale is off; the gyro's zero follows the warmth; the third is well
@machine
def strapdown(rng):
    dt = .02; sk, sc, kt, b = .035 * near(rng), 1 + .02 * near(rng), .012 * near(rng), .06 * near(rng)
    def log(j, n):
        ax, ay, w = 5 * wave(rng, n, dt, 6, .7), 4 * wave(rng, n, dt, 5, .8), .5 * wave(rng, n, dt, 10, 2); T = 22 + 14 * (1 - np.exp(-np.arange(n) / (.45 * n))) + 2 * wave(rng, n, dt, 60, 20)
        c = {"t_s": np.arange(n) * dt, "x.table_x_mps2": ax, "x.table_y_mps2": ay, "x.case_degC": T + nz(rng, .1, n), "x.table_radps": w, "z.ax": sc * ax + sk * ay + nz(rng, .08, n), "m.ax": ax,
             "z.gyro": w + kt * (T - 25) + b + nz(rng, .06, n), "m.gyro": w, "z.ay": ay + nz(rng, .1, n), "m.ay": ay}
        return c, {"ax": [ax, ay], "gyro": [T, np.ones(n)], "ay": []}
    return dict(log=log, n=[1800, 1500, 1400], channels=["ax", "gyro", "ay"], effects=[E("ax", "gain"), E("ax", "coupling", "slope"), E("gyro", "coupling", "slope"), E("gyro", "bias")])

# aeroplane rolling on the runway: engines alone are predicted; the wheels roll hard, less where the wing carries, and the air drags
@machine
def runway(rng):
    dt = .1; mu, cd, cl = .024 * near(rng), 6e-4 * near(rng), 2.2e-3
    def log(j, n):
        v = np.clip(32 + 19 * wave(rng, n, dt, 60, 10), 2, 75); th = 1.6 + 1.1 * wave(rng, n, dt, 40, 6); vm = v + nz(rng, .2, n)
        c = {"t_s": np.arange(n) * dt, "u.thrust_mps2": th, "x.ground_speed_mps": vm, "x.flap_deg": stairs(rng, n, dt, 25, 0, 20), "z.along_mps2": th - mu * (9.81 - cl * v * v) - cd * v * v + nz(rng, .06, n), "m.along_mps2": th}
        return c, {"along_mps2": [np.ones(n), vm * vm]}
    return dict(log=log, n=[1400, 1200, 1600], channels=["along_mps2"], effects=[E("along_mps2", "quadratic_drag"), E("along_mps2", "bias", "coulomb_friction")])

# yacht: the rudder turns it with the square of the speed, where the autopilot's model takes the design speed; the hull damps the turn
@machine
def yacht(rng):
    dt = .2; N, v0, damp = .16, 3., .22 * near(rng)
    def log(j, n):
        v = np.clip(3.3 + 1.1 * wave(rng, n, dt, 60, 15), .6, 6); rud = .3 * wave(rng, n, dt, 12, 2.5); r, R = 0., []
        for k in range(n):
            R.append(r)
            for _ in range(4): r += dt / 4 * (N * (v[k] / v0) ** 2 * rud[k] - damp * r)
        R = np.array(R); rm = R + nz(rng, .0015, n); vm = v + nz(rng, .03, n)
        c = {"t_s": np.arange(1, n) * dt, "u.rudder_rad": rud[:-1], "x.log_mps": vm[:-1], "x.turn_radps": rm[:-1], "x.heel_deg": (12 + 6 * wave(rng, n, dt, 40, 4))[:-1], "z.turn_radps": rm[1:], "m.turn_radps": (rm + dt * N * rud)[:-1]}
        return c, {"turn_radps": [(rud * vm ** 2)[:-1], rud[:-1], rm[:-1]]}
    return dict(log=log, n=[1700, 1500, 1400], channels=["turn_radps"], effects=[E("turn_radps", "product", "unknown", "gain"), E("turn_radps", "viscous_friction")])

# damper strut: oil through an orifice, a gas spring, the friction of its seal; nothing of it is predicted but the mass on top
@machine
def strut(rng):
    dt = .01; c2, k, fc, F0 = 900 * near(rng), 1500 * near(rng), 55 * near(rng), 120 * near(rng)
    def log(j, n):
        x = .06 * wave(rng, n, dt, 5, .9); v = np.gradient(x, dt); a = np.gradient(v, dt); vm = v + nz(rng, .004, n); am = a + nz(rng, .15, n)
        c = {"t_s": np.arange(n) * dt, "x.stroke_mm": x * 1e3, "x.stroke_mmps": vm * 1e3, "x.top_mps2": am, "z.force_N": 40 * a + c2 * v * np.abs(v) + k * x + F0 + fc * np.tanh(v / .005) + nz(rng, 9, n), "m.force_N": 40 * am}
        return c, {"force_N": [vm * np.abs(vm), x, np.ones(n), np.sign(vm)]}
    return dict(log=log, n=[2400, 2000, 1800], channels=["force_N"],
                effects=[E("force_N", "quadratic_drag", "viscous_friction"), E("force_N", "coupling"), E("force_N", "coulomb_friction"), E("force_N", "bias")])

# sonar: sound runs faster in warm water, so that far echoes come early; its electronics add a length of their own
@machine
def sonar(rng):
    dt = .5; k, b = .0021 * near(rng), .05 * near(rng)
    def log(j, n):
        d = np.clip(22 + 11 * wave(rng, n, dt, 200, 30), 1, 60); T = 12 + 5 * wave(rng, n, dt, 600, 100)
        c = {"t_s": np.arange(n) * dt, "x.depth_plan_m": d, "x.water_degC": T + nz(rng, .05, n), "x.salt_psu": 33 + .4 * wave(rng, n, dt, 300, 60), "z.echo_m": d * (1 - k * (T - 10)) + b + nz(rng, .08, n), "m.echo_m": d}
        return c, {"echo_m": [d, d * T, np.ones(n)]}
    return dict(log=log, n=[1200, 1000, 1100], channels=["echo_m"], effects=[E("echo_m", "product", "gain", "unknown"), E("echo_m", "bias")])

# balance: its spring creeps after a load, by a share of it, over some minutes; warmth moves its zero
@machine
def balance(rng):
    dt = 2.; sh, tau, kt = .035 * near(rng), 90 * near(rng), .12 * near(rng)
    def log(j, n):
        m = np.abs(stairs(rng, n, dt, 150, 0, 200)); T = 21 + 3 * wave(rng, n, dt, 2500, 500)
        c = {"t_s": np.arange(n) * dt, "u.load_g": m, "x.room_degC": T + nz(rng, .05, n), "x.room_pct": 45 + 6 * wave(rng, n, dt, 3000, 400), "z.shown_g": m + sh * late(m, tau, dt) + kt * (T - 20) + nz(rng, .25, n), "m.shown_g": m}
        return c, {"shown_g": [late(m, tau, dt), T, np.ones(n)]}
    return dict(log=log, n=[1300, 1600, 1200], channels=["shown_g"], effects=[E("shown_g", "coupling", "lag", "gain"), E("shown_g", "coupling", "slope")])

# mine hoist: the rope gives with the load and its length; the cage's acceleration is well
@machine
def hoist(rng):
    dt = .2; c0 = 2.4e-5 * near(rng)
    def log(j, n):
        L = np.clip(420 + 200 * wave(rng, n, dt, 150, 40), 20, 900); F = stairs(rng, n, dt, 40, 20, 90) + 1.5 * wave(rng, n, dt, 8, 2); a = np.gradient(np.gradient(L, dt), dt)
        c = {"t_s": np.arange(n) * dt, "x.drum_m": L, "x.rope_kN": F + nz(rng, .3, n), "x.motor_degC": 50 + np.cumsum(nz(rng, .03, n)), "z.cage_m": L + c0 * F * L + nz(rng, .06, n), "m.cage_m": L, "z.cage_mps2": a + nz(rng, .02, n), "m.cage_mps2": a}
        return c, {"cage_m": [F * L], "cage_mps2": []}
    return dict(log=log, n=[1500, 1300, 1700], channels=["cage_m", "cage_mps2"], effects=[E("cage_m", "product", "unknown", "gain")])

# eddy-current brake of a drop tower: the force rises with the speed, peaks at a speed of its own and falls again; the wheels rub
@machine
def eddy(rng):
    dt = .02; F, vc, fc = 14 * near(rng), 6 * near(rng, .8, 1.2), .5 * near(rng)
    def log(j, n):
        v = 10 + 7.5 * wave(rng, n, dt, 12, 2.5); v = np.abs(v) + .05; vm = v + nz(rng, .03, n); f = lambda s: 2 * (s / vc) / (1 + (s / vc) ** 2)
        c = {"t_s": np.arange(n) * dt, "x.fall_mps": vm, "x.fin_degC": 40 + 10 * wave(rng, n, dt, 60, 20), "z.felt_mps2": -F * f(v) - fc + nz(rng, .3, n), "m.felt_mps2": np.zeros(n)}
        return c, {"felt_mps2": [f(vm), np.ones(n)]}
    return dict(log=log, n=[1600, 1400, 1500], channels=["felt_mps2"], effects=[E("felt_mps2", "unknown", "hinge", "product")])

# survey vehicle: the antenna stands ahead of the axle, so that turning moves it sideways, and the receiver is late; its speed along is late alone
@machine
def survey(rng):
    dt = .05; arm, d = .9 * near(rng), int(rng.integers(3, 7))
    def log(j, n):
        v, w = 4 + 1.5 * wave(rng, n, dt, 12, 2), .35 * wave(rng, n, dt, 9, 1.5); side = .25 * wave(rng, n, dt, 6, 1.2); back = lambda x: np.concatenate([np.full(d, x[0]), x[:-d]])
        c = {"t_s": np.arange(n) * dt, "x.odo_mps": v, "x.slip_mps": side, "x.yaw_radps": w + nz(rng, .004, n), "z.along_mps": back(v) + nz(rng, .05, n), "m.along_mps": v, "z.across_mps": side + arm * w + nz(rng, .04, n), "m.across_mps": side}
        return c, {"along_mps": [back(v) - v], "across_mps": [w]}
    return dict(log=log, n=[1500, 1300, 1400], channels=["along_mps", "across_mps"], effects=[E("along_mps", "delay"), E("across_mps", "coupling", "viscous_friction")])

# Peltier cooler: half of the current's heat and what runs back through its legs come to the cold side; the model knows the pumped heat alone
@machine
def peltier(rng):
    dt = 1.; S, R, K, C = .05, 1.6 * near(rng), .45 * near(rng), 60.
    def log(j, n):
        i = np.clip(2.2 + 1.5 * wave(rng, n, dt, 200, 30), 0, 6); th = 35 + 6 * wave(rng, n, dt, 500, 100); T, TT = 15., []
        for k in range(n):
            TT.append(T)
            for _ in range(4): T += dt / 4 * (-S * (T + 273) * i[k] + .5 * R * i[k] ** 2 + K * (th[k] - T) + 20) / C
        TT = np.array(TT); tm = TT + nz(rng, .01, n)
        c = {"t_s": np.arange(1, n) * dt, "u.current_A": i[:-1], "x.hot_degC": (th + nz(rng, .05, n))[:-1], "x.cold_degC": tm[:-1], "z.cold_degC": tm[1:], "m.cold_degC": (tm + dt / C * (20 - S * (tm + 273) * i))[:-1]}
        return c, {"cold_degC": [(i * i)[:-1], (th - tm)[:-1]]}
    return dict(log=log, n=[1400, 1200, 1500], channels=["cold_degC"], effects=[E("cold_degC", "quadratic_drag", "product", "unknown"), E("cold_degC", "coupling", "slope", "viscous_friction")])

# buoy with nothing wrong: a heave that starts from a noisy reading, tides and warmth that wander by chance
@machine
def buoy(rng):
    dt = 1.
    def log(j, n):
        sea = 1 + .4 * wave(rng, n, dt, 900, 200); push = sea * wave(rng, n, dt, 12, 5); wind = 6 + np.cumsum(nz(rng, .05, n)); v, V = 0., []
        for k in range(n): V.append(v); v += dt * (.3 * push[k] - .4 * v)
        V = np.array(V); vm = V + nz(rng, .03, n)
        c = {"t_s": np.arange(1, n) * dt, "u.push_N": push[:-1], "x.heave_mps": vm[:-1], "x.sea_m": sea[:-1], "x.wind_mps": wind[:-1], "x.water_degC": (11 + np.cumsum(nz(rng, .01, n)))[:-1], "z.heave_mps": vm[1:],
             "m.heave_mps": (vm + dt * (.3 * push - .4 * vm))[:-1], "z.tilt_deg": (4 * push + .5 * rng.standard_normal(n))[1:], "m.tilt_deg": (4 * push)[1:]}
        return c, {"heave_mps": [], "tilt_deg": []}
    return dict(log=log, n=[1500, 1300, 1700], channels=["heave_mps", "tilt_deg"], effects=[])

def main():
    o = asked(M)
    mac = M[o.family](np.random.default_rng(o.seed * 8191 + 17))
    put(o, mac, [mac["log"](j, n) for j, n in enumerate(mac["n"])], mac["log"](len(mac["n"]), mac["n"][0]))
if __name__ == "__main__": main()
