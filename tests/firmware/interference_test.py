# SPDX-License-Identifier: MIT
"""interference_test.py RIMD WIRE DIR: rimd with an image that watches for motion interference too. DIR holds
both.rim, held.csv (a log with its own predictions, times in whole us) and held.jsonl (what `rim replay` found)."""
import csv
import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bus import CLEARED, ERROR, OK, RAISED, UPDATED, Bus, Daemon, begin

rimd, wire, here, port, c, check, _ = begin()
STATES = {"raised": RAISED, "updated": UPDATED, "cleared": CLEARED}
KINDS = ["shift", "increment", "variance", "step", "repeat", "blocked", "pushed"]

with open("held.csv") as log:
    lines = list(csv.reader(line for line in log if not line.startswith("#")))
names = lines[0]
order = [i for prefixes in (("x.", "u.", "s."), ("z.",), ("m.",), ("sd.",))
         for i, name in enumerate(names) if name.startswith(prefixes)]
ground = [json.loads(line) for line in open("held.jsonl")]
bus = Bus(wire, port)
d = Daemon(rimd, "i.conf", "image = both.rim\nlcm = udpm://239.255.76.67:%d?ttl=0\nlcm_interface = 127.0.0.1\n"
           "health_ms = 50\n" % port)
check("ready", b"rimd: ready: model" in d.said, d.said)
levels = []
for line in lines[1:]:
    bus.row(round(float(line[0]) * 1e6), [float(line[i]) for i in order])
    bus.listen(0.0005)
check("all rows", bus.until(lambda: bus.health and bus.health[-1]["observations"] == len(lines) - 1),
      bus.health[-1:] + bus.counters[-1:])
check("as many records as on the ground", len(bus.alarms) == len(ground), (len(bus.alarms), len(ground)))
for a, g in zip(bus.alarms, ground):
    told = (a["seq"], a["detector"] == 1, a["state"], KINDS[a["kind"]])
    check("record %d" % g["seq"], told == (g["seq"], g["detector"] == "interference", STATES[g["state"]], g["kind"]), told)
    check("its times", abs(a["t_s"] - g["t_s"]) < 1e-5 and abs(a["since_s"] - g["since_s"]) < 1e-5, (a, g))
both = {g["detector"] for g in ground}
check("both detectors speak", both == {"rim", "interference"}, both)
stands = {g["detector"]: g["state"] != "cleared" for g in ground}
check("level", bus.health[-1]["level"] == (ERROR if any(stands.values()) else OK), (bus.health[-1], stands))
check("SIGTERM", d.end() == 0, d.said)
c.finish()
