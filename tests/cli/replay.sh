#!/bin/bash
# SPDX-License-Identifier: MIT
# rim replay: alarms, labels, trace, figure, LCM, candump; what it finds and what it leaves alone.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
cd "$here" || exit 1
toy_model toy.rim
toy healthy.csv 101
toy biased.csv 102 1200 'a += 0.5'
toy stuck.csv 103 1200 'if (i > 600) v = held; else held = v'

out=$("$RIM" replay --model toy.rim healthy.csv biased.csv stuck.csv --alarms a.jsonl --labels l.csv --trace t.csv \
  --plot p.svg --candump c.log --lcm "file://$here/bus.lcm?mode=w"); check "replay" 0 $?
contains "healthy" "$out" "^healthy.csv: healthy: nothing found in 1200 rows"
contains "biased" "$out" "^biased.csv: FOUND at t = "
contains "biased: in words" "$out" "position a reads 0\.[2-7][0-9]* m high"
contains "stuck" "$out" "^stuck.csv: FOUND at t = [3-5]"
contains "stuck: named" "$(printf '%s\n' "$out" | grep -A2 '^stuck.csv')" "speed \(scatters [0-9.e-]* times\|repeats\)"
# A fault in a place explains the rest of the floor with the other sign as well: the last record has the sign of the first.
toy placed.csv 102 1200 'if (x > 1) v += 0.5'
"$RIM" replay --model toy.rim placed.csv --alarms placed.jsonl > /dev/null; check "a fault in a place" 0 $?
contains "placed: the sign stays" "$(tail -1 placed.jsonl)" '"shift":{"s.speed_mps":0\.4'
contains "placed: where" "$(tail -1 placed.jsonl)" '"features":\["s.position_[ab]_m"\]'
# Of two sensors that read the same the one that is wrong is named, and what they integrate before them.
toy twin.csv 101 900 'if (i >= 400) b += 0.6'
contains "twin: the other one" "$("$RIM" replay --model toy.rim twin.csv | grep 'in the end')" "position b reads 0\.[5-6][0-9]* m high"
toy twin.csv 131 900 'if (i >= 300) a -= 0.3'
contains "twin: this one" "$("$RIM" replay --model toy.rim twin.csv | grep 'in the end')" "position a reads 0\.[2-3][0-9]* m low"
contains "placed: what they integrate" "$("$RIM" replay --model toy.rim placed.csv | grep 'in the end')" "speed reads 0\.4[0-9]* m/s high"
digest=$(printf '%s\n' "$out" | tail -1)
contains "last line" "$digest" '^digest [0-9a-f]\{16\}$'
check "the same twice" "$digest" "$("$RIM" replay --model toy.rim healthy.csv biased.csv stuck.csv | tail -1)"
! [ "$digest" = "$("$RIM" replay --model toy.rim healthy.csv stuck.csv biased.csv | tail -1)" ]
check "another order, another digest" 0 $?
one=$("$RIM" replay --model toy.rim biased.csv | head -3)
check "no log depends on those before it" "$one" "$(printf '%s\n' "$out" | grep -A2 '^biased.csv')"

# A recording of the bus is played to its end; what cannot be opened is told without what helps udpm.
"$RIM" listen --lcm "file://$here/bus.lcm?speed=0" > heard.jsonl 2> heard.txt; check "a recording is played to its end" 0 $?
check "every record of it" "$(wc -l < a.jsonl)" "$(wc -l < heard.jsonl)"
check "and nothing is wrong" "rim: listening on file://$here/bus.lcm?speed=0" "$(cat heard.txt)"
for url in file://$here/none.lcm garbage; do
  "$RIM" listen --lcm "$url" > heard.jsonl 2> heard.txt; check "no bus: $url" 3 $?
  check "no bus: why" "rim: $url: LCM cannot open it" "$(tail -1 heard.txt)"
done

python3 - << 'END' > py.txt 2>&1
import csv, json
alarms = [json.loads(line) for line in open("a.jsonl")]
print("keys", all({"t_s", "seq", "detector", "state", "level", "channels", "features", "region", "ln_anom", "threshold",
    "p_value", "observations", "shift", "sentence"} <= a.keys() for a in alarms))
