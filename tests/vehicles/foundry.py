# SPDX-License-Identifier: MIT
"""Four machines of a works, drawn by somebody who had not seen the monitor.

  joints    shoulder and elbow of an industrial robot: gear friction, gravity, payload by task      (.05 s, 3000 rows)
  airplane  a small electric aeroplane under an autopilot, in gusts and thermals                     (.1 s, 2800 rows)
  heatpump  an air-to-water heat pump with modulating and on/off control, radiators, a house         (60 s, 2160 rows)
  tram      a tram on a line with stops, gradients and substations, passengers who come and go       (.5 s, 1600 rows)

run(vehicle, seed, fault) -> (columns, rows, truth):
truth: None, or dict(columns: {accepted outcome: sign of measured less nominal, or 0}, size: None or value, onset: seconds,
rows: 0/1 for every row, features: names that describe the region, or (), kinds: None or accepted kinds).
Sensor faults do not act on the control loops; physical faults do.

  python3 foundry.py [vehicle...]    prints ranges of healthy runs, the unpredictable part of every sensor, and how strongly
                                     every fault moves every sensor against a twin without the fault, in units of that part.
"""
import copy, math, random, sys

VEHICLES = ("joints", "airplane", "heatpump", "tram")
FAULTS = {
    "joints": ("bias:i2", "gain:i1", "drift:temp2", "noise:qd1", "stuck:i2", "friction1", "up2", "magnet1", "cable2", "heavy1"),
    "airplane": ("gain:airspeed", "bias:roll", "drift:current", "noise:pitchrate", "stuck:heading", "propeller", "icing",
                 "aileron_right", "elevator_slip", "cell"),
    "heatpump": ("bias:return", "gain:flow", "drift:supply", "noise:power", "stuck:evaporator", "refrigerant", "frost",
                 "bearing_fast", "window", "pump_wear"),
    "tram": ("bias:current", "gain:speed", "drift:brake", "noise:voltage", "stuck:speed", "traction_loss", "slippery",
             "regen_weak", "contact", "heavy_drag"),
}
RATE = {"joints": .05, "airplane": .1, "heatpump": 60.0, "tram": .5}
LENGTH = {"joints": 3000, "airplane": 2800, "heatpump": 2160, "tram": 1600}
COLUMNS = {
    "joints": ["t_s", "u.ref1_rad", "u.ref2_rad", "u.payload_kg", "s.q1_rad", "s.q2_rad", "s.qd1_radps", "s.qd2_radps",
               "s.i1_A", "s.i2_A", "s.temp1_degC", "s.temp2_degC"],
    "airplane": ["t_s", "u.throttle", "u.elevator_rad", "u.aileron_rad", "s.airspeed_mps", "s.altitude_m", "s.climb_mps",
                 "s.pitch_rad", "s.roll_rad", "s.heading_rad", "s.pitchrate_radps", "s.rollrate_radps", "s.current_A", "s.battery_V"],
    "heatpump": ["t_s", "u.compressor_pct", "u.pump_pct", "u.roomset_degC", "s.outdoor_degC", "s.supply_degC", "s.return_degC",
                 "s.room_degC", "s.evaporator_degC", "s.flow_lpm", "s.power_kW"],
    "tram": ["t_s", "u.traction", "u.braking", "u.load_kg", "s.position_m", "s.speed_mps", "s.current_A", "s.voltage_V",
             "s.brake_bar", "s.motor_degC"],
}
SIGMA = {  # white noise of the sensors
    "joints": dict(q1=.001, q2=.001, qd1=.01, qd2=.012, i1=.12, i2=.1, temp1=.15, temp2=.15),
    "airplane": dict(airspeed=.25, altitude=.35, climb=.15, pitch=.006, roll=.006, heading=.012, pitchrate=.015, rollrate=.015,
                     current=.2, battery=.03),
    "heatpump": dict(outdoor=.15, supply=.12, room=.05, evaporator=.2, flow=.25, power=.03, **{"return": .12}),
    "tram": dict(position=.6, speed=.06, current=6.0, voltage=2.0, brake=.03, motor=.3),
}
NO_SCALE = {"heading", "roll", "pitch", "q1", "q2", "position"}  # encoders, attitudes and balises have no scale error
GAIN = {"i1": (.05, .08), "airspeed": (.05, .08), "flow": (.05, .08), "speed": (.03, .04)}
HOLD = {"speed": 3}  # rows a stuck reading lasts; five otherwise
G = 9.81


def short(c):
    return c[2:].rsplit("_", 1)[0] if "_" in c else c[2:]


def column(vehicle, name):
    return next(c for c in COLUMNS[vehicle] if c.startswith("s.") and short(c) == name)


def wrap(a):
    return (a + math.pi) % (2 * math.pi) - math.pi


def clip(x, lo, hi):
    return lo if x < lo else hi if x > hi else x


