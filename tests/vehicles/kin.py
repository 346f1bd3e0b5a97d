# SPDX-License-Identifier: MIT
"""Four vehicles drawn by somebody who had not seen the monitor; `grade.py --module` reads them.

plane   A fixed-wing drone of 5 kg flies between random waypoints of a field at random heights, in
        a wind that turns slowly. The autopilot asks for throttle, bank and climb angle, so it
        answers a loss of thrust or more drag with throttle, and a lazy aileron with more bank. It
        starts in level flight. propeller: a chipped blade pushes less. motor: a winding draws
        more current. ice: drag in a band of height. aileron: left banks fall short.
works   A waterworks: a river fills a basin through a gate, a pump lifts the water through a
        filter that clogs into a clear-water tank, where chlorine is dosed; a second pump fills
        the tower that the town drinks from. Three levels integrate. The plan is the same every
        day, with jitter. The inflow and the demand of the town are measured. leak: the main loses
        water between the meter and the tower, so that delivery less demand no longer gives the
        level. impeller: the lift pump wears. suction: it draws air where the basin is low and the
        flow high.
truck   An electric truck of 16 t on a random road over hills. A cruise control holds random
        speeds with the motor and with a hydraulic retarder; it hides every fault of the drive
        from the speed and shows it in what it asks for. The slope and the ambient temperature are
        measured. tyre: soft tyres roll worse. fan: the motor is cooled less. hill: the motor
        gives less torque for its current when it pulls hard uphill. fluid: the retarder, when
        used, holds and heats less.
scout   A six-wheeled rover with skid steering drives between random points of a sandy yard, the
        same yard in every run. It slips uphill, and its wheels scrub when it turns. bearing: the
        left wheels turn harder. sand: a soft box of the yard, where wheels slip and pull more
        current. crumble: more slip uphill.

run(vehicle, seed, fault) -> (columns, rows, truth), as in vehicles.py. What is drawn for the
mission, the parameters, the disturbances and the sensors does not depend on the fault: a faulty
run and the healthy run of the same seed differ by the fault alone (and by what an autopilot makes
of it). truth: None, or dict(columns: accepted outcomes, with the sign of measured less nominal, 0
where it has none; size: of a bias, or None; onset: seconds, 0 for a region, which is there from
the start; rows: 0/1 for every row; features: names that describe the region, or (); kinds:
accepted kinds, or None). Sensor faults do not act on the control loop.

The accepted outcomes of a physical fault are those it acts on, checked against a healthy twin
with the same commands and disturbances, once free and once with the integrating states as
measured: each shifts in the sign given, and no other shows a third of the strongest one's
evidence. (Where a drone would be by dead reckoning does not count. The leak shows in the free
twin only: water adds up.)
"""
import math

from drawn import Drawn, clip, wrap

G = 9.81


