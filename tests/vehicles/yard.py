# SPDX-License-Identifier: MIT
"""Four more machines, drawn by somebody who knew the conventions of this folder and no detector.

run(vehicle, seed, fault) -> (columns, rows, truth), for grade.py --module. A fault is "kind:sensor"
or the name of a physical one. truth is None, or a dict: columns (accepted outcome -> sign of
measured less nominal, 0: none is defined), onset (seconds: the first faulty row), rows (0 or 1 per
row), features (accepted names for the region), size, kinds (accepted kinds or None).
  buggy    electric car, four wheels, random drive: slip, a steering servo with a delay, encoders of
           coarse steps, two drive modes, heading that wraps                        .02 s, 3000 rows
  stage    coasting upper stage: attitude by pulses of cold gas, random targets, settling jet on and
           off, a tank that empties, roll that wraps; one fault that comes and goes  .1 s, 2400 rows
  cell     fuel-cell plant: random load, coolant that takes its time in the pipes, hydrogen that
           runs out, weather of which only the temperature is measured                1 s, 3000 rows
  balloon  stratospheric balloon: ascent, then random altitudes by pumping air in and letting it
           out; sun, battery, a gondola that turns; four phases of flight            10 s, 1600 rows
Sensor faults are in the logged reading alone: the controllers have transducers of their own. What
is drawn at random does not depend on the fault, so that a run with it and one without differ by the
fault alone. All faults, also those of a region, begin at 25 to 60 % of the run.
"""
import collections
import math
import random

import common
from common import Physical, clip, wrap

ENOUGH_ROWS = 120    # a region is drawn again if the run spends fewer rows in it
LATEST = .6          # or comes to it later than at this share of the run
TRIES = 30


class Machine(common.Vehicle):
    """A vehicle with parameters in a table, and sensors that quantise or are louder at times.

    NOMINAL   parameter -> (value on paper, share by which it differs from run to run)
    LOUD      sensor -> (sensor whose size matters, a, b): noise is a + b |value| times as large
    STEPS     sensor -> size of its steps
    """
    NOMINAL, LOUD, STEPS = {}, {}, {}

    def __init__(self, r):
        super().__init__(r)
        for name, (value, share) in self.NOMINAL.items():
            setattr(self, name, self.jitter(value, share))

    def nominal(self):
        for name, (value, _) in self.NOMINAL.items():
            setattr(self, name, value)


class Pipe:
    """Gives back what went in some rows ago."""

    def __init__(self, rows, value):
        self.content = collections.deque([value] * rows)

    def __call__(self, value):
        self.content.append(value)
        return self.content.popleft()