class Machine:
    """command(t) sets u; per substep disturb() sets d, then step() moves on; read() gives the true sensor values.

    f: strengths of the physical faults that act now. view(): what their conditions look at.
    """
    def prepare(self, r):
        self.r, self.f, self.d, self.u = r, {}, (), ()

    def row_begins(self):
        pass

    def still(self):
        """The disturbances if nothing new came."""
        return self.d

    def vary(self, x, share=.004):
        return x * (1 + self.r.gauss(0, share))

    def walk(self, x, sd, tau):
        """A step of a slowly changing disturbance: standard deviation sd, correlation time tau."""
        a = math.exp(-self.h / tau)
        return x * a + self.r.gauss(0, sd * math.sqrt(1 - a * a))


class Joints(Machine):
    h, sub = .01, 5

    def __init__(self, r):
        self.prepare(r)
        v = self.vary
        self.m1, self.c1, self.l1, self.j1 = v(18), v(.22), .45, 2.2
        self.m2, self.c2, self.l2, self.j2 = v(9), v(.18), .42, .7
        self.k1, self.k2 = v(11.0), v(6.0)                       # Nm a ampere at the joint
        self.fc1, self.fc2, self.fv1, self.fv2 = v(11.0, .015), v(5.0, .015), v(9.0, .015), v(4.0, .015)
        self.load = v(1.0, .003)                                 # payload scale: the tasks' book is nearly right
        self.amb = 23 + r.gauss(0, 1.5)
        self.t1, self.t2 = self.amb + r.uniform(4, 16), self.amb + r.uniform(4, 14)
        self.stations = dict(pick=[(.35, -1.0), (.55, -1.5), (.25, -.6)], place=[(1.15, -1.9), (.8, -.7), (1.3, -1.1), (.95, -1.5)])
        self.q1, self.q2 = 1.0, -1.3
        self.w1 = self.w2 = self.s1 = self.s2 = self.a1 = self.a2 = 0.0
        self.d = (0.0, 0.0)
        self.u = self.last = (self.q1, self.q2, 0.0)
        self.legs, self.end, self.payload, self.carry = [], 1.0, 0.0, 0
        self.move = (0.0, 1.0, (self.q1, self.q2), (self.q1, self.q2))

    def command(self, t):
        r = self.r
        if t >= self.end:  # the next leg of a task; what is held changes while at rest
            if self.carry == 0:
                kind, self.payload = "pick", 0.0
            else:
                kind, self.payload = "place", r.choice((1.5, 3.0, 4.5, 6.0, 7.0))
            self.carry = 1 - self.carry
            to = r.choice(self.stations[kind])
            to = (to[0] + r.gauss(0, .05), to[1] + r.gauss(0, .07))
            far = max(abs(to[0] - self.move[3][0]), abs(to[1] - self.move[3][1]))
            T = max(.9, far * r.uniform(1.5, 2.4))
            self.move = (t, T, self.move[3], to)
            self.end = t + T + r.uniform(.4, 1.0)
        t0, T, a, b = self.move
        x = clip((t - t0) / T, 0, 1)
        x = x ** 3 * (10 - 15 * x + 6 * x * x)
        self.last = self.u
        self.u = (a[0] + (b[0] - a[0]) * x, a[1] + (b[1] - a[1]) * x, self.payload)

    def row_begins(self):
        self.a1 = self.a2 = 0.0
        self.n = 0

    def disturb(self):
        self.d = (self.walk(self.d[0], .8, .6), self.walk(self.d[1], .4, .6))

    def step(self):
        f, h, (ra, rb, mp) = self.f, self.h, self.u
        la, lb, _ = self.last
        self.n += 1
        x = self.n / self.sub
        va, vb = (ra - la) / (h * self.sub), (rb - lb) / (h * self.sub)
        e1, e2 = la + (ra - la) * x - self.q1, lb + (rb - lb) * x - self.q2
        self.s1, self.s2 = self.s1 + e1 * h, self.s2 + e2 * h
        ml = mp * self.load
        c1, c12, c2, s2 = math.cos(self.q1), math.cos(self.q1 + self.q2), math.cos(self.q2), math.sin(self.q2)
        ff2 = (9 * .18 + mp * .42) * G * c12
        ff1 = (18 * .22 + (9 + mp) * .45) * G * c1 + ff2
        # what the drives ask of the motors; a weak magnet gives less for the same current
        i1 = (ff1 + 1800 * e1 + 230 * (va - self.w1) + 2500 * self.s1) / 11.0
        i2 = (ff2 + 420 * e2 + 52 * (vb - self.w2) + 700 * self.s2) / 6.0
        tau1 = i1 * self.k1 * (1 - f.get("magnet1", 0) - f.get("heavy1", 0))
        tau2 = i2 * self.k2
        g2 = (self.m2 * self.c2 + ml * self.l2) * G * c12
        g1 = (self.m1 * self.c1 + (self.m2 + ml) * self.l1) * G * c1 + g2
        w1, w2 = self.w1, self.w2
        warm1, warm2 = 1 - .006 * (self.t1 - 35), 1 - .006 * (self.t2 - 35)
        fr1 = (self.fc1 + f.get("friction1", 0) + .03 * abs(g1)) * math.tanh(w1 / .04) + self.fv1 * warm1 * w1
        fr2 = (self.fc2 + .03 * abs(g2) + (f.get("up2", 0) if w2 > 0 else 0)) * math.tanh(w2 / .04) + self.fv2 * warm2 * w2
        n1 = tau1 - g1 - fr1 + self.d[0]
        n2 = tau2 - g2 - fr2 + self.d[1] + f.get("cable2", 0)
        k = (self.m2 * self.c2 + ml * self.l2) * self.l1
        n1 += k * s2 * (2 * w1 * w2 + w2 * w2)
        n2 -= k * s2 * w1 * w1
        m22 = self.j2 + .12 + self.m2 * self.c2 ** 2 + ml * self.l2 ** 2
        m12 = .12 + self.m2 * self.c2 ** 2 + ml * self.l2 ** 2 + k * c2
        m11 = self.j1 + .5 + self.m1 * self.c1 ** 2 + (self.m2 + ml) * self.l1 ** 2 + m22 - self.j2 + 2 * k * c2
        det = m11 * m22 - m12 * m12
        self.w1 += h * (m22 * n1 - m12 * n2) / det
        self.w2 += h * (m11 * n2 - m12 * n1) / det
        self.q1 += h * self.w1
        self.q2 += h * self.w2
        self.a1 += i1 / self.sub
        self.a2 += i2 / self.sub
        self.t1 += h / 90 * (.30 * i1 * i1 - (self.t1 - self.amb))
        self.t2 += h / 70 * (1.1 * i2 * i2 - (self.t2 - self.amb))

    def read(self):
        return self.q1, self.q2, self.w1, self.w2, self.a1, self.a2, self.t1, self.t2

    def view(self):
        return dict(q2=self.q2, w2=self.w2, payload=self.u[2])


