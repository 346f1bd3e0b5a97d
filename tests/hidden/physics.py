#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""physics.py --seed N --family F --out DIR --truth FILE: logs of machines of many kinds, each simulated without a part of its physics.

A pendulum, motors, a tank, a furnace, a ship, an arm, cars, a drone, rockets, a crane, a train and others: each is integrated in small
steps with the whole physics, read with noise, and predicted one row ahead (or in torque) from these readings by a simulation that
lacks a law. Beside what is hidden every machine has a little that no law says, as real ones do. Nothing is shared with the
engine, not even random numbers. Same truth as nature writes (README.md); `also`: other names that are as right."""
import argparse
import json
import math
import os
import random

sign = lambda v: (v > 0) - (v < 0)
G = 9.81


def wander(rng, span, period, kind="sines"):
    """A function of time within some `span` about 0: sines, or steps with ramps between them."""
    if kind == "sines":
        parts = [(span * rng.uniform(.25, .5), 2 * math.pi / period * rng.uniform(.4, 1.6), rng.uniform(0, 6.28)) for _ in range(3)]
        return lambda t: sum(a * math.sin(w * t + p) for a, w, p in parts)
    levels = [rng.uniform(-span, span) for _ in range(400)]

    def steps(t):
        k, part = divmod(t / period * 1.5, 1)
        a, b = levels[int(k) % 400], levels[(int(k) + 1) % 400]
        return a + (b - a) * max(0.0, min(1.0, (part - .7) / .3))
    return steps


class Case:
    """Features and channels of one log, row by row."""
    def __init__(self, dt, features, channels):
        self.dt, self.features, self.channels = dt, features, channels  # channels: name -> stated sd
        self.rows, self.m, self.t, self.z, self.at, self.g = [], [], [], [], [], []

    def add(self, row, m, t, z, g=None):
        """g: channel -> columns of the true form, for what least squares reaches with it."""
        self.at.append(len(self.rows) * self.dt)
        self.rows.append(row)
        self.m.append(m)
        self.t.append(t)
        self.z.append(z)
        self.g.append(g or {})

    def lose(self, rng, share):
        """Rows that never arrived."""
        kept = [i for i in range(len(self.rows)) if rng.random() >= share]
        for name in ("rows", "m", "t", "z", "at", "g"):
            setattr(self, name, [getattr(self, name)[i] for i in kept])


class Machine:
    """parts: {channel: [(cause, other names)]}; law: whether an expression is wanted. log(rng, held) -> Case."""
    law = False

    def little(self, rng):
        """What no law says: a share of the hidden effect, smooth in a quantity."""
        a, w, p = rng.uniform(.01, .04), rng.uniform(.5, 2), rng.uniform(0, 6.28)
        return lambda x: a * math.sin(w * x + p)


class Pendulum(Machine):
    """Rate one row ahead; the pivot's friction is missing."""
    parts = {"rate_radps": [("coulomb_friction", []), ("viscous_friction", [])]}

    def __init__(self, rng):
        self.length, self.inertia = rng.uniform(.3, .8), rng.uniform(.05, .2)
        self.c, self.d = rng.uniform(.06, .15), rng.uniform(.04, .12)
        self.noise, self.rest = .004, self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 1500
        torque = wander(rng, 1.6, 3.0, "steps" if held else "sines")
        case = Case(dt, ["x.angle_rad", "x.rate_radps", "u.torque_Nm"], {"rate_radps": .006})
        q, v, t = 0.1, 0.0, 0.0
        read = v + self.noise * rng.gauss(0, 1)
        for i in range(n):
            u, q0, free, read_v, k = torque(t), q, v, read, G / self.length
            angles = [q, q]
            for _ in range(20):  # without friction, from the true start and from its reading
                free, read_v = (a + dt / 20 * (u / self.inertia - k * math.sin(b)) for a, b in zip((free, read_v), angles))
                angles = [b + dt / 20 * a for a, b in zip((free, read_v), angles)]
            m = read_v
            for _ in range(20):
                f = self.c * sign(v) + self.d * v + .3 * self.c * self.rest(q)
                v += dt / 20 * ((u - f) / self.inertia - k * math.sin(q))
                q += dt / 20 * v
            t += dt
            truth = m + (v - free)
            row = [q0, read, u]
            read = v + self.noise * rng.gauss(0, 1)
            case.add(row, {"rate_radps": m}, {"rate_radps": truth}, {"rate_radps": read})
        return case


