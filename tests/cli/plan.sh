#!/bin/bash
# SPDX-License-Identifier: MIT
# rim plan: learns where rewards are, never takes what is forbidden, survives bad lines, and answers
# each state before the next is written.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
grid="--state 0:1 --action -1:1:21"

"$RIM" plan --help > help.txt; check "help" 0 $?
grep -q "^  printf" help.txt; check "help ends in an example" 0 $?
out=$(printf 'state,0.4\nreward,0.9\nstate,0.5\n' | "$RIM" plan $grid 2>err.txt); check "the example" 0 $?
check "two answers" 2 "$(printf '%s\n' "$out" | wc -l)"
contains "counts on stderr" "$(cat err.txt)" "2 answers, 1 rewards, 0 states without an allowed action, 0 lines refused"

# As a process: the answer comes before stdin ends. A planner of 60 turns whose reward is best at 0.5.
for policy in gp rim rim+gp; do
  coproc PLAN { "$RIM" plan $grid --policy $policy --noise-sd 0.05 --signal-sd 0.5 2>/dev/null; }
  pid=$PLAN_PID
  sum=0
  for t in $(seq 60); do
    printf '{"id":%d,"state":[0.%d]}\n' "$t" $((t % 10)) >&"${PLAN[1]}"
    read -r -t 20 answer <&"${PLAN[0]}" || { bad "$policy: no answer"; break; }
    i=$(printf '%s' "$answer" | sed 's/.*"action":\([0-9]*\).*/\1/')
    off=$((i - 15)); [ $off -lt 0 ] && off=$((-off)) # step 15 of 0..20 is 0.5
    printf '{"id":%d,"reward":%s}\n' "$t" "$(printf '0.%02d' $((off < 9 ? 99 - 11 * off : 0)))" >&"${PLAN[1]}"
    [ "$t" -gt 40 ] && sum=$((sum + off))
  done
  exec {PLAN[1]}>&-
  wait "$pid"; check "$policy ends" 0 $?
  if [ "$policy" != rim ]; then
    [ "$sum" -le 60 ]; check "$policy: last 20 choices within 3 steps of the best on average ($sum)" 0 $?
  fi
done

# What is forbidden is not chosen; where all is, the answer says so.
out=$(printf '{"actions":[[0.1],[0.2],[0.3]],"nominal":[0,0,9],"allowed":[true,true,false]}\n{"id":"x","actions":[[0.1],[0.2]],"allowed":[0,0]}\n' |
  "$RIM" plan --features 1 --policy gp 2>/dev/null); check "allowed" 0 $?
contains "not the forbidden one" "$(printf '%s\n' "$out" | sed -n 1p)" '"action":[01],'
contains "none allowed" "$(printf '%s\n' "$out" | sed -n 2p)" '{"id":"x","action":null'

out=$(printf '{"x":[0.2],"plan":2,"reward":5}\n{"state":[0.2]}\n' | "$RIM" plan --policy bank --plans 3 --state 0:1 --beta 0 2>/dev/null)
contains "bank: experience from before" "$out" '"action":2,'

# No flags are not the leave to do anything.
for key in allowed nominal var; do
  out=$(printf '{"id":1,"state":[0.4],"%s":[]}\n' $key | "$RIM" plan --state 0:1 --action -1:1:3 2>err.txt); check "$key: an empty list" 3 $?
  check "$key: no action" "" "$out"
  contains "$key: said" "$(cat err.txt)" "stdin:row 1: $key: an empty list"
done

# Bad lines: told with their number, counted, passed over.
printf 'state,0.4\nstate,zero\n{"state":[1,2]}\n{"reward":}\nreward,nan\nreward,1\nreward,1\n[]\nstate,0.1\r\n' |
  "$RIM" plan $grid > out.txt 2> err.txt; check "bad lines" 0 $?
