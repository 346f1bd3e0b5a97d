# SPDX-License-Identifier: MIT
"""Four machines of a quay and its hinterland, drawn by somebody who had not seen the monitor.

See `run`.

forklift    An electric counterbalance truck. A driver's levers, which follow a drawn plan, feed a
            chopped direct-current drive and a pump that lifts a two-stage mast; nothing is
            controlled in a loop. The forks weigh the load. A row every .1 s.
            bind: a brake drags. leak: the raised mast sinks. cells: the battery resists more.
            bush: the pump's bearing rubs. rail: the mast is stiff above a height while it rises.
            reverse: the gear drags when it runs backwards.
tractor     A tractor ploughs passes with headlands between; the governor holds the engine's speed,
            the hitch holds the draft by its depth, the soil differs. A row every .2 s.
            injector: less power for the fuel. lug: the tyres slip more. share: blunt, the
            furrow needs more force, so the hitch digs less deep. radiator: cools less.
            creep: the drive's belt slips uphill. surge: bad combustion in a band of engine speed.
ebike       An electric cargo bicycle with a mid-drive on a hilly course. The rider's effort is
            drawn, he shifts by cadence; the motor adds to his torque, heats and cools. A row
            every .1 s.
            magnet: less torque for the current. tyre: it loses air more and more. cells: the
            battery resists more. sink: the controller's heat sink came loose. hall: the
            motor is commutated badly in a band of cadence. cog: the chain slips uphill.
hovercraft  A small hovercraft goes between random marks on a lake; an autopilot steers, wind and
            waves push. A row every .2 s. skirt: it is torn more and more. blade: the propeller
            pushes less. bearing: the fan's bearing rubs. core: the cooler cools less.
            weed: drag in a box of the lake. vane: the rudders do less to starboard.

run(vehicle, seed, fault) -> (columns, rows, truth), as in harbour.py, whose conventions hold:
nothing that is drawn for mission, parameters, disturbances and sensors depends on the fault;
sensor faults do not act on the controllers; faults begin at 25 to 60 % of the run, but those with a
place are there from the first row in half of the cases. truth: None, or dict(columns, onset, rows,
features, size, kinds). Sensors: white noise (SIGMA), part of them rounded (STEP); a run's own
offset and scale. Sizes: SENSOR, in SIGMA (bias, the end of a drift, the noise that is added), of
one (gain), or rows for which a reading is kept.
"""
import math

from lot import Lot, clip, names, now, some, steps, wrap

G = 9.81
TURN = 2 * math.pi


