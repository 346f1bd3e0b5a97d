#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""visitors.py --seed N --family F --out DIR --truth FILE: a third lot of machines, drawn after the search was finished.

Driven as such machines are: by trapezoidal moves, chirps, pseudo-random steps, controllers that answer what is wrong. Integrated by
Runge and Kutta's rule. Writing and scoring is physics.py's; the machines are others."""
import math

from physics import Case, G, Machine, draw, sign


def moves(rng, span, rate, rest):
    """Position over time of point-to-point moves with trapezoidal speed: rest, ramp, cruise, ramp, rest; exact position, speed, acceleration."""
    parts, t, q = [], 0.0, 0.0
    while t < 200:
        goal, speed = rng.uniform(-span, span), rate * rng.uniform(.3, 1)
        ramp = rng.uniform(.15, .35)
        length = max(abs(goal - q), speed * ramp * 1.05)
        parts.append((t, q, sign(goal - q) * speed, ramp, length / speed))
        q, t = q + sign(goal - q) * length, t + length / speed + ramp + rng.uniform(.2, 1) * rest

    def at(time):
        import bisect
        t0, q0, v, ramp, cruise = parts[max(0, bisect.bisect_right(parts, (time, 1e9)) - 1)]
        s = time - t0
        if s < ramp:
            return q0 + .5 * v * s * s / ramp, v * s / ramp, v / ramp
        if s < cruise:
            return q0 + v * (s - .5 * ramp), v, 0.0
        if s < cruise + ramp:
            left = cruise + ramp - s
            return q0 + v * cruise - .5 * v * left * left / ramp, v * left / ramp, -v / ramp
        return q0 + v * cruise, 0.0, 0.0
    return at


def chirp(rng, span, slow, fast, time):
    """Frequencies swept from one to the other and back, of an amplitude that breathes."""
    p, w = rng.uniform(0, 6), rng.uniform(5, 9) / time
    phase = lambda t: 2 * math.pi * (slow * t + (fast - slow) * (t / 2 - time / (4 * math.pi) * math.sin(2 * math.pi * t / time))) + p
    return lambda t: span * (.7 + .3 * math.sin(w * t)) * math.sin(phase(t))


def steps(rng, low, high, hold):
    """Pseudo-random levels, each held for a while."""
    levels, ends, t = [], [], 0.0
    while t < 20000 * hold / 10:
        t += hold * rng.choice([.5, 1, 1, 2, 3])
        levels.append(rng.uniform(low, high))
        ends.append(t)
    def at(time):
        import bisect
        return levels[min(len(levels) - 1, bisect.bisect_right(ends, time))]
    return at


def rk4(f, x, t, dt, parts=4):
    h = dt / parts
    for _ in range(parts):
        a = f(t, x)
        b = f(t + h / 2, [p + h / 2 * q for p, q in zip(x, a)])
        c = f(t + h / 2, [p + h / 2 * q for p, q in zip(x, b)])
        d = f(t + h, [p + h * q for p, q in zip(x, c)])
        x = [p + h / 6 * (q + 2 * r + 2 * s + u) for p, q, r, s, u in zip(x, a, b, c, d)]
        t += h
    return x


class Wrist(Machine):
    """Torque of an arm's wrist from a smoothed current: friction of three kinds beside a small load, in moves with rests."""
    parts = {"tau4_Nm": [("coulomb_friction", []), ("viscous_friction", [])]}

    def __init__(self, rng):
        self.c, self.more, self.v0 = rng.uniform(1.5, 3), rng.uniform(.2, .6), rng.uniform(.05, .12)
        self.d, self.offset, self.rest = rng.uniform(1.2, 3.0), rng.uniform(-.3, .3), self.little(rng)

    def log(self, rng, held):
        dt, n = .012, 1800
        path = moves(rng, 2.2, 2.2, .6) if held else None
        wave = [(rng.uniform(.2, .6), rng.uniform(.15, .9), rng.uniform(0, 6)) for _ in range(4)]
        case = Case(dt, ["x.q4", "x.qd4", "x.q5", "x.board_degC"], {"tau4_Nm": .3})
        current = 0.0
        for i in range(n):
            t = i * dt
            if held:
                q, v, a = path(t)
            else:
                q = sum(s * math.sin(6.28 * w * t + p) for s, w, p in wave)
                v = sum(s * 6.28 * w * math.cos(6.28 * w * t + p) for s, w, p in wave)
                a = -sum(s * (6.28 * w) ** 2 * math.sin(6.28 * w * t + p) for s, w, p in wave)
            m = .08 * a + 1.6 * math.sin(q)
            f = (self.c + self.more * math.exp(-(v / self.v0) ** 2)) * math.tanh(v / .004) + self.d * v + self.offset
            truth = m + f + self.c * self.rest(3 * q)
            current = .4 * current + .6 * (truth + .35 * rng.gauss(0, 1)) if i else truth
            case.add([q, v + .004 * rng.gauss(0, 1), .5 * math.sin(.7 * t), 41 + .002 * i], {"tau4_Nm": m}, {"tau4_Nm": truth}, {"tau4_Nm": current})
        return case


