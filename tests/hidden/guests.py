#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""guests.py --seed N --family F --out DIR --truth FILE: a fourth lot of machines, each with channels of which nothing is wrong.

From one row in two seconds to a thousand per second; readings of velocity that are as noisy as real ones, quantised, coloured; rows that never
arrived; sizes that differ between logs. Of every channel that something is wrong with the columns of the true form are given, so that
`channels.py` can compare with least squares. Writing and scoring is physics.py's; the machines are others."""
import math

from physics import Case, G, Machine, draw, sign, wander
from visitors import chirp, moves, rk4, steps


class Coloured:
    """Noise that keeps a share of itself from row to row; sd 1."""
    def __init__(self, rng, keep):
        self.rng, self.keep, self.e = rng, keep, rng.gauss(0, 1)

    def __call__(self):
        self.e = self.keep * self.e + math.sqrt(1 - self.keep ** 2) * self.rng.gauss(0, 1)
        return self.e


def grains(x, grain):
    return grain * round(x / grain)


class BallScrew(Machine):
    """Motor force of a ball screw by inverse dynamics at 1 kHz: Stribeck's friction; the nut's place is right but for a reading in grains."""
    parts = {"force_N": [("coulomb_friction", []), ("viscous_friction", [])]}
    healthy = ["nut_mm"]

    def __init__(self, rng):
        self.c, self.more, self.width = rng.uniform(12, 25), rng.uniform(4, 10), rng.uniform(.01, .03)
        self.d, self.mass, self.rest = rng.uniform(80, 200), rng.uniform(20, 50), self.little(rng)

    def log(self, rng, held):
        dt, n = .001, 3000
        path, wave = moves(rng, .25, .4, .1), chirp(rng, .06, .4, 1.6, 2)
        case = Case(dt, ["x.nut_m", "x.nut_mps", "x.motor_degC"], {"force_N": 3.0, "nut_mm": .016})
        noise = Coloured(rng, .5)
        for i in range(n):
            t = i * dt
            if held:
                q, v, a = path(t)
            else:
                q, v, a = wave(t), (wave(t + 1e-4) - wave(t - 1e-4)) / 2e-4, (wave(t + 1e-3) - 2 * wave(t) + wave(t - 1e-3)) / 1e-6
            near = sign(v) * math.exp(-(v / self.width) ** 2)
            m = {"force_N": self.mass * a, "nut_mm": 1e3 * q}
            more = sign(v) * self.c + self.more * near + self.d * v
            t_ = {"force_N": m["force_N"] + more + self.c * self.rest(30 * q), "nut_mm": m["nut_mm"]}
            case.add([q, v if v == 0 else v + .0005 * rng.gauss(0, 1), 40 + .5 * t], m, t_,
                     {"force_N": t_["force_N"] + 2.5 * noise(), "nut_mm": grains(t_["nut_mm"] + .015 * rng.gauss(0, 1), .02)},
                     {"force_N": [sign(v), near, v]})
        return case


class DeadValve(Machine):
    """Speed of a hydraulic rod by its valve: nothing flows in a band about the middle, and the oil gives way, so that it answers late."""
    parts = {"rod_mmps": [("dead_zone", []), ("lag", ["delay", "lag_delay"])]}
    healthy = ["supply_bar"]

    def __init__(self, rng):
        self.band, self.tau, self.gain = rng.uniform(.08, .2), rng.uniform(.03, .08), rng.uniform(80, 160)

    def log(self, rng, held):
        dt, n = .01, 2000
        want = steps(rng, -1, 1, .6) if held else chirp(rng, .9, .1, .8, 8)
        case = Case(dt, ["u.valve", "x.oil_degC", "x.load_kN"], {"rod_mmps": 2.0, "supply_bar": .5})
        v, warm, load = 0.0, wander(rng, 6, 12.0), wander(rng, 4, 3.0)
        for i in range(n):
            u = want(i * dt)
            for _ in range(5):
                v += dt / 5 / self.tau * (self.gain * (u - max(-self.band, min(self.band, u))) - v)
            m = {"rod_mmps": self.gain * u, "supply_bar": 200 - .02 * abs(self.gain * u)}
            t = {"rod_mmps": v, "supply_bar": m["supply_bar"]}
            case.add([u, 45 + warm(i * dt), 9 + load(i * dt)], m, t,
                     {"rod_mmps": v + 1.6 * rng.gauss(0, 1), "supply_bar": t["supply_bar"] + .5 * rng.gauss(0, 1)},
                     {"rod_mmps": [v - m["rod_mmps"]]})
        return case


