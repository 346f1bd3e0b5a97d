#!/bin/bash
# SPDX-License-Identifier: MIT
# A small campaign on vehicles that nobody tuned for: a tank and an engine, one run of every fault, and wrong input on the
# engine; what grades them is tested first. The two of ../shared/vehicles too, where they are. Base of the seeds: 33000.
. "$(dirname "$0")/check.inc"
shared=${RIM_VEHICLES:-$root/../shared/vehicles}
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
cd "$root/tests/vehicles" || exit 1

python3 test_vehicles.py > "$here/graders.txt" 2>&1; check "the graders themselves" 0 $?
tail -4 "$here/graders.txt"

# Shares of 26 faulty runs; by chance a core that is as good as asked for misses none of these.
./grade.py --rim "$RIM" --vehicles tank,engine --train 20 --per 1 --healthy 4 --base 33000 --quiet \
  --require found=.9,named=.9,sign=.85,size=.5,onset=.8,region=.5,f1=.9,false=.26,wrong=.08,early=.16,errors=0 > "$here/grade.txt" 2>&1
check "tank and engine are judged rightly" 0 $?
sed -n '/^all/,$p' "$here/grade.txt"
# A pump that draws air fills the tank less, and the level, which keeps that, shows it more clearly than the flow does.
grep -q '^ *cavitation .* named 1,' "$here/grade.txt"; check "what a level keeps is not taken for the cause" 0 $?

./wrong_input.py --rim "$RIM" --vehicles engine --train 12 --base 33000 --require > "$here/wrong.txt" 2>&1
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
