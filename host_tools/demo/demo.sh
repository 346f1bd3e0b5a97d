#!/bin/bash
# demo.sh: learns 50 healthy landings, replays one healthy and three faulty ones that it has not seen,
# prints what was found, lets a separate process hear the same alarms over LCM, and draws ln anom
# against its threshold. RIM and BUILD come from make; results are in $BUILD/demo.
set -e -u -o pipefail
out=$BUILD/demo
url=udpm://239.255.76.67:7671?ttl=0
seed=1
faults="02_thrust_loss 06_gyro_drift 10_radar_high"
rm -rf "$out"; mkdir -p "$out"

say() { printf '\n== %s\n' "$*"; }

say "Simulating 50 healthy landings (seed $seed)"
"$RIM" simulate lander --out "$out/nominal" --runs 50 --seed "$seed"

say "Learning from them"
"$RIM" train "$out"/nominal/run_*.csv --out "$out/lander.rim"

say "One healthy and three faulty landings, none of them seen before"
"$RIM" simulate lander --out "$out/healthy" --runs 1 --first 101 --seed "$seed"
for fault in $faults; do
  "$RIM" simulate lander --out "$out/$fault" --runs 1 --first 102 --seed "$seed" --effect "$fault"
done

can=$("$RIM" listen --can can0 2>&1 || true)
case $can in
  *"no CAN"*) echo "CAN: this kernel has none; the frames go to candump logs, the embedded default" ;;
  *) echo "CAN: the frames go to candump logs; canplayer can put them on a bus" ;;
esac

# The subscriber is a process of its own; it says when it is ready. Without a multicast route LCM
# cannot work, and the demo goes on without it.
subscriber=
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

sent=0
for flight in healthy $faults; do
  log=$(ls "$out/$flight"/run_*.csv)
  say "Replaying '$flight'"
  "$RIM" replay --model "$out/lander.rim" "$log" --alarms "$out/$flight.jsonl" \
    --candump "$out/$flight.candump" --trace "$out/$flight.trace.csv" "${lcm[@]}" | tail -1
  if [ -s "$out/$flight.jsonl" ]; then
    grep '"state":"raised"' "$out/$flight.jsonl" |
      sed 's/.*"t_s":\([0-9.e+-]*\),.*"sentence":"\(.*\)"}$/  alarm at t = \1 s: \2/'
    tail -1 "$out/$flight.jsonl" | sed 's/.*"sentence":"\(.*\)"}$/  in the end: \1/'
  else
    echo "  no alarm"
  fi
  sent=$((sent + $(wc -l < "$out/$flight.jsonl")))
done

if [ -n "$subscriber" ]; then
  for _ in $(seq 50); do
    [ "$(wc -l < "$out/heard.jsonl")" -ge "$sent" ] && break
    sleep 0.1
  done
  say "Over LCM a separate process heard $(wc -l < "$out/heard.jsonl") of $sent records"
fi

if command -v gnuplot > /dev/null; then
  plots=
  for flight in healthy $faults; do
    plots="$plots set title '$flight' noenhanced; plot '$out/$flight.trace.csv' using 1:2 with lines lw 1.5 title 'ln anom', '' using 1:3 with lines lw 1.5 dashtype 2 title 'threshold';"
  done
  gnuplot -e "set terminal svg size 900,900 dynamic background rgb 'white'; set output '$out/demo.svg';
    set datafile separator ','; set datafile commentschars '#'; set key left top; set xlabel 't (s)';
    set multiplot layout 4,1; $plots unset multiplot"
  say "Figure: $out/demo.svg"
fi
