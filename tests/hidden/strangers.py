#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""strangers.py --seed N --family F --out DIR --truth FILE: more machines, with what logs of real ones bring along.

Columns named as their makers please and without units, velocities that were differentiated and smoothed from quantised positions,
stated deviations that are wrong, outcomes that are accelerations or forces in odd units, logs of different lengths and rates, and
a little that no law says in every one. The drawing and writing is physics.py's; the machines are others."""
import math

from physics import Case, G, Machine, draw, sign, wander


def rates(path, dt, n, grain, width):
    """Positions read in grains, and their velocity by a smoothed difference over `width` rows, as an encoder's are."""
    read = [grain * round(path(i * dt) / grain) for i in range(-width, n + width)]
    return read[width:width + n], [(read[i + 2 * width] - read[i]) / (2 * width * dt) for i in range(n)]


def true_rate(path, t):
    return (path(t + 1e-4) - path(t - 1e-4)) / 2e-4


def true_acc(path, t):
    return (path(t + 1e-2) - 2 * path(t) + path(t - 1e-2)) / 1e-4


class Press(Machine):
    """Pressure force of a hydraulic cylinder in kN over a stroke in mm; seals rub, more strongly near rest, and the oil shears."""
    parts = {"force_kN": [("coulomb_friction", []), ("viscous_friction", [])]}

    def __init__(self, rng):
        self.c, self.more, self.width = rng.uniform(1.0, 2.0), rng.uniform(.1, .5), rng.uniform(6, 12)
        self.d, self.mass, self.rest = rng.uniform(.006, .012), rng.uniform(.2, .5), self.little(rng)

    def log(self, rng, held):
        dt, n = .02, rng.randint(1200, 1900)
        path = wander(rng, 150, 4.0, "steps" if held else "sines")
        case = Case(dt, ["x.rod_mm", "x.rod_mmps", "x.supply_bar", "u.valve_pct"], {"force_kN": .2})
        rod, rate = rates(path, dt, n, .05, 2)
        supply = wander(rng, 5, 9.0)
        for i in range(n):
            t = i * dt
            v, a = true_rate(path, t), true_acc(path, t)
            m = self.mass * a * 1e-3
            f = sign(v) * (self.c + self.more * math.exp(-(v / self.width) ** 2)) + self.d * v + self.c * self.rest(rod[i] / 60)
            case.add([rod[i], rate[i], 210 + supply(t), .3 * v + rng.gauss(0, 1)], {"force_kN": m}, {"force_kN": m + f},
                     {"force_kN": m + f + .12 * rng.gauss(0, 1)})
        return case


class Winch(Machine):
    """Torque at a drum by inverse dynamics: the gear rubs in proportion to its load, and a little without."""
    parts = {"torque": [("load_friction", ["coulomb_friction"])]}

    def __init__(self, rng):
        self.mu, self.c, self.load = rng.uniform(.08, .16), rng.uniform(.5, 1.5), rng.uniform(120, 260)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .05, 1400
        path, extra = wander(rng, 4, 6.0, "steps" if held else "sines"), wander(rng, .5, 11.0, "steps")
        case = Case(dt, ["x.drum_angle", "x.drum_rate", "x.load_kg"], {"torque": 1.5})
        angle, rate = rates(path, dt, n, .002, 1)
        for i in range(n):
            t = i * dt
            v, a, load = true_rate(path, t), true_acc(path, t), self.load * (1 + extra(t))
            m = .12 * load * G * .1 + 2.0 * a
            truth = m + sign(v) * (self.mu * abs(m) + self.c) + self.c * self.rest(t)
            case.add([angle[i], rate[i], load + rng.gauss(0, 1)], {"torque": m}, {"torque": truth},
                     {"torque": truth + rng.gauss(0, 1)})
        return case


class Swing(Machine):
    """Angular acceleration of a pendulum; its bearing rubs and the air holds it back."""
    parts = {"alpha_radps2": [("coulomb_friction", []), ("viscous_friction", ["quadratic_drag"])]}

    def __init__(self, rng):
        self.c, self.d, self.length = rng.uniform(.3, .8), rng.uniform(.15, .4), rng.uniform(.4, 1)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 1500
        push = wander(rng, 5, 2.5, "steps" if held else "sines")
        case = Case(dt, ["x.theta", "x.theta_dot", "u.push"], {"alpha_radps2": .4})
        q, v = rng.uniform(-.3, .3), 0.0
        for i in range(n):
            u = push(i * dt)
            m = u - G / self.length * math.sin(q)
            truth = m - self.c * math.tanh(v / .01) - self.d * v - self.c * self.rest(3 * q)
            case.add([q + .001 * rng.gauss(0, 1), v + .01 * rng.gauss(0, 1), u], {"alpha_radps2": m}, {"alpha_radps2": truth},
                     {"alpha_radps2": truth + .3 * rng.gauss(0, 1)})
            for _ in range(10):
                v += dt / 10 * (u - G / self.length * math.sin(q) - self.c * math.tanh(v / .01) - self.d * v)
                q += dt / 10 * v
        return case


