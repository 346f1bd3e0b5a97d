# SPDX-License-Identifier: MIT
"""Five machines, drawn by somebody who knew the interface of a module of vehicles and nothing else.

run(vehicle, seed, fault) -> (columns, rows, truth), for grade.py --module. A fault is "kind:sensor"
or the name of a physical one. truth is None, or a dict: columns (accepted outcome -> sign of
measured less nominal, 0: none is defined), onset (seconds: the first faulty row), rows (0 or 1 per
row), features (accepted names for the region), size, kinds (accepted kinds or None).
  turbine   wind turbine: random wind, loops of torque and pitch, winding heated by losses, a fan
  aircraft  propeller aeroplane on autopilot: random legs, turns, speeds; phugoid
  loco      locomotive with train: random slopes, curves, limits, substations; driver in notches
  chiller   liquid chiller: compressor by hysteresis, random load and pump, saturated refrigerant
  leg       hexapod leg: one gait profile with jitter, compliant servos, foot contact
Sensor faults are in the logged reading alone: the controllers have transducers of their own. What
is drawn at random does not depend on the fault, so that a run with it and one without differ by the
fault alone. All faults, also those of a region, begin at 25 to 60 % of the run.
"""

import math, random

VEHICLES = ("turbine", "aircraft", "loco", "chiller", "leg")
FAULTS = {  # vehicle -> faults
    "turbine": (
        "bias:power",
        "gain:wind",
        "drift:blade",
        "stuck:rotor",
        "loss",
        "zone_torque",
        "pitch_up",
        "cooling",
    ),
    "aircraft": (
        "bias:airspeed",
        "gain:yawrate",
        "drift:egt",
        "noise:climb",
        "loss",
        "zone_altitude",
        "zone_nose_up_left",
        "roll_left",
    ),
    "loco": (
        "bias:line",
        "gain:traction",
        "noise:accel",
        "stuck:speed",
        "zone_curve",
        "zone_slip",
        "brake_weak",
        "wear",
    ),
    "chiller": (
        "bias:suction",
        "gain:flow",
        "drift:condensing",
        "stuck:load",
        "loss",
        "zone_pump",
        "zone_lift",
        "fouling",
    ),
    "leg": (
        "bias:tibia",
        "gain:foot",
        "noise:coxa",
        "drift:motor",
        "loss",
        "zone_bind",
        "lift_drag",
        "wear",
    ),
}
RATE = {"turbine": 0.2, "aircraft": 0.2, "loco": 0.2, "chiller": 0.2, "leg": 0.05}
LENGTH = {"turbine": 3000, "aircraft": 3000, "loco": 3000, "chiller": 3000, "leg": 2400}
COLUMNS = {
    "turbine": [
        "t_s",
        "u.pitch_rad",
        "u.torque_kNm",
        "u.fan_on",
        "s.wind_mps",
        "s.rotor_radps",
        "s.blade_rad",
        "s.power_kW",
        "s.winding_degC",
        "s.outside_degC",
        "s.tower_mps2",
    ],
    "aircraft": [
        "t_s",
        "u.throttle_frac",
        "u.pitch_rad",
        "u.roll_rad",
        "s.airspeed_mps",
        "s.altitude_m",
        "s.climb_mps",
        "s.pitch_rad",
        "s.roll_rad",
        "s.yawrate_radps",
        "s.engine_rpm",
        "s.fuelflow_kgph",
        "s.egt_degC",
    ],
    "loco": [
        "t_s",
        "u.traction_frac",
        "u.brake_bar",
        "s.speed_mps",
        "s.accel_mps2",
        "s.traction_A",
        "s.line_V",
        "s.cylinder_bar",
        "s.stator_degC",
        "s.slope_permil",
        "s.curve_pkm",
    ],
    "chiller": [
        "t_s",
        "u.compressor_on",
        "u.pump_frac",
        "s.bath_degC",
        "s.flow_lpm",
        "s.load_W",
        "s.suction_bar",
        "s.condensing_bar",
        "s.compressor_A",
        "s.ambient_degC",
    ],
    "leg": [
        "t_s",
        "u.coxa_rad",
        "u.femur_rad",
        "u.tibia_rad",
        "s.coxa_rad",
        "s.femur_rad",
        "s.tibia_rad",
        "s.foot_N",
        "s.hip_A",
        "s.knee_A",
        "s.bus_V",
        "s.motor_degC",
    ],
}
SENSOR = (
    {  # vehicle -> short name -> (white noise, coloured noise, its time constant in s, quantum)
        "turbine": {
            "wind": (0.15, 0.3, 1.0, 0),
            "rotor": (0.004, 0, 1, 0),
            "blade": (0.0025, 0, 1, 0.001),
            "power": (9, 3, 2.0, 1),
            "winding": (0.6, 0, 1, 0.1),
            "outside": (0.1, 0.1, 20.0, 0.1),
            "tower": (0.02, 0, 1, 0),
        },
        "aircraft": {
            "airspeed": (0.6, 0.25, 0.8, 0),
            "altitude": (1.0, 1.0, 5.0, 0.3),
            "climb": (0.15, 0, 1, 0),
            "pitch": (0.004, 0.002, 3.0, 0),
            "roll": (0.006, 0, 1, 0),
            "yawrate": (0.004, 0, 1, 0),
            "engine": (16, 0, 1, 5),
            "fuelflow": (0.45, 0.2, 0.5, 0),
            "egt": (4.0, 1.0, 1.0, 1),
        },
        "loco": {
            "speed": (0.05, 0, 1, 0),
            "accel": (0.03, 0.008, 0.6, 0),
            "traction": (24, 5, 1.0, 1),
            "line": (14, 0, 1, 0),
            "cylinder": (0.05, 0, 1, 0),
            "stator": (0.3, 0, 1, 0.1),
            "slope": (0.15, 0.15, 5.0, 0.1),
            "curve": (0.02, 0, 1, 0.01),
        },
        "chiller": {
            "bath": (0.03, 0, 1, 0.02),
            "flow": (0.08, 0.05, 0.8, 0),
            "load": (15, 0, 1, 0),
            "suction": (0.04, 0.01, 0.5, 0),
            "condensing": (0.12, 0.02, 1.0, 0.01),
            "compressor": (0.05, 0, 1, 0.01),
            "ambient": (0.1, 0.1, 30.0, 0.25),
        },
        "leg": {
            "coxa": (0.006, 0, 1, 0.0044),
            "femur": (0.006, 0, 1, 0.0044),
            "tibia": (0.006, 0, 1, 0.0044),
            "foot": (0.6, 0.3, 0.2, 0),
            "hip": (0.04, 0.02, 0.1, 0),
            "knee": (0.04, 0.02, 0.1, 0),
            "bus": (0.025, 0, 1, 0.01),
            "motor": (0.6, 0, 1, 0.1),
        },
    }
)
SIGMA = (
    {}
)  # per-row noise of the sensors, by short name; (vehicle, name) where two vehicles share one
for _v in SENSOR:
    for _n, (_w, _c, _t, _q) in SENSOR[_v].items():
        SIGMA[_n] = SIGMA[_v, _n] = math.sqrt(_w * _w + _c * _c + _q * _q / 12)
