#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""formulas.py --rim RIM --work DIR [--seed 1] [--count 40] [--least .8]: laws that no catalogue names, drawn at random, and how often
what rim diagnose claims of them is right.

A law is a product of up to three functions (powers, roots, exp, sin, abs, inverses), a ratio, a function of a product or of a difference, or
a sum of two of these, of six features, with a root mean square of two stated deviations. Two logs are fitted, one is the hold-out; the rim
gets no more. Right: over a fresh log, which it never saw, the R2 of what all its findings add with the law is above .95. Printed: a line a case,
the share with its 95 % interval (Wilson), by the kind of law; exit status 1 where the share is below --least. Shares no code with the engine."""
import argparse
import concurrent.futures
import json
import math
import os
import random
import re
import subprocess
import sys

SIGNED, POSITIVE = ("x.tilt", "x.flow_Lps", "u.valve"), ("x.level_m", "x.supply_V", "x.mass_kg")
ROWS, DT, SD = 1200, .1, .05


def smooth(rng, low, high):
    """A function of time between two values, of four slow sines; pressed against the ends so that these are visited."""
    parts = [(rng.uniform(.3, 1), rng.uniform(.01, .12), rng.uniform(0, 6.28)) for _ in range(4)]
    size = math.sqrt(sum(a * a for a, _, _ in parts) / 2)

    def at(t):
        x = sum(a * math.sin(6.28 * w * t + p) for a, w, p in parts) / size
        return low + (high - low) * (.5 + .5 * math.tanh(.9 * x))
    return at


RANGE = {"x.tilt": (-1.2, 1.2), "x.flow_Lps": (-8, 8), "u.valve": (-1, 1), "x.level_m": (.3, 2.5), "x.supply_V": (9, 15), "x.mass_kg": (20, 60)}


def factor(rng, name):
    """A function of one feature and its text."""
    low, high = RANGE[name]
    size = max(abs(low), abs(high))
    w, k = size * rng.uniform(.3, 1), rng.uniform(1.2, 3.5) / size
    shared = [(lambda x: x, "%s"), (lambda x: x, "%s"), (lambda x: x * x, "%s^2"), (lambda x: math.exp(-abs(x) / w), "exp(-|%s|/" + "%.3g)" % w),
              (lambda x: math.sin(k * x), "sin(" + "%.3g" % k + " %s)"), (lambda x: math.sqrt(abs(x)), "sqrt|%s|"), (lambda x: x ** 3, "%s^3")]
    own = [(abs, "|%s|")] if low < 0 else [(lambda x: 1 / x, "1/%s"), (lambda x: x ** 1.5, "%s^1.5")]
    f, text = rng.choice(shared + own)
    return (lambda p: f(p[name])), text % name


def product(rng, least):
    names = rng.sample(SIGNED + POSITIVE, rng.choice([n for n in (1, 2, 2, 3) if n >= least]))
    parts = [factor(rng, n) for n in names]
    return (lambda p: math.prod(f(p) for f, _ in parts)), " * ".join(t for _, t in parts)


def draw(rng):
    """A law, its text and its kind."""
    kind = rng.choice(["product", "product", "ratio", "sum", "sum", "inner"])
    if kind == "product":
        f, text = product(rng, 2)
    elif kind == "ratio":
        (f1, t1), under = product(rng, 1), rng.choice(POSITIVE)
        f, text = (lambda p: f1(p) / p[under]), "(%s) / %s" % (t1, under)
    elif kind == "sum":
        (f1, t1), (f2, t2) = product(rng, 1), product(rng, 1)
        r1, r2 = (rms([g(row) for row in context(random.Random(5))]) for g in (f1, f2))
        share = rng.choice([-1, 1]) * rng.uniform(.5, 1) * r1 / r2
        f, text = (lambda p: f1(p) + share * f2(p)), "%s + %.3g * %s" % (t1, share, t2)
    else:
        a, b = rng.sample(SIGNED + POSITIVE, 2)
        ra, rb = (max(abs(x) for x in RANGE[n]) for n in (a, b))
        k = rng.uniform(1.2, 3)
        f, text = rng.choice([
            (lambda p: math.sin(k * p[a] * p[b] / ra / rb), "sin(k %s %s)" % (a, b)),
            (lambda p: math.exp(-k * abs(p[a] * p[b]) / ra / rb), "exp(-k |%s %s|)" % (a, b)),
            (lambda p: abs(p[a] / ra - p[b] / rb), "|%s - k %s|" % (a, b)),
            (lambda p: math.sqrt(abs(p[a] * p[b])), "sqrt|%s %s|" % (a, b))])
    return f, text, kind


def context(rng, rows=ROWS):
    paths = {n: smooth(rng, *RANGE[n]) for n in SIGNED + POSITIVE}
    return [{n: paths[n](i * DT) for n in paths} for i in range(rows)]


def rms(x):
    mean = sum(x) / len(x)
    return math.sqrt(sum((v - mean) ** 2 for v in x) / len(x)) + 1e-300


def case(seed):
    rng = random.Random("formulas %d" % seed)
    f, text, kind = draw(rng)
    logs = [context(rng) for _ in range(4)]
    scale = 2 * SD / rms([f(p) for log in logs[:2] for p in log])
    return (lambda p: scale * f(p)), text, kind, logs, rng


def write(path, log, law, rng):
    names = list(SIGNED + POSITIVE)
    with open(path, "w", encoding="utf-8") as out:
        out.write(",".join(["t_s"] + names + ["z.y", "m.y", "sd.y"]) + "\n")
        for i, p in enumerate(log):
            m = .3 * p["u.valve"] + .01 * p["x.supply_V"]
            out.write(",".join("%.8g" % x for x in [i * DT] + [p[n] for n in names] + [m + law(p) + SD * rng.gauss(0, 1), m, SD]) + "\n")


# ---- what was claimed, from diagnosis.json alone

FUNCTIONS = {n: getattr(math, n) for n in ("sin", "cos", "tan", "tanh", "exp", "sqrt")}
FUNCTIONS.update(abs=abs, min=min, max=max, sign=lambda v: (v > 0) - (v < 0), ln=math.log)


def inside(region, p):
    for n, (low, high), is_open in zip(region["features"], region["bounds"], region["open"] or [(False, False)] * 9):
        if n not in p or (p[n] < low and not is_open[0]) or (p[n] > high and not is_open[1]):
            return False
    return True


def added(finding):
    """What a finding adds at a context; None where it is no function of it."""
    form, sizes = finding["form"], finding["parameters"]
    if form["kind"] != "mean":
        return lambda p: 0.0
    if form["name"] == "table":
        name, x, y = next(iter(form["arguments"].values())), form["knots"], form["values"]

        def table(p):
            k = max(0, min(len(x) - 2, sum(p[name] > v for v in x) - 1))
            part = max(0.0, min(1.0, (p[name] - x[k]) / (x[k + 1] - x[k])))
            return y[k] + part * (y[k + 1] - y[k])
        return table
    if not form["basis"]:
        return None
    values = {n: v["value"] for n, v in sizes.items()}
    shapes = {n: v for n, v in values.items() if re.search(r"\b%s\b" % n, " ".join(form["basis"]))}
    factors = [v for n, v in values.items() if n not in shapes] or [1.0]
    code = [compile(b.replace("^", "**"), "basis", "eval") for b in form["basis"]]

    def value(p):
        known = dict(FUNCTIONS, m=.3 * p["u.valve"] + .01 * p["x.supply_V"], t=p["t_s"], **shapes)
        known.update({k: p[n] for k, n in form["arguments"].items()})
        return inside(finding["region"], p) * sum(s * eval(c, {"__builtins__": {}}, known) for s, c in zip(factors, code))
    return value


def judge(o, seed):
    law, text, kind, logs, rng = case(seed)
    folder = os.path.join(o.work, str(seed))
    os.makedirs(folder, exist_ok=True)
    files = [os.path.join(folder, n) for n in ("run_1.csv", "run_2.csv", "holdout_1.csv")]
    for path, log in zip(files, logs):
        write(path, log, law, rng)
    done = subprocess.run([o.rim, "diagnose", *files[:2], "--holdout", files[2], "--out", folder + "/out"], capture_output=True, text=True,
                          check=False, env=dict(os.environ, RIM_THREADS="1"))
    if done.returncode not in (0, 1):
        return seed, kind, text, None, done.stderr.strip()
    with open(folder + "/out/diagnosis.json", encoding="utf-8") as lines:
        findings = json.load(lines)["findings"]
    claimed = " ; ".join(f["expression"] for f in findings)
    parts = [added(f) for f in findings]
    if any(p is None for p in parts):
        return seed, kind, text, None, claimed
    fresh = [dict(p, t_s=i * DT) for i, p in enumerate(logs[3])]
    truth = [law(p) for p in fresh]
    left = [t - sum(part(p) for part in parts) for t, p in zip(truth, fresh)]
    return seed, kind, text, 1 - sum(e * e for e in left) / (rms(truth) ** 2 * len(truth)), claimed


def interval(k, n):
    z, p = 1.96, k / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rim", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--least", type=float, default=0.0)
    o = parser.parse_args()
    of_kind = {}
    print("seed   R2      right  kind     law | claimed")
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for seed, kind, text, r2, claimed in pool.map(lambda s: judge(o, s), range(o.seed, o.seed + o.count)):
            right = r2 is not None and r2 > .95
            of_kind.setdefault(kind, []).append(right)
            print("%-6d %-7s %-5s  %-8s %s | %s" % (seed, "-" if r2 is None else "%.3f" % r2, "yes" if right else "NO", kind, text, claimed), flush=True)
    for kind, all_ in sorted(of_kind.items()) + [("all", sum(of_kind.values(), []))]:
        low, high = interval(sum(all_), len(all_))
        print("%-8s right (R2 with the law above .95 on fresh contexts): %d/%d, %.0f %% (95 %% interval %.0f to %.0f)" %
              (kind, sum(all_), len(all_), 100 * sum(all_) / len(all_), 100 * low, 100 * high))
    sys.exit(sum(all_) < o.least * len(all_))


if __name__ == "__main__":
    main()