class Motor(Machine):
    """Current of a drive by inverse dynamics; friction and cogging are missing."""
    parts = {"current_A": [("coulomb_friction", []), ("viscous_friction", []), ("periodic", [])]}

    def __init__(self, rng):
        self.c, self.d, self.cog = rng.uniform(.4, 1), rng.uniform(.02, .06), rng.uniform(.2, .4)
        self.poles, self.phase, self.inertia = rng.choice([3, 4, 5, 6, 7]), rng.uniform(0, 6), rng.uniform(.01, .03)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .01, 1800
        speed = wander(rng, 22, 2.0, "steps" if held else "sines")
        case = Case(dt, ["x.angle_rad", "x.omega_radps", "x.winding_degC"], {"current_A": .15})
        q, heat = rng.uniform(0, 6), rng.uniform(25, 35)
        for i in range(n):
            t = i * dt
            v, a = speed(t), (speed(t + dt) - speed(t - dt)) / 2 / dt
            q += dt * v
            heat += dt * .02 * (abs(v) - .2 * (heat - 25))
            m = self.inertia * a
            truth = m + self.c * sign(v) + self.d * v + self.cog * math.sin(self.poles * q + self.phase) + self.c * self.rest(v / 9)
            case.add([(q + math.pi) % (2 * math.pi) - math.pi, v + .05 * rng.gauss(0, 1), heat + .1 * rng.gauss(0, 1)],
                     {"current_A": m}, {"current_A": truth}, {"current_A": truth + .1 * rng.gauss(0, 1)})
        return case


class BackEmf(Machine):
    """Change of a motor's speed under a voltage; its back EMF is missing."""
    parts = {"domega_radps": [("viscous_friction", [])]}

    def __init__(self, rng):
        self.gain, self.emf, self.rest = rng.uniform(8, 16), rng.uniform(.5, 2), self.little(rng)

    def log(self, rng, held):
        dt, n = .05, 1200
        volts = wander(rng, 10, 4.0, "steps" if held else "sines")
        case = Case(dt, ["x.omega_radps", "u.drive_V", "x.bus_V"], {"domega_radps": .3})
        v = 0.0
        for i in range(n):
            u = volts(i * dt)
            m = dt * self.gain * u
            truth = m - dt * self.emf * (v + 2 * self.rest(u))
            case.add([v + .05 * rng.gauss(0, 1), u, 24 + .2 * rng.gauss(0, 1)], {"domega_radps": m}, {"domega_radps": truth},
                     {"domega_radps": truth + .2 * rng.gauss(0, 1)})
            v += truth
        return case


class Tank(Machine):
    """Level of a tank, its change; the outflow through an orifice is missing: a root of the level."""
    parts = {"dlevel_mm": [("unknown", [])]}
    law = True

    def __init__(self, rng):
        self.out, self.area, self.rest = rng.uniform(1.5, 3), rng.uniform(.7, 1.4), self.little(rng)

    def log(self, rng, held):
        dt, n = 1.0, 1000
        flow = wander(rng, 1, 80.0, "steps" if held else "sines")
        case = Case(dt, ["x.level_m", "u.inflow_Lps", "x.room_degC"], {"dlevel_mm": .1})
        h = rng.uniform(.3, 1)
        room = wander(rng, 4, 300.0)
        for i in range(n):
            u = self.out * (.9 + .45 * flow(i * dt))
            m = u / self.area
            truth = m - self.out * math.sqrt(max(h, 0)) * (1 + self.rest(h)) / self.area
            truth = max(truth, -1000 * h * .9)
            case.add([h + .001 * rng.gauss(0, 1), u, 20 + room(i * dt)], {"dlevel_mm": m}, {"dlevel_mm": truth},
                     {"dlevel_mm": truth + .1 * rng.gauss(0, 1)})
            h = max(.003, h + .012 * truth)
        return case


