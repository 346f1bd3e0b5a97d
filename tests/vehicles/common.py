# SPDX-License-Identifier: MIT
"""What all vehicles of this folder share: sensors, faults and their truth. Pure standard library.

A vehicle is a class that simulates one run of the true machine. This module adds the sensors (white
noise, and a bias and a scale error that each run has of its own), puts a fault in, and writes down
the truth about it. Nothing here is shared with lib/ or host_tools/.
"""
import dataclasses
import math
import random

STUCK_ROWS = 5       # a stuck sensor repeats each reading for so many rows
RUN_BIAS = .3        # standard deviation of a run's own bias, in standard deviations of the noise
RUN_SCALE = .002     # standard deviation of a run's own scale error


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def clip(x, low, high):
    return low if x < low else high if x > high else x


def short(column):
    """The name of a column without its role and its unit."""
    return column[2:].rsplit("_", 1)[0] if "_" in column else column[2:]


@dataclasses.dataclass(frozen=True)
class Physical:
    """A fault of the machine itself.

    port      the quantity of the simulation that it changes
    strength  by how much (the simulation says in which unit)
    columns   the outcomes that deviate from what the commands call for, and in which direction
              (+1, -1; 0 where the direction changes within a run)
    features  columns of which at least one describes the region; empty: everywhere
    draw      draws the edges of the region, where they differ from case to case
    where     whether it acts, of (the machine's attributes, the edges)
    since     whether it begins within the run; otherwise it is there from the start
    ramp      whether it grows from nothing at its onset to its strength at the end
    """
    port: str
    strength: float
    columns: dict
    features: tuple = ()
    draw: object = None
    where: object = None
    since: bool = True
    ramp: bool = False


class Vehicle:
    """One run of a machine. Subclasses give the constants and the functions below.

    DT, ROWS        seconds between rows, rows of a run
    COLUMNS         names: t_s, commands u., context x., sensors s.
    SIGMA           standard deviation of a sensor's white noise, by short name
    SENSOR_FAULTS   "kind:short name" of the sensor faults to draw
    PHYSICAL        name -> Physical
    FOLLOW          states that integrate others; a nominal twin is set to the true ones after
                    every step, since nobody could predict them from the commands alone
    """
    DT, ROWS = .1, 1000
    COLUMNS, SIGMA = (), {}
    SENSOR_FAULTS, PHYSICAL, FOLLOW = (), {}, ()
    ANGLES = ()      # short names of the sensors that wrap

    def __init__(self, r):
        self.r = r
        self.calm = False    # a nominal twin has no disturbances

    def jitter(self, nominal, sd):
        """A parameter that differs from run to run by the share sd."""
        return nominal * (1 + self.r.gauss(0, sd))

    def wander(self, value, time_constant, sd):
        """The next value of a disturbance that wanders about zero."""
        k = self.DT / time_constant
        push = self.r.gauss(0, sd * math.sqrt(2 * k))
        return 0.0 if self.calm else value - k * value + push

    def nominal(self):
        """Sets every parameter to that of the machine on paper."""

    def command(self, t):
        """The commands at time t: the mission and the controller."""
        raise NotImplementedError

    def step(self, u, fault):
        """One step. fault(port) is the strength of what acts on that quantity now."""
        raise NotImplementedError

    def outputs(self):
        """What perfect sensors would read, in the order of COLUMNS after the commands."""
        raise NotImplementedError


def no_fault(_port):
    return 0.0


def simulate(kind, seed, physical=None, edges=(), onset=0.0, twin=False):
    """Rows of (commands, true sensors), whether the fault acts, the nominal twin's, the states.

    The twin is the machine on paper, without a fault and without disturbances, given the same
    commands: what the best of nominal models would predict. Only the check of fairness needs it.
    """
    name = "state %s %d" % (kind.__name__, seed)
    machine = kind(random.Random(name))
    paper = kind(random.Random(name)) if twin else None
    if paper:
        paper.nominal()
        paper.calm = True
    end = kind.ROWS * kind.DT
    rows, acts, twins, states = [], [], [], []
    for k in range(kind.ROWS):
        t = k * kind.DT
        u = machine.command(t)
        a = 0.0
        if physical and t >= onset and (not physical.where or physical.where(vars(machine), edges)):
            a = physical.strength * ((t - onset) / (end - onset) if physical.ramp else 1)
        machine.step(u, (lambda port: a if port == physical.port else 0.0) if a else no_fault)
        rows.append(list(u) + list(machine.outputs()))
        acts.append(int(a != 0))
        if paper:
            states.append(dict(vars(machine)))
            paper.step(u, no_fault)
            for state in kind.FOLLOW:
                setattr(paper, state, getattr(machine, state))
            twins.append(list(u) + list(paper.outputs()))
    return rows, acts, twins, states


