#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The user's own predictions: does `rim train` on healthy logs of z. m. sd. columns keep its promise?

  tests/vehicles/own_predictions.py [--rim build/rim] [--train 20] [--healthy 100] [--per 10] [--base 0]
      [--variants white,start,offset,both] [--jobs 2] [--json FILE] [--keep DIR] [--require false=0.1,...]

A boat in a canal, and its owner's simulation of it, which is right but for what no simulation knows:
  white   nothing: the residuals are white noise of the stated sd
  start   each run starts from its own noisy reading of place, speed and temperature
  offset  each run has offsets of its own, one standard deviation of the noise, in each outcome
  both    start and offset
Trains on healthy logs, replays fresh healthy ones and faulty ones: a bias of one outcome, a drift, more
noise, thrust lost since an onset or in a stretch of the canal. Prints the rates with 95 % intervals. Where
`rim train` refuses such logs, it says so and replays without a model. --require: at least (false: at most).
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import random
import sys
import tempfile

import verdict

DT, ROWS = .5, 900
NAMES = ("x_m", "v_mps", "engine_degC")
NOISE = (.3, .03, .4)
FAULTS = ("bias:x_m", "bias:v_mps", "bias:engine_degC", "drift:engine_degC", "noise:v_mps", "loss", "stretch")
COLUMNS = ["t_s", "u.throttle"] + [p + n for n in NAMES for p in ("z.", "m.", "sd.")]


class Boat:
    """Place, speed and engine temperature; loss is the share of thrust that is lost."""

    def __init__(self, x, v, hot):
        self.state = (x, v, hot)

    def step(self, u, loss):
        x, v, hot = self.state
        v += DT / 6 * (3 * u * (1 - loss) - v)
        self.state = (x + DT * v, v, hot + DT / 80 * (20 + 50 * u * u - hot))


def run(variant, seed, fault=None):
    """(rows, truth): the log of one run, and what is wrong in it."""
    r = random.Random("own %s %d %s" % (variant, seed, fault))
    start = (r.gauss(0, .2), 1 + r.gauss(0, .05), 30 + r.gauss(0, 1))
    real, own = Boat(*start), Boat(*start)
    if variant in ("start", "both"):
        own = Boat(*(a + r.gauss(0, s) for a, s in zip(start, NOISE)))
    offset = [r.gauss(0, s) if variant in ("offset", "both") else 0 for s in NOISE]
    onset, low = r.uniform(.25, .5) * DT * ROWS, r.uniform(150, 400)
    what, _, name = (fault or "").partition(":")
    size = r.choice([-1, 1]) * 3 * NOISE[NAMES.index(name)] if name else 0
    u, until, rows, mask = .5, 0, [], []
    for k in range(ROWS):
        t = k * DT
        if t >= until:
            u, until = r.uniform(.3, .9), t + r.uniform(20, 60)
        on = (what == "stretch" and low < real.state[0] < low + 200) or (
            what not in ("", "stretch") and t >= onset)
        late = (t - onset) / (DT * ROWS - onset)
        row = [t, u]
        for n, z, m, s, o in zip(NAMES, real.state, own.state, NOISE, offset):
            z += o + r.gauss(0, s)
            if on and n == name:
                z += {"bias": size, "drift": 1.5 * size * late, "noise": r.gauss(0, 1.3 * s)}[what]
            row += [z, m, s]
        rows.append(row)
        mask.append(int(on))
        real.step(u, .02 if on and what in ("loss", "stretch") else 0)
        own.step(u, 0)
    return rows, truth(what, name, size, onset, mask)


def truth(what, name, size, onset, mask):
    if not what:
        return None
    if name:
        sign = 0 if what == "noise" else int(math.copysign(1, size))
        columns = {name: sign}
    else:
        # what is lost of the speed is lost of the place for good
        columns, onset = {"v_mps": -1, "x_m": -1}, mask.index(1) * DT if 1 in mask else 0.0
    return dict(columns=columns, onset=onset, rows=mask, size=size if what == "bias" else None,
                kinds=("variance",) if what == "noise" else None)


def draw(o, case):
    variant, role, fault, seed, path = case
    rows, t = run(variant, seed, fault)
    verdict.write(path, COLUMNS, rows)
    return t


