# SPDX-License-Identifier: MIT
"""same_frames.py NODE GROUND.candump HEARD.candump: are the records that rimd sent in segments on CAN those
of `rim replay --candump`, byte for byte but for the flags? A detail that the next record overtook is left
out. Exit 1 with what differs."""
import sys

FLAGS, RECORD, FRAMES = 32, 165, 29  # lib/include/rim/can.h


def records(path, node):
    """{seq: bytes} of the records whose segments all came, one after the other."""
    whole, data, seq, expected = {}, b"", None, 0
    for line in open(path):
        parts = line.split()
        if len(parts) < 3 or "#" not in parts[2] or "##" in parts[2]:
            continue
        name, text = parts[2].split("#", 1)
        if int(name, 16) != 0x280 + node or len(text) != 16:
            continue
        frame = bytes.fromhex(text)
        index, last = frame[1] & 0x7F, frame[1] & 0x80
        if index == 0:
            data, seq, expected = b"", frame[0], 0
        if index != expected or frame[0] != seq:
            expected = -1
            continue
        data, expected = data + frame[2:], expected + 1
        if last and expected == FRAMES:
            number = int.from_bytes(data[16:20], "little")
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
