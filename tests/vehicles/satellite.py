# SPDX-License-Identifier: MIT
"""A satellite with two reaction wheels and a battery, on an orbit shortened to 1500 s.

It slews between targets, its controller holds it there; sun and eclipse alternate.
"""
import math

from common import Physical, Vehicle, clip, wrap

ORBIT = 1500.0
WHEEL = .02      # kg m2
BODY = 10.0      # kg m2


class Satellite(Vehicle):
    DT, ROWS = 1.0, 3000
    COLUMNS = ("t_s", "u.torque_y_mNm", "u.torque_z_mNm", "u.heater", "u.payload", "x.sun", "x.orbit_rad",
               "s.rate_y_mradps", "s.rate_z_mradps", "s.yaw_rad", "s.wheel_y_radps",
               "s.wheel_z_radps", "s.panel_A", "s.array_degC", "s.bus_A", "s.battery_V", "s.cell_degC")
    SIGMA = dict(rate_y=.05, rate_z=.05, yaw=.001, wheel_y=1., wheel_z=1., panel=.03, bus=.02,
                 battery=.02, array=.3, cell=.1)
    ANGLES = ("yaw", "orbit")
    FOLLOW = ("pitch", "yaw", "rate_y", "rate_z", "charge")
    SENSOR_FAULTS = ("bias:wheel_y", "bias:bus", "drift:panel", "gain:panel", "bias:rate_z", "noise:yaw", "stuck:bus")
    PHYSICAL = {
        "friction": Physical("friction_z", .02, {"wheel_z": -1}),
        "degraded": Physical("cells", .04, {"panel": -1}),
        "hot": Physical("cells", .05, {"panel": -1}, ("s.array_degC", "x.orbit_rad", "x.sun"), since=False,
                        where=lambda f, _: f["hot"] > 35),
        "shadow": Physical("cells", .05, {"panel": -1}, ("x.orbit_rad", "u.payload", "s.bus_A"), since=False,
                           draw=lambda r: r.uniform(-1.6, 0),
                           where=lambda f, low: low < f["orbit"] < low + 1.8 and f["payload"] > .5),
        "driver": Physical("driver", .06, {"bus": 1}, ("u.torque_z_mNm",), since=False,
                           where=lambda f, _: f["torque_z"] > 25),
        "leak": Physical("leak", .4, {"battery": -1}),
    }

    def __init__(self, r):
        super().__init__(r)
        self.orbit, self.charge = r.uniform(-.8, .8), r.uniform(.75, .8)
        self.yaw, self.pitch = r.uniform(-3, 3), r.gauss(0, .001)
        self.rate_y = self.rate_z = self.drag = self.torque_y = self.torque_z = 0.0
        self.wheel_y, self.wheel_z = 180 + r.gauss(0, 3), 220 + r.gauss(0, 6)
        self.hot = 20.0 + 40 * math.cos(self.orbit)
        self.cell, self.heater, self.battery, self.panel, self.bus = 10 + r.gauss(0, 1), 0.0, 26.0, 0.0, 1.0
        self.viscous = self.jitter(1e-4, .003)
        self.cells, self.load = self.jitter(3, .005), self.jitter(.9, .005)
        self.payload, self.switch, self.next = 0.0, r.uniform(50, 250), r.uniform(100, 200)
        self.aim_yaw = self.yaw
        self.sum_y = self.sum_z = self.sun = 0.0

    def nominal(self):
        self.viscous, self.cells, self.load = 1e-4, 3.0, .9

    def command(self, t):
        r = self.r
        if t >= self.next:
            self.next, self.aim_yaw = t + r.uniform(200, 400), r.uniform(-3, 3)
        if t >= self.switch:
            self.switch, self.payload = t + r.uniform(100, 300), 1.0 - self.payload
        self.heater = 1.0 if self.cell < 8 else 0.0 if self.cell > 11 else self.heater
        away = wrap(self.aim_yaw - self.yaw)
        wanted = clip(.02 * away, -.025, .025)
        self.sum_z += .002 * (wanted - self.rate_z / 1000)
        self.sum_y -= .0005 * self.pitch
        z = 1000 * (BODY * .1 * (wanted - self.rate_z / 1000) + self.sum_z)
        y = 1000 * (BODY * (-.002 * self.pitch - .08 * self.rate_y / 1000) + self.sum_y)
        # the wheels take the reaction; the trim carries their friction at rest
        return clip(18 + y, -60, 60), clip(22 + z, -60, 60), self.heater, self.payload

    def wheels(self, u, fault):
        """The wheel takes what the body gets, with the sign turned; torques in mNm."""
        friction_y = 1000 * self.viscous * self.wheel_y
        friction_z = 1000 * self.viscous * (1 + fault("friction_z")) * self.wheel_z
        self.torque_y, self.torque_z = u[0], u[1]
        net_y, net_z = self.torque_y - friction_y, self.torque_z - friction_z
        self.wheel_y += self.DT * net_y / 1000 / WHEEL
        self.wheel_z += self.DT * net_z / 1000 / WHEEL
        self.drag = self.wander(self.drag, 200, .02)
        push = .7 * math.sin(self.orbit) + self.drag
        self.rate_y += self.DT * (net_y + push) / BODY
        self.rate_z += self.DT * (net_z + .7 * math.cos(self.orbit) + self.drag) / BODY
        self.pitch += self.DT * self.rate_y / 1000
        self.yaw = wrap(self.yaw + self.DT * self.rate_z / 1000)

    def power(self, u, fault):
        dt = self.DT
        self.orbit = wrap(self.orbit + dt * 2 * math.pi / ORBIT)
        self.sun = clip(2 * (math.cos(self.orbit) + .3), 0, 1)
        self.hot += dt / 120 * (-35 + 95 * self.sun - self.hot)
        self.panel = self.cells * self.sun * (1 - .001 * (self.hot - 25)) * (1 - fault("cells"))
        drive = .004 * (abs(u[0]) + abs(u[1]))
        self.bus = .6 + self.load * u[3] + .5 * u[2] + drive + fault("driver")
        self.cell += dt / 300 * (2 + 12 * u[2] + 3 * (self.bus - .6) - self.cell)
        net = self.panel - self.bus - fault("leak")
        self.charge = clip(self.charge + dt * net / 40000, .2, 1)
        self.battery = 22 + 5 * self.charge + .1 * net

    def step(self, u, fault):
        self.wheels(u, fault)
        self.power(u, fault)

    def outputs(self):
        return (self.sun, self.orbit, self.rate_y, self.rate_z, self.yaw, self.wheel_y, self.wheel_z, self.panel,
                self.hot, self.bus, self.battery, self.cell)
