# SPDX-License-Identifier: MIT
"""Runs of vehicles that kin.py and fleet.py draw: faults, sensors and truth, the same for both.

A vehicle is a class: RATE (s), LENGTH (rows), NOISES (of a step), COLUMNS, SIGMA and TYPICAL (white
noise and usual value of a sensor, by short name), PHYSICAL ({fault: (least and largest strength,
{outcome: sign}, features of the region)}), FAULTS; __init__(dice), pilot(t) -> commands,
inside(fault, place), step(commands, noise, {fault: strength}), sense() -> true values.
"""
import math
import random


def wrap(a):
    return (a + math.pi) % (2 * math.pi) - math.pi


def clip(x, lo, hi):
    return lo if x < lo else hi if x > hi else x


def short(c):
    return c[2:].rsplit("_", 1)[0] if "_" in c else c[2:]


class Fault:
    """What is drawn for a fault: when, how strong, where; nothing here reads the run's own dice."""

    def __init__(self, drawn, vehicle, seed, fault):
        r = random.Random("%s fault %s %s %d" % (drawn.tag, vehicle, fault, seed))
        c = drawn.kinds[vehicle]
        self.end = c.RATE * c.LENGTH
        self.kind, _, self.name = (fault or "").partition(":")
        self.onset, sign = r.uniform(.25, .5) * self.end, r.choice([-1, 1])
        many, share = r.uniform(*drawn.many), r.random()
        self.place = [r.random() for _ in range(4)]
        self.physical = c.PHYSICAL.get(self.kind) if not self.name else None
        if self.physical:
            low, high, _, features = self.physical
            self.strength = low + share * (high - low)
            self.onset = 0.0 if features else self.onset
        elif self.name:
            self.size = sign * many * c.SIGMA[self.name]
            self.gain = self.size / c.TYPICAL.get(self.name, 1.0)

    def acts(self, machine, t):
        """{fault: strength} where the physical fault acts now, otherwise nothing."""
        if self.physical and t >= self.onset and machine.inside(self.kind, self.place):
            return {self.kind: self.strength}
        return {}


class Drawn:
    """The runs of some kinds {name: class}. tag: of their dice; many: least and largest sensor
    bias, in white noise; drift: its end over the bias's size; turns: angles all round."""

    def __init__(self, tag, kinds, many, drift, turns=()):
        self.tag, self.kinds, self.many, self.drift, self.turns = tag, kinds, many, drift, turns

    def column(self, vehicle, name):
        return next(c for c in self.kinds[vehicle].COLUMNS if c.startswith("s.") and short(c) == name)

    def states(self, vehicle, seed, fault):
        """Rows of commands and true sensor values, and where a physical fault acts."""
        dice, c = random.Random("%s states %s %d" % (self.tag, vehicle, seed)), self.kinds[vehicle]
        machine, out, acts = c(random.Random("%s start %s %d" % (self.tag, vehicle, seed))), [], []
        for k in range(c.LENGTH):
            t = k * c.RATE
            u, a = machine.pilot(t), fault.acts(machine, t)
            machine.step(u, [dice.gauss(0, 1) for _ in range(machine.NOISES)], a)
            out.append(tuple(u) + tuple(machine.sense()))
            acts.append(int(bool(a)))
        return out, acts

    def measure(self, vehicle, seed, out):
        """The sensors of the run: a bias and a scale of their own, and white noise; angles wrap."""
        q, c = random.Random("%s sensors %s %d" % (self.tag, vehicle, seed)), self.kinds[vehicle]
        names = [(i, short(n)) for i, n in enumerate(c.COLUMNS[1:]) if n.startswith("s.")]
        own = [(i, c.SIGMA[a], q.gauss(0, .3), 1 + q.gauss(0, .002 * (a not in self.turns)),
                a in self.turns) for i, a in names]
        rows = []
        for s in out:
            x = list(s)
            for i, sg, bias, scale, turns in own:
                x[i] = x[i] * scale + sg * (bias + q.gauss(0, 1))
                if turns:
                    x[i] = wrap(x[i])
            rows.append(x)
        return rows

    def spoil(self, vehicle, seed, f, out, rows):
        """Puts a sensor fault into the rows; returns 0/1 for every row."""
        q = random.Random("%s spoil %s %s %s %d" % (self.tag, vehicle, f.kind, f.name, seed))
        c, hold, mask = self.kinds[vehicle], None, []
        hit = c.COLUMNS.index(self.column(vehicle, f.name)) - 1
        for k, x in enumerate(rows):
            t = k * c.RATE
            mask.append(int(t >= f.onset))
            if t < f.onset:
                continue
            if f.kind == "bias":
                x[hit] += f.size
            elif f.kind == "drift":
                x[hit] += self.drift * f.size * (t - f.onset) / (f.end - f.onset)
            elif f.kind == "gain":
                x[hit] += f.gain * out[k][hit]
            elif f.kind == "noise":
                x[hit] += q.gauss(0, 1.3 * c.SIGMA[f.name])
            elif f.kind == "stuck":
                if k % 5 == 0 or hold is None:
                    hold = x[hit]
                x[hit] = hold
        return mask

    def run(self, vehicle, seed, fault=None):
        """(columns, rows, truth), as grade.py reads them."""
        c = self.kinds[vehicle]
        if fault and fault not in c.FAULTS:
            raise ValueError("%s has no fault %s" % (vehicle, fault))
        f = Fault(self, vehicle, seed, fault)
        out, acts = self.states(vehicle, seed, f)
        rows, truth = self.measure(vehicle, seed, out), None
        if f.name:
            mask = self.spoil(vehicle, seed, f, out, rows)
            sign = (1 if f.size > 0 else -1) if f.kind in ("bias", "drift") else 0
            kinds = {"noise": ("variance",), "stuck": ("repeat", "variance")}.get(f.kind)
            truth = dict(columns={self.column(vehicle, f.name): sign}, onset=f.onset, rows=mask,
                         features=(), size=f.size if f.kind == "bias" else None, kinds=kinds)
        elif f.physical:
            _, _, signs, features = f.physical
            truth = dict(columns={self.column(vehicle, a): b for a, b in signs.items()},
                         onset=f.onset, rows=acts, features=features, size=None, kinds=None)
        return c.COLUMNS, [[k * c.RATE] + x for k, x in enumerate(rows)], truth
