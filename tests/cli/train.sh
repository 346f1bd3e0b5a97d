#!/bin/bash
# SPDX-License-Identifier: MIT
# rim train: what it prints, that it promises no more than it can, that the image is a function of the logs.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
cd "$here" || exit 1
toy_runs 700

out=$("$RIM" train run*.csv --out toy.rim); check "train" 0 $?
for text in "20 runs, 14000 rows at 20 Hz: 3 sensors, 1 command," "each run predicted without itself" "filtered commands" "'Seen from' is the constant offset" \
  "promised: at most 4.8 % of healthy runs" "highest of the 20 runs" "features may describe a region" "RAM of one monitor" "toy.rim written"; do
  contains "train prints" "$out" "$text"
done
contains "R2 and error in the sensor's unit" "$out" "^speed  *m/s  *[01]\.[0-9]*  *0\.0[0-9]"
[ "$(head -c 6 toy.rim)" = RIMIMG ]; check "an image" 0 $?
whole=$(printf '%s\n' "$out" | awk '/^whole image/{print $NF}')
check "its size is told" "$whole" "$(stat -c %s toy.rim)"

# From here on blocks of .6 s instead of .15: what is compared are bytes, which take a third of the time so.
train() { "$RIM" train "$@" --quick --block-seconds 0.6; }
train run*.csv --out toy.rim > /dev/null
RIM_THREADS=1 train run*.csv --out one.rim > /dev/null
cmp -s toy.rim one.rim; check "one thread, the same image" 0 $?
train run*.csv --out again.rim --threads 4 > /dev/null
cmp -s toy.rim again.rim; check "four threads, the same image" 0 $?
# (Of eleven runs or fewer everything is learnt again without each: more runs are learnt in less time.)
train run0*.csv run1[0-2].csv --out other.rim > /dev/null
! cmp -s toy.rim other.rim; check "other logs, another image" 0 $?

# Parts of the work teach what the whole does, in any order; what does not belong together is refused.
for i in 1 2 3 4 5 6 7 8; do
  out=$("$RIM" train run*.csv --shard $i/8 --block-seconds 0.6 --out $i.part); check "shard $i" 0 $?
done
contains "what a part holds" "$out" "^8.part written: the blocks of 2 of 20 runs"
"$RIM" train --merge [4-8].part [1-3].part --out merged.rim > said; check "learnt from eight parts" 0 $?
cmp -s toy.rim merged.rim; check "the same image" 0 $?
contains "of all runs" "$(cat said)" "^20 runs, 14000 rows at 20 Hz: 3 sensors, 1 command,"
err=$("$RIM" train --merge [1-7].part --out no.rim 2>&1 >/dev/null); check "a part is missing" 3 $?
contains "a part is missing: the run is named" "$err" "run08.csv: its blocks are in none of the 7 part files"
err=$("$RIM" train --merge run01.csv --out no.rim 2>&1 >/dev/null); check "a log instead of a part" 3 $?
contains "a log instead of a part: named" "$err" "run01.csv: is no part of a training"
"$RIM" train run0*.csv --shard 8/8 --block-seconds 0.6 --out few.part > /dev/null
err=$("$RIM" train --merge [1-7].part few.part --out no.rim 2>&1 >/dev/null); check "a part of other logs" 3 $?
contains "a part of other logs: named" "$err" "few.part: is of other logs"
for wrong in "--shard 9/8" "--shard 1/2 --merge" "--merge --block-seconds 1" "--shard 1/2 --interference labels.csv"; do
  "$RIM" train run*.csv $wrong --out no.rim 2> /dev/null; check "$wrong" 2 $?
done
[ ! -e no.rim ]; check "nothing is left behind" 0 $?

for i in 1 2 3 4 5 6 7 8; do head -n 401 run0$i.csv > few$i.csv; done
out=$(train few[1-8].csv --out few.rim)
contains "too few runs: said" "$out" "with 8 runs no rate below 11.1 % can be promised, which is used (5 % was asked for)"
contains "too few runs: how many it takes" "$out" "19 runs are the least for 5 %"
contains "too few runs: the rate used" "$out" "promised: at most 11.1 %"
out=$(train run*.csv --out half.rim --false-alarm 0.5)
contains "another rate" "$out" "promised: at most 47.6 %"

