#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis experiment fig5.10 and figB.6: shards merge to the bytes of the whole; tables, pictures, wrong
# use. Seeds 91000 on.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/figure.inc"
cd "$here" || exit 1

figure fig5.10 "--runs 2 --shots 12" 91000-91001
contains "what was asked" "$out" "asked"
contains "three goalies, three policies" "$out" "overshoot *RIM+GP-UCB"
for other in "--by-volume --shape ellipsoid" --by-volume "--shape ellipsoid"; do
  "$RIM_THESIS" experiment fig5.10 --runs 2 --shots 30 --seed 91000 $other
done | grep "^region .* RIM" | sort -u > others.txt
check "fig5.10: other regions, other shots of both policies" 6 "$(wc -l < others.txt)"
"$RIM_THESIS" experiment fig5.10 --shape cube 2> /dev/null; check "fig5.10: no such shape" 2 $?
cp merged.json goalies.json
figure figB.6 "--runs 2 --kicks 24" 91000-91001
contains "what was asked" "$out" "asked"
contains "three defences" "$out" "^combined"
contains "learning from nothing is judged" "$out" "^time *shared, flat prior .*at most 0.30: "
contains "the prior alone is shown" "$out" "^time *own prior alone"
contains "Algorithm 9 is shown" "$out" "^time *bank, flat prior"
"$RIM_THESIS" experiment figB.6 --from goalies.json > /dev/null 2>&1; check "another figure's file" 3 $?
finish