class Airplane(Machine):
    h, sub = .02, 5

    def __init__(self, r):
        self.prepare(r)
        v = self.vary
        self.m, self.S, self.cl0, self.cla, self.cd0, self.k = v(3.2, .003), .55, v(.28), v(4.8), v(.032, .008), v(.05)
        self.thrust, self.amps, self.res = v(1.0), v(1.0), v(.022, .01)
        self.mde, self.lda, self.trim = v(.8), v(60.0), r.gauss(0, .0015)
        self.V, self.gam, self.th, self.q, self.phi, self.p = 16.0, 0.0, .02, 0.0, 0.0, 0.0
        self.psi, self.alt = r.uniform(-3.1, 3.1), r.uniform(90, 150)
        self.charge, self.I, self.thr, self.bat = r.uniform(.93, 1.0), 4.0, .45, 16.0
        self.d = (0.0, 0.0, 0.0, 0.0, 0.0)  # gust along, thermal, their change a substep, roll
        self.gusty = r.uniform(.45, .7)
        self.climb, self.ie, self.it, self.next = 0.0, 0.0, 0.0, r.uniform(8, 15)
        self.ref = [self.psi, self.alt, 16.0]

    def command(self, t):
        r = self.r
        if t >= self.next:
            self.next = t + r.uniform(14, 30)
            what = r.random()
            if what < .75:
                self.ref[0] = wrap(self.ref[0] + r.uniform(-2.6, 2.6))
            if what > .45:
                self.ref[1] = r.uniform(70, 190)
            if r.random() < .4:
                self.ref[2] = r.uniform(14.5, 19)
        dt = self.h * self.sub
        self.climb += clip(clip(.12 * (self.ref[1] - self.alt), -2.2, 2.0) - self.climb, -.08, .08)
        climb = self.climb
        pitch = clip(climb / self.V + .04 * (climb - self.V * math.sin(self.gam) - self.d[1]), -.25, .25) + .02
        e = pitch - self.th
        self.ie = clip(self.ie + .25 * e * dt, -.12, .12)
        elevator = clip(.7 * e - .12 * self.q + self.ie + .06 * (1 / math.cos(self.phi) - 1), -.35, .35)
        ev = self.ref[2] - self.V
        throttle = .42 + .07 * ev + self.it + .22 * climb / 2 + .03 * (self.ref[2] - 16)
        if 0 < throttle < 1:
            self.it = clip(self.it + .012 * ev * dt, -.25, .25)
        bank = clip(1.1 * wrap(self.ref[0] - self.psi), -.6, .6)
        aileron = clip(.22 * (bank - self.phi) - .03 * self.p, -.3, .3)
        self.u = (clip(throttle, 0, 1), elevator, aileron)

    def disturb(self):
        a, w = self.walk(self.d[0], self.gusty, 9.0), self.walk(self.d[1], self.gusty, 11.0)
        self.d = (a, w, a - self.d[0], w - self.d[1], self.r.gauss(0, .45))

    def still(self):
        return self.d[0], self.d[1], 0.0, 0.0, 0.0

    def step(self):
        f, h, (thr, de, da) = self.f, self.h, self.u
        self.thr += h / .15 * (thr - self.thr)
        V, qS = self.V, .6 * self.V * self.V * self.S
        alpha = self.th - self.gam
        cl = self.cl0 + self.cla * alpha
        lift, drag = qS * cl, qS * (self.cd0 + f.get("icing", 0) + self.k * cl * cl)
        T = self.thrust * (1 - f.get("propeller", 0)) * max(0.0, 19 * self.thr ** 1.5 * (1 - .02 * V))
        self.V += h * ((T * math.cos(alpha) - drag) / self.m - G * math.sin(self.gam)) - self.d[2] * math.cos(self.gam) - self.d[3] * math.sin(self.gam)
        gd = ((lift + T * math.sin(alpha)) * math.cos(self.phi) / self.m - G * math.cos(self.gam)) / V
        self.gam += h * gd - self.d[3] / V
        turn = (lift * math.sin(self.phi) / self.m) / (V * math.cos(self.gam))
        x = qS * .22 / .18
        self.q += h * (x * (-.5 * (alpha - .02) + self.mde * (de + self.trim + f.get("elevator_slip", 0))) - 9.5 * V / 16 * self.q
                       + 9.5 * V / 16 * turn * math.sin(self.phi) * .7)
        self.th += h * (self.q * math.cos(self.phi) - turn * math.sin(self.phi) * .7)
        weak = 1 - f.get("aileron_right", 0) if da > 0 else 1
        self.p += h * (-8 * V / 16 * self.p + self.lda * weak * (V / 16) ** 2 * da - .25 * math.sin(self.phi) + self.d[4])
        self.phi += h * self.p
        self.psi = wrap(self.psi + h * turn)
        self.alt += h * (V * math.sin(self.gam) + self.d[1])
        self.I = self.amps * (.6 + 24 * self.thr ** 2.3 * (1 - .008 * V))
        self.charge -= h * self.I / (5.0 * 3600)
        self.bat = 14.2 + 2.4 * self.charge - self.I * (self.res + f.get("cell", 0))

    def read(self):
        return (self.V, self.alt, self.V * math.sin(self.gam) + self.d[1], self.th, self.phi, self.psi, self.q, self.p, self.I, self.bat)

    def view(self):
        return dict(alt=self.alt, aileron=self.u[2])