def judge(o, case, model):
    """What is said about one log."""
    variant, role, fault, seed, path = case
    t = draw(o, case)
    got = verdict.Replay(o.rim, model, path, path[:-4])
    s = dict(variant=variant, role=role, fault=fault, seed=seed, code=got.code, found=int(bool(got.alarms)))
    if role == "faulty" and got.alarms:
        last = got.alarms[-1]
        named = (last.get("channels") or [""])[0]
        bare = named[2:] if named[:2] in ("z.", "m.") else named
        ok = bare in t["columns"] and (not t["kinds"] or last["kind"] in t["kinds"])
        s.update(named=int(ok), onset=int(abs(last["since_s"] - t["onset"]) <= .1 * DT * ROWS),
                 f1=verdict.f1(got.labels, t["rows"]))
        x = last.get("shift", {}).get(named)
        if ok and x is not None and t["columns"][bare]:
            s.update(signs=1, sign=int(x * t["columns"][bare] > 0))
            if t["size"]:
                sd = last["shift_sd"][named]
                s.update(sizes=1, size=int(abs(x - t["size"]) <= max(.25 * abs(t["size"]), 3 * sd)),
                         covered=int(abs(x - t["size"]) <= 1.96 * sd))
    return s


def cases(o, variant, folder):
    at = lambda n: os.path.join(folder, n + ".csv")
    for i in range(o.train):
        yield variant, "train", None, o.base + i, at("train_%03d" % i)
    for i in range(o.healthy):
        yield variant, "healthy", None, o.base + 500 + i, at("healthy_%03d" % i)
    for i, f in enumerate(FAULTS):
        for j in range(o.per):
            yield variant, "faulty", f, o.base + 700 + 31 * j + 1000 * i, at("%s_%02d" % (f.replace(":", "_"), j))


COUNTS = ("found", "named", "onset", "signs", "sign", "sizes", "size", "covered")


def say(variant, done):
    c = collections.Counter()
    for s in done:
        if s["role"] == "healthy":
            c.update(healthy=1, false=s["found"])
        else:
            c.update({k: s[k] for k in COUNTS if k in s})
    c["cases"] = sum(s["role"] == "faulty" for s in done)
    print(variant)
    shares = dict(false="healthy", found="cases", named="found", sign="signs", size="sizes",
                  covered="sizes", onset="found")
    for k, n in shares.items():
        print("  %-8s %s" % (k, verdict.share(c[k], c[n])))
    for f in FAULTS:
        mine = [s for s in done if s["fault"] == f]
        print("    %-20s found %d of %d" % (f, sum(s["found"] for s in mine), len(mine)))
    errors = sorted({s["code"] for s in done} - {0, 1})
    if errors:
        print("  exit codes of replay: %s" % errors)
    return {k: dict(k=c[k], n=c[n], share=c[k] / c[n], ci95=verdict.wilson(c[k], c[n]))
            for k, n in shares.items() if c[n]}


def arguments():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--rim", default="build/rim")
    a.add_argument("--variants", default="white,start,offset,both")
    for k, d in (("train", 20), ("healthy", 100), ("per", 10), ("base", 0), ("jobs", 2)):
        a.add_argument("--" + k, default=d, type=int)
    for k in ("json", "keep"):
        a.add_argument("--" + k)
    a.add_argument("--require", default="", help="name=number,...: exit 1 where a variant is worse")
    a.add_argument("--train-option", action="append", default=[], help="passed to `rim train`")
    return a.parse_args()


def variant_of(o, pool, folder, variant):
    """Trains and replays one variant; its figures."""
    os.makedirs(folder, exist_ok=True)
    every = list(cases(o, variant, folder))
    logs = [c for c in every if c[1] == "train"]
    for c in logs:
        draw(o, c)
    model = os.path.join(folder, "model.rim")
    k = verdict.train(o.rim, [c[4] for c in logs], model, *o.train_option)
    if k.returncode:
        print("%s: rim train exits %d: %s\n  so the logs are replayed without a model" % (
            variant, k.returncode, k.stderr.strip()[:200]))
        model = None
    rest = [c for c in every if c[1] != "train"]
    return say(variant, list(pool.map(judge, [o] * len(rest), rest, [model] * len(rest), chunksize=2)))


def main():
    o = arguments()
    temporary = tempfile.TemporaryDirectory()
    figures, bad = {}, []
    with concurrent.futures.ProcessPoolExecutor(o.jobs) as pool:
        for v in o.variants.split(","):
            figures[v] = variant_of(o, pool, os.path.join(o.keep or temporary.name, v), v)
    for part in filter(None, o.require.split(",")):
        key, _, number = part.partition("=")
        for v, f in figures.items():
            got = f.get(key, {}).get("share")
            if got is None or (got > float(number) if key == "false" else got < float(number)):
                bad.append("%s: %s is %s, required: %s" % (v, key, got, number))
    print("base %d" % o.base)
    for x in bad:
        print("FAILED: " + x)
    if o.json:
        with open(o.json, "w") as f:
            json.dump(dict(base=o.base, figures=figures), f, indent=1)
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
