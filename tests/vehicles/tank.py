# SPDX-License-Identifier: MIT
"""A heated tank that feeds a second one: the same production plan every run, two controllers."""
import math

from common import Physical, Vehicle, clip


class Tank(Vehicle):
    DT, ROWS = 1.0, 1800
    COLUMNS = ("t_s", "u.pump", "u.heater", "u.valve", "s.level_m", "s.pressure_kPa",
               "s.temperature_degC", "s.inflow_Lps", "s.outflow_Lps", "s.pump_A", "s.heater_A",
               "s.buffer_m", "s.product_degC")
    SIGMA = dict(level=.018, pressure=.18, temperature=.3, inflow=.02, outflow=.015, pump=.05,
                 heater=.08, buffer=.006, product=.3)
    SENSOR_FAULTS = ("bias:inflow", "bias:product", "drift:heater", "gain:outflow",
                     "noise:temperature", "stuck:level")
    PHYSICAL = {
        "leak": Physical("leak", .024, {"level": -1, "pressure": -1, "outflow": -1}),
        "hole": Physical("leak", .029, {"level": -1, "pressure": -1, "outflow": -1},
                         ("s.level_m", "s.pressure_kPa"), since=False, where=lambda f, _: f["level"] > 1.55),
        "scale": Physical("heat", .06, {"temperature": -1, "product": -1}, ramp=True),
        "element": Physical("element", .06, {"heater": -1, "temperature": -1}, ("u.heater", "s.heater_A"),
                            since=False, where=lambda f, _: f["power"] > .48),
        "cavitation": Physical("suction", .06, {"inflow": -1, "pump": -1},
                               ("s.temperature_degC", "u.pump", "s.product_degC", "s.inflow_Lps"), since=False,
                               where=lambda f, _: f["temperature"] > 52 and f["flow"] > .85),
        "wear": Physical("wear", .06, {"pump": 1}),
        "valve": Physical("valve", .04, {"outflow": -1, "buffer": -1}, ("u.valve", "s.outflow_Lps"), since=False,
                          where=lambda f, _: f["open"] < .42),
    }

    def __init__(self, r):
        super().__init__(r)
        self.level, self.temperature = 1.4 + r.gauss(0, .02), 48 + r.gauss(0, .3)
        self.buffer, self.product = 1.0 + r.gauss(0, .02), self.temperature - 1
        self.flow, self.power, self.out, self.rough, self.amps = .8, .4, .8, 0.0, 2.8
        self.open = .5
        self.times = [x + r.gauss(0, 15) for x in (150, 420, 700, 1000, 1250, 1500)]
        self.phase = r.uniform(0, 6)
        self.sum_level, self.sum_heat = .44, .35
        self.coil, self.pumped, self.port = self.jitter(1, .003), self.jitter(1, .001), self.jitter(1, .001)

    def nominal(self):
        self.coil = self.pumped = self.port = 1.0

    def plan(self, t, values):
        return values[sum(t > x for x in self.times)]

    def command(self, t):
        level = self.plan(t, (1.4, 1.4, 1.75, 1.75, 1.3, 1.6, 1.4))
        heat = self.plan(t, (48, 52, 52, 56, 56, 50, 48))
        error, cold = level - self.level, heat - self.temperature
        self.sum_level = clip(self.sum_level + .004 * error * self.DT, 0, 1)
        self.sum_heat = clip(self.sum_heat + .0005 * cold * self.DT, 0, 1)
        valve = self.plan(t, (.5, .6, .4, .55, .5, .38, .5)) + .04 * math.sin(t / 35 + self.phase)
        return clip(self.sum_level + 1.2 * error, 0, 1), clip(self.sum_heat + .1 * cold, 0, 1), valve

    def step(self, u, fault):
        dt = self.DT
        self.flow += dt / 5 * (1.9 * u[0] * self.pumped * (1 - fault("suction")) - self.flow)
        self.power += dt / 8 * (u[1] * (1 - fault("element")) - self.power)
        self.open += dt / 3 * (u[2] - self.open)
        self.out = self.open * 1.45 * math.sqrt(self.level) * self.port * (1 - fault("valve"))
        self.rough = self.wander(self.rough, 20, .003)
        self.level = max(.1, self.level + dt / 60 * (self.flow + self.rough - self.out - fault("leak")))
        volume = 60 * self.level
        heat = 60 * self.power * self.coil * (1 - fault("heat"))
        self.temperature += dt / volume * (heat + self.flow * (15 - self.temperature) * .85
                                           + .05 * (20 - self.temperature))
        self.amps = .8 + 2.5 * self.flow * (1 + fault("wear"))
        self.buffer += dt / 200 * (1.2 * self.out - self.buffer)
        self.product += dt / 25 * (self.temperature - 1 - self.product)

    def outputs(self):
        return (self.level, 9.81 * self.level, self.temperature, self.flow, self.out,
                self.amps, 12 * self.power, self.buffer, self.product)
