#!/bin/sh
# SPDX-License-Identifier: MIT
# style.sh: exit 1 when a source file breaks a countable rule of the house: lines of at most 100
# columns, files of at most 800 lines, functions of less than 60 lines.
cd "$(dirname "$0")/.." || exit 1
find lib firmware host_tools tests -name '*.[ch]' -o -name '*.[ch]pp' | LC_ALL=C sort | xargs awk '
  function bad(text) { printf "%s:%d: %s\n", FILENAME, FNR, text; failures++ }
  FNR == 1 { if (last > 800) { printf "%s: %d lines\n", previous, last; failures++ } start = 0 }
  { previous = FILENAME; last = FNR }
  length($0) > 100 { bad("line of " length($0) " columns") }
  /^[A-Za-z].*[)] *(const)? *(override)? *[{]$/ || /^[{]$/ || /^    .*[)] [{]$/ && !start { if (!start) start = FNR }
  /^[}]/ { if (start && FNR - start > 60) bad("function of " FNR - start " lines"); start = 0 }
  END { if (last > 800) { printf "%s: %d lines\n", previous, last; failures++ } exit failures > 0 }'