class Heatpump(Machine):
    h, sub = 10.0, 6

    def __init__(self, r):
        self.prepare(r)
        v = self.vary
        self.cap, self.cop, self.lpm = v(9.0), v(.48), v(24.0)
        self.ce, self.ue, self.cr, self.uv, self.uw = v(320.0), v(.33), v(6000.0), v(.08, .02), v(.24, .01)
        self.start, self.base, self.amp = r.uniform(0, 24), 8 + r.gauss(0, 1.0), 5 + r.gauss(0, .6)
        self.now, self.d = 0.0, (0.0, 0.0)  # weather's own course, cloud
        self.out = self.weather(0.0)
        self.room, self.wall = 20 + r.gauss(0, .4), 17.5 + r.gauss(0, .3)
        self.ts = self.tr = self.te = 28 + r.gauss(0, 2)
        self.tr_pipe, self.ev, self.qc, self.fl, self.pw = self.tr, self.out, 0.0, 9.0, .1
        self.on, self.since, self.comp, self.i, self.pump = False, -900.0, 0.0, 0.0, 40.0
        self.sunny = r.uniform(.3, 1.1)

    def weather(self, x):
        hour = self.start + self.now / 3600
        return self.base + self.amp * math.sin((hour - 9) / 24 * 2 * math.pi) + x

    def command(self, t):
        hour = (self.start + t / 3600) % 24
        roomset = 21.0 if 5.5 < hour < 22 else 19.0
        want = clip(27 + .85 * (20 - self.out) + 3.0 * (roomset - self.room), 24, 50)
        e = want - self.ts
        if self.on and e < -3.5 and self.comp <= 38 and t - self.since > 600:
            self.on, self.since = False, t
        elif not self.on and e > 2.5 and t - self.since > 480:
            self.on, self.since, self.i = True, t, 35.0
        if self.on:
            self.i = clip(self.i + .25 * e, 10, 100)
            self.comp += clip(clip(self.i + 3.5 * e, 35, 100) - self.comp, -8, 12)
            self.comp = max(35.0, self.comp)
        else:
            self.comp = 0.0
        self.pump += clip(40 + .5 * self.comp - self.pump, -6, 6)
        self.u = (round(self.comp, 1), round(self.pump, 1), roomset)

    def disturb(self):
        self.now += self.h
        self.d = (self.walk(self.d[0], .6, 5400), self.walk(self.d[1], .35, 2400))
        self.out = self.weather(self.d[0])

    def step(self):
        f, h, (comp, pump, _) = self.f, self.h, self.u
        c, on = comp / 100, comp > 0
        a = f.get("refrigerant", 0)
        target = self.out - (3 + 6 * c + f.get("frost", 0) + 8 * a if on else 0)
        self.ev += h / 90 * (target - self.ev)
        hot = self.ts + 2 + 4 * c
        q = self.cap * c * (1 + .022 * self.ev)
        cop = self.cop * (hot + 273) / max(15.0, hot - self.ev + 2)
        self.qc += h / 60 * (q * (1 - a) - self.qc)
        self.fl += h / 15 * (self.lpm * pump / 100 * (1 - f.get("pump_wear", 0)) * (1 + .002 * (self.ts - 35)) - self.fl)
        mcp = self.fl / 60 * 4.18
        self.pw += h / 20 * ((q * (1 - .5 * a) / cop * (1 + f.get("bearing_fast", 0)) + .09 if on else 0) + .03 + .06 * (pump / 100) ** 3 - self.pw)
        self.ts += h / 70 * (self.qc - mcp * (self.ts - self.tr))
        heat = self.ue * (self.te - self.room)
        self.te += h / self.ce * (mcp * (self.ts - self.te) - heat)
        self.tr += h / 50 * (self.te - self.tr)
        hour = (self.start + self.now / 3600) % 24
        sun = max(0.0, math.sin((hour - 7) / 11 * math.pi)) * clip(self.sunny + self.d[1], 0, 1.6) if 7 < hour < 18 else 0.0
        self.room += h / self.cr * (heat + .35 + .8 * sun - (self.uv + f.get("window", 0)) * (self.room - self.out) - .8 * (self.room - self.wall))
        self.wall += h / 40000 * (.8 * (self.room - self.wall) - self.uw * (self.wall - self.out))

    def read(self):
        return self.out, self.ts, self.tr, self.room, self.ev, self.fl, self.pw

    def view(self):
        return dict(out=self.out, comp=self.u[0], on=self.u[0] > 0)


