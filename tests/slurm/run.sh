#!/bin/bash
# SPDX-License-Identifier: MIT
# A campaign as an array of jobs of a real Slurm: munged, slurmctld and slurmd with their files in a folder of their own,
# on this computer, as root. Killed jobs are computed when the array is submitted again, and only they; the shards fold to
# the bytes of one machine. PYTHON names one with dask.distributed, which folds.
. "$(dirname "$0")/../cli/check.inc"
root=$(cd "$(dirname "$0")/../.." && pwd)
python=${PYTHON:-$BUILD/campaign/bin/python3}
campaign="$python $root/host_tools/campaign/campaign.py"
[ "$(id -u)" = 0 ] || { echo "not here: munged and slurmd are started by root"; skipped=1; finish; }
for program in munged slurmctld slurmd sbatch; do
  command -v $program > /dev/null || { echo "not here: $program (make slurm-deps installs it)"; skipped=1; finish; }
done
cd "$here" || exit 1
chmod 755 "$here"

# --- a cluster of this computer alone
started=()
stop() { # runuser waits for munged, whose own number is in its file
  kill "${started[@]}" $(cat munge/pid 2> /dev/null) 2> /dev/null
  wait "${started[@]}" 2> /dev/null
  cd / && rm -rf "$here"
}
trap stop EXIT
host=$(hostname -s) cores=$(nproc)
listens() { (exec 3<> "/dev/tcp/127.0.0.1/$1") 2> /dev/null; }
for _ in $(seq 50); do # below the ports that the system hands out itself
  port=$((20000 + RANDOM % 12000))
  listens $port || listens $((port + 1)) || break
done
mkdir munge state spool
dd if=/dev/urandom of=munge/key bs=1024 count=1 2> /dev/null
chown -R munge munge && chmod 700 munge/key && chmod 755 munge && chmod 600 munge/key
runuser -u munge -- munged --foreground --key-file="$here/munge/key" --socket="$here/munge/socket" --num-threads=2 \
  --pid-file="$here/munge/pid" --log-file="$here/munge/log" --seed-file="$here/munge/seed" > munge.txt 2>&1 & started+=($!)
cat > slurm.conf << END
ClusterName=rim
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$here/munge/socket
CredType=cred/munge
StateSaveLocation=$here/state
SlurmdSpoolDir=$here/spool
SlurmctldPidFile=$here/slurmctld.pid
SlurmdPidFile=$here/slurmd.pid
SlurmctldLogFile=$here/slurmctld.log
SlurmdLogFile=$here/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
ReturnToService=2
MailProg=/bin/true
MpiDefault=none
MaxArraySize=1001
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$here/slurm.conf
for _ in $(seq 100); do [ -S munge/socket ] && break; sleep 0.1; done
slurmctld -D > ctld.txt 2>&1 & started+=($!)
slurmd -D -N "$host" > slurmd.txt 2>&1 & started+=($!)
for _ in $(seq 300); do [ "$(sinfo -h -o %t 2> /dev/null)" = idle ] && break; sleep 0.1; done
state=$(sinfo -h -o %t 2>&1); check "a Slurm of this computer is up" idle "$state"
[ "$state" = idle ] || { tail -n 5 munge.txt ctld.txt slurmd.txt slurmctld.log slurmd.log; finish; }
slurmctld -V

# --- the campaign: unit i is a function of i; what is computed is noted, and takes a while
cat > work.sh << 'END'
#!/bin/bash
while [ $# -gt 0 ]; do case $1 in --shard) shard=$2 ;; --out) out=$2 ;; esac; shift 2; done
index=${shard%/*} count=${shard#*/}
echo "$index" >> computed.txt
sleep "${TAKES:-0}"
units=$(seq 0 47 | awk -v i="$index" -v n="$count" '$1 % n == i - 1 {printf "%s{\"unit\":%d,\"value\":%.17g}", c, $1, sin($1); c = ","}')
echo "{\"schema\":\"rim-campaign/1\",\"version\":\"0\",\"kind\":\"k\",\"config\":{\"seed\":1},\"total\":48,\"units\":[$units]}" > "$out.part" &&
  mv "$out.part" "$out"
END
chmod +x work.sh
./work.sh --shard 1/1 --out one.json && "$RIM_THESIS" merge one.json --out single.json > /dev/null
ended() { for _ in $(seq 1200); do [ -z "$(squeue -h 2> /dev/null)" ] && return; sleep 0.1; done; false; }
fold() { $campaign --out "$1" --shards "$2" --merge "$RIM_THESIS merge" -- ./work.sh > said 2> log; }

: > computed.txt
$campaign --out a --shards 12 --slurm -- ./work.sh | sbatch > said 2> log; check "sbatch takes the script" 0 $?
ended; check "the array ends" 0 $?
check "every shard is there" 12 "$(ls a/shard_*.json | wc -l)"
fold a 12; check "it folds" 0 $?
cmp -s a/merged.json single.json; check "to the same bytes as one machine" 0 $?
check "each shard was computed once" 12 "$(wc -l < computed.txt)"

: > computed.txt
$campaign --out b --shards 24 --tasks 6 --slurm -- ./work.sh > array.sh; check "fewer jobs than shards" 0 $?
TAKES=1 sbatch array.sh > said
for _ in $(seq 300); do [ "$(ls b/shard_*.json 2> /dev/null | wc -l)" -ge 4 ] && break; sleep 0.1; done
scancel --signal=KILL --full "$(awk '{print $4}' said)"; scancel "$(awk '{print $4}' said)"; ended
had=$(ls b/shard_*.json | wc -l); check "killed in the middle, some shards are there" 1 $((had >= 4 && had < 24))
: > computed.txt
sbatch array.sh > said; ended; check "submitted again it ends" 0 $?
check "only what was missing is computed" $((24 - had)) "$(wc -l < computed.txt)"
fold b 24; cmp -s b/merged.json single.json; check "the same bytes" 0 $?

# --- training: parts made by an array, learnt from where they are folded
. "$root/tests/cli/toy.inc"
toy_runs
"$RIM" train run*.csv --out one.rim --quick > /dev/null; check "trained at once" 0 $?
$campaign --out t --shards 8 --suffix part --slurm -- "$RIM" train run*.csv | sbatch > said; ended
check "eight parts" 8 "$(ls t/shard_*.part | wc -l)"
$campaign --out t --shards 8 --suffix part --merged eight.rim --merge "$RIM train --merge" -- "$RIM" train run*.csv > said 2> log
check "learnt from the parts" 0 $?
cmp -s one.rim eight.rim; check "the image is the same to the last bit" 0 $?
finish
