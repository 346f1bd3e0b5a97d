#!/bin/bash
# SPDX-License-Identifier: MIT
# Bad images, logs and disks into `rim replay`: what and where on stderr, exit 3, nothing under the final name.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
cd "$here" || exit 1
for i in $(seq 12); do toy "run$i.csv" "$i" 600; done
"$RIM" train run*.csv --out toy.rim --quick > /dev/null || bad "train"
toy log.csv 50 600 'a += 0.6'
"$RIM" replay --model toy.rim log.csv > good.txt || bad "the good log"

refused() { # refused WHAT MODEL LOG PATTERN...: exit 3, the reason, and no output file
  local what=$1 model=$2 log=$3 err rc; shift 3
  err=$("$RIM" replay --model "$model" "$log" --alarms out.jsonl --labels out.csv --trace out.trace --candump out.can \
    --plot out.svg 2>&1 >/dev/null); rc=$?
  check "$what: exit status" 3 "$rc"
  for pattern in "$@"; do contains "$what" "$err" "$pattern"; done
  [ -z "$(find . -name 'out.*')" ]; check "$what: nothing left behind" 0 $?
}

# Images. The header: magic 8, endian tag 4, major 2, minor 2, bytes 4, model 4, sections 4, CRC 4, header CRC 4.
python3 - << 'END'
import struct, zlib
whole = open("toy.rim", "rb").read()
def write(name, data): open(name, "wb").write(data)
def with_header(name, at, new):
    header = bytearray(whole[:64]); header[at:at + len(new)] = new
    header[32:36] = bytes(4); header[32:36] = struct.pack("<I", zlib.crc32(bytes(header)))
    write(name, bytes(header) + whole[64:])