class GroundEffect(Machine):
    """A quadrotor near the ground: its rotors give more there (Cheeseman and Bennett), and air holds it back forward; sideways all is well."""
    parts = {"az_mps2": [("unknown", ["product", "hinge", "coupling", "gain", "bias"])], "ax_mps2": [("viscous_friction", [])]}
    healthy = ["ay_mps2"]
    law = True

    def __init__(self, rng):
        self.r, self.k, self.rest = rng.uniform(.6, .9), rng.uniform(.2, .45), self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 2000
        want = steps(rng, .5, 3.0, 3.0) if held else chirp(rng, 1.2, .04, .2, 20)
        pitch, roll = wander(rng, .25, 4.0, "steps" if held else "sines"), wander(rng, .2, 5.0)
        case = Case(dt, ["x.height_m", "x.climb_mps", "x.vx_mps", "x.vy_mps", "u.thrust_mps2", "x.pitch_rad", "x.roll_rad"],
                    {"az_mps2": .3, "ax_mps2": .2, "ay_mps2": .2})
        h, w, vx, vy = 1.5, 0.0, 0.0, 0.0
        for i in range(n):
            goal = want(i * dt) if held else 1.8 + want(i * dt)
            u = max(3.0, min(18.0, G + 6 * (goal - h) - 4 * w))
            a, b = pitch(i * dt) - .05 * vx, roll(i * dt) - .05 * vy
            more = u * (1 / (1 - min(.8, (self.r / 4 / h) ** 2 * 4)) - 1)
            m = {"az_mps2": u - G, "ax_mps2": u * math.sin(a), "ay_mps2": -u * math.sin(b)}
            t = {"az_mps2": m["az_mps2"] + more, "ax_mps2": m["ax_mps2"] - self.k * vx * (1 + self.rest(vx)), "ay_mps2": m["ay_mps2"]}
            case.add([h + .005 * rng.gauss(0, 1), w + .02 * rng.gauss(0, 1), vx + .03 * rng.gauss(0, 1), vy + .03 * rng.gauss(0, 1), u, a, b],
                     m, t, {c: t[c] + s * rng.gauss(0, 1) for c, s in (("az_mps2", .25), ("ax_mps2", .18), ("ay_mps2", .2))},
                     {"az_mps2": [more], "ax_mps2": [vx]})
            h, w, vx, vy = max(.35, h + dt * w), w + dt * t["az_mps2"], vx + dt * t["ax_mps2"], vy + dt * (t["ay_mps2"] - .1 * vy)
        return case


class Tender(Machine):
    """A boat at one row in half a second in water that flows: drag by the square of its speed through the water; its turning is well modelled."""
    parts = {"dv_mps": [("quadratic_drag", [])]}
    healthy = ["turn_degps"]

    def __init__(self, rng):
        self.k, self.flow, self.rest = rng.uniform(.05, .12), rng.uniform(-.25, .25), self.little(rng)

    def log(self, rng, held):
        dt, n = .5, 1300
        pull = wander(rng, .7, 20.0, "steps" if held else "sines")
        rudder = wander(rng, 25, 12.0)
        case = Case(dt, ["x.v_mps", "x.heading_deg", "x.rudder_deg", "u.throttle"], {"dv_mps": .02, "turn_degps": .3})
        v, psi, noise = 1.5, 0.0, Coloured(rng, .6)
        for i in range(n):
            thrust, r = pull(i * dt) + .15, rudder(i * dt)
            m = {"dv_mps": dt * thrust, "turn_degps": .25 * r * v / 2}
            of = v - self.flow
            drag = dt * self.k * of * abs(of)
            t = {"dv_mps": m["dv_mps"] - drag * (1 + self.rest(v)), "turn_degps": m["turn_degps"]}
            case.add([v + .03 * rng.gauss(0, 1), (psi + 180) % 360 - 180, r, thrust], m, t,
                     {"dv_mps": t["dv_mps"] + .018 * rng.gauss(0, 1), "turn_degps": t["turn_degps"] + .3 * noise()},
                     {"dv_mps": [drag]})
            v, psi = v + t["dv_mps"], psi + dt * t["turn_degps"]
        case.lose(rng, .03)
        return case


