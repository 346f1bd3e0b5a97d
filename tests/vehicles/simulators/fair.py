#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Is every fault of a machine fair: plain to a crude scan of a whole run, hidden in a single row?

  tests/vehicles/simulators/fair.py --vehicle NAME [--per 6] [--faults NAME,...]

For example:

  tests/vehicles/simulators/fair.py --vehicle aircraft --per 4 --faults power,carbice

The scan knows the fault's place and time, but not its size or sign. It fits every sensor on healthy
runs by ridge regression on three or four sets of features:

A  the commands, their exponential means, context, and products of pairs of the shortest means
B  these, and the other sensors in the same row, with products of pairs of all
C  B, and the sensor's own reading some seconds earlier: for what integrates or warms up slowly
D  B without the sensors that share an equation (current and speed of one motor), where a machine
   names such

The effect of a case is the slope of the residual on the fault's shape (1 in faulty rows, a ramp for
a drift, the reading for a gain) beside an offset of the run. Its variance is that of block means of
50 rows of healthy residuals. Evidence: z^2 / 2 nats; the effect is printed in standard deviations
of a single row's residual. Noise: the variance of the residual's first differences. A stuck sensor
is not scanned, since white noise never repeats a reading.

A fault is fair if in one of the sets its best accepted outcome has 25 nats or more (median of the
cases), an effect below 5 standard deviations, the declared sign in 3 of 4 cases, and no other
outcome has three times as much. Exit status 1 if one is not.
"""
import argparse
import collections
import sys

import machines
import numpy as np
from base import short

BLOCK = 50
ENOUGH, ROW, SIGN, OTHERS = 25, 5, .75, 3
FEWEST = 40     # a run with fewer faulty rows is no case
RIDGE = 1e-5

Case = collections.namedtuple("Case", "rows truth evidence")
# of the cases of a fault in one sensor: median evidence, median effect, share of right signs
Outcome = collections.namedtuple("Outcome", "name nats effect sign")


def filtered(x, gain):
    """The exponential mean of every column of x, of shape (rows, columns)."""
    out, mean = np.empty_like(x), x[0].copy()
    for i in range(len(x)):
        mean += gain * (x[i] - mean)
        out[i] = mean
    return out


def products(x):
    """Squares and products of the columns of x."""
    n = x.shape[1]
    return np.column_stack([x[:, i] * x[:, j] for i in range(n) for j in range(i, n)])


class Ridge:
    """A linear model of y, whose first feature is 1 and has no penalty to speak of."""
    def __init__(self, x, y):
        self.mean, self.sd = x.mean(0), x.std(0) + 1e-9
        self.mean[0], self.sd[0] = 0, 1
        z = (x - self.mean) / self.sd
        penalty = RIDGE * len(z) * np.eye(z.shape[1])
        self.weights = np.linalg.solve(z.T @ z + penalty, z.T @ y)

    def residual(self, x, y):
        return y - ((x - self.mean) / self.sd) @ self.weights


class Scan:
    """The models of a machine's sensors, and how much their residuals vary in healthy runs."""
    def __init__(self, name):
        self.name, self.kind = name, machines.CLASS[name]
        columns = self.kind.COLUMNS
        self.commands = [i for i, c in enumerate(columns) if c[0] == "u"]
        self.context = [i for i, c in enumerate(columns) if c[0] == "x"]
        sensors = [i for i, c in enumerate(columns) if c[0] == "s"]
        self.angles = [i for i in sensors if short(columns[i]) in self.kind.ANGLES]
        self.plain = [i for i in sensors if i not in self.angles]
        self.scanned = [i for i in self.plain if short(columns[i]) not in self.kind.NOT_SCANNED]
        self.sets = "ABCD" if self.kind.PARTNER else "ABC"
        self.scale, self.models, self.variance, self.row_sd = {}, {}, {}, {}
        self.learn()

    def gain(self, time_constant):
        return min(1., self.kind.RATE / time_constant)

    def prepare(self, rows):
        """A run with what all its sensors' features share: (rows, linear ones, shortest means)."""
        means = [filtered(rows[:, self.commands], self.gain(tau)) for tau in self.kind.TAUS]
        ones = np.ones((len(rows), 1))
        linear = [ones, rows[:, self.commands]] + means + [rows[:, self.context]]
        return rows, linear, means[0]

    def others(self, i, which):
        """The sensors that may explain the sensor i."""
        name = short(self.kind.COLUMNS[i])
        partners = self.kind.PARTNER.get(name, ()) if which == "D" else ()
        return [j for j in self.plain if j != i and short(self.kind.COLUMNS[j]) not in partners]

    def features(self, prepared, i, which):
        """The features of the sensor i in the set `which`, of shape (rows, features)."""
        rows, linear, means = prepared
        own = np.hstack([means, rows[:, self.context]])
        if which == "A":
            return np.hstack(linear + [products(own)])
        other = rows[:, self.others(i, which)]
        turned = rows[:, self.angles]
        trigonometric = [np.sin(turned), np.cos(turned)] if self.kind.TRIG else []
        pairs = np.hstack([own, other])
        if which != "D":
            mean, sd = self.scale[i]
            pairs = (pairs - mean) / sd
        out = linear + [other] + trigonometric + [products(pairs)]
        if which == "C":
            rows_back = round(self.kind.LAG / self.kind.RATE)
            past = filtered(rows[:, i], self.gain(self.kind.LAG_MEAN))
            past = np.concatenate([np.full(rows_back, past[0]), past[:-rows_back]])
            out.append(past[:, None])
        return np.hstack(out)

    def learn(self):
        """Fits every sensor's models on the first healthy runs, and measures them on the others."""
        total, fit = self.kind.HEALTHY
        healthy = [self.prepare(np.array(machines.run(self.name, 3000 + i)[1]))
                   for i in range(total)]
        for i in self.scanned:
            other = self.others(i, "B")
            known = np.vstack([np.hstack([means, rows[:, self.context], rows[:, other]])
                               for rows, _, means in healthy[:fit]])
            self.scale[i] = known.mean(0), known.std(0) + 1e-9
            for which in self.sets:
                x = [self.features(run, i, which) for run in healthy]
                y = [run[0][:, i] for run in healthy]
                model = Ridge(np.vstack(x[:fit]), np.concatenate(y[:fit]))
                self.measure(which, i, [model.residual(*xy) for xy in zip(x[fit:], y[fit:])])
                self.models[which, i] = model

    def measure(self, which, i, residuals):
        """Keeps how much a row and a block mean of fresh healthy residuals vary within a run."""
        means = [e[:len(e) // BLOCK * BLOCK].reshape(-1, BLOCK).mean(1) for e in residuals]
        self.variance[which, i] = BLOCK * np.mean([np.var(m, ddof=1) for m in means])
        self.row_sd[which, i] = np.std(np.concatenate([e - e.mean() for e in residuals]))

    def shape(self, fault, rows, act, i):
        """What the fault adds to the sensor i, up to a factor; act: 0 or 1 for every row."""
        if fault.startswith("drift"):
            ramp, late = act.copy(), np.flatnonzero(act)
            ramp[late] = np.arange(len(late)) / len(late)
            return ramp
        if fault.startswith("gain"):
            return act * rows[:, i]
        if fault in self.kind.SHAPE:
            return act * np.tanh(rows[:, self.kind.COLUMNS.index(self.kind.SHAPE[fault])] * 20)
        return act

    def evidence(self, fault, rows, truth):
        """(nats, effect) of a faulty run, for every set and scanned sensor."""
        act, prepared, out = np.array(truth["rows"], float), self.prepare(rows), {}
        for i in self.scanned:
            shape = self.shape(fault, rows, act, i)
            centred = shape - shape.mean()
            power, typical = centred @ centred, np.sqrt(np.mean(shape[act > 0] ** 2))
            for which in self.sets:
                e = self.models[which, i].residual(self.features(prepared, i, which), rows[:, i])
                if fault.startswith("noise"):
                    out[which, i] = self.rougher(e, act)
                    continue
                slope = (centred @ e) / power
                out[which, i] = (slope * slope * power / self.variance[which, i] / 2,
                                 slope * typical / self.row_sd[which, i])
        return out

    @staticmethod
    def rougher(e, act):
        """(nats, ratio of variances) of the first differences of a residual in faulty rows."""
        steps, late = np.diff(e), act[1:]
        ratio = steps[late > 0].var() / steps[late == 0].var()
        return late.sum() / 1.5 / 4 * max(0, ratio - 1 - np.log(ratio)), ratio

    def outcomes(self, cases, fault, which):
        """The Outcome of every scanned sensor; a sign that is declared 0 is right in any case."""
        for i in self.scanned:
            name = self.kind.COLUMNS[i]
            nats, effects = zip(*(case.evidence[which, i] for case in cases))
            signs = [case.truth["columns"].get(name, 0) for case in cases]
            right = [want == 0 or (x > 0) == (want > 0) for x, want in zip(effects, signs)]
            if ":" in fault and name in cases[0].truth["columns"]:
                effects = np.abs(effects)    # a sensor's fault goes either way
            yield Outcome(name, np.median(nats), np.median(effects), np.mean(right))

    def fair(self, cases, fault, which):
        """Prints what the set `which` sees of a fault; whether that is fair."""
        accepted = cases[0].truth["columns"]
        every = list(self.outcomes(cases, fault, which))
        named = [x for x in every if x.name in accepted]
        others = sorted((x for x in every if x.name not in accepted), key=lambda x: -x.nats)[:3]
        best = max(named, key=lambda x: x.nats)
        hidden = abs(best.effect) < ROW or fault.startswith("noise")
        passed = best.nats >= ENOUGH and hidden and best.sign >= SIGN \
            and others[0].nats < OTHERS * best.nats
        print("   %s%s %s | others %s" % (
            which, "*" if passed else " ",
            ", ".join("%s %.0f nats %+.2f sd sign %.2f" % x for x in named),
            ", ".join("%s %.0f %+.2f" % x[:3] for x in others)), flush=True)
        return passed

    def judge(self, fault, per):
        """Draws and prints `per` runs of a fault; whether the fault is fair."""
        first, cases, shares = 9000 + 1000 * self.kind.FAULTS.index(fault), [], []
        for j in range(per):
            _, rows, truth = machines.run(self.name, first + 31 * j, fault)
            shares.append(sum(truth["rows"]) / len(rows))
            if sum(truth["rows"]) >= FEWEST:
                rows = np.array(rows)
                cases.append(Case(rows, truth, self.evidence(fault, rows, truth)))
        print("%s: share of rows %.2f (%.2f..%.2f), under %d rows: %d of %d" % (
            fault, np.median(shares), min(shares), max(shares), FEWEST, per - len(cases), per))
        if fault.startswith("stuck"):
            return True
        passed = bool(cases) and any([self.fair(cases, fault, which) for which in self.sets])
        print("   -> " + ("fair" if passed else "NOT FAIR"), flush=True)
        return passed

    def describe(self):
        print("single-row residual sd / sensor noise (sd of block means / white):")
        for i in self.scanned:
            name, line = self.kind.COLUMNS[i], ""
            for which in self.sets:
                sd = self.row_sd[which, i]
                line += "  %s %6.2f (%.1f)" % (which, sd / self.kind.SIGMA[short(name)],
                                               self.variance[which, i] ** .5 / sd)
            print("  %-18s%s" % (name, line), flush=True)


def main():
    a = argparse.ArgumentParser(description=__doc__,
                                formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--vehicle", required=True, choices=machines.VEHICLES)
    a.add_argument("--per", default=6, type=int, help="runs of each fault")
    a.add_argument("--faults", help="names with commas between; default: all")
    o = a.parse_args()
    faults = o.faults.split(",") if o.faults else machines.FAULTS[o.vehicle]
    unknown = set(faults) - set(machines.FAULTS[o.vehicle])
    if unknown:
        a.error("%s has no fault %s" % (o.vehicle, ", ".join(sorted(unknown))))
    scan = Scan(o.vehicle)
    scan.describe()
    failed = [fault for fault in faults if not scan.judge(fault, o.per)]
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
