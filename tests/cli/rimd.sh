#!/bin/bash
# SPDX-License-Identifier: MIT
# rimd, the daemon: configuration, observations over LCM, alarms and health out, everything bad that can come
# in, restart, stale input, fixed memory. tests/firmware/rimd_test.py does the asking.
# Mostly waits.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
[ -x "$BUILD/rimd" ] || { bad "no $BUILD/rimd"; finish; }
cd "$here" || exit 1
toy_model toy.rim
toy healthy.csv 101
toy biased.csv 102 1200 'if (x > 1) v += 0.5' # in a place, so that a plan may enter it
toy long.csv 102 2400 'if (x > 1) v += 0.5'   # the same run, twice as long
"$RIM" replay --model toy.rim biased.csv --alarms biased.jsonl > /dev/null || bad "replay"
awk 'NR <= 901 || NR > 1101' biased.csv > gap.csv # 10 s of silence while the alarm stands
"$RIM" replay --model toy.rim gap.csv --alarms gap.jsonl > /dev/null || bad "replay with a gap"
# 20 features, 40 outcomes with their predictions: 140 values a row.
awk 'BEGIN {
  printf "t_s"; for (i = 0; i < 20; i++) printf ",x.f%d", i
  for (o = 0; o < 40; o++) printf ",z.o%d,m.o%d,sd.o%d", o, o, o
  for (r = 0; r < 40; r++) {
    printf "\n%d", r; for (i = 0; i < 20; i++) printf ",%.3f", sin(r * (i + 1))
    for (o = 0; o < 40; o++) printf ",%.3f,0,1", cos(r * (o + 1.5))
  }
  print "" }' > wide.csv
"$RIM" replay wide.csv --calibration-runs 19 --save-model wide.rim > /dev/null || bad "a wide image"
awk 'BEGIN {print "t_s,x.a,z.o,m.o,sd.o"; for (r = 0; r < 40; r++) printf "%d,%.3f,%.3f,0,1\n", r, sin(r), cos(2 * r)}' > own.csv
"$RIM" replay own.csv --calibration-runs 19 --save-model own.rim > /dev/null || bad "an image of rows with predictions"
gcc -O2 -Wall -Wextra -shared -fPIC "$root/tests/firmware/count_allocations.c" -o count.so || bad "counter"
gcc -O2 -Wall -Wextra -shared -fPIC "$root/tests/firmware/counted_clock.c" -o clock.so || bad "clock"