class Exchanger(Machine):
    """Outlet of a heat exchanger, a row in two seconds: it fouls, so that it passes on less of the difference the longer it runs."""
    parts = {"out_degC": [("unknown", ["product", "drift", "drift_from", "gain"])]}
    healthy = ["pump_kPa"]
    law = True

    def __init__(self, rng):
        self.foul, self.eff = rng.uniform(.08, .2), rng.uniform(.5, .7)

    def log(self, rng, held):
        dt, n = 2.0, 1500
        hot, flow = wander(rng, 12, 300.0, "steps" if held else "sines"), wander(rng, .3, 170.0)
        case = Case(dt, ["x.hot_degC", "x.cold_degC", "u.flow_Lps"], {"out_degC": .25, "pump_kPa": 1.0})
        cold = wander(rng, 3, 900.0)
        for i in range(n):
            h, c, f = 75 + hot(i * dt), 15 + cold(i * dt), 1 + flow(i * dt)
            e = self.eff * (1.2 - .2 * f)
            less = e * self.foul * i / n * (h - c)
            m = {"out_degC": c + e * (h - c), "pump_kPa": 30 * f * f}
            t = {"out_degC": m["out_degC"] - less, "pump_kPa": m["pump_kPa"]}
            case.add([h + .1 * rng.gauss(0, 1), c + .1 * rng.gauss(0, 1), f], m, t,
                     {"out_degC": grains(t["out_degC"] + .2 * rng.gauss(0, 1), .1), "pump_kPa": t["pump_kPa"] + 1.0 * rng.gauss(0, 1)},
                     {"out_degC": [less]})
        return case


class WarmMotor(Machine):
    """Current of a DC motor by its voltage: the back EMF's constant is wrong, and copper resists more when it is warm."""
    parts = {"current_A": [("viscous_friction", ["coupling"]), ("product", ["unknown", "gain", "coupling"])]}
    healthy = ["bus_V"]

    def __init__(self, rng):
        self.ke, self.wrong, self.alpha = rng.uniform(.04, .06), rng.choice([-1, 1]) * rng.uniform(.08, .15), .0039
        self.load = rng.uniform(.2, .5)

    def log(self, rng, held):
        dt, n = .05, 1800
        want = steps(rng, -20, 20, 1.5) if held else chirp(rng, 20, .05, .5, 30)
        case = Case(dt, ["u.volts_V", "x.speed_radps", "x.winding_degC"], {"current_A": .15, "bus_V": .04})
        w, warm, r = 0.0, rng.uniform(25, 45), .8
        for i in range(n):
            u = want(i * dt)
            m = {"current_A": (u - self.ke * w) / r, "bus_V": 24 - .02 * abs(u)}
            emf = -self.ke * self.wrong * w / r
            true = (u - self.ke * (1 + self.wrong) * w) / r / (1 + self.alpha * (warm - 25))
            t = {"current_A": true, "bus_V": m["bus_V"]}
            case.add([u, w + .5 * rng.gauss(0, 1), warm + .2 * rng.gauss(0, 1)], m, t,
                     {"current_A": true + .12 * rng.gauss(0, 1), "bus_V": grains(m["bus_V"] + .04 * rng.gauss(0, 1), .02)},
                     {"current_A": [emf, m["current_A"] * (warm - 25)]})
            w += dt * (8 * true - self.load * w)
            warm += dt * (.004 * true * true - .02 * (warm - 25))
        return case


