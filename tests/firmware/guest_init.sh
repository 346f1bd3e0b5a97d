# SPDX-License-Identifier: MIT
# guest_init.sh: what is asked of rimd and SocketCAN inside the guest, whose clock counts instructions: waiting costs
# nothing, and a busy machine changes nothing. Prints 'ok WHAT' or 'FAILED WHAT' for
# each check, files between '== NAME' and '== end', and 'guest done' last.
ip() { /tools/ip "$@"; } # not busybox's
tc() { /tools/tc "$@"; }
say() { echo "$@"; }
check() { if [ "$2" = "$3" ]; then say "ok $1"; else say "FAILED $1: $3 instead of $2"; fi; }
true_is() { if [ "$2" = 0 ]; then say "ok $1"; else say "FAILED $1"; fi; }
has() { if grep -q "$3" "$2"; then say "ok $1"; else say "FAILED $1: no '$3' in $2: $(tail -n 3 "$2")"; fi; }
show() { say "== $1"; cat "$1"; say "== end"; }
until_in() { # FILE PATTERN: waits at most 30 s
  for _ in $(seq 300); do grep -q "$2" "$1" 2> /dev/null && return 0; usleep 100000; done
  return 1
}
start() { # NAME: rimd with NAME.conf, its messages in NAME.said
  ./rimd "$1.conf" 2> "$1.said" & daemon=$!
  until_in "$1.said" "rimd: ready"; true_is "$1 is ready" $?
}
stop() { # NAME
  kill $daemon; wait $daemon; check "$1 ends" 0 $?
}
counted() { # WHAT NAME COUNTER: its value when the daemon ended
  value=$(sed -n "s/.* $3 \([0-9]*\).*/\1/p" "$2.said" | tail -n 1); echo "${value:-0}"
}
listen() { # NAME INTERFACE [OPTION]
  ./rim listen --can "$2" --model toy.rim $3 > "$1.jsonl" 2> "$1.err" & listener=$!
  until_in "$1.err" "listening on"; true_is "$1: listening" $?
}
raised() { grep -c '"state":"raised"' "$1"; }
play() { canplayer -t -g "${3:-1}" -I "$1" "$2=can0" > /dev/null; }

ip link set lo up; ip route add 224.0.0.0/4 dev lo
for i in can0 can1; do ip link set $i type can bitrate 500000 restart-ms 100; ip link set $i txqueuelen 64; ip link set $i up; done
for i in vcan0 vcan1 vcan2; do ip link add dev $i type vcan; done
ip link set vcan0 mtu 72
for i in vcan0 vcan1 vcan2; do ip link set $i up; done
common='image = toy.rim\ninput = can\nhealth_ms = 200\n'

