# SPDX-License-Identifier: MIT
"""rimd_test.py RIMD WIRE DIR: asks the daemon everything that tests/cli/rimd.sh cannot with files alone.
DIR holds toy.rim, healthy.csv, biased.csv, biased.jsonl (what `rim replay` found) and count.so."""
import json
import math
import os
import signal
import struct
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bus import CLEARED, ERROR, FRAGMENT, MESSAGE, NONE, OK, RAISED, STALE, UPDATED, Bus, Daemon, begin, plan_message, read_rows

rimd, wire, here, port, c, check, base = begin()
base += "lcm_interface = 127.0.0.1\n"
biased, healthy = list(read_rows("biased.csv")), list(read_rows("healthy.csv"))


def play(bus, rows, pace_s=0.0002):
    """Slowly enough for every datagram to be read."""
    for t_us, values in rows:
        bus.row(t_us, values)
        bus.listen(pace_s)


def raised(bus):
    return [a for a in bus.alarms if a["state"] == RAISED]


# The same alarms as on the ground, in fixed memory.
bus = Bus(wire, port)
env = {"RIM_ALLOCATIONS": "count.txt"}
if not os.environ.get("SANITIZE"):
    env["LD_PRELOAD"] = "./count.so"
d = Daemon(rimd, "a.conf", base + "state = a.state\nstate_s = 1\ndeadline_us = 1000000\n", env=env)
check("ready", b"rimd: ready: model" in d.said, d.said)
check("health before the first observation", bus.until(lambda: len(bus.health) > 1))
check("nothing yet", bus.health[-1]["observations"] == 0 and bus.health[-1]["level"] == OK)
play(bus, biased)
check("all rows", bus.until(lambda: bus.health[-1]["observations"] == len(biased)), bus.health[-1])
ground = [json.loads(line) for line in open("biased.jsonl")]
check("as many records as on the ground", len(bus.alarms) == len(ground), (len(bus.alarms), len(ground)))
check("the same numbers", all(a["seq"] == g["seq"] and abs(a["t_s"] - g["t_s"]) < 1e-6 and a["ln_anom"] == g["ln_anom"]
      and a["p_value"] == g["p_value"] and a["observations"] == g["observations"] for a, g in zip(bus.alarms, ground)))
check("and the same standard error of the onset", [a["since_sd_s"] for a in bus.alarms] == [g["since_sd_s"] for g in ground])


def but_for_the_flag(record):
    """A record's bytes without RIM_ALARM_FLAG_REPLAY (byte 40: behind fingerprint, times, counts and four codes)."""
    return record[:40] + bytes([record[40] & ~1]) + record[41:]


# What `rim replay` publishes on the bus is what the daemon publishes, record for record and bit for bit.
replayed = Bus(wire, port + 2)
subprocess.run([os.environ["RIM"], "replay", "--model", "toy.rim", "biased.csv", "--lcm",
                "udpm://239.255.76.67:%d?ttl=0" % (port + 2)], check=True, stdout=subprocess.DEVNULL)
check("the replay is heard", replayed.until(lambda: len(replayed.records) >= len(ground)), len(replayed.records))
check("the replay says that it is one", all(a["flags"] & 1 for a in replayed.alarms))
check("the records of replay and daemon are the same bytes",
      [but_for_the_flag(r) for r in replayed.records] == [but_for_the_flag(r) for r in bus.records],
      [(i, at, g[at], h[at]) for i, (g, h) in enumerate(zip(replayed.records, bus.records))
       for at in range(len(g)) if but_for_the_flag(g)[at] != but_for_the_flag(h)[at]][:8])