class Layer(Machine):
    """Sounding rockets in coast: drag, of a size of its own in each, and a layer of wind pushes sideways between two heights."""
    parts = {"dv_mps": [("quadratic_drag", [])], "ay_mps2": [("bias", [])]}
    healthy = ["roll_degps"]

    def __init__(self, rng):
        self.k, self.count = [rng.uniform(1, 3) * 1e-4 for _ in range(4)], 0
        self.low, self.push = rng.uniform(1200, 1600), rng.choice([-1, 1]) * rng.uniform(.4, .8)
        self.high = self.low + rng.uniform(400, 700)

    def log(self, rng, held):
        dt, k = .05, self.k[self.count]
        self.count += 1
        case = Case(dt, ["x.height_m", "x.vz_mps", "x.tilt_deg"], {"dv_mps": .04, "ay_mps2": .3, "roll_degps": 2.0})
        h, v, spin, tilt = rng.uniform(500, 800), rng.uniform(220, 300), 60.0, wander(rng, 4, 7.0)
        noise = Coloured(rng, .4)
        while v > 2:
            at, before = h, v
            for _ in range(4):
                v -= dt / 4 * (G + k * math.exp(-h / 9000) * v * abs(v))
                h += dt / 4 * v
            inside = float(self.low < at < self.high)
            m = {"dv_mps": -G * dt, "ay_mps2": .03 * tilt(h / 90), "roll_degps": spin}
            t = {"dv_mps": v - before, "ay_mps2": m["ay_mps2"] + self.push * inside, "roll_degps": spin}
            case.add([at + 3 * rng.gauss(0, 1), before + .3 * rng.gauss(0, 1), tilt(h / 90)], m, t,
                     {"dv_mps": t["dv_mps"] + .03 * noise(), "ay_mps2": t["ay_mps2"] + .25 * rng.gauss(0, 1), "roll_degps": spin + 2 * rng.gauss(0, 1)},
                     {"dv_mps": [math.exp(-at / 9000) * before * abs(before)], "ay_mps2": [inside]})
            spin *= .9995
        return case


class Wheel(Machine):
    """Speed of a reaction wheel one row ahead from its coarse reading: bearings rub, drily and in proportion; body and bus are well."""
    parts = {"wheel_radps": [("coulomb_friction", []), ("viscous_friction", [])]}
    healthy = ["body_radps", "bus_V"]

    def __init__(self, rng):
        self.c, self.d, self.noise = rng.uniform(.25, .5), rng.uniform(.004, .008), rng.uniform(.05, .1)

    def log(self, rng, held):
        dt, n = .25, 1500
        torque = steps(rng, -3, 3, 8) if held else chirp(rng, 3, .01, .06, 90)
        case = Case(dt, ["x.wheel_radps", "u.torque", "x.panel_degC"], {"wheel_radps": .15, "body_radps": .0006, "bus_V": .03})
        w, warm = 0.0, wander(rng, 12, 200.0)
        read = grains(w + self.noise * rng.gauss(0, 1), .05)
        for i in range(n):
            u = torque(i * dt) - .02 * w
            new = rk4(lambda t, x: [u - self.c * math.tanh(x[0] / .02) - self.d * x[0]], [w], 0, dt, 25)[0]
            m = {"wheel_radps": read + dt * u, "body_radps": -.001 * w, "bus_V": 28 - .05 * abs(u)}
            t = {"wheel_radps": new + (read - w), "body_radps": m["body_radps"], "bus_V": m["bus_V"]}
            case_row, g = [read, u, 20 + warm(i * dt)], {"wheel_radps": [sign(w), w]}
            read = grains(new + self.noise * rng.gauss(0, 1), .05)
            case.add(case_row, m, t, {"wheel_radps": read, "body_radps": m["body_radps"] + .0006 * rng.gauss(0, 1),
                                      "bus_V": grains(m["bus_V"] + .03 * rng.gauss(0, 1), .01)}, g)
            w = new
        return case