class Furnace(Machine):
    """Change of a temperature; the simulation has convection, radiation is missing: a fourth power."""
    parts = {"dT_K": [("unknown", [])]}
    law = True

    def __init__(self, rng):
        self.conv, self.rad, self.rest = rng.uniform(.002, .004), rng.uniform(.8, 1.6), self.little(rng)

    def log(self, rng, held):
        dt, n = 5.0, 1200
        power = wander(rng, 1, 1200.0, "steps" if held else "sines")
        case = Case(dt, ["x.oven_K", "x.hall_K", "u.heat_kW"], {"dT_K": .05})
        temp, hall = 320.0, wander(rng, 5, 3000.0)
        for i in range(n):
            u, cold = max(0.0, 3 + 4.5 * power(i * dt)), 293 + hall(i * dt)
            m = dt * (.5 * u - self.conv * (temp - cold))
            loss = self.rad * ((temp / 500) ** 4 - (cold / 500) ** 4)
            truth = m - dt * loss * .5 * (1 + self.rest(temp / 100))
            case.add([temp + .05 * rng.gauss(0, 1), cold + .05 * rng.gauss(0, 1), u], {"dT_K": m}, {"dT_K": truth},
                     {"dT_K": truth + .05 * rng.gauss(0, 1)})
            temp += truth
        return case


class Ship(Machine):
    """Change of the turn rate by rudder and speed; drag in the turn is missing; and the loss of speed in a turn."""
    parts = {"dturn_degps": [("quadratic_drag", [])]}

    def __init__(self, rng):
        self.pull, self.drag, self.rest = rng.uniform(.03, .05), rng.uniform(.06, .12), self.little(rng)

    def log(self, rng, held):
        dt, n = 1.0, 1500
        rudder = wander(rng, 25, 90.0, "steps" if held else "sines")
        case = Case(dt, ["x.heading_rad", "x.turn_degps", "x.surge_mps", "u.rudder_deg"], {"dturn_degps": .02})
        r, psi, s = 0.0, 0.0, 6.0
        for i in range(n):
            u = rudder(i * dt)
            m = dt * (self.pull * u * s / 60 - .05 * r)
            truth = m - dt * self.drag * r * (abs(r) + self.rest(psi))
            case.add([(psi + math.pi) % (2 * math.pi) - math.pi, r + .01 * rng.gauss(0, 1), s + .02 * rng.gauss(0, 1), u],
                     {"dturn_degps": m}, {"dturn_degps": truth}, {"dturn_degps": truth + .02 * rng.gauss(0, 1)})
            psi += math.radians(r) * dt
            r += truth
            s += dt * (.05 * (7 - s) - .05 * r * r)
        return case


class Arm(Machine):
    """Torques of two joints against rigid bodies with a payload's share wrong; friction of both is missing."""
    parts = {"torque1_Nm": [("coulomb_friction", []), ("viscous_friction", [])],
             "torque2_Nm": [("coulomb_friction", []), ("viscous_friction", [])]}

    def __init__(self, rng):
        self.c = [rng.uniform(4, 12), rng.uniform(2, 6)]
        self.d = [rng.uniform(5, 20), rng.uniform(2, 8)]
        self.offset, self.gain, self.rest = rng.uniform(-1, 1), rng.uniform(.97, 1.03), self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 1500
        q1, q2 = (wander(rng, 1.2, p, "steps" if held else "sines") for p in (3.0, 2.5))
        case = Case(dt, ["x.q1_rad", "x.q2_rad", "x.qd1_radps", "x.qd2_radps"], {"torque1_Nm": 1.0, "torque2_Nm": .5})
        rate = lambda q, t: (q(t + 1e-3) - q(t - 1e-3)) / 2e-3
        acc = lambda q, t: (q(t + 2e-2) - 2 * q(t) + q(t - 2e-2)) / 4e-4
        for i in range(n):
            t = i * dt + .1
            a, b, va, vb = q1(t), q2(t), rate(q1, t), rate(q2, t)
            m1 = (4 + 2 * math.cos(b)) * acc(q1, t) - math.sin(b) * (2 * va + vb) * vb + 30 * math.cos(a) + 9 * math.cos(a + b)
            m2 = 1.2 * acc(q2, t) + (1 + math.cos(b)) * acc(q1, t) + math.sin(b) * va * va + 9 * math.cos(a + b)
            f = lambda k, v, q: self.c[k] * math.tanh(v / .01) + self.d[k] * v + 2 * self.c[k] * self.rest(2 * q)
            z1, z2 = self.gain * m1 + f(0, va, a) + self.offset, self.gain * m2 + f(1, vb, b)
            case.add([a, b, va + .002 * rng.gauss(0, 1), vb + .002 * rng.gauss(0, 1)], {"torque1_Nm": m1, "torque2_Nm": m2},
                     {"torque1_Nm": z1, "torque2_Nm": z2},
                     {"torque1_Nm": z1 + .5 * rng.gauss(0, 1), "torque2_Nm": z2 + .2 * rng.gauss(0, 1)})
        return case