# 1. Two controllers on one bus: observations by canplayer on can1 into rimd on can0, its alarms back to can1.
url='udpm://239.255.76.67:7667?ttl=0'
printf "${common}can = can0\nnode = 5\nlatch = yes\ncommand_any = yes\nlcm = $url\nlcm_interface = 127.0.0.1\naxis_x = s.position_a_m\n" > bus.conf
listen all can1 --all; everything=$listener
listen heard can1
candump -L can1,180:780,200:780,280:780,380:780,480:780,700:780 > wire.candump & dumper=$!
start bus
usleep 500000
cangen can1 -g 1 -I 7A5 -L 8 -n 200 & noise=$!
play biased.candump can1
wait $noise
cansend can1 102#00
cansend can1 102#R
cansend can1 00000102#0102030405060708
until_in heard.jsonl '"state":"raised"'; true_is "the alarm is heard on the other controller" $?
usleep 1500000
check "raised once" 1 "$(raised heard.jsonl)"
has "a person can read it" heard.jsonl 'speed reads 0\.[0-9]* m'
# A plan over LCM that leads there: the warning comes over CAN.
./send_datagram plan.datagram 239.255.76.67 7667; true_is "a plan" $?
until_in heard.jsonl '"message":"entry".*"to_entry_s":[0-9]'; true_is "the entry is told on the other controller" $?
until_in all.jsonl '"message":"heartbeat","node":5,"level":"ERROR".*"observations":1200'; true_is "and the heartbeat" $?
./rim command acknowledge --any --can can1 --node 4; ./rim command acknowledge --any --can can1 --node 5
usleep 500000
ip link set can0 down
usleep 700000
kill -0 $daemon; true_is "lives while its interface is down" $?
before=$(grep -c 705# wire.candump)
ip link set can0 up
for _ in $(seq 50); do [ "$(grep -c 705# wire.candump)" -gt "$before" ] && break; usleep 100000; done
[ "$(grep -c 705# wire.candump)" -gt "$before" ]; true_is "heartbeats again when the interface is up" $?
until_in all.jsonl '"acknowledged":true'; true_is "the heartbeat says that it was acknowledged" $?
stop bus
kill $listener $dumper $everything; wait $listener; check "the listener ends" 0 $?
check "every frame of the table was read, none of the others" 2401 "$(counted frames bus can_frames)"
check "a wrong length" 1 "$(counted length bus can_refused)"
check "all rows" 1200 "$(counted rows bus rows)"
check "one command" 1 "$(counted commands bus commands)"
check "the interface was down once, in and out" 2 "$(counted down bus can_down)"
has "the finding, page by page" wire.candump ' 485#01'
show bus.said
show heard.jsonl
show wire.candump
# The ground's replay, sent on the bus with its flag, through a queue that is too short for it.
ip link set can0 down; ip link set can0 txqueuelen 2; ip link set can0 up
listen replay can1
./rim replay --model toy.rim biased.candump --candump classic.candump --node 7 > said; check "rim replay --candump" 0 $?
./rim replay --model toy.rim biased.candump --can can0 --node 9 > said; check "rim replay --can" 0 $?
until_in replay.jsonl '"state":"raised".*"replay":true'; true_is "is heard as a replay" $?
[ "$(grep -c '"replay":false' replay.jsonl)" = 0 ]; true_is "and as nothing else" $?
kill $listener; wait $listener
show replay.jsonl
ip link set can0 down
./rim replay --model toy.rim biased.candump --can can0 > said 2>&1; check "rim replay --can, the interface down" 3 $?
has "says why" said "can0: Network is down"

# 2. A full queue: 1 kbit/s on vcan1. The newest summary comes through, detail is dropped and counted.
tc qdisc add dev vcan1 root tbf rate 1kbit burst 32 limit 64; true_is "a slow queue" $?
printf "${common}can = vcan1\ncan_input = vcan2\nnode = 6\n" > full.conf
candump -L vcan1,180:780 > full.candump & dumper=$!
start full
play biased.candump vcan2
usleep 1500000
stop full
kill $dumper
[ "$(counted full full can_full)" -gt 0 ]; true_is "ENOBUFS was met" $?
[ "$(counted unsent full can_unsent)" -gt 0 ]; true_is "detail was dropped and counted" $?
check "no step was held up" 1200 "$(counted rows full rows)"
tail -n 1 full.candump > last; has "the last summary says ERROR" last '186#[0-9A-F][26A]'
show full.said

# 3. FD: one frame of 64 bytes.
printf "${common}can = vcan0\ncan_input = vcan2\ncan_fd = yes\nnode = 7\n" > fd.conf
listen fd vcan0
candump -L vcan0 > fd.candump & dumper=$!
start fd
play biased.candump vcan2
until_in fd.jsonl '"state":"raised"'; true_is "heard over FD" $?
usleep 600000
has "64 bytes in one frame" fd.candump '287##[15][0-9A-F]\{128\}$'
grep -q ' 287#[0-9A-F]' fd.candump; check "no segments" 1 $?
# An error frame says that the controller left the bus; the next frame that comes says that it is back.
cansend vcan0 20000040#0000000000000000
usleep 300000
cansend vcan2 101#0000000000000000
usleep 700000
before=$(grep -c 787# fd.candump)
kill -0 $daemon; true_is "lives through bus-off" $?
usleep 500000
[ "$(grep -c ' 707#' fd.candump)" -gt 5 ]; true_is "heartbeats go on after bus-off" $?
ip link del vcan2; usleep 300000
ip link add dev vcan2 type vcan; ip link set vcan2 up; usleep 600000
canplayer -t -g 1 -I again.candump vcan2=can0 > /dev/null
usleep 300000
stop fd
kill $listener $dumper
check "the bus-off was counted" 1 "$(counted bus_off fd can_bus_off)"
[ "$(counted rows fd rows)" -gt 1200 ]; true_is "an interface taken away and put back is read again" $?
show fd.said
show fd.jsonl
show fd.candump

# 4. Interfaces that are not what was asked for.
printf "${common}can = can0\ncan_input = can0\ncan_fd = yes\n" > classic.conf
start classic
stop classic
has "FD on a classic interface is told" classic.said "takes no FD frames"
printf "${common}can = can7\n" > gone.conf
start gone
has "an interface that is not there yet is told" gone.said "can7: no such interface yet"
ip link add dev can7 type vcan; ip link set can7 up
candump -L -n 3 can7,700:780 > gone.candump & dumper=$!
until_in gone.candump '701#'; true_is "and used when it comes" $?
kill $dumper 2> /dev/null
stop gone
# 5. The kernel's own ISO-TP puts a detail together. It offers flow control, under an identifier that nobody reads.
isotprecv -s 7FF -d 287 vcan1 > isotp.hex & receiver=$!
usleep 300000
grep ' 287#' classic.candump | head -n 25 | sed 's/^([^)]*) [a-z0-9]*/(0.000000) vcan1/' > one.candump
check "a detail has 25 segments" 25 "$(grep -c '287#' one.candump)"
tc qdisc del dev vcan1 root
canplayer -t -g 1 -I one.candump vcan1=vcan1 > /dev/null
usleep 300000
kill $receiver 2> /dev/null
check "174 bytes by the kernel's ISO-TP" 174 "$(wc -w < isotp.hex)"
has "of layout 2" isotp.hex '^02 '
say "guest done"