class Gantry(Machine):
    """A gantry crane whose payload differs between the logs: what it weighs in the hoist, and how its trolley answers."""
    parts = {"hoist_kN": [("bias", ["gain"])], "acc_mps2": [("gain", [])]}
    healthy = ["sway_deg"]

    def __init__(self, rng):
        self.mass = [rng.uniform(1.5, 5) for _ in range(4)]
        self.count = 0

    def log(self, rng, held):
        dt, n = .1, 1200
        load = self.mass[self.count]
        self.count += 1
        want = steps(rng, -1, 1, 2) if held else chirp(rng, 1, .05, .3, 30)
        lift = wander(rng, .5, 4.0)
        case = Case(dt, ["x.trolley_m", "x.trolley_mps", "u.drive_kN", "x.rope_m", "x.rope_mps2"], {"hoist_kN": .8, "acc_mps2": .02, "sway_deg": .2})
        x, v = 0.0, 0.0
        for i in range(n):
            u, a = want(i * dt) - .3 * v - .05 * x, lift(i * dt)
            m = {"hoist_kN": 8 * (G + a), "acc_mps2": u / 2, "sway_deg": 2 * math.degrees(u / 2 / G)}
            t = {"hoist_kN": (8 + load) * (G + a), "acc_mps2": u / (2 + .2 * load), "sway_deg": m["sway_deg"]}
            case.add([x, v + .01 * rng.gauss(0, 1), u, 6 - .3 * a, a], m, t, {c: t[c] + s * rng.gauss(0, 1) for c, s in
                     (("hoist_kN", .7), ("acc_mps2", .018), ("sway_deg", .2))}, {"hoist_kN": [1.0, a], "acc_mps2": [u]})
            v += dt * t["acc_mps2"]
            x += dt * v
        case.lose(rng, .01)
        return case


class Centrifuge(Machine):
    """Torque of a centrifuge, which turns one way: the air brakes it by the square of the speed, bearings by a constant."""
    parts = {"torque_Nm": [("quadratic_drag", []), ("bias", ["coulomb_friction", "viscous_friction"])]}
    healthy = ["shake_um"]

    def __init__(self, rng):
        self.k, self.c, self.rest = rng.uniform(3, 6) * 1e-5, rng.uniform(.4, .9), self.little(rng)

    def log(self, rng, held):
        dt, n = .1, 1400
        want = steps(rng, 60, 320, 12) if held else chirp(rng, 130, .01, .05, 120)
        case = Case(dt, ["x.rotor_radps", "x.rotor_radps2", "x.bowl_degC"], {"torque_Nm": .2, "shake_um": .5})
        w = 150.0
        for i in range(n):
            a = max(-20.0, min(20.0, .8 * ((want(i * dt) if held else 190 + want(i * dt)) - w)))
            m = {"torque_Nm": .05 * a, "shake_um": 2 + 1e-4 * w * w}
            t = {"torque_Nm": m["torque_Nm"] + self.k * w * w * (1 + .5 * self.rest(w / 90)) + self.c, "shake_um": m["shake_um"]}
            case.add([w + .5 * rng.gauss(0, 1), a, 20 + i / 300], m, t,
                     {"torque_Nm": t["torque_Nm"] + .15 * rng.gauss(0, 1), "shake_um": t["shake_um"] + .5 * rng.gauss(0, 1)},
                     {"torque_Nm": [w * w, 1.0]})
            w = max(20.0, w + dt * a)
        return case


