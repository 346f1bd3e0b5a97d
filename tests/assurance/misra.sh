#!/bin/bash
# SPDX-License-Identifier: MIT
# misra.sh FILE: MISRA C:2012 rules that lib/src breaks, by cppcheck's addon, counted; exit 1 for one that FILE does not
# list as a deviation (rows '| rule 15.5 | reason |'), and for a deviation that nothing needs any more.
cd "$(dirname "$0")/../.." || exit 1
found=$(cppcheck --quiet --addon=misra --std=c11 --inline-suppr -Ilib/include -Ilib/src lib/src 2>&1 |
  grep -o 'misra-c2012-[0-9.]*' | sed 's/misra-c2012-//' | sort -V | uniq -c)
[ -n "$found" ] || { echo "misra: cppcheck's addon said nothing: is it there?"; exit 1; }
allowed=$(sed -n 's/^| rule \([0-9.]*\) |.*/\1/p' "$1")
status=0
while read -r count rule; do
  if printf '%s\n' "$allowed" | grep -qxF "$rule"; then mark=deviation; else mark='NOT ALLOWED'; status=1; fi
  printf 'rule %-6s %6s  %s\n' "$rule" "$count" "$mark"
done <<< "$found"
for rule in $allowed; do
  printf '%s\n' "$found" | awk -v r="$rule" '$2 == r {n = 1} END {exit !n}' || { echo "rule $rule: no deviation is needed any more"; status=1; }
done
exit $status
