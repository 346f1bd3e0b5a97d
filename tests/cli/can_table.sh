#!/bin/bash
# SPDX-License-Identifier: MIT
# rim can-table: a DBC and a map into a flight image; whatever is wrong with either is told with its line.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
cd "$here" || exit 1
toy_model toy.rim
cp "$root/tests/firmware/toy.dbc" "$root/tests/firmware/toy.toml" .

said=$("$RIM" can-table --dbc toy.dbc --map toy.toml --model toy.rim --out can.rim); check "can-table" 0 $?
contains "what it made" "$said" "4 values from 5 signals of 2 messages, table of 280 bytes; a row is complete with its trigger, its time is a signal"
toy log.csv 102 600 'a += 0.5'
check "the image replays as before" "$("$RIM" replay --model toy.rim log.csv | tail -n 1)" "$("$RIM" replay --model can.rim log.csv | tail -n 1)"
"$RIM" can-table --dbc toy.dbc --map toy.toml --model can.rim --out again.rim > /dev/null; check "a second time" 0 $?
cmp -s can.rim again.rim; check "takes the place of the first" 0 $?
"$RIM" can-table --help | grep -q '^  rim can-table --dbc'; check "help ends in an example" 0 $?

refuses() { # WHAT PATTERN DBC MAP
  rm -f out.rim
  said=$("$RIM" can-table --dbc "$3" --map "$4" --model toy.rim --out out.rim 2>&1); check "$1" 3 $?
  contains "$1: said" "$said" "$2"
  [ ! -e out.rim ]; check "$1: nothing written" 0 $?
}
dbc() { sed "$1" toy.dbc > bad.dbc; }   # the DBC, changed by sed
map() { sed "$1" toy.toml > bad.toml; }
# As others write it: tabs, blanks, a byte order mark, a comment whose lines look like others.
dbc '1s/^/\xef\xbb\xbf/; s/^ SG_ /\tSG_\t/; s/^BO_ /BO_\t/; s/(\(.*\),\(.*\)) *\[/( \1 , \2 ) [/; s/\(SIG_VALTYPE_.*\) : /\1 /'
printf 'CM_ SG_ 258 Speed "by \\"wheel\\"\nSG_ of old,\nBO_ as well";\n' >> bad.dbc
"$RIM" can-table --dbc bad.dbc --map toy.toml --model toy.rim --out other.rim > /dev/null; check "the same DBC otherwise" 0 $?
cmp -s other.rim can.rim; check "the same table" 0 $?
printf 'CM_ "for ever\n' >> bad.dbc; refuses "a comment without an end" "bad.dbc:line [0-9]*: the comment has no end" bad.dbc toy.toml
dbc '/Speed/s/|16@/|@/'; refuses "a signal's form" "bad.dbc:line 16: not 'SG_ " bad.dbc toy.toml
dbc '/BO_ 258/s/: 8/8/'; refuses "a message's form" "bad.dbc:line 13: not 'BO_ " bad.dbc toy.toml
dbc '/BO_ 258/s/258/257/'; refuses "an identifier twice" "bad.dbc:line 13: message Drive stands on line 9 already" bad.dbc toy.toml
dbc '/Push/s/Push/Clock/'; refuses "a signal twice" "bad.dbc:line 15: signal Clock stands on line 14 already" bad.dbc toy.toml
dbc '/Speed/s/48|16/56|16/'; refuses "a signal outside its message" "outside its message" bad.dbc toy.toml
dbc '/Speed/s/48|16/9999|16/'; refuses "a start bit too large" "start bit 9999 is too large" bad.dbc toy.toml
dbc '/Speed/s/0.0001,0/0,0/'; refuses "a scale of 0" "not good" bad.dbc toy.toml
dbc '/Speed/s/0.0001,0/1e999,0/'; refuses "a scale too large" "bad.dbc:line 16: '1e999' is not a finite number" bad.dbc toy.toml
dbc '/Speed/s/Speed/Speed m1/'; refuses "a selected signal without a selector" "has no selector" bad.dbc toy.toml
dbc '/Speed/s/Speed/Speed m1M/'; refuses "two selectors" "more than one selector" bad.dbc toy.toml
dbc '/PositionA : 1/s/257/999/'; refuses "a type of no message" "there is no message 999" bad.dbc toy.toml
dbc '/PositionA : 1/s/: 1/: 2/'; refuses "a type of another size" "has 32 bits, its type 64" bad.dbc toy.toml
dbc '/^BO_/d; /^ SG_/d'; refuses "no messages" "no message" bad.dbc toy.toml
printf ' SG_ x : 0|8@1+ (1,0) [0|0] "" X\n' > bad.dbc; refuses "a signal first" "bad.dbc:line 1: a signal before any message" bad.dbc toy.toml
noise 40 3000 > bad.dbc; refuses "noise" "bad.dbc" bad.dbc toy.toml
refuses "no DBC" "absent.dbc" absent.dbc toy.toml
map 's/rim-can/rim-cam/'; refuses "another schema" "schema must be" toy.dbc bad.toml
map '/schema/d'; refuses "no schema" "schema = .* is missing" toy.dbc bad.toml
map 's/Drive.Push/Drive.Pull/'; refuses "a signal that is not there" "bad.toml:line 1[0-9]: message Drive of toy.dbc has no signal 'Pull'" toy.dbc bad.toml
map 's/Drive.Push/Push/'; refuses "no message" "'Push' is no MESSAGE.SIGNAL" toy.dbc bad.toml
map 's/u.push/u.pull/'; refuses "a value the model has not" "the model has no 'u.pull'" toy.dbc bad.toml
map 's/u.push/s.speed_mps/'; refuses "a value twice" "twice" toy.dbc bad.toml
map '/u.push/d'; refuses "a signal without a name" "name and from are needed" toy.dbc bad.toml
map 's/trigger = "Drive"/trigger = "Drift"/'; refuses "a trigger that is not there" "'Drift' is no message" toy.dbc bad.toml
map 's/trigger = "Drive"/trigger = "Lamps"/'; refuses "a trigger without a value" "carries no value" toy.dbc bad.toml
map 's/min = -1000/low = -1000/'; refuses "an unknown key" "unknown key 'low'" toy.dbc bad.toml
map 's/min = -1000/min = 2000/'; refuses "min above max" "min above max" toy.dbc bad.toml
map '/name = "s.speed_mps"/,$d' ; sed -i '$d' bad.toml; refuses "a value without a signal" "no signal 's_speed_mps' for the model's 's.speed_mps'" toy.dbc bad.toml
"$RIM" can-table --dbc toy.dbc --map toy.toml --model log.csv --out out.rim 2> /dev/null; check "no image" 3 $?
"$RIM" can-table --dbc toy.dbc --model toy.rim --out out.rim 2> said; check "without a map not all are found" 3 $?
"$RIM" can-table --dbc toy.dbc 2> /dev/null; check "usage" 2 $?