# An outcome's healthy scatter given the rest, where gusts and the like exceed the sensor's noise.
OWN = {
    ("turbine", "wind"): 0.5,
    ("aircraft", "airspeed"): 0.9,
    ("aircraft", "egt"): 5.5,
    ("aircraft", "yawrate"): 0.007,
    ("loco", "line"): 18,
    ("chiller", "condensing"): 0.17,
    ("leg", "motor"): 0.8,
}
GAIN = {  # vehicle, name -> least and most |gain|
    ("turbine", "wind"): (0.08, 0.11),
    ("aircraft", "yawrate"): (0.06, 0.09),
    ("loco", "traction"): (0.12, 0.15),
    ("chiller", "flow"): (0.015, 0.025),
    ("leg", "foot"): (0.07, 0.1),
}
POSITIVE = ("wind", "traction", "flow", "foot")  # never below zero: a gain has a sign
HOLD = {"rotor": 5, "speed": 5, "load": 5}
# Per vehicle and fault: accepted outcomes, with the sign of measured less nominal, and features.
PHYSICAL = {
    "turbine": {
        "loss": ({"power": -1, "winding": 1}, ()),
        "zone_torque": ({"power": -1}, ("u.torque_kNm", "s.rotor_radps", "s.power_kW")),
        "pitch_up": (
            {"blade": -1, "rotor": 1},
            ("u.pitch_rad", "s.blade_rad", "s.rotor_radps", "s.wind_mps"),
        ),
        "cooling": ({"winding": 1}, ()),
    },
    "aircraft": {
        "loss": ({"engine": -1, "airspeed": -1, "fuelflow": -1, "climb": -1}, ()),
        "zone_altitude": ({"fuelflow": 1, "egt": -1}, ("s.altitude_m",)),
        "zone_nose_up_left": (
            {"engine": -1, "airspeed": -1, "fuelflow": -1, "climb": -1},
            (
                "s.pitch_rad",
                "u.pitch_rad",
                "s.climb_mps",
                "s.roll_rad",
                "u.roll_rad",
                "s.yawrate_radps",
            ),
        ),
        "roll_left": ({"roll": 1, "yawrate": 1}, ("u.roll_rad", "s.roll_rad", "s.yawrate_radps")),
    },
    "loco": {
        "zone_curve": ({"accel": -1, "speed": -1}, ("s.curve_pkm",)),
        "zone_slip": (
            {"accel": -1, "speed": -1},
            ("s.speed_mps", "u.traction_frac", "s.traction_A", "s.accel_mps2"),
        ),
        "brake_weak": (
            {"cylinder": -1, "accel": 1, "speed": 1},
            ("u.brake_bar", "s.cylinder_bar", "s.accel_mps2"),
        ),
        "wear": ({"accel": -1, "speed": -1}, ()),
    },
    "chiller": {
        "loss": ({"suction": 1, "condensing": -1, "compressor": -1}, ()),
        "zone_pump": ({"flow": -1}, ("u.pump_frac", "s.flow_lpm")),
        "zone_lift": (
            {"compressor": 1},
            ("s.suction_bar", "s.condensing_bar", "s.compressor_A", "u.compressor_on"),
        ),
        "fouling": ({"condensing": 1, "compressor": 1}, ()),
    },
    "leg": {
        "loss": ({"femur": 1, "foot": -1, "hip": -1}, ()),
        "zone_bind": (
            {"hip": 1},
            ("s.coxa_rad", "u.coxa_rad", "s.foot_N", "u.femur_rad", "s.femur_rad", "s.knee_A"),
        ),
        "lift_drag": ({"femur": -1, "hip": 1}, ("u.femur_rad", "s.femur_rad", "s.foot_N")),
        "wear": ({"knee": 1}, ()),
    },
}
ZONES = {  # vehicle, fault -> ((column, least and most quantile of this run for the limit), ...)
    ("turbine", "zone_torque"): (("u.torque_kNm", 0.35, 0.5),),
    ("aircraft", "zone_altitude"): (("s.altitude_m", 0.4, 0.6),),
    ("loco", "zone_slip"): (("s.speed_mps", 0.6, 0.7),),
    ("chiller", "zone_pump"): (("u.pump_frac", 0.5, 0.65),),
    ("chiller", "zone_lift"): (("s.suction_bar", 0.3, 0.4), ("s.condensing_bar", 0.4, 0.5)),
}