check("live, not a replay", all(a["flags"] & 1 == 0 for a in bus.alarms))
check("one raised", len(raised(bus)) == 1 and bus.alarms[0]["state"] == RAISED)
check("health says ERROR", bus.health[-1]["level"] == ERROR and bus.health[-1]["alarms"] == len(ground))
check("health counts on", [h["sequence"] for h in bus.health] == list(range(1, len(bus.health) + 1)))
check("steps were timed", bus.counters[-1]["step_us"] > 0 and bus.counters[-1]["overruns"] == 0, bus.counters[-1])
check("nothing was lost", bus.counters[-1]["input_lost"] == 0 and bus.health[-1]["rejected"] == 0)
check("SIGTERM", d.end() == 0, d.said)
check("says so", b"stopped by SIGTERM after 1200 observations" in d.said, d.said)
if not os.environ.get("SANITIZE"):
    field = open("count.txt").read().split()
    check("memory is fixed after start", field[3] == "0" and int(field[5]) > 100, field)

# A restart goes on: the alarm stands, is not raised anew, numbers count on.
bus.listen(0.2)  # a slow machine may have had time for a record that says STALE
before = bus.alarms[-1]
bus2 = Bus(wire, port)
d = Daemon(rimd, "a.conf", base + "state = a.state\n")
check("goes on", b"going on at t = 59.950 s after 1200 observations" in d.said, d.said)
check("told again, as updated", bus2.until(lambda: bus2.alarms) and bus2.alarms[0]["state"] == UPDATED
      and bus2.alarms[0]["seq"] == before["seq"] + 1 and bus2.alarms[0]["ln_anom"] == before["ln_anom"], (before, bus2.alarms[:2]))
play(bus2, [(t + 60000000, v) for t, v in biased[:300]])
check("rows counted on", bus2.until(lambda: bus2.health and bus2.health[-1]["observations"] == 1500))
check("not raised anew", not raised(bus2), raised(bus2))
check("restarts are counted", bus2.counters[-1]["restarts"] == 1)
check("killed", d.end(signal.SIGKILL) == -9)
d = Daemon(rimd, "a.conf", base + "state = a.state\n")
check("goes on after a kill", b"going on" in d.said, d.said)
bus3 = Bus(wire, port)
play(bus3, [(t + 120000000, v) for t, v in biased[:100]])
check("and not raised anew", bus3.until(lambda: bus3.health and bus3.health[-1]["observations"] >= 1300) and not raised(bus3))
d.end()
for what, damage, reason in (("a byte", lambda b: b[:500] + bytes([b[500] ^ 1]) + b[501:], b"check sum"),
                             ("the end", lambda b: b[:-1], b"cut"), ("more", lambda b: b + b"x", b"cut, or longer"),
                             ("the magic", lambda b: b"X" + b[1:], b"not a state file"), ("all", lambda b: b"", b"short")):
    open("bad.state", "wb").write(damage(open("a.state", "rb").read()))
    if os.path.exists("bad.state.old"):
        os.unlink("bad.state.old")  # tests/firmware/attack_test.py is about the older one
    d = Daemon(rimd, "b.conf", base + "state = bad.state\n")
    check("state damaged: %s" % what, reason in d.said and b"beginning anew" in d.said and b"ready" in d.said, d.said)
    d.end()
d = Daemon(rimd, "b.conf", base + "state = absent/x.state\n")
check("no folder for the state", d.end() == 3 and b"No such file" in d.said, d.said)

# Everything bad that can come in is counted, and the good goes on.
bus = Bus(wire, port)
d = Daemon(rimd, "c.conf", base + "resync_rows = 4\nmax_jump_s = 10\n")


def counted(what, counter, send, more=1):
    had = bus.after(counter)
    send()
    now = bus.after(counter)
    check("%s is counted" % what, now == had + more, "%s: %d, then %d" % (counter, had, now))


