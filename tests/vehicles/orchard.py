# SPDX-License-Identifier: MIT
"""Four machines of an orchard, its packing shed and its bay, drawn by somebody who had not seen the monitor; see `run`.

sprayer     A self-propelled sprayer with a boom of 24 m in three sections drives swaths over a sloped field, with headland turns
            between. A cruise loop trims the hydrostat's lever, a rate loop the spray pump (litres a hectare), guidance the wheels;
            the tank empties. The slope is measured. A row every .1 s.
            nozzles: those of the left section are worn. filter: it clogs more and more. pump: worn, it conveys less.
            brake: it drags. steer_left: the wheels turn less to the left.
glider      A buoyancy-driven underwater glider saws between random depths through a thermocline; a pump moves oil into a bladder, a
            battery pack moves for pitch and rolls for the heading. Water is measured. A row every .5 s.
            barnacles: the hull drags. gears: the oil pump takes more current. ingress: water seeps in more and more.
            roll_right: the pack rolls less to the right. screw: the pack falls short when it is far forward.
packer      A flow wrapper: an infeed belt, a main belt that draws film over a dancer from a shrinking reel, a heated sealing bar;
            loops hold dancer and temperature. Load and room temperature are measured. A row every .1 s.
            bearing: the infeed's drum rubs more and more. element: the heater resists more. filmslip: the film slips on the belt
            at speed. drag: the main belt's bed drags under heavy load. lining: the bar loses more heat.
exo         The hip and knee of a walking exoskeleton, series elastic, on a treadmill; the wearer moves as he likes, torque commands
            follow the gait and damp the joint. Belt speed and incline are measured. A row every .05 s.
            grease: the hip's gear rubs more. extension: the knee's gear loses more when it is ordered to extend. magnet: the knee
            gives less and less torque for its current. cable: rubs in the knee when it is bent far. cell: a battery cell resists.

run(vehicle, seed, fault) -> (columns, rows, truth): nothing that is drawn for mission, parameters, disturbances and sensors depends
on the fault; sensor faults do not act on the controllers, physical ones do. Faults begin at 25 to 60 % of the run, but those with a
place are there from the first row in half of the cases. truth: None, or dict(columns: {accepted outcome: sign of measured less
nominal, or 0}, onset: seconds (with a place: first faulty row), rows: 0/1 for every row, features: names that describe the place, or
(), size: of a bias, or None, kinds: accepted kinds, or None). Sensors: white noise (SIGMA), in part a slow wander besides (RED: its
standard deviation in SIGMA, its memory in rows), rounded (STEP), an offset and a scale of the run. Sizes of sensor faults (SENSOR):
in SIGMA (bias, end of a drift, added noise), of one (gain), rows a reading is kept (stuck), seconds (lag: time constant).
"""
import math

import lot
from lot import Lot, clip, names, some, steps

G = 9.81
TURN = 2 * math.pi


def wrap(a):
    return lot.wrap(a, -math.pi, math.pi)


def now(plan, t):
    return [value for start, value in plan if start <= max(t, 0.)][-1]


def red(x, w, memory, sd):
    """The next value of a disturbance that wanders about 0: memory in rows."""
    k = math.exp(-1 / memory)
    return k * x + sd * math.sqrt(1 - k * k) * w


