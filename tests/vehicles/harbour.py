# SPDX-License-Identifier: MIT
"""Four machines of a harbour town, drawn by somebody who had not seen the monitor; see `run`.

infuser     A peristaltic pump of three rollers gives a liquid from a bag through line A or, with
            half the resistance, B; a speed loop follows a plan of flows, the rotor's angle wraps,
            the bag empties. The patient's pressure is not measured. A row every .05 s.
            nick: a roller's track is rough in a stretch of the angle. kink: line A is kinked and
            resists at high flow. fatigue: the tube closes less and less, liquid slips back.
            brush: the motor gives less torque for its current.
hydro       A water turbine on the grid: reservoir, tunnel, surge tank, penstock, wicket gate; a
            governor follows a plan of power and answers the frequency. Levels of reservoir and
            river and the frequency are measured. A row every .2 s. rough: it shakes more in a band
            of gate. cavity: it loses power at large flow where the river is low. trash: the rack
            clogs more and more. cooler: the bearing is cooled less.
heatpump    A heat pump warms a tank for a house; the compressor holds a supply temperature that
            follows the weather, the coil frosts and is thawed on demand. Weather is measured, draw
            is not. A row every 2 s. charge: refrigerant is lost more and more. leaves: the coil
            gets less air when it is cold. valve: the compressor conveys less at high frequency.
            scale: the condenser's plates are scaled.
sailer      A sailing drone beats and runs between random marks; sheet and rudder are trimmed, a
            panel charges the battery. Wind is measured on board, current not. A row every second.
            barnacle: the hull drags more and more. sheet: it slips in strong apparent wind.
            shadow: something shades the panel in a sector of headings. stock: the rudder's stock
            turns harder.

run(vehicle, seed, fault) -> (columns, rows, truth), as in town.py, whose conventions hold: nothing
that is drawn for mission, parameters, disturbances and sensors depends on the fault; sensor faults
do not act on the controllers; faults begin at 25 to 60 % of the run, but those with a place are
there from the first row in half of the cases. truth: None, or dict(columns, onset, rows, features,
size, kinds). Sensors: white noise (SIGMA), part of them with noise of a memory besides (RED: its sd
in SIGMA, its rows), or rounded (STEP); a run's own offset and scale. Sizes: SENSOR, in SIGMA (bias,
the end of a drift, the noise that is added), of one (gain), or rows for which a reading is kept.
"""
import math

from lot import Lot, clip, names, now, some, steps, wrap

G = 9.81
TURN = 2 * math.pi


