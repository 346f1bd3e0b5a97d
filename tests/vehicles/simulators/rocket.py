# SPDX-License-Identifier: MIT
"""rocket: RocketPy's ascent of a small sounding rocket, 20 s from ignition.

The commands are the throttle (a random plan while the motor burns) and the deployment of the air
brakes (a random plan after that). Wind, mass and motor differ from run to run.
"""
import warnings

import numpy as np
import rocketpy
from base import Machine, Physical, clip, jitter

BURN, THRUST = 7.0, 1150.    # s, N
LAYERS = (0, 500, 1000, 1500, 2500, 4000)    # heights in m between which the wind changes
STEP_S = .02


def followed(plan, times, start, rate):
    """A plan of steps (begin in s, level), followed at a limited rate per s, at the times."""
    level, last, out = start, None, []
    for t in times:
        want = start
        for begin, step in plan:
            if begin <= t:
                want = step
        if last is not None:
            level += clip(want - level, -rate * (t - last), rate * (t - last))
        last = t
        out.append(level)
    return np.array(out)


def values(function, times):
    return np.array([float(x) for x in function.get_value(list(times))])


def along_body(flight, t):
    """(acceleration less gravity along the rocket's axis in m/s^2, upward part of that axis).

    By differences: the simulator's own derivative has spikes where its events are.
    """
    axis = [values(getattr(flight, "attitude_vector_" + k), t) for k in "xyz"]
    before, after = np.maximum(t - STEP_S, 0), t + STEP_S
    speeds = [getattr(flight, "v" + k) for k in "xyz"]
    change = [(values(v, after) - values(v, before)) / (after - before) for v in speeds]
    return change[0] * axis[0] + change[1] * axis[1] + (change[2] + 9.8) * axis[2], axis[2]


