#!/bin/bash
# SPDX-License-Identifier: MIT
# host_tools/campaign: shards on a cluster of this computer fold to what one machine computes, also when a worker is
# killed, and when the campaign itself is killed and started anew. PYTHON names one with dask.distributed.
# Mostly waits.
. "$(dirname "$0")/check.inc"
python=${PYTHON:-$BUILD/campaign/bin/python3}
skip_under_sanitizers "what it tests is Python, and campaigns of rim-thesis have scripts of their own"
if ! has_packages "$python" distributed; then
  skip "no dask.distributed for $python (make campaign-deps installs it)"
fi
cd "$here" || exit 1
campaign="$python $root/host_tools/campaign/campaign.py"
# A campaign that takes a second a shard: unit i is a function of i; what was computed is noted. The shard HELD says which
# process started it, and waits to be let go.
cat > work.sh << 'END'
#!/bin/bash
while [ $# -gt 0 ]; do case $1 in --shard) shard=$2 ;; --out) out=$2 ;; esac; shift 2; done
index=${shard%/*} count=${shard#*/}
echo "$index" >> computed.txt
[ "$index" != "${HELD:-0}" ] || { echo "$PPID" > holder.part; mv holder.part holder; until [ -e let_go ]; do sleep 0.1; done; }
sleep 1
[ "$index" != "${FAILS:-0}" ] || { echo "no such thing"; exit 3; }
units=$(seq 0 23 | awk -v i="$index" -v n="$count" '$1 % n == i - 1 {printf "%s{\"unit\":%d,\"value\":%.17g}", c, $1, sin($1); c = ","}')
echo "{\"schema\":\"rim-campaign/1\",\"version\":\"0\",\"kind\":\"k\",\"config\":{\"seed\":1},\"total\":24,\"units\":[$units]}" > "$out.part" &&
  mv "$out.part" "$out"
END
chmod +x work.sh
./work.sh --shard 1/1 --out one.json && "$RIM_THESIS" merge one.json --out single.json > /dev/null
common="--shards 12 --workers 2 --merge"
$campaign --out a $common "$RIM_THESIS merge" -- ./work.sh > said 2> log; check "a campaign" 0 $?
cmp -s a/merged.json single.json; check "the same bytes as one machine" 0 $?
contains "the dashboard is told" "$(cat log)" "dashboard http"
contains "progress is told" "$(cat log)" "12 of 12: shard .* done (.* s of processor time)"
contains "and what it cost" "$(cat log)" "12 shards on 2 workers: .* s of processor time in the shards, .* s a shard"

: > computed.txt
$campaign --out a $common "$RIM_THESIS merge" -- ./work.sh > said 2> log; check "started again" 0 $?
check "nothing is computed twice" 0 "$(wc -l < computed.txt)"

HELD=3 $campaign --out b $common "$RIM_THESIS merge" -- ./work.sh > said 2> log & driver=$!
for _ in $(seq 1200); do [ -e holder ] && break; sleep 0.1; done
kill -9 "$(cat holder)"; check "a worker is killed" 0 $?
touch let_go
wait "$driver"; check "and the campaign ends well" 0 $?
cmp -s b/merged.json single.json; check "with the same bytes" 0 $?

: > log # of the campaign before: the loop would read there that three are done before this one has begun
$campaign --out c $common "$RIM_THESIS merge" -- ./work.sh > said 2> log & driver=$!
for _ in $(seq 1200); do grep -q ': 3 of 12' log && break; sleep 0.1; done
children=$(ps -o pid= --ppid "$driver"); kill -9 "$driver" $children 2> /dev/null; wait "$driver" 2> /dev/null
sleep 2
had=$(ls c/shard_*.json | wc -l); : > computed.txt
check "killed, some shards are there" 1 $((had >= 2 && had < 12))
$campaign --out c $common "$RIM_THESIS merge" -- ./work.sh > said 2> log; check "goes on" 0 $?
check "only what was missing is computed" $((12 - had)) "$(wc -l < computed.txt)"
cmp -s c/merged.json single.json; check "and folds to the same bytes" 0 $?

FAILS=5 $campaign --out d --shards 6 --workers 2 -- ./work.sh > said 2> log; check "a shard that fails" 3 $?
contains "is named with its reason" "$(cat log)" "shard 5 failed: exit 3: no such thing"
check "the others stay" 5 "$(ls d/shard_*.json | wc -l)"

# What keeps it from folding is told, and no trace of Python.
refuses() { # refuses WHAT STATUS WORDS ARGUMENT...
  local what=$1 status=$2 words=$3
  shift 3
  "$python" "$root/host_tools/campaign/campaign.py" "$@" -- ./work.sh > said 2> log; check "$what" "$status" $?
  contains "$what: said" "$(cat log)" "$words"
  check "$what: in a few words" 0 "$(grep -c Traceback log)"
}
refuses "no such program to fold" 3 "No such file or directory: '/none/merge'" --out c --shards 12 --merge /none/merge
refuses "an open quote" 2 "merge: No closing quotation" --out c --shards 12 --merge "'rim"
refuses "what folds nothing" 3 "wrote no none/merged" --out c --shards 12 --merge true --merged none/merged
refuses "what cannot fold" 3 "false: exit 1, and could not fold" --out c --shards 12 --merge false
refuses "a file for a folder" 3 "File exists: 'said'" --out said --shards 1
refuses "no scheduler there" 3 "127.0.0.1:9" --out h --shards 1 --scheduler tcp://127.0.0.1:9
"$python" -S "$root/host_tools/campaign/campaign.py" --out c $common "$RIM_THESIS merge" -- ./work.sh > said 2> log
check "what is there is folded without dask" 0 $?

$campaign --out "50 %d done" --shards 2 --slurm -- ./work.sh > array.sh
for i in 1 2; do failed=7 SLURM_ARRAY_TASK_ID=$i bash array.sh || bad "job $i in a folder of an odd name"; done
check "a folder of an odd name" 2 "$(ls "50 %d done" | grep -c '^shard_[12]_of_2.json$')"

$campaign --out e --shards 3 --slurm -- ./work.sh > array.sh; check "a Slurm array" 0 $?
contains "of three jobs" "$(cat array.sh)" "^#SBATCH --array=1-3"
for i in 1 2 3; do SLURM_ARRAY_TASK_ID=$i bash array.sh || bad "job $i"; done
$campaign --out e --shards 3 --workers 1 --merge "$RIM_THESIS merge" -- ./work.sh > said 2> log; check "is folded" 0 $?
cmp -s e/merged.json single.json; check "to the same bytes" 0 $?
$campaign --out g --shards 7 --tasks 3 --slurm -- ./work.sh > array.sh; contains "of fewer jobs than shards" "$(cat array.sh)" "array=1-3"
for i in 1 2 3; do SLURM_ARRAY_TASK_ID=$i bash array.sh || bad "job $i of more shards"; done
check "which compute them all" 7 "$(ls g/shard_*.json | wc -l)"
FAILS=5 SLURM_ARRAY_TASK_ID=2 bash <(sed 's/_of_7/_of_7x/' array.sh) > said; check "a job whose shard fails, fails" 1 $?
check "and computes its others" 1 "$(ls g/shard_2_of_7x.json | wc -l)"
$campaign --out f --shards 0 -- ./work.sh 2> /dev/null; check "no shard" 2 $?
finish