class Forklift:
    """The truck. Angles in rad, yaw and steering positive to the left; pressure in bar."""
    RATE, LENGTH, NOISES = .1, 3000, 5
    COLUMNS = ["t_s", "u.drive", "u.steer_deg", "u.lift", "x.load_kg", "s.speed_mps",
               "s.heading_rad", "s.yawrate_radps", "s.motor_A", "s.winding_degC", "s.mast_m",
               "s.hydraulic_bar", "s.pump_A", "s.oil_degC", "s.battery_V"]
    SIGMA = dict(load=8., speed=.02, heading=.01, yawrate=.01, motor=3., winding=.4, mast=.006,
                 hydraulic=1.2, pump=3., oil=.2, battery=.12)
    STEP = dict(load=5., motor=1., winding=.5, hydraulic=.5, oil=.1, battery=.05, mast=.002)
    WRAP = dict(heading=(-math.pi, math.pi))
    EXACT = ()
    SENSOR = {"gain:hydraulic": (.05, .07), "noise:yawrate": (1.2, 1.4)}
    PHYSICAL = {
        "bind": (160., 200., dict(motor=0, speed=0), ()),
        "leak": (.005, .007, dict(mast=-1), ()),
        "cells": (.003, .004, dict(battery=-1), ()),
        "bush": (1.8, 2.3, dict(pump=1), ()),
        "rail": (5.5, 7., dict(hydraulic=1, pump=1), ("s.mast_m", "u.lift")),
        "reverse": (150., 190., dict(motor=-1, speed=1), ("u.drive", "s.speed_mps")),
    }
    RAMPS = ()

    def __init__(self, r):
        end = self.RATE * self.LENGTH
        self.empty, self.k, self.ohm = some(r, 3200.), some(r, 11.), some(r, .1)
        self.roll, self.wheelbase = some(r, .016, .01), some(r, 1.5)
        self.bore, self.displace, self.rub = some(r, 23.5e-4), some(r, 12e-6), some(r, 2., .02)
        self.seal, self.inner = some(r, 7., .02), some(r, 14., .01)
        self.hall = 16 + r.gauss(0, 3)
        self.oil, self.winding = self.hall + r.uniform(4, 18), self.hall + r.uniform(5, 30)
        self.charge, self.cell = r.uniform(.55, .95), some(r, .020, .01)
        self.v = self.amp = self.delta = self.n = self.pump = self.mast = self.w = 0.
        self.yaw, self.bar, self.floor, self.drag, self.slide = r.uniform(-3, 3), 4., 0., 0., 0.
        self.grease = self.churn = 0.
        self.volts = 48 + 3 * self.charge
        self.drives = steps(r, end, 3, 10, lambda: r.choice(
            [0., r.uniform(.3, 1), r.uniform(.3, 1), r.uniform(-.7, -.25)]))
        self.steers = steps(r, end, 2, 7, lambda: r.choice([0., 0., r.uniform(-34, 34),
                                                            r.uniform(-34, 34)]))
        self.lifts, self.loads = self.work(r, end)
        self.i = self.j = self.m = self.o = 0
        self.drive = self.steer = self.lever = self.load = 0.

    @staticmethod
    def work(r, end):
        """Levers of the mast, and loads; what the driver does not see of it he does not mend."""
        t, load, lifts, loads = r.uniform(2, 6), 0., [(0., 0.)], [(0., 0.)]
        while t < end:
            load = r.uniform(300, 1600) if not load else 0.
            loads.append((t + .5, load))
            t += r.uniform(2, 5)
            top, u = r.uniform(1.4, 3.6), r.uniform(.4, .85)
            lifts.append((t, u))
            t += top / (.42 * u)
            lifts.append((t, 0.))
            t += r.uniform(2, 8)
            if r.random() < .5:
                u = r.uniform(.35, .8)
                lifts.append((t, -u))
                t += .5 * top / (.45 * u)
                lifts.append((t, 0.))
                t += r.uniform(1, 5)
            u = r.uniform(.4, .9)
            lifts.append((t, -u))
            t += 1.8 * top / (.3 * u)
            lifts.append((t, 0.))
            t += r.uniform(.5, 3)
        return lifts, loads

    def pilot(self, t):
        self.i, self.j = now(self.drives, t, self.i), now(self.steers, t, self.j)
        self.m, self.o = now(self.lifts, t, self.m), now(self.loads, t, self.o)
        self.drive += clip((self.drives[self.i][1] if t > 2 else 0.) - self.drive, -.06, .06)
        to = self.steers[self.j][1] * (1 - .6 * abs(self.drive))
        self.steer += clip(to - self.steer, -4, 4)
        self.lever += clip(self.lifts[self.m][1] - self.lever, -.2, .2)
        self.load += clip(self.loads[self.o][1] - self.load, -200, 200)
        return self.drive, self.steer, self.lever

    def inside(self, fault, p, u):
        if fault == "rail":
            return self.mast > .4 + .6 * p[0] and self.lever > .1
        return fault != "reverse" or self.v < -.1

    def step(self, u, w, a):
        self.floor += .0004 * w[0] - .02 * self.floor
        self.drag += .03 * w[1] - .02 * self.drag
        self.slide += .001 * w[2] - .05 * self.slide
        self.grease += .25 * w[3] - .05 * self.grease
        self.churn += .04 * w[4] - .05 * self.churn
        mass = self.empty + self.load
        thick = math.exp(-.015 * (self.oil - 32))
        ohm = self.ohm * (1 + .0039 * (self.winding - 35))
        for _ in range(5):
            dt = self.RATE / 5
            # drive
            to = clip((u[0] * self.volts - self.k * self.v) / ohm, -280, 280)
            self.amp += dt * (to - self.amp) / .06
            still = math.tanh(self.v / .05)
            force = (.93 * self.k * self.amp - mass * G * (self.roll * still + self.floor)
                     - (a.get("bind", 0.) + a.get("reverse", 0.)) * still
                     - (12 + self.drag) * self.v)
            self.v += dt * force / (1.1 * mass)
            self.delta += dt * (math.radians(u[1]) - self.delta) / .25
            self.w = self.v * (math.tan(self.delta) / (self.wheelbase + .02 * self.v ** 2)
                               + self.slide)
            self.yaw = wrap(self.yaw + dt * self.w, -math.pi, math.pi)
            # mast
            torque = (self.bar * 1e5 * self.displace / TURN
                      + (self.rub + self.churn + a.get("bush", 0.)) * min(1., self.n)
                      + .06 * thick * self.n)
            self.pump = max(0., (u[2] * self.volts - self.n) / .03) if u[2] > .02 else 0.
            self.n = max(0., self.n + dt * (.16 * self.pump - torque) / .08)
            slip = .05 * self.bar / 150 / thick
            up = 2 * self.displace * self.n * (1 - slip) / self.bore
            down = .038 * -u[2] * math.sqrt(max(0., self.bar)) / thick ** .3 if u[2] < 0 else 0.
            sink = (.0002 + a.get("leak", 0.)) * self.bar / 120 if self.mast > .01 else 0.
            going = up - down - sink
            self.mast = self.mast + dt * going
            weight = (300 + self.load) * G * 2 / self.bore * 1e-5
            stage = self.inner / (1 + math.exp(-clip((self.mast - 1.9) / .04, -30, 30)))
            rest = weight + stage
            rest += (self.seal + self.grease) * math.tanh((up - down) / .02)
            rest += a.get("rail", 0.)
            if self.mast <= 0:
                self.mast, rest = 0., 4.
            self.bar += dt * (rest - self.bar) / .12
            # heat and charge
            lost = .25 * self.pump * u[2] * self.volts + down * self.bore / 2 * self.bar * 1e5
            self.oil += dt * (lost / 28000 - (self.oil - self.hall) / 450)
            self.winding += dt * (ohm * self.amp ** 2 / 9000 - (self.winding - self.hall) / 500)
            draw = u[0] * self.amp + max(0., u[2]) * self.pump + 4
            self.charge -= dt * draw / 1.8e6
            rest = 47.8 + 3 * self.charge - (self.cell + a.get("cells", 0.)) * draw
            self.volts += dt * (rest - self.volts) / .05

    def context(self):
        return (self.load,)

    def sense(self):
        return (self.v, self.yaw, self.w, self.amp, self.winding, self.mast, self.bar, self.pump,
                self.oil, self.volts)