class Tyres(Machine):
    """Yaw rate against the steering at once; the tyres answer through a lag, and the car understeers."""
    parts = {"yaw_radps": [("lag", ["delay"])]}

    def __init__(self, rng):
        self.lag, self.under, self.base = rng.uniform(.15, .4), rng.uniform(.0, .004), rng.uniform(2.4, 2.9)

    def log(self, rng, held):
        dt, n = .05, 1200
        steer, pace = wander(rng, .12, 3.0, "steps" if held else "sines"), wander(rng, 6, 25.0)
        case = Case(dt, ["u.steer_rad", "x.speed_mps", "x.fuel_L"], {"yaw_radps": .015})
        w = 0.0
        for i in range(n):
            u, v = steer(i * dt), 14 + pace(i * dt)
            m = v / self.base * math.tan(u)
            for _ in range(10):
                w += dt / 10 / self.lag * (m / (1 + self.under * v * v / 10) - w)
            case.add([u, v + .05 * rng.gauss(0, 1), 30 - .01 * i * dt], {"yaw_radps": m}, {"yaw_radps": w},
                     {"yaw_radps": w + .012 * rng.gauss(0, 1)})
        return case


class Drone(Machine):
    """Climb one row ahead from the thrust; near the ground the rotor gives more: in the simulation it does not."""
    parts = {"dclimb_mps": [("unknown", ["hinge", "bias"])]}
    law = True

    def __init__(self, rng):
        self.radius, self.mass = rng.uniform(.5, .8), rng.uniform(1, 3)

    def log(self, rng, held):
        dt, n = .05, 2000
        path = wander(rng, 1.0, 12.0, "steps" if held else "sines")
        case = Case(dt, ["x.height_m", "x.climb_mps", "u.thrust_N", "x.battery_V"], {"dclimb_mps": .01})
        h, v = 1.2, 0.0
        for i in range(n):
            want = 1.1 + .9 * path(i * dt)
            u = max(.2, self.mass * (G + 4 * (want - h) - 3 * v))
            m = dt * (u / self.mass - G)
            lift = u / (1 - min(.6, (self.radius / 4 / max(h, .1)) ** 2 * 4))
            truth = dt * (lift / self.mass - G)
            case.add([h + .003 * rng.gauss(0, 1), v + .01 * rng.gauss(0, 1), u, 15 - .0006 * i], {"dclimb_mps": m},
                     {"dclimb_mps": truth}, {"dclimb_mps": truth + .01 * rng.gauss(0, 1)})
            v += truth
            h = max(.15, h + dt * v)
        return case


class Rocket(Machine):
    """Speed of coasting rockets under gravity alone; drag in thinning air is missing, of a size of its own in each."""
    parts = {"climb_mps": [("quadratic_drag", [])]}

    def __init__(self, rng):
        self.k = [rng.uniform(.6, 4) * 1e-4 for _ in range(4)]
        self.count = 0

    def log(self, rng, held):
        dt = rng.choice([.1, .2, .5])
        case = Case(dt, ["x.altitude_m", "x.climb_mps"], {"climb_mps": .4})
        h, v, k = rng.uniform(400, 1500), rng.uniform(180, 420), self.k[self.count]
        self.count += 1
        read = v + .2 * rng.gauss(0, 1)
        while v > 3:
            m, drag = read - G * dt, k * math.exp(-h / 8500)
            case_row, before = [h + 1.5 * rng.gauss(0, 1), read], v
            for _ in range(10):
                v -= dt / 10 * (G + drag * v * abs(v))
                h += dt / 10 * v
            truth = m + (v - before + G * dt)
            read = v + .2 * rng.gauss(0, 1)
            case.add(case_row, {"climb_mps": m}, {"climb_mps": truth}, {"climb_mps": read})
        return case


