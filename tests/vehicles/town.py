# SPDX-License-Identifier: MIT
"""Five machines about a town, drawn by somebody who had not seen the monitor; see `run`.

lift        A lift with a counterweight carries random loads between random floors; its controller
            orders a speed from the inverter and corrects it by the height, which integrates. The
            fan runs with the trips. Load and ambient temperature are measured. A row every .1 s.
            shoes: guide shoes rub in a stretch of the shaft. worm: the gear loses more when it
            lifts heavy loads. pads: the brake drags more and more. vent: the motor is cooled less.
mower       A robot with two driven wheels mows a sloped lawn between random points; its heading
            wraps, its battery runs down, and a governor holds the blade's speed. Slope and height
            of the grass are measured. A row every .5 s. hub: the left bearing turns harder and
            harder. moss: a box of the lawn where both wheels roll harder. dull: the blade takes
            more current. caster: it slides downhill where the ground falls to the right.
centrifuge  A basket centrifuge runs two batches, the same programme every day, open loop; liquid
            and cake add up in it, and a scraper takes the cake out. Solids of the feed and the
            oil's temperature are measured. A row every second. lump: the cake sits off centre.
            lube: the bearing heats more and more. mount: it shakes more in a band of speed.
            spill: a share of the feed is lost over the rim at much feed and speed.
dish        An aerial tracks random targets in wind; two servo drives get angles, with backlash and
            springy gears between motor and dish. The wind is measured on the dish. 50 rows a
            second. cable: the cable pulls back beyond an azimuth. panel: a loose panel catches
            head wind when the dish looks up. ballast: a counterweight is lost. magnet: the
            elevation motor gives less and less torque for its current.
kiln        A gas kiln follows the same firing curve every run; controllers trim gas, air (by the
            oxygen) and damper (top against bottom). Temperatures integrate. Ambient temperature
            and heating value are measured. A row every 2 s. nozzle: less gas for the valve. seal:
            the door draws air when hot. belt: the blower slips at high air. lining: the wall
            lets more and more heat out.

run(vehicle, seed, fault) -> (columns, rows, truth), as in vehicles.py. Nothing that is drawn for
the mission, the parameters, the disturbances and the sensors depends on the fault: a faulty run
and the healthy one of the same seed differ by the fault alone, and by what a controller makes of
it. Sensor faults do not act on the controllers. All faults begin at 25 to 60 % of the run, but
those with a place are there from the first row in half of the cases. truth: None, or dict(columns:
accepted outcomes with the sign of measured less nominal, 0 where it has none or changes with the
direction; size: of a bias, or None; onset: seconds, of a fault with a place its first faulty row;
rows: 0/1 for every row; features: names that tell its place, or (); kinds: accepted kinds, or
None). Quantised sensors: STEP. Physical faults were sized, and the noise of sensors chosen, so
that a linear model of commands and context (for sensor faults: of the other sensors, too) sees 25
to 150 nats of a fault in the known place and time, and less than 5 standard deviations in a row.
(Noise and stuck sensors are counted otherwise; their sizes are those of common.py.)
"""
import math
import random

from common import break_sensor, clip, short, wrap

G = 9.81
DEG = math.pi / 180
KINDS = {"noise": ("variance",), "stuck": ("repeat", "variance")}