class Plane:
    """The drone. Speeds in m/s, angles in rad, heights in m above the field."""
    RATE, LENGTH, NOISES = .2, 2500, 5
    COLUMNS = ["t_s", "u.throttle", "u.bank_rad", "u.climb_rad", "s.north_m", "s.east_m",
               "s.altitude_m", "s.airspeed_mps", "s.climb_mps", "s.bank_rad", "s.heading_rad",
               "s.yawrate_radps", "s.motor_rpm", "s.current_A", "s.battery_V"]
    SIGMA = dict(north=1.0, east=1.0, altitude=.5, airspeed=.3, climb=.15, bank=.015, heading=.02,
                 yawrate=.012, motor=30., current=.25, battery=.04)
    TYPICAL = dict(current=9.5)  # root mean square of healthy runs, for a gain
    # fault: least and largest strength, accepted outcomes with signs, features of the region
    PHYSICAL = {
        "propeller": (.05, .07, dict(airspeed=-1), ()),
        "motor": (.06, .08, dict(current=1), ()),
        "ice": (.07, .10, dict(airspeed=-1), ("s.altitude_m",)),
        "aileron": (.07, .10, dict(bank=1, yawrate=1), ("u.bank_rad", "s.bank_rad",
                                                        "s.yawrate_radps")),
    }
    FAULTS = ("bias:airspeed", "drift:climb", "gain:current", "noise:yawrate",
              "propeller", "motor", "ice", "aileron")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .003))
        self.thrust, self.drag, self.lift = few(.35), few(.0093), few(648.)
        self.turn, self.amps, self.mass = few(1.0), few(1.3), few(5.0)
        self.north, self.east, self.height = r.uniform(-300, 300), r.uniform(-300, 300), 100.
        self.height += r.uniform(-30, 30)
        self.heading, self.v, self.bank, self.angle = r.uniform(-3, 3), 18 + r.gauss(0, .2), 0., 0.
        self.rpm, self.charge, self.trim = 5500., r.uniform(.75, 1.0), .58
        self.wind_n, self.wind_e, self.lift_air = r.gauss(0, 2), r.gauss(0, 2), 0.
        self.gust = self.warm = self.rate = self.climb = self.amp = 0.
        self.to = [(r.uniform(-400, 400), r.uniform(-400, 400), r.uniform(60, 160),
                    r.uniform(16.5, 20)) for _ in range(40)]
        self.leg = 0

    def pilot(self, t):
        n, e, h, v = self.to[self.leg]
        if math.hypot(n - self.north, e - self.east) < 60:
            self.leg = (self.leg + 1) % len(self.to)
        if t < 5:
            return .58, 0., 0.
        off = wrap(math.atan2(e - self.east, n - self.north) - self.heading)
        slow = v - self.v
        self.trim = clip(self.trim + .002 * slow, .4, .8)
        angle = clip(.01 * (h - self.height), -.10, .08)
        return (clip(self.trim + .08 * slow + 2 * angle, .15, 1.),
                clip(1.2 * off, -.5, .5), angle)

    def inside(self, fault, p):
        if fault == "ice":
            low = 80 + 25 * p[0]
            return low < self.height < low + 35
        return fault != "aileron" or self.bank < -.1

    def step(self, u, w, a):
        dt, k = self.RATE, 1 - .05 * (1 - self.charge)
        self.wind_n += .004 * w[0] - .0002 * self.wind_n
        self.wind_e += .004 * w[1] - .0002 * self.wind_e
        self.lift_air += .02 * w[2] - .01 * self.lift_air
        self.gust += .014 * w[3] - .05 * self.gust
        self.warm += .002 * w[4] - .01 * self.warm
        worn = a.get("motor", 0.)
        self.rpm += dt / .5 * ((1400 + 7000 * u[0]) * k * (1 - .05 * worn) - self.rpm)
        n = self.rpm / 1000
        push = n * (self.thrust * n - .055 * self.v) * (1 - a.get("propeller", 0.))
        pull = (self.drag * self.v ** 2 + self.lift / (self.v * math.cos(self.bank)) ** 2) \
            * (1 + a.get("ice", 0.))
        self.v += dt * ((push - pull) / self.mass - G * math.sin(self.angle) + self.gust)
        self.angle += dt / .8 * (u[2] - self.angle)
        self.bank += dt / .6 * (u[1] * self.turn * (1 - a.get("aileron", 0.)) - self.bank)
        self.rate = G * math.tan(self.bank) / self.v
        self.heading = wrap(self.heading + dt * self.rate)
        self.climb = self.v * math.sin(self.angle) + self.lift_air
        flat = self.v * math.cos(self.angle)
        self.height += dt * self.climb
        self.north += dt * (flat * math.cos(self.heading) + self.wind_n)
        self.east += dt * (flat * math.sin(self.heading) + self.wind_e)
        watts = n * n * (self.amps * n - .122 * self.v) / .9
        self.amp = (.6 + watts / (22 + 3 * self.charge) + self.warm) * (1 + worn)
        self.charge -= self.amp * dt / 36000

    def sense(self):
        return (self.north, self.east, self.height, self.v, self.climb, self.bank, self.heading,
                self.rate, self.rpm, self.amp, 22.2 + 3 * self.charge - .03 * self.amp)