class Sagging(Machine):
    """Vertical acceleration of a multirotor from its commands; the battery sags, and thrust falls with the voltage; and rotors drag."""
    parts = {"az_mps2": [("product", ["coupling", "drift", "drift_from", "unknown"]), ("viscous_friction", ["quadratic_drag"])]}
    law = True

    def __init__(self, rng):
        self.k, self.sag, self.rest = rng.uniform(.25, .5), rng.uniform(.06, .1), self.little(rng)

    def log(self, rng, held):
        dt, n = .05, 1600
        want = steps(rng, 3, 12, 3.0) if held else chirp(rng, 4, .03, .3, 40)
        case = Case(dt, ["x.alt_m", "x.vz_mps", "u.thrust_mps2", "x.batt_V"], {"az_mps2": .3})
        h, v, used = 6.0, 0.0, 0.0
        for i in range(n):
            u = max(2.0, min(20.0, G + 1.5 * ((want(i * dt) if held else 8 + want(i * dt)) - h) - 2.2 * v))
            used += u * dt
            volt = 16.6 - used / 500 - .04 * u
            m = u - G
            of = lambda s: u * (1 - self.sag * (16.6 - volt)) - G - self.k * s * (1 + self.rest(h))
            truth = of(v)
            case.add([h + .02 * rng.gauss(0, 1), v + .03 * rng.gauss(0, 1), u, volt + .02 * rng.gauss(0, 1)], {"az_mps2": m}, {"az_mps2": truth},
                     {"az_mps2": truth + .25 * rng.gauss(0, 1)})
            h, v = rk4(lambda t, x: [x[1], of(x[1])], [h, v], 0, dt)
        return case


class Leak(Machine):
    """Change of a chamber's pressure; it leaks through an orifice: a root of the difference, whichever way it goes."""
    parts = {"dp_bar": [("unknown", ["coupling", "coulomb_friction"])]}
    law = True

    def __init__(self, rng):
        self.leak, self.rest = rng.uniform(.25, .5), self.little(rng)

    def log(self, rng, held):
        dt, n = .1, 1300
        feed = steps(rng, -1.6, 1.6, 3) if held else chirp(rng, 1.5, .02, .15, 60)
        case = Case(dt, ["x.dp_bar", "u.pump_Lpm", "x.oil_degC"], {"dp_bar": .02})
        p = 0.0
        for i in range(n):
            u = feed(i * dt)
            m = dt * u
            truth = m - dt * self.leak * sign(p) * math.sqrt(abs(p)) * (1 + self.rest(p))
            case.add([p + .005 * rng.gauss(0, 1), 10 * u, 40 + 4 * math.sin(i / 300)], {"dp_bar": m}, {"dp_bar": truth},
                     {"dp_bar": truth + .015 * rng.gauss(0, 1)})
            p = max(-6.0, min(6.0, p + truth))
        return case


