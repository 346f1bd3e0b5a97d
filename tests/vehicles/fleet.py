# SPDX-License-Identifier: MIT
"""Four vehicles and machines drawn blind; the interface is that of kin.py.

ferry       An electric ferry of 60 t runs between three piers in random order. A governor holds the
            speed with power, an autopilot steers; at a pier it is moored while the load changes.
            The apparent wind, the draft and the sea are measured; the tide and the waves are not.
            strainer: the motor's sea-water cooling is clogged. fouling: the hull drags more. weed:
            in a box of the strait, weed round the propeller, which pushes less and turns harder.
            rudder: it turns less to one side.
airship     A blimp flies between waypoints; sun heats the gas, which lifts; a blower holds the
            envelope's pressure against leaks and climbs. Gusts and thermals are not measured.
            rain: the envelope is heavy. blower: its filter is clogged. belt: it slips at high
            power, so that the propeller pushes less and the motor pulls less current. elevator:
            it pitches less when up.
greenhouse  Forty hours in winter: heating pipes, window, mist and CO2 under controllers; weather is
            measured, the transpiration of the crop and the draughts are not. pane: broken, the
            house leaks air. pump: the heating water carries less. nozzle: clogged, mist falls
            short when it is asked for. vent: the window opens less than asked in wind.
crane       A yard crane carries loads of random weight between random places; the drives ramp, the
            operator damps the swing. Currents are root mean squares and have no sign. contact: the
            collector shoe adds resistance. brake: it drags on the trolley. rail: a dirty stretch
            of rail. gear: the hoist's gear loses more when it lifts a load.

The accepted outcomes of a physical fault are those it acts on directly.
"""
import math

from drawn import Drawn, clip, wrap

G = 9.81