class Lift:
    """The lift. Heights in m above the lowest floor, forces in N, positive upwards."""
    RATE, LENGTH, NOISES = .1, 3000, 3
    COLUMNS = ["t_s", "u.drive_mps", "u.brake", "u.fan", "x.load_kg", "x.ambient_degC",
               "s.height_m", "s.speed_mps", "s.accel_mps2", "s.torque_A", "s.power_kW",
               "s.motor_degC", "s.tension_kN"]
    SIGMA = dict(load=3., ambient=.1, height=.01, speed=.015, accel=.03, torque=1.7, power=.25,
                 motor=.4, tension=.18)
    STEP = dict(motor=.25, load=5., height=.01)
    # fault: least and largest strength, accepted outcomes with signs, features of its place
    PHYSICAL = {
        "shoes": (1.8, 2.3, dict(power=1, torque=0), ("s.height_m",)),
        "worm": (1.6, 2.1, dict(torque=1, power=1, speed=-1),
                 ("x.load_kg", "s.tension_kN", "u.drive_mps", "s.speed_mps")),
        "pads": (4.4, 5.6, dict(power=1, torque=0), ()),
        "vent": (.2, .28, dict(motor=1), ()),
    }
    RAMPS = ("pads",)
    FAULTS = ("bias:torque", "drift:tension", "noise:accel", "stuck:speed",
              "shoes", "worm", "pads", "vent")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .004))
        self.cabin, self.stiff, self.amps = few(900.), few(20000.), few(110.)
        self.rub, self.eta, self.ohms = few(260.), few(.86), few(.2)
        self.weight, self.rope = few(1240.), few(3.)
        self.cool, self.ambient = few(1.), 22 + r.gauss(0, 3)
        self.motor, self.slack, self.mains = self.ambient + 15 + r.gauss(0, 1), r.gauss(0, .02), 0.
        z = 3.2 * r.randrange(9)
        self.z, self.v, self.acc, self.force, self.drive = z, 0., 0., 0., 0.
        self.load, t, self.trips = r.uniform(0, 750), 5 + r.uniform(0, 3), []
        while t < self.RATE * self.LENGTH:
            to = 3.2 * r.choice([f for f in range(9) if abs(3.2 * f - z) > 1])
            fast = r.choice([1.6, 2.0, 2.0])
            self.trips.append((t, z, to, fast, r.uniform(0, 750)))
            t, z = t + abs(to - z) / fast + fast / .5 + 4 + r.uniform(3, 6), to
        self.trip = -1

    def plan(self, t):
        """Wanted height and speed on the trip under way, and whether the brake is released."""
        start, a, b, fast, _ = self.trips[max(0, self.trip)]
        far, s = abs(b - a), t - start
        fast = min(fast, math.sqrt(.5 * far))
        up, way = fast / .5, far / fast + fast / .5
        if s < 0 or s > way + 2:
            return (a if s < 0 else b), 0., -.5 < s < 0
        if s < up:
            x, v = .25 * s * s, .5 * s
        elif s < way - up:
            x, v = fast * (s - up / 2), fast
        else:
            left = max(0., way - s)
            x, v = far - .25 * left * left, .5 * left
        d = 1 if b > a else -1
        return a + d * x, d * v, True

    def pilot(self, t):
        if self.trip + 1 < len(self.trips) and t > self.trips[self.trip + 1][0] - 3:
            self.trip += 1
        z, v, free = self.plan(t)
        if not free:
            return 0., 0., .35
        hang = (self.load - 340) * G / 21000
        return clip(v + 1.2 * (z - self.z) + hang, -2.3, 2.3), 1., 1.

    def inside(self, fault, p):
        if fault == "shoes":
            low = 4 + 8 * p[0]
            return low < self.z < low + 8 and abs(self.v) > .05
        return fault != "worm" or (self.load > 260 + 80 * p[0] and self.drive > .2)

    def step(self, u, w, a):
        self.drive = u[0]
        self.load += .08 * (self.trips[max(0, self.trip)][4] - self.load)
        self.ambient += .004 * w[0]
        self.slack += .003 * w[1] - .005 * self.slack
        self.mains += .002 * w[2] - .02 * self.mains
        mass = self.cabin + self.load + self.weight + 420
        for _ in range(5):
            if not u[1]:
                self.v = self.acc = self.force = 0.
                break
            lean = (self.cabin + self.load - self.weight) * G + self.rope * G * (self.z - 12.8)
            rub = self.rub * (1 + self.slack + a.get("shoes", 0.) + a.get("pads", 0.))
            rub = rub * math.tanh(self.v / .05) + 50 * self.v + 14 * self.v * abs(self.v)
            rub += 500 * a.get("worm", 0.) * math.tanh(max(0., self.v) / .2)
            pull = clip(self.stiff * (1 + self.mains) * (u[0] - self.v), -12000, 12000)
            self.force += .02 / .08 * (pull - self.force)
            self.acc = (self.force - lean - rub) / mass
            self.v += .02 * self.acc
            self.z += .02 * self.v
        amp = self.force / self.amps
        lost = self.ohms * amp * amp + 300 * u[1] + 350
        vent = self.cool * (20 + 45 * u[2]) * (1 - a.get("vent", 0.))
        self.motor += self.RATE * (lost - vent * (self.motor - self.ambient)) / 3500

    def context(self):
        return self.load, self.ambient

    def sense(self):
        amp, work = self.force / self.amps, self.force * self.v
        power = .35 + (work / self.eta if work > 0 else work * self.eta) / 1000 + .0006 * amp * amp
        rope = (self.cabin + self.load) * (G + self.acc) / 1000
        return self.z, self.v, self.acc, amp, power, self.motor, rope