STOPS = [0, 520, 1180, 1650, 2380, 2900, 3490, 4210, 4690, 5380, 5920, 6600, 7200, 7750, 8400]
LIMITS = [12, 15, 11, 16, 13, 13, 16, 11, 15, 13, 15, 14, 13, 15]  # m/s after every stop


def gradient(x):
    return .022 * math.sin(x / 2300 * 2 * math.pi + .5) + .013 * math.sin(x / 870 * 2 * math.pi)


def feeder(x):
    """Ohms to the next substations."""
    y = (x - 400) / 2500
    return .018 + .05 * abs(y - round(y)) * 2


class Tram(Machine):
    h, sub = .1, 5

    def __init__(self, r):
        self.prepare(r)
        v = self.vary
        self.empty, self.fmax, self.pmax, self.fb = v(38000, .003), v(62000.0), v(420e3), v(58000.0)
        self.roll, self.air, self.eta, self.aux = v(.0042, .02), v(5.5, .03), v(.88, .003), v(25e3, .02)
        self.u0 = 640 + r.gauss(0, 2)
        self.book = 1 + r.gauss(0, .01)
        self.load, self.weigh = r.uniform(1500, 5000), 0.0
        self.x, self.v, self.F, self.E, self.bar = 0.0, 0.0, 0.0, 0.0, 3.0
        self.motor, self.I, self.U = 45 + r.gauss(0, 6), 40.0, 640.0
        self.d = (0.0, 0.0)  # line voltage, force of wind and rail
        self.stop, self.leave, self.coast, self.hand, self.zeal = 0, r.uniform(4, 10), False, 0.0, r.uniform(.85, 1.0)
        self.u_t = self.u_b = 0.0

    def command(self, t):
        r = self.r
        go, b = 0.0, 0.0
        if self.stop + 1 >= len(STOPS):
            b = .6
        elif t < self.leave:
            b = .6
            if self.weigh is not None and t > self.leave - self.weigh:  # doors open: out and in
                full = self.load * r.uniform(.35, .9) + r.uniform(200, 5200)
                self.load, self.weigh = clip(full, 300, 11500), None
        else:
            gap = STOPS[self.stop + 1] - self.x
            if gap < .8 or gap < 3 and self.v < .25:
                self.stop += 1
                self.leave, self.weigh = t + r.uniform(15, 27), r.uniform(5, 9)
                b = .6
            else:
                limit = LIMITS[self.stop] * self.zeal
                curve = math.sqrt(2 * .85 * max(.0, gap - .6)) + .15
                self.hand = .9 * self.hand + r.gauss(0, .012)
                if self.v > curve - .5 and self.v > .6:
                    b = clip(.58 + .35 * (self.v - curve) + self.hand, 0, 1)
                else:
                    if self.v > limit:
                        self.coast = True
                    if self.v < limit - 1.3:
                        self.coast = False
                    if self.coast:
                        b = clip(.3 * (self.v - limit - .7), 0, .5)
                    else:
                        go = clip(.5 * (min(limit + .8, curve) - self.v) + .1 + self.hand, 0, .9 * self.zeal)
        self.u_t += clip(go - self.u_t, -.35, .2)
        self.u_b += clip(b - self.u_b, -.3, .25)
        self.u = (round(self.u_t, 3), round(self.u_b, 3), 50.0 * round(self.load * self.book / 50))

    def disturb(self):
        self.d = (self.walk(self.d[0], 3.5, 25.0), self.walk(self.d[1], 250.0, 12.0))

    def step(self):
        f, h, v = self.f, self.h, self.v
        ut, ub, _ = self.u
        self.F += h / .4 * (ut * min(self.fmax, self.pmax / max(v, .5)) - self.F)
        ask = ub * self.fb
        elec = min(.85 * ask, 430e3 / max(v, .5)) * clip((v - 1.5) / 2, 0, 1)
        self.E += h / .3 * (elec - self.E)
        self.bar += h / .5 * (5.0 * max(0.0, ask - elec) / self.fb - self.bar)
        drive = self.F * (1 - f.get("traction_loss", 0)) * (1 - f.get("slippery", 0))
        regen = self.E * (1 - f.get("regen_weak", 0))
        mass = self.empty + self.load
        push = drive - mass * G * (gradient(self.x) + (self.roll if v > .05 else 0)) - self.air * v * v + (self.d[1] - f.get("heavy_drag", 0)) * (v > .5)
        hold = regen + self.fb * self.bar / 5.0
        if v < .05 and abs(push) < hold:
            self.v = 0.0
        else:
            self.v = max(0.0, v + h * (push - hold) / (mass * 1.0 + 3500))
        self.x += h * self.v
        power = drive * v / self.eta - .80 * regen * v + self.aux
        if f.get("slippery", 0):  # wheels that slip a little turn faster: the motors still take their power
            power = self.F * v / self.eta - .80 * regen * v + self.aux
        line = feeder(self.x) + f.get("contact", 0)
        e = self.u0 + self.d[0]
        root = math.sqrt(max(1e4, e * e - 4 * line * power))
        self.U = .5 * (e + root)
        self.I = power / self.U
        self.motor += h / 420 * (75 * ((self.F / 40e3) ** 2 + (self.E / 45e3) ** 2) + 25 - self.motor)

    def read(self):
        return self.x, self.v, self.I, self.U, self.bar, self.motor

    def view(self):
        return dict(x=self.x, load=self.u[2], braking=self.u[1], v=self.v)


