# SPDX-License-Identifier: MIT
"""decode_alarms.py DBC ALARMS.jsonl LOG.candump [FD]: other people's decoders on the frames of
`rim replay --candump`: cantools decodes every frame by the DBC, and what it shows is what the alarms
say, names included; python can-isotp puts the segments of the details together, whose bytes are read by
the offsets of rim/can.h. Prints how many frames were decoded; exits 1 on the first difference."""
import json
import math
import re
import struct
import sys
import zlib

import cantools

dbc = cantools.database.load_file(sys.argv[1])
alarms = {a["seq"] % 256: a for a in map(json.loads, open(sys.argv[2]))}
frames = []
for line in open(sys.argv[3]):
    found = re.fullmatch(r"\(\d+\.\d+\) \w+ ([0-9A-F]{3})#(#1)?([0-9A-F]*)", line.strip())
    frames.append((int(found[1], 16), bool(found[2]), bytes.fromhex(found[3])))
fd = len(sys.argv) > 4
decoded = {}
values = {}  # (sequence, signal): newest value of the finding
undecoded = []
for number, is_fd, data in frames:
    try:
        message = dbc.get_message_by_frame_id(number)
        signals = message.decode(data)
    except Exception as problem:
        undecoded.append((hex(number), data.hex(), str(problem)))
        continue
    decoded[message.name] = decoded.get(message.name, 0) + 1
    if message.name in ("RIM_FINDING", "RIM_SUMMARY") or (fd and message.name == "RIM_DETAIL"):
        for name, value in signals.items():
            values[message.name, signals["Sequence"], name] = value
assert not undecoded, "%d of %d frames are not decoded, the first: %s" % (len(undecoded), len(frames), undecoded[0])
assert alarms and {k[1] for k in values} == set(alarms), "records: %s" % sorted({k[1] for k in values})


def near(a, b, relative=1e-6, absolute=0.0):
    return math.isclose(a, b, rel_tol=relative, abs_tol=absolute)


def same(name, sequence, signal, wanted, **tolerance):
    have = values[name, sequence, signal]
    good = near(have, wanted, **tolerance) if isinstance(wanted, float) else str(have).startswith(str(wanted))
    assert good, (name, sequence, signal, have, wanted)


for sequence, a in alarms.items():
    outcome = a["channels"][0]
    same("RIM_SUMMARY", sequence, "State", a["state"])
    same("RIM_SUMMARY", sequence, "Kind", a["kind"])
    for name, channel in [("RIM_FINDING", "Outcome")] + ([("RIM_DETAIL", "Channel0")] if fd else []):
        same(name, sequence, channel, outcome)  # "s.speed_mps [m/s]"
        same(name, sequence, "Kind", a["kind"])
        same(name, sequence, "Shift", a["shift"][outcome])
        same(name, sequence, "ShiftSd", a["shift_sd"][outcome])
        for d, (feature, bounds) in enumerate(zip(a["features"], a["region"]["bounds"])):
            same(name, sequence, "Feature%d" % d, feature)
            same(name, sequence, "Lower%d" % d, bounds[0])
            same(name, sequence, "Upper%d" % d, bounds[1])
    same("RIM_FINDING", sequence, "Age", a["t_s"] - a["since_s"], absolute=6e-4)
    same("RIM_FINDING", sequence, "AgeSd", a["since_sd_s"])

if not fd:
    import isotp

    detail = dbc.get_message_by_name("RIM_DETAIL").frame_id
    waiting = [isotp.CanMessage(arbitration_id=detail, data=data, dlc=8) for number, _, data in frames if number == detail]
    queue = list(waiting)
    layer = isotp.TransportLayerLogic(
        rxfn=lambda *_: queue.pop(0) if queue else None,
        txfn=lambda message: sys.exit("can-isotp answered: %s" % message),
        address=isotp.Address(isotp.AddressingMode.Normal_11bits, rxid=detail, txid=0x7FF),
        params={"listen_mode": True},
        error_handler=lambda problem: sys.exit("can-isotp: %s" % problem))
    records = []
    while queue:
        layer.process(rx_timeout=0)
        while layer.available():
            records.append(bytes(layer.recv()))
    while layer.available():
        records.append(bytes(layer.recv()))
    assert len(records) * 25 == len(waiting) and len(records) == len(alarms), (len(records), len(waiting))
    for r in records:
        assert len(r) == 174 and r[0] == 2, (len(r), r[0])
        assert zlib.crc32(struct.pack("<H", detail) + r[:170]) == struct.unpack_from("<I", r, 170)[0]
        t_s, since_s, sequence = struct.unpack_from("<ddI", r, 1)
        a = alarms[sequence % 256]
        outcome = a["channels"][0]
        shift, since_sd = struct.unpack_from("<f", r, 50)[0], struct.unpack_from("<f", r, 166)[0]
        assert t_s == a["t_s"] and since_s == a["since_s"] and near(shift, a["shift"][outcome]), (t_s, since_s, shift, a)
        assert near(since_sd, a["since_sd_s"]), (since_sd, a)
    print("%d records by can-isotp" % len(records))
print("%d of %d frames decoded: %s" % (sum(decoded.values()), len(frames),
                                       ", ".join("%d %s" % (n, m) for m, n in sorted(decoded.items()))))