print("raised", sum(a["state"] == "raised" for a in alarms))
print("replay", all(a["replay"] for a in alarms))
print("seq", [a["seq"] for a in alarms] == list(range(1, len(alarms) + 1)))
rows = list(csv.DictReader(open("l.csv")))
print("rows", [sum(r["log"] == n for r in rows) for n in ("healthy.csv", "biased.csv", "stuck.csv")])
print("numbers", [int(r["row"]) for r in rows] == 3 * list(range(1, 1201)))
print("marked", [any(r["finding"] == "1" for r in rows if r["log"] == n) for n in ("healthy.csv", "biased.csv", "stuck.csv")])
trace = [line for line in open("t.csv")]
print("trace", trace[0].strip(), len(trace))
END
for text in "keys True" "raised 2" "replay True" "seq True" "rows \[1200, 1200, 1200\]" "numbers True" "marked \[False, True, True\]" \
  "trace t_s,ln_anom,threshold,score,level,log 3601"; do contains "outputs" "$(cat py.txt)" "$text"; done
records=$(wc -l < a.jsonl)
frames=$(python3 -c 'import json; print(sum(31 + 3 * len(json.loads(line)["features"]) for line in open("a.jsonl")))')
check "31 CAN frames per record, and 3 per feature of a region: summary, finding, detail" "$frames" "$(wc -l < c.log)"
check "the log of the bus holds every alarm" "$records" "$(grep -ao 'RIM_ALARM' bus.lcm | wc -l)"
check "and a health message a log" 3 "$(grep -ao 'RIM_HEALTH' bus.lcm | wc -l)"
contains "figure" "$(cat p.svg)" "biased.csv: alarm at t = "
contains "figure: axes" "$(cat p.svg)" "ln anom (nat)"
"$RIM" replay --model toy.rim healthy.csv --plot p.png > /dev/null; check "png" 0 $?
contains "png" "$(head -c 4 p.png | tr -d '\211')" "PNG"
[ -z "$(find . -name '*.tmp.*' -o -name '*.gnuplot.*')" ]; check "nothing left over" 0 $?

"$RIM" replay --model toy.rim healthy.csv --fail-on-alarm > /dev/null; check "--fail-on-alarm, healthy" 0 $?
cp healthy.csv 'run 1, left.csv'
"$RIM" replay --model toy.rim 'run 1, left.csv' --trace named.csv > /dev/null; check "a comma in a name" 0 $?
check "a comma in a name: a field" '6 run 1, left.csv' "$(python3 -c 'import csv; r = list(csv.reader(open("named.csv"))); print(len(r[1]), r[1][5])')"
"$RIM" replay --model toy.rim healthy.csv biased.csv --fail-on-alarm > /dev/null; check "--fail-on-alarm, found" 1 $?
err=$("$RIM" replay --model toy.rim healthy.csv --can nocan0 2>&1 >/dev/null); check "--can without CAN" 3 $?
contains "--can: said" "$err" "nocan0: .*\(no CAN\|no such interface\).*--candump"
"$RIM" replay --model toy.rim healthy.csv --plot p.gif 2>/dev/null; check "a figure of another kind" 2 $?
"$RIM" replay --model toy.rim healthy.csv --false-alarm 0.1 2>/dev/null; check "--false-alarm with a model" 2 $?
err=$("$RIM" replay healthy.csv 2>&1 >/dev/null); check "no model, no predictions" 3 $?
contains "no model: what to do" "$err" "needs a model"

