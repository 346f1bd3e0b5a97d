# SPDX-License-Identifier: MIT
"""corpus.py DIR: the corpus of the decoders: a good input of each kind, from the public descriptions."""
import os
import struct
import sys

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(here, "..", "firmware"))
from bus import ALARM, FRAGMENT, MESSAGE, fingerprint  # noqa: E402

wire = os.path.join(here, "..", "..", "lib", "wire")
# section_level, section_threshold: of an image that rim train made of the logs of tests/cli/toy.inc, after a byte 8.
out = sys.argv[1]


def mark(name):
    return fingerprint(name, wire)


def crc8(data):
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x1D if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ 0xFF


def frame(number, data):
    """With its check sum."""
    data += bytes([crc8(struct.pack("<H", number) + data)])
    return struct.pack("<HB", number, len(data) | (0x80 if len(data) > 8 else 0)) + data


alarm = struct.pack(ALARM, mark("alarm"), 12.0, 3.0, 7, 8, 9, 0, 1, 2, 0, 0, 1, 2, 1, 0, 0, 0, 1.5, 0, 0, 0, 0.1, 0, 0, 0,
                    0, 1, 0, 0.5, 0.5, 0, 4, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 20.0, 8.0, 0.02, 0.25)
plan = struct.pack(">QqII", mark("plan"), 0, 2, 2) + struct.pack(">512d", *([0, 1] + [0] * 62 + [0, 0, 0, 5, 0, 0] + [0] * 186 +
                                                                             [1, 0, 0, 0] * 2 + [0] * 248))
table = struct.pack("<I6H", 1, 1, 1, 1, 0, 0xFFFF, 0) + struct.pack("<IBB3H", 0x123, 8, 0, 0, 1, 0) + \
    struct.pack("<HBBHBBHBBI4d", 0, 1, 0, 4, 12, 0, 0, 0, 0, 0, 0.5, 1.0, -1e9, 1e9)
files = {
    "lcm_observation": b"\0" + struct.pack(">QqIi128d", mark("observation"), 1, 2, 3, *range(128)),
    "lcm_alarm": b"\0" + alarm,
    "lcm_health": b"\0" + struct.pack(">Qd7IBB", mark("health"), 1.0, *range(7), 2, 1),
    "lcm_command": b"\0" + struct.pack(">QIIB", mark("command"), 1, 2, 1),
    "lcm_counters": b"\0" + struct.pack(">Q31I", mark("counters"), *range(31)),
    "lcm_entry": b"\0" + struct.pack(">Qdd5IB", mark("entry"), 1.0, 2.0, 1, 2, 3, 4, 5, 1),
    "lcm_plan": b"\0" + plan,
    "packet": b"\1" + struct.pack(">II", MESSAGE, 5) + b"RIM_ALARM\0" + alarm,
    "can_short": b"\2" + frame(0x181, bytes([6, 7, 8, 4, 0, 9, 0])) + frame(0x701, bytes(7)) + frame(0x201, bytes([1, 7, 8, 0, 0, 0, 0])),
    "can_segments": b"\2" + struct.pack("<HBH6s", 0x281, 8, 0xAE10, b"\2" + bytes(5)) + b"".join(
        struct.pack("<HBB7s", 0x281, 8, 0x20 | i & 15, bytes(7)) for i in range(1, 25)),
    "can_finding": b"\2" + b"".join(frame(0x481, bytes([page, 7, 1, 0, 0x20, 9, 0])) for page in range(14)),
    "lcm_model": b"\0" + struct.pack(">Q7IBB768s96s24d", mark("model"), 8, 4, 3, 50000, 5, 0, 7, 0, 0,
                                     b"".join(b"s.speed_mps".ljust(64, b"\0") for _ in range(12)), b"".join(b"m/s".ljust(8, b"\0") for _ in range(12)),
                                     *range(24)),
    "can_fd": b"\2" + frame(0x281, bytes([6, 7, 8, 0]) + bytes(59)),
    "table": b"\3" + struct.pack("<H", len(table)) + table + struct.pack("<HB", 0x123, 8) + bytes(range(8)),
    "image": b"\4RIMIMG\r\n" + struct.pack("<IHHIIIII", 0x01020304, 1, 0, 64, 1, 0, 0, 0) + bytes(28),
    "lookahead": b"\5" + plan + struct.pack("<9d", 1, 0, 0, 0, 1, 0, 0, 0, 1),
    "config": b"\6image = a.rim\nlcm = udpm://239.255.76.67:7667?ttl=0\nnode = 5 # x\nlatch = yes\nfootprint = 1 2 3, 4 5 6\naxis_x = a\n",
}
plan_parts = [plan[i:i + 1423] for i in range(0, len(plan), 1423)]
datagrams = [struct.pack(">IIIIHH", FRAGMENT, 4, len(plan), 1423 * i, i, len(plan_parts)) + (b"RIM_PLAN\0" if i == 0 else b"") + part
             for i, part in enumerate(plan_parts)]
files["fragments"] = b"\7" + b"".join(struct.pack("<HB", len(d), 1) + d for d in datagrams)
# Of 4 features and 2 outcomes (fuzz_trained): lib/src/image/basis.h, noise.h.
terms = [(0, 0, 0), (1, 0, 1), (2, 1, 0), (3, 0, 1), (4, 0, 0), (5, 1, 0), (6, 0, 0), (7, 1, 0)]
files["section_basis"] = b"\10" + struct.pack("<8I", 1, 3, 2, len(terms), 1, 0, 0, 0) + \
    struct.pack("<6H2f", 0, 0xFFFF, 1, 0xFFFE, 2, 0x8003, 1.0, 0.1) + \
    b"".join(struct.pack("<4H", op, a, b, 0) for op, a, b in terms) + \
    struct.pack(f"<{2 * len(terms)}f", *([0.5] * len(terms) + [2.0] * len(terms))) + struct.pack("<2H4f", 1, 0, 0.0, 1.0, 3.0, 4.0)
files["section_behaviour"] = b"\10" + struct.pack("<4I4I8f", 1, 1, 4, 0, 1, 0, 0, 0, 1, 2, -3, -3, 0.5, 1, 0, 0)
row = [0, 0.1, -1, 0] + [0.25] * 6
files["section_agreement"] = b"\10" + struct.pack("<4I2f", 3, 2, 1, 1, 20, 20) + struct.pack("<4H3f", 1, 0, 1, 0, 1.0, 0.5, 0.5) + \
    struct.pack("<20f", *row, *([2, 0.1, 0, 0] + [0.25] * 6))
# One input, of which also the square: lib/src/image/quadratic.h.
files["section_quadratic"] = b"\10" + struct.pack("<4I2f2H4f", 1, 1, 1, 1, 3.0, 0.5, 0, 0, 0.25, 1.0, -0.5, 0.125)
noise_channel = struct.pack("<10f", 1, 2, 0.4, 0.05, 1, 2, 0.1, 0.1, 0.2, 0.1) + \
    struct.pack("<2f10f9f", 4, 9, *([1, 0, 0, 0, 0] + [0, 1, 0, 0, 0.5]), *([1.5] * 9))
files["section_noise"] = b"\10" + struct.pack("<4I4f", 2, 8, 5, 2, 300, 20, 2000, 0) + 8 * noise_channel
files["state"] = b"\12RIMSTATE" + bytes(16) + struct.pack("<6I", 0, 7, 8, 64, 512, 0) + bytes(576)
for name, data in files.items():
    with open(os.path.join(out, name), "wb") as file:
        file.write(data)
