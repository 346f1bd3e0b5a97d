#!/bin/bash
# cross.sh DIR (PORT PREFIX RUN)...: runs DIR/PORT/replay by the emulator RUN, one port after another, and
# holds the digest each prints to that of `rim replay` on the host, and its `bits` (replay/replay.c) to
# those of DIR/linux/replay. Exit 1 when one differs or does not come.
dir=$1; shift
wanted=$(cat "$dir/landing.digest") || exit 3
wanted_bits=$("$dir/linux/replay" | grep '^bits ') || exit 3
limit_s=300 # a whole landing takes an emulator some 5 to 60 s
passed=0 failed=0
printf 'host: %s, %s\n' "$wanted" "$wanted_bits"
printf '%-16s %-16s %-6s %7s %7s %8s %8s %s\n' target digest equal rows alarms code RAM seconds
while [ $# -ge 3 ]; do
  port=$1 prefix=$2 run=$3; shift 3
  start=$(date +%s.%N)
  # shellcheck disable=SC2086
  timeout "$limit_s" $run "$dir/$port/replay" > "$dir/$port/output" 2> "$dir/$port/errors" < /dev/null
  status=$?
  seconds=$(echo "$start $(date +%s.%N)" | awk '{printf "%.1f", $2 - $1}')
  value() { awk -v key="$1" '$1 == key {print $2}' "$dir/$port/output" | tr -d '\r'; }
  bits="bits $(value bits)"
  digest=$(tr -d '\r' < "$dir/$port/output" | grep '^digest ' || echo none)
  equal=no # a landing without an alarm would prove too little
  if [ "$digest" = "$wanted" ] && [ "$bits" = "$wanted_bits" ] && [ "$status" = 0 ] &&
    [ "$(value alarm_records)" -gt 0 ]; then
    equal=yes
  fi
  size=$("${prefix}size" -t "$dir/$port/librim.a" | tail -n 1 | awk '{print $1, $2 + $3}')
  printf '%-16s %-16s %-6s %7s %7s %8s %8s %s\n' "$port" "${digest#digest }" "$equal" "$(value rows)" \
    "$(value alarm_records)" "${size% *}" "$(value monitor_bytes)" "$seconds"
  mean=$(value step_instructions_mean)
  [ -n "$mean" ] && printf '%-16s   instructions a step: mean %s, largest %s\n' '' "$mean" \
    "$(value step_instructions_largest)"
  if [ "$equal" = yes ]; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    printf '%-16s   status %s, %s; its last words:\n' '' "$status" "$bits"
    tail -n 3 "$dir/$port/output" "$dir/$port/errors"
  fi
done
echo "code: librim for the target, bytes; RAM: the monitor of this landing, bytes"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
