#!/bin/bash
# SPDX-License-Identifier: MIT
# A small campaign on vehicles that nobody tuned for: a tank and an arm, one run of every fault, and wrong input on the
# arm; what grades them is tested first. The two of ../shared/vehicles too, where they are. Base of the seeds: 33000.
. "$(dirname "$0")/check.inc"
shared=${RIM_VEHICLES:-$root/../shared/vehicles}
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
cd "$root/tests/vehicles" || exit 1

python3 test_vehicles.py > "$here/graders.txt" 2>&1; check "the graders themselves" 0 $?
tail -4 "$here/graders.txt"

# Shares of 26 faulty runs; by chance a core that is as good as asked for misses none of these.
./grade.py --rim "$RIM" --vehicles tank,arm --train 20 --per 1 --healthy 4 --base 33000 --quiet --keep "$here/campaign" \
  --require found=.9,named=.9,sign=.85,size=.5,onset=.8,region=.5,f1=.9,false=.26,wrong=.08,early=.16,errors=0 > "$here/grade.txt" 2>&1
check "tank and arm are judged rightly" 0 $?
sed -n '/^all/,$p' "$here/grade.txt"
# A pump that draws air fills the tank less, and the level, which keeps that, shows it more clearly than the flow does.
grep -q '^ *cavitation .* named 1,' "$here/grade.txt"; check "what a level keeps is not taken for the cause" 0 $?

# A monitor that is started in the middle of a run, one that loses three seconds of rows twice, and one that loses a
# row in twenty, here and there: what was before is not known, or not what was in between, so healthy runs raise no
# alarm and the output says what was not examined; a fault is found as before. On the models and logs of the campaign
# above; the arm moves fast.
cut() { awk -v n="$(wc -l < "$1")" 'NR == 1 || NR > n / 2' "$1"; }
lose() { # three seconds from 30 % and from 60 % of the rows on
  awk -F, -v n="$(wc -l < "$1")" 'NR == 1 {print; next}
    NR == int(n * .3) || NR == int(n * .6) {t = $1}
    t == "" || $1 - t >= 3' "$1"
}
thin() { awk -v seed="$2" 'BEGIN {srand(seed)} NR == 1 || rand() >= .05' "$1"; }
cd "$here/campaign" || exit 1
for log in arm/healthy_00[0-3].csv tank/healthy_00[0-3].csv; do
  name=${log%.csv} model=${log%/*}/model.rim
  lose "$log" > gaps.csv
  thin "$log" 1 > thin.csv
  "$RIM" replay --model "$model" gaps.csv thin.csv --fail-on-alarm > /dev/null; check "$name: no alarm" 0 $?
  out=$("$RIM" replay --model "$model" "$log" gaps.csv)
  of() { printf '%s\n' "$out" | grep -A2 "^$1:"; }
  ! of "$log" | grep -q 'in part'; check "$name: whole, every block is examined" 0 $?
  case $name in tank/*) # an arm that rests where its log begins looks like one that starts
    cut "$log" > cut.csv
    "$RIM" replay --model "$model" cut.csv --fail-on-alarm > /dev/null; check "$name: from the middle, no alarm" 0 $?
    out=$out$'\n'$("$RIM" replay --model "$model" cut.csv)
    contains "$name: from the middle, it is said" "$(of cut.csv)" "STALE: 0 blocks were examined in full"
    contains "$name: from the middle, how many" "$(of cut.csv)" "examined, [1-9][0-9]* of them in part" ;;
  esac
  contains "$name: after gaps, how many" "$(of gaps.csv)" "2 gaps; .*examined, [1-9][0-9]* of them in part"
done
found=0 both=0 thinned=0
for log in arm/*_00.csv tank/*_00.csv; do
  [ -s "${log%.csv}.alarms.jsonl" ] || continue # as the campaign found it
  found=$((found + 1))
  lose "$log" > gaps.csv
  "$RIM" replay --model "${log%/*}/model.rim" gaps.csv --fail-on-alarm > /dev/null; [ $? = 1 ] && both=$((both + 1))
  thin "$log" 2 > thin.csv
  "$RIM" replay --model "${log%/*}/model.rim" thin.csv --fail-on-alarm > /dev/null; [ $? = 1 ] && thinned=$((thinned + 1))
done
echo "faults found: $found, with two gaps: $both, with a row in twenty lost: $thinned"
[ $found -ge 20 ] && [ $((10 * both)) -ge $((7 * found)) ]; check "faults are found with two gaps" 0 $?
[ $((10 * thinned)) -ge $((7 * found)) ]; check "faults are found with a row in twenty lost" 0 $?
cd "$root/tests/vehicles" || exit 1

./wrong_input.py --rim "$RIM" --vehicles arm --train 20 --base 33000 --trained "$here/campaign" --require > "$here/wrong.txt" 2>&1
check "wrong rate, unit and column are named, never healthy" 0 $?
grep -e ' WRONG ' "$here/wrong.txt"; tail -5 "$here/wrong.txt"

if [ ! -f "$shared/grade.py" ]; then
  echo "skipped: no $shared/grade.py"
  skipped=$((skipped + 1))
  finish
fi
out=$(python3 "$shared/grade.py" --rim "$RIM" --train 20 --healthy 4 --per 1 --base 33000); check "rover and roamer" 0 $?
line=$(printf '%s\n' "$out" | tail -1)
echo "$line"
# at_least WHAT SHARE: of 'WHAT a/b' in the last line
at_least() {
  awk -v what="$1" -v least="$2" '{n = split($0, part, "; ")
    for (i = 1; i <= n; i++) if (part[i] ~ "^" what " [0-9]") {split(part[i], w, " "); split(w[2], f, "/"); exit !(f[2] > 0 && f[1] >= least * f[2])}
    exit 1}' <<< "$line"
  check "rover and roamer: $1 at least $2" 0 $?
}
for share in "found .9" "named .9" "sign .8" "onset .8" "region .6"; do at_least $share; done
false_alarms=$(sed -n 's|^healthy runs alarmed \([0-9]*\)/.*|\1|p' <<< "$line")
[ "${false_alarms:-9}" -le 2 ]; check "rover and roamer: false alarms of 8 ($false_alarms)" 0 $?
finish