class Ferry:
    """The ferry. Metres, m/s, rad; a row every half second for 25 minutes."""
    RATE, LENGTH, NOISES = .5, 3000, 8
    COLUMNS = ["t_s", "u.power", "u.rudder_rad", "u.bow", "s.x_m", "s.y_m", "s.heading_rad",
               "s.yawrate_radps", "s.speed_mps", "s.shaft_rpm", "s.current_A", "s.battery_V",
               "s.motor_degC", "s.draft_m", "s.windspeed_mps", "s.windangle_rad", "s.sea_degC"]
    SIGMA = dict(x=1., y=1., heading=.01, yawrate=.003, speed=.04, shaft=2., current=2.5,
                 battery=.8, motor=.4, draft=.01, windspeed=.4, windangle=.06, sea=.1)
    TYPICAL = dict(speed=3.6)
    PHYSICAL = {
        "strainer": (.08, .12, dict(motor=1), ()),
        "fouling": (.07, .10, dict(speed=-1), ()),
        "weed": (.06, .09, dict(speed=-1, current=1), ("s.x_m", "s.y_m")),
        "rudder": (.22, .30, dict(yawrate=-1), ("u.rudder_rad", "s.yawrate_radps")),
    }
    FAULTS = ("bias:yawrate", "drift:current", "gain:speed", "stuck:motor",
              "strainer", "fouling", "weed", "rudder")
    PIERS = ((0, 0), (630, 175), (245, 665))

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .004))
        self.push, self.drag, self.steer, self.torque = few(600.), few(500.), few(.03), few(110.)
        self.cool, self.top, self.trim = few(200.), few(480.), .6
        self.at, self.sea, self.charge = r.randrange(3), 12 + r.gauss(0, 2), r.uniform(.7, 1.)
        self.x, self.y = (c + r.gauss(0, 5) for c in self.PIERS[self.at])
        self.heading, self.v, self.n, self.rate, self.turned = r.uniform(-3, 3), 0., 0., 0., 0.
        self.motor, self.draft = self.sea + r.uniform(5, 25), 2 + r.uniform(-.1, .15)
        self.wind, self.wind_to, self.tide = abs(r.gauss(5, 2)), r.uniform(-3, 3), r.gauss(0, .3)
        self.wave = self.yaw = self.swirl = self.amp = self.hotel = 0.
        self.until, self.moored = r.uniform(5, 20), True
        hops = sum((r.sample((1, 1, 2, 2), 4) for _ in range(8)), [])
        self.trips = [(hop, r.uniform(3.6, 5.2), 2 + r.uniform(-.1, .15),
                       r.uniform(15, 30)) for hop in hops]

    def pilot(self, t):
        if self.moored and t >= self.until:
            hop, self.cruise, self.draft_next, self.stay = self.trips.pop(0)
            self.at, self.moored = (self.at + hop) % 3, False
        if self.moored:
            return 0., 0., 0.
        x, y = self.PIERS[self.at]
        far, e = math.hypot(x - self.x, y - self.y), wrap(math.atan2(y - self.y, x - self.x)
                                                          - self.heading)
        if far < 25:
            self.moored, self.until = True, t + self.stay
        slow = min(self.cruise, 1 + .025 * far) * max(.25, 1 - .6 * abs(e)) - self.v
        self.trim = clip(self.trim + .001 * slow, .3, .9)
        bow = clip(1.5 * e, -1, 1) if self.v < 2 else 0.
        return clip(self.trim + .25 * slow, .1, 1.), clip(.9 * e - 5 * self.rate, -.5, .5), bow

    def inside(self, fault, p):
        if fault == "weed":
            x, y = 40 + 30 * p[0], 40 + 30 * p[1]
            return not self.moored and x < self.x < x + 440 and y < self.y < y + 440
        return fault != "rudder" or self.turned > .04

    def step(self, u, w, a):
        dt, weed = self.RATE, a.get("weed", 0.)
        self.wave += .02 * w[0] - .1 * self.wave
        self.yaw += .0004 * w[1] - .1 * self.yaw
        self.swirl += .006 * w[2] - .02 * self.swirl
        self.wind = abs(self.wind + .05 * w[3] - .004 * (self.wind - 5))
        self.wind_to = wrap(self.wind_to + .01 * w[4])
        self.hotel += .3 * w[5] - .05 * self.hotel
        self.sea += .002 * w[6]
        if self.moored:
            self.draft += .02 * (getattr(self, "draft_next", self.draft) - self.draft)
        self.n += dt / 2 * (self.top / 60 * u[0] - self.n)
        self.turned += dt / 1.5 * (u[1] - self.turned)
        angle = wrap(self.wind_to - self.heading)
        self.ahead, self.side = self.wind * math.cos(angle) - self.v, self.wind * math.sin(angle)
        wet = 1 + .5 * (self.draft - 2)
        thrust = self.push * self.n * (self.n - .5 * self.v) * (1 - weed)
        drag = (self.drag * wet * (1 + a.get("fouling", 0.)) + 900 * self.turned ** 2) * self.v ** 2
        force = thrust - drag + 24 * self.ahead * abs(self.ahead)
        self.v = max(0., self.v + dt * (force / (60000 * wet) + .12 * self.wave * (self.v > .5)))
        bite = self.steer * (self.v + .3 * self.n) * self.turned
        bite *= 1 - a.get("rudder", 0.)
        want = bite + .025 * u[2] + .00005 * self.side * abs(self.side)
        self.rate += dt / 4 * (want - self.rate) + dt * self.yaw
        if self.moored:
            self.v, self.rate = self.v * .8, self.rate * .8
        self.heading = wrap(self.heading + dt * self.rate)
        near = min(math.hypot(self.x - x, self.y - y) for x, y in self.PIERS)
        flow = 0. if self.moored else (self.tide + self.swirl) * min(1, near / 200)
        self.x += dt * (self.v * math.cos(self.heading) + .8 * flow)
        self.y += dt * (self.v * math.sin(self.heading) - .6 * flow)
        watts = 6.283 * self.torque * self.n ** 2 * (self.n - .25 * self.v) * (1 + .5 * weed)
        self.amp = watts / .93 / 600 + 20 + self.hotel + 60 * abs(u[2])
        self.charge -= self.amp * dt / 3600 / 500
        cool = self.cool * (1 - a.get("strainer", 0.)) * (self.motor - self.sea)
        self.motor += dt * (.07 * watts + 600 - cool) / 24000

    def sense(self):
        speed, angle = math.hypot(self.ahead, self.side), math.atan2(self.side, self.ahead)
        volts = 590 + 40 * self.charge - .05 * self.amp
        return (self.x, self.y, self.heading, self.rate, self.v, 60 * self.n, self.amp, volts,
                self.motor, self.draft, speed, angle, self.sea)


