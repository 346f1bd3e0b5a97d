#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Grade a trained monitor on any module of vehicles, through the command line alone.

  tests/vehicles/grade.py [--rim build/rim] [--module tests/vehicles/vehicles.py] [--vehicles NAME,...]
      [--train 30] [--healthy 12] [--per 2] [--base 0] [--jobs 2] [--json FILE] [--keep DIR]
      [--csv DIR | --from DIR] [--gaps] [--lossy P] [--cut] [--late] [--longer X] [--require found=0.97,false=0.05,...] [--quiet]

For every vehicle: train on healthy runs, replay fresh healthy ones and `per` runs of every fault. Prints
a line a faulty run, and per vehicle and over all the shares with 95 % (Wilson) intervals. Seeds: base + 0..
train, base + 500.. healthy (+100000 from the 200th on), base + 700 + 1000 i + 31 j the j-th run of fault i.
Tune on some bases, report on others. --csv writes the logs and their truth and ends; --from grades these.
--gaps: every log lacks some rows, here and there and in one stretch (times by row count are off by as much).
--lossy: the logs that are not trained on lack this share of their rows, here and there.
--longer: the runs that are not trained on last X times as long (own vehicles only).
--cut: every log begins somewhere in the first 40 % of its run, at time 0.
--late: the logs that are not trained on do.

found   any alarm                          named   the last record's first channel is an accepted outcome
sign    of its shift, where truth has one  size    a bias within 25 % or 3 standard errors
covered a bias within 1.96 standard errors onset   within a tenth of the run (no onset: the first visit)
region  one of the region's features       F1      of the labelled rows, median
wrong   runs whose named outcome has the wrong sign in the last record; over all faulty runs
delay   from the first faulty row to the alarm, median; early: alarms before the first faulty row

