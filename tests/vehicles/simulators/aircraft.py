# SPDX-License-Identifier: MIT
"""aircraft: JSBSim's Cessna 172P in turbulence; the autopilot is this module's own.

The simulator's are the flight model, the engine and the air. It counts in feet and knots.
"""
import math
import tempfile

import cessna
import jsbsim
from base import Machine, Physical, clip, jitter, wrap

FOOT, KNOT = .3048, .514444    # m, m/s
ENGINE = "propulsion/engine/"
LEAD = 200                     # rows flown before the log begins: 40 s
TUNED = ("bsfc-lbs_hphr", "volumetric-efficiency", "air-intake-impedance-factor", "cooling-factor")
FUEL, VOLUME, INTAKE, COOLING = TUNED
CONTROLS = ("elevator", "aileron", "rudder", "throttle", "flap")


class Aircraft(Machine):
    """The aeroplane flies random legs of heading, height and speed for 300 s.

    Strengths: power, misfire: share of fuel a horsepower needs more; cooling: share of the cooling
    lost; flapdrag: drag area in square feet; aileron: share of its moment lost; carbice: share by
    which the intake's impedance rises.
    """
    RATE, LENGTH = .2, 1500
    CONTROL, STEPS = 4, 6      # autopilot's turns a row, steps of 1/120 s a turn
    COLUMNS = ["t_s", "u.throttle", "u.elevator", "u.aileron", "u.rudder", "u.flap", "x.air_degC",
               "s.airspeed_mps", "s.altitude_m", "s.climb_mps", "s.roll_rad", "s.pitch_rad",
               "s.heading_rad", "s.rollrate_radps", "s.yawrate_radps", "s.engine_rpm",
               "s.manifold_kPa", "s.fuelflow_kgph", "s.head_degC"]
    SIGMA = dict(air=.15, airspeed=.4, altitude=1.5, climb=.25, roll=.006, pitch=.005, heading=.012,
                 rollrate=.008, yawrate=.005, engine=10., manifold=.4, fuelflow=.35, head=1.2)
    ANGLES = ("heading",)
    PHYSICAL = {
        "power": Physical(.045, .06, dict(engine=-1, manifold=1, airspeed=0, climb=-1)),
        "cooling": Physical(.20, .26, dict(head=1)),
        "flapdrag": Physical(4.0, 5.0, dict(airspeed=-1, climb=-1),
                             ("u.flap", "s.airspeed_mps"), False),
        "aileron": Physical(.40, .50, dict(rollrate=-1), ("u.aileron", "s.rollrate_radps"), False),
        "carbice": Physical(1.5, 2.0, dict(manifold=-1, fuelflow=-1, engine=-1),
                            ("s.altitude_m",), False),
        "misfire": Physical(.06, .08, dict(engine=-1, manifold=1, airspeed=0),
                            ("s.altitude_m", "s.engine_rpm", "u.throttle"), False),
    }
    FAULTS = ("bias:airspeed", "drift:fuelflow", "noise:yawrate", "power", "cooling", "flapdrag",
              "aileron", "carbice", "misfire")

    def __init__(self, r):
        self.aerodynamics = {name: jitter(r, 1, .01)
                             for name in ("k/cdo", "k/clda", "k/cmde", "k/cndr", "k/clp")}
        cooling, fuel, volume = jitter(r, 1, .01), jitter(r, 1), jitter(r, 1)
        self.tuning = {FUEL: fuel, VOLUME: volume, INTAKE: jitter(r, 1, .01), COOLING: cooling}
        self.mass = {"inertia/pointmass-weight-lbs[0]": r.uniform(150, 200),
                     "inertia/pointmass-weight-lbs[1]": r.uniform(120, 190),
                     "propulsion/tank[0]/contents-lbs": r.uniform(70, 110),
                     "propulsion/tank[1]/contents-lbs": r.uniform(70, 110)}
        self.wind = r.uniform(0, 6), r.uniform(-math.pi, math.pi)
        self.gusts, self.seed = r.uniform(4, 9), r.randrange(1, 1 << 30)
        self.warmer = r.uniform(-8, 12)
        self.heading = r.uniform(-math.pi, math.pi)
        self.height = r.uniform(1100, 1300)
        t, self.legs = 0., []      # begin in s, height in m, speed in m/s, turn in rad, slow
        while t < 320:
            slow = r.random() < .35
            height, speed = r.uniform(1050, 1350), r.uniform(38, 42) if slow else r.uniform(46, 54)
            self.legs.append((t, height, speed, r.uniform(-1.5, 1.5), slow))
            t += r.uniform(30, 55)
        self.trim, self.sink, self.speed = .62, 0., 48.    # of the autopilot

    def started(self):
        """JSBSim with the aircraft in flight, its engine running, in this run's weather."""
        jsbsim.FGJSBBase().debug_lvl = 0
        model = jsbsim.FGFDMExec(cessna.package())
        model.set_debug_level(0)
        with tempfile.TemporaryDirectory() as folder:  # one for each run: several draw at once
            cessna.write(folder)
            model.set_aircraft_path(folder)
            model.load_model(cessna.NAME)
        model.set_dt(1 / 120)
        model["ic/h-sl-ft"] = self.height / FOOT
        model["ic/vc-kts"] = 48 / KNOT
        model["ic/psi-true-rad"] = self.heading % (2 * math.pi)
        model["ic/gamma-deg"] = 0
        model["propulsion/magneto_cmd"] = 3
        model["atmosphere/delta-T"] = self.warmer * 1.8
        model.run_ic()
        model["propulsion/set-running"] = -1
        for name, value in list(self.aerodynamics.items()) + list(self.mass.items()):
            model[name] = value
        self.engine = {name: model[ENGINE + name] * self.tuning[name] for name in TUNED}
        for name, value in self.engine.items():
            model[ENGINE + name] = value
        model["fcs/mixture-cmd-norm"] = .85
        model["atmosphere/randomseed"] = self.seed
        speed, direction = self.wind
        model["atmosphere/wind-north-fps"] = speed / FOOT * math.cos(direction)
        model["atmosphere/wind-east-fps"] = speed / FOOT * math.sin(direction)
        model["atmosphere/turb-type"] = 3
        model["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = self.gusts / FOOT
        model["atmosphere/turbulence/milspec/severity"] = 2
        return model

    def fly(self, model, leg, heading):
        """One turn of the autopilot, at 20 Hz; the commands in the order of CONTROLS."""
        _, height, speed, _, slow = leg
        v, roll = model["velocities/vc-kts"] * KNOT, model["attitude/phi-rad"]
        climb = model["velocities/h-dot-fps"] * FOOT
        want = clip(.12 * (height - model["position/h-sl-ft"] * FOOT), -1.8, 1.6)
        self.sink = clip(self.sink + .0002 * (want - climb), -.15, .15)
        pitch = clip(.02 + self.sink + .018 * (want - climb), -.2, .25)
        elevator = clip(1.6 * (model["attitude/theta-rad"] - pitch)
                        + .5 * model["velocities/q-rad_sec"] - .05, -1, 1)
        bank = clip(1.0 * wrap(heading - model["attitude/psi-rad"]), -.40, .40)
        aileron = clip(1.1 * (bank - roll) - .35 * model["velocities/p-rad_sec"], -.5, .5)
        turning = model["velocities/r-rad_sec"] - 9.81 / max(v, 20) * math.tan(roll)
        rudder = clip(-.4 * model["aero/beta-rad"] + .3 * turning, -.4, .4)
        self.speed += clip(speed - self.speed, -.02, .02)
        slower = self.speed - v
        self.trim = clip(self.trim + .0008 * slower, .2, .95)
        throttle = clip(self.trim + .03 * slower + .06 * want, .3, 1.)
        commands = elevator, aileron, rudder, throttle, 1 / 3 if slow and v < 46 else 0.
        for name, x in zip(CONTROLS, commands):
            model["fcs/%s-cmd-norm" % name] = x
        return commands

    def damage(self, model, fault, strength, edges, begun):
        """Lets the fault act where it does; whether it does."""
        inside = begun
        height = model["position/h-sl-ft"] * FOOT
        if fault == "power":
            model[ENGINE + FUEL] = self.engine[FUEL] * (1 + strength * inside)
        elif fault == "cooling":
            model[ENGINE + COOLING] = self.engine[COOLING] * (1 - strength * inside)
        elif fault == "flapdrag":
            inside = inside and model["fcs/flap-pos-deg"] > 3
            model[cessna.EXTRA] = strength * inside
        elif fault == "aileron":
            inside = inside and model["fcs/aileron-cmd-norm"] > .04
            model["k/clda"] = self.aerodynamics["k/clda"] * (1 - strength * inside)
        elif fault == "carbice":
            low = 1120 + 80 * edges[0]
            inside = inside and low < height < low + 90
            model[ENGINE + INTAKE] = self.engine[INTAKE] * (1 + strength * inside)
        elif fault == "misfire":
            high = height > 1150 + 80 * edges[1]
            inside = inside and high and model[ENGINE + "propeller-rpm"] > 2250
            model[ENGINE + FUEL] = self.engine[FUEL] * (1 + strength * inside)
        return bool(fault) and bool(inside)

    def reading(self, model, commands):
        """A row without its time."""
        elevator, aileron, rudder, throttle, flap = commands
        return (throttle, elevator, aileron, rudder, flap, model["atmosphere/T-R"] / 1.8 - 273.15,
                model["velocities/vc-kts"] * KNOT, model["position/h-sl-ft"] * FOOT,
                model["velocities/h-dot-fps"] * FOOT, model["attitude/phi-rad"],
                model["attitude/theta-rad"], wrap(model["attitude/psi-rad"]),
                model["velocities/p-rad_sec"], model["velocities/r-rad_sec"],
                model[ENGINE + "propeller-rpm"], model[ENGINE + "map-pa"] / 1000,
                model[ENGINE + "fuel-flow-rate-pps"] * .45359 * 3600,
                (model[ENGINE + "cht-degF"] - 32) / 1.8)

    def rows(self, fault, strength, edges, onset):
        model = self.started()
        leg, heading = -1, self.heading
        out, acts = [], []
        for k in range(-LEAD, self.LENGTH):
            t = k * self.RATE
            while leg + 1 < len(self.legs) and self.legs[leg + 1][0] <= t:
                leg += 1
                heading = wrap(heading + self.legs[leg][3])
            for _ in range(self.CONTROL):
                commands = self.fly(model, self.legs[max(leg, 0)], heading)
                act = self.damage(model, fault, strength, edges, k >= 0 and t >= onset)
                for _ in range(self.STEPS):
                    model.run()
            if k >= 0:
                out.append(self.reading(model, commands))
                acts.append(act)
        return out, acts
