#!/bin/bash
# SPDX-License-Identifier: MIT
# Other people's LCM programs and ours: lcm-logger records rimd and rim replay reads it; lcm-logplayer plays into
# rimd; rim listen hears it by liblcm; the lcm package of Python decodes. In a network of its own where this
# machine lets us, else skipped: liblcm wants a multicast route.
# Mostly waits.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
if [ "$1" != inside ]; then
  for program in lcm-logger lcm-logplayer unshare; do command -v $program > /dev/null || missing="$missing $program"; done
  if [ -n "$missing" ] || ! unshare -n true 2> /dev/null; then skip "no${missing:- unshare -n}"; fi
  rm -rf "$here"
  exec unshare -n "$0" inside
fi
ip link set lo up && ip route add 224.0.0.0/4 dev lo || bad "the network"
cd "$here" || exit 1
toy_model toy.rim
toy biased.csv 102 1200 'if (x > 1) v += 0.5' # in a place, so that a plan may enter it
url='udpm://239.255.76.67:7667?ttl=0'
printf "image = toy.rim\nlcm = $url\nhealth_ms = 100\nlcm_interface = 127.0.0.1\naxis_x = s.position_a_m\n" > rimd.conf
until_in() { for _ in $(seq 600); do grep -q "$2" "$1" 2> /dev/null && return 0; sleep 0.1; done; return 1; }
start() { "$BUILD/rimd" rimd.conf 2> "$1.said" & daemon=$!; until_in "$1.said" ready; }

# rimd is fed by datagrams made by hand; the logger and rim listen hear all of it.
timeout -s INT 60 lcm-logger --quiet --lcm-url="$url" bus.lcm > logger.txt 2>&1 & logger=$!
"$RIM" listen --model toy.rim --all > all.jsonl 2> listen.err & listener=$!
"$RIM" listen --model toy.rim > heard.jsonl 2> listen2.err & quiet=$!
until_in listen.err listening; check "rim listen" 0 $?
until_in listen2.err listening; check "rim listen, alarms alone" 0 $?
"$RIM" listen > nameless.jsonl 2> listen3.err & nameless=$!
until_in listen3.err listening; check "rim listen, no image" 0 $?
# On a terminal: script(1) gives it one.
script -qfec "stty cols 200; '$RIM' listen --model toy.rim" screen.txt > /dev/null 2>&1 < /dev/null & terminal=$!
until_in screen.txt "0 records"; check "rim listen on a terminal" 0 $?
start first; check "rimd" 0 $?
sleep 0.5
python3 - "$root" << 'END'
import sys, time
sys.path.insert(0, sys.argv[1] + "/tests/firmware")
from bus import Bus, read_rows
bus = Bus(sys.argv[1] + "/lib/wire", 7667)
bus.plan(59950000, 1, [(float(i), -20.0 + i, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0) for i in range(41)])
for t_us, values in read_rows("biased.csv"):
    bus.row(t_us, values)
    time.sleep(0.002)  # slow enough for a logger that has to wait for the processor
END
until_in heard.jsonl '"state":"raised"'; check "heard by liblcm" 0 $?
until_in nameless.jsonl 'speed reads 0'; check "names by RIM_MODEL" 0 $?
"$RIM" command describe --lcm "$url"; check "rim command describe" 0 $?
"$RIM" command describe --any > said 2>&1; check "describe names no alarm" 2 $?
until_in all.jsonl '"message":"counters",.*"rows":1200'; check "counters" 0 $?
until_in all.jsonl '"message":"health",.*"level":"ERROR",.*"observations":1200'; check "health" 0 $?
until_in heard.jsonl '"message":"entry",.*"to_entry_s":[0-9]'; check "an entry warning" 0 $?
grep '"message"' heard.jsonl | grep -qv '"message":"entry"'; check "and nothing else unasked" 1 $?
until_in screen.txt 'model [0-9]* on LCM: .*ERROR, 1200 observations'; check "the table shows health" 0 $?
until_in screen.txt 'plan 1 enters the region of alarm'; check "the table shows the entry" 0 $?
until_in screen.txt 'ERROR .*speed reads 0\.'; check "the table shows the alarm" 0 $?
python3 -c 'import json, sys
for line in open("all.jsonl"): json.loads(line)'; check "lines are JSON" 0 $?
sleep 1
kill $daemon; wait $daemon; check "rimd ends" 0 $?
kill -INT $logger; wait $logger 2> /dev/null
"$RIM" replay --model toy.rim biased.csv --alarms ground.jsonl > replay.txt
out=$("$RIM" replay --model toy.rim bus.lcm --alarms logged.jsonl 2> err); check "rim replay reads lcm-logger's log" 0 $?
contains "every row" "$out" "rows: 1200 used, 0 skipped"
same() { # the records of two files, without what tells a replay from a flight
  sed 's/,"replay":[a-z]*//; s/"t_s":[^,]*,//; s/"since_s":[^,]*,//' "$1"
}
check "the log replays as the original" "$(same ground.jsonl)" "$(same logged.jsonl)"
check "and as it flew" "$(same ground.jsonl)" "$(grep -v -e STALE -e '"message"' heard.jsonl > flew.jsonl; same flew.jsonl)"

