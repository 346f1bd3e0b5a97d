#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis experiment table3.1, fig4.5, fig4.10, fig4.11, table6.1: shards merge to the bytes of the
# whole; tables, pictures, wrong use. Seeds 91000 on.
. "$(dirname "$0")/check.inc"
skip_under_sanitizers "small campaigns take an hour there; tests/host/test_experiment_*, test_fig3_3, test_keepaway and test_plan run there"
cd "$here" || exit 1

# figure NAME SIZES [parts]: of the slowest in parts alone; `make test-long` compares them with the whole
figure() {
  name=$1 small="$2 --seed 91000" parts=${3:-}
  is_long && parts=
  if [ -z "$parts" ]; then
    out=$("$RIM_THESIS" experiment "$name" $small --out whole.json --plot whole.svg); check "$name: the whole" 0 $?
  fi
  "$RIM_THESIS" experiment "$name" $small --shard 1/2 --out 1.json > /dev/null; check "$name: a shard" 0 $?
  RIM_THREADS=1 "$RIM_THESIS" experiment "$name" $small --shard 2/2 --out 2.json > /dev/null
  check "$name: the other, one thread" 0 $?
  "$RIM_THESIS" merge 2.json 1.json --out merged.json > /dev/null; check "$name: merged" 0 $?
  if [ -z "$parts" ]; then
    cmp -s whole.json merged.json; check "$name: the same bytes" 0 $?
  else
    out=$("$RIM_THESIS" experiment "$name" --from merged.json --plot whole.svg); check "$name: the whole" 0 $?
  fi
  contains "$name: seeds are printed" "$out" "seeds 91000-"
  contains "$name: beside the thesis" "$out" "thesis\|table 6.1"
  grep -q '<svg' whole.svg; check "$name: a picture" 0 $?
  "$RIM_THESIS" experiment "$name" --from merged.json > again.txt; check "$name: from a file" 0 $?
  "$RIM_THESIS" experiment "$name" --from 1.json > /dev/null 2>&1; check "$name: an incomplete file" 3 $?
  "$RIM_THESIS" experiment "$name" --shard 1/2 2> /dev/null; check "$name: a shard without --out" 2 $?
  "$RIM_THESIS" experiment "$name" $small --plot x.pdf 2> /dev/null; check "$name: no such picture" 2 $?
  "$RIM_THESIS" experiment "$name" --runs 0 2> /dev/null; check "$name: no runs" 2 $?
}

figure table3.1 "--runs 1 --nominal 1 --calibration 2 --no-thesis" parts
contains "four failures" "$out" "^left turn"
[ "$(cat again.txt)" = "$out" ]; check "the same table from a file" 0 $?
RIM_DATA=$here "$RIM_THESIS" experiment table3.1 --runs 1 > /dev/null 2>&1; check "no world" 3 $?
figure fig4.5 "--runs 2 --dims 2,5"
contains "five searches" "$out" "No FS"
cp merged.json golf.json
figure fig4.11 "--runs 2 --dims 7"
contains "ours" "$out" "at the end"
"$RIM_THESIS" experiment fig4.11 --runs 1 --dims 9 --seed 91000 2> /dev/null; check "no such context" 2 $?
"$RIM_THESIS" experiment fig4.11 --from golf.json > /dev/null 2>&1; check "another figure's file" 3 $?
"$RIM_THESIS" experiment fig4.10 --runs 1 --dims 7,15 --seed 91000 --no-searches > ours.txt
check "ours alone" 0 $?
contains "against the fewest dimensions" "$(cat ours.txt)" "^ *15 "
figure table6.1 "--runs 1 --calibration 1" parts
contains "seven others" "$out" "Fast Subset Scan"
finish
