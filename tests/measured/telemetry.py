#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Real telemetry with published figures: the monitor beside the detectors of each set's authors.

  tests/measured/telemetry.py [--rim build/rim] [--from ../shared/measured] [--set skab,smap_msl]
      [--only NAME,...] [--jobs 2] [--keep DIR] [--require skab_f1=.78,skab_far=30,...] [--list]
      [--flags] [--join 100]

Everything that decides is `rim train` and `rim replay`; this script cuts and converts the files,
calls them, and scores what they say. A row is detected when `--labels` gives it to a finding or
when its level in `--trace` is OUT OF RANGE. The same rule for every file; time, row numbers and
labels reach no model.

skab      The leaderboard's protocol: one image is trained on the first 400 rows of every run, each
          a run of its own; every run is replayed whole; rows after the 400th are pooled. F1 (%FAR,
          %MAR) of rows. An alarm is cheap on this leaderboard: --false-alarm 0.3 per run,
          the largest share of false rows that is asked of us.
smap_msl  An image per channel, of its value alone: the training file cut into 10 runs of equal
          length, blocks so long that the whole training file is 240 of them; the test file replayed
          as one run. Detected rows make sequences as the set's authors make them: each is widened
          by 100 rows on either side, those that meet are one (--join changes that). A labelled
          sequence is found if any overlaps it; a detected one that overlaps none is false. Those
          found only by a sequence longer than 4 times the labels and 400 rows are counted. With
          --flags the command flags become columns of their own.