class Tractor:
    """The tractor. Forces in kN, power in kW, depth in cm."""
    RATE, LENGTH, NOISES = .2, 3000, 5
    COLUMNS = ["t_s", "u.engine_rpm", "u.ratio", "u.draft_kN", "u.down", "x.slope_deg",
               "x.air_degC", "s.engine_rpm", "s.fuel_Lph", "s.wheel_mps", "s.radar_mps",
               "s.draft_kN", "s.depth_cm", "s.coolant_degC", "s.gearoil_degC"]
    SIGMA = dict(slope=.15, air=.1, engine=6., fuel=.25, wheel=.02, radar=.03, draft=.4, depth=.4,
                 coolant=.3, gearoil=.25)
    STEP = dict(slope=.1, air=.1, engine=1., fuel=.05, depth=.2, coolant=.1, gearoil=.5)
    EXACT = ()
    SENSOR = {"bias:radar": (2.5, 3.2), "drift:coolant": (4.5, 5.5)}
    PHYSICAL = {
        "injector": (.05, .065, dict(fuel=1), ()),
        "lug": (.16, .21, dict(radar=-1), ()),
        "share": (.08, .105, dict(depth=-1), ()),
        "radiator": (.12, .15, dict(coolant=1), ()),
        "creep": (.03, .04, dict(wheel=-1, radar=-1), ("x.slope_deg",)),
        "surge": (.05, .065, dict(fuel=1), ("u.engine_rpm", "s.engine_rpm")),
    }
    RAMPS = ()

    def __init__(self, r):
        end = self.RATE * self.LENGTH
        self.eta, self.grip, self.soil = some(r, .40), some(r, .65), some(r, .8, .012)
        self.cool, self.box, self.mass = some(r, 1.), some(r, 1.), some(r, 6.5)
        self.air = self.mild = 14 + r.gauss(0, 4)
        self.coolant, self.gearoil = r.uniform(62, 80), self.air + r.uniform(12, 30)
        self.rpm, self.fuel, self.sum, self.real = 1400., 5., 5., .8
        self.v = self.vw = 1.1
        self.depth, self.draft, self.felt = 0., 0., 0.
        self.hard = r.gauss(0, .04)
        self.wet = self.haul = self.sun = 0.
        self.hills = [(r.uniform(1.3, 2.4), r.uniform(60, 260), r.uniform(0, TURN))
                      for _ in range(3)]
        self.s, self.way, self.slope = 0., 1., 0.
        t, self.fields = 0., [(0., 0.)]
        t = r.uniform(6, 14)
        while t < end:
            self.fields.append((t, 1.))
            t += r.uniform(28, 65)
            self.fields.append((t, 0.))
            t += r.uniform(9, 16)
        self.speeds = steps(r, end, 14, 34, lambda: r.uniform(1500, 2050))
        self.ratios = steps(r, end, 25, 80, lambda: r.uniform(.85, 1.3))
        self.drafts = steps(r, end, 30, 90, lambda: r.uniform(14, 22))
        self.i = self.j = self.k = self.m = 0
        self.set, self.ratio, self.pull, self.down = 1400., .9, 18., 0.

    def pilot(self, t):
        self.i, self.j = now(self.speeds, t, self.i), now(self.ratios, t, self.j)
        self.k, m = now(self.drafts, t, self.k), now(self.fields, t, self.m)
        if m != self.m and self.fields[m][1]:
            self.way = -self.way
        self.m, self.down = m, self.fields[m][1]
        self.set += clip((self.speeds[self.i][1] if self.down else 1450.) - self.set, -40, 40)
        self.ratio += clip(self.ratios[self.j][1] - self.ratio, -.01, .01)
        self.pull += clip(self.drafts[self.k][1] - self.pull, -.5, .5)
        return self.set, self.ratio, self.pull, self.down

    def inside(self, fault, p, u):
        if fault == "creep":
            return self.slope > .3 + .9 * p[0]
        return fault != "surge" or 1560 + 220 * p[0] < self.rpm < 1750 + 220 * p[0]

    def step(self, u, w, a):
        self.hard += .012 * w[0] - .04 * self.hard
        self.wet += .005 * w[1] - .03 * self.wet
        self.haul += .02 * w[2] - .03 * self.haul
        self.sun += .01 * w[3] - .003 * self.sun
        self.air += .03 * w[4] - .003 * (self.air - self.mild)
        hill = sum(x * math.sin(TURN * self.s / y + z) for x, y, z in self.hills)
        self.slope += .15 * (self.way * hill - self.slope)
        weight = self.mass * G
        tilt = weight * (math.sin(math.radians(self.slope)))
        stiff = self.soil * (1 + self.hard) * (1 + a.get("share", 0.))
        gear = .86 + .0008 * (self.gearoil - 50)
        for _ in range(10):
            dt = self.RATE / 10
            self.real += dt * (u[1] - self.real) / 1.2
            self.vw = self.rpm / 1000 * self.real * (1 - a.get("creep", 0.) - .0006 * self.felt)
            slip = 1 - self.v / max(.2, self.vw)
            pull = self.grip * weight * (1 - math.exp(-7 * (1 - a.get("lug", 0.)) * slip)) \
                * (1 + self.wet)
            self.draft = stiff * self.depth * (.75 + .05 * self.v ** 2)
            rolls = .06 * weight + self.haul + .15 * self.v
            self.v = max(.1, self.v + dt * (pull - self.draft - rolls - tilt) / self.mass)
            self.felt += dt * (self.draft - self.felt) / .3
            if u[3]:
                self.depth += dt * clip(1.0 * (u[2] - self.felt), -6, 7)
            else:
                self.depth -= 14 * dt
            self.depth = clip(self.depth, 0, 34)
            # engine
            e = u[0] - self.rpm
            self.sum = clip(self.sum + dt * .04 * e, 0, 28)
            self.fuel += dt * (clip(self.sum + .05 * e, .8, 29) - self.fuel) / .15
            om = self.rpm * TURN / 60
            burnt = 10 * self.fuel * self.eta * (1 - a.get("injector", 0.) - a.get("surge", 0.))
            shaft = max(0., pull * self.vw) / gear + 3 + 4 * (self.rpm / 2000) ** 3
            torque = 1000 * (burnt - shaft) / om - 35 - .08 * om
            self.rpm += dt * torque / 4 * 60 / TURN
            # heat
            opens = clip((self.coolant - 78) / 14, .04, 1)
            ua = 1.05 * self.cool * (.45 + .55 * self.rpm / 2000) * (1 - a.get("radiator", 0.))
            lost_heat = ua * opens * (self.coolant - self.air - self.sun)
            self.coolant += dt * (2.6 * self.fuel - lost_heat) / 130
            lost = max(0., pull * self.vw) * (1 / gear - 1) + 1.5
            self.gearoil += dt * (lost - .12 * self.box * (self.gearoil - self.air)) / 75
            self.s += dt * self.v * self.way

    def context(self):
        return self.slope, self.air

    def sense(self):
        return (self.rpm, self.fuel, self.vw, self.v, self.draft, self.depth, self.coolant,
                self.gearoil)