class Sprayer:
    """The sprayer. Angles in rad, left positive; flows in l/min, pressures in bar."""
    RATE, LENGTH, NOISES = .1, 2400, 5
    COLUMNS = ["t_s", "u.drive", "u.steer_rad", "u.pump", "u.left", "u.middle", "u.right", "x.slope_pct", "s.speed_mps",
               "s.yawrate_radps", "s.engine_rpm", "s.drive_bar", "s.flow_lpm", "s.pressure_bar", "s.filter_bar", "s.tank_l",
               "s.oil_degC"]
    SIGMA = dict(slope=.25, speed=.03, yawrate=.006, engine=5., drive=3., flow=.9, pressure=.05, filter=.05, tank=5., oil=.25)
    RED = dict(tank=(.5, 25), drive=(.3, 60))
    STEP = dict(tank=5., engine=1.)
    EXACT = ("slope",)
    SENSOR = {"bias:pressure": (3., 4.), "gain:flow": (.045, .065), "drift:drive": (5., 7.), "noise:yawrate": (1.6, 2.),
              "stuck:engine": (5, 7), "lag:speed": (.7, 1.1)}
    # fault: least and largest strength, accepted outcomes with signs, features of its place
    PHYSICAL = {
        "nozzles": (.14, .18, dict(pressure=-1, filter=-1, flow=1), ("u.left",)),
        "filter": (1.5, 1.9, dict(filter=1, pressure=-1), ()),
        "pump": (.055, .07, dict(flow=-1, pressure=-1, filter=-1), ()),
        "brake": (1700., 2300., dict(drive=1), ()),
        "steer_left": (.13, .17, dict(yawrate=-1), ("u.steer_rad", "s.yawrate_radps")),
    }
    RAMPS = ("filter",)

    def __init__(self, r):
        self.empty, self.push, self.slip, self.roll = some(r, 8600.), some(r, 150.), some(r, .0016, .01), some(r, .055, .01)
        self.base, self.convey, self.nozzle, self.mesh = some(r, 3.4), some(r, 185.), some(r, 22.2), some(r, 4.5e-5, .02)
        self.idle, self.rate = some(r, 1950., .001), r.choice((150, 180, 200, 220))
        self.liquid, self.air = r.uniform(1500, 2700), 18 + r.gauss(0, 4)
        self.oil = self.air + r.uniform(22, 34)
        self.hill, self.phase = r.uniform(2.5, 4.5), (r.uniform(0, TURN), r.uniform(35, 60))
        # swaths: length in m, speed in m/s, section that is off in a stretch, begin and end of it as shares
        self.swaths = [(r.uniform(95, 150), r.uniform(3., 4.4), r.randrange(3), r.uniform(.1, .5), r.uniform(.6, .95))
                       for _ in range(14)]
        self.side = r.choice((-1, 1))
        self.i, self.gone, self.turning, self.heading, self.off, self.y = 0, 0., 0, 0., r.gauss(0, .2), 0.
        self.v = self.rate_now = self.lever = self.displaced = self.trim = self.steer = 0.
        self.n, self.bar, self.p, self.q, self.boom, self.spin, self.sum, self.order = self.idle, 20., 1., 0., 1., .2, 0., .2
        self.soft = self.rut = self.gust = self.slosh = self.feed = 0.
        self.open = (0, 0, 0)

    def pilot(self, t):
        length, fast, cut, a, b = self.swaths[self.i % 14]
        if not self.turning and self.gone > length:
            self.turning, self.heading = 1, 0.
        if self.turning and abs(self.heading) > math.pi - .12:
            self.turning, self.gone, self.off = 0, 0., .3 * self.side
            self.heading -= self.side * math.pi
            self.side, self.i = -self.side, self.i + 1
        if t < 3:
            want, steer = 0., 0.
        elif self.turning:
            want, steer = 2.3, .28 * self.side
        else:
            want = min(fast, 2.3 + .25 * max(0., length - self.gone))
            steer = clip(-.10 * self.off - .8 * self.heading, -.25, .25)
        self.trim = clip(self.trim + .0015 * (want - self.v), -.12, .12) if want else 0.
        self.lever += clip(want / 6 + self.trim - self.lever, -.03, .02)
        share = self.gone / length
        spray = not self.turning and t > 4 and self.v > 1.5 and share > .02
        self.open = tuple(int(spray and not (k == cut and a < share < b)) for k in range(3))
        n = sum(self.open)
        if n:
            need = self.rate * self.v * n * .048
            self.sum = clip(self.sum + .0002 * (need - self.q), -.25, .25)
            self.order = clip(.10 + need / 165 + self.sum + .0012 * (need - self.q), .15, 1.)
        else:
            self.order += clip(.3 - self.order, -.05, .05)
        return (round(self.lever, 4), steer, self.order, *self.open)

    def slope(self):
        """Percent, uphill ahead positive."""
        way = 1 if self.i % 2 == 0 else -1
        return self.hill * math.sin(self.y / self.phase[1] + self.phase[0]) * way * math.cos(self.heading)

    def inside(self, fault, p, u):
        if fault == "nozzles":
            return u[3] > 0
        return fault != "steer_left" or u[1] > .01 + .01 * p[0]

    def step(self, u, w, a):
        self.soft, self.rut = red(self.soft, w[0], 50, .04), red(self.rut, w[1], 8, .004)
        self.gust, self.feed = red(self.gust, w[2], 30, 60.), red(self.feed, w[3], 100, .006)
        h, m = .02, self.empty + self.liquid
        weak = 1 - a.get("steer_left", 0.)
        for _ in range(5):
            self.displaced += h / .35 * (u[0] * 6 - self.displaced)
            bar = clip((self.displaced * self.n / self.idle - self.v) / self.slip, -250, 380)
            self.bar += h / .06 * (bar - self.bar)
            rub = (self.roll * (1 + self.soft) * m * G + self.gust + a.get("brake", 0.)) * math.tanh(self.v / .1)
            self.v += h * (self.push * self.bar - rub - m * G * self.slope() / 100 - 14 * self.v * abs(self.v)) / m
            self.steer += h / .25 * (u[1] * (weak if u[1] > 0 else 1) - self.steer)
            rate = self.v * math.tan(self.steer) / self.base * (1 - .02 * abs(self.v)) + self.rut * min(1., self.v)
            self.rate_now += h / .12 * (rate - self.rate_now)
            self.heading += h * self.rate_now
            self.off += h * self.v * math.sin(self.heading)
            self.spin += h / .35 * (u[2] - self.spin)
            mesh = self.mesh * (1 + a.get("filter", 0.))
            kn = self.nozzle * (u[3] * (1 + a.get("nozzles", 0.)) + u[4] + u[5])
            self.q = kn * math.sqrt(max(0., self.p) / (1 + mesh * kn * kn))
            self.boom = self.p - mesh * self.q * self.q
            made = self.convey * self.spin * (1 + self.feed) * self.n / self.idle * (1 - a.get("pump", 0.)) - 1.6 * self.p
            spill = 8.5 * math.sqrt(max(0., self.p)) + (30 * (self.p - 7) if self.p > 7 else 0.)
            self.p = max(.05, self.p + h * (made - spill - self.q) / 9)
            power = self.push * max(0., self.bar) * max(0., self.displaced) / 750 + .003 * made * self.p + 8
            self.n += h / .5 * (self.idle * (1 - .045 * power / 110) - self.n)
            self.gone += h * self.v
            self.y += h * self.v * math.cos(self.heading) * (1 if self.i % 2 == 0 else -1)
            self.liquid = max(50., self.liquid - h * self.q / 60)
        self.oil += self.RATE / 220 * (self.air + .9 * (power - 8) + 14 - self.oil)
        self.slosh = red(self.slosh, w[4], 20, 3.)

    def context(self):
        return (self.slope(),)

    def sense(self):
        return (self.v, self.rate_now, self.n, self.bar + 22, self.q, self.boom, self.p, self.liquid + self.slosh, self.oil)