class Airship:
    """The blimp. Metres, m/s, rad, Pa; a row every half second for 21 minutes."""
    RATE, LENGTH, NOISES = .5, 2500, 9
    COLUMNS = ["t_s", "u.motor", "u.rudder_rad", "u.elevator_rad", "u.blower", "s.north_m",
               "s.east_m", "s.altitude_m", "s.heading_rad", "s.yawrate_radps", "s.pitch_rad",
               "s.airspeed_mps", "s.climb_mps", "s.motor_rpm", "s.current_A", "s.envelope_Pa",
               "s.gas_degC", "s.air_degC", "s.sun_Wpm2"]
    SIGMA = dict(north=1.5, east=1.5, altitude=.5, heading=.015, yawrate=.004, pitch=.008,
                 airspeed=.2, climb=.1, motor=12., current=.8, envelope=6., gas=.3, air=.2, sun=8.)
    TYPICAL = dict(airspeed=12.)
    PHYSICAL = {
        "rain": (.9, 1.3, dict(climb=-1), ()),
        "blower": (.05, .07, dict(envelope=-1), ()),
        "belt": (.08, .12, dict(airspeed=-1, current=-1), ("u.motor", "s.motor_rpm")),
        "elevator": (.20, .30, dict(pitch=-1, climb=-1), ("u.elevator_rad", "s.pitch_rad")),
    }
    FAULTS = ("bias:gas", "drift:envelope", "gain:airspeed", "noise:climb",
              "rain", "blower", "belt", "elevator")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .004))
        self.push, self.drag, self.fin, self.tail = few(43.), few(1.5), few(.04), few(.6)
        self.fan, self.amps, self.heavy = few(30.), few(1.), r.gauss(0, 8)
        self.north, self.east = r.uniform(-300, 300), r.uniform(-300, 300)
        self.height, self.heading = r.uniform(80, 160), r.uniform(-3, 3)
        self.air, self.clear = 16 + r.gauss(0, 4), r.uniform(.3, 1.)
        self.sun = 600 * self.clear
        self.gas = self.air + .009 * self.sun
        self.v, self.n, self.pitch, self.q, self.rate, self.climb = 8., 1.9, 0., 0., 0., 0.
        self.pressure, self.wind_n, self.wind_e = 400 + r.gauss(0, 10), r.gauss(0, 2), r.gauss(0, 2)
        self.gust = self.veer = self.nod = self.rise = self.seep = self.load = self.amp = 0.
        self.trim, self.hold, self.keep, self.leg, self.up = .65, 0., .66, 0, 0.
        self.to = [(r.uniform(-500, 500), r.uniform(-500, 500), r.uniform(70, 200),
                    r.uniform(7.5, 11)) for _ in range(50)]

    def pilot(self, t):
        n, e, h, v = self.to[self.leg]
        if math.hypot(n - self.north, e - self.east) < 60:
            self.leg = (self.leg + 1) % len(self.to)
        off = wrap(math.atan2(e - self.east, n - self.north) - self.heading)
        slow, miss = v - self.v, clip(h - self.height, -40, 40)
        self.trim = clip(self.trim + .001 * slow, .4, .9)
        self.hold = clip(self.hold + .00004 * miss, -.15, .15)
        self.keep = clip(self.keep + .00003 * (400 - self.pressure), .3, .95)
        up = clip(self.hold + .007 * miss - .10 * self.climb - .3 * self.q, -.35, .35)
        return (clip(self.trim + .12 * slow, .2, 1.), clip(.8 * off - 3 * self.rate, -.4, .4), up,
                clip(self.keep + .003 * (400 - self.pressure), 0., 1.))

    def inside(self, fault, p):
        if fault == "belt":
            return self.n > 2.05 + .15 * p[0]
        return fault != "elevator" or self.up > .04 + .04 * p[0]

    def step(self, u, w, a):
        dt, belt = self.RATE, a.get("belt", 0.)
        self.gust += .008 * w[0] - .06 * self.gust
        self.veer += .001 * w[1] - .08 * self.veer
        self.nod += .002 * w[2] - .1 * self.nod
        self.rise += .02 * w[3] - .03 * self.rise
        self.seep += .03 * w[4] - .05 * self.seep
        self.wind_n += .01 * w[5] - .001 * self.wind_n
        self.wind_e += .01 * w[6] - .001 * self.wind_e
        self.clear = clip(self.clear + .012 * w[7] + .0006 * (.65 - self.clear), .15, 1.)
        self.load += .1 * w[8] - .05 * self.load
        self.sun = 600 * self.clear
        warm = dt * (.009 * self.sun + self.air - self.gas) / 90
        self.gas += warm
        self.n += dt / .8 * (3.1 * u[0] - self.n)
        self.up += dt / .5 * (u[2] - self.up)
        thrust = self.push * self.n * (self.n - .06 * self.v) * (1 - belt)
        slide = self.drag * self.v ** 2 * (1 + 2 * abs(self.rate))
        self.v += dt * ((thrust - slide) / 450 + self.gust)
        self.rate += dt * ((self.fin * self.v * u[1] - self.rate) / 3 + self.veer)
        moment = self.tail * self.up * (self.v / 9) ** 2 * (1 - a.get("elevator", 0.))
        self.q += dt * (.36 * (moment - self.pitch) - .6 * self.q + self.nod)
        self.pitch += dt * self.q
        lift = 8.5 * (self.gas - self.air - 3.5) - self.heavy - 35 * a.get("rain", 0.)
        want = self.v * math.sin(self.pitch) + lift / 150 + self.rise
        self.climb += dt / 3 * (want - self.climb)
        self.pressure += dt * (self.fan * u[3] * (1 - a.get("blower", 0.)) - .05 * self.pressure
                               + .5 * self.climb + self.seep) + 40 * warm
        self.height += dt * self.climb
        self.heading = wrap(self.heading + dt * self.rate)
        flat = self.v * math.cos(self.pitch)
        self.north += dt * (flat * math.cos(self.heading) + self.wind_n)
        self.east += dt * (flat * math.sin(self.heading) + self.wind_e)
        self.air += .004 * w[7] * .5
        work = 3.2 * self.n ** 2 * (self.n - .03 * self.v) * (1 - .6 * belt)
        self.amp = 3 + self.amps * work + 5 * u[3] + self.load

    def sense(self):
        return (self.north, self.east, self.height, self.heading, self.rate, self.pitch, self.v,
                self.climb, 1000 * self.n, self.amp, self.pressure, self.gas, self.air, self.sun)