class Drive(Machine):
    """Speed of a motor one row ahead: the amplifier cannot give more than a level, in the simulation it can; the load is viscous."""
    parts = {"dw_radps": [("viscous_friction", []), ("saturation", ["saturation_above", "hinge", "unknown", "gain", "coupling"])]}

    def __init__(self, rng):
        self.most, self.d = rng.uniform(5, 8), rng.uniform(.6, 1.2)

    def log(self, rng, held):
        dt, n = .02, 1500
        want = steps(rng, -14, 14, .8) if held else chirp(rng, 12, .1, 1.5, 15)
        case = Case(dt, ["x.w_radps", "u.volts", "x.winding_degC"], {"dw_radps": .05})
        w = 0.0
        for i in range(n):
            u = want(i * dt)
            give = 3.0 * max(-self.most, min(self.most, u))
            m = dt * 3.0 * u
            new = rk4(lambda t, x: [give - self.d * x[0]], [w], 0, dt)[0]
            truth = new - w
            case.add([w + .02 * rng.gauss(0, 1), u, 50 + i / 300], {"dw_radps": m}, {"dw_radps": truth}, {"dw_radps": truth + .04 * rng.gauss(0, 1)})
            w = new
        return case


class Truck(Machine):
    """Acceleration of a truck by its engine's force over a stated mass: the mass is wrong, the road rolls and the air drags."""
    parts = {"ax": [("quadratic_drag", []), ("bias", ["coulomb_friction"]), ("gain", [])]}

    def __init__(self, rng):
        self.mass, self.roll, self.air = rng.choice([1.25, 1.35, .8]), rng.uniform(.06, .1), rng.uniform(2.5e-4, 4e-4)

    def log(self, rng, held):
        dt, n = .5, 1500
        want = steps(rng, 6, 28, 20) if held else chirp(rng, 9, .003, .02, 400)
        case = Case(dt, ["x.v_mps", "u.force_kN", "x.engine_rpm"], {"ax": .05})
        v = 14.0
        for i in range(n):
            goal = want(i * dt) if held else 16 + want(i * dt)
            a = max(-2.0, min(1.5, .3 * (goal - v)))
            m = a
            of = lambda s: a / self.mass - self.roll - self.air * s * s
            truth = of(v)
            case.add([v + .03 * rng.gauss(0, 1), 20 * a, 900 + 40 * (v % 7)], {"ax": m}, {"ax": truth}, {"ax": truth + .04 * rng.gauss(0, 1)})
            v = max(2.0, rk4(lambda t, x: [of(x[0])], [v], 0, dt, 2)[0])
        return case


class Lift(Machine):
    """Rope force of an elevator by inverse dynamics: its cabin is heavier than said, guide rails rub."""
    parts = {"rope_kN": [("bias", []), ("coulomb_friction", [])]}

    def __init__(self, rng):
        self.more, self.c, self.rest = rng.choice([-1, 1]) * rng.uniform(.4, 1.2), rng.uniform(.3, .7), self.little(rng)

    def log(self, rng, held):
        dt, n = .1, 1500
        path = moves(rng, 20, 2.5, 3)
        case = Case(dt, ["x.floor_m", "x.car_mps", "x.door"], {"rope_kN": .15})
        for i in range(n):
            q, v, a = path(i * dt)
            m = .9 * a + 1.5
            truth = m + self.more + self.c * sign(v) + .1 * self.more * a / 10 + self.c * self.rest(q / 3)
            case.add([q + .002 * rng.gauss(0, 1), v if v == 0 else v + .01 * rng.gauss(0, 1), 1.0 if v == 0 else 0.0], {"rope_kN": m}, {"rope_kN": truth},
                     {"rope_kN": truth + .12 * rng.gauss(0, 1)})
        return case


class Ferry(Machine):
    """Surge acceleration of a ferry through water that flows: drag by the square of the speed, and a current pushes."""
    parts = {"acc_mps2": [("quadratic_drag", [])]}

    def __init__(self, rng):
        self.k, self.flow, self.rest = rng.uniform(.02, .05), rng.uniform(-.3, .3), self.little(rng)

    def log(self, rng, held):
        dt, n = 1.0, 1200
        pull = steps(rng, -.8, .9, 30) if held else chirp(rng, .8, .002, .02, 300)
        case = Case(dt, ["x.surge_mps", "x.sway_mps", "u.lever", "x.wind_mps"], {"acc_mps2": .03})
        v, wind = 1.0, chirp(rng, 5, .001, .01, 500)
        for i in range(n):
            u = pull(i * dt)
            of = lambda s: .25 * u - self.k * (s - self.flow) * abs(s - self.flow) * (1 + self.rest(u))
            truth, m = of(v), .25 * u
            case.add([v + .02 * rng.gauss(0, 1), .1 * math.sin(i / 50) + .02 * rng.gauss(0, 1), u, 6 + wind(i * dt)], {"acc_mps2": m},
                     {"acc_mps2": truth}, {"acc_mps2": truth + .025 * rng.gauss(0, 1)})
            v = rk4(lambda t, x: [of(x[0])], [v], 0, dt)[0]
        return case