class Payload(Machine):
    """Change of speed by force; the mass is wrong: a gain of the prediction."""
    parts = {"dv_mps": [("gain", [])]}

    def __init__(self, rng):
        self.mass, self.more = rng.uniform(40, 80), rng.choice([.8, .85, 1.2, 1.3])

    def log(self, rng, held):
        dt, n = .1, 1500
        force = wander(rng, 60, 4.0, "steps" if held else "sines")
        case = Case(dt, ["x.x_m", "x.v_mps", "u.force_N", "x.light_pct"], {"dv_mps": .006})
        v, x = 0.0, 0.0
        light = wander(rng, 40, 20.0)
        for i in range(n):
            u = force(i * dt) - 4 * v - 2 * x
            m = dt * u / self.mass
            truth = m / self.more
            case.add([x, v + .003 * rng.gauss(0, 1), u, 50 + light(i * dt)], {"dv_mps": m}, {"dv_mps": truth},
                     {"dv_mps": truth + .005 * rng.gauss(0, 1)})
            v += truth
            x += dt * v
        return case


class Thruster(Machine):
    """Speed that a drive gives a wheel; it cannot exceed a level."""
    parts = {"speed_mps": [("saturation", [])]}

    def __init__(self, rng):
        self.most, self.wobble = rng.uniform(.55, .8), self.little(rng)

    def log(self, rng, held):
        dt, n = .1, 1400
        want = wander(rng, 1.2, 6.0, "steps" if held else "sines")
        case = Case(dt, ["u.speed_mps", "x.ground_pct", "x.case_degC"], {"speed_mps": .02})
        warm = wander(rng, 8, 60.0)
        for i in range(n):
            m = want(i * dt)
            truth = max(-self.most, min(self.most, m))
            ground = 50 + 30 * math.sin(i / 47) + rng.gauss(0, 1)
            case.add([m, ground, 40 + warm(i * dt)], {"speed_mps": m}, {"speed_mps": truth},
                     {"speed_mps": truth + .015 * rng.gauss(0, 1)})
        return case


class Train(Machine):
    """Coasting and pulling, always forward: rolling resistance and drag of the air are missing."""
    parts = {"dv_mps": [("quadratic_drag", []), ("coulomb_friction", ["bias"])]}

    def __init__(self, rng):
        self.roll, self.air, self.rest = rng.uniform(.015, .03), rng.uniform(6e-5, 1.2e-4), self.little(rng)

    def log(self, rng, held):
        dt, n = 1.0, 1500
        pull = wander(rng, .3, 120.0, "steps" if held else "sines")
        case = Case(dt, ["x.speed_mps", "u.pull_kN", "x.place_km", "x.outside_degC"], {"dv_mps": .01})
        v, x = rng.uniform(15, 25), 0.0
        for i in range(n):
            u = pull(i * dt) + .09 - (.3 if v > 45 else 0) + (.3 if v < 6 else 0)
            m = dt * u
            truth = m - dt * (self.roll + self.air * v * v) * (1 + self.rest(x))
            case.add([v + .01 * rng.gauss(0, 1), 400 * u, x, 15 + 3 * math.sin(i / 400)], {"dv_mps": m}, {"dv_mps": truth},
                     {"dv_mps": truth + .008 * rng.gauss(0, 1)})
            v = max(1.0, v + truth)
            x += v * dt / 1000
        return case


class Cylinder(Machine):
    """Force on a hydraulic cylinder by inverse dynamics: friction that differs by direction, and an offset."""
    parts = {"force_N": [("coulomb_friction", []), ("viscous_friction", [])]}

    def __init__(self, rng):
        self.up, self.down = rng.uniform(60, 100), rng.uniform(30, 60)
        self.d, self.mass, self.rest = rng.uniform(150, 400), rng.uniform(30, 90), self.little(rng)

    def log(self, rng, held):
        dt, n = .02, 1600
        q = wander(rng, .25, 3.0, "steps" if held else "sines")
        case = Case(dt, ["x.stroke_m", "x.stroke_mps", "x.oil_degC"], {"force_N": 15.0})
        for i in range(n):
            t = i * dt + .1
            v, a = (q(t + 1e-3) - q(t - 1e-3)) / 2e-3, (q(t + 2e-2) - 2 * q(t) + q(t - 2e-2)) / 4e-4
            m = self.mass * a
            f = (self.up if v > 0 else -self.down if v < 0 else 0.0) + self.d * v + 60 * self.rest(9 * q(t))
            case.add([q(t), v + .002 * rng.gauss(0, 1), 40 + i / n], {"force_N": m}, {"force_N": m + f},
                     {"force_N": m + f + 6 * rng.gauss(0, 1)})
        return case


