#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Is input that the monitor was not trained for named as such, and never called healthy?

  tests/vehicles/wrong_input.py [--rim build/rim] [--module tests/vehicles/vehicles.py] [--vehicles NAME,...]
      [--train 20] [--base 0] [--jobs 2] [--keep DIR] [--trained DIR] [--json FILE] [--require]

Trains on healthy runs, then spoils a fresh healthy one: rows at 1/10, 1/5, 1/2 and twice the rate; time in ms,
us and ns; every sensor that has a unit in another unit; pairs of columns of different ranges swapped; 1e300 in
every row of a column, or from the middle on; the log cut to a few rows. The clean run is replayed too: what is
said of it must not be said of all. Right: `rim replay` does not say 'healthy', and what it says first names the
rate (or the time), or the column and that it is out of range: in the message of exit code 3, on stdout, or
in an alarm record whose level, kind or sentence says so. --require: exit status 1 where one is wrong.
--trained: the models and logs that `grade.py --keep DIR` left are taken, and none is trained.
"""
import argparse
import concurrent.futures
import json
import os
import re
import sys
import tempfile

import verdict
from grade import load

# a sensor may be called rate, so that word alone says nothing of the rows
ROWS = r"\d ?Hz|\brows? (rate|come)|\brate of (the )?rows|\bSTALE\b|\bstale\b"
RATE = re.compile(ROWS)
TIME = re.compile(ROWS + r"|\bt_s\b|\btime\b.{0,40}\bunit\b")
SHORT = re.compile(r"\bSTALE\b|\bstale\b|too few|fewer than|too short|not enough")
RANGE = re.compile(r"out[ _]of[ _]range|\brange\b|beyond|outside|\bunit\b|trained (on|with|for)|exceeds", re.I)
HEALTHY = re.compile(r"(^|:\s*)healthy\b", re.M | re.I)
# unit: (what it is mistaken for, factor, offset)
UNITS = {"mps": ("km/h", 3.6, 0), "rad": ("degrees", 57.29578, 0), "radps": ("degrees/s", 57.29578, 0),
         "mradps": ("rad/s", .001, 0), "degC": ("K", 1, 273.15), "V": ("mV", 1000, 0), "A": ("mA", 1000, 0),
         "m": ("mm", 1000, 0), "kPa": ("bar", .01, 0), "rpm": ("rad/s", .1047198, 0), "Lps": ("m3/h", 3.6, 0),
         "kgps": ("lb/h", 7936.6, 0)}


def short(c):
    return c[2:].rsplit("_", 1)[0] if "_" in c else c[2:]


def doubled(rows):
    """Twice as many rows: each second one the mean of its neighbours."""
    out = []
    for a, b in zip(rows, rows[1:]):
        out += [a, [(x + y) / 2 for x, y in zip(a, b)]]
    return out + rows[-1:]


def changed(rows, i, f, start=0):
    return [r if k < start else r[:i] + [f(r[i])] + r[i + 1:] for k, r in enumerate(rows)]


def spoil(columns, rows, ranges):
    """(name, what must be named: 'rate', 'time', 'short', columns or None, the rows) of every case."""
    yield "clean", None, rows
    for n in (10, 5, 2):
        yield "rate / %d" % n, "rate", rows[::n]
    yield "rate * 2", "rate", doubled(rows)
    yield "5 rows", "short", rows[:5]
    for name, f in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        yield "time in " + name, "time", changed(rows, 0, lambda x: x * f)
    sensors = [i for i, c in enumerate(columns) if c.startswith("s.")]
    for i in sensors:
        unit = UNITS.get(columns[i].rsplit("_", 1)[-1])
        if unit:
            low, high = (x * unit[1] + unit[2] for x in ranges[i])
            inside = ranges[i][0] <= low and high <= ranges[i][1]
            if not inside:    # else nobody could tell from the values
                spoilt = changed(rows, i, lambda x: x * unit[1] + unit[2])
                yield "%s in %s" % (columns[i], unit[0]), [columns[i]], spoilt
    for i, j in swaps(sensors, ranges):
        swapped = [[r[j] if k == i else r[i] if k == j else x for k, x in enumerate(r)] for r in rows]
        yield "%s <-> %s" % (columns[i], columns[j]), [columns[i], columns[j]], swapped
    for i in sensors:
        yield "1e300 in " + columns[i], [columns[i]], changed(rows, i, lambda x: 1e300)
    i = sensors[len(sensors) // 2]
    yield "1e300 late in " + columns[i], [columns[i]], changed(rows, i, lambda x: 1e300, len(rows) // 2)
    yield "-1e300 once in " + columns[i], [columns[i]], [
        r[:i] + [-1e300] + r[i + 1:] if k == len(rows) // 2 else r for k, r in enumerate(rows)]


def swaps(sensors, ranges):
    """At most three pairs of sensors whose ranges do not meet, each sensor once."""
    out, used = [], set()
    for i in sensors:
        for j in sensors:
            apart = ranges[i][1] < ranges[j][0] or ranges[j][1] < ranges[i][0]
            if i < j and apart and not {i, j} & used and len(out) < 3:
                out.append((i, j))
                used |= {i, j}
    return out


def says(text, column):
    """Whether a text names a column: in full, or without role and unit, with spaces for underscores."""
    name = short(column)
    return column in text or re.search(r"\b%s\b" % re.escape(name), text) or name.replace("_", " ") in text


def heading(record):
    return " ".join(str(record.get(k, "")) for k in ("level", "kind", "sentence"))


def judge(o, case):
    v, name, want, path, model = case
    got = verdict.Replay(o.rim, model, path, path[:-4])
    text = got.out + "\n" + got.err
    first = got.every[0] if got.every else {}
    # the log's own path must not name a column for it
    text = text.replace(path, "LOG").replace(os.path.basename(path), "LOG")
    healthy = bool(HEALTHY.search(text))
    said = "\n".join([text] + [heading(x) for x in got.every])
    if want is None:
        ok = got.code in (0, 1) and not RANGE.search(heading(dict(first, sentence="")))
    elif isinstance(want, str):
        ok = bool(dict(rate=RATE, time=TIME, short=SHORT)[want].search(said))
    else:
        record = heading(first)
        channel = (first.get("channels") or [""])[0]
        lines = [x for x in text.splitlines() if RANGE.search(x)]
        ok = bool(RANGE.search(record) and channel in want) or any(says(x, c) for x in lines for c in want)
        ok = ok and (not first or channel in want)
    line = next((x for x in (got.err + got.out).splitlines() if x.strip()), "").replace(path, "LOG")
    return dict(vehicle=v, case=name, want=want, code=got.code, healthy=healthy, named=ok, said=line[:150],
                ok=ok and (want is None or not healthy))


def prepare(o, module, v):
    """Trains, writes the spoilt logs; their cases."""
    folder = os.path.join(o.dir, v)
    os.makedirs(folder, exist_ok=True)
    logs, ranges = [], None
    for i in range(o.train):
        logs.append(os.path.join(o.trained or o.dir, v, "train_%03d.csv" % i))
        if o.trained:
            columns, rows = verdict.read(logs[-1])
        else:
            columns, rows, _ = module.run(v, o.base + i)
            verdict.write(logs[-1], columns, rows)
        ends = [(min(x), max(x)) for x in zip(*rows)]
        ranges = ends if ranges is None else [(min(a, c), max(b, d)) for (a, b), (c, d) in zip(ranges, ends)]
    model = os.path.join(o.trained or o.dir, v, "model.rim")
    k = None if o.trained else verdict.train(o.rim, logs, model, *o.train_option)
    if k and k.returncode:
        sys.exit("train %s: exit %d: %s" % (v, k.returncode, k.stderr.strip()))
    columns, rows, _ = module.run(v, o.base + 900)
    for n, (name, want, spoilt) in enumerate(spoil(columns, rows, ranges)):
        path = os.path.join(folder, "wrong_%03d.csv" % n)
        verdict.write(path, columns, spoilt)
        yield v, name, want, path, model


def arguments():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--rim", default="build/rim")
    a.add_argument("--module", default=os.path.join(os.path.dirname(os.path.abspath(__file__)), "vehicles.py"))
    a.add_argument("--vehicles", help="names with commas between; default: all of the module")
    for k, d in (("train", 20), ("base", 0), ("jobs", 2)):
        a.add_argument("--" + k, default=d, type=int)
    a.add_argument("--keep", help="folder for logs, models and alarms")
    a.add_argument("--trained", help="folder of grade.py --keep, whose models are taken")
    a.add_argument("--json")
    a.add_argument("--require", action="store_true", help="exit 1 where one is wrong")
    a.add_argument("--train-option", action="append", default=[], help="passed to `rim train`")
    return a.parse_args()


def main():
    o = arguments()
    module = load(o.module)
    temporary = tempfile.TemporaryDirectory()
    o.dir = o.keep or temporary.name
    done = []
    with concurrent.futures.ProcessPoolExecutor(o.jobs) as pool:
        for v in o.vehicles.split(",") if o.vehicles else module.VEHICLES:
            cases = list(prepare(o, module, v))
            for s in pool.map(judge, [o] * len(cases), cases):
                done.append(s)
                print("%-10s %-32s exit %d  %-8s%-10s%s  %s" % (
                    s["vehicle"], s["case"], s["code"], "healthy " if s["healthy"] else "",
                    "named" if s["named"] else "not named", "ok   " if s["ok"] else "WRONG", s["said"]), flush=True)
    spoilt = [s for s in done if s["want"] is not None]
    print("base %d" % o.base)
    clean = [s for s in done if s["want"] is None]
    print("clean runs taken as such  " + verdict.share(sum(s["ok"] for s in clean), len(clean)))
    print("called healthy            " + verdict.share(sum(s["healthy"] for s in spoilt), len(spoilt)))
    print("named as what it is       " + verdict.share(sum(s["named"] for s in spoilt), len(spoilt)))
    print("right                     " + verdict.share(sum(s["ok"] for s in spoilt), len(spoilt)))
    if o.json:
        with open(o.json, "w") as f:
            json.dump(dict(base=o.base, cases=done), f, indent=1)
    return int(o.require and not all(s["ok"] for s in done))


if __name__ == "__main__":
    sys.exit(main())