class Copter(Machine):
    """Accelerations of a small copter along two axes from its attitude; its rotors hold it back in proportion to speed."""
    parts = {"ax_mps2": [("viscous_friction", [])], "ay_mps2": [("viscous_friction", [])]}

    def __init__(self, rng):
        self.k, self.rest = rng.uniform(.25, .5), self.little(rng)

    def log(self, rng, held):
        dt, n = .05, 1500
        kind = "steps" if held else "sines"
        roll, pitch, wind = wander(rng, .3, 5.0, kind), wander(rng, .3, 6.0, kind), wander(rng, .3, 20.0)
        case = Case(dt, ["x.vx_mps", "x.vy_mps", "x.roll_rad", "x.pitch_rad", "u.throttle_pct"], {"ax_mps2": .25, "ay_mps2": .25})
        vx, vy = 0.0, 0.0
        for i in range(n):
            t = i * dt
            a, b = pitch(t) - .02 * vx, roll(t) - .02 * vy
            mx, my = G * math.tan(a), -G * math.tan(b) / math.cos(a)
            tx, ty = mx - self.k * (vx - .2 * wind(t)), my - self.k * (vy + .2 * wind(t + 7)) + .1 * self.rest(vx)
            case.add([vx + .03 * rng.gauss(0, 1), vy + .03 * rng.gauss(0, 1), b, a, 50 + 5 * a * a * 10 + rng.gauss(0, 1)],
                     {"ax_mps2": mx, "ay_mps2": my}, {"ax_mps2": tx, "ay_mps2": ty},
                     {"ax_mps2": tx + .2 * rng.gauss(0, 1), "ay_mps2": ty + .2 * rng.gauss(0, 1)})
            vx, vy = vx + dt * tx, vy + dt * ty
        return case


class Boat(Machine):
    """Change of a boat's speed within a row: the hull's drag is missing, and a steady wind pushes. No sd. is right: stated ten times too small."""
    parts = {"du_mps": [("quadratic_drag", [])]}

    def __init__(self, rng):
        self.k, self.wind, self.rest = rng.uniform(.04, .09), rng.uniform(-.02, .02), self.little(rng)

    def log(self, rng, held):
        dt, n = .5, rng.randint(900, 1400)
        pull = wander(rng, .5, 25.0, "steps" if held else "sines")
        case = Case(dt, ["x.u_mps", "x.r_degps", "u.rpm", "x.rudder_deg"], {"du_mps": .002})
        u, rudder = 1.0, wander(rng, 20, 14.0)
        for i in range(n):
            thrust = pull(i * dt)
            m = dt * thrust
            truth = m - dt * (self.k * u * abs(u) * (1 + .5 * self.rest(u)) - self.wind)
            case.add([u + .01 * rng.gauss(0, 1), .3 * rudder(i * dt) + .2 * rng.gauss(0, 1), 900 * thrust, rudder(i * dt)],
                     {"du_mps": m}, {"du_mps": truth}, {"du_mps": truth + .015 * rng.gauss(0, 1)})
            u += truth
        return case


class Oven(Machine):
    """Change of temperature within a row; the heater acts late by minutes, and the wall loses heat."""
    parts = {"dT_degC": [("delay", ["lag"]), ("coupling", ["bias", "gain_of_change", "hinge"])]}

    def __init__(self, rng):
        self.late, self.loss, self.power = rng.randint(3, 7), rng.uniform(.004, .009), rng.uniform(1.5, 3)

    def log(self, rng, held):
        dt, n = 10.0, 1300
        want = wander(rng, 45, 900.0, "steps" if held else "sines")
        case = Case(dt, ["x.T_degC", "u.heater_pct", "x.fan_rpm"], {"dT_degC": .12})
        heat, temp, fan = [], 60.0, wander(rng, 200, 500.0)
        for i in range(n):
            u = max(0.0, min(100.0, 45 + 3 * (70 + want(i * dt) - temp)))
            heat.append(u)
            m = self.power * u / 100
            truth = self.power * heat[max(0, i - self.late)] / 100 - self.loss * (temp - 20)
            case.add([temp + .05 * rng.gauss(0, 1), u, 1200 + fan(i * dt)], {"dT_degC": m}, {"dT_degC": truth},
                     {"dT_degC": truth + .08 * rng.gauss(0, 1)})
            temp += truth
        return case


