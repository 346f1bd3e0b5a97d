#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""limits.py EXPERIMENT FILE: whether what `rim-thesis experiment EXPERIMENT` printed into FILE keeps the
limits that this project set itself. Prints one line per limit. Exits 0 when all are met or none is kept
for the experiment, 1 when one is missed or its line is not in the file, 2 when called wrongly.

The limits hold for the experiments at their own size, as `make bench` runs them."""
import re
import sys

NUMBER = r"(-?[\d.]+)"
SKIP = r"-?[\d.]+"
INTERVAL = r"\[[^]]*\]"  # 0.940 [0.930, 0.951]
LOW, HIGH = r"\[(-?[\d.]+),[^]]*\]", r"\[[^],]*, (-?[\d.]+)\]"
RATIO = r"[\d.]+ \([^)]*\)"  # 0.123 (0.101 to 0.150)


def golf(dims, column):
    """The row of so many dimensions: F1, runs alarmed without a bump, shots to the alarm, ms of one run."""
    parts = ["%s " + INTERVAL, SKIP, SKIP, "%s", "%s " + INTERVAL, SKIP, "%s", SKIP]
    names = ["F1", None, None, "no bump", "shots", None, "ms", None]
    return "^%d " % dims + " ".join(p % (NUMBER if n == column else SKIP) if "%s" in p else p
                                    for p, n in zip(parts, names)) + "$"


def falcon(column):
    """Every flight's row: ratios at one step, in air, at the horizon, on the coast, of the second term."""
    parts = [RATIO] * 5
    parts[column] = r"(?:%s \([^)]*\)|-|none found)" % NUMBER
    return r"^\S+ \d+ " + " ".join(p if i == column else "(?:%s|-|none found)" % p for i, p in enumerate(parts)) + "$"


def table31(failure, column):
    """The row of a failure: data points to the alarm, precision, recall; beside each the thesis's."""
    parts = {"points": "%s " + INTERVAL + " " + SKIP + " " + SKIP + " " + SKIP,
             "precision": "%s " + INTERVAL + " " + SKIP, "recall": "%s " + INTERVAL + " " + SKIP}
    return "^" + failure + " " + " ".join(p % (NUMBER if n == column else SKIP) for n, p in parts.items()) + "$"