class Infuser:
    """The infusion pump. Flows in ml/min, pressures in mbar, angle in rad."""
    RATE, LENGTH, NOISES = .05, 3600, 4
    COLUMNS = ["t_s", "u.flow_mlpm", "u.line_b", "x.liquid_degC", "s.rotor_rad", "s.speed_rpm",
               "s.motor_mA", "s.inlet_mbar", "s.outlet_mbar", "s.flow_mlpm", "s.bag_g"]
    SIGMA = dict(liquid=.08, rotor=.01, speed=.35, motor=2.5, inlet=.8, outlet=2., flow=1.6, bag=.8)
    RED = dict(inlet=(.8, 30), flow=(.7, 12), motor=(.6, 25))
    STEP = dict(motor=1., bag=.5, liquid=.1, outlet=.5)
    WRAP = dict(rotor=(-math.pi, math.pi))
    SENSOR = {"bias:outlet": (1.5, 2.1), "gain:flow": (.03, .042), "drift:inlet": (2.2, 2.9),
              "noise:speed": (.8, 1.)}
    PHYSICAL = {
        "nick": (.045, .06, dict(motor=1, speed=-1), ("s.rotor_rad",)),
        "kink": (.022, .032, dict(outlet=1, motor=1), ("u.flow_mlpm", "u.line_b", "s.flow_mlpm",
                                                    "s.speed_rpm")),
        "fatigue": (.05, .07, dict(flow=-1, bag=1, outlet=-1, inlet=1), ()),
        "brush": (.045, .06, dict(motor=1), ()),
    }
    RAMPS = ("fatigue",)

    def __init__(self, r):
        self.stroke, self.kt, self.rub = some(r, 3.), some(r, 1.), some(r, 60.)
        self.squeeze, self.res, self.room = some(r, 22., .02), some(r, 1.), 22 + r.gauss(0, 1.5)
        self.liquid = self.room - r.uniform(1, 8)
        self.bag, self.rotor = r.uniform(700, 1000), r.uniform(-3, 3)
        self.n, self.sum, self.torque, self.body, self.stiff = 0., 0., 0., 15 + r.gauss(0, 4), 0.
        self.out, self.inlet, self.q, self.breath = self.body, 0., 0., r.uniform(.22, .3)
        end = self.RATE * self.LENGTH
        self.plan = steps(r, end, 6, 18,
                          lambda: r.choice([30, 45, 60, 75, 90, 110, r.uniform(25, 120)]))
        self.lines = steps(r, end, 15, 45, lambda: float(r.random() < .4))
        self.i = self.j = 0
        self.want, self.line, self.t = 0., 0., 0.

    def pilot(self, t):
        self.i, self.j, self.t = now(self.plan, t, self.i), now(self.lines, t, self.j), t
        to = self.plan[self.i][1] if t > 2 else 0.
        self.want += clip(to - self.want, -2., 2.)
        self.line = self.lines[self.j][1]
        return self.want, self.line

    def inside(self, fault, p, u):
        if fault == "nick":
            return wrap(self.rotor - TURN * p[0], 0, TURN) < 1.1 + .7 * p[1] and self.n > 1
        return fault != "kink" or (self.want > 55 + 15 * p[0] and not self.line)

    def step(self, u, w, a):
        self.liquid += .0015 * (self.room - self.liquid) * self.RATE + .003 * w[0]
        self.body += .05 * w[1] - .003 * (self.body - 15)
        self.stiff += .002 * w[2] - .01 * self.stiff
        thin = 1 - .02 * (self.liquid - 20)
        res = self.res * (.9 - .45 * u[1]) * thin + a.get("kink", 0.)
        patient = self.body + 3 * math.sin(TURN * self.breath * self.t)
        soft = 1 - .008 * (self.liquid - 20) + self.stiff
        for _ in range(2):
            dt = self.RATE / 2
            e = u[0] / self.stroke - self.n
            self.sum = clip(self.sum + dt * 12 * e, -100, 300)
            drive = 8 * e + self.sum
            wave = math.cos(3 * self.rotor)
            load = (self.rub * math.tanh(self.n / .8)
                    + self.squeeze * soft * (1 + .5 * wave) * min(1, self.n / 3)
                    + .22 * (self.out - self.inlet) + .6 * self.n + 60 * a.get("nick", 0.))
            self.n = max(0., self.n + dt * 1.2 * (drive - load))
            self.rotor = wrap(self.rotor + dt * self.n * TURN / 60, -math.pi, math.pi)
            slip = .0006 * max(0., self.out - self.inlet) + .02 * wave + a.get("fatigue", 0.)
            pumped = self.stroke * self.n * (1 - slip) * (1 + .25 * wave)
            self.inlet += dt * 8 * (.04 * self.bag - .45 * thin * pumped - self.inlet)
            flow = (self.out - patient) / res
            self.out += dt * (pumped - flow) * 2.5
            self.q += dt * 6 * (flow - self.q)
            self.bag -= dt * pumped / 60
        self.torque = max(0., drive) / self.kt / (1 - a.get("brush", 0.))

    def context(self):
        return (self.liquid,)

    def sense(self):
        return self.rotor, self.n, 20 + self.torque, self.inlet, self.out, self.q, self.bag


