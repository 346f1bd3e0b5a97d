#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""latecomers.py --seed N --family F --out DIR --truth FILE: a fifth lot of machines, drawn after what guests.py showed was corrected.

Each with channels of which nothing is wrong, and with the columns of the true form. Writing and scoring is physics.py's."""
import math

from guests import Coloured, grains
from physics import Case, Machine, draw, sign, wander
from visitors import chirp, moves, steps


class Gimbal(Machine):
    """Torque of a camera's gimbal: its bearing rubs, its motor cogs with the angle; its other axis is well."""
    parts = {"pan_Nm": [("coulomb_friction", []), ("periodic", [])]}
    healthy = ["tilt_Nm"]

    def __init__(self, rng):
        self.c, self.cog, self.poles, self.phase = rng.uniform(.05, .1), rng.uniform(.03, .06), rng.choice([4, 6, 7]), rng.uniform(0, 6)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .005, 2400
        pan, tilt = (wander(rng, 2.6, 3.0 + k, "steps" if held else "sines") for k in range(2))
        case = Case(dt, ["x.pan_rad", "x.pan_radps", "x.tilt_rad", "x.tilt_radps"], {"pan_Nm": .02, "tilt_Nm": .02})
        noise = Coloured(rng, .4)
        rate = lambda f, t: (f(t + 1e-3) - f(t - 1e-3)) / 2e-3
        acc = lambda f, t: (f(t + 1e-2) - 2 * f(t) + f(t - 1e-2)) / 1e-4
        for i in range(n):
            t = i * dt
            q, v, w = pan(t), rate(pan, t), rate(tilt, t)
            m = {"pan_Nm": .02 * acc(pan, t), "tilt_Nm": .015 * acc(tilt, t)}
            cog = [math.sin(self.poles * q), math.cos(self.poles * q)]
            more = self.c * sign(v) + self.cog * math.sin(self.poles * q + self.phase)
            t_ = {"pan_Nm": m["pan_Nm"] + more + self.c * self.rest(v), "tilt_Nm": m["tilt_Nm"]}
            case.add([(q + math.pi) % (2 * math.pi) - math.pi, v + .01 * rng.gauss(0, 1), tilt(t), w + .01 * rng.gauss(0, 1)], m, t_,
                     {"pan_Nm": t_["pan_Nm"] + .018 * rng.gauss(0, 1), "tilt_Nm": t_["tilt_Nm"] + .02 * noise()}, {"pan_Nm": [sign(v)] + cog})
        return case


class Tram(Machine):
    """Change of a tram's speed one row ahead from its noisy reading: air and rails hold it back, and its line rises between two stops."""
    parts = {"v_mps": [("quadratic_drag", ["viscous_friction"]), ("bias", [])]}
    healthy = ["line_V"]

    def __init__(self, rng):
        self.k, self.low, self.rise = rng.uniform(.0008, .0016), rng.uniform(400, 700), rng.uniform(.15, .3)
        self.high = self.low + rng.uniform(250, 450)

    def log(self, rng, held):
        dt, n = .5, 1500
        want = steps(rng, 2, 17, 15) if held else chirp(rng, 7, .005, .03, 200)
        case = Case(dt, ["x.place_m", "x.v_mps", "u.notch", "x.people_t"], {"v_mps": .12, "line_V": 4.0})
        s, v, noise = rng.uniform(0, 1200), 8.0, .08
        read = v + noise * rng.gauss(0, 1)
        for i in range(n):
            a = max(-1.2, min(1.2, .4 * ((want(i * dt) if held else 9 + want(i * dt)) - v)))
            inside = float(self.low < s < self.high)
            new = max(.5, v + dt * (a - self.k * v * v * 4 - self.rise * inside))
            m = {"v_mps": read + dt * a, "line_V": 600 - 30 * max(0.0, a)}
            row, g = [s, read, a, 4.0 + .5 * math.sin(i / 200)], {"v_mps": [v * v, inside]}
            t = {"v_mps": read + new - v, "line_V": m["line_V"]}
            read = new + noise * rng.gauss(0, 1)
            case.add(row, m, t, {"v_mps": read, "line_V": m["line_V"] + 4 * rng.gauss(0, 1)}, g)
            s, v = (s + dt * v) % 1200, new
        return case