class Greenhouse:
    """The greenhouse, per square metre of floor; a row a minute for 40 hours."""
    RATE, LENGTH, NOISES = 60., 2400, 9
    COLUMNS = ["t_s", "u.heat", "u.vent", "u.mist", "u.dose", "s.air_degC", "s.pipe_degC",
               "s.floor_degC", "s.vapour_gpm3", "s.co2_ppm", "s.tank_m", "s.outside_degC",
               "s.dew_gpm3", "s.sun_Wpm2", "s.windspeed_mps"]
    SIGMA = dict(air=.15, pipe=.4, floor=.1, vapour=.2, co2=15., tank=.008, outside=.15, dew=.1,
                 sun=6., windspeed=.4)
    TYPICAL = dict(co2=600.)
    PHYSICAL = {
        "pane": (.22, .30, dict(air=-1, vapour=-1, co2=-1), ()),
        "pump": (.07, .10, dict(pipe=-1, air=-1), ()),
        "nozzle": (.20, .28, dict(vapour=-1, air=1, tank=1), ("u.mist",)),
        "vent": (.16, .22, dict(air=1, vapour=1, co2=1), ("u.vent", "s.windspeed_mps")),
    }
    FAULTS = ("bias:air", "drift:vapour", "gain:co2", "noise:pipe",
              "pane", "pump", "nozzle", "vent")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .005))
        self.boiler, self.wall, self.leak, self.spray = few(4.), few(5.), few(.0008), few(.07)
        self.crop, self.eat, self.gas, self.open = few(1.), few(1.), few(1.), few(.012)
        self.clock, self.season = r.uniform(0, 24), r.gauss(7, 1.5)
        self.air, self.floor, self.pipe = 18 + r.gauss(0, 1), 18 + r.gauss(0, .7), 40.
        self.vapour, self.co2 = 10 + r.gauss(0, .7), 600 + r.gauss(0, 60)
        self.tank = r.uniform(2, 2.6)
        self.cold, self.cloud, self.wind, self.dew = r.gauss(0, 1), r.uniform(.3, .9), 4., 5.
        self.outside, self.sun, self.draught, self.leaf = self.season, 0., 0., 0.
        self.flue = self.breath = self.haze = self.sum = 0.
        self.want = [(r.gauss(19.5, .5), r.gauss(16.5, .5), r.gauss(780, 50), r.gauss(14.4, .4))
                     for _ in range(5)]

    def pilot(self, t):
        day, night, rich, damp = self.want[int((self.clock + t / 3600) / 24)]
        light = 6.5 < (self.clock + t / 3600) % 24 < 19
        cold = (day if light else night) - self.air
        self.sum = clip(self.sum + .002 * cold, -.2, .6)
        vent = clip(.15 * (-cold - 1.5) + .04 * max(0, self.vapour - 14), 0., 1.)
        mist = clip(.35 * (damp - self.vapour), 0., 1.) if light else 0.
        return (clip(.3 * cold + self.sum + .2, 0., 1.), vent, mist,
                clip(.003 * (rich * (1 - .2 * vent) - self.co2) + .3, 0., 1.) if light else 0.)

    def inside(self, fault, p):
        if fault == "vent":
            return self.asked > .08 and self.wind > 2.5 + p[0]
        return fault != "nozzle" or self.mist > .05 + .08 * p[0]

    asked = mist = 0.

    def step(self, u, w, a):
        dt = self.RATE
        hour = (self.clock + self.haze_t) % 24
        self.haze_t += dt / 3600
        self.cold += .03 * w[0] - .002 * self.cold
        self.cloud = clip(self.cloud + .03 * w[1] + .01 * (.65 - self.cloud), .1, 1.)
        self.wind = abs(self.wind + .15 * w[2] - .01 * (self.wind - 4))
        self.dew = clip(self.dew + .02 * w[3] - .004 * (self.dew - 5), 2., 7.5)
        self.leaf += .02 * w[4] - .04 * self.leaf
        self.draught += .03 * w[5] - .06 * self.draught
        self.flue += .3 * w[6] - .05 * self.flue
        self.breath += .012 * w[7] - .05 * self.breath
        self.haze += 1.5 * w[8] - .1 * self.haze
        self.outside = self.season + 4 * math.sin((hour - 9) * math.pi / 12) + self.cold
        self.sun = 550 * self.cloud * max(0., math.sin((hour - 6.5) * math.pi / 12))
        self.asked, self.mist = u[1], u[2]
        gap = u[1] * (1 - a.get("vent", 0.))
        q = self.leak * (1 + .06 * self.wind + a.get("pane", 0.)) * math.exp(self.draught) \
            + self.open * gap * (.4 + .12 * self.wind)
        warm = 3 * (self.pipe - self.air)
        spray = self.spray * u[2] * (1 - a.get("nozzle", 0.))
        sweat = (.006 + .00005 * self.sun) * self.crop * math.exp(self.leaf)
        self.pipe += dt * ((self.boiler * (1 - a.get("pump", 0.)) * u[0] * (85 - self.pipe)
                            - warm) + self.flue) / 4000
        heat = warm + .6 * self.sun + 5 * (self.floor - self.air) + self.haze \
            - self.wall * (1 + .03 * self.wind) * (self.air - self.outside) \
            - 1200 * q * (self.air - self.outside) - 2450 * (spray + sweat)
        self.floor += dt * (5 * (self.air - self.floor) + .05 * self.sun) / 200000
        full = 5.0 * math.exp(.062 * (.7 * self.air + .3 * self.outside))
        self.vapour += dt / 4 * (sweat + spray - q * (self.vapour - self.dew)
                                 - .002 * max(0., self.vapour - full))
        grow = .45 * self.eat * self.sun / (self.sun + 250) * self.co2 / 800
        self.co2 += dt / 4 * (.9 * self.gas * u[3] + .05 - grow + self.breath
                              - q * (self.co2 - 420))
        self.air += dt * heat / 30000
        self.tank -= dt * spray / 4000

    haze_t = 0.

    def sense(self):
        return (self.air, self.pipe, self.floor, self.vapour, self.co2, self.tank, self.outside,
                self.dew, self.sun, self.wind)


