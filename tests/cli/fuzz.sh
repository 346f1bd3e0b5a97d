#!/bin/bash
# SPDX-License-Identifier: MIT
# A short search of every decoder by libFuzzer, from the corpus in tests/fuzz; `make fuzz` searches for longer. Where
# there is no clang, tests/firmware/test_fuzz.c has done what can be done without.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
skip_under_sanitizers "the fuzzer is built with them in any case"
echo 'int LLVMFuzzerTestOneInput(const char *d, unsigned long n) {return n > 1 ? d[0] * 0 : 0;}' > tiny.c
if ! clang -fsanitize=fuzzer,address tiny.c -o tiny 2> /dev/null; then
  skip "no clang with libFuzzer (make fuzz installs it)"
fi
make -s -C "$root" BUILD="${BUILD#"$root"/}" "${BUILD#"$root"/}/fuzz/fuzz" > log 2>&1; check "the fuzzer builds" 0 $? || cat log
cp -r "$root/tests/fuzz/corpus" corpus
echo "seed 1"
"$BUILD/fuzz/fuzz" -runs=60000 -seed=1 -max_len=8192 -timeout=20 -close_fd_mask=2 corpus > said 2>&1
check "60000 inputs" 0 $?
contains "it ran" "$(tail -n 3 said)" "^Done 60000 runs"
[ "$failed" -eq 0 ] || { tail -n 40 said; mkdir -p "$BUILD/fuzz"; cp crash-* timeout-* "$BUILD/fuzz/" 2> /dev/null; }
finish