class Buggy(Machine):
    """A cruise controller follows a planned speed; the road pushes and slopes, the tyres slip."""
    DT, ROWS = .02, 3000
    COLUMNS = ("t_s", "u.speed_mps", "u.accel_mps2", "u.steer_rad", "u.brake", "u.boost",
               "x.slope_pct", "s.speed_mps", "s.wheel_fl_radps", "s.wheel_fr_radps",
               "s.wheel_rl_radps", "s.wheel_rr_radps", "s.yaw_rad", "s.yawrate_radps",
               "s.lateral_mps2", "s.current_A", "s.bus_V", "s.motor_degC")
    SIGMA = dict(speed=.05, wheel_fl=.25, wheel_fr=.25, wheel_rl=.25, wheel_rr=.25, yaw=.005,
                 yawrate=.01, lateral=.1, current=.8, bus=.05, motor=.3)
    ANGLES, FOLLOW = ("yaw",), ("yaw", "used")
    LOUD = {"lateral": ("speed", .4, .15)}
    STEPS = dict(wheel_fl=.5, wheel_fr=.5, wheel_rl=.5, wheel_rr=.5)
    NOMINAL = dict(magnet=(9, .003), roll=(45, .005), air=(.9, .005), grip=(8000, .005),
                   under=(110, .005), inner=(.03, .005))
    SENSOR_FAULTS = ("bias:lateral", "gain:wheel_fr", "noise:yawrate", "stuck:current")
    SPEEDS = ("u.speed_mps", "s.speed_mps", "s.wheel_fl_radps", "s.wheel_fr_radps",
              "s.wheel_rl_radps", "s.wheel_rr_radps")
    TURNS = ("u.steer_rad", "s.yawrate_radps", "s.lateral_mps2")
    PHYSICAL = {
        # a brake that does not let go
        "drag": Physical("drag", 22, {"current": 1, "motor": 1, "bus": -1}),
        # the rear left tyre loses air: its wheel must turn faster
        "tyre": Physical("tyre", .033, {"wheel_rl": 1}, ramp=True),
        # the drive train shakes in a band of speed
        "shake": Physical("drag", 44, {"current": 1, "bus": -1}, SPEEDS,
                          draw=lambda r: r.uniform(3.5, 5),
                          where=lambda f, low: low < f["speed"] < low + 1.5),
        # a tyre rubs when steered to the left and fast
        "rub_left": Physical("drag", 34, {"current": 1, "bus": -1}, TURNS + SPEEDS,
                             draw=lambda r: (r.uniform(.02, .05), r.uniform(4, 5)),
                             where=lambda f, e: f["steer"] > e[0] and f["speed"] > e[1]),
        # the linkage yields to the left alone
        "yield_left": Physical("yield", .13, {"yawrate": -1, "lateral": -1, "yaw": 0}, TURNS,
                               where=lambda f, _: f["steer"] > .02),
    }

    def __init__(self, r):
        super().__init__(r)
        self.speed = self.plan = self.accel = self.steer = self.rate = self.lateral = 0.0
        self.aim, self.wheel, self.turn, self.boost = r.uniform(4, 8), 0.0, 0.0, 0.0
        self.next_aim, self.next_turn, self.next_boost = r.uniform(3, 5), 1.5, r.uniform(4, 10)
        self.bends = []
        self.yaw, self.servo, self.pipe = r.uniform(-3, 3), 0.0, Pipe(4, 0.0)
        self.length, self.phase = r.uniform(40, 70), r.uniform(0, 6)
        self.way = self.slope = self.push = self.gust = self.sum = self.current = self.used = 0.0
        self.force = self.bus = self.limit = 0.0
        self.motor = 33 + r.gauss(0, .8)

    def command(self, t):
        r, dt = self.r, self.DT
        if t >= self.next_aim:
            self.next_aim, self.aim = t + r.uniform(2, 5), r.uniform(2.5, 8.5)
        if t >= self.next_turn:
            if not self.bends:
                self.bends = [-1, 1, 0, -1, 1]
                r.shuffle(self.bends)
            self.next_turn = t + r.uniform(1.2, 3.5)
            self.turn = self.bends.pop() * r.uniform(.04, .16)
        if t >= self.next_boost:
            self.next_boost, self.boost = t + r.uniform(4, 10), 1.0 - self.boost
        self.accel += dt / .2 * (clip(1.2 * (self.aim - self.plan), -2.5, 1.8) - self.accel)
        self.plan = max(0.0, self.plan + dt * self.accel)
        self.wheel += dt / .4 * (self.turn - self.wheel)
        self.brake = clip((-self.accel - 1) / 2, 0, 1)
        return self.plan, self.accel, self.wheel, self.brake, self.boost

    def step(self, u, fault):
        dt, v = self.DT, self.speed
        plan, accel, wheel, brake, boost = u
        moves = math.tanh(v / .2)
        self.way += dt * plan
        self.slope = 3 * math.sin(2 * math.pi * self.way / self.length + self.phase)
        self.push = self.wander(self.push, 2, 5)
        self.gust = self.wander(self.gust, .5, .004)
        wanted = (300 * accel + 900 * (plan - v) + self.sum) / 9 + 78 * brake
        self.limit = 70 + 45 * boost
        asked = clip(wanted, -40, self.limit)
        if asked == wanted:
            self.sum += dt * 500 * (plan - v)
        self.current += dt / .05 * (asked - self.current)
        self.force = self.magnet * self.current
        resist = self.roll + self.air * v * v + 1.2 * v + 6 * abs(self.rate * v) + fault("drag")
        net = self.force - moves * (700 * brake + resist) - 29.4 * self.slope + self.push
        self.speed = max(0.0, v + dt * net / 300)
        self.servo += dt / .08 * (self.pipe(wheel) - self.servo)
        self.steer = self.servo * (1 - fault("yield"))
        wants = v * math.tan(self.steer) / 1.6 / (1 + v * v / self.under)
        self.rate += dt / .12 * (wants - self.rate) + dt * self.gust * moves * 10
        self.yaw = wrap(self.yaw + dt * self.rate)
        self.lateral = v * self.rate
        self.used += dt * self.current
        self.bus = 52 - self.inner * self.current - .0008 * self.used
        self.motor += dt / 30 * (.009 * self.current ** 2 - self.motor + 29)
        brakes = 350 * brake * moves
        rear = .5 + .3 * boost
        front = 1 + ((1 - rear) * self.force - brakes) / self.grip
        back = 1 + (rear * self.force - brakes) / self.grip
        left, right = (self.speed - .6 * self.rate) / .25, (self.speed + .6 * self.rate) / .25
        ahead = 1 / math.cos(self.servo)
        self.wheels = (left * ahead * front, right * ahead * front,
                       left * back / (1 - fault("tyre")), right * back)

    def outputs(self):
        return (self.slope, self.speed) + self.wheels + (
            self.yaw, self.rate, self.lateral, self.current, self.bus, self.motor)


