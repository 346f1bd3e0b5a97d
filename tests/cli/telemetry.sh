#!/bin/bash
# SPDX-License-Identifier: MIT
# Real telemetry beside published figures: all of SKAB, and a few files of SMAP and MSL, which tests/measured/telemetry.py scores whole.
# Skipped, saying so, where ../shared/measured is absent.
. "$(dirname "$0")/check.inc"
measured=${RIM_MEASURED:-$root/../shared/measured}
[ -d "$measured/skab" ] && [ -d "$measured/smap_msl" ] || skip "no $measured/skab and $measured/smap_msl"
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
score="$root/tests/measured/telemetry.py --rim $RIM --from $measured --list"

# A detector that marks every row has a FAR of 100 %.
python3 $score --set skab --require skab_f1=.78,skab_far=30 > "$here/skab.txt"
check "SKAB: F1 and FAR" 0 $?
cat "$here/skab.txt"

python3 $score --set smap_msl --only A-4,D-14,M-6,R-1,S-2,T-5,T-9 --require smap_msl_precision=.7,smap_msl_recall=.6 > "$here/ranges.txt"
check "SMAP and MSL: precision and recall" 0 $?
cat "$here/ranges.txt"

# The scorer itself: what is not kept is told.
python3 $score --set smap_msl --only S-2 --require smap_msl_recall=1.1,nothing=1 > "$here/missed.txt"; check "a figure that is missed" 1 $?
contains "which one" "$(cat "$here/missed.txt")" "missed: smap_msl_recall is"
contains "which was not measured" "$(cat "$here/missed.txt")" "missed: nothing was not measured"
python3 $score --set nonsense > /dev/null 2>&1; check "an unknown set" 2 $?
finish