class Turbine(Machine):
    """A wind turbine: its blades follow the wanted pitch late, its power is less by the air's density; the tower is well."""
    parts = {"pitch_deg": [("lag", ["delay", "lag_delay"])], "power_kW": [("gain", [])]}
    healthy = ["tower_mps2"]

    def __init__(self, rng):
        self.tau, self.thin = rng.uniform(.3, .7), rng.uniform(.88, .95)

    def log(self, rng, held):
        dt, n = .1, 1600
        want, gust = (steps(rng, 0, 18, 5) if held else chirp(rng, 8, .02, .15, 60)), wander(rng, 3, 15.0)
        case = Case(dt, ["u.pitch_deg", "x.wind_mps", "x.rotor_rpm"], {"pitch_deg": .25, "power_kW": 20, "tower_mps2": .02})
        beta, noise = 9.0, Coloured(rng, .7)
        for i in range(n):
            u, wind = (want(i * dt) if held else 9 + want(i * dt)), 11 + gust(i * dt)
            beta += (1 - math.exp(-dt / self.tau)) * (u - beta)
            m = {"pitch_deg": u, "power_kW": .8 * wind ** 3, "tower_mps2": .002 * wind}
            t = {"pitch_deg": beta, "power_kW": self.thin * m["power_kW"], "tower_mps2": m["tower_mps2"]}
            case.add([u, wind, 12 + .1 * wind + .05 * rng.gauss(0, 1)], m, t,
                     {"pitch_deg": grains(beta + .2 * rng.gauss(0, 1), .1), "power_kW": t["power_kW"] + 18 * rng.gauss(0, 1),
                      "tower_mps2": t["tower_mps2"] + .02 * noise()}, {"pitch_deg": [beta - u], "power_kW": [m["power_kW"]]})
        case.lose(rng, .02)
        return case


class Battery(Machine):
    """Voltage of a battery, a row in two seconds: its simulation has one open-circuit voltage for all charges, and too small a resistance."""
    parts = {"volt_V": [("unknown", ["coupling", "hinge", "product", "drift"]), ("coupling", ["gain", "viscous_friction", "unknown"])]}
    healthy = ["cell_degC"]
    law = True

    def __init__(self, rng):
        self.knee, self.r = rng.uniform(.08, .15), rng.uniform(.01, .02)

    def log(self, rng, held):
        dt, n = 2.0, 1600
        want = steps(rng, -15, 40, 60) if held else chirp(rng, 25, .001, .008, 800)
        case = Case(dt, ["x.charge", "u.amps_A", "x.room_degC"], {"volt_V": .06, "cell_degC": .2})
        soc, room = rng.uniform(.85, .98), wander(rng, 2, 1500.0)
        for i in range(n):
            amps = want(i * dt) if held else 12 + want(i * dt)
            amps = -abs(amps) * .2 if soc < .06 else amps
            m = {"volt_V": 13.0 - .02 * amps, "cell_degC": 25 + room(i * dt)}
            ocv = .9 * (soc - .5) - .8 * math.exp(-soc / self.knee)
            t = {"volt_V": m["volt_V"] + ocv - self.r * amps, "cell_degC": m["cell_degC"]}
            case.add([soc + .002 * rng.gauss(0, 1), amps, 25 + room(i * dt)], m, t,
                     {"volt_V": grains(t["volt_V"] + .05 * rng.gauss(0, 1), .01), "cell_degC": t["cell_degC"] + .2 * rng.gauss(0, 1)},
                     {"volt_V": [soc, 1.0, math.exp(-soc / self.knee), amps]})
            soc = max(.02, min(1.0, soc - amps * dt / 3600 / 10))
        return case