def short(c):
    return c[2:].rsplit("_", 1)[0] if "_" in c else c[2:]


def column(vehicle, name):
    return next(c for c in COLUMNS[vehicle] if c.startswith("s.") and short(c) == name)


def clamp(x, a, b):
    return a if x < a else b if x > b else x


class Coloured:
    """First-order noise of unit scale times sd."""

    def __init__(self, r, dt, tau, sd):
        self.r, self.a, self.sd = r, math.exp(-dt / tau), sd
        self.b, self.x = math.sqrt(1 - self.a * self.a), r.gauss(0, 1)

    def __call__(self):
        self.x = self.a * self.x + self.b * self.r.gauss(0, 1)
        return self.sd * self.x


class Effect:
    """A physical fault: its name, moment, size (drawn about 1) and region's limits."""

    def __init__(self, name=None, onset=0.0, end=1.0, size=1.0, limits=()):
        self.name, self.onset, self.end, self.size, self.limits, self.now, self.t = (
            name,
            onset,
            end,
            size,
            limits,
            False,
            0.0,
        )

    def step(self, t):
        self.t, self.now = t, False

    def __call__(self, name, strength, where=True):
        """strength * size if this fault acts now, else 0."""
        if self.name != name or self.t < self.onset or not where:
            return 0.0
        self.now = True
        return strength * self.size

    def ramp(self):
        return (self.t - self.onset) / (self.end - self.onset)


def schedule(r, T, least, most, draw):
    """[(start, value)...] over T seconds."""
    out, t = [], 0.0
    while t < T:
        out.append((t, draw()))
        t += r.uniform(least, most)
    return out


