#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""campaign.py: runs the shards of a campaign on a Dask cluster or as a Slurm array, and folds them.

A campaign is any command that takes `--shard I/N` and `--out FILE` and writes FILE by an atomic rename, as
`rim-thesis experiment` does. Each shard is a function of its number alone, so a shard whose worker dies is computed
again elsewhere, and one whose file is there is not computed again: killed and started anew, a campaign goes on.

  campaign.py --out DIR --shards 16 --workers 2 --merge 'build/rim-thesis merge' -- \\
      build/rim-thesis experiment golf --runs 100
  campaign.py --out DIR --shards 1000 --scheduler tcp://head:8786 ... -- ...     a cluster that is there
  campaign.py --out DIR --shards 1000 --slurm ... -- ... | sbatch                one array of jobs; run again without
                                                                                 --slurm when it is done: it folds

Workers of a cluster need the command and DIR at the same paths. Prints the dashboard's address and each shard that
ends on stderr, the folded file's name on stdout. Exit 0; 2 usage; 3 a shard failed (its last line is told) or could
not be folded; what was computed stays."""
import argparse
import os
import shlex
import subprocess
import sys


def shard_file(out, index, count):
    return os.path.join(out, "shard_%0*d_of_%d.json" % (len(str(count)), index, count))


def run_shard(command, path, index, count):
    """On a worker: one shard. Returns its number, and what it said where it failed."""
    if os.path.exists(path):
        return index, None
    done = subprocess.run([*command, "--shard", "%d/%d" % (index, count), "--out", path],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == 0 and os.path.exists(path):
        return index, None
    last = (done.stdout.strip().splitlines() or ["it said nothing"])[-1]
    return index, "exit %d: %s" % (done.returncode, last)


def say(text):
    print("campaign: " + text, file=sys.stderr, flush=True)


def slurm_script(o):
    """An array of jobs: each computes the shard of its number, where its file is not there yet."""
    width = len(str(o.shards))
    return "\n".join([
        "#!/bin/bash", "#SBATCH --job-name=rim-campaign", "#SBATCH --array=1-%d" % o.shards,
        "#SBATCH --output=%s/slurm_%%a.txt" % o.out, "#SBATCH --requeue",
        "file=$(printf '%%s/shard_%%0%dd_of_%d.json' %s \"$SLURM_ARRAY_TASK_ID\")" % (width, o.shards, shlex.quote(o.out)),
        "[ -e \"$file\" ] || exec %s --shard \"$SLURM_ARRAY_TASK_ID/%d\" --out \"$file\"" % (shlex.join(o.command), o.shards)])


def connect(o):
    from dask.distributed import Client, LocalCluster
    if o.scheduler:
        return Client(o.scheduler)
    return Client(LocalCluster(n_workers=o.workers, threads_per_worker=1, processes=True, memory_limit=0,
                               dashboard_address=o.dashboard))


def compute(o):
    """All shards that are not there. Returns what failed: number -> reason."""
    from dask.distributed import as_completed
    missing = [i for i in range(1, o.shards + 1) if not os.path.exists(shard_file(o.out, i, o.shards))]
    say("%d of %d shards are there" % (o.shards - len(missing), o.shards))
    if not missing:
        return {}
    failed = {}
    with connect(o) as client:
        say("dashboard %s" % client.dashboard_link)
        futures = [client.submit(run_shard, o.command, os.path.abspath(shard_file(o.out, i, o.shards)), i, o.shards,
                                 key="shard-%d-of-%d" % (i, o.shards), retries=2, pure=False) for i in missing]
        for number, future in enumerate(as_completed(futures), 1):
            try:
                index, reason = future.result()
            except Exception as error:  # the worker died more often than is retried
                index, reason = future.key, str(error)
            if reason is not None:
                failed[index] = reason
            say("%d of %d: shard %s %s" % (number, len(missing), index, reason or "done"))
    return failed


def parse():
    a = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    a.add_argument("--out", required=True, help="folder of the shards' files")
    a.add_argument("--shards", type=int, required=True)
    a.add_argument("--workers", type=int, default=os.cpu_count(), help="of a cluster on this computer")
    a.add_argument("--scheduler", help="address of a Dask scheduler; without it a cluster on this computer")
    a.add_argument("--dashboard", default=":0", help="its address on this computer")
    a.add_argument("--slurm", action="store_true", help="print a script for sbatch instead")
    a.add_argument("--merge", help="command that folds: FILES --out FILE are put behind it")
    a.add_argument("command", nargs=argparse.REMAINDER, metavar="-- COMMAND")
    o = a.parse_args()
    o.command = o.command[1:] if o.command[:1] == ["--"] else o.command
    if not o.command or o.shards < 1 or o.workers < 1:
        a.error("a command after --, and at least one shard and worker, are needed")
    return o


def main():
    o = parse()
    os.makedirs(o.out, exist_ok=True)
    if o.slurm:
        print(slurm_script(o))
        return 0
    failed = compute(o)
    if failed:
        for index in sorted(failed, key=str):
            say("shard %s failed: %s" % (index, failed[index]))
        return 3
    if o.merge:
        whole = os.path.join(o.out, "merged.json")
        files = [shard_file(o.out, i, o.shards) for i in range(1, o.shards + 1)]
        if subprocess.run([*shlex.split(o.merge), *files, "--out", whole], stdout=sys.stderr).returncode:
            return 3
        print(whole)
    return 0


if __name__ == "__main__":
    sys.exit(main())
