# SPDX-License-Identifier: MIT
"""An underwater vehicle that sails random legs of heading, depth and speed under its autopilot."""
import math

from common import Physical, Vehicle, clip, wrap


class Submarine(Vehicle):
    DT, ROWS = .5, 2000
    COLUMNS = ("t_s", "u.propeller", "u.rudder_rad", "u.plane_rad", "s.depth_m", "s.pitch_rad",
               "s.heading_rad", "s.yawrate_radps", "s.speed_mps", "s.shaft_rpm", "s.current_A",
               "s.battery_V", "s.water_degC")
    SIGMA = dict(depth=.1, pitch=.006, heading=.01, yawrate=.003, speed=.02, shaft=8., current=.15,
                 battery=.03, water=.08)
    ANGLES = ("heading",)
    FOLLOW = ("depth", "heading", "charge")
    SENSOR_FAULTS = ("bias:speed", "bias:pitch", "drift:current", "gain:yawrate", "noise:speed",
                     "stuck:shaft")
    PHYSICAL = {
        "fouled": Physical("thrust", .04, {"speed": -1}),
        "bearing": Physical("bearing", .1, {"current": 1}, ramp=True),
        "layer": Physical("thrust", .05, {"speed": -1}, ("s.depth_m", "s.water_degC"), since=False,
                          draw=lambda r: r.uniform(15, 40),
                          where=lambda f, low: low < f["depth"] < low + 20),
        "rudder_left": Physical("rudder", .2, {"yawrate": -1, "heading": 0},
                                ("u.rudder_rad", "s.yawrate_radps"),
                                since=False, where=lambda f, _: f["rudder"] > .05),
        "shear": Physical("thrust", .06, {"speed": -1}, ("s.heading_rad", "s.depth_m"), since=False,
                          draw=lambda r: (r.uniform(-2.5, .5), r.uniform(10, 30)),
                          where=lambda f, low: low[0] < f["heading"] < low[0] + 2.4
                          and low[1] < f["depth"] < low[1] + 35),
        "cracked": Physical("drag", .04, {"speed": -1}, ("s.speed_mps", "u.propeller", "s.shaft_rpm"),
                            where=lambda f, _: f["speed"] > 1.5),
    }

    def __init__(self, r):
        super().__init__(r)
        self.depth, self.heading, self.charge = r.uniform(15, 65), r.uniform(-3, 3), 1 + r.gauss(0, .01)
        self.goal = [self.heading, self.depth, r.uniform(.9, 2)]
        self.next = [r.uniform(20, 60) for _ in self.goal]
        self.speed = self.goal[2]
        self.rpm = 500 * self.speed
        self.pitch = self.yawrate = self.swirl = self.rudder = self.sum_v = self.sum_p = 0.0
        self.current, self.battery = 5.0, 48.0
        self.thrust, self.motor = self.jitter(1, .004), self.jitter(1, .004)
        self.top = 18 + r.gauss(0, .05)
        self.water = self.sea()

    def nominal(self):
        self.thrust = self.motor = 1.0

    def sea(self):
        return self.top - 9 / (1 + math.exp(-(self.depth - 40) / 7))

    def command(self, t):
        r = self.r
        draws = (r.uniform(-3, 3), r.uniform(10, 70), r.uniform(.9, 2))
        for i, x in enumerate(draws):
            if t > self.next[i]:
                self.goal[i], self.next[i] = x, t + r.uniform(50, 130)
        error = self.goal[2] - self.speed
        self.sum_v = clip(self.sum_v + .01 * error * self.DT, -.2, .2)
        climb = clip(.06 * (self.goal[1] - self.depth), -.3, .3)
        self.sum_p = clip(self.sum_p + .005 * (climb - self.pitch) * self.DT, -.1, .1)
        rudder = clip(.5 * wrap(self.goal[0] - self.heading) - 3 * self.yawrate, -.35, .35)
        plane = clip(.8 * climb + .6 * (climb - self.pitch) + self.sum_p, -.4, .4)
        return clip(self.goal[2] / 3 + .25 * error + self.sum_v, .1, 1), rudder, plane

    def step(self, u, fault):
        dt = self.DT
        self.rpm += dt / 2 * (1500 * u[0] - self.rpm)
        self.rudder += dt / 1 * (u[1] - self.rudder)
        pull = 2 * self.rpm / 1000 * self.thrust * (1 - fault("thrust")) * (1 - fault("drag"))
        self.speed += dt / 8 * (pull * (1 - 1.2 * self.rudder ** 2) - self.speed)
        grip = self.rudder * self.speed * .2 * (1 - fault("rudder"))
        self.swirl = self.wander(self.swirl, 10, .001)
        self.yawrate += dt / 3 * (grip + self.swirl - self.yawrate)
        self.heading = wrap(self.heading + dt * self.yawrate)
        self.pitch += dt / 5 * (u[2] * self.speed / 1.5 - self.pitch)
        self.depth = max(0, self.depth + dt * self.speed * math.sin(self.pitch))
        self.water += dt / 5 * (self.sea() - self.water)
        self.current = 1 + 14 * (self.rpm / 1000) ** 2 * self.motor * (1 + fault("bearing"))
        self.charge -= dt * self.current / 60000
        self.battery = 44 + 5 * self.charge - .03 * self.current

    def outputs(self):
        return (self.depth, self.pitch, self.heading, self.yawrate, self.speed, self.rpm, self.current,
                self.battery, self.water)