class Stage(Machine):
    """Pulses of cold gas turn it to random targets; a settling jet pushes it off its axis."""
    DT, ROWS = .1, 2400
    COLUMNS = ("t_s", "u.left", "u.right", "u.spin_up", "u.spin_down", "u.settle", "u.heater",
               "s.yawrate_mradps", "s.rollrate_mradps", "s.roll_rad", "s.tank_bar",
               "s.regulated_bar", "s.left_bar", "s.right_bar", "s.axial_mmps2", "s.gas_degC",
               "s.bus_A", "s.battery_V")
    SIGMA = dict(yawrate=.15, rollrate=.2, roll=.004, tank=1.2, regulated=.04, left=.12, right=.12,
                 axial=1., gas=.2, bus=.06, battery=.03)
    ANGLES, FOLLOW = ("roll",), ("yaw", "yawrate", "roll", "rollrate", "used")
    LOUD = {"axial": ("axial", 1, .01)}
    STEPS = {"gas": .5}
    NOMINAL = dict(arm=(1, .003), spin=(.7, .003), offset=(1.4, .01), jet=(20, .003),
                   droop=(.05, .01), coil=(.35, .005), idle=(1.8, .003), gauge=(62, .002))
    SENSOR_FAULTS = ("bias:bus", "drift:regulated", "gain:axial", "noise:rollrate")
    PHYSICAL = {
        # dirt in the right nozzle's valve
        "clog": Physical("clog", .1, {"right": -1, "yawrate": 0}),
        # gas escapes from the tank, more and more
        "leak": Physical("leak", 1.4, {"tank": -1}, ramp=True),
        # the radio's amplifier works against a wall in an arc of the roll
        "arc": Physical("radio", .1, {"bus": 1}, ("s.roll_rad",), draw=lambda r: r.uniform(-3, 3),
                        where=lambda f, a: abs(wrap(f["roll"] - a)) < .9),
        # ice in the settling jet, when it blows and the gas is cold
        "ice": Physical("ice", .04, {"axial": -1}, ("u.settle", "s.axial_mmps2", "s.gas_degC"),
                        draw=lambda r: r.uniform(3, 6),
                        where=lambda f, cold: f["settle"] > .5 and f["gas"] < cold),
        # the regulator sags in stretches of time
        "sag": Physical("sag", .035, {"regulated": -1, "left": -1, "right": -1, "axial": -1},
                        draw=lambda r: [(r.uniform(5, 14), r.uniform(5, 14)) for _ in range(40)],
                        where=lambda f, e: Stage.comes(f["time"], e)),
    }

    @staticmethod
    def comes(time, stretches):
        """Whether an intermittent fault is on: stretches are seconds (on, off) from the start."""
        for on, off in stretches:
            if time < on:
                return True
            time -= on + off
            if time < 0:
                return False
        return False

    def __init__(self, r):
        super().__init__(r)
        self.time = 0.0
        self.yaw, self.aim, self.next_aim = r.uniform(-50, 50), 0.0, r.uniform(3, 8)
        self.spinning, self.next_spin = r.uniform(-80, 80), r.uniform(20, 40)
        self.settle, self.next_settle, self.heater = 0.0, r.uniform(5, 15), 0.0
        self.yawrate = self.rollrate = self.twist = self.slosh = self.used = self.surge = 0.0
        self.roll, self.mass, self.gas = r.uniform(-3, 3), r.uniform(2.85, 3.15), 11 + r.gauss(0, 1)
        self.regulated, self.valves, self.pulses = 6.0, [0.0] * 5, [0.0] * 4
        self.tank = self.axial = self.bus = self.battery = 0.0

    @staticmethod
    def pulse(error, wide, on):
        """Whether a valve opens: from a wide error until it is small."""
        return 1.0 if error > (.15 * wide if on else wide) else 0.0

    def command(self, t):
        r, p = self.r, self.pulses
        if t >= self.next_aim:
            self.next_aim, self.aim = t + r.uniform(10, 20), r.uniform(-250, 250)
        if t >= self.next_spin:
            self.next_spin, self.spinning = t + r.uniform(20, 40), r.uniform(-90, 90)
        if t >= self.next_settle:
            self.next_settle, self.settle = t + r.uniform(12, 26), 1.0 - self.settle
        self.heater = 1.0 if self.gas < 0 else 0.0 if self.gas > 8 else self.heater
        yaw = clip(.15 * (self.aim - self.yaw), -25, 25) - self.yawrate
        roll = self.spinning - self.rollrate
        self.pulses = [self.pulse(yaw, 2.5, p[0]), self.pulse(-yaw, 2.5, p[1]),
                       self.pulse(roll, 4, p[2]), self.pulse(-roll, 4, p[3])]
        return tuple(self.pulses) + (self.settle, self.heater)

    def step(self, u, fault):
        dt = self.DT
        self.time += dt
        for i in range(5):
            self.valves[i] += .8 * (u[i] - self.valves[i])
        left, right, up, down, settle = self.valves
        right *= 1 - fault("clog")
        flow = self.regulated / 6 * (2 * (left + right + up + down) + 5 * settle)
        self.surge = self.wander(self.surge, 20, .02)
        self.mass -= dt * (flow + fault("leak")) / 1000
        self.gas += dt * (-.06 * flow + .3 * u[5] + (12 - self.gas) / 80)
        self.tank = self.gauge * self.mass * (1 + self.gas / 273)
        sets = 6 - self.droop * flow - .003 * (180 - self.tank) + self.surge
        self.regulated += .5 * (sets * (1 - fault("sag")) - self.regulated)
        self.chambers = self.regulated * left, self.regulated * right
        self.twist = self.wander(self.twist, 15, .2)
        self.slosh = self.wander(self.slosh, 8, .3)
        turn = self.arm * (self.chambers[0] - self.chambers[1])
        self.yawrate += dt * (turn + self.offset * settle + self.twist)
        self.rollrate += dt * (self.spin * self.regulated * (up - down) + self.slosh)
        self.yaw += dt * self.yawrate
        self.roll = wrap(self.roll + dt * self.rollrate / 1000)
        self.axial = self.jet * self.regulated * settle * (1 - fault("ice"))
        self.bus = self.idle + self.coil * sum(u[:4]) + .8 * u[4] + 1.5 * u[5] + fault("radio")
        self.used += dt * self.bus
        self.battery = 28.5 - .12 * self.bus - .002 * self.used

    def outputs(self):
        return (self.yawrate, self.rollrate, self.roll, self.tank, self.regulated) + self.chambers \
            + (self.axial, self.gas, self.bus, self.battery)