values = biased[0][1]
good = bus.observation(50000, values)
play(bus, biased[:3])
counted("a row too short", "wrong_length", lambda: bus.row(200000, values[:-1]))
counted("a row too long", "wrong_length", lambda: bus.row(200000, values + [1.0]))
counted("NaN", "not_finite", lambda: bus.row(200000, [math.nan] + values[1:]))
counted("infinity", "not_finite", lambda: bus.row(200000, [math.inf] + values[1:]))
counted("a time repeated", "time_back", lambda: bus.row(100000, values))
counted("a time from before", "time_back", lambda: bus.row(-5, values))
counted("a time far ahead", "future", lambda: bus.row(3600 * 10**6, values))
counted("and farthest", "future", lambda: bus.row(2**63 - 1, values))
counted("the first of all times", "time_back", lambda: bus.row(-2**63, values))
counted("a message cut", "lcm_refused", lambda: bus.send("RIM_OBSERVATION", good[:-1]))
counted("a message without a byte", "lcm_refused", lambda: bus.send("RIM_OBSERVATION", b""))
counted("a message too long", "lcm_refused", lambda: bus.send("RIM_OBSERVATION", good + b"x"))
counted("a message of another type", "lcm_refused", lambda: bus.send("RIM_OBSERVATION", b"\0" * len(good)))
counted("a count of -1", "lcm_refused", lambda: bus.send("RIM_OBSERVATION", bus.observation(150000, values, sequence=0, count=-1)))
counted("a count of 129", "lcm_refused", lambda: bus.send("RIM_OBSERVATION", bus.observation(150000, values, sequence=0, count=129)))
counted("another channel", "lcm_other", lambda: bus.send("CAMERA", b"picture"))
counted("a fragment", "lcm_fragments", lambda: bus.datagram(struct.pack(">II", FRAGMENT, 0) + b"\0" * 100))
counted("noise", "lcm_malformed", lambda: bus.datagram(b"noise, certainly no LCM"))
counted("an empty datagram", "lcm_malformed", lambda: bus.datagram(b""))
counted("a channel without an end", "lcm_malformed", lambda: bus.datagram(struct.pack(">II", MESSAGE, 0) + b"RIM_OBSERVATION"))
counted("a channel without a name", "lcm_malformed", lambda: bus.datagram(struct.pack(">II", MESSAGE, 0) + b"\0" + good))
counted("a channel with a long name", "lcm_malformed", lambda: bus.datagram(struct.pack(">II", MESSAGE, 0) + b"x" * 64 + b"\0"))
counted("a command that is none", "commands_refused", lambda: bus.command(9))
counted("a command cut", "commands_refused", lambda: bus.send("RIM_COMMAND", b"\0" * 9))
counted("an acknowledgement of nothing", "commands_refused", lambda: bus.command(1))
bus.sequence += 5
counted("numbers missing", "gaps", lambda: bus.row(150000, biased[3][1]), 5)
check("good rows went on", bus.after("rows") == 4, bus.counters[-1])
check("health has the sum", bus.health[-1]["rejected"] == 15 and bus.health[-1]["gaps"] == 5, bus.health[-1])
# A source that was restarted: its clock is believed after 4 rows.
bus.row(9000000, values)
resets = bus.after("clock_resets")
play(bus, healthy[:60])
check("the clock of a restarted source is believed", bus.until(lambda: bus.counters[-1]["clock_resets"] == resets + 1), bus.counters[-1])
check("and its rows are used", bus.until(lambda: bus.counters[-1]["rows"] >= 5 + 60 - 25), bus.counters[-1])
# Numbers of the source, in rows that are nothing else: one that was overtaken is missed once, and a source that
# begins again elsewhere has lost nothing.
first = bus.sequence
for what, numbers, missing in (("overtaken", (1, 0, 2), 1), ("twice", (2, 2, 3), 0), ("far behind", (4 - 64, 4), 0), ("an outage", (100005, 100006), 100000),
                               ("no outage", (200008, 200009), 0), ("elsewhere, ahead", (4000000, 4000002), 1), ("elsewhere, behind", (7, 9), 1),
                               ("past the greatest", (-2000 - first, 1 - first), 2000)):
    counted("numbers: " + what, "gaps", lambda: [bus.row(0, [math.nan] + values[1:], sequence=first + n) for n in numbers], missing)
