# SPDX-License-Identifier: MIT
"""Four machines whose logs look odd; `grade.py --module` reads them. Conventions: drawn.py.

bus     A spacecraft's bus in one of six modes, whose numbers are the command: each draws, heats
        and transmits as it does, in no order. mode3: the fourth mode draws more. radiator: the
        box is cooled less. amplifier: less power is transmitted.
lone    One valve and one flow, and nothing else. clog: the valve passes less when wide open.
wide    Forty sensors of a plant of three commands, each with its own lag, and a disturbance that
        all share. leg: two of them rise.
relay   A pump and a fan that thermostats switch, a valve, a limit switch, a counter and a column
        that never changes. Nobody measures the ambient temperature, which differs from run to
        run. pump: it draws more. fan: it cools less.
"""
import math
import random

from drawn import Drawn


class Bus:
    RATE, LENGTH, NOISES = 2., 1500, 1
    COLUMNS = ["t_s", "u.mode", "u.heater", "s.current_A", "s.box_degC", "s.amp_degC", "s.link_W",
               "s.battery_V"]
    SIGMA = dict(current=.03, box=.15, amp=.2, link=.05, battery=.01)
    TYPICAL = dict(amp=25.)
    DRAW, HEAT = (1., 2.6, 1.4, 4.1, 2., 3.1), (.2, 1., .5, 2.2, .3, 1.6)
    LINK = (0., 0., 0., 6., 0., 2.5)
    PHYSICAL = {"mode3": (.03, .04, dict(current=1), ("u.mode", "s.link_W", "s.current_A")),
                "radiator": (.08, .12, dict(box=1), ()),
                "amplifier": (.015, .025, dict(link=-1), ())}
    FAULTS = ("bias:current", "drift:box", "gain:amp", "noise:battery", "stuck:link", "mode3",
              "radiator", "amplifier")

    def __init__(self, r):
        self.r = random.Random(r.random())
        self.draw = [x * (1 + r.gauss(0, .002)) for x in self.DRAW]
        self.box, self.amp = 20 + r.gauss(0, 2), 22 + r.gauss(0, 2)
        self.charge, self.mode, self.heater, self.left = r.uniform(.7, .95), 0, 0, 0
        self.wander = self.current = self.link = self.time = 0.

    def pilot(self, t):
        self.time = t
        if self.left == 0:
            self.mode, self.left = self.r.randrange(6), self.r.randrange(20, 80)
        self.left -= 1
        self.heater = 1 if self.box < 18 else 0 if self.box > 23 else self.heater
        return self.mode, self.heater

    def inside(self, fault, p):
        return fault != "mode3" or self.mode == 3

    def step(self, u, w, a):
        self.wander += .002 * w[0] - .01 * self.wander
        self.current = self.draw[u[0]] * (1 + a.get("mode3", 0.)) + .8 * u[1] + self.wander
        cool = .0015 * (1 - a.get("radiator", 0.)) * (self.box - 5)
        self.box += self.RATE * (.02 * (self.HEAT[u[0]] + 2 * u[1]) - cool)
        warm = 18 + 1.5 * self.LINK[u[0]] + .3 * (self.box - 20)
        self.amp += self.RATE / 60 * (warm - self.amp)
        self.link = self.LINK[u[0]] * (1 - a.get("amplifier", 0.))
        sun = 4.2 if self.time % 1200 < 750 else 0.
        self.charge = min(1., self.charge + self.RATE * (sun - self.current) / 60000)

    def sense(self):
        volts = 24 + 4 * self.charge - .05 * self.current
        return self.current, self.box, self.amp, self.link, volts


class Lone:
    RATE, LENGTH, NOISES = .5, 1200, 0
    COLUMNS = ["t_s", "u.valve", "s.flow_lps"]
    SIGMA, TYPICAL = dict(flow=.05), dict(flow=1.3)
    PHYSICAL = {"clog": (.02, .03, dict(flow=-1), ("u.valve", "s.flow_lps"))}
    FAULTS = ("bias:flow", "gain:flow", "noise:flow", "clog")

    def __init__(self, r):
        self.r = random.Random(r.random())
        self.full, self.flow, self.valve, self.left = 3 * (1 + r.gauss(0, .003)), 0., .3, 0

    def pilot(self, t):
        if self.left == 0:
            self.valve, self.left = self.r.uniform(0, 1), self.r.randrange(10, 60)
        self.left -= 1
        return (self.valve,)

    def inside(self, fault, p):
        return self.valve > .65 + .1 * p[0]

    def step(self, u, w, a):
        self.flow += .3 * (self.full * u[0] ** 1.5 * (1 - a.get("clog", 0.)) - self.flow)

    def sense(self):
        return (self.flow,)