class Mower:
    """The mower. A lawn of 30 m by 24 m; wheel speeds in rad/s, grass in mm."""
    RATE, LENGTH, NOISES = .5, 2400, 6
    COLUMNS = ["t_s", "u.left", "u.right", "u.blade", "x.pitch_rad", "x.roll_rad", "x.grass_mm",
               "s.north_m", "s.east_m", "s.heading_rad", "s.yawrate_radps", "s.left_radps",
               "s.right_radps", "s.ileft_A", "s.iright_A", "s.blade_rpm", "s.cut_A",
               "s.battery_V"]
    SIGMA = dict(pitch=.003, roll=.003, grass=.6, north=.03, east=.03, heading=.012, yawrate=.008,
                 left=.03, right=.03, ileft=.02, iright=.02, blade=12., cut=.04, battery=.02)
    STEP = dict(blade=10., battery=.02, grass=1.)
    PHYSICAL = {
        "hub": (.95, 1.3, dict(ileft=1), ()),
        "moss": (.19, .26, dict(ileft=1, iright=1), ("s.north_m", "s.east_m")),
        "dull": (.29, .37, dict(cut=1), ()),
        "caster": (.02, .03, dict(yawrate=-1, heading=0), ("x.roll_rad",)),
    }
    RAMPS = ("hub",)
    FAULTS = ("bias:yawrate", "gain:cut", "noise:battery", "stuck:iright",
              "hub", "moss", "dull", "caster")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .004))
        self.mass, self.radius, self.track = few(14.), few(.12), few(.40)
        self.kt, self.ke, self.ohms, self.roll_on = few(3.6), few(4.), few(1.6), few(.11)
        self.scrub, self.fan, self.cutting = few(.5), few(.075), few(.0125)
        self.x, self.y, self.heading = r.uniform(3, 27), r.uniform(3, 21), r.uniform(-3, 3)
        self.wl = self.wr = self.v = self.rate = self.il = self.ir = 0.
        self.blade, self.cut, self.charge = 0., 0., r.uniform(.7, 1.)
        self.tall, self.damp, self.drag, self.pull = r.gauss(0, 3), r.gauss(0, .02), 0., 0.
        self.phase = r.uniform(0, 6.28), r.uniform(0, 6.28)
        self.to = [(r.uniform(2, 28), r.uniform(2, 22), r.uniform(.6, .95)) for _ in range(80)]
        self.leg = 0

    def ground(self):
        """Pitch (nose up) and roll (right side down) of the ground, height of the grass."""
        x, y = self.x, self.y
        gx = .08 * math.cos(.35 * x + .15 * y) + .03 * math.sin(.6 * y)
        gy = .07 * math.sin(.4 * y - .2 * x) + .03 * math.cos(.5 * x + 1)
        c, s = math.cos(self.heading), math.sin(self.heading)
        grass = 42 + self.tall + 7 * math.sin(.3 * x + self.phase[0])
        return gx * c + gy * s, gx * s - gy * c, grass + 6 * math.sin(.35 * y + self.phase[1])

    def pilot(self, t):
        x, y, fast = self.to[self.leg]
        if math.hypot(x - self.x, y - self.y) < .6:
            self.leg = (self.leg + 1) % len(self.to)
        blade = clip(.70 + (2800 - self.blade) / 4000, .2, 1.) if t > 3 else 0.
        if t < 8:
            return 0., 0., blade
        e = wrap(math.atan2(y - self.y, x - self.x) - self.heading)
        ahead, turn = fast * max(.2, 1 - .9 * abs(e)), clip(.35 * e, -.25, .25)
        return clip(ahead - turn, -.3, 1.), clip(ahead + turn, -.3, 1.), blade

    def inside(self, fault, p):
        if fault == "moss":
            x, y = 5 + 8 * p[0], 4 + 6 * p[1]
            return x < self.x < x + 10 + 2 * p[2] and y < self.y < y + 8 + 2 * p[3]
        return fault != "caster" or self.ground()[1] > .01 + .02 * p[0]

    def step(self, u, w, a):
        dt = self.RATE
        pitch, roll, grass = self.ground()
        self.tall += .05 * w[0] - .001 * self.tall
        self.damp += .002 * w[1] - .005 * self.damp
        self.drag += .01 * w[2] - .05 * self.drag
        self.pull += .0012 * w[3] - .05 * self.pull
        volts = 24 + 2.5 * self.charge - .06 * (self.il + self.ir + self.cut)
        soft = self.roll_on * (1 + .008 * (grass - 42) + self.damp + a.get("moss", 0.))
        push = self.mass * G * self.radius / 2
        turn = self.scrub * math.tanh(1.5 * (self.wr - self.wl)) + .15 * (self.wr - self.wl)
        want = []
        for side, wheel, order in ((-1, self.wl, u[0]), (1, self.wr, u[1])):
            rub = .25 * (a.get("hub", 0.) if side < 0 else 0.)
            load = push * (1 + 1.2 * side * roll) * (soft * math.tanh(3 * wheel) + math.sin(pitch))
            load += rub * math.tanh(3 * wheel) + side * turn
            free = order * volts / self.ke
            was, now = wheel, wheel + .7 * (free - load * self.ohms / self.ke / self.kt - wheel)
            want.append((now, .12 * math.tanh(3 * wheel) + (load + .1 * (now - was)) / self.kt))
        (self.wl, self.il), (self.wr, self.ir) = want
        slip = .03 + .25 * pitch
        self.v = self.radius * (self.wl + self.wr) / 2 * (1 - slip)
        slide = .25 * roll * self.v + self.pull + a.get("caster", 0.) * math.tanh(5 * self.v)
        want = .85 * self.radius * (self.wr - self.wl) / self.track - slide
        self.rate += .75 * (want - self.rate) + .001 * w[4]
        self.heading = wrap(self.heading + dt * self.rate)
        self.x += dt * self.v * math.cos(self.heading)
        self.y += dt * self.v * math.sin(self.heading)
        n = self.blade / 1000
        eat = self.cutting * grass * (.35 + .9 * max(0., self.v)) * min(1., n) * (
            1 + self.drag + a.get("dull", 0.))
        self.cut = .2 + self.fan * n * n + eat + .005 * w[5]
        self.blade += .4 * (4200 * u[2] * volts / 25 - 120 * self.cut - self.blade)
        self.charge -= dt * (.6 + abs(self.il) + abs(self.ir) + self.cut) / 3600 / 4

    def context(self):
        return self.ground()

    def sense(self):
        volts = 24 + 2.5 * self.charge - .06 * (self.il + self.ir + self.cut)
        return (self.x, self.y, self.heading, self.rate, self.wl, self.wr, self.il, self.ir,
                self.blade, self.cut, volts)


