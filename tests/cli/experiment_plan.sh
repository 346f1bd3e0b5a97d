#!/bin/bash
# rim experiment fig5.10 and figB.6: shards merge to the bytes of the whole; tables, pictures, wrong
# use. Seeds 91000 on.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1

# figure NAME SIZES
figure() {
  name=$1 small="$2 --seed 91000"
  out=$("$RIM" experiment "$name" $small --out whole.json --plot whole.svg)
  check "$name: the whole" 0 $?
  contains "$name: seeds are printed" "$out" "seeds 91000-91001"
  contains "$name: what was asked" "$out" "asked"
  grep -q '<svg' whole.svg; check "$name: a picture" 0 $?
  "$RIM" experiment "$name" $small --shard 1/2 --out 1.json > /dev/null; check "$name: a shard" 0 $?
  RIM_THREADS=1 "$RIM" experiment "$name" $small --shard 2/2 --out 2.json > /dev/null
  check "$name: the other, one thread" 0 $?
  "$RIM" merge 2.json 1.json --out merged.json > /dev/null; check "$name: merged" 0 $?
  cmp -s whole.json merged.json; check "$name: the same bytes" 0 $?
  "$RIM" experiment "$name" --from merged.json --plot two.png > two.txt; check "$name: from a file" 0 $?
  [ "$(cat two.txt)" = "$out" ]; check "$name: the same table from a file" 0 $?
  head -c 8 two.png | grep -q PNG; check "$name: PNG" 0 $?
  "$RIM" experiment "$name" --from 1.json > /dev/null 2>&1; check "$name: an incomplete file" 3 $?
  "$RIM" experiment "$name" --shard 1/2 2> /dev/null; check "$name: a shard without --out" 2 $?
  "$RIM" experiment "$name" $small --plot x.pdf 2> /dev/null; check "$name: no such picture" 2 $?
  "$RIM" experiment "$name" --runs 0 2> /dev/null; check "$name: no runs" 2 $?
  RIM_DATA=$here "$RIM" experiment "$name" $small > /dev/null 2>&1; check "$name: no world" 3 $?
}

figure fig5.10 "--runs 2 --shots 12"
contains "three goalies, three policies" "$out" "overshoot *RIM+GP-UCB"
cp merged.json goalies.json
figure figB.6 "--runs 2 --kicks 24"
contains "three defences" "$out" "^combined"
contains "the prior" "$out" "prior: own"
out=$("$RIM" experiment figB.6 --runs 2 --kicks 3 --seed 91000 --prior others); check "another prior" 0 $?
contains "is named" "$out" "prior: others"
"$RIM" experiment figB.6 --from goalies.json > /dev/null 2>&1; check "another figure's file" 3 $?
finish