class Glider:
    """The glider. Pitch nose up, roll and heading to the right positive; oil that is out of the hull positive, in cm3."""
    RATE, LENGTH, NOISES = .5, 2400, 5
    COLUMNS = ["t_s", "u.ballast_cc", "u.shift_mm", "u.roll_rad", "x.water_degC", "x.salinity_psu", "s.depth_m", "s.speed_mps",
               "s.pitch_rad", "s.roll_rad", "s.heading_rad", "s.ballast_cc", "s.pump_A", "s.vacuum_kPa", "s.battery_V"]
    SIGMA = dict(water=.03, salinity=.01, depth=.06, speed=.008, pitch=.006, roll=.007, heading=.012, ballast=2., pump=.05,
                 vacuum=.04, battery=.015)
    RED = dict(heading=(.4, 60), vacuum=(.3, 80))
    STEP = dict(ballast=1., vacuum=.02, depth=.02)
    EXACT, WRAP = ("pitch", "roll", "heading"), dict(heading=(-math.pi, math.pi))
    SENSOR = {"bias:pitch": (3., 4.), "gain:speed": (.08, .11), "drift:vacuum": (5., 7.), "noise:roll": (1.6, 2.),
              "lag:ballast": (1.5, 2.2)}
    PHYSICAL = {
        "barnacles": (.27, .35, dict(speed=-1, depth=0), ()),
        "gears": (.22, .30, dict(pump=1, battery=-1), ("u.ballast_cc", "s.pump_A", "s.depth_m")),
        "ingress": (.045, .06, dict(vacuum=1, depth=1, speed=0), ()),
        "roll_right": (.08, .12, dict(roll=-1, heading=0), ("u.roll_rad", "s.roll_rad")),
        "screw": (.10, .15, dict(pitch=1), ("u.shift_mm", "s.pitch_rad")),
    }
    RAMPS = ("ingress",)

    def __init__(self, r):
        self.m, self.rho0, self.cla, self.cd, self.k = 60., some(r, 1024., .00008), some(r, .5), some(r, .0125), some(r, .30)
        self.low, self.pack, self.lever, self.tilt = some(r, .36), some(r, 10.), some(r, .16), some(r, .92)
        self.trim, self.squeeze, self.flow = r.gauss(0, .003), some(r, 4.2e-6, .01), some(r, 11.)
        self.warm, self.cold, self.cline = 15.5 + r.gauss(0, .6), 10.5 + r.gauss(0, .4), r.uniform(13, 20)
        self.fresh, self.gas, self.p0 = 32.4 + r.gauss(0, .1), some(r, 12., .01), 74 + r.gauss(0, 1.)
        self.vx, self.vz, self.depth, self.pitch, self.turn = .05, -.02, r.uniform(2, 5), 0., 0.
        self.roll, self.rollv, self.heading = 0., 0., r.uniform(-3, 3)
        self.oil, self.slid, self.mode, self.amp, self.charge = 150., 0., 0, .05, r.uniform(.5, 1.)
        self.inner, self.wave, self.lift, self.sum, self.heave, self.thin, self.wet = self.warm, 0., 0., 0., 0., 0., 0.
        self.leg, self.down, self.soaked = 0, True, 0.
        end = self.RATE * self.LENGTH
        self.legs = [(r.uniform(24, 42), r.uniform(5, 10), r.uniform(150, 215), r.uniform(150, 215), r.uniform(.36, .52),
                      r.uniform(.36, .52)) for _ in range(20)]
        self.course = steps(r, end, 70, 140, lambda: r.uniform(-math.pi, math.pi))

    def water(self):
        """Temperature, salinity, density."""
        z = math.tanh((self.depth - self.cline - self.heave) / 4)
        temp = (self.warm + self.cold) / 2 - (self.warm - self.cold) / 2 * z
        salt = self.fresh + .25 * z + self.thin
        return temp, salt, self.rho0 + .77 * (salt - 32.5) - .2 * (temp - 13) + .0045 * self.depth

    def pilot(self, t):
        deep, high, a, b, steep, climb = self.legs[self.leg % 20]
        if self.down and self.depth > deep:
            self.down = False
        elif not self.down and self.depth < high:
            self.down, self.leg = True, self.leg + 1
        want, oil = (-steep, -a) if self.down else (climb, b)
        if t < 10:
            want, oil = 0., 150.
        e = want - self.pitch
        self.sum = clip(self.sum - .03 * e, -6, 6)
        shift = clip(-36 * math.tan(want) + self.sum - 6 * e, -38, 38)
        bank = clip(.9 * wrap(now(self.course, t) - self.heading), -.5, .5)
        return oil, round(shift, 1), bank if self.down else -bank

    def inside(self, fault, p, u):
        if fault == "gears":
            return self.mode > 0
        if fault == "roll_right":
            return u[2] > .03 + .05 * p[0]
        return fault != "screw" or u[1] > 9 + 2 * p[0]

    def step(self, u, w, a):
        h = .1
        self.wave, self.heave = red(self.wave, w[0], 24, .006), red(self.heave, w[1], 200, .8)
        self.thin, self.wet = red(self.thin, w[2], 300, .03), red(self.wet, w[3], 60, .012)
        out = u[0] - self.oil
        if self.mode == 0 and abs(out) > 4 or self.mode * out < 0:
            self.mode = (out > 4) - (out < -4)
        extra = a.get("ingress", 0.)
        for _ in range(5):
            if self.mode > 0:
                self.oil += h * self.flow * (1 - .004 * self.depth)
                ask = .55 + .034 * self.depth + a.get("gears", 0.)
            elif self.mode < 0:
                self.oil -= h * self.flow * 1.3
                ask = .25
            else:
                ask = .05
            if self.mode * (u[0] - self.oil) < 0:
                self.mode = 0
            self.amp += h / .25 * (ask - self.amp)
            temp, _, rho = self.water()
            goal = u[1] * (1 - a.get("screw", 0.))
            if abs(goal - self.slid) > .3:
                self.slid += clip(goal - self.slid, -2.5 * h, 2.5 * h)
            hull = self.m / self.rho0 * (1 - self.squeeze * self.depth + 4e-5 * (temp - 13)) + self.oil * 1e-6
            weight = (self.m + extra - rho * hull) * G
            v = math.hypot(self.vx, self.vz)
            path = math.atan2(self.vz, self.vx) if v > .01 else 0.
            alpha = clip(wrap(self.pitch - path), -.6, .6)
            press = .5 * rho * v * v
            self.lift = press * self.cla * .3 * math.tanh(alpha / .3)
            drag = press * (self.cd * (1 + a.get("barnacles", 0.) + self.wet) + self.k * alpha * alpha)
            c, s = math.cos(path), math.sin(path)
            self.vx += h * (-drag * c - self.lift * s * math.cos(self.roll)) / 66
            self.vz += h * (-drag * s + self.lift * c * math.cos(self.roll) - weight) / 95
            self.depth = max(.3, self.depth - h * (self.vz + self.wave))
            nose = -self.pack * (self.slid + self.trim * 1000) * .001 + self.oil * 1e-6 * 1000 * self.lever
            moment = G * (nose * math.cos(self.pitch) - self.low * math.sin(self.pitch)) - press * .1 * alpha
            self.turn += h * (moment - 7.5 * self.turn - 30 * self.turn * abs(self.turn)) / 12
            self.pitch += h * self.turn
            tilt = self.tilt * u[2] * (1 - (a.get("roll_right", 0.) if u[2] > 0 else 0.))
            self.rollv += h * (.8 * (tilt - self.roll) - 1.3 * self.rollv)
            self.roll += h * self.rollv
            self.heading = wrap(self.heading + h * (self.lift * math.sin(self.roll) / (66 * max(v, .12) * max(c, .3))))
            self.inner += h / 500 * (temp + 2 - self.inner)
            self.charge -= h * (self.amp + .12) / 3600 / 25
        self.heading = wrap(self.heading + self.RATE * .0012 * w[4])
        self.soaked = extra

    def context(self):
        return self.water()[:2]

    def sense(self):
        room = self.gas + self.oil / 1000 - self.soaked
        vacuum = self.p0 * 12 / room * (273 + self.inner) / 288
        volts = 13.6 + 1.6 * self.charge - .16 * self.amp
        return (self.depth, math.hypot(self.vx, self.vz), self.pitch, self.roll, self.heading, self.oil, self.amp, vacuum, volts)