class Centrifuge:
    """The centrifuge. Two batches; flows in l/min, masses in kg."""
    RATE, LENGTH, NOISES = 1., 1200, 4
    COLUMNS = ["t_s", "u.drive_rpm", "u.feed", "u.oil", "x.solids_pct", "x.oil_degC",
               "s.speed_rpm", "s.current_A", "s.vibration_mmps", "s.bearing_degC",
               "s.filtrate_lpm"]
    SIGMA = dict(solids=.1, oil=.2, speed=3., current=.8, vibration=.2, bearing=1.8, filtrate=.8)
    STEP = dict(speed=1., bearing=.5)
    PHYSICAL = {
        "lump": (.44, .56, dict(vibration=1), ()),
        "lube": (.14, .20, dict(bearing=1), ()),
        "mount": (.36, .48, dict(vibration=1), ("u.drive_rpm", "s.speed_rpm")),
        "spill": (.07, .105, dict(filtrate=-1), ("u.feed", "s.speed_rpm", "u.drive_rpm")),
    }
    RAMPS = ("lube",)
    FAULTS = ("bias:filtrate", "gain:current", "drift:bearing", "noise:vibration",
              "lump", "lube", "mount", "spill")
    # second, wanted speed; second, feed valve
    SPIN = ((0, 0), (15, 0), (75, 900), (230, 900), (290, 1750), (420, 1750), (500, 160),
            (600, 160), (660, 1050), (820, 1050), (890, 1900), (1030, 1900), (1120, 160),
            (1300, 160))
    FEED = ((0, 0), (80, .45), (130, .75), (180, .6), (225, 0), (665, .7), (720, .5), (770, .8),
            (815, 0), (9999, 0))

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .006))
        self.inertia, self.wind, self.top = few(1.), few(6.), few(70.)
        self.wobble, self.peak, self.heat = few(.8), few(620.), few(1.)
        self.drain, self.slip, self.oil = few(.05), few(.3), 30 + r.gauss(0, 2)
        self.n, self.amp, self.cake, self.wet, self.flow = 0., 0., r.uniform(2, 5), 0., 0.
        self.temp, self.solids, self.skew = self.oil + r.uniform(0, 5), 12 + r.gauss(0, 1), 0.
        self.head, self.order = r.gauss(0, .01), (0., 0., 0.)
        self.spin = [(t and t + r.gauss(0, 1.5), n * (1 + r.gauss(0, .004))) for t, n in self.SPIN]
        self.feeds = [(t and t + r.gauss(0, 1.5), f * (1 + r.gauss(0, .01))) for t, f in self.FEED]

    def pilot(self, t):
        i = max(i for i in range(len(self.spin) - 1) if self.spin[i][0] <= t)
        (a, x), (b, y) = self.spin[i:i + 2]
        feed = [f for s, f in self.feeds if s <= t][-1]
        self.order = x + (y - x) * (t - a) / (b - a), feed, .4 if t < 250 or 560 < t < 850 else .8
        return self.order

    def inside(self, fault, p):
        if fault == "mount":
            low = 1400 + 200 * p[0]
            return low < self.n < low + 520
        return fault != "spill" or (self.order[1] > .5 and self.n > 700 + 150 * p[0])

    def step(self, u, w, a):
        self.solids += .02 * w[0]
        self.oil += .02 * w[1]
        self.head += .001 * w[2] - .02 * self.head
        self.skew += .03 * w[3] - .05 * self.skew
        kilo, was = self.n / 1000, self.n
        fed = self.top * u[1] * (1 + self.head)
        mass = 1 + (self.cake + self.wet) / 120
        drag = self.wind * kilo * kilo + 2.5 * math.tanh(kilo / .05) + .10 * fed * kilo
        drag *= 1 + .003 * (60 - self.temp)
        self.n += .35 * (u[0] - self.slip * drag - self.n)
        push = .5 * self.inertia * mass * (self.n - was) + drag
        self.amp += .6 * (5 + .8 * push - self.amp)
        self.flow = self.wet * self.drain * kilo ** 1.2 / (1 + .006 * self.cake)
        lost = a.get("spill", 0.)
        self.wet = max(0., self.wet + fed / 60 * (1 - self.solids / 100) * (1 - lost) - self.flow)
        self.cake += fed / 60 * self.solids / 100 * (1 - lost)
        if u[0] < 300 and self.cake > 3:
            self.cake -= .012 * self.cake
        heat = self.heat * (1.3 * kilo ** 1.5 + .25 * kilo) * (1 + a.get("lube", 0.))
        self.temp += .012 * (30 * heat - (.5 + u[2]) * (self.temp - self.oil))
        x = self.n / self.peak
        ring = .5 * x * x / math.sqrt((1 - x * x) ** 2 + .3 * x * x)
        self.shake = self.wobble * kilo * kilo * (1 + .012 * self.cake + self.skew
                                                  + a.get("lump", 0.) + a.get("mount", 0.)) + ring

    def context(self):
        return self.solids, self.oil

    def sense(self):
        return self.n, self.amp, .3 + self.shake, self.temp, self.flow * 60