class Cell(Machine):
    """Fuel cells of 48 plates, water-cooled through long pipes, a blower, a tank of hydrogen."""
    DT, ROWS = 1.0, 3000
    COLUMNS = ("t_s", "u.load_A", "u.blower", "u.pump", "u.fan", "u.purge", "x.ambient_degC",
               "s.stack_V", "s.current_A", "s.air_gps", "s.cathode_bar", "s.tank_bar",
               "s.anode_bar", "s.inlet_degC", "s.outlet_degC", "s.blower_A")
    SIGMA = dict(stack=.12, current=.8, air=.06, cathode=.004, tank=.5, anode=.006, inlet=.2,
                 outlet=.2, blower=.25)
    LOUD = {"air": ("air", .5, .08)}
    STEPS = {"tank": 1.}
    NOMINAL = dict(ohm=(.0009, .003), rush=(12, .003), hole=(.02, .003), wet=(1.05, .003),
                   copper=(30, .003), plates=(.25, .005))
    SENSOR_FAULTS = ("bias:anode", "drift:air", "gain:blower", "stuck:cathode")
    LOADS = ("u.load_A", "s.current_A", "u.blower", "s.air_gps", "s.cathode_bar", "s.blower_A",
             "u.pump")
    PHYSICAL = {
        # a fitting of the tank that is not tight
        "leak": Physical("leak", .006, {"tank": -1}),
        # the membranes age
        "ageing": Physical("ohm", .1, {"stack": -1}, ramp=True),
        # the blower surges in a band of speed
        "surge": Physical("surge", .025, {"air": -1, "cathode": -1}, LOADS,
                          draw=lambda r: r.uniform(.35, .6),
                          where=lambda f, low: low < f["blower"] < low + .2),
        # water stays in the channels at high load in cold weather
        "flood": Physical("flood", .4, {"stack": -1}, ("x.ambient_degC",) + LOADS + ("s.stack_V",),
                          draw=lambda r: (r.uniform(130, 160), r.uniform(17, 20)),
                          where=lambda f, e: f["load"] > e[0] and f["ambient"] < e[1]),
    }

    def __init__(self, r):
        super().__init__(r)
        self.load, self.aim, self.next = 0.0, r.uniform(80, 200), r.uniform(60, 120)
        self.purge, self.next_purge, self.end_purge = 0.0, r.uniform(60, 100), 0.0
        self.trim, self.blower, self.pump, self.fan, self.sum = 0.0, .1, .3, 0.0, 0.0
        self.mean, self.period = r.uniform(17, 20), r.uniform(700, 1100)
        self.phase = r.uniform(0, 6)
        self.weather = self.wind = self.dry = self.seat = 0.0
        self.ambient = self.mean
        self.outlet = self.inlet = self.back = 30 + r.gauss(0, 1)
        self.to, self.fro = Pipe(8, self.outlet), Pipe(6, self.outlet)
        self.current, self.air, self.cathode, self.anode = 0.0, 1.2, 1.02, 1.6
        self.mass, self.tank, self.stack, self.amps = r.uniform(1150, 1250), 340.0, 48.0, 2.0
        self.time = 0.0

    def command(self, t):
        r = self.r
        if t >= self.next:
            self.next, self.aim = t + r.uniform(60, 180), r.uniform(60, 250)
            self.trim = r.uniform(-.06, .06)
        if t >= self.next_purge:
            self.next_purge, self.end_purge = t + r.uniform(60, 110), t + 6
        self.purge = 1.0 if t < self.end_purge else 0.0
        self.load += clip(self.aim - self.load, -4, 4)
        self.blower += .3 * (clip(.0032 * self.load + .1 + self.trim, 0, 1) - self.blower)
        self.pump = clip(.3 + .0025 * self.load, 0, 1)
        hot = self.outlet - 65
        wanted = .05 * hot + self.sum
        self.fan = clip(wanted, 0, 1)
        if self.fan == wanted or hot * (.5 - self.fan) > 0:
            self.sum += .0008 * hot
        return self.load, self.blower, self.pump, self.fan, self.purge

    def step(self, u, fault):
        load, blower, pump, fan, purge = u
        self.time += self.DT
        self.weather = self.wander(self.weather, 200, .6)
        self.wind = self.wander(self.wind, 60, .04)
        self.dry = self.wander(self.dry, 150, .006)
        self.seat = self.wander(self.seat, 30, .004)
        swing = 5 * math.sin(2 * math.pi * self.time / self.period + self.phase)
        self.ambient = self.mean + swing + self.weather
        self.current += .5 * (load - self.current)
        blows = self.rush * blower * 293 / (273 + self.ambient) * (1 - fault("surge"))
        self.air += .4 * (blows - self.air)
        self.cathode = 1 + self.hole * self.air + .0004 * self.air ** 2
        i = max(self.current, 0.0)
        excess = max(.3, self.air / (.0171 * i + .3) - 1)
        ohm = self.ohm * (1 - .006 * (self.outlet - 65)) * (1 + self.dry + fault("ohm"))
        volts = self.wet - .045 * math.log(1 + i / 3) - ohm * i - .03 / (.5 + excess)
        self.stack = 48 * volts - fault("flood")
        heat = i * (60 - self.stack) / 1000
        carries = .1 + .9 * pump
        loses = carries * (self.outlet - self.inlet) + .015 * (self.outlet - self.ambient)
        self.outlet += (heat - loses) / 25
        hot = self.to(self.outlet)
        cools = (.02 + self.plates * fan) * (1 + self.wind) / (.4 + pump)
        self.back += .2 * (hot - cools * (hot - self.ambient) - self.back)
        self.inlet = self.fro(self.back)
        self.mass -= .0005 * i + .25 * purge + fault("leak")
        self.tank = .285 * self.mass
        self.anode += .6 * (1.6 - .0006 * i - .15 * purge + self.seat - self.anode)
        self.amps = 2 + self.copper * blower ** 2 * 293 / (273 + self.ambient)

    def outputs(self):
        return (self.ambient, self.stack, self.current, self.air, self.cathode, self.tank,
                self.anode, self.inlet, self.outlet, self.amps)