class Odometry(Machine):
    """Speed and turn of a cart by satellite against its odometry: one radius for both wheels is wrong, and they are not equal."""
    parts = {"speed_mps": [("gain", ["coupling"])], "turn_radps": [("coupling", ["viscous_friction", "gain"])]}
    healthy = ["climb_mps"]

    def __init__(self, rng):
        self.scale, self.split = rng.choice([-1, 1]) * rng.uniform(.04, .08), rng.choice([-1, 1]) * rng.uniform(.02, .05)

    def log(self, rng, held):
        dt, n = .1, 1500
        left, right = (wander(rng, .6, 6.0, "steps" if held else "sines") for _ in range(2))
        case = Case(dt, ["x.left_mps", "x.right_mps", "x.mast_degC"], {"speed_mps": .04, "turn_radps": .03, "climb_mps": .02})
        noise = Coloured(rng, .3)
        for i in range(n):
            l, r = .7 + left(i * dt), .7 + right(i * dt)
            m = {"speed_mps": (l + r) / 2, "turn_radps": (r - l) / .5, "climb_mps": 0.0}
            a, b = l * (1 + self.scale - self.split / 2), r * (1 + self.scale + self.split / 2)
            t = {"speed_mps": (a + b) / 2, "turn_radps": (b - a) / .5, "climb_mps": 0.0}
            case.add([l, r, 15 + i / 500], m, t, {"speed_mps": t["speed_mps"] + .035 * rng.gauss(0, 1),
                     "turn_radps": t["turn_radps"] + .03 * noise(), "climb_mps": .02 * rng.gauss(0, 1)},
                     {"speed_mps": [l, r], "turn_radps": [l, r]})
        case.lose(rng, .02)
        return case


class Misaligned(Machine):
    """Three gyros against a reference: one leans towards another's axis, one has an offset, the third is well."""
    parts = {"gz_radps": [("coupling", ["viscous_friction"])], "gx_radps": [("bias", [])]}
    healthy = ["gy_radps"]

    def __init__(self, rng):
        self.lean, self.offset = rng.choice([-1, 1]) * rng.uniform(.02, .05), rng.choice([-1, 1]) * rng.uniform(.006, .012)

    def log(self, rng, held):
        dt, n = .01, 2000
        w = [wander(rng, .8, 1.5 + k, "steps" if held else "sines") for k in range(3)]
        case = Case(dt, ["x.wx_radps", "x.wy_radps", "x.wz_radps", "x.chip_degC"], {"gx_radps": .01, "gy_radps": .01, "gz_radps": .01})
        for i in range(n):
            x, y, z = (f(i * dt) for f in w)
            m = {"gx_radps": x, "gy_radps": y, "gz_radps": z}
            t = {"gx_radps": x + self.offset, "gy_radps": y, "gz_radps": z + self.lean * x}
            case.add([x, y, z, 40 + i / 400], m, t, {c: grains(t[c] + .009 * rng.gauss(0, 1), .004) for c in t},
                     {"gx_radps": [1.0], "gz_radps": [x]})
        return case


class Boom(Machine):
    """Torque at a boom that swings by inverse dynamics: what it carries is heavier and elsewhere than said, so that weight depends on the angle."""
    parts = {"torque_Nm": [("periodic", ["slope", "unknown", "coupling", "gain"]), ("coulomb_friction", [])]}
    healthy = ["motor_degC"]

    def __init__(self, rng):
        self.weight, self.phase, self.c, self.rest = rng.uniform(8, 16), rng.uniform(-.4, .4), rng.uniform(2, 5), self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 1600
        path, wave = moves(rng, 2.0, 1.5, .4), wander(rng, 2.0, 4.0)
        case = Case(dt, ["x.q_rad", "x.qd_radps", "x.qdd_radps2"], {"torque_Nm": 1.0, "motor_degC": .3})
        for i in range(n):
            t = i * dt
            if held:
                q, v, a = path(t)
            else:
                q, v, a = wave(t), (wave(t + 1e-3) - wave(t - 1e-3)) / 2e-3, (wave(t + 1e-2) - 2 * wave(t) + wave(t - 1e-2)) / 1e-4
            m = {"torque_Nm": 3 * a + 30 * math.sin(q), "motor_degC": 45 + t / 30}
            more = self.weight * math.sin(q + self.phase)
            t_ = {"torque_Nm": m["torque_Nm"] + more + self.c * sign(v) + self.c * self.rest(2 * q), "motor_degC": m["motor_degC"]}
            case.add([q + .001 * rng.gauss(0, 1), v if v == 0 else v + .01 * rng.gauss(0, 1), a], m, t_,
                     {"torque_Nm": t_["torque_Nm"] + .8 * rng.gauss(0, 1), "motor_degC": grains(m["motor_degC"] + .3 * rng.gauss(0, 1), .25)},
                     {"torque_Nm": [math.sin(q), math.cos(q), sign(v)]})
        return case


