#!/bin/bash
# SPDX-License-Identifier: MIT
# rim-thesis merge: shards fold to one file, in any order to the same bytes; what does not belong is refused.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1

part() { # part NAME SEED UNIT...
  local name=$1 seed=$2 units=; shift 2
  for u in "$@"; do units="$units,{\"unit\":$u,\"value\":0.$((u + 1))}"; done
  echo "{\"schema\":\"rim-campaign/1\",\"version\":\"0\",\"kind\":\"k\",\"config\":{\"seed\":$seed},\"total\":4,\"units\":[${units#,}]}" > "$name"
}
part a.json 1 0 2; part b.json 1 1 3; part other.json 2 1 3

out=$("$RIM_THESIS" merge a.json b.json --out ab.json); check "merge" 0 $?
contains "merge counts" "$out" "4 of 4 units"
"$RIM_THESIS" merge b.json a.json --out ba.json > /dev/null; check "merge in another order" 0 $?
cmp -s ab.json ba.json; check "the order does not matter" 0 $?
out=$("$RIM_THESIS" merge a.json --out half.json); check "an incomplete merge" 0 $?
contains "missing shards are told" "$out" "shards are missing"
err=$("$RIM_THESIS" merge a.json other.json --out no.json 2>&1); check "another campaign" 3 $?
contains "another campaign is named" "$err" "other.json: of another campaign than a.json"
[ ! -e no.json ]; check "nothing is left behind" 0 $?
err=$("$RIM_THESIS" merge a.json missing.json --out no.json 2>&1); check "a missing file" 3 $?
contains "a missing file is named" "$err" "missing.json"
"$RIM_THESIS" merge --out no.json 2>/dev/null; check "no files" 2 $?
finish