class Balloon(Machine):
    """Rises until its skin is full, then pumps air in to sink and lets it out to rise."""
    DT, ROWS = 10.0, 1600
    COLUMNS = ("t_s", "u.phase", "u.compressor", "u.vent", "u.azimuth_rad", "u.payload", "u.heater",
               "x.sun", "x.altitude_km", "s.ambient_hPa", "s.outside_degC", "s.gas_degC",
               "s.super_hPa", "s.compressor_A", "s.climb_mps", "s.azimuth_rad", "s.panel_A",
               "s.bus_A", "s.battery_V", "s.box_degC")
    SIGMA = dict(ambient=.3, outside=.4, gas=.3, super=.45, compressor=.06, climb=.06, azimuth=.03,
                 panel=.1, bus=.06, battery=.03, box=.3)
    ANGLES = ("azimuth",)
    FOLLOW = ("altitude", "ballast", "azimuth", "charge")
    LOUD = {"climb": ("climb", 1, .6)}
    STEPS = {"outside": 1.}
    NOMINAL = dict(cells=(8.5, .004), idle=(2.2, .003), motor=(3.2, .005), dish=(1.4, .005),
                   blows=(.02, .005), skin=(20, .01))
    SENSOR_FAULTS = ("bias:panel", "drift:bus", "noise:battery", "stuck:super")
    PHYSICAL = {
        # strings of the panel fail
        "cells": Physical("cells", .036, {"panel": -1, "battery": -1}),
        # helium escapes, more and more
        "leak": Physical("leak", .9, {"super": -1}, ramp=True),
        # something hangs before the panel in an arc of the gondola's heading
        "shadow": Physical("cells", .05, {"panel": -1, "battery": -1},
                           ("u.azimuth_rad", "s.azimuth_rad"),
                           draw=lambda r: r.uniform(-3, 3),
                           where=lambda f, a: abs(wrap(f["azimuth"] - a)) < .9),
        # the payload's high voltage leaks into air that is thin enough
        "corona": Physical("corona", .15, {"bus": 1}, ("x.altitude_km", "u.payload",
                           "s.ambient_hPa"), draw=lambda r: r.uniform(17.8, 18.4),
                           where=lambda f, low: f["altitude"] > low and f["payload"] > .5),
    }

    def __init__(self, r):
        super().__init__(r)
        self.altitude, self.ballast, self.helium = r.uniform(0, .3), 0.0, r.uniform(1.197, 1.203)
        self.aim, self.next = r.uniform(17.6, 19.4), r.uniform(4500, 5500)
        self.phase = self.compressor = self.vent = self.heater = self.payload = 0.0
        self.next_payload, self.next_turn = r.uniform(500, 1500), r.uniform(300, 700)
        self.azimuth = self.turn = r.uniform(-3, 3)
        self.noon, self.sun = r.uniform(8500, 12000), 0.0
        self.air = self.albedo = self.swirl = self.draught = self.climb = 0.0
        self.outside, self.gas = 15.0, 15 + r.gauss(0, 1)
        self.charge, self.box, self.super = r.uniform(.55, .65), 15 + r.gauss(0, 1), 0.0
        self.time = self.amps = self.panel = self.bus = self.ambient = self.battery = 0.0

    def command(self, t):
        r = self.r
        if t >= self.next:
            self.next, self.aim = t + r.uniform(700, 1600), r.uniform(17.5, 19.5)
        if t >= self.next_payload:
            self.next_payload, self.payload = t + r.uniform(300, 900), 1.0 - self.payload
        if t >= self.next_turn:
            self.next_turn, self.turn = t + r.uniform(200, 500), r.uniform(-math.pi, math.pi)
        self.heater = 1.0 if self.box < 3 else 0.0 if self.box > 8 else self.heater
        high = self.altitude - self.aim
        if self.phase == 0:
            self.phase = 1.0 if self.super > 4 else 0.0
        elif abs(high) > .1:
            self.phase = 3.0 if high > 0 else 2.0
        elif abs(high) < .03:
            self.phase = 1.0
        self.compressor = clip(3 * high + .2, 0, 1) if self.phase == 3 else 0.0
        self.vent = clip(-3 * high + .2, 0, 1) if self.phase == 2 else 0.0
        return self.phase, self.compressor, self.vent, self.turn, self.payload, self.heater

    def step(self, u, fault):
        dt, h = self.DT, self.altitude
        self.time += dt
        _, compressor, vent, turn, payload, heater = u
        self.air = self.wander(self.air, 1500, .4)
        self.albedo = self.wander(self.albedo, 600, .005)
        self.swirl = self.wander(self.swirl, 100, .05)
        self.draught = self.wander(self.draught, 120, .05)
        self.sun = max(0.0, math.cos((self.time - self.noon) * 2 * math.pi / 60000))
        self.outside = max(15 - 6.5 * h, -56 + .8 * (h - 12)) + self.air
        warm = self.outside + 4 + self.skin * self.sun - 1.2 * self.climb
        self.gas += dt / 400 * (warm - self.gas)
        thin = math.exp((20 - h) / 6.9)
        self.ambient = 55 * thin
        fills = (self.helium + self.ballast / 53) * (self.gas + 273) / 217
        self.super = max(0.0, 55 * fills - self.ambient)
        lifts = 53 * min(thin, fills * 217 / (self.outside + 273))
        self.amps = compressor * self.motor * (.7 + .01 * self.ambient / 2 + .01 * self.super)
        pumped = self.blows * compressor * self.ambient / 70
        vented = self.blows * vent * math.sqrt(self.super / 12)
        self.ballast = clip(self.ballast + dt * (pumped - vented), 0, 35)
        self.helium -= dt * fault("leak") / 1e5
        net = lifts - 52 - self.ballast
        self.climb = 2.2 / math.sqrt(1 + math.exp(-h / 7) * 3) * net / math.sqrt(abs(net) + 1)
        self.climb += self.draught
        self.altitude = max(0.0, h + dt * self.climb / 1000)
        self.azimuth = wrap(self.azimuth + dt / 60 * (wrap(turn - self.azimuth) + self.swirl))
        light = self.sun * (1.15 - .15 * self.sun) * (1 + self.albedo) * min(1.0, .8 + h / 80)
        self.panel = self.cells * light * (1 - fault("cells"))
        self.bus = self.idle + self.dish * payload + 1.6 * heater + self.amps + fault("corona")
        self.charge = clip(self.charge + dt * (self.panel - self.bus) / 250000, .1, 1)
        self.battery = 24 + 4 * self.charge + .06 * (self.panel - self.bus)
        keeps = self.outside + 50 + 14 * heater + 3 * payload + 2 * self.sun
        self.box += dt / 700 * (keeps - self.box)

    def outputs(self):
        return (self.sun, self.altitude, self.ambient, self.outside, self.gas, self.super,
                self.amps, self.climb, self.azimuth, self.panel, self.bus, self.battery, self.box)


