# SPDX-License-Identifier: MIT
"""What the graders of this folder share: logs, the command line under test, and intervals."""
import csv
import json
import math
import os
import subprocess


def write(path, columns, rows):
    with open(path, "w", newline="") as f:
        w = csv.writer(f)
        w.writerow(columns)
        for r in rows:
            w.writerow(["%.9g" % x for x in r])


def read(path):
    """(columns, rows) of a CSV; lines that begin with # are comments."""
    with open(path, newline="") as f:
        lines = csv.reader(x for x in f if not x.startswith("#"))
        columns = next(lines)
        return columns, [[float(x) for x in r] for r in lines]


def wilson(k, n, z=1.96):
    """The 95 % interval of a share."""
    if n == 0:
        return 0.0, 1.0
    p, d = k / n, 1 + z * z / n
    half = z * math.sqrt(p * (1 - p) / n + z * z / 4 / n / n) / d
    mid = (p + z * z / 2 / n) / d
    return max(0.0, mid - half), min(1.0, mid + half)


def share(k, n):
    """'k/n = p % (low to high)', or a dash where nothing was asked."""
    if n == 0:
        return "-"
    low, high = wilson(k, n)
    return "%d/%d = %.1f %% (%.1f to %.1f)" % (k, n, 100 * k / n, 100 * low, 100 * high)


def median(values):
    v = sorted(values)
    n = len(v)
    return float("nan") if n == 0 else .5 * (v[(n - 1) // 2] + v[n // 2])


def f1(said, truth):
    both, either = sum(1 for a, b in zip(said, truth) if a and b), sum(said) + sum(truth)
    return 2 * both / either if either else 1.0


def train(rim, logs, model, *more):
    """Trains a model; the process's answer, with its exit code and texts."""
    return subprocess.run([rim, "train", *logs, "--out", model, *more], capture_output=True, text=True)


class Replay:
    """One log through `rim replay`: exit code, texts, alarm records and labelled rows.

    Without a model (None) the log's own predictions are what it is judged by.
    """

    def __init__(self, rim, model, log, stem, *more):
        alarms, labels = stem + ".alarms.jsonl", stem + ".labels.csv"
        for path in (alarms, labels):
            if os.path.exists(path):
                os.remove(path)
        of = ["--model", model] if model else []
        k = subprocess.run([rim, "replay", *of, log, "--alarms", alarms, "--labels", labels, *more],
                           capture_output=True, text=True)
        self.code, self.out, self.err = k.returncode, k.stdout, k.stderr
        self.every = self.records(alarms)
        self.alarms = [x for x in self.every if x.get("state") in ("raised", "updated")]
        self.labels = self.rows(labels)

    @staticmethod
    def records(path):
        if not os.path.exists(path):
            return []
        with open(path) as f:
            return [json.loads(x) for x in f if x.strip()]

    @staticmethod
    def rows(path):
        if not os.path.exists(path):
            return []
        with open(path, newline="") as f:
            return [int(x["finding"]) > 0 for x in csv.DictReader(x for x in f if not x.startswith("#"))]