CLASSES = {"joints": Joints, "airplane": Airplane, "heatpump": Heatpump, "tram": Tram}


def physical(vehicle, fault, r, onset):
    """(condition(state, t) -> strength, accepted outcomes with signs, onset, features) of a physical fault."""
    late = lambda size: lambda s, t: size if t >= onset else 0.0
    u = r.uniform
    if vehicle == "joints":
        if fault == "friction1":
            return late(u(5, 7)), dict(i1=0, q1=0), onset, ()
        if fault == "up2":
            a = u(2.6, 3.6)
            return (lambda s, t: a if s["w2"] > .06 else 0.0), dict(i2=1, q2=-1), 0.0, ("s.qd2_radps",)
        if fault == "magnet1":
            return late(u(.04, .06)), dict(i1=1, q1=-1), onset, ()
        if fault == "cable2":
            a, q = u(2.2, 3.2), u(-1.45, -1.25)
            return (lambda s, t: a if s["q2"] < q else 0.0), dict(i2=-1, q2=1), 0.0, ("s.q2_rad", "u.ref2_rad")
        if fault == "heavy1":
            a = u(.04, .06)
            return (lambda s, t: a if s["payload"] > 4 else 0.0), dict(i1=1, q1=-1), 0.0, ("u.payload_kg",)
    if vehicle == "airplane":
        if fault == "propeller":
            return late(u(.15, .2)), dict(airspeed=-1, altitude=-1, climb=-1, pitch=-1), onset, ()
        if fault == "icing":
            a, top = u(.008, .011), u(120, 130)
            return (lambda s, t: a if s["alt"] > top else 0.0), dict(airspeed=-1, altitude=-1, climb=-1, pitch=-1), 0.0, ("s.altitude_m",)
        if fault == "aileron_right":
            a = u(.12, .18)
            return (lambda s, t: a if s["aileron"] > .01 else 0.0), dict(rollrate=-1, roll=-1), 0.0, ("u.aileron_rad", "s.rollrate_radps")
        if fault == "elevator_slip":
            sign = r.choice((-1, 1))
            return late(sign * u(.003, .0045)), dict(pitch=sign, pitchrate=sign, climb=sign, altitude=sign, airspeed=-sign), onset, ()
        if fault == "cell":
            return late(u(.03, .04)), dict(battery=-1), onset, ()
    if vehicle == "heatpump":
        if fault == "refrigerant":
            return late(u(.06, .085)), dict(supply=-1, evaporator=-1, power=-1, **{"return": -1}), onset, ()
        if fault == "frost":
            a, cold = u(.8, 1.1), u(6.5, 8.0)
            return (lambda s, t: a if s["out"] < cold and s["on"] else 0.0), dict(evaporator=-1), 0.0, ("s.outdoor_degC",)
        if fault == "bearing_fast":
            a, fast = u(.07, .1), u(44, 49)
            return (lambda s, t: a if s["comp"] > fast else 0.0), dict(power=1), 0.0, ("u.compressor_pct",)
        if fault == "window":
            return late(u(.045, .06)), dict(room=-1), onset, ()
        if fault == "pump_wear":
            return late(u(.06, .08)), dict(flow=-1), onset, ()
    if vehicle == "tram":
        if fault == "traction_loss":
            return late(u(.05, .065)), dict(speed=-1, current=-1, position=-1), onset, ()
        if fault == "slippery":
            i = r.randrange(2, 7); a, x0 = u(.07, .10), STOPS[i] - u(30, 120); x1 = x0 + u(1100, 1400)
            return (lambda s, t: a if x0 < s["x"] < x1 else 0.0), dict(speed=-1, position=-1), 0.0, ("s.position_m",)
        if fault == "regen_weak":
            a = u(.06, .08)
            return (lambda s, t: a if s["braking"] > .1 and s["v"] > 2 else 0.0), dict(speed=1, current=1, position=1), 0.0, ("u.braking", "s.brake_bar")
        if fault == "contact":
            a, x0 = u(.028, .038), u(1000, 3200); x1 = x0 + u(1200, 1500)
            return (lambda s, t: a if x0 < s["x"] < x1 else 0.0), dict(voltage=0), 0.0, ("s.position_m",)
        if fault == "heavy_drag":
            a = u(1100, 1500)
            return (lambda s, t: a if s["load"] > 4500 and s["v"] > .5 else 0.0), dict(speed=-1, position=-1), 0.0, ("u.load_kg",)
    raise ValueError("no fault %r of %r" % (fault, vehicle))


