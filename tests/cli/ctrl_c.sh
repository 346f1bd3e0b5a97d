#!/bin/bash
# SPDX-License-Identifier: MIT
# Commands that a signal ends: no temporary stays, what stood under a name stays as it was, what was
# complete is kept and counted, and the shell sees which signal it was. A pipe that never ends holds
# a command at its work until the signal comes.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
cat > logs.py <<'EOF'
import math, random
random.seed(5)
for run in range(5):
    with open(f"run_{run}.csv", "w") as f:
        print("t_s,u.push,s.speed_mps,z.way_m,m.way_m,sd.way_m" if run == 4 else "t_s,u.push,s.speed_mps", file=f)
        v = 0.0
        for i in range(400):
            u = math.sin(i / (20 + run))
            v += 0.1 * (u - v) + random.gauss(0, 0.01)
            more = f",{v + random.gauss(0, 0.1):.4f},{v:.4f},0.1" if run == 4 else ""
            print(f"{i / 10:.1f},{u:.4f},{v:.4f}{more}", file=f)
EOF
python3 logs.py
cat > stop.py <<'EOF'
"""stop.py SIGNAL WAIT_FOR COMMAND...: starts the command, waits until a file of the pattern is there,
then sends the signal. Prints the status as subprocess gives it (-2: SIGINT) and what it wrote on stderr."""
import glob, os, signal, subprocess, sys, time
name, pattern, command = sys.argv[1], sys.argv[2], sys.argv[3:]
held = os.open("endless", os.O_RDWR) # the command reads the pipe, and no end comes
first = open("run_4.csv" if "diagnose" in command else "run_0.csv").read()[:4000]
os.write(held, first.encode())
def start():
    signal.signal(signal.SIGINT, signal.SIG_IGN if name == "ignored" else signal.SIG_DFL)
child = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, preexec_fn=start)
for _ in range(0 if pattern == "started" else 600):
    if glob.glob(pattern) or child.poll() is not None:
        break
    time.sleep(0.05)
if pattern == "started":
    time.sleep(1)
if name == "deaf": # as tee, that the same Ctrl-C ended before
    child.stderr.close()
child.send_signal(signal.SIGINT if name in ("ignored", "deaf") else getattr(signal, name))
if name == "deaf":
    try:
        print(child.wait(timeout=20))
    except subprocess.TimeoutExpired:
        child.kill()
        print("hangs")
    sys.exit()
if name == "ignored":
    time.sleep(0.5)
    print("alive" if child.poll() is None else "ended")
    child.kill()
print(child.wait(), child.stderr.read())
EOF
mkfifo endless
stop() { python3 stop.py "$@"; }
left() { find . -name '*.tmp.*' -o -name '*.lines.*' | wc -l; }

"$RIM" train run_[0123].csv --out model.rim --quick > /dev/null 2>&1; check "a model" 0 $?
sum=$(cksum < model.rim)
out=$(stop SIGINT 'new.rim.tmp.*' "$RIM" train run_0.csv run_1.csv endless --out new.rim)
contains "train: ends by the signal, and says so" "$out" '^-2 .*rim: interrupted: no file was written or changed; 1 that was not finished went away$'
[ ! -e new.rim ]; check "train: nothing under its name" 0 $?
out=$(stop SIGTERM 'model.rim.tmp.*' "$RIM" train run_0.csv run_1.csv endless --out model.rim)
contains "train, SIGTERM" "$out" '^-15 .*no file was written or changed'
check "train: the earlier model stays" "$sum" "$(cksum < model.rim)"
check "train: no temporary" 0 "$(left)"
out=$(stop deaf 'new.rim.tmp.*' "$RIM" train run_0.csv run_1.csv endless --out new.rim)
check "train: ends though nobody reads what it says" "-2" "$out"
check "train: no temporary of that either" 0 "$(left)"

# The file that is opened last is waited for.
out=$(stop SIGINT 'a.candump.tmp.*' "$RIM" replay --model model.rim run_0.csv endless --alarms a.jsonl --labels l.csv \
  --trace trace.csv --report flight.html --candump a.candump)
contains "replay: five files were open" "$out" '^-2 .*no file was written or changed; 5 that were not finished went away'
check "replay: nothing remains" "" "$(ls a.jsonl l.csv trace.csv flight.html a.candump 2> /dev/null)"
check "replay: no temporary" 0 "$(left)"
# What was replayed is printed, also into a pipe: the log that comes next never ends.
exec {held}<> endless
"$RIM" replay --model model.rim run_0.csv endless > printed.txt 2> /dev/null & replaying=$!
for _ in $(seq 600); do [ -s printed.txt ] && break; sleep 0.05; done
kill -TERM $replaying; wait $replaying; check "replay: the status of a signal" 143 $?
exec {held}>&-
contains "replay: the log before stays said" "$(cat printed.txt)" '^run_0.csv: '
out=$(stop SIGHUP started "$RIM" diagnose run_4.csv endless --out found)
contains "diagnose, SIGHUP" "$out" '^-1 .*no file was written or changed$'
[ ! -e found ]; check "diagnose: no folder" 0 $?

out=$(stop SIGINT 'runs/run_0030.csv' "$RIM" simulate lander --out runs --runs 5000 --seed 2)
kept=$(ls runs/run_*.csv | wc -l)
contains "simulate: how many are kept" "$out" "^-2 .*interrupted: $kept files are complete and kept, the last runs/run_[0-9]*.csv"
check "simulate: no temporary" 0 "$(left)"
last=$(ls runs/run_*.csv | tail -1 | tr -dc 0-9) # its number: threads may leave gaps before it
"$RIM" simulate lander --out whole --runs "$((10#$last))" --seed 2 > /dev/null 2>&1
same=0; for f in runs/run_*.csv; do cmp -s "$f" whole/"$(basename "$f")" && same=$((same + 1)); done
check "simulate: each that is there is whole" "$kept" "$same"
complete=$(for f in runs/run_*.csv; do tail -c 1 "$f" | od -An -c; done | grep -c '\\n')
check "simulate: every last line has its end" "$kept" "$complete"

# What a caller ignores stays ignored: nohup, a job in the background of a script.
contains "an ignored signal" "$(stop ignored 'new.rim.tmp.*' "$RIM" train run_0.csv run_1.csv endless --out new.rim)" '^alive'
rm -f new.rim.tmp.*
# A reader that goes away: no temporary, no message.
"$RIM" replay --model model.rim $(yes run_0.csv | head -200) --alarms a.jsonl 2> said | true
check "a closed pipe: not written" "no" "$([ -e a.jsonl ] && echo yes || echo no)"
check "a closed pipe: no temporary" 0 "$(left)"
check "a closed pipe: no word" "" "$(grep -v ' s so far$' said)" # progress comes by the clock
finish