def measure(kind, seed, rows):
    """Sensors over the true values: a run's own bias and scale, white noise; angles wrap."""
    q = random.Random("sensors %s %d" % (kind.__name__, seed))
    sensors = [(i, short(c)) for i, c in enumerate(kind.COLUMNS[1:]) if c.startswith("s.")]
    bias = {i: q.gauss(0, RUN_BIAS) * kind.SIGMA[a] for i, a in sensors}
    scale = {i: 1.0 if a in kind.ANGLES else 1 + q.gauss(0, RUN_SCALE) for i, a in sensors}
    out = []
    for row in rows:
        x = list(row)
        for i, a in sensors:
            x[i] = x[i] * scale[i] + bias[i] + q.gauss(0, kind.SIGMA[a])
        out.append(x)
    return out


def break_sensor(fault, hit, measured, rows, sigma, start, r):
    """Puts a sensor fault into column `hit` of `measured` from row `start` on; its size if one."""
    size = r.choice([-1, 1]) * r.uniform(2.5, 3.5) * sigma
    n = len(measured)
    rms = math.sqrt(sum(x[hit] ** 2 for x in rows[start:]) / (n - start))
    hold = None
    for k in range(start, n):
        x = measured[k]
        if fault == "bias":
            x[hit] += size
        elif fault == "drift":
            x[hit] += 1.5 * size * (k - start) / (n - start)
        elif fault == "gain":    # so large that its effect has the size of the other faults
            x[hit] += size / rms * rows[k][hit]
        elif fault == "noise":
            x[hit] += r.gauss(0, 1.3 * sigma)
        elif fault == "stuck":
            if hold is None or k % STUCK_ROWS == 0:
                hold = x[hit]
            x[hit] = hold
        else:
            raise ValueError("no such sensor fault: " + fault)
    return size


def column(kind, name):
    return next(c for c in kind.COLUMNS if c.startswith("s.") and short(c) == name)


KINDS = {"noise": ("variance",), "stuck": ("repeat", "variance")}


def make(kind, seed, fault=None, twin=False):
    """One run: (columns, rows, truth, what fair.py needs); truth is None in a healthy run.

    truth: columns {accepted outcome: sign of measured less nominal, 0 where none is asked for},
    onset in seconds, rows (1 where the fault is), features (of which one describes the region),
    size (of a bias, else None), kinds (accepted kinds of finding, None: any).
    """
    r = random.Random("fault %s %s %d" % (kind.__name__, fault, seed))
    onset = r.uniform(.25, .5) * kind.ROWS * kind.DT
    physical = kind.PHYSICAL.get(fault)
    edges = physical.draw(r) if physical and physical.draw else ()
    began = onset if physical is None or physical.since else 0.0
    rows, acts, twins, states = simulate(kind, seed, physical, edges, began, twin)
    measured, truth = measure(kind, seed, rows), None
    if physical:
        truth = dict(columns={column(kind, a): s for a, s in physical.columns.items()}, onset=began,
                     rows=acts, features=physical.features, size=None, kinds=None)
    elif fault:
        what, _, name = fault.partition(":")
        hit = kind.COLUMNS.index(column(kind, name)) - 1
        start = int(math.ceil(onset / kind.DT))
        size = break_sensor(what, hit, measured, rows, kind.SIGMA[name], start, r)
        sign = (1 if size > 0 else -1) if what in ("bias", "drift") else 0
        acts = [int(k >= start) for k in range(kind.ROWS)]
        truth = dict(columns={kind.COLUMNS[hit + 1]: sign}, onset=onset, rows=acts, features=(),
                     size=size if what == "bias" else None, kinds=KINDS.get(what))
    for x in measured:
        for i, c in enumerate(kind.COLUMNS[1:]):
            if c.startswith("s.") and short(c) in kind.ANGLES:
                x[i] = wrap(x[i])
    stamped = [[k * kind.DT] + x for k, x in enumerate(measured)]
    return list(kind.COLUMNS), stamped, truth, (twins, states, edges)
