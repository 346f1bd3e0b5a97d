# SPDX-License-Identifier: MIT
"""damage_test.py RIMD WIRE DIR: bits are turned over in rimd's memory (through /proc/PID/mem) while it watches.
DIR holds toy.rim and long.csv."""
import os
import re
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bus import STALE, Bus, Daemon, Flight, begin, read_rows

rimd, wire, here, port, c, check, base = begin()
base += "stale_ms = 600000\n"
log = list(read_rows("long.csv"))
image = open("toy.rim", "rb").read()
DAMAGED = 2


class Memory:
    """What a daemon has in its anonymous memory."""

    def __init__(self, pid):
        self.file = open("/proc/%d/mem" % pid, "r+b", buffering=0)
        self.parts = []
        for line in open("/proc/%d/maps" % pid):
            m = re.match(r"([0-9a-f]+)-([0-9a-f]+) rw", line)
            if m and "[v" not in line:
                begin, end = (int(x, 16) for x in m.groups())
                self.file.seek(begin)
                self.parts.append((begin, self.file.read(end - begin)))

    def find(self, what, fits=lambda data, at, begin: True):
        for begin, data in self.parts:
            at = data.find(what)
            while at >= 0:
                if fits(data, at, begin):
                    return begin + at
                at = data.find(what, at + 1)
        return None

    def monitor(self):
        """The header: its magic number, the library's version, its own size; and among its pointers one that leads
        just behind it, which a copy for the state file has not."""
        def fits(data, at, begin):
            if at % 8 != 0 or not 1000 < struct.unpack_from("<I", data, at + 8)[0] < 4096:
                return False
            words = struct.unpack_from("<128Q", data, at)
            return any(begin + at + 1000 < w < begin + at + 4096 for w in words)
        return self.find(struct.pack("<I", 0x52494D4E), fits)

    def turn(self, at, bit):
        self.file.seek(at)
        byte = self.file.read(1)[0]
        self.file.seek(at)
        self.file.write(bytes([byte ^ 1 << bit]))


class Damaged(Flight):
    def __init__(self, more="", name="d.conf"):
        bus = Bus(wire, port)
        super().__init__(Daemon(rimd, name, base + more), bus, log)
        check("ready", b"rimd: ready" in self.daemon.said, self.daemon.said)

    # What turns over within a step is another matter (firmware/ASSURANCE.md).
    def hit_monitor(self, offset):
        self.wait_until_used()
        memory = Memory(self.daemon.process.pid)
        at = memory.monitor()
        check("the monitor is found", at is not None)
        memory.turn(at + offset, 6)

    def hit_image(self, offset):
        self.wait_until_used()
        memory = Memory(self.daemon.process.pid)
        at = memory.find(image[:64])
        check("the image is found", at is not None)
        memory.turn(at + offset, 4)

    def health(self):
        self.bus.after("rows")
        self.bus.after("rows")
        return self.bus.health[-1]


def rebuilt(what, hit):
    """By default the monitor is built anew, and says so in every health message."""
    f = Damaged()
    f.play(300)
    check("%s: not damaged before" % what, f.health()["flags"] & DAMAGED == 0, f.bus.health[-1])
    hit(f)
    f.play(400)
    had = f.bus.after("rows")
    f.play(100)
    check("%s: rows are used again" % what, f.bus.after("rows") - had == 100, f.bus.counters[-1])
    check("%s: it is told" % what, f.health()["flags"] & DAMAGED != 0 and f.bus.health[-1]["level"] != STALE,
          f.bus.health[-1])
    check("%s: no alarm" % what, not any(a["state"] == 1 for a in f.bus.alarms), f.bus.alarms)
    check("%s: ends" % what, f.daemon.end() == 0, f.daemon.said)
    check("%s: said" % what, b"memory is damaged" in f.daemon.said and b"built anew" in f.daemon.said, f.daemon.said)


rebuilt("a pointer", lambda f: f.hit_monitor(160))
rebuilt("a count", lambda f: f.hit_monitor(12))
rebuilt("the image", lambda f: f.hit_image(len(image) // 2))

f = Damaged()
f.play(300)
f.hit_monitor(160)
check("without a row: it is told", f.bus.until(lambda: f.bus.health and f.bus.health[-1]["flags"] & DAMAGED), f.bus.health[-1:])
had = f.bus.after("rows")
f.play(100)
check("without a row: rows are used again", f.bus.until(lambda: f.bus.counters[-1]["rows"] == had + 100), f.bus.counters[-1])
check("without a row: ends", f.daemon.end() == 0, f.daemon.said)

f = Damaged("on_damage = silent\n")
f.play(300)
f.hit_monitor(160)
had = f.bus.after("rows")
f.play(100)
check("silent: no row is used", f.bus.after("rows") == had, f.bus.counters[-1])
check("silent: nothing is known", f.health()["level"] == STALE and f.bus.health[-1]["flags"] & DAMAGED, f.bus.health[-1])
check("silent: ends", f.daemon.end() == 0, f.daemon.said)

# At the next row, when no state is due before; and without a row, where states are due all the time.
for what, rows, state_s in (("restart", 1, 3600), ("restart without a row", 0, 1)):
    for name in ("d.state", "d.state.old"):
        if os.path.exists(name):
            os.remove(name)
    more = "on_damage = restart\nstate = d.state\nstate_s = %d\n" % state_s
    f = Damaged(more)
    f.play(300)
    f.wait_until_used()
    check("%s: ends" % what, f.daemon.end() == 0, f.daemon.said)
    f = Damaged(more)
    f.next = 300
    f.bus.listen(2.5)
    kept = open("d.state", "rb").read()
    f.hit_monitor(160)
    f.play(rows)
    check("%s: exit 4" % what, f.daemon.process.wait(20) == 4, f.daemon.hear())
    f.daemon.hear()
    check("%s: and says why" % what, b"stopped by on_damage = restart after" in f.daemon.said and b"SIGTERM" not in f.daemon.said, f.daemon.said)
    check("%s: the state file is left alone" % what, state_s == 1 or open("d.state", "rb").read() == kept)
    g = Damaged(more)
    check("%s: goes on" % what, b"going on at t" in g.daemon.said, g.daemon.said)
    check("%s: ends" % what, g.daemon.end() == 0, g.daemon.said)

daemon = Daemon(rimd, "bad.conf", base + "on_damage = perhaps\n")
check("an unknown answer is refused", daemon.end() == 3 and b"on_damage" in daemon.said, daemon.said)
c.finish()