bus.listen(0.2)
check("no alarm of all this", not raised(bus), bus.alarms)
check("SIGINT", d.end(signal.SIGINT) == 0 and b"SIGINT" in d.said)

# Stale input: told once, alarm or not, and over when it comes back.
bus = Bus(wire, port)
# Runs are played one after another, tens of seconds apart on their own clock and at once on ours.
d = Daemon(rimd, "d.conf", base + "stale_ms = 300\nlatch = yes\nreplay = yes\nmax_jump_s = 60\n")
check("stale from the start", bus.until(lambda: bus.health and bus.health[-1]["level"] == STALE)
      and bus.alarms and bus.alarms[0]["level"] == STALE and bus.alarms[0]["state"] == NONE, bus.alarms)
play(bus, healthy[:20])
check("back", bus.until(lambda: bus.health[-1]["level"] == OK) and bus.alarms[1]["level"] == OK)
check("stale again", bus.until(lambda: bus.health[-1]["level"] == STALE) and bus.alarms[2]["level"] == STALE)
bus.listen(0.5)
check("told once", len(bus.alarms) == 3, len(bus.alarms))
play(bus, biased[20:1000]) # the source goes on where it fell silent
check("an alarm", bus.until(lambda: raised(bus)))
check("carries the replay flag, as asked", all(a["flags"] & 1 for a in bus.alarms) and bus.health[-1]["flags"] == 1)
check("stale while it stands", bus.until(lambda: bus.alarms[-1]["level"] == STALE) and bus.alarms[-1]["state"] == UPDATED
      and bus.alarms[-1]["ln_anom"] > 0)
check("stale times", bus.until(lambda: bus.counters[-1]["stale"] == 3), bus.counters[-1])

# A silence in which an alarm stands: the records are those of a replay of the log with the same gap, whose
# image says 2 s. The numbers of seq, the times and the levels are the same.
quiet = Bus(wire, port + 1)
# Played faster than it was recorded, a gap is longer than the time that passes: rimd has to be told.
q = Daemon(rimd, "q.conf", base.replace(str(port), str(port + 1)) + "max_jump_s = 10\n")
rows = list(read_rows("gap.csv"))
play(quiet, rows[:900])
check("a silence", quiet.until(lambda: quiet.alarms and quiet.alarms[-1]["level"] == STALE, 6), quiet.alarms)
play(quiet, rows[900:])
check("its end", quiet.until(lambda: quiet.health[-1]["observations"] == len(rows)), quiet.health[-1])
replayed = [json.loads(line) for line in open("gap.jsonl")]
levels = {"ERROR": ERROR, "STALE": STALE}
told = [(a["seq"], round(a["t_s"], 6), a["level"]) for a in quiet.alarms]
check("the same records as on the ground", told == [(g["seq"], round(g["t_s"], 6), levels[g["level"]]) for g in replayed], (told, replayed))
check("of which one is STALE", sum(a["level"] == STALE for a in quiet.alarms) == 1)
check("ends", q.end() == 0)

# What the indices mean, by itself and when asked: not a word about alarms.
check("names and units", bus.until(lambda: len(bus.models) > 1), len(bus.models))
model = bus.models[-1]
check("of features, then outcomes", (model["features"], model["outcomes"], model["first"], model["count"], model["period_us"])
      == (4, 3, 0, 7, 50000), model)
check("as in the image", [q[:2] for q in model["quantities"]] == [("u.push", ""), ("s.position_a_m", "m"), ("s.position_b_m", "m"),
      ("s.speed_mps", "m/s"), ("s.position_a_m", "m"), ("s.position_b_m", "m"), ("s.speed_mps", "m/s")], model)
check("with the trained ranges", all((low < high) == (i < 4) for i, (_, _, low, high) in enumerate(model["quantities"])), model)
asked, records = bus.counters[-1]["commands"], len(bus.alarms)
bus.command(3)
check("asked, it describes itself", bus.until(lambda: bus.counters[-1]["commands"] == asked + 1) and len(bus.alarms) == records)