class Rocket(Machine):
    """The ascent.

    Strengths: nozzle: share of the thrust lost; flutter, base: share by which the drag rises;
    brake: share of the deployment that is missing.
    """
    RATE, LENGTH = .025, 800
    COLUMNS = ["t_s", "u.throttle", "u.brake", "s.altitude_m", "s.climb_mps", "s.accel_mps2",
               "s.pitot_kPa", "s.chamber_kPa", "s.tilt_rad", "s.pitchrate_radps", "s.mach",
               "s.static_kPa"]
    SIGMA = dict(altitude=3., climb=.5, accel=.5, pitot=.4, chamber=20., tilt=.01, pitchrate=.02,
                 mach=.006, static=.08)
    HEALTHY = (24, 17)
    TAUS, LAG, LAG_MEAN = (.05, .25, 1), .5, .1
    PHYSICAL = {
        "nozzle": Physical(.036, .048, dict(accel=-1, climb=-1)),
        "flutter": Physical(.10, .14, dict(accel=-1, climb=-1),
                            ("s.mach", "s.pitot_kPa", "s.climb_mps"), False),
        "brake": Physical(.22, .28, dict(accel=1, climb=1), ("u.brake",), False),
        "base": Physical(.14, .18, dict(accel=-1, climb=-1),
                         ("s.mach", "s.pitot_kPa", "s.climb_mps", "u.throttle"), False),
    }
    FAULTS = ("bias:accel", "drift:mach", "noise:pitot", "nozzle", "flutter", "brake", "base")

    def __init__(self, r):
        self.dry, self.fuel = jitter(r, 15., .004), jitter(r, 3.6, .004)    # kg
        self.thrust = jitter(r, THRUST, .006)
        self.drag, self.brake_drag = jitter(r, .48, .01), jitter(r, 1.0, .02)
        self.chamber = jitter(r, 3.1, .005)    # kPa per N of thrust
        self.inclination, self.heading = r.uniform(84, 88), r.uniform(0, 360)    # degrees
        self.wind = [(h, r.gauss(0, 2.5), r.gauss(0, 2.5)) for h in LAYERS]
        self.throttles, t = [(0., 1.)], 1.0
        while t < BURN:
            self.throttles.append((t, r.uniform(.65, 1.0)))
            t += r.uniform(.7, 1.6)
        self.brakes, t = [], BURN + r.uniform(.3, 1.0)
        while t < 20:
            self.brakes.append((t, r.choice((0., r.uniform(.2, 1.)))))
            t += r.uniform(1.0, 2.5)

    def motor(self, times, push):
        """RocketPy's motor with the thrust `push` in N at the times."""
        return rocketpy.GenericMotor(
            thrust_source=np.column_stack([times, push]).tolist(), burn_time=BURN + .2,
            chamber_radius=.05, chamber_height=.5, chamber_position=.4,
            propellant_initial_mass=self.fuel, nozzle_radius=.03, dry_mass=2.0,
            center_of_dry_mass_position=.4, dry_inertia=(.2, .2, .01), nozzle_position=0)

    def body(self, fault, strength, fast):
        """RocketPy's rocket without its motor; drag rises with the Mach number, and above `fast`
        with a fault."""
        def burning(mach):
            drag = self.drag * (1 + .15 * max(0., mach - .3))
            return drag * (1 + (strength if fault == "flutter" and mach > fast else 0.))

        def coasting(mach):
            at_base = strength * (mach > fast - .08) if fault == "base" else 0.
            return burning(mach) * (1 + at_base)

        body = rocketpy.Rocket(
            radius=.07, mass=self.dry, inertia=(5.5, 5.5, .05), power_off_drag=coasting,
            power_on_drag=burning, center_of_mass_without_motor=1.25,
            coordinate_system_orientation="tail_to_nose")
        body.add_nose(length=.4, kind="vonKarman", position=2.4)
        body.add_trapezoidal_fins(n=4, root_chord=.2, tip_chord=.1, span=.14, position=.25)
        return body

    def add_brakes(self, body, times, deployed, lost, edge):
        """Brakes that follow `deployed` at the times; above `edge` the share `lost` is missing."""
        def drag(level, mach):
            return self.brake_drag * level

        def deploy(time, sampling_rate, state, state_history, observed_variables, air_brakes):
            level = float(np.interp(time, times, deployed))
            air_brakes.deployment_level = level * (1 - (lost if level > edge else 0.))

        body.add_air_brakes(drag_coefficient_curve=drag, controller_function=deploy,
                            sampling_rate=10, clamp=True, reference_area=.0154,
                            override_rocket_drag=False)

    def flight(self, body):
        air = rocketpy.Environment(latitude=40, longitude=0, elevation=200)
        air.set_atmospheric_model(type="custom_atmosphere",
                                  wind_u=[(h, east) for h, east, _ in self.wind],
                                  wind_v=[(h, north) for h, _, north in self.wind])
        return rocketpy.Flight(
            rocket=body, environment=air, rail_length=5, inclination=self.inclination,
            heading=self.heading, terminate_on_apogee=False,
            max_time=self.RATE * self.LENGTH + .5, time_overshoot=False)

    def rows(self, fault, strength, edges, onset):
        burn = np.arange(0, BURN + .4, .025)
        throttle = followed(self.throttles, burn, 1., 2.)
        rise = np.clip(burn / .15, .02, 1) * np.clip((BURN + .2 - burn) / .2, 0, 1)
        push = self.thrust * throttle * rise
        # what erodes the nozzle begins while the motor burns
        eroded = 1.5 + 3.0 * (onset / (self.RATE * self.LENGTH))
        loss = strength * (burn >= eroded) if fault == "nozzle" else np.zeros(len(burn))
        fast, edge = .42 + .08 * edges[0], .25 + .2 * edges[1]    # Mach, deployment
        coast = np.arange(0, 30, .05)
        deployed = followed(self.brakes, coast, 0., 2.)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            body = self.body(fault, strength, fast)
            body.add_motor(self.motor(burn, push * (1 - loss)), position=0)
            self.add_brakes(body, coast, deployed, strength if fault == "brake" else 0., edge)
            flight = self.flight(body)
            t = np.arange(self.LENGTH) * self.RATE
            along, up = along_body(flight, t)
            height, mach = values(flight.z, t), values(flight.mach_number, t)
            pitot = values(flight.dynamic_pressure, t) / 1000
            static = values(flight.pressure, t) / 1000
            rate = np.hypot(values(flight.w1, t), values(flight.w2, t))
            climb = values(flight.vz, t)
        command = np.interp(t, burn, throttle * (burn < BURN + .2), right=0.) * (t < BURN)
        chamber = np.interp(t, burn, push, right=0.) * self.chamber
        brake = np.interp(t, coast, deployed)
        tilt = np.arccos(np.clip(up, -1, 1))
        acts = {"nozzle": (t >= eroded) & (t < BURN), "flutter": mach > fast, "brake": brake > edge,
                "base": (t > BURN + .2) & (mach > fast - .08)}.get(fault, np.zeros(len(t), bool))
        return np.column_stack([command, brake, height - height[0], climb, along, pitot, chamber,
                                tilt, rate, mach, static]), list(acts)
