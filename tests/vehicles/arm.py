# SPDX-License-Identifier: MIT
"""A robot arm of two links in a vertical plane that moves loads between random postures."""
import math

from common import Physical, Vehicle, clip

G = 9.81


class Arm(Vehicle):
    DT, ROWS = .05, 2400
    COLUMNS = ("t_s", "u.q1_rad", "u.q2_rad", "u.w1_radps", "u.w2_radps", "u.load", "s.q1_rad", "s.q2_rad",
               "s.w1_radps", "s.w2_radps", "s.i1_A", "s.i2_A", "s.motor1_degC", "s.motor2_degC", "s.supply_V")
    SIGMA = dict(q1=.002, q2=.002, w1=.02, w2=.02, i1=.08, i2=.06, motor1=.35, motor2=.35, supply=.03)
    SENSOR_FAULTS = ("bias:i1", "bias:motor2", "drift:i2", "gain:w2", "noise:w1", "stuck:i2")
    PHYSICAL = {
        "dry_up": Physical("dry1", .75, {"i1": 1}, ("u.w1_radps", "s.w1_radps"), since=False,
                           where=lambda f, _: f["w1"] > .15),
        "viscous": Physical("viscous2", 1.3, {"i2": 1}, ("u.w2_radps", "s.w2_radps"),
                            where=lambda f, _: f["w2"] > .1),
        "cable": Physical("pull1", .6, {"i1": 1}, ("s.q1_rad", "u.q1_rad"), since=False,
                          draw=lambda r: r.uniform(.2, .7),
                          where=lambda f, low: low < f["q1"] < low + .5),
        "collision": Physical("pull2", .5, {"i2": 1}, ("s.q1_rad", "s.q2_rad", "u.q1_rad", "u.q2_rad"),
                              since=False, draw=lambda r: (r.uniform(.1, .5), r.uniform(-1.2, -.5)),
                              where=lambda f, low: low[0] < f["q1"] < low[0] + .7
                              and low[1] < f["q2"] < low[1] + .9),
        "weak": Physical("magnet1", .05, {"i1": 1}),
        "heavy": Physical("weight", .12, {"i2": 1, "i1": 1}, ("u.load",), since=False,
                          where=lambda f, _: f["load"] > .5),
        "blocked_fan": Physical("fan", .6, {"motor1": 1}, ramp=True),
    }

    def __init__(self, r):
        super().__init__(r)
        self.from1 = self.to1 = self.q1 = r.uniform(.2, 1.2)
        self.from2 = self.to2 = self.q2 = r.uniform(-1.4, 0)
        self.w1 = self.w2 = self.load = 0.0
        self.start, self.lasts = r.uniform(2, 3), 1e-9
        self.motor1, self.motor2 = 32 + r.gauss(0, 1), 30 + r.gauss(0, 1)
        self.i1 = self.i2 = self.chatter1 = self.chatter2 = 0.0
        self.supply = 48.0
        self.dry1, self.dry2 = self.jitter(.3, .01), self.jitter(.2, .01)
        self.magnet1, self.magnet2 = self.jitter(1, .002), self.jitter(1, .002)

    def nominal(self):
        self.dry1, self.dry2, self.magnet1, self.magnet2 = .3, .2, 1.0, 1.0

    def command(self, t):
        r = self.r
        if t > self.start + self.lasts:
            self.from1, self.from2 = self.to1, self.to2
            self.start, self.lasts = t + r.uniform(.3, 1.2), r.uniform(1.5, 3)
            self.to1, self.to2 = r.uniform(.2, 1.2), r.uniform(-1.4, 0)
            if r.random() < .4:
                self.load = 1.0 - self.load
        x = clip((t - self.start) / self.lasts, 0, 1)
        s, v = x ** 3 * (10 - 15 * x + 6 * x * x), 30 * x * x * (1 - x) ** 2 / self.lasts
        a, b = self.to1 - self.from1, self.to2 - self.from2
        return self.from1 + a * s, self.from2 + b * s, a * v, b * v, self.load

    def torques(self, load, a1, a2, fault):
        """What the motors must give in each joint, from the accelerations of the two links."""
        mass = 1 + (.8 + fault("weight")) * load
        lift2 = mass * .35 * G * math.cos(self.q1 + self.q2)
        lift1 = lift2 + (2 + mass) * .4 * G * math.cos(self.q1)
        rub1 = (self.dry1 + (fault("dry1") if self.w1 > 0 else 0)) * math.tanh(self.w1 / .05) + .8 * self.w1
        rub2 = self.dry2 * math.tanh(self.w2 / .05) + (.5 + fault("viscous2")) * self.w2
        t1 = lift1 + (2.2 + .5 * mass) * a1 + .15 * mass * a2 + rub1 + fault("pull1")
        t2 = lift2 + (.3 + .2 * mass) * a2 + .15 * mass * a1 + rub2 + fault("pull2")
        return t1, t2

    def step(self, u, fault):
        dt, k = self.DT, 12.0
        self.chatter1 = self.wander(self.chatter1, .5, .004)
        self.chatter2 = self.wander(self.chatter2, .5, .004)
        a1 = k * k * (u[0] - self.q1) + 2 * k * .7 * (u[2] - self.w1)
        a2 = k * k * (u[1] - self.q2) + 2 * k * .7 * (u[3] - self.w2)
        t1, t2 = self.torques(u[4], a1, a2, fault)
        self.w1 += dt * a1 + self.chatter1 * dt * 5
        self.w2 += dt * a2 + self.chatter2 * dt * 5
        self.q1 += dt * self.w1
        self.q2 += dt * self.w2
        self.i1 = t1 / 4 / self.magnet1 / (1 - fault("magnet1"))
        self.i2 = t2 / 3 / self.magnet2
        cool = 1 - fault("fan")
        self.motor1 += dt / 60 * (.6 * self.i1 ** 2 - .8 * cool * (self.motor1 - 25))
        self.motor2 += dt / 50 * (1.4 * self.i2 ** 2 - .8 * (self.motor2 - 25))
        self.supply = 48.5 - .06 * (abs(self.i1) + abs(self.i2))

    def outputs(self):
        return (self.q1, self.q2, self.w1, self.w2, self.i1, self.i2, self.motor1, self.motor2, self.supply)