class Follow:
    def __init__(self, plan):
        self.plan, self.i = plan, 0

    def __call__(self, t):
        while self.i + 1 < len(self.plan) and self.plan[self.i + 1][0] <= t:
            self.i += 1
        return self.plan[self.i][1]


def turbine(r, n, dt, e):
    g = lambda s: r.gauss(0, s)
    R, J, rated, most = 40.0, 8e6, 1.95, 1.05e6
    A = math.pi * R * R
    mean, out_t = r.uniform(11.5, 14.5), r.uniform(5, 25)
    rho = 1.225 * 288 / (273 + out_t)
    soil, eta0, cool, damp = 1 + g(0.01), 0.94 + g(0.001), 1 + g(0.02), 0.012 + abs(g(0.002))
    slow, turb, drift = Coloured(r, dt, 60, 1.3), Coloured(r, dt, 4, 1), Coloured(r, dt, 200, 0.4)
    w, beta, integ, hot, fan, T = 1.7, 0.0, 0.0, 70 + g(4), 0, 5e5
    x, xd, k2 = 0.35, 0.0, 1.78e5
    rows, acts = [], []
    for k in range(n):
        e.step(k * dt)
        V = max(4.5, mean + slow() + 0.07 * mean * turb())
        amb = out_t + drift()
        Tc = k2 * w * w if w < 1.8 else min(most, k2 * 3.24 + (most - k2 * 3.24) * (w - 1.8) / 0.12)
        err, sched = w - rated, 1 / (1 + beta / 0.12)
        integ = clamp(integ + 0.35 * sched * err * dt, 0, 0.45)
        bc = clamp(integ + 1.0 * sched * err, 0, 0.45)
        fan = 1 if hot > 78 else 0 if hot < 68 else fan
        for _ in range(2):
            h = dt / 2
            rate = clamp((bc - beta) / 0.35, -0.14, 0.14)
            rate *= 1 - e("pitch_up", 0.5, rate > 0.004)
            beta += rate * h
            lam, b = R * w / V, math.degrees(beta)
            li = 1 / (1 / (lam + 0.08 * b) - 0.035 / (b**3 + 1))
            cp = max(0.0, 0.5176 * (116 / li - 0.4 * b - 5) * math.exp(-21 / li) + 0.0068 * lam)
            T += (Tc - T) * min(1, h / 0.15)
            w += h / J * (0.5 * rho * A * V**3 * cp * soil / w - T - 8e3 * w)
            thrust = 0.5 * rho * A * V * V * max(0.1, 0.8 - 2.4 * beta)
            acc = thrust / 3e5 - 4.84 * x - 2 * (damp + 0.04) * 2.2 * xd
            xd += h * acc
            x += h * xd
        w += g(0.0008)
        load = T * w / 2e6
        eta = eta0 - 0.025 * (1 - load) ** 2 - 1e-4 * (hot - 70)
        loss = e("loss", 0.0065)
        power = (eta - loss) * (
            1 - e("zone_torque", 0.009, bool(e.limits) and T / 1e3 > min(e.limits[0], 1e3))
        ) * T * w / 1e3 - 6 * fan
        U = (
            (1.2 + 1.0 * fan)
            * cool
            * (1 - e("cooling", 0.21) * (e.ramp() if e.name == "cooling" else 0))
        )
        hot += dt / 60 * ((1 - eta + loss) * T * w / 1e3 - U * (hot - amb)) + g(0.01)
        rows.append((bc, Tc / 1e3, fan, 0.94 * V, w, beta, power, hot, amb, acc))
        acts.append(e.now)
    return rows, acts