check "good lines answered" 2 "$(wc -l < out.txt)"
contains "number of the line" "$(cat err.txt)" "stdin:row 2: 'zero' is not a number"
contains "wrong count" "$(cat err.txt)" "stdin:row 3: state: 2 numbers instead of 1"
contains "not JSON" "$(cat err.txt)" "stdin:row 4: not a JSON object"
contains "counted" "$(cat err.txt)" "lines refused"
printf 'rubbish\n' | "$RIM" plan $grid > /dev/null 2> err.txt; check "nothing usable" 3 $?
"$RIM" plan $grid < /dev/null > /dev/null 2>&1; check "nothing at all" 0 $?
noise 54 4096 | "$RIM" plan $grid > /dev/null 2>&1; check "noise" 3 $?

# How a region's extent is represented changes what is expected beside it.
for x in 1 2 3 4 5 6 7 8 9; do
  for y in -8 -6 -4 -2 0 2 4 6 8; do
    [ $x -ge 3 ] && [ $x -le 7 ] && [ $y -ge -4 ] && [ $y -le 4 ]; r=$((1 - $?))
    printf '{"x":[0.%d,%d.0e-1],"reward":%d}\n' $x $y $r
  done
done > known.txt
: > seen.txt
for extent in "volume --shape ellipsoid" "sampled --shape ellipsoid" "sampled --shape box"; do
  { cat known.txt; printf '{"state":[0.75]}\n'; } |
    "$RIM" plan $grid --policy rim --beta 0 --extent $extent > a.txt 2>/dev/null; check "$extent" 0 $?
  contains "$extent: an expectation" "$(cat a.txt)" '"mean":'
  cat a.txt >> seen.txt
done
check "three different expectations" 3 "$(sort -u seen.txt | wc -l)"
"$RIM" plan $grid --extent guessed < /dev/null 2>/dev/null; check "no such extent" 2 $?
"$RIM" plan $grid --shape cube < /dev/null 2>/dev/null; check "no such shape" 2 $?

"$RIM" plan --state 1:0 --action 0:1:3 < /dev/null 2>/dev/null; check "axis upside down" 2 $?
"$RIM" plan --state 0:1 --action 0:1 < /dev/null 2>/dev/null; check "axis without count" 2 $?
"$RIM" plan --policy bank < /dev/null 2>/dev/null; check "bank without plans" 2 $?
"$RIM" plan --policy wrong < /dev/null 2>/dev/null; check "no such policy" 2 $?
"$RIM" plan $grid --power 5 < /dev/null 2>/dev/null; check "a power above 4" 2 $?
"$RIM" plan $grid --gain -1 < /dev/null 2>/dev/null; check "a gain below 0" 2 $?
printf 'state,0.4\n' | "$RIM" plan $grid --gain 5 --unseen-sd 0.5 --smooth-sd 0.1 --beta 1 --signal-sd 1 > a.txt 2>/dev/null
contains "a region not seen yet widens the choice" "$(cat a.txt)" '"sd":1.118'
"$RIM" plan $grid --points 4 < /dev/null 2>/dev/null; check "too few points" 2 $?
for lengths in 0.1 "0.1 0.1 0.1" "0.1 0" "-0.1 0.1"; do
  "$RIM" plan $grid --length $lengths < /dev/null 2> err.txt; check "lengths $lengths" 2 $?
  contains "lengths $lengths: it says so" "$(cat err.txt)" "--length: "
done
"$RIM" plan $grid --length 0.1 0.1 < /dev/null 2>/dev/null; check "a length per number" 0 $?
"$RIM" plan --policy bank --plans 2 --state 0:1 --length 0.1 < /dev/null 2>/dev/null; check "a bank's length" 0 $?
for option in signal noise smooth unseen; do
  "$RIM" plan $grid --$option-sd -0.1 < /dev/null 2>/dev/null; check "a $option sd below 0" 2 $?
done
"$RIM" plan $grid --seconds -5 < /dev/null 2>/dev/null; check "seconds below 0" 2 $?

# The same input, the same bytes.
seq 40 | awk '{printf "state,%.2f\nreward,%.2f\n", $1 / 41, ($1 * 7 % 11) / 11}' > in.csv
"$RIM" plan $grid < in.csv > a.txt 2>/dev/null; "$RIM" plan $grid < in.csv > b.txt 2>/dev/null
cmp -s a.txt b.txt; check "deterministic" 0 $?
finish
