#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Is every fault of vehicles.py fair: plain to a crude scan of a whole run, hidden in a single row?

  tests/vehicles/fair.py [--vehicles NAME,...] [--faults NAME,...] [--train 24] [--healthy 24]
      [--per 6] [--twin]

The scan knows the fault's place and time, but not its size or sign. Per outcome it takes block means
of ten rows, less a model: ridge regression, learnt from healthy runs, on filtered commands, their
products, time and the start of the run, for sensor faults on the other sensors too (or, with --twin,
the machine on paper given the same commands). It fits the fault's shape to what is left, alone and
beside an offset of the run, and asks how far the fit stands from those of healthy runs in the same
place and time: z standard deviations, evidence z^2 / 2 nats. Scatter: the same of the mean square
second difference. A stuck sensor repeats readings that white noise never repeats: that is counted.

A fault is fair if the median evidence of its cases is 25 nats or more in one of its columns, nobody
else's is three times larger, the sign is the declared one, and the mean effect is below 5 standard
deviations of a single row. Exit status 1 if one is not.
"""
import argparse
import math
import statistics
import sys

import common
import vehicles as V
from linear import Ridge, filtered

BLOCK = 10
SKIP = .03    # of the run: how it starts depends on a past that is in no log
ENOUGH, ROW = 25.0, 5.0


def blocks(rows, hop=BLOCK):
    return [[sum(x) / hop for x in zip(*rows[k:k + hop])] for k in range(0, len(rows) - hop + 1, hop)]


def unwrapped(rows, i):
    """Column i without jumps, in place: a block mean over a jump of an angle means nothing."""
    for a, b in zip(rows, rows[1:]):
        b[i] = a[i] + common.wrap(b[i] - a[i])


class Run:
    def __init__(self, kind, seed, fault=None):
        self.kind, self.sensors = kind, [i for i, c in enumerate(kind.COLUMNS) if c[:2] == "s."]
        self.columns, rows, self.truth, (twins, self.states, self.edges) = common.make(kind, seed, fault, True)
        twin = [[r[0]] + x for r, x in zip(rows, twins)]
        for i in self.sensors:
            if common.short(kind.COLUMNS[i]) in kind.ANGLES:
                for r, x in zip(rows, twin):
                    x[i] = r[i] + common.wrap(x[i] - r[i])
                unwrapped(rows, i)
        self.rough = [[0.0] * len(r) for r in rows[:2]] + [
            [(p - 2 * q + r) ** 2 / 6 for p, q, r in zip(*w)] for w in zip(rows, rows[1:], rows[2:])]
        self.rough, self.twin, self.rows = blocks(self.rough), blocks(twin), blocks(rows)
        inputs = [i for i, c in enumerate(kind.COLUMNS) if c[:2] in ("u.", "x.")]
        self.inputs = filtered([self.plain(r, inputs) for r in rows], kind.ROWS, BLOCK)
        self.repeats = sum(a[i] == b[i] for a, b in zip(rows, rows[1:]) for i in self.sensors)

    def plain(self, row, inputs):
        """Commands and context of a row; of an angle its sine and cosine."""
        out = []
        for i in inputs:
            angle = common.short(self.kind.COLUMNS[i]) in self.kind.ANGLES
            out += [math.sin(row[i]), math.cos(row[i])] if angle else [row[i]]
        return out

    def others(self, o):
        """Per block: the other sensors, and their changes since the block before."""
        out = []
        for a, b in zip(self.rows[:1] + self.rows, self.rows):
            z = []
            for i in self.sensors:
                if i != o:
                    angle = common.short(self.kind.COLUMNS[i]) in self.kind.ANGLES
                    z += [b[i] - a[i]] if angle else [b[i], b[i] - a[i]]
            out.append(z)
        return out

    def target(self, o):
        """What a model predicts of outcome o: the value, of an angle its change."""
        if common.short(self.kind.COLUMNS[o]) in self.kind.ANGLES:
            return [b[o] - a[o] for a, b in zip(self.rows[:1] + self.rows, self.rows)]
        return [r[o] for r in self.rows]

    def residual(self, o, model):
        if model is None:
            return [r[o] - x[o] for r, x in zip(self.rows, self.twin)]
        return [y - p for y, p in zip(self.target(o), model.predict(self))]

    def mask(self, physical, onset, edges, ramp=False):
        n, end = len(self.rows), self.kind.ROWS * self.kind.DT
        out = []
        for b in range(n):
            on = 0.0
            if b < SKIP * n:
                out.append(0.0)
                continue
            for k in range(b * BLOCK, b * BLOCK + BLOCK):
                t = k * self.kind.DT
                if t >= onset and (not physical or not physical.where
                                   or physical.where(self.states[k], edges)):
                    on += (t - onset) / (end - onset) if ramp else 1.0
            out.append(on / BLOCK)
        return out


def fits(r, m):
    """The size of shape m in residual r: alone, and beside an offset of the run."""
    mm, mr, n, sm, sr = sum(x * x for x in m), sum(x * y for x, y in zip(m, r)), len(m), sum(m), sum(r)
    if mm < 3:
        return None
    beside = mm - sm * sm / n
    return mr / mm, (mr - sm * sr / n) / beside if beside > 1 else mr / mm


def score(value, others):
    mean, sd = statistics.mean(others), statistics.stdev(others)
    return (value - mean) / max(sd, 1e-12)


def judge(case, healthy, fault, o, model):
    """(nats, z, size) of the fault in outcome o of a faulty run."""
    if fault.startswith("stuck"):
        hit = case.kind.COLUMNS[o] in case.truth["columns"]
        return (case.repeats, case.repeats, 0.0) if hit else (0.0, 0.0, 0.0)
    physical = case.kind.PHYSICAL.get(fault)
    what = fault.partition(":")[0]
    ramp = physical.ramp if physical else what == "drift"
    onset = case.truth["onset"]

    def of(run):
        m = run.mask(physical, onset, case.edges, ramp)
        if what == "noise":
            return (math.log(1e-30 + sum(a * x[o] for a, x in zip(m, run.rough)) / sum(m)),) * 2
        if what == "gain":
            m = [a * x[o] for a, x in zip(m, run.twin)]
            rms = math.sqrt(sum(x * x for x in m) / max(1, sum(x != 0 for x in m)))
            m = [x / rms for x in m]
        return fits(run.residual(o, model), m)

    rest = [f for f in map(of, healthy) if f]
    mine = of(case)
    if mine is None or len(rest) < 8:
        return 0.0, 0.0, 0.0
    z = max((score(mine[i], [f[i] for f in rest]) for i in (0, 1)), key=abs)
    return z * z / 2, z, mine[0]


def spread(healthy, o, kind):
    """Standard deviation of a single row about the machine on paper."""
    sigma = kind.SIGMA[common.short(kind.COLUMNS[o])]
    return math.sqrt(sigma ** 2 + statistics.mean(x * x for r in healthy for x in r.residual(o, None)))


def vehicle(name, o):
    kind = V.KIND[name]
    train = [Run(kind, i) for i in range(0 if o.twin else o.train)]
    healthy = [Run(kind, 500 + i) for i in range(o.healthy)]
    sensors = healthy[0].sensors
    alone = {s: None if o.twin else Ridge(train, s, False) for s in sensors}
    beside = {s: None if o.twin else Ridge(train, s, True) for s in sensors}
    bad = 0
    for i, fault in enumerate(V.FAULTS[name]):
        if o.faults and fault not in o.faults.split(","):
            continue
        models = alone if fault in kind.PHYSICAL else beside
        table, z = {s: [] for s in sensors}, {s: [] for s in sensors}
        rows, sizes = [], {s: [] for s in sensors}
        for j in range(o.per):
            case = Run(kind, 700 + 31 * j + 1000 * i, fault)
            rows.append(sum(case.truth["rows"]))
            for s in sensors:
                nats, at, size = judge(case, healthy, fault, s, models[s])
                table[s].append(nats); z[s].append(at); sizes[s].append(abs(size))
        bad += report(kind, name, fault, case.truth, rows, table, z, sizes, healthy)
    return bad


def report(kind, name, fault, truth, rows, table, z, sizes, healthy):
    named = [kind.COLUMNS.index(c) for c in truth["columns"]]
    best = max(named, key=lambda s: statistics.median(table[s]))
    other = max((s for s in table if s not in named), key=lambda s: statistics.median(table[s]))
    sign = kind.PHYSICAL[fault].columns[common.short(kind.COLUMNS[best])] if fault in kind.PHYSICAL else 0
    right = sum((x > 0) == (sign > 0) for x in z[best])
    nats, rival = sorted(table[best]), statistics.median(table[other])
    scatter = fault.startswith(("noise", "stuck"))
    rowwise = 0.0 if scatter else statistics.median(sizes[best]) / spread(healthy, best, kind)
    why = []
    if statistics.median(nats) < ENOUGH:
        why.append("too small")
    if rival > 3 * statistics.median(nats):
        why.append("shows elsewhere")
    if rowwise > ROW:
        why.append("plain in a row")
    if sign and right < len(nats):
        why.append("sign")
    if min(rows) < 60:
        why.append("few rows")
    print("%-10s %-14s %-18s nats %6.0f %6.0f %6.0f  row %4.1f  rows %4d..%-4d  %s %.0f  %s" % (
        name, fault, kind.COLUMNS[best], nats[0], statistics.median(nats), nats[-1], rowwise, min(rows),
        max(rows), kind.COLUMNS[other], rival, "UNFAIR: " + ", ".join(why) if why else "fair"))
    sys.stdout.flush()
    return bool(why)


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--vehicles", default=",".join(V.VEHICLES))
    for k, d in (("train", 24), ("healthy", 24), ("per", 6)):
        a.add_argument("--" + k, default=d, type=int)
    a.add_argument("--faults", help="of these alone, names with commas between")
    a.add_argument("--twin", action="store_true", help="the machine on paper instead of a learnt model")
    o = a.parse_args()
    bad = sum(vehicle(v, o) for v in o.vehicles.split(","))
    print("unfair: %d" % bad)
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