class Crane:
    """The crane. Metres, m/s, tonnes, A; five rows a second for nearly nine minutes."""
    RATE, LENGTH, NOISES = .2, 2600, 6
    COLUMNS = ["t_s", "u.trolley", "u.hoist", "s.trolley_m", "s.rope_m", "s.tspeed_mps",
               "s.hspeed_mps", "s.swing_rad", "s.load_t", "s.itrolley_A", "s.ihoist_A",
               "s.drive_degC", "s.bus_V", "s.windspeed_mps"]
    SIGMA = dict(trolley=.02, rope=.02, tspeed=.01, hspeed=.008, swing=.004, load=.06, itrolley=.5,
                 ihoist=.7, drive=.4, bus=1.5, windspeed=.4)
    TYPICAL = dict(ihoist=45.)
    PHYSICAL = {
        "contact": (.8, 1.1, dict(bus=-1), ()),
        "brake": (.40, .55, dict(itrolley=1), ()),
        "rail": (.40, .60, dict(itrolley=1), ("s.trolley_m",)),
        "gear": (.045, .065, dict(ihoist=1), ("u.hoist", "s.hspeed_mps", "s.load_t")),
    }
    FAULTS = ("bias:load", "drift:swing", "gain:ihoist", "stuck:bus",
              "contact", "brake", "rail", "gear")

    def __init__(self, r):
        few = lambda x: x * (1 + r.gauss(0, .004))
        self.mass, self.roll = few(8.), .008 * (1 + r.gauss(0, .02))
        self.kt, self.kh = few(8.), few(.62)
        self.eta, self.ohm, self.cool = few(.86), few(.07), few(1.)
        self.place, self.rope, self.load = r.uniform(2, 38), 5., 0.
        self.v = self.h = self.acc = self.pull = self.swing = self.spin = self.it = self.ih = 0.
        self.wind, self.grid, self.ambient = abs(r.gauss(4, 2)), r.gauss(0, 1), 15 + r.gauss(0, 4)
        self.drive, self.rough, self.rub = self.ambient + r.uniform(5, 25), 0., 0.
        self.phase, self.until, self.fast = 0, r.uniform(2, 8), 1.
        self.jobs = [(r.uniform(1, 39), r.uniform(9, 14), r.uniform(1.5, 12), r.uniform(.75, 1.),
                      r.uniform(1.5, 5)) for _ in range(60)]

    def pilot(self, t):
        """Phases: travel at height, lower, wait and take or leave the load, lift."""
        to, deep, heavy, self.fast, stay = self.jobs[0]
        go = lift = 0.
        if t < self.until:
            return 0., 0.
        if self.phase == 0:
            go = clip(.4 * (to - self.place) + 1.2 * self.swing, -self.fast, self.fast)
            if abs(to - self.place) < .08 and abs(self.swing) < .02 and abs(self.v) < .05:
                self.phase = 1
        elif self.phase == 1:
            lift = clip(.8 * (deep - self.rope), -.4, self.fast)
            if abs(deep - self.rope) < .06:
                self.load, self.phase, self.until = (0. if self.load else heavy), 2, t + stay
        else:
            lift = clip(.8 * (5 - self.rope), -self.fast * (1 - .03 * self.load), .4)
            if abs(5 - self.rope) < .06:
                self.phase, self.until = 0, t + .3 * stay
                self.jobs.pop(0)
        return go, lift

    def inside(self, fault, p):
        if fault == "rail":
            return 8 + 10 * p[0] < self.place < 18 + 10 * p[0]
        return fault != "gear" or (self.h < -.1 and self.load > 1.5 + p[0])

    def step(self, u, w, a):
        dt, m = self.RATE, self.load + .8
        self.wind = abs(self.wind + .06 * w[0] - .01 * (self.wind - 4))
        self.grid += .04 * w[1] - .01 * self.grid
        self.rough += .02 * w[2] - .1 * self.rough
        self.rub += .006 * w[3] - .06 * self.rub
        self.acc = clip((1.5 * u[0] - self.v) / .5, -.3, .3)
        self.v += dt * self.acc
        lift = clip((.8 * u[1] - self.h) / .4, -.4, .4)
        self.h += dt * lift
        self.place += dt * self.v
        self.rope += dt * self.h
        blow = .0012 * self.wind ** 2 / m + .01 * w[4]
        self.spin += dt * (-G * self.swing - self.acc - 2 * self.h * self.spin + blow) / self.rope
        self.spin *= 1 - .03 * dt
        self.swing += dt * self.spin
        drag = self.roll * (self.mass + m) * G * (1 + self.rough + a.get("rail", 0.)
                                                  + a.get("brake", 0.)) * math.tanh(self.v / .03)
        force = self.mass * self.acc + drag - m * G * self.swing - .003 * self.wind ** 2
        self.it = math.hypot(4., self.kt * force)
        moving = math.tanh(abs(self.h) / .04)
        heave = m * (G - lift)
        gear = (1 + a.get("gear", 0.)) * (1 + self.rub)
        hold = heave / self.eta * gear if self.h < 0 else heave * self.eta * (1 + self.rub)
        self.ih = math.hypot(1 + 9 * moving, self.kh * hold * moving)
        self.bus = 565 + self.grid - self.ohm * (1 + a.get("contact", 0.)) * (8 + self.it + self.ih)
        heat = .0022 * (self.it ** 2 + self.ih ** 2) + .3
        self.drive += dt * (heat - .12 * self.cool * (self.drive - self.ambient)) / 25
        self.cell = m * (1 - lift / G) + .01 * w[5]

    def sense(self):
        return (self.place, self.rope, self.v, self.h, self.swing, self.cell, self.it, self.ih,
                self.drive, self.bus, self.wind)


CLASS = {"ferry": Ferry, "airship": Airship, "greenhouse": Greenhouse, "crane": Crane}
VEHICLES = tuple(CLASS)
FAULTS = {v: c.FAULTS for v, c in CLASS.items()}
RATE = {v: c.RATE for v, c in CLASS.items()}
LENGTH = {v: c.LENGTH for v, c in CLASS.items()}
COLUMNS = {v: c.COLUMNS for v, c in CLASS.items()}
run = Drawn("fleet", CLASS, many=(3, 5), drift=1.2, turns=("heading", "windangle")).run