--require: the share named must be at least (false, wrong, early, errors: at most) the number given, over
all vehicles; exit status 1 if not, otherwise 0. Seeds are in every line and in the JSON file.
"""
import argparse
import collections
import concurrent.futures
import importlib.util
import inspect
import json
import os
import random
import sys
import tempfile

import verdict

AT_MOST = ("false", "wrong", "early", "errors")
# name: (hits, out of), both keys of the counts
SHARES = dict(false=("false", "healthy"), found=("found", "cases"), named=("named", "found"),
              sign=("sign_ok", "signs"), size=("size_ok", "sizes"), covered=("covered", "sizes"),
              onset=("onset", "found"), region=("region_ok", "regions"), wrong=("wrong", "cases"),
              early=("early", "cases"), errors=("errors", "replays"))


def load(path):
    """The module of vehicles at `path`, whose folder is left as it is."""
    sys.dont_write_bytecode = True
    sys.path.insert(0, os.path.dirname(os.path.abspath(path)))
    spec = importlib.util.spec_from_file_location("graded_vehicles", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Case = collections.namedtuple("Case", "vehicle role seed fault stem")


def plan(module, o):
    """Every run to draw: (vehicle, role, seed, fault, name of its files)."""
    for v in o.vehicles:
        for i in range(o.train):
            yield Case(v, "train", o.base + i, None, "%s/train_%03d" % (v, i))
        for i in range(o.healthy):
            seed = o.base + 500 + i + (100000 if i >= 200 else 0)
            yield Case(v, "healthy", seed, None, "%s/healthy_%03d" % (v, i))
        for i, fault in enumerate(module.FAULTS[v]):
            for j in range(o.per):
                seed = o.base + 700 + 31 * j + 1000 * i
                yield Case(v, "faulty", seed, fault, "%s/%s_%02d" % (v, fault.replace(":", "_"), j))


def only(kept, rows, truth):
    return [rows[i] for i in kept], truth and dict(truth, rows=[truth["rows"][i] for i in kept])


def with_gaps(case, rows, truth):
    """The rows that telemetry brings which loses one in 50, and 3 % of the run in one stretch."""
    r = random.Random("gaps %s" % case.stem)
    first = r.randrange(len(rows) // 10, len(rows) - len(rows) // 10)
    return only([i for i in range(len(rows))
                 if not first <= i < first + .03 * len(rows) and r.random() > .02], rows, truth)


def lossy(case, share, rows, truth):
    """The rows that telemetry brings which loses this share of them."""
    r = random.Random("lossy %s" % case.stem)
    return only([i for i in range(len(rows)) if r.random() >= share], rows, truth)


def cut(case, rows, truth):
    """A log that was switched on while the vehicle was under way, and before what began in the run."""
    onset = truth and truth["onset"] or rows[-1][0]
    most = max(0, min(.4, onset / rows[-1][0] - .1))
    first = int(len(rows) * random.Random("cut %s" % case.stem).uniform(0, most))
    start_s = rows[first][0]
    if truth:
        truth = dict(truth, rows=truth["rows"][first:], onset=truth["onset"] and onset - start_s)
    return [[row[0] - start_s] + row[1:] for row in rows[first:]], truth


def draw(o, case):
    """Writes the log of a run, and its truth beside it where it has one."""
    module = load(o.module)
    how = {} if case.role == "train" or o.longer == 1 else {"longer": o.longer}
    columns, rows, truth = module.run(case.vehicle, case.seed, case.fault, **how)
    if o.gaps:
        rows, truth = with_gaps(case, rows, truth)
    if o.lossy and case.role != "train":
        rows, truth = lossy(case, o.lossy, rows, truth)
    if o.cut or o.late and case.role != "train":
        rows, truth = cut(case, rows, truth)
    stem = os.path.join(o.dir, case.stem)
    verdict.write(stem + ".csv", columns, rows)
    if truth:
        faulty_rows = [row for row, bad in zip(rows, truth["rows"]) if bad]
        sums = {c: sum(row[columns.index(c)] for row in faulty_rows) for c in truth["columns"]}
        truth = dict(truth, end_s=rows[-1][0], fault=case.fault, seed=case.seed,
                     negative=[c for c, x in sums.items() if x < 0])
        with open(stem + ".truth.json", "w") as f:
            json.dump(truth, f)


def model_of(o, v):
    return os.path.join(o.dir, v, "model.rim")


def fit(o, v, cases):
    logs = [os.path.join(o.dir, c.stem + ".csv") for c in cases if c.vehicle == v and c.role == "train"]
    k = verdict.train(o.rim, logs, model_of(o, v), *o.train_option)
    if o.keep:
        with open(os.path.join(o.dir, v, "train.txt"), "w") as f:
            f.write(k.stdout + k.stderr)
    return "exit %d: %s" % (k.returncode, k.stderr.strip()) if k.returncode else ""


def judge(o, case):
    """The counts and notes of one replay."""
    stem = os.path.join(o.dir, case.stem)
    got = verdict.Replay(o.rim, model_of(o, case.vehicle), stem + ".csv", stem)
    s = dict(vehicle=case.vehicle, fault=case.fault, seed=case.seed, replays=1)
    if got.code not in (0, 1):
        s.update(errors=1, note="exit %d: %s" % (got.code, got.err.strip()[-200:]))
    if case.role == "healthy":
        s.update(healthy=1, false=int(bool(got.alarms)))
        if got.alarms:
            s["note"] = "alarm: " + got.alarms[-1].get("sentence", "")
    else:
        with open(stem + ".truth.json") as f:
            faulty(s, got, json.load(f))
    if not o.keep:
        for end in (".alarms.jsonl", ".labels.csv"):
            if os.path.exists(stem + end):
                os.remove(stem + end)
    return s


def faulty(s, got, t):
    """Adds what was right and wrong about a faulty run to s."""
    if sum(t["rows"]) < 40:
        s.update(replays=0, skipped=1, note="fewer than 40 faulty rows: not counted")
        return
    s["cases"] = 1
    if not got.alarms:
        s["note"] = s.get("note", "not found")
        return
    last, end = got.alarms[-1], t["end_s"]
    first_visit = t["rows"].index(1) * end / (len(t["rows"]) - 1)
    outcome = (last.get("channels") or [""])[0]
    named = outcome in t["columns"] and (t["kinds"] is None or last["kind"] in t["kinds"])
    since, alarm = last["since_s"], got.alarms[0]["t_s"]
    late = abs(since - t["onset"]) <= .1 * end
    if t["onset"] == 0:
        late = since <= max(.4 * end, first_visit + .1 * end)
    s.update(found=1, named=int(named), onset=int(late), early=int(alarm < first_visit),
             delay=(alarm - first_visit) / end, f1=verdict.f1(got.labels, t["rows"]))
    note = "%s at %.0f of %.0f s: %s %s (want %s), since %.0f (onset %.0f), F1 %.2f" % (
        last["state"], alarm, end, last["kind"], outcome, " or ".join(t["columns"]), since,
        t["onset"] or first_visit, s["f1"])
    if named and t["columns"][outcome] and outcome in last.get("shift", {}):
        note += shifted(s, last, outcome, t)
    if t["features"]:
        ok = bool(set(last["features"]) & set(t["features"]))
        s.update(regions=1, region_ok=int(ok))
        note += "" if ok else ", features %s" % last["features"]
    s["note"] = note + (", EARLY" if s["early"] else "")


def shifted(s, last, outcome, t):
    """Sign and size of the named outcome's shift; a note where one is wrong."""
    x, sd, note = last["shift"][outcome], last["shift_sd"][outcome], ""
    want = t["columns"][outcome]
    if last["kind"] == "gain" and outcome in t.get("negative", ()):
        want = -want  # what is below 0 and comes nearer to it has a smaller gain
    ok = (x > 0) == (want > 0)
    if last["kind"] in ("shift", "drift", "gain"):
        s.update(signs=1, sign_ok=int(ok), wrong=int(not ok))
        note += "" if ok else ", WRONG SIGN"
        if t["size"]:
            off = abs(x - t["size"])
            ok = off <= max(.25 * abs(t["size"]), 3 * sd)
            s.update(sizes=1, size_ok=int(ok), covered=int(off <= 1.96 * sd))
            note += ", size %.3g +- %.2g for %.3g%s" % (x, sd, t["size"], "" if ok else " WRONG")
    return note