def aircraft(r, n, dt, e):
    g = lambda s: r.gauss(0, s)
    T = n * dt
    m, S, D, base = 1050 + g(40), 16.0, 1.9, r.uniform(800, 1400)
    cd0, warm, torque0 = 0.035 * (1 + g(0.015)), g(8), 480 * (1 + g(0.008))
    plan_h = schedule(r, T - 90, 20, 45, lambda: base + r.uniform(-250, 250)) + [(T - 80, 450.0)]
    plan_h[0] = (0.0, base + 150)
    plan_v = Follow(schedule(r, T, 40, 90, lambda: r.uniform(46, 54)))
    plan_r = Follow(
        schedule(r, T, 12, 30, lambda: r.choice((0, 1, 1, -1, -1, -1)) * r.uniform(0.2, 0.5))
    )
    plan_h = Follow(plan_h)
    gw, gu, gp = Coloured(r, dt, 1.5, 0.35), Coloured(r, dt, 2.0, 0.3), Coloured(r, dt, 0.8, 0.02)
    V, h, gam, th, phi, om, egt = 50.0, base - 100, 0.0, 0.03, 0.0, 250.0, 720.0
    ith, iv, fuel, want, aim = 0.03, 0.65, 60.0, 0.0, 50.0
    rows, acts = [], []
    for k in range(n):
        e.step(k * dt)
        t = k * dt
        wz, ux, roll_gust = gw(), gu(), gp()
        rho = 1.225 * math.exp(-h / 9500)
        hd = V * math.sin(gam)
        want += dt / 3 * (clamp(0.06 * (plan_h(t) - h), -3.0, 2.5) - want)
        ith = clamp(ith + 0.006 * (want - hd) * dt, -0.05, 0.15)
        tc = clamp(ith + 0.022 * (want - hd) + 0.05 * abs(phi), -0.2, 0.25)
        aim += dt / 5 * (plan_v(t) - aim)
        ev = aim - V
        iv = clamp(iv + 0.006 * ev * dt, 0.2, 0.95)
        uc = clamp(iv + 0.025 * ev + 0.05 * want, 0.2, 0.95)
        rc = plan_r(t)
        a = e("loss", 0.03) + e("zone_nose_up_left", 0.045, phi < -0.1 and gam > 0.008)
        for _ in range(2):
            s = dt / 2
            nr = om / (2 * math.pi)
            adv = V / (nr * D)
            Q = rho * nr * nr * D**5 * (0.0088 - 0.004 * adv * adv)
            Qe = torque0 * (1 - a) * (1 - (1 - uc) ** 1.6) * (rho / 1.225) ** 1.1
            om += s * (Qe - Q) / 2.0
            thrust = rho * nr * nr * D**4 * (0.13 - 0.10 * adv - 0.03 * adv * adv)
            va = V + ux
            alpha = th - gam + wz / V
            q = 0.5 * rho * va * va
            cl = 0.3 + 5 * alpha
            V += s * ((thrust - q * S * (cd0 + 0.055 * cl * cl)) / m - 9.81 * math.sin(gam))
            gam += s * (q * S * cl * math.cos(phi) / (m * V) - 9.81 * math.cos(gam) / V)
            th += s * (tc - th) / 0.8
            phi += s * (rc * (1 - e("roll_left", 0.045, rc < -0.05)) + roll_gust * 0.5 - phi) / 0.7
            h += s * V * math.sin(gam)
        rich = e("zone_altitude", 0.03, bool(e.limits) and h > e.limits[0])
        kw = Qe * om / 1e3
        fuel = 0.29 * kw * (1 + rich) * (1 + 0.12 * max(0.0, uc - 0.8)) + 2.0
        egt += dt / 1.5 * (
            610 + warm + 150 * uc - 130 * max(0.0, uc - 0.8) - 120 * rich + 0.03 * om - egt
        ) + g(0.3)
        m -= fuel / 3600 * dt
        rows.append(
            (
                uc,
                tc,
                rc,
                V + ux,
                h,
                V * math.sin(gam) + 0.2 * wz,
                th,
                phi,
                9.81 * math.tan(phi) / V,
                om * 30 / math.pi,
                fuel,
                egt,
            )
        )
        acts.append(e.now)
    return rows, acts


