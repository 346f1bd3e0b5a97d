#!/bin/bash
# SPDX-License-Identifier: MIT
# A monitor that is started in the middle of a run, and one that loses three seconds of rows twice: what the
# commands were before is not known, so healthy runs raise no alarm and the output says what was not
# examined; a fault after the gaps is found as before. On two vehicles of tests/vehicles; base of seeds: 41000.
. "$(dirname "$0")/check.inc"
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
cd "$here" || exit 1

cut() { awk -v n="$(wc -l < "$1")" 'NR == 1 || NR > n / 2' "$1"; }
lose() { # three seconds from 30 % and from 60 % of the rows on
  awk -F, -v n="$(wc -l < "$1")" 'NR == 1 {print; next}
    NR == int(n * .3) || NR == int(n * .6) {t = $1}
    t == "" || $1 - t >= 3' "$1"
}
for v in engine tank; do
  python3 "$root/tests/vehicles/grade.py" --vehicles $v --train 20 --healthy 3 --per 1 --base 41000 --csv logs > /dev/null
  check "$v: drawn" 0 $?
  "$RIM" train logs/$v/train_*.csv --out $v.rim > /dev/null 2>&1; check "$v: trained" 0 $?
  for log in logs/$v/healthy_*.csv; do
    name=$v/$(basename "$log" .csv)
    cut "$log" > cut.csv
    lose "$log" > gaps.csv
    "$RIM" replay --model $v.rim cut.csv gaps.csv --fail-on-alarm > /dev/null; check "$name: no alarm" 0 $?
    out=$("$RIM" replay --model $v.rim "$log" cut.csv gaps.csv)
    of() { printf '%s\n' "$out" | grep -A2 "^$1:"; }
    ! of "$log" | grep -q 'in part'; check "$name: whole, every block is examined" 0 $?
    contains "$name: from the middle, it is said" "$(of cut.csv)" "STALE: 0 blocks were examined in full"
    contains "$name: from the middle, how many" "$(of cut.csv)" "examined, [1-9][0-9]* of them in part"
    contains "$name: after gaps, how many" "$(of gaps.csv)" "2 gaps; .*examined, [1-9][0-9]* of them in part"
  done
done
found=0 both=0
for log in logs/engine/*_00.csv logs/tank/*_00.csv; do
  lose "$log" > gaps.csv
  v=$(basename "$(dirname "$log")")
  "$RIM" replay --model "$v.rim" "$log" --fail-on-alarm > /dev/null; whole=$?
  [ $whole = 1 ] || continue
  found=$((found + 1))
  "$RIM" replay --model "$v.rim" gaps.csv --fail-on-alarm > /dev/null; [ $? = 1 ] && both=$((both + 1))
done
echo "faults found: $found, with rows lost: $both"
[ $found -ge 20 ] && [ $((10 * both)) -ge $((7 * found)) ]; check "faults are found with rows lost" 0 $?
finish
