#!/bin/bash
# SPDX-License-Identifier: MIT
# budget.sh DIR 'RUN' (NAME FEATURES/OUTCOMES MEAN LARGEST RAM)...: runs DIR/mps2-an500/replay-NAME under QEMU, which
# counts its instructions, and holds what it prints to the budget: instructions of a step, mean and largest,
# in thousands, and the monitor's RAM in kB (1000 bytes); and the largest step to the static bound (monitor/work.h).
# Exit 1 when one is over.
dir=$1 run=$2; shift 2
status=0
printf '%-16s %-8s %6s %22s %22s %18s %10s\n' "Cortex-M7" "feat/out" rows "mean, at most" "largest, at most" "RAM, at most" \
  "bound"
while [ $# -ge 5 ]; do
  out=$dir/mps2-an500/$1.output
  # shellcheck disable=SC2086
  timeout 300 $run "$dir/mps2-an500/replay-$1" > "$out" 2>&1 < /dev/null
  value() { tr -d '\r' < "$out" | awk -v key="$1" '$1 == key {print $2}'; }
  mean=$(value step_instructions_mean) largest=$(value step_instructions_largest) ram=$(value monitor_bytes)
  bound=$(value step_instructions_bound)
  if [ -z "$mean" ] || [ "$(value alarm_records)" = 0 ]; then
    echo "$1: did not run, or raised no alarm:"; tail -n 3 "$out"; status=1
  else
    printf '%-16s %-8s %6s %11sk, %7sk %11sk, %7sk %8s kB, %3s kB %9sk' "$1" "$2" "$(value rows)" $((mean / 1000)) "$3" \
      $((largest / 1000)) "$4" $((ram / 1000)) "$5" $((bound / 1000))
    if [ "$mean" -gt $(($3 * 1000)) ] || [ "$largest" -gt $(($4 * 1000)) ] || [ "$ram" -gt $(($5 * 1000)) ] ||
      [ "$largest" -gt "$bound" ]; then
      printf '  OVER'; status=1
    fi
    printf '\n'
  fi
  shift 5
done
exit $status
