#!/bin/bash
# SPDX-License-Identifier: MIT
# Motion interference: simulated, learned, measured; bad labels and logs are refused.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
printf '[[effect]]\nkind = "hold"\n' > hold.toml
printf '[[effect]]\nkind = "stuck"\nwheel = 2\n' > stuck.toml
for kind in hold stuck; do
  "$RIM" simulate cobot --out $kind --runs 3 --rows 400 --seed 5 --effect $kind.toml --labels $kind.csv > /dev/null
  check "simulate $kind" 0 $?
done
"$RIM" simulate cobot --out control --runs 2 --rows 1500 --seed 6 > /dev/null; check "control" 0 $?
(cat hold.csv; tail -n +2 stuck.csv) > labels.csv
contains "labels" "$(cat labels.csv)" "^hold/run_0001.csv,[0-9.]*,[0-9.]*,hold$"

out=$("$RIM" train hold/*.csv stuck/*.csv control/*.csv --interference labels.csv --out a.rim 2>err.txt); check "train" 0 $?
contains "p_mi" "$out" "^p_mi "
contains "whole detector" "$out" "all together: 6 of 6 found, 0 false"
"$RIM" train hold/*.csv stuck/*.csv control/*.csv --interference labels.csv --out b.rim > /dev/null 2>&1
cmp -s a.rim b.rim; check "deterministic" 0 $?
# The folder tells logs of one name apart, however their paths begin and the labels' lines end.
sed 's/$/\r/' labels.csv > crlf.csv
"$RIM" train ./hold/*.csv ./stuck/*.csv ./control/*.csv --interference crlf.csv --out b.rim > /dev/null 2>&1
cmp -s a.rim b.rim; check "other paths, and lines that end as on Windows" 0 $?

# Encoders that wrap give the same speeds.
"$RIM" simulate cobot --out enc --runs 3 --rows 400 --seed 5 --effect hold.toml --labels enc.csv --encoders > /dev/null
"$RIM" train enc/*.csv --interference enc.csv --out x.rim > /dev/null 2> err.txt; check "encoders of a robot that is not known" 3 $?
contains "encoders: which robot" "$(cat err.txt)" "whose wheels .*--robot"
printf '[cobot]\nbase_radius_m = 0.2\ntick_m = 1e-4\n' > robot.toml
out=$("$RIM" train enc/*.csv --interference enc.csv --robot robot.toml --out c.rim 2>/dev/null); check "encoders" 0 $?
contains "encoders find" "$out" "all together: 3 of 3 found"

bad_labels() { # WHAT ROW REASON
  printf 'log,start_s,end_s,kind\n%b\n' "$2" > bad.csv
  "$RIM" train hold/*.csv --interference bad.csv --out x.rim > /dev/null 2> err.txt; check "$1" 3 $?
  contains "$1: why" "$(cat err.txt)" "$3"
}
bad_labels "overlap" "hold/run_0001.csv,4,6,hold\nhold/run_0001.csv,5,7,hold" "overlap"
bad_labels "leaves the log" "hold/run_0001.csv,4,60,hold" "leaves the log"
bad_labels "another log" "none.csv,4,6,hold" "not among the logs"
bad_labels "one log under two names" "hold/run_0001.csv,4,6,hold\nstuck/run_0001.csv,4,6,hold" "both seem to be hold/run_0001.csv"
sed 's,^hold/,,' hold.csv > bare.csv
"$RIM" train hold/*.csv stuck/*.csv --interference bare.csv --out x.rim > /dev/null 2> err.txt; check "a name of two logs" 3 $?
contains "a name of two logs: why" "$(cat err.txt)" "'run_0001.csv' may be hold/run_0001.csv or stuck/run_0001.csv"
bad_labels "no number" "hold/run_0001.csv,x,6,hold" "not a number"
head -6 hold/run_0001.csv > short.csv
printf 'log,start_s,end_s,kind\n' > none.csv
"$RIM" train short.csv --interference none.csv --out x.rim > /dev/null 2> err.txt; check "short" 3 $?
contains "short: why" "$(cat err.txt)" "regression windows need 9"
out=$("$RIM" train control/*.csv --interference none.csv --out d.rim 2>/dev/null); check "no interference" 0 $?
contains "unseen" "$out" "state 'mi' is never seen"
sed '1s/u.vx_mps/u.other/' hold/run_0001.csv > nocmd.csv
"$RIM" train nocmd.csv --interference none.csv --out x.rim > /dev/null 2> err.txt; check "no command" 3 $?
contains "no command: why" "$(cat err.txt)" "no command"
[ -e x.rim ]; check "nothing written" 1 $?

# On board: an image for the logs' own predictions, with the detector put into it.
held=hold/run_0001.csv
head -n 701 control/run_0001.csv > brief.csv
"$RIM" replay brief.csv --save-model plain.rim --calibration-runs 19 > /dev/null 2>&1; check "plain image" 0 $?
"$RIM" train hold/*.csv stuck/*.csv control/*.csv --interference labels.csv --model plain.rim --out both.rim > out.txt 2>&1
check "put into an image" 0 $?
"$RIM" replay --model both.rim $held --alarms held.jsonl --candump held.can > text.txt 2>&1; check "replay held" 0 $?
contains "told" "$(cat text.txt)" "motion interference FOUND at t = "
first=$(grep '"detector":"interference"' held.jsonl | head -1)
contains "raised" "$first" '"state":"raised"'
contains "its kind" "$first" '"kind":"blocked"'
contains "its channel" "$first" '"channels":\["z.vx_mps"\]'
contains "in words" "$first" "vx is blocked"
span=$(grep "^$held," labels.csv)
number() { printf '%s\n' "$first" | sed "s/.*\"$1\":\([0-9.]*\).*/\1/"; }
awk -F, -v t="$(number t_s)" -v since="$(number since_s)" \
  '{exit !(t >= $2 && t <= $3 && since <= t && since >= $2 - 0.5)}' <<< "$span"
check "within its time ($span, t $(number t_s), since $(number since_s))" 0 $?
check "its frames" "$(grep -c . held.jsonl)" "$(grep -c '181#' held.can)"
"$RIM" replay --model both.rim control/*.csv --alarms control.jsonl > text.txt; check "replay control" 0 $?
check "control is quiet" 2 "$(grep -c 'motion interference: none' text.txt)"
check "no alarm of it" 0 "$(grep -c '"detector":"interference"' control.jsonl)"
both=$(tail -1 text.txt)
check "the same again" "$both" "$("$RIM" replay --model both.rim control/*.csv | tail -1)"
"$RIM" replay --model plain.rim control/*.csv --alarms plain.jsonl > text.txt
check "regions as without it" "$(cat plain.jsonl | sed 's/,"model_id":[0-9]*//')" "$(sed 's/,"model_id":[0-9]*//' control.jsonl)"
check "digest holds its numbers" 1 "$([ "$both" != "$(tail -1 text.txt)" ] && echo 1)"
"$RIM" train hold/*.csv --model plain.rim --out x.rim > /dev/null 2> err.txt; check "--model alone" 2 $?
"$RIM" train hold/*.csv --interference hold.csv --model hold.csv --out x.rim > /dev/null 2> err.txt; check "no image" 3 $?
sed '1s/vx_mps/forward_mps/g' brief.csv > other.csv
"$RIM" replay other.csv --save-model other.rim --calibration-runs 19 > /dev/null 2>&1
"$RIM" train hold/*.csv --interference hold.csv --model other.rim --out x.rim > /dev/null 2> err.txt; check "other rows" 3 $?
contains "other rows: why" "$(cat err.txt)" "no 'u.vx_mps'"
[ -e x.rim ]; check "nothing written by these" 1 $?

# The daemon says what the replay says.
awk -F, 'BEGIN {OFS = ","} /^#/ || /^t_s/ {print; next} {$1 = sprintf("%.6f", $1); print}' $held > held.csv
"$RIM" replay --model both.rim held.csv --alarms held.jsonl > /dev/null 2>&1; check "replay in whole us" 0 $?
said=$(python3 "$root/tests/firmware/interference_test.py" "$BUILD/rimd" "$root/lib/wire" .); check "rimd" 0 $?
echo "rimd: $said"

# Cells without a command are skipped and counted; labels and detector go on.
awk -F, 'BEGIN {OFS = ","} NR == 1 {for (i = 1; i <= NF; i++) if ($i == "u.vx_mps") c = i} NR > 1 && NR % 50 == 0 {$c = ""} {print}' \
  hold/run_0001.csv > missing.csv
out=$("$RIM" train missing.csv hold/run_0002.csv hold/run_0003.csv --interference hold.csv --out e.rim 2>err.txt)
check "labels of another log" 3 $?
cp hold.csv names.csv; sed -i 's/run_0001/missing/; s,hold/missing,missing,' names.csv
out=$("$RIM" train missing.csv hold/run_0002.csv hold/run_0003.csv --interference names.csv --out e.rim 2>err.txt)
check "commands missing" 0 $?
contains "commands missing: counted" "$out" "8 rows skipped"

if [ -z "${SANITIZE:-}" ] && command -v valgrind > /dev/null; then
  "$root/lib/instructions.sh" "$BUILD" 2000 hmm; check "instructions of the HMM" 0 $?
else
  echo "skipped: instructions of the HMM (no valgrind, or under the sanitizers)"
  skipped=$((skipped + 1))
fi

out=$("$RIM_THESIS" experiment control_mrclam --data nowhere 2>&1); check "no measured robots" 3 $?
contains "no measured robots: why" "$out" "nowhere: no such folder"
# Robots that reach nine tenths of the speed commanded, and that after a while; own random numbers.
mkdir robots
cat > robot.awk <<'END'
function uniform() {seed = (seed * 16807) % 2147483647; return seed / 2147483647}
function normal(  i, s) {s = -6; for (i = 0; i < 12; i++) s += uniform(); return s}
BEGIN {
  seed = (seed * 7919 + 17) % 2147483647
  for (i = 0; i < 20; i++) uniform()
  print "t_s,x_m,y_m,theta_rad,cmd_v_mps,cmd_w_radps,pose_ok"
  x = y = th = v = 0; next_s = 0
  for (i = 0; i < rows; i++) {
    t = i * 0.02
    if (t >= next_s) {cv = 0.1 + 0.1 * uniform(); cw = uniform() < 0.5 ? 0 : uniform() - 0.5; next_s = t + 3 + 4 * uniform()}
    target = 0.9 * cv; d = target - v; m = 0.01; if (d > m) d = m; if (d < -m) d = -m; v += d
    x += v * cos(th) * 0.02; y += v * sin(th) * 0.02; th += cw * 0.02
    w = atan2(sin(th), cos(th))
    printf "%.2f,%.5f,%.5f,%.5f,%.4f,%.4f,1\n", t, x + 0.0005 * normal(), y + 0.0005 * normal(), w + 0.001 * normal(), cv, cw
  }
}
END
for r in 1 2; do awk -v seed=$((r + 40)) -v rows=6000 -f robot.awk > robots/d1_r$r.csv; done
out=$("$RIM_THESIS" experiment control_mrclam --data robots --halves --null-runs 4 2> err.txt); check "control_mrclam" 0 $?
contains "silent" "$out" "^false alarms in all runs: 0 in 0.07 h"
contains "holds are found" "$out" "^all .* \([1-9]\)/\1 "
contains "diagnosed" "$out" "^d1_r1 by the others: .*gain"
"$RIM_THESIS" experiment control_mrclam --data robots --exclude d1_r1 > /dev/null 2> err.txt; check "one robot" 3 $?
contains "one robot: why" "$(cat err.txt)" "too few logs to learn from"

out=$("$RIM_THESIS" experiment figC.5 --worlds 1 --hours 0.05 --seed 900 --plot c5.svg 2>/dev/null); check "figC.5" 0 $?
contains "table" "$out" "^whole detector"
[ -s c5.svg ]; check "picture" 0 $?
finish
