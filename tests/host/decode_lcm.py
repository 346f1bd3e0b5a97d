# SPDX-License-Identifier: MIT
"""decode_lcm.py TYPES LOG: reads an LCM event log with lcm-gen's Python types and encodes every
message again to the same bytes. Exit 1 with a reason otherwise."""
import struct
import sys

sys.path.insert(0, sys.argv[1])
import rim  # noqa: E402

types = {"RIM_OBSERVATION": rim.observation_t, "RIM_ALARM": rim.alarm_t, "RIM_HEALTH": rim.health_t}
log = open(sys.argv[2], "rb").read()
at, seen = 0, {}
while at < len(log):
    sync, number, t_us, name_size, size = struct.unpack_from(">IqqII", log, at)
    assert sync == 0xEDA1DA01, "sync word at %d" % at
    at += 28
    channel, data = log[at : at + name_size].decode(), log[at + name_size : at + name_size + size]
    at += name_size + size
    message = types[channel].decode(data)
    assert message.encode() == data, channel + " does not encode to the same bytes"
    seen[channel] = message
assert sorted(seen) == sorted(types), "channels: %s" % sorted(seen)
alarm = seen["RIM_ALARM"]
assert (alarm.sequence, alarm.dims, alarm.channels, alarm.t_s) == (3, 2, 2, 312.25)
assert alarm.shift[0] == 12.4 and alarm.center[0] == 140.0 and alarm.observations == 84
assert seen["RIM_OBSERVATION"].values[2] == 1.5 and seen["RIM_HEALTH"].observations == 10
