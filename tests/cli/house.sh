#!/bin/bash
# SPDX-License-Identifier: MIT
# The house: rooms include only what their table allows, requirements name code and tests that are
# there, and no symbol is public that no header declares. Each check is also shown what breaks its
# rule.
. "$(dirname "$0")/check.inc"
python3 "$root/tests/rooms.py" > "$here/said" 2>&1; check "rooms include what rooms.txt allows" 0 $? || tail -20 "$here/said"
contains "the graph is printed" "$(cat "$here/said")" "monitor .*search("

mkdir "$here/tree" && (cd "$root" && tar -cf - lib firmware host_tools tests/rooms.py) | tar -C "$here/tree" -xf -
echo '#include "monitor/blocks.h"' >> "$here/tree/lib/src/base/crc.c"
err=$(python3 "$here/tree/tests/rooms.py" lib 2>&1 > /dev/null); check "an arrow upwards fails" 1 $?
contains "and is named" "$err" "lib/src/base/crc.c:[0-9]*: room base may not include room monitor"
sed -i 's/^base:.*/base: monitor/' "$here/tree/lib/rooms.txt"
err=$(python3 "$here/tree/tests/rooms.py" lib 2>&1 > /dev/null); check "a cycle in the table fails" 1 $?
contains "and is named" "$err" "form a cycle: .*base.*monitor"

# The mutants that a reader found to be the same program: each names a line that is still in its source.
none() { (cd "$root" && python3 tests/assurance/mutate.py "$BUILD" --number 0 --equivalent "$1" 2>&1); }
contains "every equivalent mutant is of a line in the source" "$(none tests/assurance/equivalent.txt)" "no place to try"
echo 'lib/src/base/crc.c | no such line; | no; | it is gone' > "$here/gone.txt"
contains "one that is not is named" "$(none "$here/gone.txt")" "gone.txt:1: .*a line that is in the source"

# Requirements: each names code and a test that are there.
trace() { (cd "$root" && python3 tests/assurance/trace.py "$1" 2>&1); }
trace firmware/ASSURANCE.md > "$here/said"; check "every requirement names code and a test" 0 $? || cat "$here/said"
sed 's/c:begins_late`/c:begins_never`/' "$root/firmware/ASSURANCE.md" > "$here/gone.md"
contains "a name that is gone is said" "$(trace "$here/gone.md")" "no 'begins_never'"

if [ -n "$SANITIZE" ]; then skipped=2; finish; fi
"$root/lib/check_symbols.sh" nm "$BUILD/librim.a" names; check "names begin with rim_ or rimi_" 0 $?
python3 "$root/lib/api.py" nm "$BUILD/librim.a" > "$here/said" 2>&1; check "every public symbol is declared in a public header" 0 $? || tail -5 "$here/said"
echo 'int rim_hidden(void); int rim_hidden(void) { return 1; }' > "$here/hidden.c"
cp "$BUILD/librim.a" "$here/more.a" && gcc -c "$here/hidden.c" -o "$here/hidden.o" && ar r "$here/more.a" "$here/hidden.o" 2> /dev/null
err=$(python3 "$root/lib/api.py" nm "$here/more.a" 2>&1 > /dev/null); check "one that is not fails" 1 $?
contains "and is named" "$err" "rim_hidden is public, and no header declares it"
finish
