#!/bin/bash
# SPDX-License-Identifier: MIT
# What rimd does when a bit of its memory, or of its image in memory, turns over: tests/firmware/damage_test.py.
# Mostly waits.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
[ -x "$BUILD/rimd" ] || { bad "no $BUILD/rimd"; finish; }
cd "$here" || exit 1
skip_under_sanitizers "their shadow memory is many gigabytes, all of which the test would search"
toy_model toy.rim
toy long.csv 102 3000 ''
python3 "$root/tests/firmware/damage_test.py" "$BUILD/rimd" "$root/lib/wire" . > damage.txt 2>&1
sed '$d' damage.txt
read -r p f < <(awk 'END {if (match($0, /^[0-9]+ passed, [0-9]+ failed/)) print $1+0, $3+0; else print 0, 1}' damage.txt)
[ "$p" = 0 ] && cat damage.txt
passed=$((passed + p)) failed=$((failed + f))
finish
