#!/bin/bash
# SPDX-License-Identifier: MIT
# A small campaign on a vehicle that nobody tuned for: a tank, one run of every fault, and wrong input; what grades it is
# tested first. `make test-long`: an engine beside it, an arm of which rows are lost, and the two of ../shared/vehicles,
# where they are. Base of the seeds: 33000.
. "$(dirname "$0")/check.inc"
shared=${RIM_VEHICLES:-$root/../shared/vehicles}
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
cd "$root/tests/vehicles" || exit 1

python3 test_vehicles.py > "$here/graders.txt" 2>&1; check "the graders themselves" 0 $?
tail -4 "$here/graders.txt"

# Shares of 13 faulty runs of each; by chance a core that is as good as asked for misses none of these. Half of the time is
# the training, which is shorter with blocks of 12 s instead of 8.
vehicles=tank least=10 blocks="--train-option=--block-seconds --train-option=12"
is_long && vehicles=tank,engine least=20 blocks=
./grade.py --rim "$RIM" --vehicles $vehicles --train 20 --per 1 --healthy 4 --base 33000 --quiet --keep "$here/campaign" $blocks \
  --require found=.9,named=.9,sign=.85,size=.5,onset=.8,region=.5,f1=.9,false=.26,wrong=.08,early=.16,errors=0 > "$here/grade.txt" 2>&1
check "$vehicles: judged rightly" 0 $?
grep -v '^    ' "$here/grade.txt"
# A pump that draws air fills the tank less, and the level, which keeps that, shows it more clearly than the flow does.
grep -q '^ *cavitation .* named 1,' "$here/grade.txt"; check "what a level keeps is not taken for the cause" 0 $?

# A monitor that is started in the middle of a run, and one that loses three seconds of rows twice: what the
# commands were before is not known, so healthy runs raise no alarm and the output says what was not
# examined; a fault after the gaps is found as before. On the models and logs of the campaign above.
cut() { awk -v n="$(wc -l < "$1")" 'NR == 1 || NR > n / 2' "$1"; }
lose() { # three seconds from 30 % and from 60 % of the rows on
  awk -F, -v n="$(wc -l < "$1")" 'NR == 1 {print; next}
    NR == int(n * .3) || NR == int(n * .6) {t = $1}
    t == "" || $1 - t >= 3' "$1"
}
cd "$here/campaign" || exit 1
for log in */healthy_00[0-2].csv; do
  name=${log%.csv} model=${log%/*}/model.rim
  cut "$log" > cut.csv
  lose "$log" > gaps.csv
  # What was not examined is not called healthy either: cut.csv is STALE, hence 3.
  out=$("$RIM" replay --model "$model" "$log" cut.csv gaps.csv --fail-on-alarm 2> stale.txt); check "$name: STALE" 3 $?
  check "$name: no alarm" 0 "$(printf '%s\n' "$out" | grep -c 'FOUND at')"
  contains "$name: which are STALE" "$(cat stale.txt)" "^rim: 1 of 3 logs STALE"
  of() { printf '%s\n' "$out" | grep -A2 "^$1:"; }
  ! of "$log" | grep -q 'in part'; check "$name: whole, every block is examined" 0 $?
  contains "$name: from the middle, it is said" "$(of cut.csv)" "STALE: 0 blocks were examined in full"
  contains "$name: from the middle, how many" "$(of cut.csv)" "examined, [1-9][0-9]* of them in part"
  contains "$name: after gaps, how many" "$(of gaps.csv)" "2 gaps; .*examined, [1-9][0-9]* of them in part"
done
# One row in twenty lost, here and there: what the vehicle does in between is not known.
sparse() { awk 'BEGIN {srand(7)} NR == 1 || rand() >= .05' "$1"; }
found=0 gaps=0 rows=0
for log in */*_00.csv; do
  [ -s "${log%.csv}.alarms.jsonl" ] || continue # as the campaign found it
  found=$((found + 1))
  for how in lose sparse; do
    $how "$log" > lost.csv
    "$RIM" replay --model "${log%/*}/model.rim" lost.csv --fail-on-alarm > /dev/null
    case $how$? in lose1) gaps=$((gaps + 1)) ;; sparse1) rows=$((rows + 1)) ;; esac
  done
done
echo "faults found: $found, after gaps: $gaps, with one row in twenty lost: $rows"
[ $found -ge $least ] && [ $((10 * gaps)) -ge $((7 * found)) ]; check "faults are found after gaps" 0 $?
[ $((10 * rows)) -ge $((7 * found)) ]; check "faults are found with one row in twenty lost" 0 $?
for log in */healthy_00[0-3].csv; do
  sparse "$log" > lost.csv
  "$RIM" replay --model "${log%/*}/model.rim" lost.csv --fail-on-alarm > /dev/null
  check "$log: healthy with one row in twenty lost" 0 $?
done
cd "$root/tests/vehicles" || exit 1

if is_long; then # an arm, which moves fast
  ./grade.py --rim "$RIM" --vehicles arm --train 20 --per 1 --healthy 8 --base 33000 --lossy .05 --quiet \
    --require found=.7,named=.8,false=.26,errors=0 > "$here/lossy.txt" 2>&1
  check "an arm of which rows are lost is judged rightly" 0 $?
  sed -n '1,11p' "$here/lossy.txt"
fi

./wrong_input.py --rim "$RIM" --vehicles $vehicles --train 20 --base 33000 --trained "$here/campaign" --require > "$here/wrong.txt" 2>&1
check "wrong rate, unit and column are named, never healthy" 0 $?
grep -e ' WRONG ' "$here/wrong.txt"; tail -5 "$here/wrong.txt"

is_long || finish
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