class Works:
    """The waterworks. Levels in m, flows in l/s, chlorine in mg/l; a row every 20 s, 13 hours."""
    RATE, LENGTH, NOISES = 20., 2400, 5
    COLUMNS = ["t_s", "u.gate", "u.lift", "u.dose", "u.main", "s.inflow_lps", "s.basin_m",
               "s.raw_lps", "s.filter_kPa", "s.chlorine_mgpl", "s.clear_m", "s.delivered_lps",
               "s.pressure_kPa", "s.tower_m", "s.demand_lps", "s.power_kW"]
    SIGMA = dict(inflow=1.2, basin=.02, raw=1.2, filter=.8, chlorine=.02, clear=.02, delivered=1.2,
                 pressure=2., tower=.02, demand=1., power=.6)
    TYPICAL = dict(raw=70.0)
    PHYSICAL = {
        "leak": (.03, .04, dict(tower=-1, pressure=-1), ()),
        "impeller": (.03, .05, dict(raw=-1, filter=-1, clear=-1, basin=1), ()),
        "suction": (.04, .06, dict(raw=-1, filter=-1, clear=-1), ("s.basin_m", "u.lift")),
    }
    FAULTS = ("bias:delivered", "drift:chlorine", "gain:raw", "noise:pressure", "stuck:power",
              "leak", "impeller", "suction")
    # hour, wanted level of the basin, base of the lift pump, dose, base of the main pump
    PLAN = ((0, 3.0, .65, .50, .62), (1.5, 2.4, .75, .55, .75), (3.5, 3.0, .60, .45, .68),
            (5, 2.2, .70, .60, .60), (7, 3.2, .80, .50, .78), (8.5, 2.6, .62, .55, .70),
            (10, 2.2, .72, .45, .80), (12, 3.0, .66, .55, .64), (99, 3.0, .65, .50, .62))

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .003))
        self.k_gate, self.k_lift, self.k_main = few(140.), few(108.), few(104.)
        self.k_dose, self.k_filter, self.eta = few(100.), few(.0055), few(.66)
        self.basin, self.clear = r.uniform(2.6, 3.2), r.uniform(2.7, 3.3)
        self.tower, self.clog = r.uniform(3.7, 4.3), r.uniform(0, .1)
        self.inflow, self.raw = 70 + r.gauss(0, 2), 70 + r.gauss(0, 2)
        self.delivered, self.hours = 68 + r.gauss(0, 2), 0.
        self.chlorine, self.river, self.thirst, self.decay = .72 + r.gauss(0, .02), 0., 0., 0.
        self.air, self.loss, self.demand, self.phase = 0., 0., 68., r.uniform(-.3, .3)
        self.plan = [(h + (r.gauss(0, .15) if h else 0), b + r.gauss(0, .05), p + r.gauss(0, .01),
                      d + r.gauss(0, .01), m + r.gauss(0, .01)) for h, b, p, d, m in self.PLAN]

    def pilot(self, t):
        i = max(i for i in range(len(self.plan)) if self.plan[i][0] * 3600 <= t)
        _, b, p, d, m = self.plan[i]
        lift = clip(p + .25 * (3.0 - self.clear), .3, 1.)
        main = clip(m + .25 * (4.0 - self.tower), .3, 1.)
        return clip(.62 + 1.0 * (b - self.basin), .2, 1.), lift, d * (.6 + .6 * lift), main

    def inside(self, fault, p):
        return fault != "suction" or (self.basin < 2.45 + .1 * p[0] and self.raw > 66 + 4 * p[1])

    def step(self, u, w, a):
        dt = self.RATE / 1000
        self.river += .002 * w[0] - .002 * self.river
        self.thirst += .10 * w[1] - .005 * self.thirst
        self.decay += .0005 * w[2] - .002 * self.decay
        self.air += .04 * w[3] - .05 * self.air
        self.loss += .04 * w[4] - .05 * self.loss
        lost = a.get("impeller", 0.) + a.get("suction", 0.)
        self.inflow += .3 * (self.k_gate * u[0] * math.sqrt(max(.1, 1.3 + self.river
                             - .15 * self.basin)) / 1.2 - self.inflow)
        want = self.k_lift * u[1] * (1 + .04 * (self.basin - 3)) / (1 + .3 * self.clog) + self.air
        self.raw += .3 * (want * (1 - lost) - self.raw)
        want = self.k_main * u[3] * (1 + .03 * (self.clear - 3) - .03 * (self.tower - 4))
        self.delivered += .3 * (want + self.loss - self.delivered)
        self.hours += self.RATE / 3600
        self.demand = 70 + 7 * math.sin((self.hours + self.phase) * 2 * math.pi / 6.5) + self.thirst
        self.clog += 2e-6 * self.raw
        self.basin += dt * (self.inflow - self.raw) / 600
        self.clear += dt * (self.raw - self.delivered) / 400
        self.tower += dt * (self.delivered * (1 - a.get("leak", 0.)) - self.demand) / 300
        self.chlorine += dt * self.raw / 60 * (self.k_dose * u[2] / self.raw * (1 + self.decay)
                                               - self.chlorine)

    def sense(self):
        q, d = self.raw, self.delivered
        drop = self.k_filter * q * q * (1 + self.clog)
        press = 320 + 9.8 * self.tower + .006 * d * d
        power = 2 + (q * (60 + drop) + d * press) / 1000 / self.eta
        return (self.inflow, self.basin, q, drop, self.chlorine, self.clear, d, press, self.tower,
                self.demand, power)