def total(cases):
    """The counts of a list of cases, and what their medians are."""
    out = collections.Counter()
    for s in cases:
        for k, x in s.items():
            if isinstance(x, int) and k != "seed":
                out[k] += x
    return out, median(cases, "f1"), median(cases, "delay")


def median(cases, key):
    return verdict.median([s[key] for s in cases if key in s])


def say(name, cases):
    c, f1, delay = total(cases)
    print(name)
    for label, (k, n) in SHARES.items():
        if c[n] and (c[k] or label not in ("early", "errors")):
            print("  %-8s %s" % (label, verdict.share(c[k], c[n])))
    print("  F1 of rows, median %.2f; alarm %.1f %% of the run after the first faulty row, median" % (
        f1, 100 * delay))


def by_fault(cases):
    """A line a fault: what was right how often."""
    for fault in sorted({s["fault"] for s in cases if s["fault"]}, key=str):
        c, f1, _ = total([s for s in cases if s["fault"] == fault])
        print("    %-18s found %d/%d, named %d, sign %d/%d, onset %d, region %d/%d, F1 %.2f" % (
            fault, c["found"], c["cases"], c["named"], c["sign_ok"], c["signs"], c["onset"],
            c["region_ok"], c["regions"], f1))


def summary(cases):
    c, f1, delay = total(cases)
    out = {k: dict(k=c[a], n=c[b], share=c[a] / c[b], ci95=verdict.wilson(c[a], c[b]))
           for k, (a, b) in SHARES.items() if c[b]}
    return dict(out, f1_median=f1, delay_median=delay)


def failures(require, figures):
    """The requirements 'name=number,...' that do not hold."""
    out = []
    for part in filter(None, require.split(",")):
        key, _, number = part.partition("=")
        got = figures["f1_median"] if key == "f1" else figures.get(key, {}).get("share")
        bad = got is None or (got > float(number) if key in AT_MOST else not got >= float(number))
        if bad:
            out.append("%s is %s, required: %s %s" % (
                key, got, "at most" if key in AT_MOST else "at least", number))
    return out