# Acknowledge and clear.
newest = bus.alarms[-1]
bus.command(1, sequence=newest["seq"] + 7)
check("a command for another record", bus.until(lambda: bus.counters[-1]["commands_refused"] == 1))
bus.command(1, sequence=newest["seq"], model=newest["model_id"] ^ 1)
check("a command for another model", bus.until(lambda: bus.counters[-1]["commands_refused"] == 2))
bus.command(1, sequence=newest["seq"], model=newest["model_id"])
check("acknowledged", bus.until(lambda: bus.alarms[-1]["flags"] & 4) and bus.alarms[-1]["state"] == UPDATED, bus.alarms[-1])
bus.answer(1)
check("twice is once", bus.until(lambda: bus.counters[-1]["commands"] == asked + 3) and bus.alarms[-1]["seq"] == newest["seq"] + 1)
bus.answer(2)
check("cleared", bus.until(lambda: bus.alarms[-1]["state"] == CLEARED) and bus.alarms[-1]["level"] == OK)
count = len(raised(bus))
play(bus, list(read_rows("long.csv"))[1000:]) # the run goes on
check("and raised again by what is still there", bus.until(lambda: len(raised(bus)) == count + 1), bus.alarms[-1])
# The clock of the source goes back: the monitor forgets, the alarm is held until somebody has seen it.
play(bus, healthy[:140])
check("latched", bus.until(lambda: any(a["flags"] & 2 and a["state"] == UPDATED for a in bus.alarms)), bus.alarms[-1])
bus.listen(0.1)
bus.answer(1)
check("acknowledged and over", bus.until(lambda: bus.alarms[-1]["state"] == CLEARED), bus.alarms[-1])
check("numbers count on", [a["seq"] for a in bus.alarms] == list(range(1, len(bus.alarms) + 1)))
check("ends", d.end() == 0)

# The look-ahead: a plan along the axis in which the alarmed region lies.
bus = Bus(wire, port)
d = Daemon(rimd, "h.conf", base + "axis_x = s.position_a_m\nfootprint = 0.1 0.1 0, 0.1 -0.1 0, -0.1 0.1 0, -0.1 -0.1 0\n")


def line(speed):
    return [(float(i), -20.0 + speed * i, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0) for i in range(41)]


bus.plan(59950000, 1, line(1.0))
play(bus, biased)
check("an entry is told when the alarm comes", bus.until(lambda: bus.entries and bus.health[-1]["observations"] == 1200), bus.alarms[-1])
bus.listen(0.3)
alarm, entry = bus.alarms[-1], bus.entries[-1]
check("a region in space", alarm["dims"] == 1, alarm)
due = alarm["lower"][0] - 0.1 + 20.0 # from the plan's start, now
check("with the time to it", abs(entry["to_entry_s"] - due) < 0.02 and entry["pose"] == int(due), (entry, due))
check("named", entry["alarm_sequence"] == alarm["seq"] and entry["plan_sequence"] == 1, entry)
bus.plan(59950000, 2, line(-1.0))
check("another plan does not enter", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 2) and bus.entries[-1]["to_entry_s"] == -1, bus.entries[-1])
n = len(bus.entries)
bus.listen(0.3)
check("told once", len(bus.entries) == n)
middle = 0.5 * (alarm["lower"][0] + alarm["upper"][0])
bus.plan(59950000 - round((20.0 + middle) * 1e6), 3, line(1.0))
check("inside it already", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 3) and bus.entries[-1]["to_entry_s"] == 0, bus.entries[-1])
counted("a plan of 65 poses", "lcm_refused", lambda: bus.plan(0, 4, line(1.0), count=65))
check("a refused plan replaces none", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 3 and bus.entries[-1]["to_entry_s"] == 0))
bus.plan(59950000, 5, line(1.0))
check("and the next one is", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 5 and bus.entries[-1]["to_entry_s"] > 0))
whole = plan_message(wire, 59950000, 6, line(1.0))
bus.fragments("RIM_PLAN", whole, 1423, [2, 0, 1])
check("a plan in three fragments", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 6 and bus.entries[-1]["to_entry_s"] > 0))
bus.fragments("RIM_PLAN", plan_message(wire, 59950000, 7, line(-1.0)), 1423, [0, 2])
bus.fragments("RIM_PLAN", plan_message(wire, 59950000, 8, line(1.0)), 1423)
check("one that is not whole is none", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 8) and all(e["plan_sequence"] != 7 for e in bus.entries))
bus.answer(2)
check("cleared: no entry", bus.until(lambda: bus.entries[-1]["to_entry_s"] == -1), bus.entries[-1])
check("entries count", [e["sequence"] for e in bus.entries] == list(range(1, len(bus.entries) + 1)))
check("ends", d.end() == 0)
for text, reason in (("axis_x = s.nothing\n", b"no feature 's.nothing'"), ("axis_x = u.push\nfootprint = 1 2\n", b"footprint: '1 2' is not"),
                     ("footprint = 1 2 3\n", b"footprint needs axis_x"), ("axis_x = u.push\nfootprint = 1 2 nan\n", b"is not up to 16"),
                     ("axis_x = u.push\nfootprint = %s\n" % ", ".join(["1 1 1"] * 17), b"is not up to 16")):
    d = Daemon(rimd, "i.conf", base + text)
    check("refused: %s" % text.strip(), d.end() == 3 and reason in d.said, d.said)