class Truck:
    """The truck. Slope in %, speeds in m/s; its motor gives full torque up to 12 m/s."""
    RATE, LENGTH, NOISES = .2, 2500, 5
    COLUMNS = ["t_s", "u.drive", "u.retarder", "u.fan", "s.speed_mps", "s.accel_mps2",
               "s.slope_pct", "s.torque_Nm", "s.current_A", "s.battery_V", "s.motor_degC",
               "s.oil_degC", "s.ambient_degC"]
    SIGMA = dict(speed=.1, accel=.02, slope=.08, torque=8., current=2.5, battery=1.2, motor=.6,
                 oil=.6, ambient=.2)
    TYPICAL = dict(current=138.0)
    PHYSICAL = {
        "tyre": (.12, .16, dict(speed=-1, accel=-1), ()),
        "fan": (.07, .10, dict(motor=1), ()),
        "hill": (.03, .05, dict(torque=-1, speed=-1, accel=-1), ("s.slope_pct", "u.drive")),
        "fluid": (.06, .09, dict(speed=1, accel=1, oil=-1), ("u.retarder",)),
    }
    FAULTS = ("bias:torque", "drift:motor", "gain:current", "stuck:battery",
              "tyre", "fan", "hill", "fluid")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .003))
        self.mass, self.roll, self.aero, self.ratio = few(16000.), few(.0055), few(3.), few(14.)
        self.full, self.hold, self.eta = few(1500.), few(14000.), few(.92)
        self.cool, self.ambient, self.charge = few(1.), 18 + r.gauss(0, 3), r.uniform(.7, .95)
        self.v, self.x, self.acc, self.torque, self.amp, self.brake = 0., 0., 0., 0., 0., 0.
        self.ask = 0.
        self.motor, self.oil = self.ambient + r.uniform(20, 35), self.ambient + r.uniform(15, 30)
        self.head, self.slick, self.sum = r.gauss(0, .25), 0., 0.
        self.hills = [(r.uniform(.7, 1.8), 2 * math.pi / r.uniform(500, 2500),
                       r.uniform(0, 2 * math.pi)) for _ in range(5)]
        t, self.plan = 5., []
        while t < 520:
            self.plan.append((t, r.uniform(13, 23)))
            t += r.uniform(35, 70)

    def slope(self):
        return sum(a * math.sin(k * self.x + p) for a, k, p in self.hills) * math.tanh(self.x / 200)

    def pilot(self, t):
        fan = clip((self.motor - 45) / 30, .1, 1.)
        if t < 5:
            return 0., .3, fan
        e = max(v for s, v in self.plan if s == max(s for s, _ in self.plan if s <= t)) - self.v
        if abs(e) < 2:
            self.sum = clip(self.sum + .0008 * e, -.6, .6)
        want = .12 * e + self.sum + .09 * self.slope()
        return clip(want, 0., 1.), clip(-want, 0., 1.), fan

    def inside(self, fault, p):
        if fault == "hill":
            return self.slope() > .6 + .4 * p[0] and self.ask > .2 + .1 * p[1]
        return fault != "fluid" or self.brake > .06 + .06 * p[0]

    def step(self, u, w, a):
        dt = self.RATE
        self.head += .005 * w[0] - .0005 * self.head
        self.slick += .005 * w[1] - .05 * self.slick
        self.ambient += .003 * w[2]
        self.ask = u[0]
        full = self.full * min(1, 12 / max(.1, self.v))
        give = u[0] * full * (1 - .0004 * (self.motor - 60))
        self.torque += dt / .4 * (give * (1 - a.get("hill", 0.)) - self.torque)
        self.brake += dt / .6 * (u[1] - self.brake)
        slow = self.hold * self.brake * math.tanh(self.v / 3) * (1 - a.get("fluid", 0.))
        rest = self.mass * G * self.roll * (1 + a.get("tyre", 0.)) * math.tanh(self.v * 4)
        wind = self.v + self.head
        push = self.torque * self.ratio - slow - rest - self.aero * wind * abs(wind)
        self.acc = push / self.mass - G * self.slope() / 100 + self.slick * .3 * math.tanh(self.v)
        if self.v <= 0 and self.acc < 0:
            self.acc = 0.
        self.v = max(0., self.v + dt * self.acc)
        self.x += dt * self.v
        made = give * (1 + .02 * w[3]) * self.ratio * self.v
        self.amp += dt / .4 * (12 + made / self.eta / 650 + .03 * give - self.amp)
        self.charge -= self.amp * dt / 3600 / 400
        lost = 600 + 9000 * (give / 1000) ** 2 + 10 * self.v
        vent = self.cool * (20 + 150 * u[2] * (1 - a.get("fan", 0.)))
        self.motor += dt * (lost - vent * (self.motor - self.ambient)) / 7000
        heat = 60 * slow * self.v / 100 - 350 * self.cool * (self.oil - self.ambient)
        self.oil += dt * (heat + 6000 + 20 * w[4]) / 50000

    def sense(self):
        volts = 620 + 60 * self.charge - .06 * self.amp
        return (self.v, self.acc, self.slope(), self.torque, self.amp, volts, self.motor, self.oil,
                self.ambient)


