#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""channels.py --rim RIM [--drawer guests.py] [--seed 0] [--count 17 | --seeds 3,5,8] [--family F] [--keep DIR] [--jobs 2] [--floors FILE]: rim diagnose, channel by channel.

Every case of the drawer is diagnosed with its hold-out. Of a channel that something is wrong with: whether anything was claimed (found), whether
what was claimed first has a right name (first), whether every part has one (all), and the share of the RMSE on the hold-out that is left beside
the share that least squares with the true form leaves (where the drawer gives its columns; otherwise the noiseless truth). The gain is the fall
of the squares over that of least squares. Of a channel with nothing wrong: whether anything was claimed.
Floors: lines `name least` or `name most`, of the figures printed at the end. Exit 1 where one is missed, 3 where a case fails."""
import argparse
import concurrent.futures
import json
import os
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))


def names(effect):
    return [effect["cause"]] + effect["also"]


def judge(o, seed):
    folder = tempfile.mkdtemp(prefix="rim_channels_")
    try:
        logs, truth_path = folder + "/logs", folder + "/truth.json"
        subprocess.run([sys.executable, os.path.join(HERE, o.drawer), "--seed", str(seed), "--family", o.family, "--out", logs, "--truth",
                        truth_path], check=True)
        with open(truth_path, encoding="utf-8") as text:
            truth = json.load(text)
        fit = sorted(f for f in os.listdir(logs) if f.startswith("run_"))
        command = [os.path.abspath(o.rim), "diagnose"] + fit + ["--holdout", "holdout_1.csv", "--out", "OUT"]
        done = subprocess.run(command, cwd=logs, capture_output=True, text=True, check=False, timeout=300)
        if done.returncode not in (0, 1):
            return seed, truth["family"], None, done.stderr
        with open(logs + "/OUT/diagnosis.json", encoding="utf-8") as text:
            d = json.load(text)
        if o.keep:
            shutil.rmtree(os.path.join(o.keep, str(seed)), ignore_errors=True)
            shutil.copytree(folder, os.path.join(o.keep, str(seed)))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    rows = []
    for channel in (c["name"] for c in truth["channels"]):
        parts = [e for e in truth["effects"] if e["channel"] == channel]
        claimed = [f for f in d["findings"] if f["channel"] == channel]
        causes = [f["cause"] for f in claimed]
        gain, best = d["gain"]["channels"].get(channel, {}), truth["holdout"][channel]
        left = gain.get("ratio", 1.0)
        bound = (best.get("rmse_least_squares") or best["rmse_true"]) / best["rmse_before"]
        row = {"channel": channel, "causes": causes, "left": left, "bound": bound, "healthy": not parts}
        if parts:
            row["found"] = bool(causes)
            row["first"] = bool(causes) and any(causes[0] in names(e) for e in parts)
            row["all"] = all(any(c in names(e) for c in causes) for e in parts)
            row["wanted"] = ["/".join(names(e)[:2]) for e in parts]
            row["gain"] = (1 - left ** 2) / (1 - bound ** 2)
        rows.append(row)
    return seed, truth["family"], rows, ""


def figures(rows):
    wrong, well = [r for r in rows if not r["healthy"]], [r for r in rows if r["healthy"]]
    share = lambda of, what: sum(bool(what(r)) for r in of) / max(1, len(of))
    gains = sorted(r["gain"] for r in wrong) or [0.0]
    return {"found": share(wrong, lambda r: r["found"]), "first": share(wrong, lambda r: r["first"]), "all": share(wrong, lambda r: r["all"]),
            "gain_tenth": gains[len(gains) // 10], "gain_median": gains[len(gains) // 2],
            "at_bound": share(wrong, lambda r: r["left"] <= 1.05 * r["bound"]), "worse": share(rows, lambda r: r["left"] > 1.02),
            "false": share(well, lambda r: r["causes"]), "channels": len(wrong), "healthy_channels": len(well)}


MOST = ("worse", "false")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rim", required=True)
    parser.add_argument("--drawer", default="guests.py")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=17)
    parser.add_argument("--seeds", default="", help="these instead of --seed and --count")
    parser.add_argument("--family", default="each")
    parser.add_argument("--keep", default="")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--floors", default="")
    o = parser.parse_args()
    seeds = [int(s) for s in o.seeds.split(",")] if o.seeds else list(range(o.seed, o.seed + o.count))
    rows, failed = [], 0
    with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        for seed, family, of_case, said in pool.map(lambda s: judge(o, s), seeds):
            if of_case is None:
                failed += 1
                print("%d %s: FAILED: %s" % (seed, family, said.strip()))
                continue
            for r in of_case:
                if r["healthy"]:
                    if r["causes"] or r["left"] > 1.02:
                        print("%4d %-14s %-12s FALSE, left %.3f: %s" % (seed, family, r["channel"], r["left"], ", ".join(r["causes"])))
                else:
                    mark = "%s%s%s" % ("F" if r["found"] else "-", "1" if r["first"] else "-", "A" if r["all"] else "-")
                    print("%4d %-14s %-12s %s gain %5.2f, left %.3f of %.3f: %s   [%s]" % (seed, family, r["channel"], mark, r["gain"], r["left"],
                                                                                 r["bound"], ", ".join(r["causes"]), ", ".join(r["wanted"])))
                sys.stdout.flush()
            rows += of_case
    reached = figures(rows)
    print("%s, seeds %d to %d: " % (o.drawer, seeds[0], seeds[-1]) + ", ".join("%s %.3g" % kv for kv in reached.items()))
    missed = False
    for line in open(o.floors, encoding="utf-8") if o.floors else []:
        words = line.split("#")[0].split()
        if words:
            met = reached[words[0]] <= float(words[1]) if words[0] in MOST else reached[words[0]] >= float(words[1])
            missed = missed or not met
            print("%s: %s %.3g (%s %s)" % ("ok" if met else "FAILED", words[0], reached[words[0]], "at most" if words[0] in MOST else "at least",
                                           words[1]))
    sys.exit(3 if failed else 1 if missed else 0)


if __name__ == "__main__":
    main()