class Understeer(Machine):
    """Yaw rate of a car by its kinematics, v tan(steer) / base: it turns less the faster it is; v squared in the denominator."""
    parts = {"yaw_radps": [("product", ["gain", "unknown", "lag", "coupling"])]}
    law = True

    def __init__(self, rng):
        self.base, self.k = rng.uniform(2.5, 3), rng.uniform(.004, .008)

    def log(self, rng, held):
        dt, n = .05, 1400
        wheel, pace = (steps(rng, -.07, .07, 1.2) if held else chirp(rng, .06, .05, .5, 30)), chirp(rng, 7, .01, .03, 90)
        case = Case(dt, ["x.v_mps", "u.steer_rad", "x.tyre_bar"], {"yaw_radps": .01})
        for i in range(n):
            v, s = 15 + pace(i * dt), wheel(i * dt)
            m = v * math.tan(s) / self.base
            truth = m / (1 + self.k * v * v / self.base)
            case.add([v + .05 * rng.gauss(0, 1), s, 2.4 + .001 * rng.gauss(0, 1)], {"yaw_radps": m}, {"yaw_radps": truth},
                     {"yaw_radps": truth + .008 * rng.gauss(0, 1)})
        return case


class Spin(Machine):
    """Change of a satellite's rate about one axis: the product of the other two is missing."""
    parts = {"dwx": [("product", [])]}

    def __init__(self, rng):
        self.k = rng.choice([-1, 1]) * rng.uniform(.3, .7)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .25, 1300
        torque = [steps(rng, -.05, .05, 6) if held else chirp(rng, .05, .01, .1, 100) for _ in range(3)]
        case = Case(dt, ["x.wx", "x.wy", "x.wz", "u.tx"], {"dwx": .002})
        w = [.05, .1, -.1]
        for i in range(n):
            t = i * dt
            of = lambda t, x: [torque[0](t) + self.k * x[1] * x[2] - .1 * x[0], torque[1](t) - .3 * x[0] * x[2] - .1 * x[1], torque[2](t) - .1 * x[2]]
            new = rk4(of, w, t, dt)
            less = rk4(lambda t, x: [of(t, x)[0] - self.k * x[1] * x[2]] + of(t, x)[1:], w, t, dt)
            m, truth = less[0] - w[0], new[0] - w[0]
            case.add([x + .0005 * rng.gauss(0, 1) for x in w] + [torque[0](t)], {"dwx": m}, {"dwx": truth}, {"dwx": truth + .0015 * rng.gauss(0, 1)})
            w = new
        return case


class Pump(Machine):
    """Pressure behind a long pipe: the loss by the square of the flow is missing."""
    parts = {"p_kPa": [("quadratic_drag", ["product", "unknown", "viscous_friction", "coupling"])]}
    law = True

    def __init__(self, rng):
        self.k, self.rest = rng.uniform(.03, .06), self.little(rng)

    def log(self, rng, held):
        dt, n = .5, 1200
        want = steps(rng, -25, 30, 8) if held else chirp(rng, 25, .005, .05, 150)
        case = Case(dt, ["x.flow_Lps", "u.pump_pct", "x.water_degC", "x.tank_m"], {"p_kPa": 2.0})
        flow = 0.0
        for i in range(n):
            flow += .2 * ((want(i * dt) if held else 3 + want(i * dt)) - flow)
            m = 150 + 1.2 * flow
            truth = m - self.k * flow * abs(flow) * (1 + self.rest(flow / 9))
            case.add([flow + .1 * rng.gauss(0, 1), 40 + flow + rng.gauss(0, 1), 12 + i / 400, 3 + .2 * math.sin(i / 90)], {"p_kPa": m}, {"p_kPa": truth},
                     {"p_kPa": truth + 1.6 * rng.gauss(0, 1)})
        return case