class Scout:
    """The rover. Wheel speeds in rad/s, a yard of 30 m by 30 m with hills of some degrees."""
    RATE, LENGTH, NOISES = .2, 2600, 5
    COLUMNS = ["t_s", "u.left", "u.right", "s.x_m", "s.y_m", "s.heading_rad", "s.pitch_rad",
               "s.roll_rad", "s.left_radps", "s.right_radps", "s.ileft_A", "s.iright_A",
               "s.speed_mps", "s.yawrate_radps", "s.battery_V"]
    SIGMA = dict(x=.05, y=.05, heading=.01, pitch=.006, roll=.006, left=.04, right=.04, ileft=.06,
                 iright=.06, speed=.01, yawrate=.012, battery=.02)
    TYPICAL = dict(speed=.36)
    PHYSICAL = {
        "bearing": (.07, .10, dict(ileft=1), ()),
        "sand": (.05, .08, dict(speed=-1, ileft=1, iright=1), ("s.x_m", "s.y_m")),
        "crumble": (.05, .07, dict(speed=-1), ("s.pitch_rad",)),
    }
    FAULTS = ("bias:yawrate", "gain:speed", "drift:iright", "noise:left", "stuck:roll",
              "bearing", "sand", "crumble")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .003))
        self.radius, self.slip, self.scrub = few(.15), few(.05), few(.62)
        self.kt, self.top, self.base = few(.05), few(4.), few(9.)
        self.x, self.y, self.heading = r.uniform(3, 27), r.uniform(3, 27), r.uniform(-3, 3)
        self.wl = self.wr = self.v = self.rate = self.il = self.ir = 0.
        self.charge, self.soft, self.rough, self.lag = r.uniform(.6, 1.), 0., 0., 0.
        self.to = [(r.uniform(2, 28), r.uniform(2, 28), r.uniform(.55, .95)) for _ in range(60)]
        self.leg = 0

    def tilt(self):
        """Pitch (nose up) and roll of the ground under it."""
        x, y = self.x, self.y
        gx = .07 * math.cos(.45 * x + .2 * y) + .04 * math.sin(.7 * y)
        gy = .06 * math.sin(.5 * y - .15 * x) + .04 * math.cos(.6 * x + 1)
        c, s = math.cos(self.heading), math.sin(self.heading)
        return gx * c + gy * s, gx * s - gy * c

    def pilot(self, t):
        x, y, fast = self.to[self.leg]
        if math.hypot(x - self.x, y - self.y) < .5:
            self.leg = (self.leg + 1) % len(self.to)
        if t < 4:
            return 0., 0.
        e = wrap(math.atan2(y - self.y, x - self.x) - self.heading)
        ahead, turn = fast * max(.3, 1 - .8 * abs(e)), clip(.5 * e, -.25, .25)
        return clip(ahead - turn, .05, 1.), clip(ahead + turn, .05, 1.)

    def inside(self, fault, p):
        if fault == "sand":
            x, y = 6 + 6 * p[0], 6 + 6 * p[1]
            return x < self.x < x + 9 + 2 * p[2] and y < self.y < y + 9 + 2 * p[3]
        return fault != "crumble" or self.tilt()[0] > .02 + .015 * p[0]

    def step(self, u, w, a):
        dt = self.RATE
        pitch, roll = self.tilt()
        self.soft += .0015 * w[0] - .01 * self.soft
        self.rough += .04 * w[1] - .1 * self.rough
        sand = a.get("sand", 0.)
        drag = (self.base + self.rough) * (1 + .8 * sand)
        turn = 9 * (self.wr - self.wl)
        grade, lean = 60 * G * math.sin(pitch) * self.radius * .3, 25 * roll
        left = (drag * (1 + a.get("bearing", 0.)) - lean) * math.tanh(3 * self.wl) + grade - turn
        right = (drag + lean) * math.tanh(3 * self.wr) + grade + turn
        self.wl += dt / .5 * (self.top * u[0] - .008 * left - self.wl) + .005 * w[2]
        self.wr += dt / .5 * (self.top * u[1] - .008 * right - self.wr) + .005 * w[3]
        self.il = .25 + self.kt * 1.6 * left * (1 + .1 * self.wl)
        self.ir = .25 + self.kt * 1.6 * right * (1 + .1 * self.wr)
        grip = 1 - self.slip - .8 * pitch - self.soft - sand - a.get("crumble", 0.)
        mean = self.radius * (self.wl + self.wr) / 2
        self.v += dt / .3 * (mean * grip - self.v)
        rate = self.scrub * self.radius * (self.wr - self.wl) / .7
        self.rate += dt / .3 * (rate - self.rate) + .002 * w[4]
        self.heading = wrap(self.heading + dt * self.rate)
        self.x += dt * self.v * math.cos(self.heading)
        self.y += dt * self.v * math.sin(self.heading)
        self.charge -= dt * (1.5 + abs(self.il) + abs(self.ir)) / 3600 / 20

    def sense(self):
        pitch, roll = self.tilt()
        volts = 26 + 2 * self.charge - .05 * (1.5 + self.il + self.ir)
        return (self.x, self.y, self.heading, pitch, roll, self.wl, self.wr, self.il, self.ir,
                self.v, self.rate, volts)


CLASS = {"plane": Plane, "works": Works, "truck": Truck, "scout": Scout}
VEHICLES = tuple(CLASS)
FAULTS = {v: c.FAULTS for v, c in CLASS.items()}
RATE = {v: c.RATE for v, c in CLASS.items()}
LENGTH = {v: c.LENGTH for v, c in CLASS.items()}
COLUMNS = {v: c.COLUMNS for v, c in CLASS.items()}
run = Drawn("kin", CLASS, many=(2.5, 3.5), drift=1.5).run