class Slip(Machine):
    """A car's speed by its wheels: under load the tyres slip, in proportion to the pull; and the reading comes late."""
    parts = {"speed_mps": [("coupling", ["product", "gain", "hinge", "unknown"])]}

    def __init__(self, rng):
        self.slip, self.rest = rng.uniform(.006, .012), self.little(rng)

    def log(self, rng, held):
        dt, n = .05, 1400
        pull = wander(rng, 2.5, 6.0, "steps" if held else "sines")
        case = Case(dt, ["u.pull_mps2", "x.wheel_mps", "x.tyre_degC"], {"speed_mps": .05})
        v, warm = 9.0, wander(rng, 10, 40.0)
        for i in range(n):
            a = pull(i * dt) - .25 * (v - 9)
            wheel = v * (1 + self.slip * a)
            case.add([a, wheel, 50 + warm(i * dt)], {"speed_mps": wheel}, {"speed_mps": v}, {"speed_mps": v + .04 * rng.gauss(0, 1)})
            v = max(2.0, v + dt * a)
        return case


class Probe(Machine):
    """Change of the climb rate of two sounding rockets in coast (and a third, held out): drag differs between them; the reading wanders."""
    parts = {"dv_mps": [("quadratic_drag", [])]}

    def __init__(self, rng):
        self.k, self.count = [rng.uniform(1, 4) * 1e-4 for _ in range(4)], 0

    def log(self, rng, held):
        dt = rng.choice([.05, .1, .25])
        case = Case(dt, ["x.alt_m", "x.vz_mps", "x.roll_degps"], {"dv_mps": 1.2 * dt})
        h, v, k, push = rng.uniform(300, 900), rng.uniform(150, 330), self.k[self.count], 0.0
        self.count += 1
        while v > 2:
            m, before, at = -G * dt, v, h
            for _ in range(5):
                v -= dt / 5 * (G + k * math.exp(-h / 9000) * v * abs(v))
                h += dt / 5 * v
            push = .8 * push + .3 * dt * rng.gauss(0, 1)
            truth = v - before
            case.add([at + 3 * rng.gauss(0, 1), before + .3 * rng.gauss(0, 1), 40 + rng.gauss(0, 5)], {"dv_mps": m}, {"dv_mps": truth},
                     {"dv_mps": truth + push + .8 * dt * rng.gauss(0, 1)})
        return case


class Valve(Machine):
    """Flow through a valve against its command: nothing moves within a band about its middle."""
    parts = {"flow": [("dead_zone", [])]}

    def __init__(self, rng):
        self.band, self.rest = rng.uniform(.12, .3), self.little(rng)

    def log(self, rng, held):
        dt, n = .1, 1400
        want = wander(rng, 1.2, 5.0, "steps" if held else "sines")
        case = Case(dt, ["u.flow", "x.supply", "x.oil_degC"], {"flow": .05})
        supply, warm = wander(rng, 6, 30.0), wander(rng, 8, 50.0)
        for i in range(n):
            m = want(i * dt)
            truth = m - max(-self.band, min(self.band, m)) + .1 * self.band * self.rest(3 * m)
            case.add([m, 100 + supply(i * dt), 45 + warm(i * dt)], {"flow": m}, {"flow": truth}, {"flow": truth + .04 * rng.gauss(0, 1)})
        return case


class Sensor(Machine):
    """A pressure sender that reads with another gain and an offset; nothing else is wrong."""
    parts = {"p_bar": [("gain", []), ("bias", [])]}

    def __init__(self, rng):
        self.gain, self.offset, self.rest = rng.choice([.93, .95, 1.05, 1.08]), rng.choice([-1, 1]) * rng.uniform(.4, .8), self.little(rng)

    def log(self, rng, held):
        dt, n = .2, 1300
        level = wander(rng, 6, 12.0, "steps" if held else "sines")
        case = Case(dt, ["x.pump_rpm", "x.oil_degC", "u.open_pct"], {"p_bar": .25})
        warm = wander(rng, 9, 60.0)
        for i in range(n):
            m = 12 + level(i * dt)
            truth = self.gain * m + self.offset + .1 * self.rest(level(i * dt))
            case.add([900 + 60 * m + 20 * rng.gauss(0, 1), 45 + warm(i * dt), 30 + 3 * level(i * dt) + 2 * rng.gauss(0, 1)], {"p_bar": m},
                     {"p_bar": truth}, {"p_bar": truth + .2 * rng.gauss(0, 1)})
        return case


