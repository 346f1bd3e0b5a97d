# SPDX-License-Identifier: MIT
"""decode_can.py FOLDER WIRE.candump HEARD.jsonl FD.candump FD.jsonl: cantools decodes our frames by our DBC;
what it says is what `rim listen` said. Exit 1 with a reason."""
import json
import re
import sys

import cantools

bus = cantools.database.load_file(sys.argv[1] + "/rim.dbc", frame_id_mask=0x780)
fd_bus = cantools.database.load_file(sys.argv[1] + "/rim_fd.dbc")
summary, heartbeat = bus.get_message_by_name("RIM_SUMMARY"), bus.get_message_by_name("RIM_HEARTBEAT")
entry, detail = bus.get_message_by_name("RIM_ENTRY"), fd_bus.get_message_by_name("RIM_DETAIL")


def lines_of(path):
    lines = [json.loads(line) for line in open(path)]
    return {h["seq"]: h for h in lines if h.get("channels")}, [h for h in lines if h.get("message") == "entry"]


heard, entries = lines_of(sys.argv[3])
states, beats, commands, levels, times = [], 0, 0, set(), []
for line in open(sys.argv[2]):
    found = re.match(r"\(\d+\.\d+\) can1 ([0-9A-F]{3})#([0-9A-F]*)", line)
    number, data = int(found[1], 16), bytes.fromhex(found[2])
    assert bus.get_message_by_frame_id(number).decode(data), line  # every frame, whatever the node
    if number == 0x185:
        s = summary.decode(data)
        states.append(str(s["State"]))
        h = heard.get(s["Sequence"])
        if h and str(s["State"]) == h["state"]:
            assert abs(s["LnAnom"] - min(h["ln_anom"], 1023.75)) <= 0.125, (s, h)
            assert str(s["Kind"]) == h["kind"] and s["Observations"] == h["observations"], (s, h)
    elif number == 0x705:
        b = heartbeat.decode(data)
        beats += 1
        levels.add(str(b["Level"]))
    elif number == 0x385:
        e = entry.decode(data)
        times.append(e["TimeToEntry"])
        assert e["PlanSequence"] == 3, e
    elif 0x200 <= number < 0x280:
        commands += 1
assert "raised" in states and "updated" in states, states
assert beats > 5 and {"OK", "ERROR"} <= levels and b["Acknowledged"] == 1 and b["Observations"] == 1200, (b, beats, levels)
assert commands == 2
assert times and len(times) == len(entries), (times, entries)
assert all(abs(t - (655.35 if e["to_entry_s"] is None else e["to_entry_s"])) < 0.006 for t, e in zip(times, entries))

told, _ = lines_of(sys.argv[5])
compared = 0
for line in open(sys.argv[4]):
    found = re.match(r"\(\d+\.\d+\) vcan0 287##[0-9A-F]([0-9A-F]{128})$", line.strip())
    if not found:
        continue
    d = detail.decode(bytes.fromhex(found[1]))
    h = told[d["Sequence"]]
    if str(d["State"]) != h["state"]:
        continue
    region = h["region"]["bounds"]
    assert str(d["Kind"]) == h["kind"] and str(d["Level"]) == h["level"] and d["Dims"] == len(region), (d, h)
    assert d["Observations"] == h["observations"] and abs(d["Time"] - h["t_s"]) <= 0.001, (d, h)
    assert abs(d["Shift"] - h["shift"][h["channels"][0]]) <= 1e-6 * abs(d["Shift"]), (d, h)
    for i, (lower, upper) in enumerate(region):
        assert abs(d["Lower%d" % i] - lower) <= 1e-6 * abs(lower) and abs(d["Upper%d" % i] - upper) <= 1e-6 * abs(upper), (d, h)
    compared += 1
assert compared > 0
print("%d summaries, %d heartbeats, %d entries, %d FD details" % (len(states), beats, len(times), compared))