class Hydro:
    """The turbine. Heads in m, flows in m3/s, power in kW, gate in per cent."""
    RATE, LENGTH, NOISES = .2, 3000, 6
    COLUMNS = ["t_s", "u.gate_pct", "u.field_A", "x.lake_m", "x.river_m", "x.grid_Hz", "s.gate_pct",
               "s.flow_m3ps", "s.penstock_kPa", "s.surge_m", "s.power_kW", "s.volts_V",
               "s.bearing_degC", "s.shake_mmps", "s.speed_rpm"]
    SIGMA = dict(lake=.02, river=.02, grid=.002, gate=.25, flow=.09, penstock=4., surge=.06,
                 power=25., volts=12., bearing=.25, shake=.12, speed=.12)
    RED = dict(flow=(.8, 30), shake=(1., 8), volts=(.7, 40), power=(.5, 15))
    STEP = dict(gate=.1, bearing=.1, lake=.01, river=.01, speed=.1)
    SENSOR = {"bias:penstock": (.6, .85), "gain:flow": (.042, .055), "stuck:gate": (4, 6),
              "drift:volts": (3.6, 4.6)}
    PHYSICAL = {
        "rough": (.26, .34, dict(shake=1),
                  ("u.gate_pct", "s.gate_pct", "s.flow_m3ps", "s.power_kW")),
        "cavity": (.014, .02, dict(power=-1),
                   ("x.river_m", "s.flow_m3ps", "s.gate_pct", "u.gate_pct", "s.power_kW")),
        "trash": (.13, .18, dict(surge=-1, penstock=-1), ()),
        "cooler": (.05, .065, dict(bearing=1), ()),
    }
    RAMPS = ("trash",)

    def __init__(self, r):
        self.wide, self.loss, self.eta = some(r, 1.), some(r, .09, .02), some(r, .92)
        self.lake, self.river = 52 + r.gauss(0, 1.), 1.5 + r.gauss(0, .2)
        self.wobble, self.cool, self.air = some(r, 1.), some(r, 1.), 18 + r.gauss(0, 3)
        self.q = self.tunnel = r.uniform(3.5, 6.5)
        self.surge = self.lake - self.loss * self.q ** 2 + r.gauss(0, .3)
        self.open, self.integral, self.order, self.head = 10 * self.q, 10 * self.q, 10 * self.q, 45.
        self.power, self.w, self.angle, self.grid, self.volts = 35 * 9 * self.q, 1., .5, 50., 6300.
        self.temp, self.field = 50 + r.gauss(0, 3), 110.
        self.swirl = self.wind = self.fouled = 0.
        self.tide = r.uniform(0, TURN), r.uniform(300, 500), r.uniform(.5, .8)
        self.plan = steps(r, 600, 25, 70, lambda: r.uniform(1000, 2900))
        self.reactive = steps(r, 600, 40, 120, lambda: r.uniform(-8, 8))
        self.i = self.j = 0
        self.t, self.kw, self.mech = 0., self.plan[0][1], 0.

    def pilot(self, t):
        self.i, self.j, self.t = now(self.plan, t, self.i), now(self.reactive, t, self.j), t
        self.kw += clip(self.plan[self.i][1] - self.kw, -12, 12)
        e = self.kw - 1800 * (self.grid - 50) - self.power
        self.integral = clip(self.integral + .0004 * e, 8, 96)
        self.order = clip(self.integral + .002 * e, 5, 100)
        self.field += .05 * (70 + .018 * self.power + self.reactive[self.j][1] - self.field)
        return self.order, self.field

    def inside(self, fault, p, u):
        if fault == "rough":
            return 42 + 14 * p[0] < self.open < 58 + 14 * p[0]
        low = 1.5 + .3 * p[1]
        return fault != "cavity" or (self.q > 4.6 + .6 * p[0] and self.level < low)

    def step(self, u, w, a):
        self.lake += .001 * w[0]
        phase = self.tide[0] + TURN * self.t / self.tide[1]
        self.level = self.river + self.tide[2] * math.sin(phase)
        self.grid += .003 * w[1] - .03 * (self.grid - 50)
        self.swirl += .02 * w[2] - .02 * self.swirl
        self.fouled += .0008 * w[3] - .004 * self.fouled
        self.wind += .03 * w[4] - .005 * self.wind
        self.open += self.RATE * clip(1.5 * (u[0] - self.open), -8, 8)
        k = self.loss * (1 + self.fouled + a.get("trash", 0.))
        for _ in range(8):
            dt = self.RATE / 8
            lost = k * self.tunnel * abs(self.tunnel)
            self.tunnel += dt * G * 8 / 400 * (self.lake - self.surge - lost)
            self.surge += dt * (self.tunnel - self.q) / 20
            self.head = (self.q / (self.wide * .0155 * max(5, self.open))) ** 2
            self.q = max(.3, self.q + dt * G * 2.2 / 60 * (
                self.surge - self.level - self.head - .05 * self.q ** 2))
            eta = self.eta * (1 - .03 * (self.q - 5.6) ** 2 / 2) * (1 - a.get("cavity", 0.))
            self.mech = G * self.q * self.head * eta - 40
            electric = (6000 * math.sin(self.angle) * (.7 + .3 * self.field / 110)
                        + 1e5 * (self.w - self.grid / 50))
            self.w += dt * (self.mech - electric) / 16000
            self.angle += dt * TURN * 50 * (self.w - self.grid / 50)
        self.power = .97 * electric
        self.volts += .3 * (6300 + 6 * (u[1] - 70 - .018 * self.power) + 40 * (self.grid - 50)
                            - self.volts)
        heat = (22 + .005 * self.power) * self.w ** 2
        cooled = self.cool * (1 - a.get("cooler", 0.)) * (self.temp - self.air - self.wind)
        self.temp += self.RATE / 60 * (heat - cooled)
        x = (self.open - 48) / 14
        self.shake = 1.2 + self.wobble * (.9 * math.exp(-x * x) + .0003 * self.power) + self.swirl
        self.shake += a.get("rough", 0.)

    def context(self):
        return self.lake, self.level, self.grid

    def sense(self):
        return (self.open, self.q, G * (self.head + .5 * self.level), self.surge, self.power,
                self.volts, self.temp, self.shake, 300 * self.w)