write("empty.rim", b"")
for cut in (1, 63, 64, 500, len(whole) - 1): write(f"cut{cut if cut < 1000 else 'last'}.rim", whole[:cut])
for k, at in enumerate((3, 9, 70, 200, len(whole) // 2, len(whole) - 3)):
    flipped = bytearray(whole); flipped[at] ^= 0x10; write(f"flip{k}.rim", bytes(flipped))
with_header("same.rim", 8, whole[8:12])
with_header("version.rim", 12, struct.pack("<H", 99))
with_header("endian.rim", 8, whole[8:12][::-1])
write("text.rim", b"hello\n" * 100)
END
cmp -s same.rim toy.rim; check "the test's own header CRC is right" 0 $?
refused "an empty image" empty.rim log.csv "empty.rim: is empty"
for cut in 1 63 64 500 last; do refused "an image cut at $cut" cut$cut.rim log.csv "cut$cut.rim: .*truncated\|cut$cut.rim: .*short\|cut$cut.rim: is no flight image"; done
for k in 0 1 2 3 4 5; do refused "a bit flipped ($k)" flip$k.rim log.csv "flip$k.rim: \(not a flight image\|is no flight image\)"; done
refused "another version" version.rim log.csv "version.rim: .*unsupported version; .rim train. makes it anew"
refused "another endianness" endian.rim log.csv "endian.rim: .*swapped"
refused "a text file" text.rim log.csv "text.rim: is no flight image"
mkdir folder; refused "a folder as image" folder log.csv "folder: is a folder"
refused "no image" none.rim log.csv "none.rim: .*No such file"

# Logs.
refused "no log" toy.rim none.csv "none.csv: .*No such file"
refused "a folder as log" toy.rim folder "folder: is a folder"
: > empty.csv; refused "an empty log" toy.rim empty.csv "empty.csv: .*empty"
cut -d, -f1-4 log.csv > narrow.csv; refused "a column is missing" toy.rim narrow.csv "narrow.csv: column 's.speed_mps' is missing"
sed '4s/,[^,]*$//' log.csv > short.csv; refused "a row too short" toy.rim short.csv "short.csv:row 3: .*4 fields\|short.csv.*row 3.*fields"
sed '5s/$/,7/' log.csv > long.csv; refused "a row too long" toy.rim long.csv "long.csv.*row 4.*fields"
awk -F, 'NR==10{print; print; next} {print}' log.csv > again.csv; refused "time that repeats" toy.rim again.csv "again.csv.*row 10: column 't_s'" "repeats"
awk -F, -v OFS=, 'NR==10{$1=0.1} {print}' log.csv > back.csv; refused "time that runs backwards" toy.rim back.csv "back.csv.*row 9: column 't_s'" "backwards"
sed '8s/,[^,]*$/,x1/' log.csv > text.csv; refused "text in a number" toy.rim text.csv "text.csv.*row 7: column 's.speed_mps': 'x1'"

# Holes: skipped, counted, and the rest is used.
for hole in nan inf -inf ''; do
  sed "300s/,[^,]*\$/,$hole/" log.csv > hole.csv
  out=$("$RIM" replay --model toy.rim hole.csv --labels hole_labels.csv 2>err.txt); check "a row with '$hole'" 0 $?
  contains "a row with '$hole' is counted" "$out" "rows: 599 used, 1 skipped"
  contains "a row with '$hole' is named" "$(cat err.txt)" "hole.csv.*row 299: column 's.speed_mps'"
  check "a row with '$hole' has a label" "hole.csv,299,,0" "$(sed -n 300p hole_labels.csv)"
  check "and so has every other" 601 "$(wc -l < hole_labels.csv)"
done
out=$("$RIM" replay --model toy.rim back.csv --skip-bad-time 2>/dev/null); check "--skip-bad-time" 0 $?
contains "--skip-bad-time counts" "$out" "rows: 599 used, 1 skipped"
sed '200,230d' log.csv > gap.csv
contains "a gap is counted" "$("$RIM" replay --model toy.rim gap.csv)" "1 gap"

# Outputs that would replace what is read, another output, or a log that `*.csv` put behind --out: nothing is touched.
cp log.csv in.csv; ln in.csv hard.csv; ln -s in.csv soft.csv; cp toy.rim mine.rim
before=$(cksum in.csv mine.rim)
same() { # same WHAT PATTERN COMMAND...: exit 2, both are named, the inputs stay
  local what=$1 pattern=$2 err; shift 2
  err=$("$RIM" "$@" 2>&1 >/dev/null); check "$what: exit status" 2 $?
  contains "$what" "$err" "$pattern"
  check "$what: the inputs stay" "$before" "$(cksum in.csv mine.rim)"
  cp log.csv in.csv; cp toy.rim mine.rim
}
for option in --alarms --labels --trace --candump --report; do
  same "$option over the log" "$option in.csv and LOG in.csv name the same file" replay --model mine.rim in.csv $option in.csv
done
same "by another path" "--alarms ./in.csv and LOG in.csv name" replay --model mine.rim in.csv --alarms ./in.csv
same "by a link" "--alarms soft.csv and LOG in.csv name" replay --model mine.rim in.csv --alarms soft.csv
same "by a second name" "--alarms hard.csv and LOG in.csv name" replay --model mine.rim in.csv --alarms hard.csv
same "over the model" "--labels mine.rim and --model mine.rim name" replay --model mine.rim in.csv --labels mine.rim
same "two outputs" "--alarms o.txt and --labels ./o.txt name the same file" replay --model mine.rim in.csv --alarms o.txt --labels ./o.txt
same "a table over its model" "--out mine.rim and --model mine.rim name" can-table --dbc in.csv --model mine.rim --out mine.rim
same "an image over a log" "--out: in.csv is there already and is no flight image" train --quick --out in.csv run*.csv
same "a table over the DBC" "--out: in.csv is there already and is no flight image" can-table --dbc in.csv --model mine.rim --out in.csv
[ ! -e o.txt ]; check "two outputs: nothing written" 0 $?
"$RIM" replay --model mine.rim in.csv --alarms /dev/null --labels /dev/null > /dev/null; check "two outputs into a device" 0 $?

# A run of a single row among others.
head -2 run1.csv > single.csv
err=$("$RIM" train run*.csv single.csv --quick --out one.rim 2>&1 >/dev/null); check "a single row" 3 $?
contains "a single row: which" "$err" "single.csv: has fewer than two rows"

# Disks.
for option in --alarms --labels --trace --candump; do
  err=$("$RIM" replay --model toy.rim log.csv $option /dev/full 2>&1 >/dev/null); check "$option on a full disk" 3 $?
  contains "$option on a full disk: said" "$err" "/dev/full: .*No space"
done
err=$("$RIM" replay --model toy.rim log.csv --alarms folder 2>&1 >/dev/null); check "output is a folder" 3 $?
err=$("$RIM" replay --model toy.rim log.csv --alarms folder/no/a.jsonl 2>&1 >/dev/null); check "output in no folder" 3 $?
"$RIM" replay --model toy.rim log.csv > /dev/full 2>/dev/null; check "standard output full" 3 $?
mkdir small
if [ "$(id -u)" = 0 ] && mount -t tmpfs -o size=16k tmpfs small 2>/dev/null; then
  trap 'umount "$here/small"; rm -rf "$here"' EXIT
  for option in --labels --trace --plot; do
    name=small/out.svg
    err=$("$RIM" replay --model toy.rim log.csv log.csv log.csv $option $name 2>&1 >/dev/null); check "$option on a small disk" 3 $?
    contains "$option on a small disk: said" "$err" "small/out"
    [ -z "$(ls small)" ]; check "$option on a small disk: nothing left" 0 $?
  done
  head -c 12288 /dev/zero > small/filler
  err=$("$RIM" train run*.csv --quick --out small/toy.rim 2>&1 >/dev/null); check "train on a small disk" 3 $?
  contains "train on a small disk: said" "$err" "small/toy.rim: .*No space"
  check "train on a small disk: nothing left" filler "$(ls small)"
  rm small/filler
  echo before > keep.txt; cp keep.txt small/kept.csv
  "$RIM" replay --model toy.rim log.csv log.csv log.csv --labels small/kept.csv > /dev/null 2>&1; check "over an older file" 3 $?
  cmp -s keep.txt small/kept.csv; check "the older file stays" 0 $?
else
  skipped=$((skipped + 1))
fi
check "the good log still replays" "$(cat good.txt)" "$("$RIM" replay --model toy.rim log.csv)"
finish