FIXED = random.Random("the plant of the wide machine")
MIX = [[FIXED.gauss(0, 1) for _ in range(4)] for _ in range(40)]
LAG = [FIXED.uniform(.3, 5) for _ in range(40)]


class Wide:
    RATE, LENGTH, NOISES = .2, 1000, 1
    COLUMNS = ["t_s", "u.a", "u.b", "u.c"] + ["s.x%02d_V" % i for i in range(40)]
    SIGMA, TYPICAL = {"x%02d" % i: .02 for i in range(40)}, dict(x30=.7)
    PHYSICAL = {"leg": (.04, .06, dict(x05=1, x06=1), ())}
    FAULTS = ("bias:x03", "drift:x17", "gain:x30", "noise:x22", "stuck:x09", "leg")

    def __init__(self, r):
        self.r = random.Random(r.random())
        self.u, self.left, self.x, self.shared = [0., 0., 0.], 0, [0.] * len(MIX), 0.

    def pilot(self, t):
        if self.left == 0:
            self.u[self.r.randrange(3)] = self.r.uniform(-1, 1)
            self.left = self.r.randrange(10, 40)
        self.left -= 1
        return tuple(self.u)

    def inside(self, fault, p):
        return True

    def step(self, u, w, a):
        self.shared += .01 * w[0] - .02 * self.shared
        for i, m in enumerate(MIX):
            goal = m[0] * u[0] + m[1] * u[1] + m[2] * u[2] + m[3] * (.5 * u[0] * u[1] + self.shared)
            goal += a.get("leg", 0.) if i in (5, 6) else 0.
            self.x[i] += self.RATE / LAG[i] * (goal - self.x[i])

    def sense(self):
        return tuple(self.x)


class Relay:
    RATE, LENGTH, NOISES = 1., 1500, 0
    COLUMNS = ["t_s", "u.pump", "u.valve", "u.fan", "x.revision", "x.count", "s.level_m",
               "s.temp_degC", "s.power_W", "s.limit"]
    SIGMA, TYPICAL = dict(level=.004, temp=.1, power=1., limit=1e-9), dict(power=120.)
    PHYSICAL = {"pump": (.008, .012, dict(power=1), ("u.pump", "s.power_W")),
                "fan": (.08, .12, dict(temp=1), ("u.fan",))}
    FAULTS = ("bias:temp", "drift:level", "gain:power", "noise:temp", "pump", "fan")

    def __init__(self, r):
        self.r = random.Random(r.random())
        self.level, self.temp, self.ambient = .5, 30 + r.gauss(0, 1), 20 + r.gauss(0, 1)
        self.pump = self.valve = self.fan = self.count = 0
        self.power = 40.

    def pilot(self, t):
        self.valve = 1 - self.valve if self.r.random() < .03 else self.valve
        self.pump = 1 if self.level < .4 else 0 if self.level > .8 else self.pump
        self.fan = 1 if self.temp > 40 else 0 if self.temp < 32 else self.fan
        self.count += 1
        return self.pump, self.valve, self.fan, 3, self.count

    def inside(self, fault, p):
        return bool(self.pump if fault == "pump" else self.fan)

    def step(self, u, w, a):
        pump, valve, fan = u[:3]
        self.level += .004 * pump - .0035 * valve * math.sqrt(max(self.level, 0.))
        cool = .012 + .02 * fan * (1 - a.get("fan", 0.))
        self.temp += .08 + .35 * pump - cool * (self.temp - self.ambient)
        self.power = 40 + 160 * pump * (1 + a.get("pump", 0.)) + 25 * fan + 5 * valve

    def sense(self):
        return self.level, self.temp, self.power, 1. if self.level > .75 else 0.


CLASS = {"bus": Bus, "lone": Lone, "wide": Wide, "relay": Relay}
VEHICLES = tuple(CLASS)
FAULTS = {v: c.FAULTS for v, c in CLASS.items()}
RATE = {v: c.RATE for v, c in CLASS.items()}
LENGTH = {v: c.LENGTH for v, c in CLASS.items()}
COLUMNS = {v: c.COLUMNS for v, c in CLASS.items()}
run = Drawn("odd", CLASS, many=(2.5, 3.5), drift=1.5).run