class Packer:
    """The wrapper. Positive currents drive, negative ones brake; the dancer's way in mm, positive towards more tension."""
    RATE, LENGTH, NOISES = .1, 2400, 6
    COLUMNS = ["t_s", "u.infeed_mps", "u.belt_mps", "u.reel_radps", "u.heater", "x.load_kg", "x.room_degC", "s.infeed_mps",
               "s.iinfeed_A", "s.belt_mps", "s.ibelt_A", "s.dancer_mm", "s.tension_N", "s.ireel_A", "s.seal_degC", "s.heater_A"]
    SIGMA = dict(load=.15, room=.1, infeed=.004, iinfeed=.06, belt=.004, ibelt=.07, dancer=.5, tension=.25, ireel=.08, seal=.3,
                 heater=.03)
    RED = dict(tension=(.4, 50), ibelt=(.3, 100))
    STEP = dict(seal=.1, load=.1)
    EXACT = ("dancer",)
    SENSOR = {"bias:tension": (3., 4.), "gain:ibelt": (.07, .09), "drift:seal": (7., 9.), "noise:infeed": (1.6, 2.),
              "stuck:dancer": (5, 7)}
    PHYSICAL = {
        "bearing": (16., 20., dict(iinfeed=1), ()),
        "element": (.12, .16, dict(heater=-1, seal=-1), ()),
        "filmslip": (.009, .013, dict(dancer=-1, tension=-1), ("u.belt_mps", "s.belt_mps")),
        "drag": (10., 13., dict(ibelt=1), ("x.load_kg",)),
        "lining": (.16, .22, dict(seal=-1), ()),
    }
    RAMPS = ("bearing",)

    def __init__(self, r):
        self.rub1, self.rub2, self.mu1, self.mu2 = some(r, 30., .01), some(r, 44., .01), some(r, .25), some(r, .25)
        self.k1, self.k2, self.k3 = some(r, 40.), some(r, 42.), some(r, .8)
        self.mass, self.watts, self.loss, self.amps = some(r, 450.), some(r, 620., .003), some(r, 1.6), some(r, 2.7)
        self.spring, self.cold = some(r, .12), 21 + r.gauss(0, 2)
        self.radius = r.uniform(.16, .24)
        self.guess = self.radius * (1 + r.gauss(0, .02))
        self.v1 = self.v2 = self.a1 = self.a2 = self.spin = self.spun = self.x = self.sway = self.sum = self.u1 = self.u2 = 0.
        self.load, self.on = r.uniform(6, 12), r.uniform(6, 12)
        end = self.RATE * self.LENGTH
        self.seal = self.bar = 150 + r.gauss(0, 6)
        self.duty, self.grid, self.rough, self.mess, self.stick, self.clock = .4, 0., 0., 0., 0., 0.
        # recipes: speed of the belt, ratio of the infeed, kilograms on the infeed
        self.recipe = steps(r, end, 12, 26, lambda: (r.choice((r.uniform(.2, .4), r.uniform(.4, .6), r.uniform(.46, .6))),
                                                     r.uniform(.94, 1.06), r.choice((r.uniform(5, 11), r.uniform(12, 22)))))
        self.stops = [(t, t + r.uniform(3, 6)) for t in (r.uniform(40, 80), r.uniform(100, 140), r.uniform(160, 215))]
        self.setting = steps(r, end, 50, 90, lambda: r.uniform(142, 172))

    def pilot(self, t):
        fast, ratio, _ = now(self.recipe, t)
        if t < 4 or any(a < t < b for a, b in self.stops):
            fast = 0.
        self.u2 += clip(fast - self.u2, -.03, .02)
        self.u1 += clip(fast * ratio - self.u1, -.03, .02)
        self.sum = clip(self.sum + .0001 * self.x, -1, 1)
        reel = max(0., self.u2 / self.guess * (1 + self.sum) + .008 * self.x)
        e = now(self.setting, t) - self.seal
        self.duty = clip(self.duty + .00012 * e, .1, .8)
        return self.u1, self.u2, reel, clip(self.duty + .03 * e, 0., 1.)

    def inside(self, fault, p, u):
        if fault == "filmslip":
            return u[1] > .36 + .04 * p[0]
        return fault != "drag" or self.load > 9.5 + 1.5 * p[0] and u[1] > .05

    def step(self, u, w, a):
        want = now(self.recipe, self.clock)[2]
        self.clock += self.RATE
        self.grid, self.rough = red(self.grid, w[0], 80, .008), red(self.rough, w[1], 60, .008)
        self.mess, self.stick = red(self.mess, w[2], 6, .12), red(self.stick, w[3], 40, .15)
        self.cold += .004 * w[4]
        h = .02
        for _ in range(5):
            self.load += h * max(0., self.v1) / 1.2 * (want * (1 + self.mess) - self.load)
            self.on += h * max(0., self.v2) / 1.5 * (.8 * self.load - self.on)
            f1 = self.mu1 * G * self.load + self.rub1 * (1 + self.rough) + a.get("bearing", 0.)
            f1 = (f1 + 50 * self.v1) * math.tanh(self.v1 / .01)
            pull = max(0., 14 + self.spring * self.x + .02 * self.sway + self.stick)
            f2 = self.mu2 * G * self.on + self.rub2 * (1 + .6 * self.rough) + a.get("drag", 0.)
            f2 = (f2 + 70 * self.v2) * math.tanh(self.v2 / .01) + pull * math.tanh(self.v2 / .01)
            acc1, acc2 = (u[0] * (1 - .0003 * f1) - self.v1) / .15, (u[1] * (1 - .0001 * f2) - self.v2) / .15
            self.v1, self.v2 = self.v1 + h * acc1, self.v2 + h * acc2
            self.a1 += h / .08 * (.35 * math.tanh(self.v1 / .01) + (f1 + (30 + self.load) * acc1) / self.k1 - self.a1)
            self.a2 += h / .08 * (.45 * math.tanh(self.v2 / .01) + (f2 + (45 + self.on) * acc2) / self.k2 - self.a2)
            self.spun = (u[2] - self.spin) / .25
            self.spin += h * self.spun
            drawn = self.v2 * (1 - .0015 * pull - a.get("filmslip", 0.))
            self.sway = 500 * (drawn - self.spin * self.radius)
            self.x = clip(self.x + h * self.sway, -90, 90)
            self.radius = max(.05, self.radius - h * 6e-5 * self.spin / TURN)
            heat = self.watts * u[3] * (1 + 2 * self.grid) * (1 - a.get("element", 0.))
            take = self.loss * (1 + a.get("lining", 0.)) + .9 * max(0., self.v2)
            self.bar += h * (heat - take * (self.bar - self.cold)) / self.mass
            self.seal += h / 3 * (self.bar - self.seal)
        inertia = .02 + 90 * (self.radius ** 4 - .04 ** 4)
        torque = (.5 + .03 * self.spin) * math.tanh(self.spin / .05) + inertia * self.spun - pull * self.radius * .7
        self.i3 = torque / self.k3 + .02 * w[5]
        self.i4 = self.amps * u[3] * (1 + self.grid) * (1 - a.get("element", 0.))
        self.pull = pull

    def context(self):
        return self.load, self.cold

    def sense(self):
        return self.v1, self.a1, self.v2, self.a2, self.x, self.pull, self.i3, self.seal, self.i4


