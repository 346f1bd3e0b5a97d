#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Are small constant sensor biases in healthy landings named, with their sign, size and onset?

  tests/vehicles/lander_bias.py [--rim build/rim] [--dir DIR] [--train 50] [--per 1] [--at 100,200,300]
      [--sensors NAME,...] [--seed 1] [--fresh 7] [--healthy 12] [--jobs 2] [--json FILE] [--require share=0.9]

`rim simulate lander` draws the landings: `--train` runs of --seed, and fresh ones of seed + --fresh.
A bias of 3 standard deviations of the sensor's white noise (from second differences of healthy logs)
is added to one sensor from one time on: every sensor, every time, `--per` landings with alternating
sign. Right: the last alarm names the sensor or its redundant twin with the kind shift, the sign is right
(turned round for the twin, which then disagrees the other way), the size within 25 % and the onset
within 20 s. --dir keeps logs and model and uses those that are there.
"""
import argparse
import concurrent.futures
import json
import os
import subprocess
import sys
import tempfile

import verdict

# Sensors that measure one and the same quantity: a disagreement tells that one of the two is off, not which.
TWINS = [("s.velocity_imu_%s_mps" % a, "s.velocity_doppler_%s_mps" % a) for a in "xyz"]
TWINS += [("s.altitude_radar_m", "s.altitude_laser_m")]
TWIN = dict(TWINS + [(b, a) for a, b in TWINS])
PARTS = ("sensor", "sign", "size", "onset", "all")


def simulate(o, folder, runs, seed):
    at = os.path.join(o.dir, folder)
    names = [os.path.join(at, "run_%04d.csv" % (i + 1)) for i in range(runs)]
    if not all(map(os.path.exists, names)):
        subprocess.run([o.rim, "simulate", "lander", "--out", at, "--runs", str(runs), "--seed", str(seed)],
                       check=True, stdout=subprocess.DEVNULL)
    return names


def white_noise(logs):
    """Per column, the standard deviation of the white noise: second differences have 6 times its
    variance, and their median is not moved by the few rows in which the vehicle jerks."""
    found = {}
    for log in logs:
        columns, rows = verdict.read(log)
        for i, c in enumerate(columns):
            if c.startswith("s."):
                d = [abs(a[i] - 2 * b[i] + e[i]) for a, b, e in zip(rows, rows[1:], rows[2:])]
                found.setdefault(c, []).append(verdict.median(d) / .6745 / 6 ** .5)
    return {c: verdict.median(x) for c, x in found.items()}


def judge(o, case):
    sensor, at, sign, log, sd, model, k = case
    size = sign * 3 * sd
    columns, rows = verdict.read(log)
    i = columns.index(sensor)
    for r in rows:
        r[i] += size if r[0] >= at else 0
    stem = os.path.join(o.dir, "%s_%g_%d" % (sensor, at, k))
    verdict.write(stem + ".csv", columns, rows)
    got = verdict.Replay(o.rim, model, stem + ".csv", stem)
    os.remove(stem + ".csv")
    s = dict(sensor=sensor, at=at, size=size, log=os.path.basename(log), code=got.code, found=bool(got.alarms))
    if got.alarms:
        last = got.alarms[-1]
        named = (last.get("channels") or [""])[0]
        x = last.get("shift", {}).get(named, 0.0) * (-1 if named == TWIN.get(sensor) else 1)
        s.update(named=named, kind=last["kind"], x=x, sd=last.get("shift_sd", {}).get(named), since=last["since_s"],
                 delay=got.alarms[0]["t_s"] - at)
        right = [named in (sensor, TWIN.get(sensor)) and last["kind"] == "shift"]
        right += [right[0] and x * size > 0, right[0] and abs(x - size) <= .25 * abs(size),
                  right[0] and abs(last["since_s"] - at) <= 20]
        s["ok"] = dict(zip(PARTS, right + [all(right)]))
        s["wrong_sign"] = right[0] and x * size <= 0
    else:
        s["ok"] = dict.fromkeys(PARTS, False)
    return s


def say(s):
    if s["found"]:
        said = "%s %s %.3g +- %.2g since %.0f s" % (s["kind"], s["named"], s["x"], s["sd"] or 0, s["since"])
    else:
        said = "nothing found" + (", exit %d" % s["code"] if s["code"] else "")
    lacks = ", ".join(p for p in PARTS[:4] if not s["ok"][p])
    print("%-26s %+.3g from %g s in %s: %s%s" % (s["sensor"], s["size"], s["at"], s["log"], said,
                                             "; wrong: " + lacks if lacks else ""), flush=True)


def arguments():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--rim", default="build/rim")
    a.add_argument("--at", default="100,200,300")
    for k in ("dir", "sensors", "json", "model"):
        a.add_argument("--" + k)
    a.add_argument("--require", default="", help="share=NUMBER: exit 1 where fewer are right in all")
    for k, d in (("train", 50), ("per", 1), ("seed", 1), ("fresh", 7), ("healthy", 12), ("jobs", 2)):
        a.add_argument("--" + k, default=d, type=int)
    a.add_argument("--train-option", action="append", default=[], help="passed to `rim train`")
    return a.parse_args()


def trained(o):
    """The model: the given one, the one in --dir, or a new one."""
    model = o.model or os.path.join(o.dir, "lander.rim")
    if not os.path.exists(model):
        k = verdict.train(o.rim, simulate(o, "train", o.train, o.seed), model, *o.train_option)
        if k.returncode:
            sys.exit("train: exit %d: %s" % (k.returncode, k.stderr.strip()))
    return model


def plan(o, model):
    """Every case, and the fresh healthy landings; a landing serves several cases."""
    fresh = simulate(o, "fresh", o.healthy, o.seed + o.fresh)
    noise = white_noise(fresh[:4])
    cases = []
    sensors = o.sensors.split(",") if o.sensors else list(noise)
    for i, sensor in enumerate(sensors):
        for j, at in enumerate(float(x) for x in o.at.split(",")):
            for k in range(o.per):
                n = i * 7 + j * 3 + k
                sign = 1 if (i + j + k) % 2 else -1
                cases.append((sensor, at, sign, fresh[n % len(fresh)], noise[sensor], model, k))
    return fresh, cases


def main():
    o = arguments()
    temporary = tempfile.TemporaryDirectory()
    o.dir = o.dir or temporary.name
    os.makedirs(o.dir, exist_ok=True)
    model = trained(o)
    fresh, cases = plan(o, model)
    with concurrent.futures.ProcessPoolExecutor(o.jobs) as pool:
        n = len(fresh)
        stems = [f[:-4] for f in fresh]
        healthy = list(pool.map(verdict.Replay, [o.rim] * n, [model] * n, fresh, stems))
        done = []
        for s in pool.map(judge, [o] * len(cases), cases):
            done.append(s)
            say(s)
    n = len(done)
    print("seeds: train %d, fresh %d" % (o.seed, o.seed + o.fresh))
    print("healthy alarmed  " + verdict.share(sum(bool(h.alarms) for h in healthy), len(healthy)))
    print("found            " + verdict.share(sum(s["found"] for s in done), n))
    for part in PARTS:
        print("%-16s %s" % (part + " right", verdict.share(sum(s["ok"][part] for s in done), n)))
    print("wrong sign       " + verdict.share(sum(s.get("wrong_sign", False) for s in done), n))
    got = sum(s["ok"]["all"] for s in done) / n
    if o.json:
        with open(o.json, "w") as f:
            json.dump(dict(seed=o.seed, fresh=o.seed + o.fresh, share=got,
                           ci95=verdict.wilson(round(got * n), n), cases=done), f, indent=1)
    if o.require and got < float(o.require.partition("=")[2]):
        print("FAILED: share is %.3f, required: at least %s" % (got, o.require.partition("=")[2]))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