KIND = {"buggy": Buggy, "stage": Stage, "cell": Cell, "balloon": Balloon}
VEHICLES = tuple(KIND)
RATE = {v: k.DT for v, k in KIND.items()}
LENGTH = {v: k.ROWS for v, k in KIND.items()}
FAULTS = {name: kind.SENSOR_FAULTS + tuple(kind.PHYSICAL) for name, kind in KIND.items()}


def sensors(kind):
    """(index in a row without its time, short name) of every sensor."""
    return [(i, common.short(c)) for i, c in enumerate(kind.COLUMNS[1:]) if c.startswith("s.")]


def measure(kind, seed, rows):
    """Sensors over the true values: a run's own bias and scale, white noise, louder at times."""
    q = random.Random("yard sensors %s %d" % (kind.__name__, seed))
    every = sensors(kind)
    place = {name: i for i, name in every}
    own = {}
    for i, name in every:
        sigma = kind.SIGMA[name]
        scale = 1 + q.gauss(0, common.RUN_SCALE)
        of, a, b = kind.LOUD.get(name, (name, 1, 0))
        own[i] = (q.gauss(0, common.RUN_BIAS) * sigma, 1.0 if name in kind.ANGLES else scale,
                  place[of], a * sigma, b * sigma)
    out = []
    for row in rows:
        x = list(row)
        for i, (bias, scale, of, a, b) in own.items():
            x[i] = row[i] * scale + bias + q.gauss(0, 1) * (a + b * abs(row[of]))
        out.append(x)
    return out


