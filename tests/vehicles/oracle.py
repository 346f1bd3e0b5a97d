#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Stands in for `rim` in test_vehicles.py: knows the truth beside each log, tells it, or lies.

ORACLE=right (default): alarms in every faulty run, all true. ORACLE=wrong: the other sign, late onset,
another feature, no row labelled, and every healthy run alarms. ORACLE=silent: never an alarm.
"""
import json
import os
import sys


def value(option):
    return sys.argv[sys.argv.index(option) + 1]


def alarm(truth, end, lie):
    name = "u.none" if lie == "wrong" and not any(truth["columns"].values()) else next(iter(truth["columns"]))
    sign = (truth["columns"].get(name) or 1) * (-1 if lie == "wrong" else 1)
    size = abs(truth["size"] or 1.0) * sign
    first = truth["rows"].index(1) / len(truth["rows"]) * end
    since = .99 * end if lie == "wrong" else truth["onset"]
    return dict(t_s=max(first + 1, since), state="raised", kind=(truth["kinds"] or ["shift"])[0], channels=[name],
                features=["u.none"] if lie == "wrong" else list(truth["features"]), since_s=since,
                shift={name: size}, shift_sd={name: abs(size) / 10}, level="ERROR", sentence="as the oracle says")


def main():
    if sys.argv[1] == "train":
        open(value("--out"), "w").close()
        return 0
    log, lie = sys.argv[4], os.environ.get("ORACLE", "right")
    with open(log) as f:
        n = sum(1 for _ in f) - 1
    records, labels = [], [0] * n
    if os.path.exists(log[:-4] + ".truth.json") and lie != "silent":
        with open(log[:-4] + ".truth.json") as f:
            truth = json.load(f)
        records = [alarm(truth, truth["end_s"], lie)]
        labels = labels if lie == "wrong" else truth["rows"]
    elif lie == "wrong":
        records = [dict(t_s=1.0, state="raised", kind="shift", channels=["s.none"], since_s=0.0,
                        features=[], shift={}, shift_sd={})]
    with open(value("--alarms"), "w") as f:
        f.writelines(json.dumps(x) + "\n" for x in records)
    with open(value("--labels"), "w") as f:
        f.write("log,row,finding\n")
        f.writelines("%s,%d,%d\n" % (log, k + 1, x) for k, x in enumerate(labels))
    return 0


if __name__ == "__main__":
    sys.exit(main())