Intervals: 95 %, bootstrap over runs or channels, 2000 draws, seed 1. --require: the figures named
must be at least (FAR: at most) the number given; exit status 1 if not. --list: a line per file.
"""
import argparse
import collections
import concurrent.futures
import csv
import gzip
import os
import random
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
DATA = os.path.join(HERE, "..", "..", "data")
DRAWS, SEED = 2000, 1
START_ROWS = 400            # of the leaderboard
SKAB_FALSE_ALARM = "0.3"
TRAIN_RUNS, TRAIN_BLOCKS = 10, 240
JOIN_ROWS = 100             # Telemanom's error_buffer
OUT_OF_RANGE = 4            # rim/alarm.h

SKAB_PUBLISHED = [
    ("Conv-AE", .78, 13.6, 28.0), ("MSET", .78, 39.7, 14.1), ("T2+Q", .76, 26.6, 24.9),
    ("LSTM-AE", .74, 30.0, 25.9), ("T2", .66, 19.2, 42.6), ("LSTM-VAE", .56, None, None),
    ("vanilla LSTM", .54, None, None), ("vanilla AE", .39, None, None),
    ("MSCRED", .36, None, None), ("isolation forest", .29, None, None)]
RANGE_PUBLISHED = [("Telemanom (LSTM)", "SMAP", .855, .855), ("Telemanom (LSTM)", "MSL", .926, .694),
                   ("Telemanom (LSTM)", "all", .875, .800),
                   ("30-row means and sds", "SMAP", .96, .68),
                   ("30-row means and sds", "MSL", .70, .53)]


class Failed(Exception):
    """A command of ours ended otherwise than with 0."""


def run(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise Failed("%s: exit status %d: %s" % (" ".join(command[:4]), done.returncode,
                                                 done.stderr.strip().splitlines()[-1:]))


def replay(o, image, schema, logs, work):
    """Per log: whether each of its rows is detected."""
    labels, trace = os.path.join(work, "labels.csv"), os.path.join(work, "trace.csv")
    run(o.rim, "replay", *logs, "--schema", schema, "--model", image, "--labels", labels,
        "--trace", trace)
    marks, beyond = collections.defaultdict(list), collections.defaultdict(list)
    with open(labels, newline="") as f:
        for row in csv.DictReader(f):
            marks[row["log"]].append(int(row["finding"]) > 0)
    with open(trace, newline="") as f:
        for row in csv.DictReader(line for line in f if not line.startswith("#")):
            beyond[row["log"]].append(int(row["level"]) == OUT_OF_RANGE)
    for log in logs:
        if not len(marks[log]) == len(beyond[log]) > 0:
            raise Failed("%s: %d rows labelled, %d traced" % (log, len(marks[log]), len(beyond[log])))
        marks[log] = [a or b for a, b in zip(marks[log], beyond[log])]
    return marks


def bootstrap(units, figure):
    """2.5 and 97.5 % points of figure(list of units) over draws of whole units."""
    rng = random.Random(SEED)
    values = sorted(figure([rng.choice(units) for _ in units]) for _ in range(DRAWS))
    return values[int(.025 * DRAWS)], values[int(.975 * DRAWS) - 1]


def share(a, b):
    return a / b if b > 0 else 0.0


# ---- rows: SKAB ----

Rows = collections.namedtuple("Rows", "name tp fp fn tn")


def row_figures(units):
    tp, fp, fn, tn = (sum(getattr(u, k) for u in units) for k in ("tp", "fp", "fn", "tn"))
    return share(2 * tp, 2 * tp + fp + fn), 100 * share(fp, fp + tn), 100 * share(fn, fn + tp)


def skab_names(folder):
    return sorted(n for n in os.listdir(folder)
                  if n.endswith(".csv") and not n.startswith("anomaly_free"))


def skab(o, folder, work):
    names = [n for n in skab_names(folder) if not o.only or n[:-4] in o.only]
    starts, runs = [], [os.path.join(folder, n) for n in names]
    for name, path in zip(names, runs):
        starts.append(os.path.join(work, name))
        with open(path) as whole, open(starts[-1], "w") as start:
            for _, line in zip(range(1 + START_ROWS), whole):
                start.write(line)
    schema, image = os.path.join(DATA, "skab.toml"), os.path.join(work, "skab.rim")
    run(o.rim, "train", *starts, "--schema", schema, "--false-alarm", SKAB_FALSE_ALARM,
        "--leave-out-unlike", "--out", image)  # the fault of other_2 begins in its first 400 rows
    marks, units = replay(o, image, schema, runs, work), []
    for name, path in zip(names, runs):
        count = collections.Counter()
        with open(path, newline="") as f:
            for i, row in enumerate(csv.DictReader(f)):
                if i >= START_ROWS:
                    count[float(row["anomaly"]) > 0, marks[path][i]] += 1
        units.append(Rows(name[:-4], count[True, True], count[False, True], count[True, False],
                          count[False, False]))
    return units


def print_skab(o, units):
    print("SKAB, %d runs, rows after the %dth pooled" % (len(units), START_ROWS))
    if o.list:
        for u in units:
            print("  %-12s F1 %.2f  FAR %5.1f %%  MAR %5.1f %%" % ((u.name,) + row_figures([u])))
    f1, far, mar = row_figures(units)
    between = ["%.*f to %.*f" % ((2, a, 2, b) if k == 0 else (1, a, 1, b)) for k in range(3)
               for a, b in [bootstrap(units, lambda draw: row_figures(draw)[k])]]
    print("  %-18s %5s  %7s  %7s" % ("", "F1", "FAR %", "MAR %"))
    print("  %-18s %5.3f  %7.1f  %7.1f   95 %%: F1 %s, FAR %s, MAR %s"
          % (("rimwatch", f1, far, mar) + tuple(between)))
    for name, a, b, c in SKAB_PUBLISHED:
        print("  %-18s %5.2f  %7s  %7s" % (name, a, "-" if b is None else b, "-" if c is None else c))
    return dict(skab_f1=f1, skab_far=far)


# ---- sequences: SMAP and MSL ----

Channel = collections.namedtuple("Channel", "name craft found missed false rows marked labelled by_long")


def widened(marks, by):
    """Sequences (first, last) of detected rows, widened and joined."""
    joined = []
    for i, marked in enumerate(marks):
        if not marked:
            continue
        first, last = max(0, i - by), min(len(marks) - 1, i + by)
        if joined and first <= joined[-1][1] + 1:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined


def meets(a, b):
    return a[0] <= b[1] and b[0] <= a[1]


def is_long(detected, truth):
    """Whether it says little about where: beyond four times the labels that it meets and 400 rows."""
    labelled = sum(b - a + 1 for a, b in truth["sequences"] if meets((a, b), detected))
    return detected[1] - detected[0] + 1 > 4 * labelled + 400


def flags_of(source):
    with gzip.open(source, "rt", newline="") as f:
        return sorted(set().union(*(r["cmds"].split() for r in csv.DictReader(f))), key=int)


def convert(source, flags, runs):
    """The rows of a channel's file, cut into as many logs as there are paths. Returns their number."""
    with gzip.open(source, "rt", newline="") as f:
        rows = [(r["i"], r["value"], frozenset(r["cmds"].split())) for r in csv.DictReader(f)]
    for k, path in enumerate(runs):
        with open(path, "w") as out:
            out.write(",".join(["i", "value"] + ["u.flag_" + f for f in flags]) + "\n")
            for i, value, active in rows[k * len(rows) // len(runs):(k + 1) * len(rows) // len(runs)]:
                out.write(",".join([i, value] + ["1" if f in active else "0" for f in flags]) + "\n")
    return len(rows)


def channel(o, folder, work, name, truth):
    place = os.path.join(work, name)
    os.makedirs(place, exist_ok=True)
    train = [os.path.join(place, "train_%02d.csv" % k) for k in range(TRAIN_RUNS)]
    test = os.path.join(place, "test.csv")
    source = os.path.join(folder, name + "_train.csv.gz")
    flags = flags_of(source) if o.flags else []
    rows = convert(source, flags, train)
    convert(os.path.join(folder, name + "_test.csv.gz"), flags, [test])
    schema, image = os.path.join(DATA, "smap_msl.toml"), os.path.join(place, "model.rim")
    run(o.rim, "train", *train, "--schema", schema, "--threads", "1", "--out", image,
        "--block-seconds", str(max(1, rows // TRAIN_BLOCKS)))
    marks = replay(o, image, schema, [test], place)[test]
    detected = widened(marks, o.join)
    found = sum(any(meets(t, d) for d in detected) for t in truth["sequences"])
    by_long = sum(any(meets(t, d) for d in detected) and all(is_long(d, truth) for d in detected
                                                             if meets(t, d))
                  for t in truth["sequences"])
    false = sum(not any(meets(t, d) for t in truth["sequences"]) for d in detected)
    return Channel(name, truth["craft"], found, len(truth["sequences"]) - found, false, len(marks),
                   sum(marks), sum(b - a + 1 for a, b in truth["sequences"]), by_long)


def smap_msl(o, folder, work):
    truth = collections.OrderedDict()
    with open(os.path.join(folder, "labels.csv"), newline="") as f:
        for row in csv.DictReader(f):
            t = truth.setdefault(row["chan_id"], dict(craft=row["spacecraft"], sequences=[]))
            t["sequences"].append((int(row["start"]), int(row["end"])))
    names = [n for n in truth if os.path.exists(os.path.join(folder, n + "_test.csv.gz"))
             and (not o.only or n in o.only)]
    with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        return list(pool.map(lambda n: channel(o, folder, work, n, truth[n]), names))


def range_figures(units):
    found, missed, false = (sum(getattr(u, k) for u in units) for k in ("found", "missed", "false"))
    return share(found, found + false), share(found, found + missed)


def print_ranges(o, units):
    print("SMAP and MSL, %d channels" % len(units))
    if o.list:
        for u in units:
            print("  %-5s %-5s found %d of %d, false %d, rows detected %4.1f %%"
                  % (u.name, u.craft, u.found, u.found + u.missed, u.false,
                     100 * share(u.marked, u.rows)))
    print("  %-22s %-5s %9s  %6s" % ("", "", "precision", "recall"))
    for craft in ("SMAP", "MSL", "all"):
        some = [u for u in units if craft in (u.craft, "all")]
        if not some:
            continue
        p, r = range_figures(some)
        low_p, high_p = bootstrap(some, lambda draw: range_figures(draw)[0])
        low_r, high_r = bootstrap(some, lambda draw: range_figures(draw)[1])
        print("  %-22s %-5s %9.3f  %6.3f   95 %%: precision %.2f to %.2f, recall %.2f to %.2f; "
              "%d found, %d of them by long sequences, %d missed, %d false; rows detected %.1f %%, labelled %.1f %%"
              % ("rimwatch", craft, p, r, low_p, high_p, low_r, high_r, sum(u.found for u in some),
                 sum(u.by_long for u in some), sum(u.missed for u in some), sum(u.false for u in some),
                 100 * share(sum(u.marked for u in some), sum(u.rows for u in some)),
                 100 * share(sum(u.labelled for u in some), sum(u.rows for u in some))))
    for name, craft, p, r in RANGE_PUBLISHED:
        print("  %-22s %-5s %9.3f  %6.3f" % (name, craft, p, r))
    p, r = range_figures(units)
    return dict(smap_msl_precision=p, smap_msl_recall=r)


SETS = collections.OrderedDict([("skab", (skab, print_skab)), ("smap_msl", (smap_msl, print_ranges))])


def missed_requirements(figures, wanted):
    """'name=number,...' against the figures: sentences of those that are not kept."""
    missed = []
    for part in filter(None, wanted.split(",")):
        name, number = part.split("=")
        if name not in figures:
            missed.append("%s was not measured" % name)
        elif (figures[name] > float(number)) if name.endswith("_far") else figures[name] < float(number):
            missed.append("%s is %.3f, wanted %s" % (name, figures[name], number))
    return missed


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--rim", default=os.path.join(HERE, "..", "..", "build", "rim"))
    p.add_argument("--from", dest="source", default=os.path.join(HERE, "..", "..", "..", "shared", "measured"))
    p.add_argument("--set", dest="sets", default=",".join(SETS))
    p.add_argument("--only", default="")
    p.add_argument("--jobs", type=int, default=2)
    p.add_argument("--keep")
    p.add_argument("--flags", action="store_true")
    p.add_argument("--join", type=int, default=JOIN_ROWS)
    p.add_argument("--require", default="")
    p.add_argument("--list", action="store_true")
    o = p.parse_args()
    o.only = set(filter(None, o.only.split(",")))
    figures = {}
    with tempfile.TemporaryDirectory() as temporary:
        for name in o.sets.split(","):
            if name not in SETS:
                p.error("no set '%s': %s" % (name, ", ".join(SETS)))
            folder = os.path.join(o.source, name)
            if not os.path.isdir(folder):
                print("skipped: no %s" % folder)
                continue
            work = os.path.join(o.keep or temporary, name)
            os.makedirs(work, exist_ok=True)
            measure, tell = SETS[name]
            try:
                figures.update(tell(o, measure(o, folder, work)))
            except Failed as e:
                sys.exit("telemetry.py: %s" % e)
    missed = missed_requirements(figures, o.require)
    for sentence in missed:
        print("missed: " + sentence)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