class Cooling(Machine):
    """Change of a block's temperature: heat that goes to the room in proportion to the difference is missing."""
    parts = {"dT_K": [("coupling", ["unknown", "hinge", "viscous_friction", "gain"])]}

    def __init__(self, rng):
        self.k, self.rest = rng.uniform(.004, .008), self.little(rng)

    def log(self, rng, held):
        dt, n = 2.0, 1300
        heat = steps(rng, 0, 1, 60) if held else chirp(rng, .45, .001, .01, 900)
        case = Case(dt, ["x.block_degC", "x.room_degC", "u.heater_W"], {"dT_K": .03})
        temp, room = 30.0, chirp(rng, 4, .0005, .003, 2000)
        for i in range(n):
            u, cold = (heat(i * dt) if held else .5 + heat(i * dt)), 21 + room(i * dt)
            m = dt * .25 * u
            truth = m - dt * self.k * (temp - cold) * (1 + self.rest(temp / 20))
            case.add([temp + .03 * rng.gauss(0, 1), cold + .03 * rng.gauss(0, 1), 60 * u], {"dT_K": m}, {"dT_K": truth},
                     {"dT_K": truth + .025 * rng.gauss(0, 1)})
            temp += truth
        return case


class Crane(Machine):
    """Acceleration of a trolley by its drive: wheels rub, and the load that swings below pulls in proportion to its angle."""
    parts = {"acc_mps2": [("coulomb_friction", []), ("coupling", [])]}

    def __init__(self, rng):
        self.c, self.load, self.rope = rng.uniform(.1, .25), rng.uniform(1.5, 3), rng.uniform(3, 7)
        self.rest = self.little(rng)

    def log(self, rng, held):
        dt, n = .05, 1500
        want = steps(rng, -.9, .9, 3) if held else chirp(rng, 1.0, .05, .4, 40)
        case = Case(dt, ["x.trolley_m", "x.trolley_mps", "x.swing_rad", "u.drive_N"], {"acc_mps2": .06})
        x = [0.0, 0.0, .02, 0.0]
        for i in range(n):
            u = want(i * dt) - .4 * x[1] - .05 * x[0]
            acc = lambda s: u - self.c * math.tanh(s[1] / .01) + self.load * s[2] * (1 + self.rest(s[0]))
            truth, m = acc(x), u
            case.add([x[0], x[1] + .005 * rng.gauss(0, 1), x[2] + .002 * rng.gauss(0, 1), 300 * u], {"acc_mps2": m}, {"acc_mps2": truth},
                     {"acc_mps2": truth + .05 * rng.gauss(0, 1)})
            x = rk4(lambda t, s: [s[1], acc(s), s[3], -(G * s[2] + acc(s)) / self.rope - .1 * s[3]], x, 0, dt)
        return case


class Sounder(Machine):
    """Speed of sounding rockets in coast one row ahead, by an accelerometer's integral that drifts; drag differs between them."""
    parts = {"vz_mps": [("quadratic_drag", ["coupling"])]}  # or by the accelerometer's reading, which drag is

    def __init__(self, rng):
        self.k, self.count = [rng.uniform(.8, 3.5) * 1e-4 for _ in range(4)], 0

    def log(self, rng, held):
        dt, k = rng.choice([.1, .2, .25]), self.k[self.count]
        self.count += 1
        case = Case(dt, ["x.height_m", "x.vz_mps", "x.vertical_g"], {"vz_mps": .5})
        x, off = [rng.uniform(300, 1800), rng.uniform(150, 500)], 0.0
        of = lambda t, s: [s[1], -G - k * math.exp(-s[0] / 9000) * s[1] * abs(s[1])]
        while x[1] > 2 and len(case.rows) < 600:
            read = x[1] + off
            new = rk4(of, x, 0, dt)
            then = off + .01 * rng.gauss(0, 1) * math.sqrt(dt)
            m, truth = read - G * dt, new[1] + off
            case.add([x[0] + 2 * rng.gauss(0, 1), read, of(0, x)[1] / G + 1 + .01 * rng.gauss(0, 1)], {"vz_mps": m}, {"vz_mps": truth},
                     {"vz_mps": new[1] + then + .02 * rng.gauss(0, 1)})
            x, off = new, then
        return case