def finish(kind, measured):
    """Steps and wrapped angles, in place: what comes after everything else."""
    for i, name in sensors(kind):
        step, angle = kind.STEPS.get(name), name in kind.ANGLES
        for x in measured:
            if step:
                x[i] = step * round(x[i] / step)
            if angle:
                x[i] = wrap(x[i])


def make(kind, seed, fault=None, twin=False):
    """As common.make, with regions that the run comes to in time."""
    r = random.Random("yard fault %s %s %d" % (kind.__name__, fault, seed))
    physical, best = kind.PHYSICAL.get(fault), None
    for _ in range(TRIES if physical and physical.where else 1):
        start = int(r.uniform(.25, .5) * kind.ROWS) + 1
        edges = physical.draw(r) if physical and physical.draw else ()
        simulated = common.simulate(kind, seed, physical, edges, start * kind.DT, twin)
        acts = simulated[1]
        few = max(0, ENOUGH_ROWS - sum(acts))
        late = max(0.0, (acts.index(1) if any(acts) else kind.ROWS) - LATEST * kind.ROWS)
        if best is None or (late, few) < best[0]:
            best = (late, few), start, edges, simulated
        if best[0] == (0, 0):
            break
    _, start, edges, (rows, acts, twins, states) = best
    measured, truth = measure(kind, seed, rows), None
    if physical:
        truth = dict(columns={common.column(kind, a): s for a, s in physical.columns.items()},
                     onset=acts.index(1) * kind.DT, rows=acts, features=physical.features,
                     size=None, kinds=None)
    elif fault:
        what, _, name = fault.partition(":")
        hit = kind.COLUMNS.index(common.column(kind, name)) - 1
        size = common.break_sensor(what, hit, measured, rows, kind.SIGMA[name], start, r)
        sign = (1 if size > 0 else -1) if what in ("bias", "drift") else 0
        truth = dict(columns={kind.COLUMNS[hit + 1]: sign}, onset=start * kind.DT,
                     rows=[int(k >= start) for k in range(kind.ROWS)], features=(),
                     size=size if what == "bias" else None, kinds=common.KINDS.get(what))
    finish(kind, measured)
    stamped = [[k * kind.DT] + x for k, x in enumerate(measured)]
    return list(kind.COLUMNS), stamped, truth, (twins, states, edges)


def run(vehicle, seed, fault=None):
    return make(KIND[vehicle], seed, fault)[:3]
