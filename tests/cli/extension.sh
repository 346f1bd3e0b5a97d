#!/bin/bash
# SPDX-License-Identifier: MIT
# --extension: what rim diagnose found, put to use by replay and simulate.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1

"$RIM" simulate golf --out golf --runs 1 --seed 7 --truth truth.csv > /dev/null; check "golf" 0 $?
"$RIM" replay golf/run_0001.csv --fail-on-alarm > /dev/null; check "found" 1 $?

# What is lost behind the bump, as rows of the truth say, in a box about them.
python3 - << 'END'
import csv
log = [r for r in csv.DictReader(line for line in open("golf/run_0001.csv") if not line.startswith("#"))]
truth = [r for r in csv.DictReader(line for line in open("truth.csv") if not line.startswith("#"))]
inside = [l for l, t in zip(log, truth) if t["finding"] == "1"]
names = ["x.f001", "x.f002"]
low = [min(float(r[n]) for r in inside) for n in names]
high = [max(float(r[n]) for r in inside) for n in names]
box = [r for r in log if all(a <= float(r[n]) <= b for n, a, b in zip(names, low, high))]
shift = sum(float(r["z.reward"]) - float(r["m.reward"]) for r in box) / len(box)
open("mend.toml", "w").write(f"""schema = "rim-extension/1"
[[term]]
channel = "reward"
cause = "bias"
basis = ["1"]
[[term.size]]
name = "size"
value = {shift}
[term.region]
features = {names}
lower = {low}
upper = {high}
""".replace("'", '"'))
END
out=$("$RIM" replay golf/run_0001.csv --extension mend.toml --fail-on-alarm); check "mended: nothing is found" 0 $?
contains "mended: said" "$out" "run_0001.csv: healthy"

"$RIM" replay golf/run_0001.csv --extension mend.toml --save-model mended.rim > /dev/null; check "an image" 0 $?
"$RIM" replay golf/run_0001.csv --model mended.rim --fail-on-alarm > /dev/null; check "the image carries the correction" 0 $?
"$RIM" replay golf/run_0001.csv --save-model plain.rim > /dev/null
"$RIM" replay golf/run_0001.csv --model plain.rim --fail-on-alarm > /dev/null; check "one without it finds" 1 $?
"$RIM" replay golf/run_0001.csv --model plain.rim --extension mend.toml --fail-on-alarm > /dev/null
check "a model and an extension" 0 $?

"$RIM" simulate golf --out again --runs 1 --seed 7 --extension mend.toml > /dev/null; check "simulate" 0 $?
"$RIM" replay again/run_0001.csv --fail-on-alarm > /dev/null; check "its prediction is mended" 0 $?
contains "the record says so" "$(head -2 again/simulate.toml)" "--extension mend.toml"
check "nothing but the prediction differs" "$(grep -v '^#' golf/run_0001.csv | cut -d, -f1-4)" \
  "$(grep -v '^#' again/run_0001.csv | cut -d, -f1-4)"

# bad input
err=$("$RIM" simulate lander --out no --extension mend.toml 2>&1); check "lander: nothing to apply to" 2 $?
contains "lander: said" "$err" "carry no prediction"
[ ! -e no ]; check "lander: no folder" 0 $?
err=$("$RIM" replay golf/run_0001.csv --extension none.toml 2>&1 > /dev/null); check "no such file" 3 $?
sed 's/bias/drag/; s/"1"/"v"/' mend.toml > bad.toml
err=$("$RIM" replay golf/run_0001.csv --extension bad.toml 2>&1 > /dev/null); check "an unknown name" 3 $?
contains "an unknown name: where" "$err" "bad.toml:line 5: .*'v' is neither"
sed 's/f002/f003/' mend.toml > other.toml
err=$("$RIM" replay golf/run_0001.csv --extension other.toml --save-model half.rim 2>&1 > /dev/null)
check "a feature that the log has not" 3 $?
contains "which" "$err" "other.toml:line 9: there is no feature 'x.f003'"
err=$("$RIM" simulate golf --out half --extension other.toml 2>&1 > /dev/null); check "simulate: the same" 3 $?
[ ! -e half.rim ] && [ ! -e half ]; check "nothing half-written" 0 $?
"$RIM" replay golf/run_0001.csv --model plain.rim --save-model x.rim 2> /dev/null; check "nothing new to write" 2 $?
finish
