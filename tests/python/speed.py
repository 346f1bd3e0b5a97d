# SPDX-License-Identifier: MIT
"""speed.py RIM MODEL.rim LOG: what Python costs beside the command line, in user CPU: Monitor.run over the table
of a log against `rim replay` over its file, and Monitor.step against Monitor.run, row by row. A
measurement, not a test: it prints and asserts nothing but equal digests."""

import resource
import subprocess
import sys
import time

import numpy as np

import rimwatch

RIM, MODEL, LOG = sys.argv[1:4]


def user_s(who=resource.RUSAGE_SELF):
    return resource.getrusage(who).ru_utime


frame = rimwatch.read(LOG)
image = rimwatch.Image.load(MODEL)
start = user_s()
replay = rimwatch.replay(frame, image)
run_s = user_s() - start
said = subprocess.run([RIM, "replay", "--model", MODEL, LOG], capture_output=True, text=True,
                      check=True).stdout.splitlines()[-1]
replay_s = user_s(resource.RUSAGE_CHILDREN)
assert said == f"digest {replay.digest}", (said, replay.digest)
print(f"{len(frame)} rows x {len(frame.columns)}: run {run_s:.2f} s, rim replay {replay_s:.2f} s, "
      f"ratio {run_s / replay_s:.2f}")

rows = min(len(frame), 20000)
monitor, times = rimwatch.Monitor(image), frame.index[:rows].tolist()
values = [np.ascontiguousarray(row) for row in frame.to_numpy()[:rows]]
start = time.process_time()
for t, row in zip(times, values):
    monitor.step(t, row)
step_us = 1e6 * (time.process_time() - start) / rows
start = time.process_time()
rimwatch.replay(frame.iloc[:rows], image)
run_us = 1e6 * (time.process_time() - start) / rows
print(f"first {rows} rows: step {step_us:.2f} us, run {run_us:.2f} us a row")
