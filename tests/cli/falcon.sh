#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis experiment falcon: the measured landings, where they are on this machine; said clearly where not.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
out=$("$RIM_THESIS" experiment falcon --data "$here/nowhere" 2>&1); check "no data" 3 $?
contains "no data: said" "$out" "nowhere: no such folder"
"$RIM_THESIS" experiment falcon 2> /dev/null; check "data not named" 2 $?
skip_under_sanitizers "the rest trains a model for each flight"
measured=${RIM_MEASURED:-$root/../shared/measured}/falcon9
[ -d "$measured" ] || skip "no $measured"
half() { "$RIM_THESIS" experiment falcon --data "$measured" --exclude crs12,crs13,bulgariasat1,formosat5; }
out=$(half); check "falcon" 0 $?
contains "half of the flights" "$out" "promised: at most .* (3 training flights"
check "the same twice, on one thread or more" "$out" "$(RIM_THREADS=1 half)"
flights=4
if is_long; then
  flights=8
  out=$("$RIM_THESIS" experiment falcon --data "$measured"); check "all eight" 0 $?
  contains "the promise" "$out" "promised: at most 12.5 % (7 training flights"
fi
contains "every flight" "$out" "iridium3 .*nrol76 .*koreasat5a"
flown=$(printf '%s\n' "$out" | awk '/^as flown/{print $(NF-2); exit}')
[ "$flown" -le $((flights / 4)) ]; check "at most a quarter of $flights flights raises a false alarm ($flown)" 0 $?
# Of the flights whose altitude is shown to tenths of a km (the last table), more than as flown.
in_last_table() { printf '%s\n' "$out" | awk -v row="$1" 'index($0, row) == 1 {n = $(NF-2)} END {print n}'; }
as_flown=$(in_last_table "as flown")
for fault in "speed +20 %" "altitude stuck 10 s"; do
  is_long || continue # half of the flights teach too little
  found=$(in_last_table "$fault")
  [ "$found" -gt "$as_flown" ]; check "$fault is seen in some flight ($found, as flown $as_flown)" 0 $?
done
finish
