# SPDX-License-Identifier: MIT
"""same_alarms.py GROUND.jsonl HEARD.jsonl: are the records that came over CAN those of the ground? Detail
carries numbers in single precision; a record whose detail was overtaken by the next is told by its summary.
Exit 1 with what differs."""
import json
import sys

ground, heard = [[json.loads(line) for line in open(path)] for path in sys.argv[1:3]]
whole = [h for h in heard if h.get("channels")]
by_seq = {g["seq"]: g for g in ground}
compared = 0
for h in whole:
    g = by_seq.get(h["seq"])
    if g is None or h["state"] != g["state"]:
        continue  # a record that a command caused: acknowledged
    for key in ("kind", "channels", "features", "observations", "detector"):
        if h[key] != g[key]:
            sys.exit("record %d: %s is %s, on the ground %s" % (h["seq"], key, h[key], g[key]))
    if abs(h["ln_anom"] - g["ln_anom"]) > 1e-6 * abs(g["ln_anom"]) or abs(h["t_s"] - g["t_s"]) > 1e-6:
        sys.exit("record %d: %s, on the ground %s" % (h["seq"], h, g))
    compared += 1
print("%d of %d records compared" % (compared, len(ground)))
if compared == 0 or not any(h["state"] == "raised" for h in whole):
    sys.exit("too few")
