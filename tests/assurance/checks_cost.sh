#!/bin/sh
# SPDX-License-Identifier: MIT
# checks_cost.sh FLEET UNGUARDED RECORDING...: the share of a step's time that the checks of memory
# take. Each recording is flown ROUNDS times by the program with the checks and the one without, in
# turn; of each the best is taken, as whatever else the computer does only makes a flight slower.
# Fails where the two programs do not raise the alarm at the same row.
set -eu
fleet=$1 unguarded=$2
shift 2
for recording in "$@"; do
  round=0
  while [ "$round" -lt "${ROUNDS:-7}" ]; do
    "$fleet" "$recording" 1 | sed 's/^/with /'
    "$unguarded" "$recording" 1 | sed 's/^/without /'
    round=$((round + 1))
  done | awk -v name="$(basename "$recording" .rec)" '
    { for (i = 2; i <= NF; ++i) {
        if ($i == "rows" && $(i + 1) == "a" && $(i - 1) > best[$1]) best[$1] = $(i - 1)
        if ($i == "row") alarm[$1] = $(i + 1)
      } }
    END {
      if (alarm["with"] != alarm["without"] || !(best["with"] > 0)) {
        print "checks_cost: " name ": the flights differ" > "/dev/stderr"
        exit 1
      }
      printf "%-16s %6.2f us a step, %6.2f without the checks, which take %4.1f %% of it\n", name,
        1e6 / best["with"], 1e6 / best["without"], 100 * (1 - best["with"] / best["without"])
    }'
done