class Heatpump:
    """The heat pump. Temperatures in deg C, heat in kW, water in l/s."""
    RATE, LENGTH, NOISES = 2., 2600, 5
    COLUMNS = ["t_s", "u.comp_Hz", "u.fan_pct", "u.valve_pct", "u.defrost", "u.pump_pct",
               "x.outdoor_degC", "x.humid_pct", "s.coil_degC", "s.suction_bar", "s.cond_bar",
               "s.discharge_degC", "s.supply_degC", "s.return_degC", "s.tank_degC", "s.power_kW",
               "s.flow_lps"]
    SIGMA = {"outdoor": .08, "humid": .6, "coil": .25, "suction": .06, "cond": .12, "discharge": .7,
             "supply": .12, "return": .12, "tank": .15, "power": .03, "flow": .006}
    RED = dict(coil=(.7, 15), suction=(.5, 20), discharge=(.8, 20), flow=(.7, 10), power=(.6, 30))
    STEP = dict(supply=.1, tank=.25, humid=1., outdoor=.1, power=.01)
    SENSOR = {"bias:return": (1.1, 1.5), "drift:suction": (2.8, 3.6), "gain:power": (.025, .035),
              "noise:discharge": (.8, 1.)}
    PHYSICAL = {
        "charge": (2.4, 3.2, dict(discharge=1, suction=-1), ()),
        "leaves": (.06, .09, dict(coil=-1, suction=-1), ("x.outdoor_degC",)),
        "valve": (.055, .075, dict(cond=-1, coil=1, suction=1, discharge=0, supply=-1),
                  ("u.comp_Hz", "s.power_kW")),
        "scale": (.08, .11, dict(cond=1), ()),
    }
    RAMPS = ("charge",)

    def __init__(self, r):
        self.ua, self.plate, self.swept = some(r, .85), some(r, 1.5), some(r, .125)
        self.mid, self.swing = 1.5 + r.gauss(0, 1.), r.uniform(2.5, 4)
        self.phase = r.uniform(0, TURN)
        self.humid, self.outdoor, self.breeze = clip(82 + r.gauss(0, 5), 60, 97), 1., 0.
        self.tank, self.ret, self.supply = 34 + r.gauss(0, 2), 33 + r.gauss(0, 1.5), 35.
        self.te, self.tc, self.frost, self.hot = -3., 38., r.uniform(0, .6), 60.
        self.sum, self.f, self.thaw, self.since = 55., 50., 0., r.uniform(0, 900)
        self.sh, self.exv, self.draw, self.flow, self.power, self.air = 6., 45., 0., .3, 1.5, 1.
        self.plan = steps(r, 5200, 500, 1400, lambda: r.uniform(-3, 4))
        self.use = steps(r, 5200, 150, 700, lambda: r.choice([0., 0., r.uniform(.5, 2.)]))
        self.speed = steps(r, 5200, 250, 800, lambda: r.choice([55., 65., 75., 85., 95.]))
        self.i = self.j = self.k = 0

    def pilot(self, t):
        self.t = t
        self.i, self.j = now(self.plan, t, self.i), now(self.use, t, self.j)
        self.k = now(self.speed, t, self.k)
        self.since += self.RATE
        if self.thaw and (self.te > 9 or self.since > 240):
            self.thaw, self.since = 0., 0.
        elif not self.thaw and self.since > 900 and self.frost > .95:
            self.thaw, self.since = 1., 0.
        e = 38 - .5 * self.outdoor + self.plan[self.i][1] - self.supply
        if self.thaw:
            self.f += clip(60 - self.f, -2, 2)
        else:
            self.sum = clip(self.sum + .03 * e, 22, 95)
            self.f += clip(clip(self.sum + 3 * e, 25, 95) - self.f, -1, 1)
        self.exv = 90. if self.thaw else clip(self.exv + .05 * (self.sh - 6), 15, 90)
        self.fan = 0. if self.thaw else clip(40 + .6 * self.f, 40, 95)
        return self.f, self.fan, self.exv, self.thaw, self.speed[self.k][1]

    def inside(self, fault, p, u):
        if fault == "leaves":
            return self.outdoor < self.mid - .8 + 1.2 * p[0] and not self.thaw
        return fault != "valve" or (self.f > 43 + 6 * p[0] and not self.thaw)

    def step(self, u, w, a):
        dt = self.RATE
        day = math.sin(self.phase + TURN * self.t / 4200)
        self.outdoor += .004 * (self.mid + self.swing * day - self.outdoor)
        self.outdoor += .015 * w[0]
        self.humid = clip(self.humid + .12 * w[1] + .002 * (82 - self.humid), 50, 99)
        self.breeze += .003 * w[2] - .02 * self.breeze
        self.draw += .02 * (self.use[self.j][1] - self.draw) + .01 * w[3] - .01 * self.draw
        self.flow += .3 * (.0042 * u[4] * (1 + .001 * w[4]) - self.flow)
        self.air += .2 * (u[1] / 80 - self.air)
        moved = self.swept * u[0] * math.exp(.03 * self.te) * (1 - a.get("valve", 0.))
        if u[3]:
            cold = -.05 * u[0]
            pumped, work = cold, .4 + .012 * u[0]
            melt = .012 * max(0., self.te + 1) if self.frost > .02 else 0.
            self.frost = max(0., self.frost - dt * .0016 * max(0., self.te + 2))
            self.te += dt * (.05 * u[0] - .5 * melt * 20 - .05 * (self.te - self.outdoor)) / 14
            qc = -.035 * u[0]
            self.sh += .05 * (2 - self.sh)
        else:
            ua = self.ua * max(.2, self.air) ** .6 * (1 - .35 * self.frost) * (
                1 + self.breeze) * (1 - a.get("leaves", 0.))
            pumped = moved * (1 - .004 * (self.tc - self.te))
            work = .35 + u[0] * (.009 + .00055 * (self.tc - self.te))
            qe = ua * (self.outdoor - self.te)
            self.te += dt * (qe - pumped) / 12
            dry = self.outdoor - (100 - self.humid) / 5
            frosts = dt * .00018 * max(0., dry - self.te) * (self.te < 0)
            self.frost = clip(self.frost + frosts, 0, 1.3)
            need = 8 + .55 * u[0] * math.exp(.025 * self.te)
            self.sh += .06 * (6 + .4 * (need - u[2]) + a.get("charge", 0.) - self.sh)
            qc = pumped + .92 * work
        self.power += .25 * (work - self.power)
        water = (self.ret + self.supply) / 2
        give = self.plate * (1 - a.get("scale", 0.)) * (self.flow / .3) ** .4 * (self.tc - water)
        self.tc += dt * (qc - give) / 14
        self.supply += .15 * (self.ret + give / (4.18 * max(.05, self.flow)) - self.supply)
        self.ret += .1 * (self.tank - .4 - self.ret)
        load = .23 * (21 - self.outdoor) + .15 * (self.tank - 30) + self.draw
        self.tank += dt * (4.18 * self.flow * (self.supply - self.ret) - load) / 600
        to = 45. if u[3] else self.tc + 6 + 1.1 * self.sh + .35 * (self.tc - self.te)
        self.hot += .03 * (to - self.hot)
        self.low = a.get("charge", 0.)

    def context(self):
        return self.outdoor, self.humid

    def sense(self):
        suction = 8. * math.exp(.031 * self.te) * (1 - .008 * self.low)
        return (self.te, suction, 8. * math.exp(.0268 * self.tc), self.hot, self.supply, self.ret,
                self.tank, self.power, self.flow)


