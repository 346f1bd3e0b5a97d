#!/bin/bash
# SPDX-License-Identifier: MIT
# cross.sh DIR 'RECORDING...' (PORT PREFIX RUN)...: runs DIR/PORT/replay-RECORDING by the emulator RUN, one
# after another, and holds the digest each prints to that of `rim replay` on the host, and its `bits`
# (replay/replay.c) to those of DIR/linux/replay-RECORDING. Exit 1 when one differs or does not come.
dir=$1 recordings=$2; shift 2
limit_s=600 # an emulator takes some 1 to 20 s, on a busy machine ten times that
passed=0 failed=0

# compare RECORDING PORT PREFIX RUN
compare() {
  local recording=$1 port=$2 prefix=$3 run=$4
  local out=$dir/$port/$recording.output errors=$dir/$port/$recording.errors
  local start status seconds bits digest equal size mean can
  value() { tr -d '\r' < "$out" | awk -v key="$1" '$1 == key {print $2}'; }
  start=$(date +%s.%N)
  # shellcheck disable=SC2086
  timeout "$limit_s" $run "$dir/$port/replay-$recording" > "$out" 2> "$errors" < /dev/null
  status=$?
  seconds=$(echo "$start $(date +%s.%N)" | awk '{printf "%.1f", $2 - $1}')
  digest=$(value digest) bits=$(value bits)
  equal=no # a run without an alarm would prove too little
  if [ "digest $digest" = "$wanted" ] && [ "bits $bits" = "$wanted_bits" ] && [ "$status" = 0 ] &&
    [ "$(value alarm_records)" -gt 0 ]; then
    equal=yes
  fi
  # A port with CAN controllers: every record must have come back over the bus as it went.
  can=$(value can_records_equal)
  [ -n "$can" ] && [ "$can" != "$(value alarm_records)" ] && equal=no
  size=$("${prefix}size" -t "$dir/$port/librim.a" | awk 'END {print $1}')
  mean=$(value step_instructions_mean)
  printf '%-16s %-16s %-6s %6s %6s %8s %8s %7s %s\n' "$port" "${digest:-none}" "$equal" "$(value rows)" \
    "$(value alarm_records)" "$size" "$(value monitor_bytes)" "$seconds" \
    "${mean:+$mean, $(value step_instructions_largest)}${can:+CAN: $can of $(value alarm_records) records came back}"
  if [ "$equal" = yes ]; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    printf '  status %s, bits %s; its last words:\n' "$status" "$bits"
    tail -n 3 "$out" "$errors"
  fi
}

for recording in $recordings; do
  wanted=$(cat "$dir/$recording.digest") || exit 3
  wanted_bits=$("$dir/linux/replay-$recording" | grep '^bits ') || exit 3
  printf '%s on the host: %s, %s\n' "$recording" "$wanted" "$wanted_bits"
  printf '%-16s %-16s %-6s %6s %6s %8s %8s %7s %s\n' target digest equal rows alarms code RAM seconds \
    "instructions a step: mean, largest"
  ports=("$@")
  while [ ${#ports[@]} -ge 3 ]; do
    compare "$recording" "${ports[@]:0:3}"
    ports=("${ports[@]:3}")
  done
done
echo "code: librim for the target, bytes; RAM: the monitor of this recording, bytes"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
