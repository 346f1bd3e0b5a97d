# SPDX-License-Identifier: MIT
"""What the machines of this folder share: sensors, sensor faults and the truth about a run.

A machine is a class that runs one simulation of a public simulator. This module adds the sensors
(white noise, and a bias and a scale error that each run has of its own), puts a sensor fault in,
and writes down the truth.
"""
import dataclasses
import math
import random

import numpy as np

STUCK_ROWS = 5       # a stuck sensor repeats each reading for so many rows
RUN_BIAS = .3        # standard deviation of a run's own bias, in standard deviations of the noise
RUN_SCALE = .002     # standard deviation of a run's own scale error
KINDS = {"noise": ("variance",), "stuck": ("repeat", "variance")}


def clip(x, low, high):
    return low if x < low else high if x > high else x


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def short(column):
    """The name of a column without its role and its unit."""
    return column[2:].rsplit("_", 1)[0]


def jitter(r, nominal, sd=.005):
    """A parameter that differs from run to run by the share sd."""
    return nominal * (1 + r.gauss(0, sd))


@dataclasses.dataclass(frozen=True)
class Physical:
    """A fault of the machine itself.

    low, high  the range of its strength (the machine says in which unit)
    columns    short names of the accepted outcomes, and in which direction each deviates (0 where
               that changes within a run)
    features   columns of which at least one describes the region; empty: everywhere
    since      whether it begins within the run; otherwise it is there from the start
    """
    low: float
    high: float
    columns: dict
    features: tuple = ()
    since: bool = True


class Machine:
    """One run. Subclasses give the constants, __init__(r), and rows().

    __init__ draws the parameters, the mission and the weather from the generator r. rows(fault,
    strength, edges, onset) simulates: fault is the name of a physical fault or None, edges are six
    numbers within 0..1 that place a region, onset is in s. It returns the commands and the true
    outcomes in the order of COLUMNS[1:], and for every row whether the fault acted.

    RATE, LENGTH    seconds between rows, rows of a run
    COLUMNS         names: t_s, commands u., context x., sensors s.
    SIGMA           standard deviation of a sensor's white noise, by short name
    PHYSICAL        name -> Physical
    FAULTS          all faults; those of sensors are "kind:short name"
    ANGLES          short names of the sensors that wrap

    For fair.py alone:

    TAUS, LAG, LAG_MEAN   time constants of the filtered commands, age and averaging of a sensor's
                          own past, in s
    HEALTHY               healthy runs to draw, and how many of these to fit on
    NOT_SCANNED           short names of the sensors left out
    TRIG                  whether sine and cosine of the angles are features
    PARTNER               short name -> short names of the sensors that share an equation with it
    SHAPE                 fault -> the column against whose sign it works
    """
    RATE, LENGTH = .1, 1000
    COLUMNS, SIGMA = (), {}
    PHYSICAL, FAULTS = {}, ()
    ANGLES = ()
    TAUS, LAG, LAG_MEAN = (1, 5, 25), 5., 1.
    HEALTHY = (34, 24)
    NOT_SCANNED, TRIG, PARTNER, SHAPE = (), False, {}, {}


def sensor(kind, name):
    """The column of the sensor or context with this short name."""
    return next(c for c in kind.COLUMNS if c[0] in "sx" and short(c) == name)


def measured(kind, name, seed, true):
    """What the sensors read of the true values, both of shape (rows, columns without the time)."""
    q = random.Random("sensors %s %d" % (name, seed))
    noise = np.random.default_rng(q.randrange(1 << 62))
    x = true.copy()
    for i, column in enumerate(kind.COLUMNS[1:]):
        if column[0] not in "sx":
            continue
        sd = kind.SIGMA[short(column)]
        bias, scale = q.gauss(0, RUN_BIAS) * sd, 1 + q.gauss(0, RUN_SCALE)
        if short(column) in kind.ANGLES:  # where an angle's zero lies is a convention
            scale = 1.0
        x[:, i] = true[:, i] * scale + bias + noise.normal(0, sd, len(true))
    return x


def spoil(kind, fault, onset, r, true, x):
    """Puts a sensor fault in the readings x, in place; its truth."""
    what, _, name = fault.partition(":")
    column = sensor(kind, name)
    i, n = kind.COLUMNS.index(column) - 1, len(true)
    sd = kind.SIGMA[name]
    start = round(onset / kind.RATE)
    size = r.choice([-1, 1]) * r.uniform(2.5, 3.5) * sd
    late = slice(start, n)
    if what == "bias":
        x[late, i] += size
    elif what == "drift":
        x[late, i] += 1.5 * size * np.arange(n - start) / (n - start)
    elif what == "gain":
        x[late, i] += size / math.sqrt(np.mean(true[late, i] ** 2)) * true[late, i]
    elif what == "noise":
        noise = np.random.default_rng(r.randrange(1 << 62))
        x[late, i] += noise.normal(0, 1.3 * sd, n - start)
    elif what == "stuck":
        for k in range(start, n):
            if k != start and k % STUCK_ROWS:
                x[k, i] = x[k - 1, i]
    else:
        raise ValueError(fault)
    sign = (1 if size > 0 else -1) if what in ("bias", "drift") else 0
    return dict(columns={column: sign}, onset=onset, rows=[int(k >= start) for k in range(n)],
                features=[], size=size if what == "bias" else None, kinds=KINDS.get(what))


def run(kind, name, seed, fault=None):
    """(columns, rows, truth) of one run of the machine `kind`, whose name is `name`."""
    r = random.Random("fault %s %s %d" % (name, fault, seed))
    onset = round(r.uniform(.25, .5) * kind.LENGTH) * kind.RATE
    edges = [r.random() for _ in range(6)]
    physical = kind.PHYSICAL.get(fault)
    strength = r.uniform(physical.low, physical.high) if physical else 0.0
    began = onset if not physical or physical.since else 0.0
    machine = kind(random.Random("state %s %d" % (name, seed)))
    true, acts = machine.rows(fault if physical else None, strength, edges, began)
    if True in acts:  # some begin earlier than was drawn
        began = min(began, round(acts.index(True) * kind.RATE, 6))
    true = np.array(true, float)
    x = measured(kind, name, seed, true)
    truth = None
    if physical:
        columns = {sensor(kind, c): sign for c, sign in physical.columns.items()}
        truth = dict(columns=columns, onset=began, rows=[int(a) for a in acts],
                     features=list(physical.features), size=None, kinds=None)
    elif fault:
        truth = spoil(kind, fault, onset, r, true, x)
    for i, column in enumerate(kind.COLUMNS[1:]):
        if short(column) in kind.ANGLES:
            x[:, i] = (x[:, i] + math.pi) % (2 * math.pi) - math.pi
    rows = [[round(k * kind.RATE, 6)] + list(map(float, readings)) for k, readings in enumerate(x)]
    return list(kind.COLUMNS), rows, truth