# Configuration: told whole, with file and line.
refuses() { # WHAT STATUS PATTERN TEXT
  printf '%b' "$4" > bad.conf
  said=$("$BUILD/rimd" --check bad.conf 2>&1); check "$1" "$2" $?
  contains "$1: said" "$said" "$3"
}
lcm='lcm = udpm://239.255.76.67:7667?ttl=0\n'
printf "image = toy.rim\n$lcm" > good.conf
said=$("$BUILD/rimd" --check good.conf); check "a good one" 0 $?
contains "sizes" "$said" "^bytes: image [0-9]*, monitor [0-9]*, everything else [0-9]*$"
sed -e 's/^#\([a-z]\)/\1/' -e 's/lander.rim/toy.rim/' -e '/^input/d' -e '/^axis/d' -e '/^footprint/d' -e '/^margin/d' -e '/^key/d' "$root/firmware/rimd/rimd.conf" > whole.conf
"$BUILD/rimd" --check whole.conf > /dev/null; check "the example with all its defaults" 0 $?
refuses "unknown key" 3 "^rimd: bad.conf:2: unknown key 'modell'$" "image = toy.rim\nmodell = 1\n$lcm"
refuses "a key twice" 3 "bad.conf:3: image: stands on line 1 already" "image = toy.rim\n$lcm image = b\n"
refuses "no equal sign" 3 "bad.conf:1: 'image toy.rim' is not 'key = value'" "image toy.rim\n$lcm"
refuses "no value" 3 "bad.conf:2: node: has no value" "image = toy.rim\nnode = # none\n$lcm"
refuses "a number too large" 3 "bad.conf:1: node: '128' is not a whole number from 0 to 127" "node = 128\nimage = toy.rim\n$lcm"
refuses "a number far too large" 3 "is not a whole number" "node = 99999999999999999999\nimage = toy.rim\n$lcm"
refuses "a negative number" 3 "'-1' is not a whole number" "node = -1\nimage = toy.rim\n$lcm"
refuses "neither yes nor no" 3 "bad.conf:1: latch: 'maybe' is neither yes nor no" "latch = maybe\nimage = toy.rim\n$lcm"
refuses "no image" 3 "image = FILE.rim is missing" "$lcm"
refuses "no bus" 3 "nobody would hear" "image = toy.rim\n"
refuses "a scheme of another kind" 3 "must begin with udpm" "image = toy.rim\nlcm = file://x\n"
refuses "a group that is none" 3 "multicast address" "image = toy.rim\nlcm = udpm://10.0.0.1:7667\n"
refuses "a port that is none" 3 "port must be" "image = toy.rim\nlcm = udpm://239.1.1.1:70000\n"
refuses "an option that is none" 3 "only option" "image = toy.rim\nlcm = udpm://239.1.1.1:7000?recv_buf_size=1\n"
refuses "ttl" 3 "ttl must be" "image = toy.rim\nlcm = udpm://239.1.1.1:7000?ttl=x\n"
refuses "an interface's address" 3 "bad.conf:3: lcm_interface: 'lo' is not an IPv4 address" "image = toy.rim\n${lcm}lcm_interface = lo\n"
refuses "input" 3 "neither lcm nor can" "image = toy.rim\n${lcm}input = serial\n"
refuses "input without its bus" 3 "needs can or can_input" "image = toy.rim\n${lcm}input = can\n"
refuses "all errors at once" 3 "3 errors" "a = 1\nb\nimage = toy.rim\nnode = x\n$lcm"
refuses "binary" 3 "no text file" 'image = \001toy\n'
refuses "a name too long" 3 "longer than 255" "image = $(printf 'x%.0s' $(seq 300))\n$lcm"
refuses "an image that is not there" 3 "absent.rim: No such file" "image = absent.rim\n$lcm"
refuses "an image that is none" 3 "biased.csv: " "image = biased.csv\n$lcm"
refuses "an empty image" 3 "empty" "image = /dev/null\n$lcm"
refuses "CAN input without a table" 3 "no table of CAN signals" "image = toy.rim\ncan = can0\ninput = can\n$lcm"
refuses "an image too wide for LCM" 3 "wide.rim: a row has 140 values, and an observation over LCM carries 128" "image = wide.rim\n$lcm"
refuses "and not for CAN" 3 "wide.rim: has no table of CAN signals" "image = wide.rim\ncan = can0\ninput = can\n$lcm"
head -c 20000 /dev/zero | tr '\0' '#' > long.conf
said=$("$BUILD/rimd" long.conf 2>&1); check "a file too long" 3 $?
contains "a file too long: said" "$said" "longer than"
cp toy.rim hurt.rim; printf 'X' | dd of=hurt.rim bs=1 seek=2000 conv=notrunc status=none
refuses "a damaged image" 3 "hurt.rim: .*check sum" "image = hurt.rim\n$lcm"
"$BUILD/rimd" --check absent.conf 2> /dev/null; check "no configuration" 3 $?
"$BUILD/rimd" > said 2>&1; check "usage" 2 $?
"$BUILD/rimd" --wrong good.conf > said 2>&1; check "unknown option" 2 $?
"$BUILD/rimd" good.conf good.conf > said 2>&1; check "two files" 2 $?
"$BUILD/rimd" --help | grep -q '^Example'; check "help ends in an example" 0 $?
contains "help names every exit status" "$("$BUILD/rimd" --help | tr '\n' ' ')" "Exit status: 0 stopped, 2 usage, 3 .*, 4 memory is damaged and on_damage = restart"
check "-h is --help" "$("$BUILD/rimd" --help)" "$("$BUILD/rimd" -h)"
contains "version" "$("$BUILD/rimd" --version)" "^rimd [0-9]*\.[0-9]*\.[0-9]*$"
"$BUILD/rimd" good.conf --state > said 2>&1; check "an option without its argument" 2 $?
contains "an option without its argument: said" "$(cat said)" "state needs an argument"
for name in "" "$(printf 'x%.0s' $(seq 300))"; do
  "$BUILD/rimd" --check good.conf --state "$name" > said 2>&1; check "a state's name of ${#name} characters" 2 $?