class Ebike:
    """The bicycle. The crank's angle in rad, torques at the crank in N m, slope in per cent."""
    RATE, LENGTH, NOISES = .1, 3000, 3
    COLUMNS = ["t_s", "u.assist", "u.gear", "u.brake", "x.slope_pct", "x.air_degC", "s.speed_mps",
               "s.crank_rad", "s.cadence_rpm", "s.torque_Nm", "s.motor_A", "s.supply_A",
               "s.battery_V", "s.winding_degC", "s.controller_degC"]
    SIGMA = dict(slope=.15, air=.1, speed=.03, crank=.03, cadence=.8, torque=.7, motor=.25,
                 supply=.15, battery=.04, winding=.3, controller=.3)
    STEP = dict(slope=.1, air=.1, speed=.02, cadence=.5, torque=.1, motor=.1, winding=.1,
                controller=.1)
    WRAP = dict(crank=(-math.pi, math.pi))
    EXACT = ()
    AID = (0., .5, 1., 1.7, 2.5)
    METRES = (2.2, 2.7, 3.3, 4.0, 4.8, 5.6, 6.4, 7.2)
    SENSOR = {"stuck:cadence": (4, 6), "bias:controller": (2.6, 3.4)}
    PHYSICAL = {
        "magnet": (.06, .08, dict(supply=-1, speed=-1), ()),
        "tyre": (.008, .011, dict(speed=-1, cadence=-1), ()),
        "cells": (.02, .027, dict(battery=-1), ()),
        "sink": (.16, .20, dict(controller=1), ()),
        "hall": (.10, .13, dict(supply=1), ("s.cadence_rpm",)),
        "cog": (.03, .04, dict(cadence=1, crank=0, speed=-1), ("x.slope_pct",)),
    }
    RAMPS = ("tyre",)

    def __init__(self, r):
        end = self.RATE * self.LENGTH
        self.mass, self.face, self.crr = some(r, 150., .008), some(r, .85, .01), some(r, .009, .02)
        self.kt, self.ohm, self.cell = some(r, 3.), some(r, .15), some(r, .12, .01)
        self.lazy, self.mild = some(r, 1.), 15 + r.gauss(0, 4)
        self.air = self.mild
        self.winding, self.controller = self.air + r.uniform(0, 14), self.air + r.uniform(0, 8)
        self.charge = r.uniform(.5, .95)
        self.head, self.gust, self.feel = r.gauss(0, .4), r.gauss(0, .4), 0.
        self.hills = [(r.uniform(1., 2.2), r.uniform(150, 500), r.uniform(0, TURN))
                      for _ in range(3)]
        self.efforts = steps(r, end, 6, 22, lambda: r.choice([0., *[r.uniform(12, 42)] * 5]))
        self.aids = steps(r, end, 15, 50, lambda: float(r.choice([0, 1, 2, 3, 3, 4, 4])))
        self.halts = steps(r, end, 3, 5, lambda: r.uniform(.15, .5) if r.random() < .07 else 0.)
        self.i = self.j = self.k = 0
        self.v, self.cad, self.crank, self.torque, self.sensed = 0., 0., r.uniform(-3, 3), 0., 0.
        self.amp = self.draw = self.s = self.slope = self.effort = 0.
        self.volts, self.gear, self.shifted, self.brake = 38., 2, 0., 0.

    def pilot(self, t):
        self.i, self.j = now(self.efforts, t, self.i), now(self.aids, t, self.j)
        self.k = now(self.halts, t, self.k)
        self.effort = self.efforts[self.i][1] if t > 3 else 0.
        if self.v < 2.2 and t > 3:
            self.effort = max(self.effort, 26.)
        brake = self.halts[self.k][1] if self.v > 4 else 0.
        if self.v > 10.5:
            brake = max(brake, .25)
        if t <= 3:
            brake = .3
        self.brake += clip(brake - self.brake, -.1, .1)
        if self.brake > .05 and t > 3:
            self.effort = 0.
        pace = 60 * self.v / self.METRES[self.gear - 1]
        if t - self.shifted > 1.5:
            if pace > 84 and self.gear < 8:
                self.gear, self.shifted = self.gear + 1, t
            elif pace < 57 and self.gear > 1:
                self.gear, self.shifted = self.gear - 1, t
        return self.aids[self.j][1], float(self.gear), self.brake

    def inside(self, fault, p, u):
        if fault == "hall":
            return 56 + 10 * p[0] < self.cad < 69 + 10 * p[0]
        return fault != "cog" or (self.slope > .6 + .8 * p[0] and self.cad > 20)

    def step(self, u, w, a):
        self.gust += .05 * w[0] - .02 * self.gust
        self.feel += .012 * w[1] - .05 * self.feel
        self.air += .03 * w[2] - .002 * (self.air - self.mild)
        self.slope += .1 * (sum(x * math.sin(TURN * self.s / y + z) for x, y, z in self.hills)
                            - self.slope)
        metres = self.METRES[int(u[1]) - 1]
        incline = self.mass * G * self.slope / 100
        slips = 1 + a.get("cog", 0.)
        for _ in range(5):
            dt = self.RATE / 5
            pace = 60 * self.v / metres * slips
            if self.effort:
                self.cad += dt * (pace - self.cad) / .15
            else:
                self.cad -= dt * self.cad / .3
            self.crank = wrap(self.crank + dt * self.cad * TURN / 60, -math.pi, math.pi)
            push = self.effort * (1.3 - self.cad / 130) * (1 - .45 * math.cos(2 * self.crank))
            self.torque += dt * (push * (1 + self.feel) - self.torque) / .08
            self.sensed += dt * (self.torque - self.sensed) / .4
            taper = clip((9.4 - self.v) / .8, 0, 1)
            to = clip(self.AID[int(u[0])] * self.sensed / 3., 0, 20) * taper
            self.amp += dt * (to - self.amp) / .08
            motor = self.kt * (1 - a.get("magnet", 0.)) * self.amp
            omega = self.cad * TURN / 60
            ohm = self.ohm * (1 + .0039 * (self.winding - 25))
            heat = ohm * self.amp ** 2
            shaft = motor * omega
            power = shaft / .92 * (1 + a.get("hall", 0.)) + heat + 5 + .02 * self.cad
            self.draw += dt * (power / self.volts - self.draw) / .08
            self.volts = 35.5 + 3 * self.charge - (self.cell + a.get("cells", 0.)) * self.draw
            self.charge -= dt * self.draw / 36000
            drive = TURN * .96 / slips * (self.torque + motor) / metres
            wind = self.v + self.head + self.gust
            drag = (.6 * self.face * wind * abs(wind) + 320 * u[2] * math.tanh(self.v / .1)
                    + self.mass * G * (self.crr + a.get("tyre", 0.)) * math.tanh(self.v / .1))
            self.v += dt * (drive - drag - incline) / (1.03 * self.mass)
            if self.v < 0:
                self.v = 0.
            self.s += dt * self.v
            flow = .6 + .06 * self.v
            lost = heat + .08 * shaft + .15 * shaft * a.get("hall", 0.)
            self.winding += dt * (lost - .38 * flow * (self.winding - self.air)) / 60
            fets = 2 + .35 * self.amp + .03 * self.amp ** 2
            self.controller += dt * (fets - .6 * flow * self.lazy * (1 - a.get("sink", 0.))
                                     * (self.controller - self.air)) / 32

    def context(self):
        return self.slope, self.air

    def sense(self):
        return (self.v, self.crank, self.cad, self.torque, self.amp, self.draw, self.volts,
                self.winding, self.controller)


