#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis experiment golf: shards merge to the bytes of the whole; the table; wrong use.
. "$(dirname "$0")/check.inc"
skip_under_sanitizers "small campaigns take an hour there; tests/host/test_experiment_*, test_fig3_3, test_keepaway and test_plan run there"
cd "$here" || exit 1
small="--dims 2,6 --runs 4 --nominal 6 --calibration 20 --seed 91000 --search flight"

out=$("$RIM_THESIS" experiment golf $small --out whole.json); check "the whole" 0 $?
contains "seeds are printed" "$out" "seeds 91000-91019 calibration"
contains "a row for each number of features" "$out" "^ *6 "
"$RIM_THESIS" experiment golf $small --shard 1/3 --out 1.json > /dev/null; check "a shard" 0 $?
"$RIM_THESIS" experiment golf $small --shard 2/3 --out 2.json > /dev/null; check "another" 0 $?
"$RIM_THESIS" experiment golf $small --shard 3/3 --out 3.json > /dev/null; check "the last" 0 $?
"$RIM_THESIS" merge 3.json 1.json 2.json --out merged.json > /dev/null; check "merged" 0 $?
cmp -s whole.json merged.json; check "the same bytes" 0 $?
out=$("$RIM_THESIS" experiment golf --from merged.json); check "from a file" 0 $?
contains "the table from a file" "$out" "right pair"
err=$("$RIM_THESIS" experiment golf --from 1.json 2>&1); check "an incomplete file" 3 $?
contains "says so" "$err" "shards are missing"
"$RIM_THESIS" experiment golf --shard 1/2 2> /dev/null; check "a shard without --out" 2 $?
"$RIM_THESIS" experiment golf --search fast 2> /dev/null; check "an unknown search" 2 $?
"$RIM_THESIS" experiment golf --dims 1 2> /dev/null; check "too few features" 2 $?
"$RIM_THESIS" experiment 2> /dev/null; check "no experiment named" 2 $?
finish