class Gearbox(Machine):
    """Angle behind a gear with play against the angle before it: it stays behind by half of the play, whichever way it turns."""
    parts = {"out_deg": [("coulomb_friction", ["unknown", "lag", "delay", "lag_delay"])]}

    def __init__(self, rng):
        self.play = rng.uniform(.6, 1.4)

    def log(self, rng, held):
        dt, n = .02, 1500
        path = moves(rng, 40, 50, .3) if held else None
        wave = chirp(rng, 25, .1, .6, 25)
        case = Case(dt, ["x.motor_deg", "x.motor_degps", "x.case_degC"], {"out_deg": .15})
        out, before = 0.0, 0.0
        for i in range(n):
            q = path(i * dt)[0] if held else wave(i * dt)
            out = max(q - self.play / 2, min(q + self.play / 2, out))
            rate = (q - before) / dt if i else 0.0
            before = q
            case.add([q, rate, 35 + i / 500], {"out_deg": q}, {"out_deg": out}, {"out_deg": out + .1 * rng.gauss(0, 1)})
        return case


class Racer(Machine):
    """Speed and turn of a small car against its commands: both answer through a lag, the turn late as well and with a gain below one."""
    parts = {"speed_mps": [("lag", ["delay", "lag_delay"])], "turn_radps": [("lag", ["delay", "lag_delay"]), ("gain", ["coupling", "unknown"])]}

    def __init__(self, rng):
        self.ts, self.tt, self.late, self.gain = rng.uniform(.15, .4), rng.uniform(.08, .15), rng.choice([0, .05, .1]), rng.uniform(.8, .92)

    def log(self, rng, held):
        dt, n = .05, 900
        pace, wheel = steps(rng, .4, 1.8, 2.0), (steps(rng, -.35, .35, 1.0) if held else chirp(rng, .3, .1, .8, 20))
        case = Case(dt, ["u.speed_mps", "u.steer_rad"], {"speed_mps": .03, "turn_radps": .04})
        v, w = 0.0, 0.0
        for i in range(n):
            t = i * dt
            u, s = (0.0 if t < 1 else pace(t)), wheel(t)
            mt = u * math.tan(s) / .33
            case.add([u, s], {"speed_mps": u, "turn_radps": mt}, {"speed_mps": v, "turn_radps": w},
                     {"speed_mps": v + .02 * rng.gauss(0, 1), "turn_radps": w + .03 * rng.gauss(0, 1)})
            for k in range(5):
                v += dt / 5 / self.ts * (u - v)
                then = t + k * dt / 5 - self.late
                late = (0.0 if then < 1 else pace(then)) * math.tan(wheel(then)) / .33
                w += dt / 5 / self.tt * (self.gain * late - w)
        return case


class Sound(Machine):
    """Nothing is wrong: two channels with noise that wanders and now and then an outlier."""
    parts = {}

    def __init__(self, rng):
        self.keep, self.share = rng.uniform(.3, .9), rng.uniform(.002, .01)

    def log(self, rng, held):
        dt, n = .05, 1400
        want = steps(rng, -2, 2, 2) if held else chirp(rng, 2, .1, 1, 20)
        case = Case(dt, ["x.place", "x.pace", "u.push", "x.mast_degC"], {"a": .1, "b": .3})
        x, d = [0.0, 0.0], 0.0
        for i in range(n):
            u = want(i * dt) - x[1] - x[0]
            d = self.keep * d + math.sqrt(1 - self.keep ** 2) * rng.gauss(0, 1)
            wild = 12 * rng.gauss(0, 1) if rng.random() < self.share else rng.gauss(0, 1)
            m = {"a": u, "b": 3 * x[1] * x[1]}
            case.add(x + [u, 20 + i / 700], m, m, {"a": m["a"] + .1 * d, "b": m["b"] + .3 * wild})
            x = rk4(lambda t, s: [s[1], u], x, 0, dt, 1)
        return case


MACHINES = {"wrist": Wrist, "sagging": Sagging, "leak": Leak, "drive": Drive, "truck": Truck, "lift": Lift, "ferry": Ferry,
            "understeer": Understeer, "spin": Spin, "pump": Pump, "cooling": Cooling, "crane": Crane, "sounder": Sounder,
            "gearbox": Gearbox, "racer": Racer, "sound": Sound}

if __name__ == "__main__":
    draw(MACHINES, __doc__, "visitors")