class Blimp(Machine):
    """Climb and surge of a blimp: it is heavier than said, gas leaks, and air holds it back forward."""
    parts = {"dclimb_mps": [("bias", ["drift"]), ("drift", ["bias"])], "dsurge_mps": [("quadratic_drag", [])]}
    healthy = ["dyaw_radps"]

    def __init__(self, rng):
        self.heavy, self.leak, self.k = rng.uniform(.01, .02), rng.uniform(.02, .04), rng.uniform(.05, .1)

    def log(self, rng, held):
        dt, n = 1.0, 1300
        fan, flap, fin = (wander(rng, a, p, "steps" if held else "sines") for a, p in ((.5, 40.0), (.3, 30.0), (.2, 20.0)))
        case = Case(dt, ["x.height_m", "x.surge_mps", "x.yaw_radps", "u.fan", "u.flap", "u.fin"],
                    {"dclimb_mps": .015, "dsurge_mps": .03, "dyaw_radps": .01})
        h, u, r, noise = 60.0, 1.0, 0.0, Coloured(rng, .5)
        for i in range(n):
            f, e, d = fan(i * dt) + .3, flap(i * dt), fin(i * dt)
            m = {"dclimb_mps": .1 * e, "dsurge_mps": .4 * f, "dyaw_radps": .2 * d - .2 * r}
            t = {"dclimb_mps": m["dclimb_mps"] - self.heavy - self.leak * i / n, "dsurge_mps": m["dsurge_mps"] - self.k * u * abs(u),
                 "dyaw_radps": m["dyaw_radps"]}
            case.add([h + .3 * rng.gauss(0, 1), u + .03 * rng.gauss(0, 1), r + .002 * rng.gauss(0, 1), f, e, d], m, t,
                     {"dclimb_mps": t["dclimb_mps"] + .012 * noise(), "dsurge_mps": t["dsurge_mps"] + .025 * rng.gauss(0, 1),
                      "dyaw_radps": t["dyaw_radps"] + .01 * rng.gauss(0, 1)},
                     {"dclimb_mps": [1.0, float(i)], "dsurge_mps": [u * abs(u)]})
            h, u, r = h + .3 * e, u + t["dsurge_mps"], r + t["dyaw_radps"]
        case.lose(rng, .02)
        return case


class Kiln(Machine):
    """Change of a kiln's temperature, a row in two seconds: the burner acts late, and the wall gives heat away."""
    parts = {"dT_K": [("lag", ["delay", "lag_delay"]), ("coupling", ["viscous_friction", "unknown", "hinge"])]}
    healthy = ["gas_kPa"]

    def __init__(self, rng):
        self.tau, self.loss = rng.uniform(8, 20), rng.uniform(.0015, .003)

    def log(self, rng, held):
        dt, n = 2.0, 1500
        want = steps(rng, .1, 1, 50) if held else chirp(rng, .4, .003, .02, 300)
        case = Case(dt, ["x.T_degC", "x.hall_degC", "u.burner"], {"dT_K": .08, "gas_kPa": .3})
        temp, heat, hall = 300.0, .5, wander(rng, 5, 800.0)
        for i in range(n):
            u = want(i * dt) if held else .55 + want(i * dt)
            heat += (1 - math.exp(-dt / self.tau)) * (u - heat)
            m = {"dT_K": 2.5 * u, "gas_kPa": 20 + 4 * u}
            t = {"dT_K": 2.5 * heat - self.loss * (temp - 20 - hall(i * dt)) * dt, "gas_kPa": m["gas_kPa"]}
            case.add([temp + .2 * rng.gauss(0, 1), 20 + hall(i * dt), u], m, t,
                     {"dT_K": t["dT_K"] + .07 * rng.gauss(0, 1), "gas_kPa": grains(m["gas_kPa"] + .3 * rng.gauss(0, 1), .1)},
                     {"dT_K": [heat - u, temp - 20 - hall(i * dt)]})
            temp += t["dT_K"]
        return case


class Saw(Machine):
    """Motor current of a saw at rest and at work: a no-load current is drawn only while it turns; at rest the command is about nothing."""
    parts = {"current_A": [("coulomb_friction", ["bias", "coupling", "viscous_friction", "unknown"])]}
    healthy = ["dust_pct"]

    def __init__(self, rng):
        self.idle, self.rest = rng.uniform(.6, 1.2), self.little(rng)

    def log(self, rng, held):
        dt, n = .1, 1500
        load = steps(rng, 0, 6, 4)
        case = Case(dt, ["u.speed_pct", "x.blade_radps", "x.board_degC"], {"current_A": .12, "dust_pct": 1.0})
        w, on = 0.0, steps(rng, -1, 1, 8)
        for i in range(n):
            u = (60 + 40 * on(i * dt + 500)) if on(i * dt) > -.3 else .2 * rng.gauss(0, 1)
            w += .25 * (3 * max(0.0, u) - w)
            cut = load(i * dt) if w > 30 else 0.0
            m = {"current_A": cut + .004 * w, "dust_pct": 10 + 5 * cut}
            turns = 1.0 if w > 2 else w / 2
            t = {"current_A": m["current_A"] + self.idle * turns * (1 + self.rest(w / 60)), "dust_pct": m["dust_pct"]}
            case.add([u, w + .3 * rng.gauss(0, 1), 30 + i / 300], m, t, {"current_A": t["current_A"] + .1 * rng.gauss(0, 1),
                     "dust_pct": grains(t["dust_pct"] + rng.gauss(0, 1), .5)}, {"current_A": [turns]})
        return case


