# SPDX-License-Identifier: MIT
"""toy_can.py LOG.csv: the log of tests/cli/toy.inc as frames of toy.dbc, in the form of `candump -L`."""
import struct
import sys

for line in list(open(sys.argv[1]))[1:]:
    t_s, push, a, b, speed = map(float, line.split(","))
    motion = struct.pack("<f", a) + struct.pack(">f", b)
    drive = struct.pack("<Ihh", round(t_s * 1000), round(push * 1e4), round(speed * 1e4))
    stamp = 1700000000 + t_s
    print("(%017.6f) can0 101#%s\n(%017.6f) can0 102#%s" % (stamp, motion.hex().upper(), stamp + 1e-4, drive.hex().upper()))