class Dish:
    """The dish. Angles in degrees, torques as the current that gives them; 50 rows a second."""
    RATE, LENGTH, NOISES = .02, 2500, 4
    COLUMNS = ["t_s", "u.az_deg", "u.el_deg", "x.front_mps", "x.side_mps", "s.az_deg", "s.el_deg",
               "s.azmotor_dps", "s.elmotor_dps", "s.azrate_dps", "s.elrate_dps", "s.iaz_A",
               "s.iel_A"]
    SIGMA = dict(front=.2, side=.2, az=.02, el=.02, azmotor=.08, elmotor=.08, azrate=.12,
                 elrate=.12, iaz=.25, iel=.25)
    STEP = dict(az=.01, el=.01, iaz=.05, iel=.05)
    PHYSICAL = {
        "cable": (.75, 1.05, dict(iaz=1), ("s.az_deg", "u.az_deg")),
        "panel": (.65, .85, dict(iel=1), ("x.front_mps", "s.el_deg", "u.el_deg")),
        "ballast": (.48, .58, dict(iel=1), ()),
        "magnet": (.52, .58, dict(iel=1), ()),
    }
    RAMPS = ("magnet",)
    FAULTS = ("bias:elrate", "gain:azmotor", "drift:iaz", "stuck:azrate",
              "cable", "panel", "ballast", "magnet")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .004))
        self.kt, self.hold = few(1.), few(1.)
        self.inertia, self.stiff, self.moment, self.rub = few(.035), few(18.), few(2.4), few(.12)
        self.sail, self.lift = few(.005), few(.005)
        # each axis: angle, rate of motor; of dish; wanted angle; sum; current; wanted rate; trim
        first = r.uniform(-100, 100), r.uniform(25, 60)
        self.axes = [[x, 0., x, 0., x, 0., 0., 0., 0.] for x in first]
        self.wind = 7 + r.gauss(0, 1.5), r.uniform(-70, 70)
        self.gust, self.veer, self.warm = 0., 0., 0.
        self.front = self.side = 0.
        t, self.plan = 1., []
        while t < self.RATE * self.LENGTH:
            t += r.uniform(3, 6)
            az = r.uniform(30, 140) if len(self.plan) % 2 else r.uniform(-140, 60)
            self.plan.append((t, az, r.uniform(15, 80), r.uniform(-2, 2), r.uniform(-1, 1)))

    def pilot(self, t):
        """Slews to a target, which moves on slowly, at 14 degrees a second or less."""
        i = max([0] + [i for i, x in enumerate(self.plan) if x[0] <= t])
        start, az, el, raz, rel = self.plan[i]
        out = []
        for k, (to, rate) in enumerate(((az, raz), (el, rel))):
            x = self.axes[k]
            to = to + rate * (t - start) if t > start else x[4]
            e = to - x[4]
            v = math.copysign(min(1.5 * abs(e), math.sqrt(10 * abs(e)), 14 - 5 * k), e)
            v = x[7] = x[7] + clip(v - x[7], -.14, .14)
            x[4] += self.RATE * v
            x[8] = clip(x[8] + self.RATE * .5 * (x[4] - x[2]), -1, 1)
            out.append(x[4] + x[8])
        return out

    def inside(self, fault, p):
        if fault == "cable":
            return self.axes[0][2] > -20 + 40 * p[0]
        el = self.axes[1][2]
        return fault != "panel" or (self.front > -1 + 2 * p[0] and el > 25 + 12 * p[1])

    def step(self, u, w, a):
        self.gust += .02 * w[0] - .006 * self.gust
        self.veer += .2 * w[1] - .003 * self.veer
        self.warm = self.warm + .002 * w[2] - .004 * self.warm
        speed, way = max(.5, self.wind[0] + self.gust), (self.wind[1] + self.veer
                                                        - self.axes[0][2]) * DEG
        self.front, self.side = speed * math.cos(way), speed * math.sin(way)
        el = self.axes[1][2] * DEG
        load = (self.sail * self.side * speed * math.cos(el) - a.get("cable", 0.),
                self.lift * self.front * speed * math.sin(el)
                - self.moment * math.cos(el) * (1 + a.get("ballast", 0.)) - a.get("panel", 0.))
        for k, x in enumerate(self.axes):
            kt = self.kt * (1 - a.get("magnet", 0.) * k)
            for _ in range(4):
                x[5] = clip(x[5] + .005 * 2 * (u[k] - x[0]), -6, 6)
                ask = self.hold * (2.5 * (u[k] - x[0]) + x[7] - x[1]) + x[5]
                x[6] = clip(ask, -9, 9)
                gap = x[0] - x[2]
                gap = gap - .015 if gap > .015 else gap + .015 if gap < -.015 else 0.
                twist = self.stiff * gap + .25 * (x[1] - x[3])
                rub = self.rub * (1 + self.warm) * math.tanh(x[1] / .5) + .02 * x[1]
                x[1] += .005 * (kt * x[6] - twist - rub) / self.inertia
                x[3] += .005 * (twist + load[k]) / self.inertia
                x[0] += .005 * x[1]
                x[2] += .005 * x[3]

    def context(self):
        return self.front, self.side

    def sense(self):
        a, e = self.axes
        return a[2], e[2], a[1], e[1], a[3], e[3], a[6], e[6]