class Hexapod(Machine):
    """Force in a leg of a positioning hexapod at 200 Hz in point-to-point moves: a screw's friction that grows with its load; a null beside it."""
    parts = {"leg_N": [("load_friction", ["coulomb_friction"])]}
    healthy = ["leg_mm", "plate_degC"]

    def __init__(self, rng):
        self.mu, self.c, self.rest = rng.uniform(.06, .12), rng.uniform(2, 5), self.little(rng)

    def log(self, rng, held):
        dt, n = .005, 2400
        path, wave, load = moves(rng, .05, .06, .2), chirp(rng, .03, .2, 1.0, 6), wander(rng, 60, 5.0)
        case = Case(dt, ["x.leg_m", "x.leg_mps", "x.plate_N"], {"leg_N": 1.5, "leg_mm": .01, "plate_degC": .1})
        for i in range(n):
            t = i * dt
            q, v, a = path(t) if held else (wave(t), (wave(t + 1e-3) - wave(t - 1e-3)) / 2e-3, 0.0)
            p = 140 + load(t)
            m = {"leg_N": p + 8 * a, "leg_mm": 1e3 * q, "plate_degC": 21 + t / 60}
            tr = dict(m, leg_N=m["leg_N"] + sign(v) * (self.mu * abs(m["leg_N"]) + self.c) + self.c * self.rest(40 * q))
            case.add([q, v if v == 0 else v + .0004 * rng.gauss(0, 1), p + rng.gauss(0, 1)], m, tr,
                     {"leg_N": tr["leg_N"] + 1.3 * rng.gauss(0, 1), "leg_mm": tr["leg_mm"] + .01 * rng.gauss(0, 1),
                      "plate_degC": grains(tr["plate_degC"] + .1 * rng.gauss(0, 1), .05)}, {"leg_N": [sign(v), sign(v) * m["leg_N"]]})
        return case


class Buoy(Machine):
    """Nothing is wrong: heave and its rate one row ahead from noisy readings, waves, heavy tails, rows lost."""
    parts = {}
    healthy = ["heave_m", "rate_mps", "tide_m"]

    def __init__(self, rng):
        self.noise = rng.uniform(.02, .05)

    def log(self, rng, held):
        dt, n = .5, 1400
        wave = wander(rng, 1.2, 9.0, "steps" if held else "sines")
        sd_h, sd_v = self.noise * math.sqrt(2 + dt * dt), self.noise * math.sqrt(1 + .81)
        case = Case(dt, ["x.heave_m", "x.rate_mps", "x.wind_mps"], {"heave_m": sd_h, "rate_mps": sd_v, "tide_m": .03})
        h, v, wind, drift = 0.0, 0.0, wander(rng, 4, 60.0), Coloured(rng, .8)
        rh, rv = h + self.noise * rng.gauss(0, 1), v + self.noise * rng.gauss(0, 1)
        for i in range(n):
            a = wave(i * dt)
            m = {"heave_m": rh + dt * rv, "rate_mps": .9 * rv + .2 * (a - h), "tide_m": .001 * i}
            row = [rh, rv, 7 + wind(i * dt)]
            h, v = h + dt * v, .9 * v + .2 * (a - h)
            rh, rv = h + self.noise * rng.gauss(0, 1), v + self.noise * rng.gauss(0, 1)
            case.add(row, m, m, {"heave_m": rh, "rate_mps": rv, "tide_m": m["tide_m"] + .03 * drift()})
        case.lose(rng, .02)
        return case


MACHINES = {"gimbal": Gimbal, "tram": Tram, "blimp": Blimp, "kiln": Kiln, "saw": Saw, "hexapod": Hexapod, "buoy": Buoy}

if __name__ == "__main__":
    draw(MACHINES, __doc__, "latecomers")