class Spring(Machine):
    """Force that a joint holds: a spring that grows stiffer is missing, x and x cubed."""
    parts = {"force_N": [("unknown", ["coupling"])]}
    law = True

    def __init__(self, rng):
        self.k, self.cube = rng.uniform(20, 60), rng.uniform(400, 900)

    def log(self, rng, held):
        dt, n = .02, 1500
        q = wander(rng, .45, 2.5, "steps" if held else "sines")
        case = Case(dt, ["x.flex_m", "x.flex_mps", "u.motor_A"], {"force_N": 2.0})
        for i in range(n):
            t = i * dt + .1
            x, v, a = q(t), (q(t + 1e-3) - q(t - 1e-3)) / 2e-3, (q(t + 2e-2) - 2 * q(t) + q(t - 2e-2)) / 4e-4
            m = 4 * a
            f = self.k * x + self.cube * x ** 3
            case.add([x, v, m / 9 + .1 * rng.gauss(0, 1)], {"force_N": m}, {"force_N": m + f}, {"force_N": m + f + 1.5 * rng.gauss(0, 1)})
        return case


class Belt(Machine):
    """Speed of a conveyor against its command: it answers late."""
    parts = {"belt_mps": [("delay", ["lag"])]}

    def __init__(self, rng):
        self.late, self.lag = rng.uniform(.25, .7), rng.uniform(.05, .15)

    def log(self, rng, held):
        dt, n = .05, 1200
        want = wander(rng, .5, 4.0, "steps" if held else "sines")
        case = Case(dt, ["u.belt_mps", "x.load_kg"], {"belt_mps": .02})
        v, load = 1 + want(-self.late), wander(rng, 20, 15.0)
        for i in range(n):
            for k in range(5):
                v += dt / 5 / self.lag * (1 + want(i * dt + k * dt / 5 - self.late) - v)
            m = 1 + want(i * dt + dt)
            case.add([m, 40 + load(i * dt)], {"belt_mps": m}, {"belt_mps": v}, {"belt_mps": v + .012 * rng.gauss(0, 1)})
        return case


class Well(Machine):
    """Nothing is wrong but a little that no law says, and a disturbance that wanders."""
    parts = {}

    def __init__(self, rng):
        self.hold, self.size = rng.uniform(.5, 3), rng.uniform(.3, .8)

    def log(self, rng, held):
        dt, n = .1, 1500
        push = wander(rng, 2, 4.0, "steps" if held else "sines")
        case = Case(dt, ["x.x_m", "x.v_mps", "u.push_N", "x.warm_degC"], {"dv_mps": .02})
        v, x, d = 0.0, 0.0, 0.0
        keep = math.exp(-dt / self.hold)
        for i in range(n):
            d = keep * d + math.sqrt(1 - keep * keep) * rng.gauss(0, 1) * self.size * .02
            u = push(i * dt) - v - .5 * x
            m = dt * u
            case.add([x, v, u, 20 + 3 * math.sin(i / 90)], {"dv_mps": m}, {"dv_mps": m},
                     {"dv_mps": m + d + .02 * math.sqrt(max(.1, 1 - self.size ** 2)) * rng.gauss(0, 1)})
            v += m
            x += dt * v
        return case


MACHINES = {"pendulum": Pendulum, "motor": Motor, "back_emf": BackEmf, "tank": Tank, "furnace": Furnace, "ship": Ship, "arm": Arm,
            "tyres": Tyres, "drone": Drone, "rocket": Rocket, "payload": Payload, "thruster": Thruster, "train": Train,
            "cylinder": Cylinder, "spring": Spring, "belt": Belt, "well": Well}


def write(case, path):
    with open(path, "w", encoding="utf-8") as out:
        out.write(",".join(["t_s"] + case.features + [p + c for c in case.channels for p in ("z.", "m.", "sd.")]) + "\n")
        for i, row in enumerate(case.rows):
            cells = [case.at[i]] + row
            for c, s in case.channels.items():
                cells += [case.z[i][c], case.m[i][c], s]
            out.write(",".join("%.9g" % x for x in cells) + "\n")