class Hovercraft:
    """The hovercraft. Heading 0 to 360, clockwise from north; wind off the bow, -180 to 180."""
    RATE, LENGTH, NOISES = .2, 3000, 7
    COLUMNS = ["t_s", "u.thrust", "u.rudder_deg", "u.fan", "x.wave_m", "s.north_m", "s.east_m",
               "s.heading_deg", "s.yawrate_dps", "s.surge_mps", "s.sway_mps", "s.bag_Pa",
               "s.fan_kW", "s.prop_kW", "s.wind_mps", "s.windangle_deg", "s.engine_degC"]
    SIGMA = dict(wave=.01, north=1., east=1., heading=.8, yawrate=.4, surge=.08, sway=.08, bag=8.,
                 fan=.12, prop=.25, wind=.25, windangle=2., engine=.3)
    STEP = dict(heading=.1, windangle=1., engine=.1, bag=1., wind=.1)
    WRAP = dict(heading=(0., 360.), windangle=(-180., 180.))
    EXACT = ("north", "east")
    SENSOR = {"drift:bag": (4.2, 5.2), "gain:yawrate": (.08, .11)}
    PHYSICAL = {
        "skirt": (.010, .014, dict(bag=-1, fan=1), ()),
        "blade": (.07, .09, dict(surge=-1), ()),
        "bearing": (.28, .36, dict(fan=1), ()),
        "core": (.035, .05, dict(engine=1), ()),
        "weed": (8., 10., dict(surge=-1), ("s.north_m", "s.east_m")),
        "vane": (.16, .21, dict(yawrate=-1), ("u.rudder_deg", "s.yawrate_dps")),
    }
    RAMPS = ("skirt",)

    def __init__(self, r):
        end = self.RATE * self.LENGTH
        self.mass, self.push, self.helm = some(r, 900.), some(r, 1800.), some(r, 1.)
        self.skirt, self.holes, self.cool = some(r, 20., .01), some(r, .23), some(r, 1.)
        self.blow, self.veer, self.gust = r.uniform(1.5, 4.5), r.uniform(-180, 180), 0.
        self.sea = self.wave = .14 + r.gauss(0, .03)
        self.air = 13 + r.gauss(0, 3)
        self.engine = self.air + r.uniform(20, 45)
        self.north, self.east, self.yaw = r.gauss(0, 100), r.gauss(0, 100), r.uniform(0, 360)
        self.v = self.s = self.rate = self.prop = 0.
        self.n, self.bag, self.aw, self.awa, self.rudder = .9, 1350., 1., 0., 0.
        self.marks = [(r.uniform(-500, 500), r.uniform(-500, 500)) for _ in range(80)]
        self.thrusts = steps(r, end, 15, 50, lambda: r.uniform(.6, .95))
        self.fans = steps(r, end, 25, 80, lambda: r.uniform(.82, 1.))
        self.i = self.j = self.m = 0
        self.thrust, self.fan, self.drag, self.eddy = 0., .9, 0., 0.
        self.kw, self.shaft, self.swell = 10., 0., 0.

    def pilot(self, t):
        self.i, self.j = now(self.thrusts, t, self.i), now(self.fans, t, self.j)
        n, e = self.marks[self.m]
        if math.hypot(n - self.north, e - self.east) < 45:
            self.m = (self.m + 1) % len(self.marks)
            n, e = self.marks[self.m]
        course = self.yaw + math.degrees(math.atan2(self.s, max(3., self.v)))
        to = math.degrees(math.atan2(e - self.east, n - self.north))
        err = wrap(to - course, -180, 180)
        want = clip(.5 * err, -22, 22)
        order = clip(1.1 * (want - self.rate) + .9 * want, -30, 30)
        level = self.thrusts[self.i][1] * (1 - .15 * min(1., abs(err) / 90)) if t > 4 else 0.
        self.thrust += clip(level - self.thrust, -.06, .06)
        self.fan += clip(self.fans[self.j][1] - self.fan, -.01, .01)
        return self.thrust, order, self.fan

    def inside(self, fault, p, u):
        if fault == "weed":
            n, e = -400 + 400 * p[0], -400 + 400 * p[1]
            return n < self.north < n + 400 and e < self.east < e + 400
        return fault != "vane" or self.rudder > 3

    def step(self, u, w, a):
        self.gust += .15 * w[0] - .05 * self.gust
        self.veer = wrap(self.veer + .15 * w[1], -180, 180)
        self.wave = max(.02, self.wave + .003 * w[2] + .02 * (self.sea - self.wave))
        self.drag += .6 * w[3] - .04 * self.drag
        self.eddy += .02 * w[4] - .05 * self.eddy
        self.air += .004 * w[5]
        self.swell += .008 * w[6] - .1 * self.swell
        blow = max(0., self.blow + self.gust)
        for _ in range(10):
            dt = self.RATE / 10
            # air cushion
            self.n += dt * (u[2] - self.n) / .8
            fan = math.sqrt(max(0., 2200 * self.n ** 2 - self.bag) / 24)
            under = self.holes * math.sqrt(max(0., self.bag - 1100))
            torn = (a.get("skirt", 0.) + .02 * self.wave * self.swell) * math.sqrt(self.bag)
            self.bag += dt * 400 * (fan - under - torn)
            gap = under / 308
            self.kw = (2200 * self.n ** 2 * fan / .62 / 1000 + 1.5 * self.n ** 3
                       + a.get("bearing", 0.) * self.n)
            # thrust, wind, water
            self.prop += dt * (u[0] - self.prop) / .7
            self.rudder += dt * (u[1] - self.rudder) / .2
            tw = math.radians(self.veer - self.yaw)
            ahead, side = blow * math.cos(tw) + self.v, blow * math.sin(tw) + self.s
            self.aw, self.awa = math.hypot(ahead, side), math.degrees(math.atan2(side, ahead))
            push = max(0., self.push * self.prop ** 2 * (1 - .012 * ahead)
                       * (1 - a.get("blade", 0.)))
            self.shaft = 28 * self.prop ** 3 * (1 - .01 * ahead)
            fast = math.hypot(self.v, self.s)
            rubs = (self.skirt + 110 * math.exp(-gap / .008) + 90 * self.wave + self.drag
                    + a.get("weed", 0.) + 120 * math.exp(-((fast - 3) / 1.2) ** 2))
            vane = math.sin(math.radians(self.rudder)) * (1 - a.get("vane", 0.)) * self.helm
            jet = .55 * push * vane
            x = push - 1.5 * self.aw * ahead - rubs * self.v - .12 * push * abs(vane)
            y = -jet - 5 * self.aw * side - 3 * rubs * self.s
            om = math.radians(self.rate)
            self.v += dt * (x / self.mass + om * self.s)
            self.s += dt * (y / self.mass - om * self.v)
            turn = 1.7 * jet - 22 * rubs * om - 1.2 * self.aw * side - 900 * om + 40 * self.eddy
            self.rate += dt * math.degrees(turn / 1300)
            self.yaw = wrap(self.yaw + dt * self.rate, 0, 360)
            c, s = math.cos(math.radians(self.yaw)), math.sin(math.radians(self.yaw))
            self.north += dt * (self.v * c - self.s * s)
            self.east += dt * (self.v * s + self.s * c)
            lost = .55 * (self.kw + self.shaft) + .5
            self.engine += dt * (lost - .24 * self.cool * (1 - a.get("core", 0.))
                                 * (self.engine - self.air)) / 26

    def context(self):
        return (self.wave,)

    def sense(self):
        return (self.north, self.east, self.yaw, self.rate, self.v, self.s, self.bag, self.kw,
                self.shaft, self.aw, self.awa, self.engine)


def measure(c, rows, q):
    """What sensors read: an offset and a scale of the run, and white noise."""
    for i, name in names(c):
        sigma = c.SIGMA[name]
        scale, offset = 1 + q.gauss(0, .002), q.gauss(0, .3) * sigma
        if name in c.EXACT or name in getattr(c, "WRAP", ()):
            scale = 1.
        for x in rows:
            x[i] = x[i] * scale + offset + sigma * q.gauss(0, 1)
    return rows


LOT = Lot("quay", {"forklift": Forklift, "tractor": Tractor, "ebike": Ebike, "hovercraft": Hovercraft}, measure)
VEHICLES, FAULTS = tuple(LOT.machines), LOT.faults
RATE, LENGTH, COLUMNS = LOT.of("RATE"), LOT.of("LENGTH"), LOT.of("COLUMNS")
run = LOT.run