# rim listen and rim command on a machine without the interface, or without CAN.
said=$("$RIM" listen --can nocan0 --seconds 1 2>&1); check "listen: no interface" 3 $?
contains "listen: said" "$said" "nocan0: .*\(no CAN\|no such interface\)"
said=$("$RIM" command acknowledge --any --can nocan0 2>&1); check "command: no interface" 3 $?
contains "command: said" "$said" "nocan0: .*\(no CAN\|no such interface\)"
"$RIM" command forget 2> /dev/null; check "command: unknown" 2 $?
said=$("$RIM" command clear --can nocan0 --sequence 3 2>&1); check "command: which alarm?" 2 $?
contains "command: names what is missing" "$said" "model-id say which alarm"

# A candump log replays where the image has a table.
python3 "$root/tests/firmware/toy_can.py" log.csv > log.candump
out=$("$RIM" replay --model can.rim log.candump 2> err); check "a candump log" 0 $?
contains "found" "$out" "^log.candump: FOUND at t = "
contains "every row" "$out" "rows: 600 used, 0 skipped"
check "quietly" "" "$(cat err)"
sed -e '100s/102#/102#00/' -e '200s/#/ /' -e '301s/101#.*/101#0000C07F00000000/' -e '5i (1700000000.1) can0 123#R' -e '6i (1700000000.1) can0 00000101#00' log.candump > bad.candump
contains "its speed" "$("$RIM" bench --replay can.rim log.candump 2>&1)" "^Replay of log.candump: [0-9]* rows in "
out=$("$RIM" replay --model can.rim bad.candump 2> err); check "a damaged one" 0 $?
contains "damage is counted" "$(cat err)" "bad.candump: [2-9] frames or rows skipped, the first: line "
err=$("$RIM" replay --model toy.rim log.candump 2>&1 > /dev/null); check "without a table" 3 $?
contains "without a table: said" "$err" "give a model with a CAN table"
printf '(1700000000.000000) can0 7FF#00\n' > none.candump
err=$("$RIM" replay --model can.rim none.candump 2>&1 > /dev/null); check "no row" 3 $?
contains "no row: said" "$err" "its frames make no row"
finish