done
"$BUILD/rimd" --state /nowhere/at/all good.conf > said 2>&1; check "the state of the command line is the one" 3 $?
contains "the state of the command line: said" "$(cat said)" "^rimd: /nowhere/at/all.tmp: No such file"
# What needs a state has it by the command line too, and instead of the file's.
head -c 32 /dev/urandom | od -An -v -tx1 | tr -d ' \n' > a.key; chmod 600 a.key
printf "image = toy.rim\n${lcm}key = a.key\n" > key.conf
said=$("$BUILD/rimd" --check key.conf 2>&1); check "a key without a state" 3 $?
contains "a key without a state: said" "$said" "^rimd: key.conf:3: key needs state"
said=$("$BUILD/rimd" --check --state here.state key.conf 2>&1); status=$?
case $said in *"without libsodium"*) echo "not here: rimd with libsodium"; skipped=$((skipped + 1)) ;; *) check "a key with --state" 0 $status ;; esac
case $said in *"needs state"*) bad "a key with --state: $said" ;; *) ok ;; esac
printf "image = toy.rim\n${lcm}state = /nowhere/at/all\n" > other.conf
timeout 20 "$BUILD/rimd" --state /nowhere/else other.conf > said 2>&1; check "the command line's state before the file's" 3 $?
contains "the command line's state before the file's: said" "$(cat said)" "^rimd: /nowhere/else.tmp: No such file"
# What the service checks before it starts is what it starts.
options() { sed -n "s/^$1=[^ ]*rimd //p" "$root/firmware/rimd/rimd.service.in"; }
check "the service checks what it starts" "--check $(options ExecStart)" "$(options ExecStartPre)"
printf "image = own.rim\n$lcm" > own.conf
contains "predictions are told" "$("$BUILD/rimd" --check own.conf)" "with their predictions"
# Without the rights that real time takes. (setpriv leaves root everything else.)
if [ "$(id -u)" = 0 ] && command -v setpriv prlimit > /dev/null; then
  for right in ipc_lock:'mlock = yes':mlock sys_nice:'fifo_priority = 10':fifo_priority; do
    case ${SANITIZE:+$right} in ipc_lock*) continue ;; esac # with them mlockall() does nothing
    printf 'image = toy.rim\nlcm_interface = 127.0.0.1\n%b%s\n' "$lcm" "$(echo "$right" | cut -d: -f2)" > real.conf
    timeout 20 prlimit --memlock=65536 --rtprio=0 setpriv --bounding-set="-${right%%:*}" "$BUILD/rimd" real.conf > said 2>&1
    check "${right%%:*} is missing" 3 $?
    contains "${right%%:*} is missing: said" "$(cat said)" "^rimd: ${right##*:}: .*is needed"
  done
else
  echo "not here: rights that are missing (root and setpriv)"; skipped=$((skipped + 1))
fi

python3 "$root/tests/firmware/rimd_test.py" "$BUILD/rimd" "$root/lib/wire" . > python.txt 2>&1
sed '$d' python.txt
read -r p f s < <(awk 'END {if (match($0, /^[0-9]+ passed, [0-9]+ failed/)) print $1+0, $3+0, (NF > 4 ? $5 : 0); else print 0, 1, 0}' python.txt)
[ "$p" = 0 ] && cat python.txt
passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
finish
