# SPDX-License-Identifier: MIT
"""Runs of the machines that harbour.py, quay.py and orchard.py draw: dice, faults and truth, the same for all three.

A machine is a class: RATE (s), LENGTH (rows), NOISES (dice of a step), COLUMNS (time first), SIGMA (white noise of sensors and context
by short name), STEP (of those that are rounded), WRAP ({name: (low, high)} of angles), SENSOR ({fault: (least and largest size)}),
PHYSICAL ({fault: (least and largest strength, {outcome: sign}, features of its place)}), RAMPS (faults that grow from the onset on);
__init__(dice), pilot(t) -> commands, inside(fault, place, commands), step(commands, noise, {fault: strength}), context() and sense() ->
true values. Nothing that is drawn for mission, parameters, disturbances and sensors depends on the fault.
"""
import math
import random

KINDS = {"noise": ("variance",), "stuck": ("repeat", "variance")}


def clip(x, low, high):
    return low if x < low else high if x > high else x


def wrap(x, low, high):
    return (x - low) % (high - low) + low


def short(column):
    return column[2:].rsplit("_", 1)[0] if "_" in column else column[2:]


def some(r, x, share=.004):
    return x * (1 + r.gauss(0, share))


def steps(r, end, shortest, longest, draw):
    """A plan [(second, value)] of values that hold for a random while."""
    t, plan = 0., []
    while t < end:
        plan.append((t, draw()))
        t += r.uniform(shortest, longest)
    return plan


def now(plan, t, i):
    """The index of the plan's entry at t, from i on."""
    while i + 1 < len(plan) and plan[i + 1][0] <= t:
        i += 1
    return i


def names(c):
    """(place in a row, short name) of sensors and context."""
    return [(i, short(n)) for i, n in enumerate(c.COLUMNS[1:]) if n[0] in "sx"]


def sensor(c, name):
    return next(x for x in c.COLUMNS if x[:2] == "s." and short(x) == name)


def spoil(c, what, hit, size, rows, true, start, q):
    """Puts a sensor fault into the rows from `start` on; the hit column only."""
    kept, slow = None, true[max(0, start - 1)][hit]
    for k in range(start, len(rows)):
        x = rows[k]
        if what == "bias":
            x[hit] += size
        elif what == "drift":
            x[hit] += size * (k - start) / (len(rows) - start)
        elif what == "gain":
            x[hit] += size * true[k][hit]
        elif what == "noise":
            x[hit] += q.gauss(0, size)
        elif what == "stuck":
            kept = x[hit] = x[hit] if (k - start) % int(size) == 0 else kept
        elif what == "lag":
            slow += (1 - math.exp(-c.RATE / size)) * (true[k][hit] - slow)
            x[hit] += slow - true[k][hit]


def finish(c, rows):
    """Rounds, wraps and puts the time in front."""
    for i, name in names(c):
        step, turn = c.STEP.get(name), getattr(c, "WRAP", {}).get(name)
        for x in rows:
            if step:
                x[i] = round(round(x[i] / step) * step, 6)
            if turn:
                x[i] = wrap(x[i], *turn)
    return [[round(k * c.RATE, 6)] + x for k, x in enumerate(rows)]


class Lot:
    """The machines of a module, {vehicle: class}, under its name; measure(class, rows, dice) -> what sensors read of true values."""

    def __init__(self, name, machines, measure):
        self.name, self.machines, self.measure = name, machines, measure
        self.faults = {v: tuple(c.SENSOR) + tuple(c.PHYSICAL) for v, c in machines.items()}

    def dice(self, *what):
        return random.Random(" ".join((self.name, *map(str, what))))

    def of(self, what):
        """An attribute of every class by its vehicle."""
        return {v: getattr(c, what) for v, c in self.machines.items()}

    def simulate(self, vehicle, seed, fault, strength, began, place):
        """Rows of what perfect sensors would read, and whether the physical fault acts in them."""
        c = self.machines[vehicle]
        machine, dice, end = c(self.dice("machine", vehicle, seed)), self.dice("weather", vehicle, seed), c.LENGTH * c.RATE
        rows, acts = [], []
        for k in range(c.LENGTH):
            t, a = k * c.RATE, {}
            u = machine.pilot(t)
            if fault and k and t >= began and machine.inside(fault, place, u):
                a[fault] = strength * ((t - began) / (end - began) if fault in c.RAMPS else 1)
            machine.step(u, [dice.gauss(0, 1) for _ in range(c.NOISES)], a)
            rows.append([*u, *machine.context(), *machine.sense()])
            acts.append(int(bool(a)))
        return rows, acts

    def run(self, vehicle, seed, fault=None):
        """(columns, rows, truth) of one run; truth is None in a healthy one."""
        c = self.machines[vehicle]
        if fault and fault not in self.faults[vehicle]:
            raise ValueError("%s has no fault %s" % (vehicle, fault))
        q = self.dice("fault", vehicle, fault, seed)
        onset, early = q.uniform(.25, .6) * c.LENGTH * c.RATE, q.random() < .5
        place, part, sign = [q.random() for _ in range(4)], q.random(), q.choice([-1, 1])
        truth = None
        if fault in c.PHYSICAL:
            low, high, columns, features = c.PHYSICAL[fault]
            began = 0. if features and early else onset
            true, acts = self.simulate(vehicle, seed, fault, low + (high - low) * part, began, place)
            first = round(acts.index(1) * c.RATE, 6) if any(acts) else began
            truth = dict(columns={sensor(c, a): s for a, s in columns.items()}, onset=first, rows=acts, features=features, size=None,
                         kinds=None)
        else:
            true, _ = self.simulate(vehicle, seed, None, 0., 0., place)
        rows = self.measure(c, [list(x) for x in true], self.dice("sensors", vehicle, seed))
        if fault and not truth:
            what, _, name = fault.partition(":")
            column, (low, high) = sensor(c, name), c.SENSOR[fault]
            hit, start = c.COLUMNS.index(column) - 1, int(math.ceil(onset / c.RATE))
            size = low + (high - low) * part
            if what in ("bias", "drift", "gain"):
                size *= sign
            if what in ("bias", "drift", "noise"):
                size *= c.SIGMA[name]
            size = round(size) if what == "stuck" else size
            spoil(c, what, hit, size, rows, true, start, q)
            signed = what in ("bias", "drift") or what == "gain" and min(x[hit] for x in true) >= 0
            truth = dict(columns={column: sign if signed else 0}, onset=onset, rows=[int(k >= start) for k in range(c.LENGTH)],
                         features=(), size=size if what == "bias" else None, kinds=KINDS.get(what))
        return list(c.COLUMNS), finish(c, rows), truth