def loco(r, n, dt, e):
    g = lambda s: r.gauss(0, s)
    M, wet = (900 + r.uniform(-25, 25)) * 1e3, 1 + g(0.01)
    slope, curve, limit, x = [], [], [], 0.0
    while x < 24e3:
        slope.append((x, r.choice((0, 1, 1)) * r.uniform(-11, 11)))
        x += r.uniform(300, 900)
    x = 0.0
    while x < 24e3:
        curve.append((x, 0.0))
        x += r.uniform(150, 500)
        curve.append((x, r.uniform(0.6, 2.2)))
        x += r.uniform(200, 600)
    x = 0.0
    while x < 24e3:
        limit.append((x, r.uniform(7, 24)))
        x += r.uniform(400, 1200)
    substation, amb = r.uniform(0, 3e3), r.uniform(0, 25)
    Ps, Pc, Pl, Pa = Follow(slope), Follow(curve), Follow(limit), Follow(limit)
    others, rough, wind = (
        Coloured(r, dt, 2, 8),
        Coloured(r, dt, 0.4, 0.006),
        Coloured(r, dt, 30, 2e3),
    )
    x, v, hot, cyl, u, line, sl, cu = 0.0, 6.0, amb + 45 + g(4), 0.0, 0.0, 2950.0, 0.0, 0.0
    F, tb = 0.0, 0.0
    rows, acts = [], []
    for k in range(n):
        e.step(k * dt)
        if k % 5 == 0:  # the driver moves the handle once a second, in notches
            vt = min(Pl(x), Pa(x + 9 * v))
            u = (
                round(clamp(u + 0.5 * (clamp(0.22 * (vt - v) + 0.12, -1, 1) - u), -1, 1) / 0.05)
                * 0.05
            )
        ut, tb = max(0.0, u), max(0.0, -u - 0.1) * 3.8
        sl += dt / 4 * (Ps(x) - sl)
        cu += dt / 3 * (Pc(x) - cu)
        force = min(260e3 * ut, 3.0e6 * ut / max(v, 1))
        F += (force - F) * min(1, dt / 0.5)
        slip = e("zone_slip", 0.27, bool(e.limits) and v < e.limits[0] and ut > 0.3)
        cyl += dt / 0.9 * (tb * (1 - e("brake_weak", 0.07, tb > 0.2)) - cyl)
        drag = e("zone_curve", 40e3, cu > 0.9) + e("wear", 85e3) * (
            e.ramp() if e.name == "wear" else 0
        )
        res = (
            12e3
            + 400 * v
            + 32 * v * v
            + M * 9.81 * (sl + 0.7 * cu) * 1e-3
            + wind()
            + drag * min(1, v)
        )
        acc = (F * wet * (1 - slip) - res - 155e3 * cyl / (1 + v / 40) * min(1, v)) / (
            1.06 * M
        ) + rough()
        v += acc * dt
        if v < 0.3:
            v = 0.3
        x += v * dt
        watt = F * v / 0.88 + F * F * 2.2e-6 + 9e4
        ohm = 0.10 + 0.04 * abs(math.sin(math.pi * (x - substation) / 9e3))
        amp = watt / line
        line += 0.6 * (3050 - ohm * amp + others() - line)
        hot += dt / 220 * (F * F * 1.9e-9 + 10 + amb - hot) + g(0.015)
        rows.append((ut, tb, v, acc, amp, line, cyl, hot, sl, cu))
        acts.append(e.now)
    return rows, acts


def chiller(r, n, dt, e):
    g = lambda s: r.gauss(0, s)
    T = n * dt
    amb0, setp, fill = r.uniform(18, 28), r.uniform(12, 17), 1 + g(0.01)
    UAc0, volts = 75 * (1 + g(0.02)), 230 * (1 + g(0.008))
    load = Follow(schedule(r, T, 15, 50, lambda: r.uniform(150, 650)))
    pump = Follow(schedule(r, T, 10, 35, lambda: round(r.uniform(0.4, 1.0), 2)))
    drift, flick, hunt = (
        Coloured(r, dt, 150, 0.6),
        Coloured(r, dt, 1.5, 12),
        Coloured(r, dt, 1.2, 0.006),
    )
    psat = lambda c: math.exp(10.813 - 2660 / (273.15 + c))
    bath, Te, Tc, on, flow, rush, Q, heat = (
        setp + g(0.3),
        setp - 3,
        amb0 + 4,
        0,
        6.0,
        0.0,
        0.0,
        300.0,
    )
    rows, acts = [], []
    for k in range(n):
        e.step(k * dt)
        t = k * dt
        amb, up = amb0 + drift(), pump(t)
        new = 1 if bath > setp + 0.6 else 0 if bath < setp - 0.6 else on
        rush = 1.2 if new > on else rush * 0.55
        on = new
        heat += dt / 0.8 * (load(t) - heat)
        hl = heat + flick()
        cav = e("zone_pump", 0.02, bool(e.limits) and up >= e.limits[0])
        flow += dt / 0.7 * (9.5 * up**0.9 * (1 - cav) * (1 + 0.004 * (bath - 15)) - flow) + g(0.01)
        Ps, Pd = psat(Te), psat(Tc)
        ratio = max(1.05, Pd / Ps)
        Q += (
            dt
            / 0.6
            * (
                on
                * 334
                * fill
                * (1 - e("loss", 0.07, on > 0))
                * Ps
                * (1 + hunt())
                * (1 - 0.04 * (ratio**0.87 - 1))
                - Q
            )
        )
        work = 0.28 * Q * math.log(ratio)
        work *= 1 + e(
            "zone_lift",
            0.065,
            len(e.limits) > 1 and on > 0 and Ps < e.limits[0] and Pd > e.limits[1],
        )
        UAe = 110 * (flow / 8) ** 0.6
        foul = e("fouling", 0.22) * (e.ramp() if e.name == "fouling" else 0)
        UAc = UAc0 * (1 - foul) * (1 if on else 0.45)
        bath += dt / 6000 * (hl + 25 + 8 * (amb - bath) - UAe * (bath - Te)) + g(0.002)
        Te += dt / 200 * (UAe * (bath - Te) - Q)
        Tc += dt / 350 * (Q + work - UAc * (Tc - amb))
        amp = 0.25 + 0.12 * up + on * 0.15 + work / (volts * 0.82) + rush
        rows.append((on, up, bath, flow, hl, psat(Te), psat(Tc), amp, amb))
        acts.append(e.now)
    return rows, acts


