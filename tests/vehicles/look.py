#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Do the healthy runs make sense? Per column: range over all runs, range of the runs' means, overlap.

  tests/vehicles/look.py [--vehicles NAME,...] [--runs 20]

'within' is the smallest share of a run's values that lie in the range of all the other runs, with 5 %
of it on either side; exit status 1 where it falls below .95, or where a value is not finite.
"""
import argparse
import math
import sys

import vehicles as V


def within(runs, i):
    """The smallest share of a run's values in the range of the other runs, and 5 % of it beside."""
    ends = [(min(x), max(x)) for x in ([r[i] for r in run] for run in runs)]
    worst = 1.0
    for k, run in enumerate(runs):
        low = min(a for j, (a, _) in enumerate(ends) if j != k)
        high = max(b for j, (_, b) in enumerate(ends) if j != k)
        margin = .05 * (high - low)
        worst = min(worst, sum(-margin <= r[i] - low <= high - low + margin for r in run) / len(run))
    return worst


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--vehicles", default=",".join(V.VEHICLES))
    a.add_argument("--runs", default=20, type=int)
    o = a.parse_args()
    bad = 0
    for v in o.vehicles.split(","):
        runs = [V.run(v, i)[1] for i in range(o.runs)]
        print("%s: %d rows of %g s, %d faults" % (v, V.LENGTH[v], V.RATE[v], len(V.FAULTS[v])))
        for i, c in enumerate(V.COLUMNS[v]):
            x = [r[i] for run in runs for r in run]
            means = [sum(r[i] for r in run) / len(run) for run in runs]
            sane = all(map(math.isfinite, x)) and within(runs, i) > .95
            bad += not sane
            print("  %-16s %10.4g to %-10.4g means %10.4g to %-10.4g within %.3f%s" % (
                c, min(x), max(x), min(means), max(means), within(runs, i), "" if sane else "  BAD"))
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