# What is odd about the logs is named.
cp run03.csv copy.csv
awk -F, -v OFS=, 'NR > 350 {$5 += 2} {print}' run04.csv > odd.csv
err=$(train run*.csv copy.csv --out same.rim 2>&1 >/dev/null); check "the same run twice" 0 $?
contains "the same run twice: named" "$err" "copy.csv holds the same rows as run03.csv"
err=$(train run*.csv odd.csv --out odd.rim 2>&1 >/dev/null); check "a run unlike the others" 0 $?
contains "a run unlike the others: named" "$err" "odd.csv is unlike the other runs.*'s.speed_mps' deviates most"
out=$(train run*.csv odd.csv --leave-out-unlike --out without.rim); check "without the run unlike the others" 0 $?
contains "what was left out" "$out" "^left out: odd.csv, a run unlike the others (score [1-9]"
contains "the rest was learnt" "$out" "^20 runs, 14000 rows"
cmp -s toy.rim without.rim; check "the image of the others alone" 0 $?
train run*.csv --leave-out-unlike --out same.rim > /dev/null
cmp -s toy.rim same.rim; check "none is unlike: nothing is left out" 0 $?
"$RIM" train run*.csv --leave-out-unlike --shard 1/2 --out x.part 2> err; check "not of a shard" 2 $?
contains "not of a shard: said" "$(cat err)" "needs the logs"
awk -F, -v OFS=, 'NR > 1 {$1 = sprintf("%.2f", 2 * $1)} {print}' run05.csv > slow.csv
err=$("$RIM" train run*.csv slow.csv --out no.rim 2>&1 >/dev/null); check "another rate" 3 $?
contains "another rate: named" "$err" "slow.csv: its rows come at 10 Hz, those of the other runs at 20 Hz"

# A plant whose rows come every 20 seconds: no silence of two seconds between them is one.
plant() { awk -F, -v OFS=, 'NR > 1 {$1 = sprintf("%.0f", 400 * $1)} {print}' "$1" > "$2"; }
for i in 01 02 03 04 05 06 07 08 09 10 11 12; do plant run$i.csv plant$i.csv; done
"$RIM" train plant*.csv --out plant.rim --quick --block-seconds 240 > /dev/null; check "rows every 20 s" 0 $?
toy wrong.csv 99 700 'if (i > 350) v += 0.3'
plant wrong.csv plant_wrong.csv
out=$("$RIM" replay --model plant.rim plant_wrong.csv --fail-on-alarm); check "rows every 20 s: found" 1 $?
contains "rows every 20 s: said" "$out" "speed reads 0.[23][0-9]* m/s high"

# Logs with their own predictions: noise, effects of the run and thresholds alone.
for i in 01 02 03 04 05 06; do
  awk -F, -v OFS=, 'NR == 1 {print "t_s,x.push,z.position_m,m.position_m,sd.position_m"; next} {print $1, $2, $3, $4, 0.05}' run$i.csv > own$i.csv
done
out=$("$RIM" train own*.csv --out own.rim); check "own predictions" 0 $?
contains "own predictions: said" "$out" "^position  *m  *-  *- .*your own"
"$RIM" replay --model own.rim own01.csv --fail-on-alarm > /dev/null; check "own predictions: healthy" 0 $?

err=$("$RIM" train run01.csv run02.csv --out two.rim 2>&1 >/dev/null); check "two logs" 3 $?
contains "two logs: reason" "$err" "at least 3 logs"
[ ! -e two.rim ]; check "two logs: no image" 0 $?
cut -d, -f1-4 run03.csv > narrow.csv
err=$("$RIM" train run01.csv run02.csv narrow.csv --out no.rim 2>&1 >/dev/null); check "a column less" 3 $?
contains "a column less: named" "$err" "narrow.csv: column 's.speed_mps' is missing"
err=$("$RIM" train run01.csv --false-alarm 2 --out no.rim 2>&1 >/dev/null); check "a rate of 2" 2 $?
err=$("$RIM" train run0*.csv --out no/where/x.rim 2>&1 >/dev/null); check "no such folder" 3 $?
contains "no such folder: named" "$err" "no/where/x.rim"
finish