def states(vehicle, seed, fault=None, effect=None, twin_rows=0, still=False):
    """Rows of (commands, true sensor values), where the physical effect acts; with twin_rows: (row, differences) to a twin
    without the fault which starts anew from the true state that often and gets the same commands and disturbances (or, still, the disturbances as they stood)."""
    m = CLASSES[vehicle](random.Random("foundry state %s %d" % (vehicle, seed)))
    out, acts, twins, twin = [], [], [], None
    for k in range(LENGTH[vehicle]):
        t = k * RATE[vehicle]
        if twin_rows and k % twin_rows == 0:
            if twin is not None:
                twins.append((k - 1, [a - b for a, b in zip(m.read(), twin.read())]))
            twin = copy.copy(m)
            twin.f = {}
            twin.d = twin.still()
        m.command(t)
        a = effect(m.view(), t) if effect else 0.0
        m.f = {fault: a} if a else {}
        acts.append(a != 0)
        if twin:
            twin.u = m.u
            if vehicle == "joints": twin.last = m.last
            if vehicle == "tram": twin.load = m.load
            twin.row_begins()
        m.row_begins()
        for _ in range(m.sub):
            m.disturb()
            m.step()
            if twin:
                if vehicle == "heatpump": twin.now = m.now
                if not still:
                    twin.d = m.d
                    if vehicle == "heatpump": twin.out = m.out
                twin.step()
        out.append(tuple(m.u) + tuple(m.read()))
    return out, acts, twins


