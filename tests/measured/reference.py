#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""reference.py --out DIR [--from ../shared/measured]: logs of measured machines whose prediction already holds the published physics.

The published forms are fitted by least squares to the logs that are diagnosed, and added to m. in these and in the hold-outs, so that
`rim diagnose` should find nothing, or nothing that makes a hold-out worse. A folder for each machine: fit_*.csv, and hold_*.csv where there is one.

  emps_v emps_dv emps_inv   Coulomb and viscous friction, offset
  arm1 arm2 arm3            the same, of each joint
  genesis halcyon           drag with density; no hold-out: one log each
"""
import argparse
import csv
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "vehicles"))
from linear import solve


def read(path):
    with open(path, encoding="utf-8") as lines:
        rows = list(csv.reader(lines))
    return rows[0], [[float(x) for x in row] for row in rows[1:]]


def column(head, prefix, names=()):
    """Index of the first column of that prefix, of these words where there are any."""
    for i, name in enumerate(head):
        if name.startswith(prefix) and (not names or any(word in name for word in names)):
            return i
    raise SystemExit("no column %s %s in %s" % (prefix, names, head))


def friction(head, row):
    v = row[column(head, "x.", ("velocity", "rate"))]
    return [(v > 0) - (v < 0), v, 1.0]


def drag(head, row):
    v, h = row[column(head, "x.", ("mps", "speed", "velocity"))], row[column(head, "x.", ("altitude", "height"))]
    return [math.exp(-h / 9000) * v * abs(v)]


def put_back(out, name, fitted, held, forms):
    """Writes the logs with the forms, fitted to `fitted`, in the prediction. A log: its head and rows."""
    k = len(forms(fitted[0][0], fitted[0][1][0]))
    gram, right = [[0.0] * k for _ in range(k)], [0.0] * k
    for head, rows in fitted:
        z, m = column(head, "z."), column(head, "m.")
        for row in rows:
            g = forms(head, row)
            for i in range(k):
                right[i] += g[i] * (row[z] - row[m])
                for j in range(k):
                    gram[i][j] += g[i] * g[j]
    size = solve(gram, right)
    folder = os.path.join(out, name)
    os.makedirs(folder, exist_ok=True)
    left = before = 0.0  # of the hold-outs; of the logs themselves where there are none
    for what, logs in (("fit", fitted), ("hold", held)):
        for number, (head, rows) in enumerate(logs, 1):
            z, m = column(head, "z."), column(head, "m.")
            with open(os.path.join(folder, "%s_%d.csv" % (what, number)), "w", encoding="utf-8") as to:
                to.write(",".join(head) + "\n")
                for row in rows:
                    new = row[:]
                    new[m] += sum(s * g for s, g in zip(size, forms(head, row)))
                    if what == "hold" or not held:
                        before += (row[z] - row[m]) ** 2
                        left += (row[z] - new[m]) ** 2
                    to.write(",".join("%.9g" % x for x in new) + "\n")
    print("%s: sizes %s; they leave %.3f of the error" % (name, " ".join("%.4g" % s for s in size), math.sqrt(left / before)))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", required=True)
    parser.add_argument("--from", dest="source", default="../shared/measured")
    o = parser.parse_args()
    of = lambda *parts: read(os.path.join(o.source, *parts))
    for form in ("v", "dv", "inv"):
        put_back(o.out, "emps_" + form, [of("emps", "%s_fit%d.csv" % (form, k)) for k in (1, 2, 3, 4)],
                 [of("emps", form + "_pulses.csv")], friction)
    for joint in (1, 2, 3):
        put_back(o.out, "arm%d" % joint, [of("ur10e", "j%d_fit%d.csv" % (joint, k)) for k in (1, 2, 3)],
                 [of("ur10e", "j%d_hold.csv" % joint)], friction)
    for rocket in ("genesis", "halcyon"):
        put_back(o.out, rocket, [of("rockets", "dv_%s.csv" % rocket)], [], drag)


if __name__ == "__main__":
    main()