def scores(case, c):
    n, s = len(case.rows), case.channels[c]
    square = lambda a: sum((z[c] - b[c]) ** 2 for z, b in zip(case.z, a)) / n
    nll = lambda a: .5 * (square(a) / s / s + math.log(2 * math.pi * s * s))
    return {"rmse_before": math.sqrt(square(case.m)), "rmse_true": math.sqrt(square(case.t)), "nll_before": nll(case.m),
            "nll_true": nll(case.t)}


def solve(a, b):
    """a x = b by Gauss with pivots; a hardly positive pivot leaves its size at none."""
    n = len(b)
    a = [row[:] + [b[i]] for i, row in enumerate(a)]
    for i in range(n):
        p = max(range(i, n), key=lambda k: abs(a[k][i]))
        a[i], a[p] = a[p], a[i]
        for k in range(n):
            if k != i and abs(a[i][i]) > 1e-300:
                f = a[k][i] / a[i][i]
                a[k] = [x - f * y for x, y in zip(a[k], a[i])]
    return [a[i][n] / a[i][i] if abs(a[i][i]) > 1e-300 else 0.0 for i in range(n)]


def least_squares(cases, c):
    """RMSE on the last case of the true form of channel c, its sizes by least squares on the others; None where it is not given."""
    k = len(cases[0].g[0].get(c, []))
    if k == 0:
        return None
    gram, right = [[0.0] * k for _ in range(k)], [0.0] * k
    for case in cases[:-1]:
        for g, z, m in zip(case.g, case.z, case.m):
            for i in range(k):
                right[i] += g[c][i] * (z[c] - m[c])
                for j in range(k):
                    gram[i][j] += g[c][i] * g[c][j]
    size, last = solve(gram, right), cases[-1]
    left = [z[c] - m[c] - sum(s * x for s, x in zip(size, g[c])) for g, z, m in zip(last.g, last.z, last.m)]
    return math.sqrt(sum(e * e for e in left) / len(left))


def draw(machines, about, text):
    """The command line of a file of machines; `text` goes into every seed."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--family", default="each")
    parser.add_argument("--out", required=True)
    parser.add_argument("--truth", required=True)
    o = parser.parse_args()
    every = list(machines)
    family = every[o.seed % len(every)] if o.family in ("each", "any") else o.family
    if family not in machines:
        parser.error("no machine '%s': %s" % (family, " ".join(every)))
    rng = random.Random("%s %s %d" % (text, family, o.seed))
    machine = machines[family](rng)
    cases = [machine.log(rng, k == 3) for k in range(4)]
    os.makedirs(o.out, exist_ok=True)
    sd = cases[0].channels
    truth = {"schema": "rim-hidden-truth/1", "seed": o.seed, "family": family, "attempts": 1, "noise": "white", "world": family,
             "noise_parameter": 0, "effects": [], "logs": [], "holdout": {},
             "channels": [{"name": c, "sd": s} for c, s in sd.items()]}
    for c, parts in machine.parts.items():
        for cause, also in parts:
            truth["effects"].append({"family": family, "cause": cause, "also": also, "kind": "mean", "channel": c, "gate": None})
    for k, case in enumerate(cases):
        held = k == 3
        name = "holdout_1.csv" if held else "run_%d.csv" % (k + 1)
        write(case, os.path.join(o.out, name))
        of = lambda c: [(t[c] - m[c]) / sd[c] for t, m in zip(case.t, case.m)]
        difference = {c: of(c) for c in machine.parts}
        truth["logs"].append({"file": name, "holdout": held, "rows": len(case.rows),
                              "effect_sd": {c: [round(d, 4) for d in all_] for c, all_ in difference.items()},
                              "acts": [int(any(abs(d[i]) > .1 for d in difference.values())) for i in range(len(case.rows))]})
        if held:
            truth["holdout"] = {c: scores(case, c) for c in sd}
            for c in sd:
                truth["holdout"][c]["rmse_least_squares"] = least_squares(cases, c)
    with open(o.truth, "w", encoding="utf-8") as out:
        json.dump(truth, out)


if __name__ == "__main__":
    draw(MACHINES, __doc__, "physics")
