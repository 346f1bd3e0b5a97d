#!/bin/bash
# SPDX-License-Identifier: MIT
# The program that ports carry, built for this machine: the digest of `rim replay`, and what it refuses.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
skip_under_sanitizers "it builds by itself what it tests, without them"
cd "$here" || exit 1
toy_few 5 600
toy log.csv 50 900 'if (i > 400) a += 0.6'
wanted=$("$RIM" replay --model toy.rim log.csv | tail -1)

flags="-std=c11 -O2 -ffp-contract=off -Wall -Wextra -Werror -I$root/firmware -I$root/lib/include -I$root/lib/src"
gcc $flags "$root/firmware/replay/record.c" -o record "$BUILD/librim.a" || bad "record does not build"
# fly RECORDING: what the program says of it
fly() {
  gcc -DRECORDING="\"$1\"" -c "$root/firmware/replay/recording.S" -o recording.o &&
    gcc $flags "$root/firmware/port/linux/port.c" "$root/firmware/replay/replay.c" "$root/firmware/replay/no_bus.c" recording.o -o fly "$BUILD/librim.a" &&
    ./fly
}
./record toy.rim log.csv toy.rec; check "record" 0 $?
said=$(fly toy.rec); check "replay" 0 $?
check "the digest of rim replay" "$wanted" "$(printf '%s\n' "$said" | tail -1)"
contains "rows" "$said" "^rows 900$"
contains "an alarm" "$said" "^alarm_records [1-9]"
bits=$(printf '%s\n' "$said" | grep '^bits ')
awk -F, -v OFS=, 'NR == 600 {$3 += 0.01} {print}' OFMT=%.12g CONVFMT=%.12g log.csv > near.csv
./record toy.rim near.csv near.rec
! [ "$(fly near.rec | grep '^bits ')" = "$bits" ]; check "a centimetre in one row changes the bits" 0 $?
awk -F, -v OFS=, '{print $1, $5, $4, $3, $2}' log.csv > order.csv
./record toy.rim order.csv order.rec && cmp -s order.rec toy.rec; check "columns by name" 0 $?

# damage BYTE: one byte of the recording changed
damage() {
  cp toy.rec bad.rec
  old=$(od -An -tu1 -j "$1" -N 1 bad.rec)
  printf "\\x$(printf %02x $((old ^ 1)))" | dd of=bad.rec bs=1 seek="$1" conv=notrunc status=none
}
size=$(stat -c %s toy.rec)
for at in 0 8 12 16 20 40 1000 $((size - 1)); do
  damage "$at"
  said=$(fly bad.rec); check "damage at $at is refused" 3 $?
  contains "damage at $at has a reason" "$said" "^refused: "
done
head -c $((size - 8)) toy.rec > bad.rec; fly bad.rec > said; check "a row cut" 3 $?
head -c 31 toy.rec > bad.rec; fly bad.rec > said; check "a header cut" 3 $?
: > bad.rec; fly bad.rec > said; check "nothing" 3 $?

# Own predictions: no training, the image from the log itself.
"$RIM" simulate golf --out golf --dims 5 --seed 3 > /dev/null || bad "simulate golf"
golf=golf/run_0001.csv
wanted=$("$RIM" replay "$golf" --calibration-runs 19 --save-model golf.rim | tail -1)
check "the saved model replays the same" "$wanted" "$("$RIM" replay --model golf.rim "$golf" | tail -1)"
./record golf.rim "$golf" golf.rec; check "record golf" 0 $?
check "the digest with own predictions" "$wanted" "$(fly golf.rec | tail -1)"
"$RIM" replay "$golf" --model golf.rim --save-model x.rim > said 2>&1; check "nothing new to save" 2 $?
"$RIM" replay "$golf" --save-model absent/x.rim > said 2>&1; check "no such folder" 3 $?

refuses() { # WHAT PATTERN IMAGE LOG
  reason=$(./record "$3" "$4" out.rec 2>&1); check "$1" 3 $?
  contains "$1: reason" "$reason" "$2"
}
cut -d, -f1-4 log.csv > short.csv
refuses "a column missing" "column 's.speed_mps' is missing" toy.rim short.csv
sed '9s/,[^,]*$/,x/' log.csv > word.csv
refuses "a word for a number" "row 8: field 5 is not a number" toy.rim word.csv
sed '1s/,sd\./,s./' "$golf" > no_sd.csv
refuses "no sd column" "column 'sd.reward' is missing" golf.rim no_sd.csv
refuses "no log" "No such file" toy.rim absent.csv
refuses "no image" "log.csv: " log.csv log.csv
./record 2> /dev/null; check "usage" 2 $?
finish