# A deadline of a microsecond is missed, and counted; a message that cannot be written holds nothing up.
bus = Bus(wire, port)
d = Daemon(rimd, "e.conf", base + "deadline_us = 1\nmax_skew_s = 100\n")
counted("a clock far from ours", "time_back", lambda: play(bus, biased[:50]), 50)
now_us = int(time.time() * 1e6)
play(bus, [(t + now_us, v) for t, v in biased[:500]])
check("overruns", bus.until(lambda: bus.counters and bus.counters[-1]["overruns"] > 25), bus.counters[-1:])
check("ends", d.end() == 0)

# A row is late by what it waited for the rows before it. The clock goes on a millisecond with every look at it;
# forty rows that wait together are answered one after the other, so the last is forty milliseconds late.
if not os.environ.get("SANITIZE"):
    bus = Bus(wire, port)
    d = Daemon(rimd, "h.conf", base.replace("health_ms = 50", "health_ms = 5") + "deadline_us = 20000\n", env={"LD_PRELOAD": "./clock.so"})
    play(bus, healthy[:5])
    check("the first rows", bus.until(lambda: bus.counters and bus.counters[-1]["rows"] == 5), bus.counters[-1:])
    d.process.send_signal(signal.SIGSTOP)
    for t_us, values in healthy[5:45]:
        bus.row(t_us, values)
    d.process.send_signal(signal.SIGCONT)
    check("forty rows at once", bus.until(lambda: bus.counters[-1]["rows"] == 45), bus.counters[-1:])
    check("the wait in the queue counts", bus.counters[-1]["overruns"] >= 15 and bus.counters[-1]["step_us"] >= 40000, bus.counters[-1:])
    check("ends", d.end() == 0)

# Real time, where this computer lets us.
d = Daemon(rimd, "f.conf", base + "mlock = yes\nfifo_priority = 10\n")
if b"ready" in d.said:
    check("real-time scheduling", os.sched_getscheduler(d.process.pid) == os.SCHED_FIFO)
    check("memory is locked", os.environ.get("SANITIZE") or any(line.split()[1] != "0" for line in open("/proc/%d/status" % d.process.pid) if line.startswith("VmLck")))
    check("ends", d.end() == 0)
else:
    check("refused with a reason", d.end() == 3 and (b"CAP_" in d.said), d.said)
d = Daemon(rimd, "g.conf", base.replace("127.0.0.1", "192.0.2.199"))
check("an interface that is not there", d.end() == 3 and b"interface" in d.said, d.said)
c.finish()