# Experiment: what, where (the number is the group), how it is compared, with what, and in how many lines
# it must stand at least.
LIMITS = {
    "golf": [("F1, %d dimensions" % d, golf(d, "F1"), ">=", bound, 1)
             for d, bound in ((2, 0.92), (10, 0.92), (30, 0.91), (100, 0.91))]
    + [("false alarms, %d dimensions" % d, golf(d, "no bump"), "<=", 0.08, 1) for d in (2, 100)]
    + [("shots to the alarm, %d dimensions" % d, golf(d, "shots"), "<=", bound, 1)
       for d, bound in ((2, 7), (10, 10), (100, 13))]
    + [("ms of one run, 100 dimensions", golf(100, "ms"), "<=", 100, 1)],
    "table3.1": [("%s: %s" % (failure, column), table31(failure, column), how, bound, 1)
                 for failure, bounds in (("encoder", (29.0, 1.0, 0.92)), ("collision", (2.25, 1.0, 0.85)),
                                         ("corridor", (30.0, 0.97, 0.90)), ("left.turn", (15.5, 0.95, 0.85)))
                 for column, how, bound in zip(("points", "precision", "recall"), ("<=", ">=", ">="), bounds)],
    "fig3.4": [("FRR within 300 passes", r"^\d+-300 " + " ".join([SKIP + " " + INTERVAL] * 2) + " %s " % NUMBER
                + INTERVAL, ">=", 0.45, 1)],
    "fig3.5": [("MPA of the corrected model over the nominal one's, lower end",
                r"^MPA \(eq\. 3\.38\) " + " ".join([SKIP + " " + INTERVAL] * 2) + " " + SKIP + " " + LOW, ">", 0.0, 1)],
    "fig4.10": [("loss of F1 against the fewest dimensions",
                 r"^\d+ (?:%s )*%s %s %s %s$" % (SKIP, SKIP, INTERVAL, NUMBER, INTERVAL), "<=", 0.03, 1)],
    "figC.5": [("recall, %", r"^whole detector \S+ %s" % NUMBER, ">=", 100.0, 1),
               ("false positives", r"^whole detector \S+ %s (?:%s )?%s " % (SKIP, INTERVAL, NUMBER), "<=", 0, 1),
               ("mean delay, s", r"^whole detector \S+ %s (?:%s )?%s %s %s" % (SKIP, INTERVAL, SKIP, NUMBER, INTERVAL),
                "<=", 0.30, 1),
               ("median delay, s", r"^whole detector .* %s %s$" % (NUMBER, INTERVAL), "<=", 0.18, 1),
               ("false alarms in 10 h of nominal driving", r"^whole detector, false alarms .* in 10 h %s " % NUMBER,
                "<=", 1.0, 1)],
    "fig5.10": [("region: late shots of RIM+GP-UCB less GP-UCB, lower end",
                 r"^region: RIM\+GP-UCB less GP-UCB, late shots: first \d+ runs %s %s" % (SKIP, LOW), ">", 0.0, 1),
                ("region: shots until 80 %, RIM-UCB over GP-UCB",
                 r"^region: shots until 80 %%, RIM-UCB over GP-UCB: %s " % NUMBER, "<=", 0.5, 1),
                ("other goalies: RIM+GP-UCB less the better of the others, upper end",
                 r"^\w+: RIM\+GP-UCB less the better of the others \([^)]*\): first \d+ runs %s %s" % (SKIP, HIGH),
                 ">=", 0.0, 2)],
    "figB.6": [("last kicks, part of the regret of chance", r"^\w+ shared, flat prior "
                + " ".join([SKIP + " " + INTERVAL] * 3) + " %s " % NUMBER + INTERVAL, "<=", 0.30, 3)],
    "measured_falcon": [("1 s", falcon(0), "<=", 0.16, 3), ("the horizon", falcon(2), "<=", 0.08, 3),
                        ("coast", falcon(3), "<=", 1.05, 3), ("second term", falcon(4), "<=", 0.75, 3)],
    "measured_mrclam": [(what, r"%s (?:%s ){3}%s \(" % (row, SKIP, NUMBER), "<=", bound, 2) for what, row, bound in (
        ("forward speed in turns", r"forward speed turn rate above \S+ rad/s", 0.30),
        ("forward speed otherwise", "forward speed otherwise", 1.0),
        ("forward speed", "forward speed everywhere", 0.55),
        ("turn rate", "turn rate everywhere", 0.60))]
    + [("forward speed: a product and a late command, from either half",
        r"^forward speed: (?=.*product).*(?:delay|lag)", None, None, 2)],
    "control_mrclam": [("false alarms in all runs", r"^false alarms in all runs: %s in" % NUMBER, "<=", 2, 1)],
}
HOLDS = {">=": lambda a, b: a >= b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b}


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    lines = [" ".join(line.split()) for line in open(sys.argv[2])]
    missed = 0
    for what, where, how, bound, least in LIMITS.get(sys.argv[1], []):
        matches = [match for match in (re.search(where, line) for line in lines) if match]
        if how is None:  # what must be said, not how much
            missed += len(matches) < least
            print("%s: in %d lines; asked: %d: %s" % (what, len(matches), least, "met" if len(matches) >= least else "MISSED"))
            continue
        found = [match.group(1) for match in matches]
        if len(found) < least:
            print("%s: in %d lines, not in %d: MISSED" % (what, len(found), least))
            missed += 1
        for text in found:
            met = text is not None and HOLDS[how](float(text), bound)
            missed += not met
            print("%s: %s; asked: %s %g: %s" % (what, text or "none", how, bound, "met" if met else "MISSED"))
    return 1 if missed else 0


sys.exit(main())
