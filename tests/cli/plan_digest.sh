#!/bin/bash
# SPDX-License-Identifier: MIT
# Whole runs of every planning policy: the same bits from gcc and clang at -O0, -O2 and -O3, and on
# aarch64 under qemu-user, where these are installed. Seeds 71 and 72.
. "$(dirname "$0")/check.inc"
tests=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$tests/../.." && pwd)
skip_under_sanitizers "it builds by itself what it tests, without them"
cd "$here" || exit 1
sources=
for module in plan/bandit search/cem base/crc base/ellipsoid plan/extent plan/gp base/real base/region base/rng base/status; do
  sources="$sources $root/lib/src/$module.c"
done

# build NAME COMPILER FLAG...
build() {
  name=$1; shift
  "$@" -std=c11 -ffp-contract=off -fno-math-errno -I"$root/lib/include" -I"$root/lib/src" \
    "$tests/plan_run.c" $sources -o "$name" > make.log 2>&1 || { bad "$name: $(tail -5 make.log)"; return 1; }
}

build plain gcc -O2 -fno-tree-slp-vectorize && digest=$(./plain)
contains "a digest" "$digest" "^digest [0-9a-f]\{16\}$"
! [ "$(./plain other)" = "$digest" ]; check "another seed, another digest" 0 $?
for level in -O0 -O3; do
  build "gcc$level" gcc $level -fno-tree-slp-vectorize && check "gcc $level" "$digest" "$("./gcc$level")"
done
if command -v clang > /dev/null; then
  for level in -O0 -O3; do build "clang$level" clang $level && check "clang $level" "$digest" "$("./clang$level")"; done
else
  echo "no clang: not compared"; skipped=$((skipped + 1))
fi
if command -v aarch64-linux-gnu-gcc > /dev/null && command -v qemu-aarch64 > /dev/null; then
  build arm aarch64-linux-gnu-gcc -O2 -fno-tree-slp-vectorize -static && check "aarch64" "$digest" "$(qemu-aarch64 ./arm)"
else
  echo "no aarch64-linux-gnu-gcc or qemu-aarch64: not compared"; skipped=$((skipped + 1))
fi
finish
