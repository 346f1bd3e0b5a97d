#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""valves.py --seed N --family F --out DIR --truth FILE: commands that are not answered in a band about the middle, and then late.

The simulation has the static gain alone. Writing and scoring is physics.py's; nothing is shared with the engine."""
import math

from physics import Case, Machine, draw, wander
from visitors import chirp, steps


def beyond(u, band):
    return math.copysign(max(0.0, abs(u) - band), u)


class Spool(Machine):
    """Speed of a rod by its spool: overlapped edges, and oil that gives way."""
    parts = {"rod_mmps": [("dead_zone", []), ("lag", [])]}
    healthy = []
    rows, dt, late = 1800, .02, 0

    def __init__(self, rng):
        self.band, self.tau, self.gain = rng.uniform(.08, .25), rng.uniform(.08, .4), rng.uniform(20, 80)

    def log(self, rng, held):
        dt = self.dt
        want = steps(rng, -1, 1, 4 * self.tau) if held else chirp(rng, .9, .02 / self.tau, .15 / self.tau, 8)
        sd = .02 * self.gain
        case = Case(dt, ["u.spool", "x.oil_degC"], {"rod_mmps": sd})
        v, warm, past = 0.0, wander(rng, 6, 12.0), [0.0] * (self.late + 1)
        for i in range(self.rows):
            u = want(i * dt)
            past.append(u)
            aim = self.gain * beyond(past[-1 - self.late], self.band)
            v = aim + (v - aim) * math.exp(-dt / self.tau)
            case.add([u, 45 + warm(i * dt)], {"rod_mmps": self.gain * u}, {"rod_mmps": v},
                     {"rod_mmps": v + sd * rng.gauss(0, 1)}, {"rod_mmps": [v - self.gain * u]})
        return case


class Damper(Machine):
    """Flow through a damper whose linkage has slack and whose air takes its time; the pressure before it is well."""
    parts = {"flow_m3ps": [("dead_zone", []), ("lag", ["delay"])]}
    healthy = ["before_Pa"]

    def __init__(self, rng):
        self.band, self.tau, self.gain, self.late = rng.uniform(.1, .3), rng.uniform(1.5, 5), rng.uniform(1, 3), rng.randint(3, 8)

    def log(self, rng, held):
        dt, n, sd = .2, 2000, .02 * self.gain
        want = steps(rng, -1, 1, 4 * self.tau) if held else chirp(rng, .9, .02 / self.tau, .1 / self.tau, 60)
        case = Case(dt, ["u.damper", "x.air_degC"], {"flow_m3ps": sd, "before_Pa": 2.0})
        v, air, past = 0.0, wander(rng, 3, 90.0), [0.0] * (self.late + 1)
        for i in range(n):
            u = want(i * dt)
            past.append(u)
            aim = self.gain * beyond(past[-1 - self.late], self.band)
            v = aim + (v - aim) * math.exp(-dt / self.tau)
            m = {"flow_m3ps": self.gain * u, "before_Pa": 120 - 10 * u}
            case.add([u, 21 + air(i * dt)], m, {"flow_m3ps": v, "before_Pa": m["before_Pa"]},
                     {"flow_m3ps": v + sd * rng.gauss(0, 1), "before_Pa": m["before_Pa"] + 2 * rng.gauss(0, 1)},
                     {"flow_m3ps": [v - m["flow_m3ps"]]})
        return case


class Trim(Spool):
    """Turn rate of a boat by its rudder, whose gear has slack: at 10 Hz, in slow waves of the helm."""
    rows, dt = 1500, .1

    def __init__(self, rng):
        self.band, self.tau, self.gain = rng.uniform(.06, .2), rng.uniform(.6, 2.5), rng.uniform(5, 15)


MACHINES = {"spool": Spool, "damper": Damper, "trim": Trim}

if __name__ == "__main__":
    draw(MACHINES, __doc__, "valves")