class Kiln:
    """The kiln. Temperatures in deg C, flows in l/s of gas and of air; a row every 2 s."""
    RATE, LENGTH, NOISES = 2., 1800, 4
    COLUMNS = ["t_s", "u.gas", "u.air", "u.damper", "x.ambient_degC", "x.heating_MJpm3",
               "s.top_degC", "s.bottom_degC", "s.wall_degC", "s.stack_degC", "s.oxygen_pct",
               "s.gas_lps"]
    SIGMA = dict(ambient=.2, heating=.05, top=2., bottom=2., wall=1.4, stack=3., oxygen=.45,
                 gas=.065)
    STEP = dict(top=1., bottom=1., wall=.5, oxygen=.1)
    PHYSICAL = {
        "nozzle": (.066, .086, dict(gas=-1, oxygen=1), ()),
        "seal": (.045, .065, dict(oxygen=1), ("s.top_degC", "s.bottom_degC", "s.stack_degC")),
        "belt": (.07, .10, dict(oxygen=-1), ("u.air", "u.gas", "s.gas_lps")),
        "lining": (.10, .13, dict(wall=1), ()),
    }
    RAMPS = ("lining",)
    FAULTS = ("bias:oxygen", "gain:gas", "drift:wall", "noise:stack",
              "nozzle", "seal", "belt", "lining")
    PLAN = ((0, 160), (300, 260), (1100, 720), (1450, 740), (2100, 1020), (2700, 1040),
            (3100, 880), (3500, 780), (9999, 780))

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .003))
        self.k_gas, self.k_air, self.mass, self.leak = few(6.), few(90.), few(60.), few(.045)
        self.shell, self.give, self.skin, self.air_in = few(1.), few(.055), few(.04), few(1.)
        self.ambient, self.heating = 18 + r.gauss(0, 3), 36 + r.gauss(0, .4)
        self.top, self.bottom = 160 + r.gauss(0, 12), 150 + r.gauss(0, 12)
        self.wall, self.stack = 40 + r.gauss(0, 4), 150 + r.gauss(0, 10)
        self.mains, self.wind, self.q, self.oxygen = r.gauss(0, .005), 0., 0., 20.9
        self.sum, self.trim, self.tilt, self.blow = .1, 0., 0., 0.
        self.plan = [(t and t + r.gauss(0, 15), x + r.gauss(0, 4)) for t, x in self.PLAN]

    def pilot(self, t):
        i = max(i for i in range(len(self.plan) - 1) if self.plan[i][0] <= t)
        (a, x), (b, y) = self.plan[i:i + 2]
        want, slope = x + (y - x) * (t - a) / (b - a), (y - x) / (b - a)
        e = want - (self.top + self.bottom) / 2
        self.sum = clip(self.sum + .00002 * e, 0., .5)
        gas = clip(self.sum + .006 * e + .00042 * want + .45 * slope, .08, 1.)
        self.trim = clip(self.trim + .0006 * (5 - self.oxygen), -.15, .15)
        air = clip(.04 + .80 * gas + self.trim + .01 * (5 - self.oxygen), .12, 1.)
        self.tilt = clip(self.tilt + .0002 * (self.top - self.bottom), -.3, .3)
        return gas, air, clip(.5 + self.tilt + .004 * (self.top - self.bottom), 0., 1.)

    def inside(self, fault, p):
        if fault == "seal":
            return self.top > 640 + 120 * p[0]
        return fault != "belt" or self.blow > .52 + .06 * p[0]

    def step(self, u, w, a):
        dt = self.RATE
        self.ambient += .02 * w[0]
        self.heating += .004 * w[1]
        self.mains += .0006 * w[2] - .01 * self.mains
        self.wind += .004 * w[3] - .02 * self.wind
        self.blow = u[1]
        want = self.k_gas * u[0] ** 1.15 * (1 + self.mains) * (1 - a.get("nozzle", 0.))
        self.q += .5 * (want - self.q)
        mean = (self.top + self.bottom) / 2
        draw = math.sqrt(max(0., mean - self.ambient) / 800)
        air = self.k_air * u[1] * (1 - a.get("belt", 0.)) * (1 - .06 * u[1])
        air += 2.5 * draw * (self.air_in + self.wind) + 40 * draw * a.get("seal", 0.)
        need = .265 * self.heating * self.q
        over = max(1.02, air / need)
        self.oxygen += .2 * (20.9 * (over - 1) / (over - .1) - self.oxygen)
        heat = self.q * self.heating * .97
        flow = (air + self.q) * .0013
        hot = mean + (heat - flow * (mean - self.ambient)) / (.11 + flow)
        split = .5 + .25 * (u[2] - .5)
        into = .11 * (hot - mean)
        loss = self.leak * self.shell * (1 + a.get("lining", 0.))
        mix = .06 * (self.top - self.bottom)
        half = self.mass / 2
        for name, share, sign in (("top", 1 - split, -1), ("bottom", split, 1)):
            x = getattr(self, name)
            out = loss * (x - self.wall) / 2
            setattr(self, name, x + dt * (share * into - out + sign * mix) / half)
        self.wall += dt * (loss * (mean - self.wall) - .55 * (self.wall - self.ambient)) / 90
        self.stack += .08 * (.25 * hot + .70 * mean + .05 * self.ambient - self.stack)

    def context(self):
        return self.ambient, self.heating

    def sense(self):
        return self.top, self.bottom, self.wall, self.stack, self.oxygen, self.q


