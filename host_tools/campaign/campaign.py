#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""campaign.py: runs the shards of a campaign on a Dask cluster or as a Slurm array, and folds them.

A campaign is any command that takes `--shard I/N` and `--out FILE` and writes FILE by an atomic rename, as
`rim-thesis experiment` and `rim train` do. Each shard is a function of its number alone, so a shard whose worker dies
is computed again elsewhere, and one whose file is there is not computed again: killed and started anew, a campaign
goes on.

  campaign.py --out DIR --shards 16 --workers 2 --merge 'build/rim-thesis merge' -- \\
      build/rim-thesis experiment golf --runs 100
  campaign.py --out DIR --shards 1000 --scheduler tcp://head:8786 ... -- ...     a cluster that is there
  campaign.py --out DIR --shards 1000 --slurm ... -- ... | sbatch                one array of jobs; run again without
                                                                                 --slurm when it is done: it folds
  campaign.py --out DIR --shards 8 --suffix part --merged DIR/model.rim --merge 'build/rim train --merge' -- \\
      build/rim train landings/*.csv

Workers of a cluster need the command and DIR at the same paths. A worker computes one shard at a time on one core:
RIM_THREADS is 1 unless it is set. An array has at most --tasks jobs, each of which computes every so many-th shard,
since Slurm refuses an array larger than its MaxArraySize. Prints the dashboard's address, each shard that ends with
its processor time, and the sum of these on stderr, the folded file's name on stdout. Exit 0; 2 usage; 3 a shard failed
(its last line is told) or could not be folded; what was computed stays."""
import argparse
import os
import shlex
import subprocess
import sys
import tempfile
import time


def shard_file(o, index):
    return os.path.join(os.path.abspath(o.out),
                        "shard_%0*d_of_%d.%s" % (len(str(o.shards)), index, o.shards, o.suffix))


def run_shard(command, path, index, count):
    """On a worker: one shard. Returns its number, its processor seconds, and what it said where it failed."""
    if os.path.exists(path):
        return index, 0.0, None
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        child = subprocess.Popen([*command, "--shard", "%d/%d" % (index, count), "--out", path], stdout=said,
                                 stderr=subprocess.STDOUT, env={"RIM_THREADS": "1", **os.environ})
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)  # Popen must not wait for it again
        spent = used.ru_utime + used.ru_stime
        if child.returncode == 0 and os.path.exists(path):
            return index, spent, None
        said.seek(0)
        last = (said.read().strip().splitlines() or ["it said nothing"])[-1]
    return index, spent, "exit %d: %s" % (child.returncode, last)


def say(text):
    print("campaign: " + text, file=sys.stderr, flush=True)


def slurm_script(o):
    """An array of jobs: job K computes the shards K, K + tasks, ... whose files are not there yet."""
    tasks = min(o.tasks, o.shards)
    folder = os.path.abspath(o.out).replace("%", "%%")  # for printf and for Slurm, as it is
    file = os.path.join(folder, "shard_%%0%dd_of_%d.%s" % (len(str(o.shards)), o.shards, o.suffix.replace("%", "%%")))
    return "\n".join([
        "#!/bin/bash", "#SBATCH --job-name=rim-campaign", "#SBATCH --array=1-%d" % tasks, "#SBATCH --ntasks=1",
        "#SBATCH --output=%s" % shlex.quote(folder + "/slurm_%a.txt"), "#SBATCH --open-mode=append", "#SBATCH --requeue",
        "export RIM_THREADS=${RIM_THREADS:-${SLURM_CPUS_PER_TASK:-1}}", "failed=0",
        "for ((shard = SLURM_ARRAY_TASK_ID; shard <= %d; shard += %d)); do" % (o.shards, tasks),
        "  file=$(printf %s \"$shard\")" % shlex.quote(file),
        "  [ -e \"$file\" ] || %s --shard \"$shard/%d\" --out \"$file\" || failed=1" % (shlex.join(o.command), o.shards),
        "done", "exit $failed"])


def connect(o):
    from dask.distributed import Client, LocalCluster
    if o.scheduler:
        return Client(o.scheduler)
    return Client(LocalCluster(n_workers=o.workers, threads_per_worker=1, processes=True, memory_limit=0,
                               dashboard_address=o.dashboard))


def compute(o):
    """All shards that are not there. Returns what failed: number -> reason."""
    missing = [i for i in range(1, o.shards + 1) if not os.path.exists(shard_file(o, i))]
    say("%d of %d shards are there" % (o.shards - len(missing), o.shards))
    if not missing:
        return {}
    from dask.distributed import as_completed
    failed, spent, began = {}, [], time.monotonic()
    with connect(o) as client:
        say("dashboard %s" % client.dashboard_link)
        futures = [client.submit(run_shard, o.command, shard_file(o, i), i, o.shards,
                                 key="shard-%d-of-%d" % (i, o.shards), retries=2, pure=False) for i in missing]
        for number, future in enumerate(as_completed(futures), 1):
            try:
                index, seconds, reason = future.result()
                spent.append(seconds)
            except Exception as error:  # the worker died more often than is retried
                index, seconds, reason = int(future.key.split("-")[1]), 0.0, str(error)
            if reason is not None:
                failed[index] = reason
            say("%d of %d: shard %s %s (%.1f s of processor time)" % (number, len(missing), index, reason or "done",
                                                                      seconds))
        workers = len(client.scheduler_info(n_workers=-1)["workers"])
    if spent:
        say("%d shards on %d workers: %.1f s, %.1f s of processor time in the shards, %.2f s a shard" %
            (len(spent), workers, time.monotonic() - began, sum(spent), sum(spent) / len(spent)))
    return failed


def parse():
    a = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    a.add_argument("--out", required=True, help="folder of the shards' files")
    a.add_argument("--shards", type=int, required=True)
    a.add_argument("--workers", type=int, default=os.cpu_count(), help="of a cluster on this computer")
    a.add_argument("--scheduler", help="address of a Dask scheduler; without it a cluster on this computer")
    a.add_argument("--dashboard", default=":0", help="its address on this computer")
    a.add_argument("--slurm", action="store_true", help="print a script for sbatch instead")
    a.add_argument("--tasks", type=int, default=1000, help="most jobs of the array (1000)")
    a.add_argument("--suffix", default="json", help="of the shards' files (json)")
    a.add_argument("--merged", help="the folded file (OUT/merged.SUFFIX)")
    a.add_argument("--merge", help="command that folds: FILES --out FILE are put behind it")
    a.add_argument("command", nargs=argparse.REMAINDER, metavar="-- COMMAND")
    o = a.parse_args()
    o.command = o.command[1:] if o.command[:1] == ["--"] else o.command
    try:
        o.merge = shlex.split(o.merge or "")
    except ValueError as error:
        a.error("--merge: %s" % error)
    if not o.command or o.shards < 1 or o.workers < 1 or o.tasks < 1:
        a.error("a command after --, and at least one shard, worker and task, are needed")
    return o


def main():
    o = parse()
    try:
        return run(o)
    except (OSError, ImportError) as error:  # a folder, dask, the scheduler, or the command that folds
        say(str(error))
        return 3


def run(o):
    os.makedirs(o.out, exist_ok=True)
    if o.slurm:
        print(slurm_script(o))
        return 0
    failed = compute(o)
    if failed:
        for index in sorted(failed):
            say("shard %s failed: %s" % (index, failed[index]))
        return 3
    if o.merge:
        whole = o.merged or os.path.join(o.out, "merged." + o.suffix)
        files = [shard_file(o, i) for i in range(1, o.shards + 1)]
        status = subprocess.run([*o.merge, *files, "--out", whole], stdout=sys.stderr).returncode
        if status or not os.path.exists(whole):
            say("%s: exit %d, and %s" % (o.merge[0], status, "could not fold" if status else "wrote no " + whole))
            return 3
        print(whole)
    return 0


if __name__ == "__main__":
    sys.exit(main())
