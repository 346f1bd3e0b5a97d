#!/bin/bash
# SPDX-License-Identifier: MIT
# The demo, whole, but learnt from 12 landings (20 in `make test-long`): the healthy landing is left alone, three faults are found, a second process
# hears it all.
. "$(dirname "$0")/check.inc"
skip_under_sanitizers "it learns twelve landings; simulate.sh, train.sh, replay.sh and interop.sh run the same commands on fewer"
out=$(DEMO_RUNS=$(is_long && echo 20 || echo 12) RIM=$RIM BUILD=$here "$root/host_tools/demo/demo.sh" 2>&1); check "demo" 0 $?
printf '%s\n' "$out" > "$here/demo.txt"
contains "healthy" "$out" "^healthy/run_0101.csv: healthy: nothing found"
for fault in 04_doppler_scale 07_velocity_delay 12_velocity_stuck; do contains "$fault" "$out" "^$fault/run_.*: FOUND at t = "; done
contains "the Doppler is named, not its twin" "$out" "velocity doppler z reads [0-9.]* m/s low"
contains "the stuck sensor is named" "$out" "velocity imu z repeats"
if printf '%s\n' "$out" | grep -q "no multicast"; then skipped=$((skipped + 1)); else
  contains "a second process" "$out" "heard \([0-9]*\) of \1 records.*the same to the last digit"
fi
contains "CAN is spoken of" "$out" "^CAN: "
for file in report.html demo.svg alarms.jsonl labels.csv trace.csv lander.rim alarms.candump; do
  [ -s "$here/demo/$file" ]; check "$file" 0 $?
done
contains "the figure" "$(cat "$here/demo/demo.svg")" "07_velocity_delay/run_0103.csv: alarm at t = "
said=$(printf '%s\n' "$out" | sed -n '/^04_doppler.*FOUND/,/in the end/ s/.*later: \(velocity [a-z]* z\) .*/\1/p')
contains "the figure names what was said in the end" "$(cat "$here/demo/demo.svg")" "04_doppler_scale/run_[0-9]*.csv: alarm at t = [0-9.]* s, ${said:?}"
finish