def run(vehicle, seed, fault=None):
    r = random.Random("foundry fault %s %s %d" % (vehicle, fault, seed))
    cols, dt, n, sigma = COLUMNS[vehicle], RATE[vehicle], LENGTH[vehicle], SIGMA[vehicle]
    T = n * dt
    onset = r.uniform(.25, .5) * T
    kind, _, name = (fault or "").partition(":")
    effect = phys = None
    if fault and not name:
        effect, *phys = physical(vehicle, fault, r, onset)
    st, acts, _ = states(vehicle, seed, fault, effect)
    names = [short(c) for c in cols[1:]]
    sens = [i for i, c in enumerate(cols[1:]) if c.startswith("s.")]
    q = random.Random("foundry sensors %s %d" % (vehicle, seed))
    bias = [q.gauss(0, .3) * sigma.get(a, 0) for a in names]
    scale = [1 + (0 if a in NO_SCALE else q.gauss(0, .002)) for a in names]
    hit = next((i for i in sens if names[i] == name), -1)
    size = r.choice([-1, 1]) * r.uniform(3, 5) * sigma[name] if name else 0.0
    gain = r.choice([-1, 1]) * r.uniform(*GAIN.get(name, (.05, .08)))
    rows, mask, hold = [], [], None
    for k, s in enumerate(st):
        t = k * dt
        x = list(s)
        for i in sens:
            x[i] = x[i] * scale[i] + bias[i] + q.gauss(0, sigma[names[i]])
        on = bool(name) and t >= onset
        if on:
            if kind == "bias": x[hit] += size
            elif kind == "drift": x[hit] += 1.5 * size * (t - onset) / (T - onset)
            elif kind == "gain": x[hit] += gain * s[hit]
            elif kind == "noise": x[hit] += r.gauss(0, 1.5 * sigma[name])
            elif kind == "stuck":
                if hold is None or k % HOLD.get(name, 5) == 0: hold = x[hit]
                x[hit] = hold
            else: raise ValueError("no fault %r" % fault)
        for i in sens:
            if names[i] == "heading": x[i] = wrap(x[i])
        rows.append([t] + x)
        mask.append(int(on or acts[k]))
    truth = None
    if name:
        sgn = 1 if size > 0 else -1
        if kind == "gain":  # a channel that never changes sign is moved one way
            v = [s[hit] for s in st]
            sgn = (1 if gain > 0 else -1) * (1 if min(v) > -.1 * max(v) else -1 if max(v) < -.1 * min(v) else 0)
        truth = dict(columns={cols[hit + 1]: sgn if kind in ("bias", "drift", "gain") else 0}, onset=onset, rows=mask, features=(),
                     size=size if kind == "bias" else None, kinds={"noise": ("variance",), "stuck": ("repeat", "variance")}.get(kind))
    elif phys:
        sg, at, fe = phys
        truth = dict(columns={column(vehicle, a): b for a, b in sg.items()}, onset=at, rows=mask, features=fe, size=None, kinds=None)
    return cols, rows, truth


def main():
    window = {"joints": 10, "airplane": 40, "heatpump": 20, "tram": 16}
    rms = lambda v: math.sqrt(sum(x * x for x in v) / len(v)) if v else float("nan")
    for vehicle in sys.argv[1:] or VEHICLES:
        cols = COLUMNS[vehicle]
        runs = [run(vehicle, i)[1] for i in range(3)]
        sn = [short(c) for c in cols[1:] if c.startswith("s.")]
        new = [d for _, d in states(vehicle, 3, twin_rows=1, still=True)[2]]  # what a row brings that nobody could predict
        part = {n: math.hypot(1, rms([(wrap(d[i]) if n == "heading" else d[i]) for d in new]) / SIGMA[vehicle][n]) for i, n in enumerate(sn)}
        print("%s: %d rows of %g s" % (vehicle, LENGTH[vehicle], RATE[vehicle]))
        for j, c in enumerate(cols[1:], 1):
            parts = []
            for rows in runs:
                v = sorted(x[j] for x in rows)
                parts.append("%9.4g %9.4g %9.4g" % (v[0], v[len(v) // 2], v[-1]))
            print("  %-18s %s%s" % (c, " | ".join(parts), "   unpredictable in a row: %.2f sigma" % part[short(c)] if c[0] == "s" else ""))
        for fault in FAULTS[vehicle]:
            kind, _, name = fault.partition(":")
            if name:
                c, rows, truth = run(vehicle, 900, fault)
                healthy = run(vehicle, 900)[1]
                j = c.index(column(vehicle, name))
                d = [(a[j] - b[j]) / SIGMA[vehicle][name] for a, b, m in zip(rows, healthy, truth["rows"]) if m]
                if name == "heading": d = [wrap(x * .012) / .012 for x in d]
                print("  %-16s %s mean %+.1f, rms %.1f, end %+.1f sigma" % (fault, truth["columns"], sum(d) / len(d), rms(d), d[-1]))
                continue
            r = random.Random("foundry fault %s %s %d" % (vehicle, fault, 900))
            T = RATE[vehicle] * LENGTH[vehicle]
            effect, sg, at, fe = physical(vehicle, fault, r, r.uniform(.25, .5) * T)
            W = window[vehicle]
            _, acts, tw = states(vehicle, 900, fault, effect, W)
            ds = [d for k, d in tw if sum(acts[k - W + 1:k + 1]) > W / 2]
            print("  %-16s rows %4d, windows %3d: %s" % (fault, sum(acts), len(ds), "  ".join(
                "%s%s %+.1f/%.1f" % ("*" if n in sg else "", n, sum(v) / len(v), rms(v)) for i, n in enumerate(sn)
                for v in [[(wrap(d[i]) if n == "heading" else d[i]) / SIGMA[vehicle][n] for d in ds] or [0.0]] if rms(v) > .25)))


if __name__ == "__main__":
    main()