# What nobody judged is not healthy: STALE says from when to when, in the summary and, for who asks, by the status, as rim check does.
stale() { # stale WHAT LOG PATTERN
  local option want
  for option in "" --fail-on-alarm; do
    want=3; [ -n "$option" ] || [ "$2" = slow.csv ] || want=0 # without the option only another rate counts
    out=$("$RIM" replay --model toy.rim "$2" $option 2> err.txt); check "$1 $option: status" $want $?
    contains "$1 $option" "$out" "$3"
    contains "$1 $option: on stderr" "$(cat err.txt)" "1 of 1 logs STALE"
  done
  check "$1: not healthy" 0 "$(printf '%s\n' "$out" | grep -c ': healthy')"
  out=$("$RIM" check --model toy.rim "$2" 2> /dev/null); check "$1: status of rim check" 3 $?
  contains "$1: rim check" "$out" "$3"
}
silent() { awk -F, -v OFS=, -v from="$1" -v to="$2" 'NR > 1 && NR - 1 > from && NR - 1 <= to {$5 = ""} {print}' healthy.csv; }
silent 300 1200 > dead.csv; silent 200 1100 > hole.csv; silent 0 400 > late.csv
stale "a sensor that dies" dead.csv "^dead.csv: STALE: no usable row from t = 14.95 s to t = 59.95 s (45 s of 60 s)"
stale "a sensor silent for a time" hole.csv "^hole.csv: STALE: no usable row from t = 9.95 s to t = 55.00 s"
stale "a sensor that begins late" late.csv "^late.csv: STALE: no usable row from t = 0.00 s to t = 20.00 s"
awk 'NR == 1 || NR <= 400 || NR > 460' healthy.csv > gap.csv
out=$("$RIM" replay --model toy.rim gap.csv --fail-on-alarm 2> /dev/null); check "a short silence" 0 $?
contains "a short silence is told" "$out" "^gap.csv: healthy: .*; not judged: no usable row from t = 19.90 s to t = 22.95 s (3.05 s of 60 s)"
head -2 healthy.csv > one.csv; awk 'NR == 1 || NR % 10 == 2' healthy.csv > slow.csv
stale "a single row" one.csv "^one.csv: STALE: 0 blocks were examined, too few"
stale "another rate" slow.csv "^slow.csv: STALE: rows come at 2.00[0-9]* Hz"
"$RIM" replay --model toy.rim dead.csv --candump dead.can > /dev/null 2>&1
check "the record that the board sends" 1 "$(grep -c ' 181#' dead.can)"
out=$("$RIM" replay --model toy.rim healthy.csv dead.csv biased.csv --fail-on-alarm 2>&1); check "one of several" 3 $?
contains "one of several: how many" "$out" "1 of 3 logs STALE"
# Found is judged, whatever came later; and what a schema leaves out on purpose is no silence.
awk -F, -v OFS=, 'NR > 901 {$5 = ""} {print}' biased.csv > ended.csv
out=$("$RIM" replay --model toy.rim ended.csv --fail-on-alarm 2> /dev/null); check "found, then silent" 1 $?
contains "found, then silent: both" "$(printf '%s\n' "$out" | tr '\n' ' ')" "FOUND at .*STALE: no usable row"
printf 'schema = "rim-schema/1"\n[[keep]]\ncolumn = "u.push"\nmin = 0\n' > half.toml
out=$("$RIM" replay --model toy.rim healthy.csv --schema half.toml 2> /dev/null)
contains "left out on purpose" "$out" "left out by the schema"
check "left out on purpose: no silence" 0 "$(printf '%s\n' "$out" | grep -c 'no usable row')"

# Columns are found by name: another order and one more column change nothing.
awk -F, -v OFS=, '{print $1, $5, $2, $4, $3, (NR == 1 ? "s.extra" : 1)}' biased.csv > turned.csv
err=$("$RIM" replay --model toy.rim turned.csv 2>&1 >/dev/null)
contains "an unknown column is named" "$err" "s.extra"
check "columns by name" "$("$RIM" replay --model toy.rim biased.csv | tail -1)" "$("$RIM" replay --model toy.rim turned.csv 2>/dev/null | tail -1)"

# Logs with their own predictions need no model.
awk -F, -v OFS=, 'NR == 1 {print "t_s,x.push,z.position,m.position,sd.position"; next}
  {print $1, $2, $3 + ($2 > 0.5 ? 0.2 : 0), $4, 0.05}' healthy.csv > own.csv
out=$("$RIM" replay own.csv --labels own_labels.csv); check "own predictions" 0 $?
contains "own predictions: found" "$out" "position reads 0\.[12][0-9]* high .*where push is"
contains "own predictions: promise" "$out" "^calibrated by a table: at most 5 % of healthy runs"
contains "own predictions: residuals" "$out" "^residuals were tested for scale and autocorrelation"
out=$("$RIM" replay own.csv --calibration-runs 39); check "by Monte Carlo" 0 $?
contains "by Monte Carlo: promise" "$out" "^calibrated by 39 Monte Carlo runs: at most 5 % of healthy runs"
hit=$(paste -d, <(tail -n +2 own.csv) <(tail -n +2 own_labels.csv) | awk -F, '{n++; s += (($2 > 0.5) == ($9 > 0))} END {print (s / n > 0.9)}')
check "own predictions: the rows of the region" 1 "$hit"
awk -F, -v OFS=, '{print $1, $2, ($2 > 0.5 || NR == 1 ? $3 : $3), $4}' own.csv > nosd.csv
err=$("$RIM" replay nosd.csv 2>&1 >/dev/null); check "without sd" 0 $?
contains "without sd: said" "$err" "z.position.* estimated"
finish
