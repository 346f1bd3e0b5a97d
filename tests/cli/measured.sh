#!/bin/bash
# SPDX-License-Identifier: MIT
# rim diagnose on what was measured: Falcon 9 descents, each left out in turn. `make bench` holds small
# robots (measured_mrclam) to their limits too, which takes longer.
# Skipped, saying so, where ../shared/measured is absent. Random numbers: seed 1.
. "$(dirname "$0")/check.inc"
measured=${RIM_MEASURED:-$root/../shared/measured}
[ -d "$measured/falcon9" ] || skip "no $measured/falcon9"
data=$root/data
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
cd "$here" || exit 1
# below WHAT VALUE BOUND
below() {
  echo "$1: $2 (at most $3)"
  if awk -v a="$2" -v b="$3" 'BEGIN {exit !(a != "" && a + 0 <= b + 0)}'; then ok; else bad "$1: '$2' is above $3"; fi
}

# the figures of issue 3: .16 at 1 s and .08 at 10 s on every flight
"$RIM_THESIS" experiment measured_falcon --data "$measured/falcon9" > falcon.txt 2> err.txt; check "falcon" 0 $?
cat falcon.txt
flights=$(awk '/^-----/ {on = 1; next} on && NF == 0 {exit} on {print $1}' falcon.txt)
[ "$(echo "$flights" | wc -l)" -ge 4 ]; check "falcon: flights" 0 $?
for flight in $flights; do
  below "$flight, 1 s" "$(awk -v f="$flight" '$1 == f {print $3; exit}' falcon.txt)" 0.16
  below "$flight, 10 s" "$(awk -v f="$flight" '$1 == f {print $11; exit}' falcon.txt)" 0.08
  contains "$flight: drag comes first" "$(grep "^$flight: " falcon.txt)" "^$flight: quadratic_drag"
done

# the README's example: a curve over altitude must not take the drag's place, which two flights
# do not suffice to learn
"$RIM" diagnose --world falcon --schema "$data/diagnose_falcon9.toml" "$measured/falcon9/iridium3.csv" \
  "$measured/falcon9/crs12.csv" --holdout "$measured/falcon9/iridium8.csv" --horizon 10 --out readme > readme.txt 2> err.txt
check "the README's example" 1 $?
contains "README: drag" "$(grep '^1\.' readme.txt)" "Cause: quadratic drag"
below "README: iridium8, 1 s" "$(awk '$1 == "speed_mps" && $3 == "all" && $4 == "one" {print $8}' readme.txt)" 0.16
below "README: iridium8, 10 s" "$(awk '$1 == "speed_mps" && $3 == "all" && $4 == "10" {print $7}' readme.txt)" 0.08

finish
