# SPDX-License-Identifier: MIT
"""same_frames.py NODE GROUND.candump HEARD.candump: are the records that rimd sent in segments on CAN those
of `rim replay --candump`, byte for byte but for the flags? A detail that the next record overtook is left
out. Exit 1 with what differs."""
import sys

FLAGS, RECORD, FRAMES = 33, 170, 25  # lib/include/rim/can.h


def records(path, node):
    """{seq: bytes} of the records whose segments all came, one after the other."""
    whole, data, expected = {}, b"", -1
    for line in open(path):
        parts = line.split()
        if len(parts) < 3 or "#" not in parts[2] or "##" in parts[2]:
            continue
        name, text = parts[2].split("#", 1)
        if int(name, 16) != 0x280 + node or len(text) != 16:
            continue
        frame = bytes.fromhex(text)
        if frame[0] >> 4 == 1:  # ISO 15765-2: the first segment, and the others
            data, expected = frame[2:], 1
            continue
        if frame[0] >> 4 != 2 or expected < 0 or frame[0] & 15 != expected & 15:
            expected = -1
            continue
        data, expected = data + frame[1:], expected + 1
        if expected == FRAMES:
            number = int.from_bytes(data[17:21], "little")
            expected = -1
            whole.setdefault(number, data[:FLAGS] + b"\0" + data[FLAGS + 1:RECORD])
    return whole


node = int(sys.argv[1])
ground, heard = records(sys.argv[2], node), records(sys.argv[3], node)
both = sorted(set(ground) & set(heard))
for number in both:
    if ground[number] != heard[number]:
        at = next(i for i in range(RECORD) if ground[number][i] != heard[number][i])
        sys.exit("record %d: byte %d is %d, on the ground %d" % (number, at, heard[number][at], ground[number][at]))
print("%d of %d records are the same bytes" % (len(both), len(ground)))
if not both:
    sys.exit("no record came whole")