class Sailer:
    """The drone. Angles in degrees: heading 0 to 360, clockwise from north; wind -180 to 180."""
    RATE, LENGTH, NOISES = 1., 2400, 10
    COLUMNS = ["t_s", "u.rudder_deg", "u.sheet_deg", "u.radio", "x.sun_Wpm2", "x.sea_degC",
               "s.north_m", "s.east_m", "s.heading_deg", "s.yawrate_dps", "s.speed_mps",
               "s.heel_deg", "s.wind_mps", "s.windangle_deg", "s.solar_W", "s.rudder_A",
               "s.battery_V", "s.hull_degC"]
    SIGMA = dict(sun=6., sea=.03, north=1.2, east=1.2, heading=1.2, yawrate=.25, speed=.04, heel=.8,
                 wind=.2, windangle=2., solar=1., rudder=.03, battery=.015, hull=.12)
    RED = dict(north=(.8, 40), east=(.8, 40), heel=(1., 3), wind=(.6, 4), speed=(.7, 25))
    STEP = dict(battery=.01, hull=.1, sun=5., windangle=1., rudder=.01)
    WRAP = dict(heading=(0., 360.), windangle=(-180., 180.))
    SENSOR = {"bias:yawrate": (.7, .95), "gain:speed": (.06, .08), "drift:hull": (2., 2.8),
              "stuck:heel": (4, 6)}
    PHYSICAL = {
        "barnacle": (.55, .75, dict(speed=-1), ()),
        "sheet": (4., 5.5, dict(heel=0, speed=0), ("s.wind_mps",)),
        "shadow": (.05, .075, dict(solar=-1), ("s.heading_deg",)),
        "stock": (.10, .14, dict(rudder=1), ()),
    }
    RAMPS = ("barnacle",)

    def __init__(self, r):
        self.drag, self.sail, self.helm = some(r, 1.), some(r, 1.), some(r, .12)
        self.righting, self.cells = some(r, 1.), some(r, .062)
        self.blow, self.veer, self.gust = r.uniform(5.5, 8.), r.uniform(-180, 180), 0.
        self.sea, self.haze, self.noon = 14 + r.gauss(0, 1.5), 0., r.uniform(300, 800)
        self.north, self.east, self.yaw = r.gauss(0, 100), r.gauss(0, 100), r.uniform(0, 360)
        self.v, self.rate, self.heel, self.rudder, self.amp = .8, 0., 0., 0., .1
        self.stream, self.charge = [r.gauss(0, .1), r.gauss(0, .1)], r.uniform(.5, .9)
        self.hull = self.sea + r.uniform(2, 5)
        self.marks = [(r.uniform(-500, 500), r.uniform(-500, 500)) for _ in range(60)]
        self.radio = steps(r, 2400, 30, 150, lambda: float(r.random() < .4))
        self.i = self.m = 0
        self.tack, self.cloud, self.order, self.leeway = 1, 0., 0., 0.
        self.spray, self.wave = r.gauss(0, .017), 0.
        self.feel()

    def feel(self):
        """Apparent wind: its speed, and where it comes from off the bow."""
        tw = math.radians(self.veer - self.yaw)
        speed = max(1., self.blow + self.gust)
        ahead, side = speed * math.cos(tw) + self.v, speed * math.sin(tw)
        self.aw, self.awa = math.hypot(ahead, side), math.degrees(math.atan2(side, ahead))

    def pilot(self, t):
        self.t, self.i = t, now(self.radio, t, self.i)
        n, e = self.marks[self.m]
        if math.hypot(n - self.north, e - self.east) < 30:
            self.m = (self.m + 1) % len(self.marks)
        to = math.degrees(math.atan2(e - self.east, n - self.north))
        off = wrap(to - self.veer, -180, 180)
        if abs(off) < 48:
            if self.tack * off < -20:
                self.tack = -self.tack
            to = self.veer + self.tack * 48
        else:
            self.tack = 1 if off > 0 else -1
        err = wrap(to - self.yaw, -180, 180)
        self.order = clip(.5 * err - .8 * self.rate, -28, 28)
        sheet = clip(.62 * abs(self.awa) - 10, 8, 85)
        return self.order, sheet, self.radio[self.i][1]

    def inside(self, fault, p, u):
        if fault == "sheet":
            return self.aw > 6.6 + p[0]
        return fault != "shadow" or wrap(self.yaw - 360 * p[0], 0, 360) < 80 + 50 * p[1]

    def step(self, u, w, a):
        self.gust += .12 * w[0] - .03 * self.gust
        self.blow += .008 * w[1] - .001 * (self.blow - 7)
        self.veer = wrap(self.veer + .25 * w[2], -180, 180)
        self.stream = [.999 * x + .002 * y for x, y in zip(self.stream, w[3:5])]
        self.cloud = clip(self.cloud + .02 * w[5] - .01 * (self.cloud - .25), 0, .8)
        self.haze = 1 - self.cloud
        self.sun = (250 + 500 * math.exp(-((self.t - 1200) / (900 + self.noon)) ** 2)) * self.haze
        self.sea += .002 * w[6]
        self.spray += .003 * w[8] - .015 * self.spray
        self.wave += .003 * w[9] - .02 * self.wave
        self.feel()
        moved = clip(u[0] - self.rudder, -8, 8)
        self.rudder += .7 * moved
        sheet = u[1] + a.get("sheet", 0.)
        attack = clip(abs(self.awa) - sheet, -5, 90)
        lift = 1 - .005 * (attack - 28)
        if attack < 28:
            lift = math.sin(2 * math.radians(clip(attack * 1.6, -5, 45)))
        push = self.sail * .045 * self.aw ** 2
        drive = push * (lift * math.sin(math.radians(abs(self.awa))) * .9
                        + .35 * math.sin(math.radians(attack))
                        * max(0., -math.cos(math.radians(self.awa)))
                        - .12 * max(0., math.cos(math.radians(self.awa))))
        side = push * lift * abs(math.cos(math.radians(sheet))) * math.copysign(1, self.awa)
        drag = self.drag * (.75 + .5 * a.get("barnacle", 0.)) * self.v * abs(self.v) + .15 * self.v
        drag += .0008 * self.rudder ** 2 * self.v
        self.v = max(.05, self.v + .16 * (drive - drag) + .006 * w[7])
        self.heel += .4 * (-9.5 * self.righting * side - self.heel)
        turn = self.helm * 1.6 * self.rudder * (.25 + self.v) + .03 * self.heel * self.v
        self.rate += .5 * (turn - self.rate)
        self.yaw = wrap(self.yaw + self.rate, 0, 360)
        self.leeway = -.006 * self.heel
        c, s = math.cos(math.radians(self.yaw)), math.sin(math.radians(self.yaw))
        self.north += self.v * c + self.leeway * s + self.stream[0]
        self.east += self.v * s - self.leeway * c + self.stream[1]
        hold = .004 * abs(self.rudder) * self.v * self.v
        stock = a.get("stock", 0.)
        turns = .14 * abs(moved) + 1.2 * hold
        self.amp = .12 + self.wave + turns * (1 + 2 * stock) + .25 * stock
        facing = 1 + .012 * self.heel * math.sin(math.radians(self.yaw - 180))
        lit = (1 + self.spray) * (1 - a.get("shadow", 0.))
        self.solar = self.cells * self.sun * facing * lit * (1 - .003 * (self.hull - 20))
        self.load = 9 + 14 * u[2] + 12 * self.amp
        self.charge = clip(self.charge + (self.solar - self.load) / 400000, 0, 1)
        self.hull += .01 * (self.sea + .08 * self.load + .006 * self.sun - self.hull)

    def context(self):
        return self.sun, self.sea

    def sense(self):
        volts = 11.8 + 1.4 * self.charge + .012 * (self.solar - self.load)
        return (self.north, self.east, self.yaw, self.rate, self.v, self.heel, self.aw, self.awa,
                self.solar, self.amp, volts, self.hull)


def measure(c, rows, q):
    """What sensors read: an offset and a scale of the run, white noise and noise with memory."""
    for i, name in names(c):
        sigma = c.SIGMA[name]
        scale, offset = 1 + q.gauss(0, .002), q.gauss(0, .4) * sigma
        share, memory = c.RED.get(name, (0., 1)) if c.COLUMNS[i + 1][0] == "s" else (0., 1)
        keep = math.exp(-1 / memory)
        red = q.gauss(0, share)
        exact = ("north", "east", "grid", "lake", "surge", *getattr(c, "WRAP", ()))
        if name in exact or name == "speed" and c is Hydro:
            scale = 1.
        for x in rows:
            red = keep * red + q.gauss(0, share * math.sqrt(1 - keep * keep))
            x[i] = x[i] * scale + offset + sigma * (red + q.gauss(0, 1))
    return rows


LOT = Lot("harbour", {"infuser": Infuser, "hydro": Hydro, "heatpump": Heatpump, "sailer": Sailer}, measure)
VEHICLES, FAULTS = tuple(LOT.machines), LOT.faults
RATE, LENGTH, COLUMNS = LOT.of("RATE"), LOT.of("LENGTH"), LOT.of("COLUMNS")
run = LOT.run
