#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis experiment fig5.10 and figB.6: shards merge to the bytes of the whole; tables, pictures, wrong
# use. Seeds 91000 on.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/figure.inc"
skip_under_sanitizers "small campaigns take an hour there; tests/host/test_experiment_*, test_fig3_3, test_keepaway and test_plan run there"
cd "$here" || exit 1

# limits NAME COUNT: every line that has a limit is found in what was printed; so small, few limits are met.
limits() { check "$1: lines with a limit" "$2" "$("$root/tests/thesis/limits.py" "$1" two.txt | grep -c '; asked: ')"; }
figure fig5.10 "--runs 2 --shots 12" 91000-91001
limits fig5.10 "$(grep -q 'never gets there' two.txt && echo 3 || echo 4)"
contains "three goalies, three policies" "$out" "overshoot *RIM+GP-UCB"
for other in "--by-volume --shape ellipsoid" --by-volume "--shape ellipsoid"; do
  "$RIM_THESIS" experiment fig5.10 --runs 2 --shots 30 --seed 91000 $other
done | grep "^region .* RIM" | sort -u > others.txt
check "fig5.10: other regions, other shots of both policies" 6 "$(wc -l < others.txt)"
"$RIM_THESIS" experiment fig5.10 --shape cube 2> /dev/null; check "fig5.10: no such shape" 2 $?
cp merged.json goalies.json
figure figB.6 "--runs 2 --kicks 24" 91000-91001
limits figB.6 3
contains "three defences" "$out" "^combined"
contains "learning from nothing is shown" "$out" "^time *shared, flat prior "
contains "the prior alone is shown" "$out" "^time *own prior alone"
contains "Algorithm 9 is shown" "$out" "^time *bank, flat prior"
"$RIM_THESIS" experiment figB.6 --from goalies.json > /dev/null 2>&1; check "another figure's file" 3 $?
finish
