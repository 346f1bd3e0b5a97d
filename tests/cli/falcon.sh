#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis experiment falcon: the measured landings, where they are on this machine; said clearly where not.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
out=$("$RIM_THESIS" experiment falcon --data "$here/nowhere"); check "no data" 3 $?
contains "no data: said" "$out" "skipped: no folder .*nowhere"
out=$("$RIM_THESIS" experiment falcon); check "falcon" 0 $?
if printf '%s\n' "$out" | grep -q '^skipped'; then skipped=1; finish; fi
contains "every flight" "$out" "iridium3 .*nrol76 .*koreasat5a"
contains "the promise" "$out" "promised: at most 12.5 % (7 training flights"
flown=$(printf '%s\n' "$out" | awk '/^as flown/{print $(NF-2); exit}')
[ "$flown" -le 2 ]; check "at most 2 of 8 flights raise a false alarm ($flown)" 0 $?
found=$(printf '%s\n' "$out" | awk '/^altitude \+10 km/{print $(NF-2); exit}')
[ "$found" -ge 1 ]; check "10 km of altitude are seen in some flight ($found of 8)" 0 $?
check "the same twice" "$out" "$("$RIM_THESIS" experiment falcon)"
finish