class Greenhouse(Machine):
    """Nothing is wrong: slow channels whose noise wanders, in coarse grains, and rows that are missing."""
    parts = {}
    healthy = ["air_degC", "damp_pct", "light_W"]

    def __init__(self, rng):
        self.keep = rng.uniform(.3, .85)

    def log(self, rng, held):
        dt, n = 2.0, 1500
        sun, vent = wander(rng, 200, 700.0, "steps" if held else "sines"), wander(rng, .4, 200.0)
        case = Case(dt, ["x.outside_degC", "u.vent", "x.sun_W"], {"air_degC": .2, "damp_pct": 1.0, "light_W": 8.0})
        a, out = Coloured(rng, self.keep), wander(rng, 4, 1500.0)
        for i in range(n):
            s, v, o = 400 + sun(i * dt), .5 + vent(i * dt), 12 + out(i * dt)
            m = {"air_degC": o + .01 * s * (1.2 - v), "damp_pct": 70 - 20 * v, "light_W": .8 * s}
            tail = math.sqrt(sum(rng.gauss(0, 1) ** 2 for _ in range(5)) / 5) * math.sqrt(5 / 3)
            case.add([o, v, s], m, m, {"air_degC": m["air_degC"] + .2 * a(), "damp_pct": grains(m["damp_pct"] + 1.0 * rng.gauss(0, 1), .5),
                                       "light_W": m["light_W"] + 8 * rng.gauss(0, 1) / tail})
        case.lose(rng, .05)
        return case


class Stage(Machine):
    """Nothing is wrong: place and speed of a linear stage at 500 Hz, one row ahead from noisy readings of both; its force is well too."""
    parts = {}
    healthy = ["place_mm", "speed_mmps", "force_N"]

    def __init__(self, rng):
        self.noise, self.still = rng.uniform(.2, .6), rng.uniform(.005, .02)

    def log(self, rng, held):
        dt, n = .002, 2500
        push = steps(rng, -900, 900, .2) if held else chirp(rng, 900, .5, 3, 4)
        of_speed = math.sqrt(self.noise ** 2 * (1 + (1 - 6 * dt) ** 2))
        of_place = math.sqrt(2 * self.still ** 2 + (dt * self.noise) ** 2)
        case = Case(dt, ["x.place_mm", "x.speed_mmps", "u.push", "x.rail_degC"], {"place_mm": of_place, "speed_mmps": of_speed, "force_N": .5})
        q, v = 0.0, 0.0
        rq, rv = q + self.still * rng.gauss(0, 1), v + self.noise * rng.gauss(0, 1)
        for i in range(n):
            u = push(i * dt)
            m = {"place_mm": rq + dt * rv, "speed_mmps": rv + dt * (u - 6 * rv - 40 * rq), "force_N": .01 * u}
            row = [rq, rv, u, 22 + i / 2000]
            q, v = q + dt * v, v + dt * (u - 6 * v - 40 * q)
            rq, rv = q + self.still * rng.gauss(0, 1), v + self.noise * rng.gauss(0, 1)
            case.add(row, m, m, {"place_mm": rq, "speed_mmps": rv, "force_N": m["force_N"] + .5 * rng.gauss(0, 1)})
        return case


MACHINES = {"ball_screw": BallScrew, "dead_valve": DeadValve, "ground_effect": GroundEffect, "tender": Tender, "exchanger": Exchanger,
            "warm_motor": WarmMotor, "layer": Layer, "wheel": Wheel, "gantry": Gantry, "centrifuge": Centrifuge, "turbine": Turbine,
            "battery": Battery, "odometry": Odometry, "misaligned": Misaligned, "boom": Boom, "greenhouse": Greenhouse, "stage": Stage}

if __name__ == "__main__":
    draw(MACHINES, __doc__, "guests")