CLASS = {"lift": Lift, "mower": Mower, "centrifuge": Centrifuge, "dish": Dish, "kiln": Kiln}
VEHICLES = tuple(CLASS)
FAULTS = {v: c.FAULTS for v, c in CLASS.items()}
RATE = {v: c.RATE for v, c in CLASS.items()}
LENGTH = {v: c.LENGTH for v, c in CLASS.items()}
COLUMNS = {v: c.COLUMNS for v, c in CLASS.items()}


def simulate(vehicle, seed, fault, strength, began, p):
    """Rows of what perfect sensors would read, and whether the physical fault acts in them."""
    c = CLASS[vehicle]
    machine = c(random.Random("town machine %s %d" % (vehicle, seed)))
    air, end = random.Random("town air %s %d" % (vehicle, seed)), c.LENGTH * c.RATE
    rows, acts = [], []
    for k in range(c.LENGTH):
        t, a = k * c.RATE, {}
        u = machine.pilot(t)
        if fault and t >= began and machine.inside(fault, p):
            a[fault] = strength * ((t - began) / (end - began) if fault in c.RAMPS else 1)
        machine.step(u, [air.gauss(0, 1) for _ in range(c.NOISES)], a)
        rows.append([*u, *machine.context(), *machine.sense()])
        acts.append(int(bool(a)))
    return rows, acts