class Payarm(Machine):
    """Torque of a lifting joint: a payload's weight is missing, and friction."""
    parts = {"tau_Nm": [("coulomb_friction", []), ("unknown", ["slope", "periodic", "coupling", "viscous_friction"])]}
    law = True

    def __init__(self, rng):
        self.weight, self.c, self.d = rng.uniform(8, 20), rng.uniform(2, 5), rng.uniform(1, 4)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 1500
        path = wander(rng, 1.6, 3.0, "steps" if held else "sines")
        case = Case(dt, ["x.q_rad", "x.qd_radps", "x.motor_degC"], {"tau_Nm": .8})
        q, qd = rates(path, dt, n, .0005, 2)
        for i in range(n):
            t = i * dt
            v, a = true_rate(path, t), true_acc(path, t)
            m = 3.0 * a + 25 * math.cos(q[i])
            truth = m + self.weight * math.cos(q[i]) + self.c * math.tanh(v / .02) + self.d * v + self.c * self.rest(2 * v)
            case.add([q[i], qd[i], 35 + .004 * i], {"tau_Nm": m}, {"tau_Nm": truth}, {"tau_Nm": truth + .5 * rng.gauss(0, 1)})
        return case


class Servo(Machine):
    """Angle of a servo against its command: a second-order answer."""
    parts = {"angle_deg": [("lag", ["delay"])]}

    def __init__(self, rng):
        self.omega, self.damping, self.gain = rng.uniform(6, 14), rng.uniform(.7, 1.1), rng.uniform(.94, 1.0)

    def log(self, rng, held):
        dt, n = .02, 1500
        want = wander(rng, 40, 2.5, "steps" if held else "sines")
        case = Case(dt, ["u.angle_deg", "x.bus_V"], {"angle_deg": .8})
        q, v, bus = want(0), 0.0, wander(rng, .4, 12.0)
        for i in range(n):
            u = want(i * dt)
            for _ in range(5):
                v += dt / 5 * (self.omega ** 2 * (self.gain * want(i * dt) - q) - 2 * self.damping * self.omega * v)
                q += dt / 5 * v
            case.add([u, 12 + bus(i * dt)], {"angle_deg": u}, {"angle_deg": q}, {"angle_deg": q + .5 * rng.gauss(0, 1)})
        return case


class Calm(Machine):
    """Nothing is wrong but the stated deviation, heavy tails and coarse readings."""
    parts = {}

    def __init__(self, rng):
        self.factor, self.grain = rng.uniform(.9, 1.1), rng.uniform(.2, .6)

    def log(self, rng, held):
        dt, n = .1, 1500
        push = wander(rng, 2, 4.0, "steps" if held else "sines")
        case = Case(dt, ["x.pos", "x.vel", "u.push_N", "x.volt_V"], {"dvel": .02})
        v, x = 0.0, 0.0
        for i in range(n):
            u = push(i * dt) - v - .5 * x
            m = dt * u
            tail = math.sqrt(sum(rng.gauss(0, 1) ** 2 for _ in range(6)) / 6) * math.sqrt(6 / 4)
            read = m + .02 * self.factor * rng.gauss(0, 1) / tail
            case.add([x, v, u, 12 + .01 * rng.gauss(0, 1)], {"dvel": m}, {"dvel": m}, {"dvel": self.grain * .02 * round(read / (self.grain * .02))})
            v += m
            x += dt * v
        return case


class Noisy(Machine):
    """Nothing is wrong: position one row ahead from noisy readings of position and velocity, after a filter's lag."""
    parts = {}

    def __init__(self, rng):
        self.noise, self.pull = rng.uniform(.01, .03), rng.uniform(.5, 2)

    def log(self, rng, held):
        dt, n = .1, 1500
        push = wander(rng, 1, 4.0, "steps" if held else "sines")
        of_pos = self.noise * math.sqrt(2 + dt * dt)
        of_vel = math.sqrt(self.noise ** 2 * (1 + (1 - dt * self.pull) ** 2 + dt * dt) + .003 ** 2)
        case = Case(dt, ["x.pos_m", "x.vel_mps", "u.push"], {"pos_m": of_pos, "vel_mps": of_vel})
        x, v = 0.0, 0.0
        rx, rv = x + self.noise * rng.gauss(0, 1), v + self.noise * rng.gauss(0, 1)
        for i in range(n):
            u = push(i * dt)
            mx, mv = rx + dt * rv, rv + dt * (u - self.pull * rv - rx)
            row = [rx, rv, u]
            x, v = x + dt * v, v + dt * (u - self.pull * v - x) + .003 * rng.gauss(0, 1)
            rx, rv = x + self.noise * rng.gauss(0, 1), v + self.noise * rng.gauss(0, 1)
            m = {"pos_m": mx, "vel_mps": mv}
            case.add(row, m, m, {"pos_m": rx, "vel_mps": rv})
        return case


MACHINES = {"press": Press, "winch": Winch, "swing": Swing, "copter": Copter, "boat": Boat, "oven": Oven, "slip": Slip, "probe": Probe,
            "valve": Valve, "sensor": Sensor, "payarm": Payarm, "servo": Servo, "calm": Calm, "noisy": Noisy}

if __name__ == "__main__":
    draw(MACHINES, __doc__, "strangers")
