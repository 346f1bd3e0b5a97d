#!/bin/bash
# SPDX-License-Identifier: MIT
# The demo on the first 250 s of its landings, learnt from 12 in coarser blocks: the healthy landing is left alone, a Doppler's scale and a
# stuck sensor are found, a second process hears it all. `make test-long`: whole landings, learnt from 20, and a delay that the descent shows.
. "$(dirname "$0")/check.inc"
skip_under_sanitizers "it learns twelve landings; simulate.sh, train.sh, replay.sh and interop.sh run the same commands on fewer"
demo_rim=$RIM runs=20 faults="04_doppler_scale 07_velocity_delay 12_velocity_stuck"
if ! is_long; then # the demo's own commands, with two options more
  demo_rim=$here/rim runs=12 faults="04_doppler_scale 12_velocity_stuck"
  printf '#!/bin/bash\ncase $1 in simulate) set -- "$@" --rows 5000 ;; train) set -- "$@" --block-seconds 4 ;; esac\nexec "%s" "$@"\n' "$RIM" > "$demo_rim"
  chmod +x "$demo_rim"
fi
out=$(DEMO_RUNS=$runs RIM=$demo_rim BUILD=$here "$root/host_tools/demo/demo.sh" 2>&1); check "demo" 0 $?
printf '%s\n' "$out" > "$here/demo.txt"
contains "healthy" "$out" "^healthy/run_0101.csv: healthy: nothing found"
for fault in $faults; do contains "$fault" "$out" "^$fault/run_.*: FOUND at t = "; done
contains "the Doppler is named, not its twin" "$out" "velocity doppler z reads [0-9.]* m/s low"
contains "the stuck sensor is named" "$out" "velocity imu z repeats"
if printf '%s\n' "$out" | grep -q "no multicast"; then skipped=$((skipped + 1)); else
  contains "a second process" "$out" "heard \([0-9]*\) of \1 records.*the same to the last digit"
fi
contains "CAN is spoken of" "$out" "^CAN: "
for file in report.html demo.svg alarms.jsonl labels.csv trace.csv lander.rim alarms.candump; do
  [ -s "$here/demo/$file" ]; check "$file" 0 $?
done
contains "the figure" "$(cat "$here/demo/demo.svg")" "${faults##* }/run_[0-9]*.csv: alarm at t = "
! is_long || contains "the figure, of the delay" "$(cat "$here/demo/demo.svg")" "07_velocity_delay/run_0103.csv: alarm at t = "
said=$(printf '%s\n' "$out" | sed -n '/^04_doppler.*FOUND/,/in the end/ s/.*later: \(velocity [a-z]* z\) .*/\1/p')
contains "the figure names what was said in the end" "$(cat "$here/demo/demo.svg")" "04_doppler_scale/run_[0-9]*.csv: alarm at t = [0-9.]* s, ${said:?}"
finish
