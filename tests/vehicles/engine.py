# SPDX-License-Identifier: MIT
"""A turbofan on a test flight: climb, cruise, descent and throttle steps, the same card every run."""
import math

from common import Physical, Vehicle, clip


class Engine(Vehicle):
    DT, ROWS = .1, 2000
    COLUMNS = ("t_s", "u.throttle", "u.bleed", "x.altitude_km", "x.mach", "s.fan_rpm", "s.core_rpm",
               "s.exhaust_degC", "s.fuel_kgps", "s.compressor_kPa", "s.oil_degC", "s.pressure_kPa",
               "s.vibration")
    SIGMA = dict(fan=8., core=12., exhaust=1.5, fuel=.003, compressor=4., oil=.3, pressure=1.5,
                 vibration=.03)
    SENSOR_FAULTS = ("bias:exhaust", "gain:fuel", "drift:compressor", "noise:fan", "stuck:core",
                     "bias:vibration")
    PHYSICAL = {
        "fouling": Physical("compressor", .012, {"compressor": -1}),
        "bearing": Physical("oil", 2.5, {"oil": 1}, ramp=True),
        "thin": Physical("combustion", 5., {"exhaust": 1}, ("x.altitude_km",), since=False,
                         draw=lambda r: r.uniform(2, 3.2),
                         where=lambda f, low: low < f["altitude"] < low + 1.5),
        "bleed_leak": Physical("compressor", .018, {"compressor": -1}, ("u.bleed",), since=False,
                               where=lambda f, _: f["bleed"] > .5),
        "flutter": Physical("shake", .1, {"vibration": 1}, ("s.fan_rpm", "s.core_rpm", "u.throttle", "x.mach"),
                            since=False, where=lambda f, _: f["fan"] > 4000 and f["mach"] > .52),
        "slow_spool": Physical("spool", 45., {"core": -1, "fan": -1},
                               ("u.throttle", "s.core_rpm", "s.fan_rpm", "s.fuel_kgps"), since=False, where=lambda f, _: f["core"] > 13600),
        "rub": Physical("shake", .09, {"vibration": 1}),
    }

    def __init__(self, r):
        super().__init__(r)
        self.ground = r.uniform(.28, .32)
        self.altitude, self.mach, self.air = self.ground, .25, 1.0
        self.times = [20 + r.gauss(0, 2), 65 + r.gauss(0, 3), 140 + r.gauss(0, 3), 180 + r.gauss(0, 3)]
        self.steps = sorted(r.uniform(70, 138) for _ in range(6))
        self.values = [r.uniform(.66, .8) for _ in range(7)]
        self.bleeds = [30 + r.gauss(0, 3), 60 + r.gauss(0, 3), 110 + r.gauss(0, 3), 150 + r.gauss(0, 3)]
        self.fan, self.core, self.exhaust, self.fuel = 3000.0, 11500.0, 520.0, .3
        self.compressor, self.shake, self.bleed = 900.0, .5, 0.0
        self.oil, self.wear, self.gust = 75 + r.gauss(0, 1), 0.0, 0.0
        self.flow, self.heat = self.jitter(1, .002), r.gauss(0, .8)

    def nominal(self):
        self.flow, self.heat = 1.0, 0.0

    def command(self, t):
        a, b, c, d = self.times
        if t < a:
            throttle = .45
        elif t < b:
            throttle = .92
        elif t < c:
            throttle = self.values[sum(t > x for x in self.steps)]
        else:
            throttle = .5 if t < d else .62
        self.bleed = float(self.bleeds[0] < t < self.bleeds[1] or self.bleeds[2] < t < self.bleeds[3])
        return throttle + .01 * math.sin(t / 3), self.bleed

    def fly(self, throttle):
        self.gust = self.wander(self.gust, 10, .01)
        climb = .17 * (throttle - .68) + .04 * (.72 - self.mach)
        self.altitude = clip(self.altitude + self.DT * climb * (1.6 if throttle > .9 else 1), self.ground, 9)
        self.mach += self.DT / 25 * (.2 + .6 * throttle + self.gust - self.mach)
        self.air = math.exp(-self.altitude / 12) * (1 + .2 * self.mach ** 2)

    def step(self, u, fault):
        dt = self.DT
        self.fly(u[0])
        self.fuel += dt / .3 * (.08 + .7 * u[0] ** 1.5 * self.air - self.fuel)
        self.core += dt / 1.2 * (9200 + 5200 * u[0] - 60 * u[1] - fault("spool") - self.core)
        self.fan += dt / 1.8 * (5200 * (self.core / 14000) ** 2.5 - self.fan)
        ratio = 1 + 13 * (self.core / 14000) ** 3 * self.flow
        press = 95 * self.air * ratio * (1 - .03 * u[1]) * (1 - fault("compressor"))
        self.compressor += dt / .3 * (press - self.compressor)
        hot = 380 + 300 * u[0] + 12 * u[1] - 8 * self.altitude + self.heat + fault("combustion")
        self.exhaust += dt / 1.5 * (hot - self.exhaust)
        self.oil += dt / 40 * (60 + 35 * (self.core / 14000) ** 2 - .8 * self.altitude + fault("oil") - self.oil)
        self.shake += dt / .5 * (.3 + .5 * (self.fan / 4500) ** 2 + fault("shake") - self.shake)

    def outputs(self):
        return (self.altitude, self.mach, self.fan, self.core, self.exhaust, self.fuel, self.compressor,
                self.oil, 150 + 190 * self.core / 14000 - .9 * (self.oil - 75), self.shake)