def measure(vehicle, seed, rows):
    """What real sensors read: each run has its own offset and scale; white noise."""
    c, q = CLASS[vehicle], random.Random("town sensors %s %d" % (vehicle, seed))
    out = [list(x) for x in rows]
    for i, name in enumerate(c.COLUMNS[1:]):
        sigma = c.SIGMA.get(short(name)) if name[0] in "sx" else None
        if sigma is None:
            continue
        scale, offset = 1 + q.gauss(0, .002), q.gauss(0, .3) * sigma
        if short(name) == "heading":
            scale = 1.
        for x in out:
            x[i] = x[i] * scale + offset + q.gauss(0, sigma)
    return out


def finish(c, rows):
    """Quantises, wraps the heading and puts the time in front."""
    for i, name in enumerate(c.COLUMNS[1:]):
        step = c.STEP.get(short(name)) if name[0] in "sx" else None
        for x in rows:
            if step:
                x[i] = round(round(x[i] / step) * step, 6)
            if short(name) == "heading":
                x[i] = wrap(x[i])
    return [[round(k * c.RATE, 6)] + x for k, x in enumerate(rows)]


def run(vehicle, seed, fault=None):
    """(columns, rows, truth) of one run; truth is None in a healthy one."""
    c = CLASS[vehicle]
    q = random.Random("town fault %s %s %d" % (vehicle, fault, seed))
    onset, early = q.uniform(.25, .6) * c.LENGTH * c.RATE, q.random() < .5
    p, size = [q.random() for _ in range(4)], q.random()
    sensor = lambda name: next(x for x in c.COLUMNS if x[0] == "s" and short(x) == name)
    truth = None
    if fault in c.PHYSICAL:
        low, high, columns, features = c.PHYSICAL[fault]
        began = 0. if features and early else onset
        true, acts = simulate(vehicle, seed, fault, low + (high - low) * size, began, p)
        first = acts.index(1) * c.RATE if any(acts) else began
        truth = dict(columns={sensor(a): s for a, s in columns.items()}, onset=first, rows=acts,
                     features=features, size=None, kinds=None)
    else:
        true, _ = simulate(vehicle, seed, None, 0., 0., p)
    rows = measure(vehicle, seed, true)
    if fault and not truth:
        what, _, name = fault.partition(":")
        hit, start = c.COLUMNS.index(sensor(name)) - 1, int(math.ceil(onset / c.RATE))
        size = break_sensor(what, hit, rows, true, c.SIGMA[name], start, q)
        signed = what in ("bias", "drift") or what == "gain" and min(x[hit] for x in true) >= 0
        truth = dict(columns={sensor(name): (1 if size > 0 else -1) if signed else 0}, onset=onset,
                     rows=[int(k >= start) for k in range(c.LENGTH)], features=(),
                     size=size if what == "bias" else None, kinds=KINDS.get(what))
    return list(c.COLUMNS), finish(c, rows), truth