# The player plays it into another rimd: the same alarm.
start second
timeout 100 lcm-logplayer --lcm-url="$url" -e '^RIM_OBSERVATION$' bus.lcm > player.txt 2>&1; check "lcm-logplayer" 0 $?
for _ in $(seq 100); do [ "$(grep -c '"state":"raised"' heard.jsonl)" = 2 ] && break; sleep 0.1; done
check "played into rimd and heard" 2 "$(grep -c '"state":"raised"' heard.jsonl)"
kill $daemon; wait $daemon
contains "all rows" "$(cat second.said)" "after 1200 observations"
"$RIM" command clear --any --lcm "$url"; check "rim command" 0 $?

# With a key: what rim command seals is obeyed, what it does not seal is not.
(umask 077 && head -c 32 /dev/urandom | od -An -v -tx1 | tr -d ' \n' > secret && echo >> secret && tr 0 1 < secret > other)
cp rimd.conf plain.conf; printf "key = secret\nstate = keyed.state\n" >> rimd.conf
start keyed
if grep -q 'without libsodium' keyed.said; then echo "not here: rimd with libsodium"; skipped=$((skipped + 1)); else
  "$RIM" command describe --lcm "$url" && "$RIM" command describe --lcm "$url" --key other; check "rim command, no key or another" 0 $?
  "$RIM" command describe --lcm "$url" --key secret; check "rim command --key" 0 $?
  until_in all.jsonl '"message":"counters",.*"commands":1,"commands_refused":2'; check "two refused, one obeyed" 0 $?
  kill $daemon; wait $daemon; check "rimd with a key ends" 0 $?
  contains "counted" "$(cat keyed.said)" "with the key: unsealed 1 forged 1 replayed 0"
fi
mv plain.conf rimd.conf
chmod 644 other; "$RIM" command describe --key other > said 2>&1; check "a key that others may read" 3 $?
contains "says why" "$(cat said)" "other: others may read or write it"
"$RIM" command describe --key none > said 2>&1; check "no key" 3 $?
echo 00 > other; chmod 600 other; "$RIM" command describe --key other > said 2>&1; check "a key too short" 3 $?
contains "says how long" "$(cat said)" "a key has 64 hexadecimal digits"
kill $listener $quiet $nameless; wait $listener; check "the listener ends" 0 $?
kill $terminal; wait $terminal

python=python3
[ -x "$BUILD/venv/bin/python3" ] && python=$BUILD/venv/bin/python3
if has_packages $python lcm; then
  mkdir types
  lcm-gen -p --ppath types "$root"/lib/wire/*.lcm
  $python - << 'END' > py.txt 2>&1
import json, sys
sys.path.insert(0, "types")
import lcm, rim
seen = {}
for event in lcm.EventLog("bus.lcm"):
    if not event.channel.startswith("RIM_"):
        continue  # LCM's own test of itself
    kind = {"RIM_ALARM": rim.alarm_t, "RIM_HEALTH": rim.health_t, "RIM_COUNTERS": rim.counters_t, "RIM_OBSERVATION": rim.observation_t,
            "RIM_ENTRY": rim.entry_t, "RIM_COMMAND": rim.command_t, "RIM_PLAN": rim.plan_t, "RIM_MODEL": rim.model_t}[event.channel]
    seen.setdefault(event.channel, []).append(kind.decode(event.data))
ground = [json.loads(line) for line in open("ground.jsonl")]
alarms = [a for a in seen["RIM_ALARM"] if a.level == 2]
print("alarms", [(a.sequence, a.ln_anom, a.p_value) for a in alarms] == [(g["seq"], g["ln_anom"], g["p_value"]) for g in ground])
print("onset", [a.since_sd_s for a in alarms] == [g["since_sd_s"] for g in ground])
text = lambda b: bytes(b).split(b"\0")[0].decode()
m = seen["RIM_MODEL"][0]
print("model", m.features, m.outcomes, m.count, m.period_us, [text(m.name[i]) + " " + text(m.unit[i]) for i in (0, 3, 6)])
print("entry", seen["RIM_ENTRY"][-1].plan_sequence, seen["RIM_ENTRY"][-1].to_entry_s > 0, seen["RIM_PLAN"][0].count)
print("health", seen["RIM_HEALTH"][-1].observations, "counters", seen["RIM_COUNTERS"][-1].rows, len(seen["RIM_OBSERVATION"]))
END
  contains "Python's lcm: alarms" "$(cat py.txt)" "^alarms True"
  contains "Python's lcm: the onset's standard error" "$(cat py.txt)" "^onset True"
  contains "Python's lcm: names and units" "$(cat py.txt)" "^model 4 3 7 50000 \['u.push ', 's.speed_mps m/s', 's.speed_mps m/s'\]"
  contains "Python's lcm: the entry" "$(cat py.txt)" "^entry 1 True 41"
  contains "Python's lcm: the rest" "$(cat py.txt)" "^health 1200 counters 1200 1200"
else
  skipped=$((skipped + 1))
fi
finish
