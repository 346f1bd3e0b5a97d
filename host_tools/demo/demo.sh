#!/bin/bash
# SPDX-License-Identifier: MIT
# demo.sh: learns 50 healthy landings (or DEMO_RUNS), replays one healthy and three faulty ones that it
# has not seen, prints what was found, lets a separate process hear the same alarms over LCM, and draws
# ln anom against its threshold. RIM and BUILD come from make; results are in $BUILD/demo.
set -e -u -o pipefail
out=$BUILD/demo
url=udpm://239.255.76.67:7671?ttl=0
faults="04_doppler_scale 07_velocity_delay 12_velocity_stuck"
effects=$(dirname "$0")/../../data/effects
runs=${DEMO_RUNS:-50}
start=$SECONDS
rm -rf "$out"; mkdir -p "$out"

# Long sentences at 110 columns, the rest of each indented.
wrap() {
  awk 'length <= 110 {print; next}
    {n = split($0, word, " "); line = "  " word[1]
     for (i = 2; i <= n; i++) {
       if (length(line) + 1 + length(word[i]) > 110) {print line; line = "      " word[i]}
       else line = line " " word[i]
     }
     print line}'
}
# The onset's standard error has no room in the record of the bus.
on_the_bus() { sed 's/"since_sd_s":[^,]*,//' "$1"; }
heard_the_same() { cmp -s <(on_the_bus "$out/heard.jsonl") <(on_the_bus "$out/alarms.jsonl"); }
say() { printf '\n== %s\n' "$*"; }

say "1. Simulate $runs healthy landings of a spacecraft: 350 s of fall, then a powered descent"
"$RIM" simulate lander --out "$out/nominal" --runs "$runs" --seed 1

say "2. Learn from them what is normal, and how much one healthy landing differs from the next"
"$RIM" train "$out"/nominal/run_*.csv --out "$out/lander.rim" > "$out/train.txt"
sed -n -e 1p -e '/^local-linear maps/p' -e '/^Calibration/,/^  alarm/p' \
  -e '/^whole image/p' -e '/^RAM of one/p' -e '$p' "$out/train.txt"
echo "(all of it: $out/train.txt)"

say "3. Simulate four landings it has not seen: one healthy, three with a hidden fault"
"$RIM" simulate lander --out "$out/healthy" --runs 1 --first 101 --seed 2
logs=("$out/healthy/run_0101.csv")
run=102
for fault in $faults; do
  "$RIM" simulate lander --out "$out/$fault" --runs 1 --first "$run" --seed 2 --effect "$fault"
  logs+=("$(printf '%s/%s/run_%04d.csv' "$out" "$fault" "$run")")
  sed -n 's/^description = "\(.*\)"$/    hidden: \1/p' "$effects/$fault.toml"
  run=$((run + 1))
done

# The subscriber is a process of its own; it says when it is ready. Where the machine has no
# multicast LCM cannot work, and the demo goes on without it.
"$RIM" listen --lcm "$url" --model "$out/lander.rim" > "$out/heard.jsonl" 2> "$out/listen.log" &
subscriber=$!
trap '[ -z "$subscriber" ] || kill "$subscriber" 2> /dev/null || true' EXIT
for _ in $(seq 100); do
  grep -q listening "$out/listen.log" && break
  kill -0 "$subscriber" 2> /dev/null || break
  sleep 0.1
done
lcm=(--lcm "$url")
if ! grep -q listening "$out/listen.log"; then
  cat "$out/listen.log"; subscriber=; lcm=()
fi

say "4. Fly them: the onboard code, row by row"
"$RIM" replay --model "$out/lander.rim" "${logs[@]}" --alarms "$out/alarms.jsonl" \
  --labels "$out/labels.csv" --trace "$out/trace.csv" --plot "$out/demo.svg" --report "$out/report.html" \
  --candump "$out/alarms.candump" "${lcm[@]}" | tee "$out/replay.txt" | sed "s#^$out/#\n#" | wrap

say "5. The same alarms on the buses"
sent=$(wc -l < "$out/alarms.jsonl")
if [ -n "$subscriber" ]; then
  for _ in $(seq 50); do
    [ "$(wc -l < "$out/heard.jsonl")" -ge "$sent" ] && break
    sleep 0.1
  done
  heard=$(wc -l < "$out/heard.jsonl")
  if heard_the_same; then same="the same to the last digit"; else same="NOT the same"; fi
  echo "LCM: a separate process heard $heard of $sent records on $url: $same"
else
  echo "LCM: this machine has no multicast route; nothing was published"
fi
can=$("$RIM" replay --model "$out/lander.rim" "${logs[0]}" --can can0 2>&1 > /dev/null || true)
echo "CAN: ${can#rim: can0: }"
echo "     here: $(wc -l < "$out/alarms.candump") frames in $out/alarms.candump, as \`candump -L\` writes them"

if [ -n "$subscriber" ] && ! heard_the_same; then exit 1; fi
say "Done in $((SECONDS - start)) s. Look at"
cat << END
  $out/report.html    every alarm measured against expected; open it in a browser
  $out/demo.svg       ln anom against its threshold over time, a panel a landing
  $out/alarms.jsonl   every alarm record, one JSON object a line
  $out/labels.csv     which rows lie in the region that was found
  $out/lander.rim     the flight image: all that the onboard code needs
END
