#!/bin/sh
# SPDX-License-Identifier: MIT
# instructions.sh BUILD [STEPS [hmm]]: instructions of a step of the interference detector in nominal
# driving, and of a choice of the planner ('rim bench --choice'), counted by valgrind's callgrind on
# this machine's build; exit 1 above what is asked of the HMM. hmm: of the detector alone.
build=$1 steps=${2:-20000} asked=2000
program=$build/tests/lib/test_interference
command -v valgrind > /dev/null || { echo "instructions: valgrind is not installed" >&2; exit 2; }
# Between entering and leaving any of these functions, everything below them included.
count() {
  toggles=
  for f in "$@"; do toggles="$toggles --toggle-collect=$f"; done
  valgrind --tool=callgrind --callgrind-out-file=/dev/null --collect-atstart=no $toggles \
    "$program" steps "$steps" 2>&1 |
    awk -v steps="$steps" '/Collected/ {printf "%.0f", $NF / steps; found = 1} END {exit !found}'
}
hmm=$(count rimi_hmm_step rimi_hmm_ln_odds) && whole=$(count rimi_interference_step) || exit 2
echo "instructions a step, mean of $steps: HMM (forward algorithm and its odds) $hmm, asked below $asked;" \
  "with regressions, emissions and two CUSUMs $whole"
if [ -x "$build/rim" ] && [ "${3:-}" != hmm ]; then
  # One choice in each of the four settings.
  valgrind --tool=callgrind --callgrind-out-file=/dev/null --collect-atstart=no \
    --toggle-collect=rim_bandit_choose "$build/rim" bench --choice 1 2>&1 |
    awk '/Collected/ {printf "instructions a choice among 200 actions with 200 observations, mean of 4 settings: %.1f million\n", $NF / 4e6; found = 1} END {exit !found}' || exit 2
fi
[ "$hmm" -lt "$asked" ]