def leg(r, n, dt, e):
    g = lambda s: r.gauss(0, s)
    j = [g(0.8) for _ in range(5)]
    pay, stiff, cell = 25 * (1 + g(0.05)), 1 + g(0.03), 16.4 + g(0.08)
    uneven, shake = Coloured(r, dt, 0.5, 0.0012), Coloured(r, dt, 0.15, 0.004)
    a, b, c, F, hot, ph, soc = 0.0, 0.0, 0.0, 12.0, 31 + g(0.5), r.random(), 0.0
    rows, acts = [], []
    for k in range(n):
        e.step(k * dt)
        t = k * dt
        period, lift, stride = (
            (1.8, 0.35, 0.25)
            if t < 25 + j[0]
            else (
                (1.2, 0.3, 0.35)
                if t < 55 + j[1]
                else (
                    (9e9, 0, 0)
                    if t < 62 + j[2]
                    else (1.8, 0.5, 0.2) if t < 90 + j[3] else (1.3, 0.35, 0.3)
                )
            )
        )
        ph = (ph + dt / period) % 1.0 if lift else ph
        if ph < 0.45:
            s = ph / 0.45
            uc, uf, ut = (
                stride * -math.cos(math.pi * s),
                lift * math.sin(math.pi * s),
                -0.6 * lift * math.sin(math.pi * s) ** 2,
            )
        else:
            s = (ph - 0.45) / 0.55
            uc, uf, ut = stride * math.cos(math.pi * s), 0.0, 0.10 * math.sin(math.pi * s)
        if not lift:
            uc, uf, ut = uc * 0.3, 0.0, 0.05
        up, sh = uneven(), shake()
        pa, pb, pc = a, b, c
        rising = uf - b > 0.02
        for _ in range(3):
            h = dt / 3
            press = max(0.0, 1500 * (pay / 1500 + up - 0.08 * b - 0.03 * c - 0.04 * b * c))
            F += h / 0.05 * (press - F)
            arm = 0.08 * math.cos(b) + 0.01 * math.sin(c)
            soft = 0.125 / stiff * (1 + e("loss", 0.6))
            a += h / 0.07 * (uc - a) + h * sh
            b += h * ((uf - b) / 0.08 * (1 - e("lift_drag", 0.12, rising)) + soft * F * arm)
            c += h / 0.075 * (ut - c) + h * 0.05 * F * 0.05
        wa, wb, wc = (a - pa) / dt, (b - pb) / dt, (c - pc) / dt
        bind = e("zone_bind", 0.065, a > 0.05 and F > 10)
        rub = (
            e("wear", 0.13, abs(wc) > 0.02)
            * (e.ramp() if e.name == "wear" else 0)
            * abs(wc)
            / (abs(wc) + 0.08)
        )
        hip = (
            0.15
            + 0.35 * F * arm
            + 0.12 * abs(wb)
            + 0.1 * abs(wa)
            + e("lift_drag", 0.03, rising)
            + bind
        )
        knee = 0.12 + 0.35 * F * 0.05 + 0.14 * abs(wc) + 0.03 * wc * wc + rub
        soc += (hip + knee) * 2e-4 * dt
        hot += dt / 25 * (18 * hip * hip + 6 * knee * knee + 24 - hot) + g(0.005)
        rows.append(
            (uc, uf, ut, a, b, c, F, hip, knee, cell - 0.12 * (hip + knee + 1.5) - soc, hot)
        )
        acts.append(e.now)
    return rows, acts