class Exo:
    """The exoskeleton. Angles positive in flexion, torques at the joint; each joint: angle, rate, motor's angle and rate, current."""
    RATE, LENGTH, NOISES = .05, 2400, 6
    COLUMNS = ["t_s", "u.hip_Nm", "u.knee_Nm", "x.belt_mps", "x.incline_pct", "s.hip_rad", "s.knee_rad", "s.hiprate_radps",
               "s.kneerate_radps", "s.hiptorque_Nm", "s.kneetorque_Nm", "s.ihip_A", "s.iknee_A", "s.foot_N", "s.kneemotor_degC",
               "s.battery_V"]
    SIGMA = dict(belt=.01, incline=.1, hip=.006, knee=.006, hiprate=.05, kneerate=.06, hiptorque=.25, kneetorque=.25, ihip=.12,
                 iknee=.12, foot=14., kneemotor=.25, battery=.03)
    RED = dict(foot=(.4, 40), hiptorque=(.3, 200))
    STEP = dict(foot=5., kneemotor=.1)
    EXACT = ("hip", "knee", "belt", "incline")
    SENSOR = {"bias:hiptorque": (3., 4.), "gain:iknee": (.12, .16), "drift:hip": (8., 11.), "noise:kneerate": (1.6, 2.),
              "stuck:battery": (5, 7), "lag:foot": (.05, .08)}
    PHYSICAL = {
        "grease": (1.9, 2.4, dict(ihip=0, hiptorque=0), ()),
        "extension": (.2, .26, dict(iknee=-1, kneetorque=1), ("u.knee_Nm", "s.kneetorque_Nm", "s.iknee_A")),
        "magnet": (.26, .32, dict(iknee=0, kneetorque=0), ()),
        "cable": (1.9, 2.5, dict(iknee=0, kneetorque=0), ("s.knee_rad",)),
        "cell": (.045, .06, dict(battery=-1), ()),
    }
    RAMPS = ("magnet",)

    def __init__(self, r):
        self.kt, self.stiff = (some(r, 3.2), some(r, 2.8)), (some(r, 320.), some(r, 280.))
        self.rub, self.slow = (some(r, 2.2, .01), some(r, 1.8, .01)), (some(r, 1.2), some(r, 1.))
        self.rotor = (some(r, .22), some(r, .18))
        self.inertia, self.limb, self.body = (2.6, .45), (r.uniform(110, 140), r.uniform(45, 60)), r.uniform(620, 880)
        self.swing, self.bend, self.stride = r.uniform(.34, .42), r.uniform(.9, 1.05), r.uniform(.54, .6)
        self.hot, self.room, self.charge, self.ohm = r.uniform(28, 36), 23 + r.gauss(0, 1.5), r.uniform(.6, 1.), some(r, .06, .01)
        self.turns = self.speed = self.incline = 0.
        self.joints = [[.1, 0., .1, 0., 0.], [.12, 0., .12, 0., 0.]]
        self.mean, self.load, self.bus, self.gain, self.torque = [0., 0.], self.body / 2, 1., 0., [0., 0.]
        self.hurry = self.size = self.lean = self.stiffer = 0.
        end = self.RATE * self.LENGTH
        self.belt = steps(r, end, 10, 20, lambda: r.uniform(.35, .9))
        self.grade = steps(r, end, 15, 30, lambda: r.choice((0., 0., r.uniform(-4, 0), r.uniform(2, 7))))
        self.help = steps(r, end, 12, 24, lambda: r.uniform(.45, 1.))
        self.tune = r.gauss(0, .03)

    def pattern(self, x):
        """Where the wearer wants hip and knee at stride x (1 is a stride), and the share of his weight on the foot."""
        p, go = x % 1., min(1., self.speed / .5)
        big = (.75 + .3 * self.speed) * (1 + self.size) * go
        hip = .16 + .02 * self.incline + self.swing * big * math.cos(TURN * (p - .92)) + .04 * big * math.cos(2 * TURN * p)
        knee = .12 + .012 * self.incline
        for at, wide, high in ((.14, .09, .26), (.73, .105, self.bend)):
            d = (p - at + .5) % 1. - .5
            knee += high * big * math.exp(-.5 * (d / wide) ** 2)
        on = .5 * (math.tanh((p + .02) / .02) - math.tanh((p - .62) / .02)) + .5 * (1 + math.tanh((p - .98) / .02))
        foot = clip(on, 0, 1) * (1 + .18 * go * math.cos(2 * TURN * (p - .14)))
        return hip, knee, foot * go + .5 * (1 - go)

    def pilot(self, t):
        self.goal = (0., 0.) if t < 3 else (now(self.belt, t), now(self.grade, t))
        want = 0. if t < 5 else now(self.help, t)
        self.gain += clip(want - self.gain, -.02, .02)
        p, go = (self.turns + self.tune) % 1., min(1., self.speed / .5)
        hip = 13 * self.gain * go * (1 + .05 * self.incline) * math.sin(TURN * (p - .62)) - .5 * self.joints[0][1]
        knee = -14 * go * math.exp(-.5 * (((p - .2 + .5) % 1. - .5) / .09) ** 2)
        knee += 11 * go * math.exp(-.5 * (((p - .62 + .5) % 1. - .5) / .07) ** 2)
        knee -= 7 * go * math.exp(-.5 * (((p - .88 + .5) % 1. - .5) / .06) ** 2)
        return round(hip, 2), round(self.gain * knee - .3 * self.joints[1][1], 2)

    def inside(self, fault, p, u):
        if fault == "extension":
            return u[1] < -1 - p[0]
        return fault != "cable" or self.joints[1][0] > .45 + .1 * p[0]

    def step(self, u, w, a):
        self.hurry, self.size = red(self.hurry, w[0], 60, .015), red(self.size, w[1], 40, .02)
        self.lean, self.stiffer = red(self.lean, w[2], 30, 1.), red(self.stiffer, w[3], 30, .8)
        self.speed += clip(self.goal[0] - self.speed, -.02, .02)
        self.incline += clip(self.goal[1] - self.incline, -.05, .05)
        h, self.mean, bus = .005, [0., 0.], 0.
        pace = (.25 + self.stride * self.speed) * min(1., self.speed / .3) * (1 + self.hurry)
        for _ in range(10):
            before, there = self.pattern(self.turns), self.pattern(self.turns + h * pace)
            self.turns += h * pace
            for k in (0, 1):
                j = self.joints[k]
                spring = self.stiff[k] * (j[2] - j[0]) + .8 * (j[3] - j[1])
                kt = self.kt[k] * (1 - (a.get("magnet", 0.) if k else 0.))
                ask = u[k] + 1.6 * (u[k] - spring) + .7 * (2.2, 1.8)[k] * math.tanh(j[3] / .2) + 1.4 * j[1]
                ask = (ask - .6 * (j[3] - j[1])) / (3.2, 2.8)[k]
                j[4] += h / .008 * (clip(ask, -14, 14) - j[4])
                dry = self.rub[k] + .05 * abs(spring) + (a.get("cable", 0.) if k else a.get("grease", 0.))
                drive = kt * j[4]
                if k and u[1] < 0 and drive < 0:
                    drive *= 1 - a.get("extension", 0.)
                j[3] += h * (drive - spring - dry * math.tanh(j[3] / .15) - self.slow[k] * j[3]) / self.rotor[k]
                j[2] += h * j[3]
                rate = (there[k] - before[k]) / h
                muscle = self.limb[k] * (there[k] - j[0]) + (14, 4)[k] * (rate - j[1]) + (self.lean, self.stiffer)[k]
                j[1] += h * (muscle + .6 * spring) / self.inertia[k]
                j[0] += h * j[1]
                self.torque[k] = spring
                self.mean[k] += j[4] / 10
                bus += (.12 * j[4] * j[4] + max(-20., kt * j[4] * j[3])) / 48 / 10
        self.hot += self.RATE * (.25 * self.mean[1] ** 2 - .07 * (self.hot - self.room - 6)) / 8
        self.bus += .5 * (1.2 + bus + .3 * self.speed - self.bus)
        self.charge -= self.RATE * self.bus / 3600 / 4
        self.load += .8 * (self.body * there[2] * (1 + .03 * w[4]) - self.load)
        self.volts = 44 + 6 * self.charge - self.bus * (self.ohm + a.get("cell", 0.)) + .005 * w[5]

    def context(self):
        return self.speed, self.incline

    def sense(self):
        (hip, hr, _, _, _), (knee, kr, _, _, _) = self.joints
        return (hip, knee, hr, kr, *self.torque, *self.mean, self.load, self.hot, self.volts)


def measure(c, rows, q):
    """What sensors read: an offset and a scale of the run, white noise and part of them a wander."""
    for i, name in names(c):
        sigma, (share, memory) = c.SIGMA[name], c.RED.get(name, (0., 1))
        scale, offset, slow = 1 + q.gauss(0, .002), q.gauss(0, .3) * sigma, q.gauss(0, share)
        if name in c.EXACT:
            scale = 1.
        for x in rows:
            slow = red(slow, q.gauss(0, 1), memory, share)
            x[i] = x[i] * scale + offset + sigma * (slow + q.gauss(0, 1))
    return rows


LOT = Lot("orchard", {"sprayer": Sprayer, "glider": Glider, "packer": Packer, "exo": Exo}, measure)
VEHICLES, FAULTS = tuple(LOT.machines), LOT.faults
RATE, LENGTH, COLUMNS = LOT.of("RATE"), LOT.of("LENGTH"), LOT.of("COLUMNS")
run = LOT.run
