"""decode_can.py RIM.dbc WIRE.candump HEARD.jsonl: cantools decodes our frames by our DBC; what it says is
what `rim listen` said. Exit 1 with a reason."""
import json
import re
import sys

import cantools

bus = cantools.database.load_file(sys.argv[1])
heard = {h["seq"]: h for h in map(json.loads, open(sys.argv[3])) if h["channels"]}
summary, heartbeat = bus.get_message_by_name("RIM_SUMMARY"), bus.get_message_by_name("RIM_HEARTBEAT")
states, beats, commands, levels = [], 0, 0, set()
for line in open(sys.argv[2]):
    found = re.match(r"\(\d+\.\d+\) can1 ([0-9A-F]{3})#([0-9A-F]*)", line)
    number, data = int(found[1], 16), bytes.fromhex(found[2])
    if number == 0x185:
        s = summary.decode(data)
        states.append(str(s["State"]))
        h = heard.get(s["Sequence"])
        if h and str(s["State"]) == h["state"]:
            assert abs(s["LnAnom"] - h["ln_anom"]) <= 0.125, (s, h)
            assert str(s["Kind"]) == h["kind"] and s["Observations"] == h["observations"], (s, h)
    elif number == 0x705:
        b = heartbeat.decode(data)
        beats += 1
        levels.add(str(b["Level"]))
    elif 0x200 <= number < 0x280:
        commands += 1
assert "raised" in states and "updated" in states, states
assert beats > 5 and {"OK", "ERROR", "STALE"} <= levels and b["Acknowledged"] == 1 and b["Observations"] == 1200, b
assert commands == 2
print("%d summaries, %d heartbeats" % (len(states), beats))