def arguments():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    here = os.path.dirname(os.path.abspath(__file__))
    a.add_argument("--rim", default="build/rim")
    a.add_argument("--module", default=os.path.join(here, "vehicles.py"))
    a.add_argument("--vehicles", help="names with commas between; default: all of the module")
    for k, d in (("train", 30), ("healthy", 12), ("per", 2), ("base", 0), ("jobs", 2)):
        a.add_argument("--" + k, default=d, type=int)
    for k in ("json", "keep", "csv"):
        a.add_argument("--" + k)
    a.add_argument("--from", dest="source", help="grade the logs that --csv wrote, with the same numbers of runs")
    a.add_argument("--gaps", action="store_true", help="every log lacks rows")
    a.add_argument("--lossy", type=float, default=0.0, help="share of rows that logs not trained on lack")
    a.add_argument("--longer", type=float, default=1.0, help="length of runs that are not trained on")
    a.add_argument("--cut", action="store_true", help="every log begins under way")
    a.add_argument("--late", action="store_true", help="logs that are not trained on begin under way")
    a.add_argument("--require", default="", help="name=number,...: exit 1 where a share is worse")
    a.add_argument("--train-option", action="append", default=[], help="passed to `rim train`")
    a.add_argument("--quiet", action="store_true", help="no line for each run")
    o = a.parse_args()
    if o.longer != 1 and "longer" not in inspect.signature(load(o.module).run).parameters:
        a.error("--longer: run() of %s takes no such length" % o.module)
    return o


def run(o, module, pool, cases):
    """Trains, replays and prints; the outcome of every replay."""
    done = []
    broken = {}
    for v, why in zip(o.vehicles, pool.map(fit, [o] * len(o.vehicles), o.vehicles, [cases] * len(o.vehicles))):
        if why:
            broken[v] = why
            print("train %s: %s" % (v, why))
    todo = [c for c in cases if c.role != "train" and c.vehicle not in broken]
    for s in pool.map(judge, [o] * len(todo), todo):
        done.append(s)
        if not o.quiet and s.get("note"):
            print("%s %s %d: %s" % (s["vehicle"], s["fault"] or "healthy", s["seed"], s["note"]), flush=True)
    for c in cases:
        if c.vehicle in broken and c.role != "train":
            done.append({"vehicle": c.vehicle, "fault": c.fault, "seed": c.seed, "replays": 1, "errors": 1,
                         "healthy" if c.role == "healthy" else "cases": 1})
    return done


def main():
    o = arguments()
    module = load(o.module)
    o.vehicles = o.vehicles.split(",") if o.vehicles else list(module.VEHICLES)
    temporary = tempfile.TemporaryDirectory()
    o.dir = o.csv or o.source or o.keep or temporary.name
    o.keep = o.keep or o.source
    cases = list(plan(module, o))
    if o.source:
        absent = [c.stem for c in cases if not os.path.exists(os.path.join(o.dir, c.stem + ".csv"))]
        if absent:
            sys.exit("grade.py: %d of %d logs are not in %s, the first of them %s.csv"
                     % (len(absent), len(cases), o.source, absent[0]))
    for v in o.vehicles:
        os.makedirs(os.path.join(o.dir, v), exist_ok=True)
    with concurrent.futures.ProcessPoolExecutor(o.jobs) as pool:
        if not o.source:
            for _ in pool.map(draw, [o] * len(cases), cases, chunksize=4):
                pass
        if o.csv:
            print("%d logs in %s" % (len(cases), o.csv))
            return 0
        done = run(o, module, pool, cases)
    by = {v: [s for s in done if s["vehicle"] == v] for v in o.vehicles}
    for v in o.vehicles:
        say(v, by[v])
        by_fault(by[v])
    if len(o.vehicles) > 1:
        say("all", done)
    figures = dict({v: summary(by[v]) for v in o.vehicles}, all=summary(done))
    if o.json:
        with open(o.json, "w") as f:
            json.dump(dict(base=o.base, train=o.train, figures=figures, cases=done), f, indent=1)
    bad = failures(o.require, figures["all"])
    for x in bad:
        print("FAILED: " + x)
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
