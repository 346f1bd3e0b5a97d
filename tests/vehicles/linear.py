# SPDX-License-Identifier: MIT
"""The crude nominal model of fair.py: ridge regression on filtered commands. Pure standard library."""
import math

CONSTANTS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)    # rows
FAST, SLOW = 2, 6    # of these the products too
DECAYS = (.03, .12, .5)            # of the run


def filtered(rows, length, block):
    """Per block: running means of the commands, products of two of them, time, decays."""
    state = [[x] * len(CONSTANTS) for x in rows[0]]
    sums, out, total = None, [], [0.0] * len(rows[0])
    for k, row in enumerate(rows):
        for s, x in zip(state, row):
            for i, c in enumerate(CONSTANTS):
                s[i] += (x - s[i]) / c
        now = [v for s in state for v in s]
        mid = [s[FAST] for s in state]
        now += [a * b for i, a in enumerate(mid) for b in mid[i:]] + [abs(a) for a in mid]
        slow = [s[SLOW] for s in state]
        now += [a * b for i, a in enumerate(slow) for b in slow[i:]]
        total = [a + x / length for a, x in zip(total, row)]
        now += total + [k / length] + [math.exp(-k / length / d) for d in DECAYS]
        sums = now if sums is None else [a + b for a, b in zip(sums, now)]
        if k % block == block - 1:
            out.append([x / block for x in sums])
            sums = None
    return out


def solve(a, b):
    """x of a x = b for a symmetric positive definite a, by elimination."""
    n = len(b)
    m = [list(row) + [y] for row, y in zip(a, b)]
    for i in range(n):
        for j in range(i + 1, n):
            f = m[j][i] / m[i][i]
            if f:
                mi, mj = m[i], m[j]
                for k in range(i, n + 1):
                    mj[k] -= f * mi[k]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (m[i][n] - sum(m[i][k] * x[k] for k in range(i + 1, n))) / m[i][i]
    return x


def gram(data):
    n = len(data[0])
    out = [[0.0] * n for _ in range(n)]
    for z in data:
        for i in range(n):
            if z[i]:
                a, row = z[i], out[i]
                for j in range(i, n):
                    row[j] += a * z[j]
    for i in range(n):
        for j in range(i):
            out[i][j] = out[j][i]
    return out


class Ridge:
    """Of one outcome, learnt from healthy runs (fair.Run); the first block tells the start."""

    def __init__(self, runs, o, others):
        self.o, self.others = o, others
        raw = [z for run in runs for z in self.inputs(run)]
        y = [v for run in runs for v in run.target(o)]
        n = len(raw)
        self.mean = [sum(c) / n for c in zip(*raw)]
        self.sd = [math.sqrt(sum((x - m) ** 2 for x in c) / n) for c, m in zip(zip(*raw), self.mean)]
        self.sd = [s if s > 1e-9 * (1 + abs(m)) else 1e30 for s, m in zip(self.sd, self.mean)]
        data = [self.standard(z) for z in raw]
        self.offset = sum(y) / n
        matrix = gram(data)
        for i in range(len(matrix)):
            matrix[i][i] += 1e-6 * n
        right = [sum(z[i] * (v - self.offset) for z, v in zip(data, y)) for i in range(len(matrix))]
        self.weight = solve(matrix, right)

    def inputs(self, run):
        """Per block: the commands, the start of the run and its decays, other sensors if asked."""
        start = run.target(self.o)[0]
        out = [z + [start] + [start * x for x in z[-len(DECAYS):]] for z in run.inputs]
        return [z + x for z, x in zip(out, run.others(self.o))] if self.others else out

    def standard(self, z):
        return [(x - m) / s for x, m, s in zip(z, self.mean, self.sd)]

    def predict(self, run):
        return [self.offset + sum(w * x for w, x in zip(self.weight, self.standard(z)))
                for z in self.inputs(run)]