STATES = {"turbine": turbine, "aircraft": aircraft, "loco": loco, "chiller": chiller, "leg": leg}


def states(vehicle, seed, effect=None):
    """Rows of (commands, true sensor values), and where the physical effect acts."""
    return STATES[vehicle](
        random.Random("blind state %s %d" % (vehicle, seed)),
        LENGTH[vehicle],
        RATE[vehicle],
        effect or Effect(),
    )


def run(vehicle, seed, fault=None):
    r = random.Random("blind fault %s %s %d" % (vehicle, fault, seed))
    cols, dt, n = COLUMNS[vehicle], RATE[vehicle], LENGTH[vehicle]
    T = n * dt
    onset = r.uniform(0.25, 0.6) * T
    kind, _, name = (fault or "").partition(":")
    effect, phys = None, None
    if fault is not None and fault not in FAULTS[vehicle]:
        raise ValueError("%s has no fault %s" % (vehicle, fault))
    if fault and not name:
        phys = PHYSICAL[vehicle][fault]
        limits, zone = [], ZONES.get((vehicle, fault), ())
        if phys[1]:  # a region: leave it the time to be visited
            onset = r.uniform(0.25, 0.4) * T
        if zone:  # the limits lie where this very run goes
            healthy = states(vehicle, seed)[0]
            for c, lo, hi in zone:
                x = sorted(s[cols.index(c) - 1] for s in healthy[int(onset / dt) :])
                limits.append(x[int(r.uniform(lo, hi) * len(x))])
        effect = Effect(fault, onset, T, r.uniform(0.9, 1.1), tuple(limits))
    st, acts = states(vehicle, seed, effect)
    m = len(cols) - 1
    names = [short(c) for c in cols[1:]]
    sens = [i for i in range(m) if cols[i + 1].startswith("s.")]
    q = random.Random("blind sensors %s %d" % (vehicle, seed))
    spec = {i: SENSOR[vehicle][names[i]] for i in sens}
    bias = {i: q.gauss(0, 0.3) * SIGMA[vehicle, names[i]] for i in sens}
    scale = {i: 1 + q.gauss(0, 0.002) for i in sens}
    col = {i: Coloured(q, dt, spec[i][2], spec[i][1]) for i in sens}
    hit = next((i for i in sens if names[i] == name), -1)
    own = OWN.get((vehicle, name), SIGMA.get((vehicle, name), 0.0))
    way = r.choice([-1, 1])
    size = way * r.uniform(1.5, 2.3) * own
    gain = way * r.uniform(*GAIN.get((vehicle, name), (0.03, 0.05)))
    rows, mask, hold, held = [], [], None, HOLD.get(name, 5)
    for k, s in enumerate(st):
        t = k * dt
        x = list(s)
        on = bool(name) and t >= onset
        for i in sens:
            w, _, _, step = spec[i]
            y = x[i] * scale[i] + bias[i] + q.gauss(0, w) + col[i]()
            if on and i == hit:
                if kind == "bias":
                    y += size
                elif kind == "drift":
                    y += 2 * size * (t - onset) / (T - onset)
                elif kind == "gain":
                    y += gain * s[i]
                elif kind == "noise":
                    y += r.gauss(0, 1.3 * own)
                elif kind == "stuck":
                    if hold is None or k % held == 0:
                        hold = y
                    y = hold
            x[i] = round(y / step) * step if step else y
        rows.append([t] + x)
        mask.append(int(on or acts[k]))
    first = next((k * dt for k in range(n) if mask[k]), onset)
    truth = None
    if name:
        signed = kind in ("bias", "drift") or kind == "gain" and name in POSITIVE
        truth = dict(
            columns={cols[hit + 1]: way if signed else 0},
            onset=first,
            rows=mask,
            features=(),
            size=size if kind == "bias" else None,
            kinds={"noise": ("variance",), "stuck": ("repeat", "variance")}.get(kind),
        )
    elif phys:
        truth = dict(
            columns={column(vehicle, a): b for a, b in phys[0].items()},
            onset=first,
            rows=mask,
            features=phys[1],
            size=None,
            kinds=None,
        )
    return cols, rows, truth
