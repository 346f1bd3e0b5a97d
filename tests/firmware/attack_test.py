# SPDX-License-Identifier: MIT
"""attack_test.py RIMD WIRE DIR: what a hostile or broken sender tries while an alarm stands (firmware/SECURITY.md).
DIR holds toy.rim and long.csv, a run with a fault that goes on. attack_test.py RIMD WIRE DIR ADDRESS: only whether
rimd keeps to its interface; ADDRESS is that of another one, in a network of the test's own."""
import math
import os
import select
import signal
import socket
import struct
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bus import CLEARED, ERROR, FRAGMENT, MESSAGE, RAISED, UPDATED, Bus, Daemon, Flight, begin, fingerprint, plan_message, read_rows, sealed

# No lcm_interface and no max_jump_s: what holds is what rimd does unasked.
rimd, wire, here, port, c, check, base = begin()
base += "stale_ms = 600000\n"
log = list(read_rows("long.csv"))


class Listener(Bus):
    """Hears all but what this test forged: messages that begin with eight zeros."""

    def take(self, data):
        if b"RIM_ALARM\0" + b"\0" * 8 not in data and b"RIM_HEALTH\0" + b"\0" * 8 not in data:
            super().take(data)


class Attacked(Flight):
    """A daemon with rows of long.csv, and an alarm that stands."""

    def __init__(self, more="", name="x.conf"):
        bus = Listener(wire, port)
        super().__init__(Daemon(rimd, name, base + more), bus, log)
        check("ready", b"rimd: ready" in self.daemon.said, self.daemon.said)

    def raise_alarm(self):
        while not any(a["state"] == RAISED for a in self.bus.alarms) and self.next < len(log):
            self.play(20)
        self.play(100)
        check("an alarm stands", self.bus.after("rows") == self.next and self.bus.alarms[-1]["level"] == ERROR)
        return self

    def now_us(self):
        return log[self.next - 1][0]

    def stands(self, what):
        """The alarm is still there, and was not ended and raised again."""
        self.bus.after("rows")
        states = [a["state"] for a in self.bus.alarms]
        check("%s: the alarm stands" % what, states.count(RAISED) == 1 and CLEARED not in states
              and self.bus.health[-1]["level"] == ERROR, (states, self.bus.health[-1]))

    def used(self, what, number):
        """The next so many true rows are all used."""
        had = self.bus.after("rows")
        self.play(number)
        now = self.bus.after("rows")
        check("%s: all true rows are used" % what, now - had == number, (had, now, self.bus.counters[-1]))

    def end(self):
        check("ends", self.daemon.end() == 0, self.daemon.said)


def counted(bus, counter, send):
    had = bus.after(counter)
    send()
    return bus.after(counter) - had


def commands():
    """Nobody silences what he has not named."""
    f = Attacked().raise_alarm()
    seq, model = f.bus.alarms[-1]["seq"], f.bus.alarms[-1]["model_id"]
    check("the model has a number", model != 0)
    for code in (1, 2):
        for what, named in (("naught", {}), ("the model alone", {"model": model}), ("the record alone", {"sequence": seq}),
                            ("an older record", {"sequence": seq - 1, "model": model}),
                            ("all ones", {"sequence": 0xFFFFFFFF, "model": 0xFFFFFFFF})):
            got = counted(f.bus, "commands_refused", lambda: f.bus.command(code, **named))
            check("command %d that names %s is refused" % (code, what), got == 1, got)
            f.stands("command %d that names %s" % (code, what))
    f.used("after them", 100)
    f.bus.answer(1)
    check("who has seen it may acknowledge it", f.bus.until(lambda: f.bus.alarms[-1]["flags"] & 4))
    f.bus.answer(2)
    check("and clear it", f.bus.until(lambda: f.bus.alarms[-1]["state"] == CLEARED), f.bus.alarms[-1])
    f.end()
    f = Attacked("command_any = yes\n").raise_alarm()
    f.bus.command(2)
    check("command_any: naught means any", f.bus.until(lambda: f.bus.alarms[-1]["state"] == CLEARED), f.bus.alarms[-1])
    f.end()


def times():
    """Time stamps that are wrong, one at a time, cost nothing; a clock that moved for good is believed."""
    f = Attacked().raise_alarm()
    for ahead_s, counter in ((59, "future"), (1, "future"), (3e9, "future"), (-59, "time_back"), (-1e9, "time_back")):
        what = "a row %g s off" % ahead_s
        got = counted(f.bus, counter, lambda: f.bus.row(f.now_us() + round(ahead_s * 1e6), log[0][1]))
        check("%s is counted" % what, got == 1, got)
        f.used(what, 110)
        f.stands(what)
    had = f.bus.after("rows")
    for i in range(20):  # 20 forged rows among 1800
        f.bus.row(f.now_us() + 59000000, log[0][1])
        f.play(90)
    check("one in 90 rows 59 s ahead: 1800 of 1800 true rows", f.bus.after("rows") - had == 1800, f.bus.counters[-1])
    check("and no clock was reset", f.bus.counters[-1]["clock_resets"] == 0)
    f.stands("one in 90")
    for sign in (1, -1):
        for i in range(99):
            f.bus.row(f.now_us() + sign * 59000000 + 50000 * i, log[0][1])
        f.used("99 rows that agree", 10)
        f.stands("99 rows that agree")
    check("nothing was reset", f.bus.counters[-1]["clock_resets"] == 0)
    had = f.bus.after("rows")
    for t_us, values in log[f.next:f.next + 150]:  # the source's clock was put on by an hour
        f.bus.row(t_us + 3600000000, values)
        f.bus.listen(0.0002)
    check("a clock put on is believed after 100 rows", f.bus.after("rows") - had == 51, f.bus.counters[-1])
    f.stands("a clock put on")
    f.end()


def line(speed):
    return [(float(i), -20.0 + speed * i, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0) for i in range(41)]


def plans():
    """A plan that is none ends no look-ahead."""
    f = Attacked("axis_x = s.position_a_m\n")
    f.raise_alarm()
    f.play(1200 - f.next)  # by then the region is a place
    bus = f.bus
    bus.plan(f.now_us(), 1, line(1.0))
    check("the plan enters the region", bus.until(lambda: bus.entries and bus.entries[-1]["to_entry_s"] > 0), bus.alarms[-1])
    good = plan_message(wire, f.now_us(), 2, line(-1.0))
    nan, back = line(-1.0), line(-1.0)
    nan[40], back[40] = (40.0, math.nan) + nan[40][2:], (1.0,) + back[40][1:]
    for what, junk in (("noise", os.urandom(len(good))), ("a plan cut", good[:-1]), ("a plan too long", good + b"x"),
                       ("nothing", b""), ("another type", b"\0" * 8 + good[8:]),
                       ("a plan of 65 poses", plan_message(wire, f.now_us(), 2, line(-1.0), count=65)),
                       ("a plan of no pose", plan_message(wire, f.now_us(), 2, [])),
                       ("a plan whose last pose is no number", plan_message(wire, f.now_us(), 2, nan)),
                       ("a plan whose last pose is before the one before", plan_message(wire, f.now_us(), 2, back))):
        got = counted(bus, "lcm_refused", lambda: bus.send("RIM_PLAN", junk))
        check("%s is refused" % what, got == 1, got)
        had = len(bus.entries)
        check("%s: the warning goes on" % what, bus.until(lambda: len(bus.entries) >= had + 2)
              and all(e["plan_sequence"] == 1 and e["to_entry_s"] > 0 for e in bus.entries[had:]), bus.entries[-2:])
    bus.send("RIM_PLAN", good)
    check("a good one replaces it", bus.until(lambda: bus.entries[-1]["plan_sequence"] == 2 and bus.entries[-1]["to_entry_s"] < 0))
    f.end()


def floods():
    """Every datagram of a flood is counted, or was lost and counted as lost; nothing remains of it."""
    f = Attacked("axis_x = s.position_a_m\n").raise_alarm()
    bus = f.bus

    def message(channel, payload):
        return struct.pack(">II", MESSAGE, 0) + channel.encode() + b"\0" + payload

    command = struct.pack(">QIIB", fingerprint("command", wire), 999999, bus.alarms[-1]["model_id"], 2)
    fragment = struct.pack(">IIIIHH", FRAGMENT, 1, 60000, 59999, 1, 2) + b"x" * 1000  # beyond its own end
    for what, counter, data, number in (
            ("garbage", "lcm_malformed", b"\xa5" * 64, 5000),
            ("observations of time 0", "time_back", message("RIM_OBSERVATION", bus.observation(0, log[0][1])), 3000),
            ("commands for another record", "commands_refused", message("RIM_COMMAND", command), 5000),
            ("fragments of 60 kB", "lcm_fragments", fragment, 5000),
            ("messages of 60 kB", "lcm_other", message("CAMERA", b"x" * 60000), 500),
            ("junk plans", "lcm_refused", message("RIM_PLAN", b"\xff" * 4632), 2000),
            ("forged alarms", "", message("RIM_ALARM", b"\0" * 600), 3000),
            ("forged health", "", message("RIM_HEALTH", b"\0" * 46), 3000)):
        bus.after("rows")
        before = bus.counters[-1]
        for i in range(number):
            bus.datagram(data)
        bus.wait_for_readers(0)
        bus.after("rows")
        bus.after("rows")
        after = bus.counters[-1]
        # What rimd itself sends comes back to its socket, and may be among what was lost there.
        own = 3 * (after["sequence"] - before["sequence"]) + 10
        grown = {k: after[k] - before[k] for k in after if after[k] != before[k] and k not in ("sequence", "gaps", "step_us")}
        if counter:
            check("flood of %s: every one is counted" % what, 0 <= grown.get(counter, 0) + grown.get("input_lost", 0) - number <= own, grown)
        else:
            check("flood of %s: changes no other counter" % what, set(grown) <= {"input_lost"}, grown)
        f.used("after a flood of %s" % what, 100)
        f.stands("flood of %s" % what)
    f.end()


def state():
    """What was heard is known after a kill; what is damaged is refused, counted, and the one before is used."""
    for i in range(5):
        for name in ("k.state", "k.state.old"):
            if os.path.exists(name):
                os.unlink(name)
        f = Attacked("state = k.state\nstate_s = 3600\n")
        while not f.bus.alarms and f.next < len(log):
            f.play(5)
        f.daemon.end(signal.SIGKILL)  # at the moment when it is heard
        heard = f.bus.alarms[-1]
        f.bus, first = Bus(wire, port), f.next
        f.daemon = Daemon(rimd, "x.conf", base + "state = k.state\nstate_s = 3600\n")
        check("goes on", b"going on" in f.daemon.said, f.daemon.said)
        check("knows of the record that was heard", f.bus.until(lambda: f.bus.alarms) and f.bus.alarms[0]["state"] == UPDATED
              and f.bus.alarms[0]["seq"] == heard["seq"] + 1, (heard, f.bus.alarms))
        f.play(200)
        f.bus.after("rows")
        check("and does not raise it anew", all(a["state"] != RAISED for a in f.bus.alarms), (first, f.bus.alarms))
        f.end()
    newest, older = open("k.state", "rb").read(), open("k.state.old", "rb").read()
    hurt = newest[:500] + bytes([newest[500] ^ 1]) + newest[501:]

    def start(what, files, refused, said, goes_on):
        for name, data in zip(("k.state", "k.state.old"), files):
            if os.path.exists(name):
                os.unlink(name)
            if data is not None:
                open(name, "wb").write(data)
        bus = Bus(wire, port)
        d = Daemon(rimd, "x.conf", base + "state = k.state\n")
        check("%s: said" % what, all(s in d.said for s in said), d.said)
        bus.after("rows")
        check("%s: counted" % what, bus.counters[-1]["state_refused"] == refused, bus.counters[-1])
        check("%s: the alarm" % what, (bus.health[-1]["level"] == ERROR) == goes_on, bus.health[-1])
        check("%s: ends" % what, d.end() == 0)

    start("both good", (newest, older), 0, (b"k.state: going on",), True)
    start("the newest damaged", (hurt, older), 1, (b"k.state: damaged", b"k.state.old: going on"), True)
    start("the newest cut", (newest[:-9], older), 1, (b"k.state: cut", b"k.state.old: going on"), True)
    start("power lost between the two renames", (None, newest), 0, (b"k.state: none yet", b"k.state.old: going on"), True)
    start("both damaged", (hurt, hurt), 2, (b"k.state: damaged", b"k.state.old: damaged", b"beginning anew"), False)
    start("none", (None, None), 0, (b"k.state: none yet", b"beginning anew"), False)


def keys():
    """With a key, what is not sealed with it commands nothing and is no row; nothing is good twice."""
    secret, wrong = bytes(range(32)), bytes(31) + b"\1"
    for name, text, mode in (("a.key", secret.hex() + "\n", 0o600), ("open.key", secret.hex() + "\n", 0o644), ("short.key", "00\n", 0o600)):
        open(name, "w").write(text)
        os.chmod(name, mode)
    conf = "key = a.key\nkey_observations = yes\nstate = key.state\nstate_s = 3600\n"
    d = Daemon(rimd, "x.conf", base + conf)
    if b"without libsodium" in d.hear():
        check("refused with a reason", d.end() == 3)
        c.skipped += 1
        print("not here: rimd with libsodium")
        return
    d.end()
    for text, reason in ((conf.replace("a.key", "open.key"), b"open.key: others may read"), (conf.replace("a.key", "short.key"), b"short.key: a key has 64"),
                         (conf.replace("a.key", "no.key"), b"no.key: No such file"), ("key = a.key\n", b"key needs state"),
                         ("key_observations = yes\n", b"key_observations needs key"),
                         (conf + "input = can\ncan = vcan0\n", b"key_observations needs input = lcm")):
        d = Daemon(rimd, "x.conf", base + text)
        check("refused: %s" % reason.decode(), d.end() == 3 and reason in d.said, d.said)
    for name in ("key.state", "key.state.old"):
        if os.path.exists(name):
            os.unlink(name)
    f = Attacked(conf)
    bus = f.bus
    bus.key = secret
    f.raise_alarm()
    row = bus.observation(log[f.next][0], log[f.next][1])
    good = sealed(row, "observation", wire, secret, bus.counter + 1)
    for what, junk in (("a row without a tag", row), ("a row of another key", sealed(row, "observation", wire, wrong, bus.counter + 1)),
                       ("a row whose value was changed", good[:40] + bytes([good[40] ^ 1]) + good[41:]),
                       ("a row whose counter was changed", good[:-17] + bytes([good[-17] ^ 1]) + good[-16:]),
                       ("a row cut", good[:-1]), ("a row too long", good + b"x"),
                       ("a row whose counter was used", sealed(row, "observation", wire, secret, bus.counter)),
                       ("a row older than the window", sealed(row, "observation", wire, secret, bus.counter - 64))):
        check("%s is refused" % what, counted(bus, "lcm_refused", lambda: bus.send("RIM_OBSERVATION", junk)) == 1)
    check("none of them was used", bus.after("rows") == f.next, bus.counters[-1])
    f.used("after them", 50)
    seq, model = bus.alarms[-1]["seq"], bus.alarms[-1]["model_id"]
    command = bus.command_bytes(1, seq, model)
    good = sealed(command, "command", wire, secret, 1000)
    refused = [("a command without a tag", command), ("a command of another key", sealed(command, "command", wire, wrong, 1000)),
               ("a command cut", good[:-1]), ("a command too long", good + b"x"), ("a tag of zeros", good[:-16] + bytes(16)),
               ("another command under the same tag", good[:16] + b"\2" + good[17:])]

    def is_refused(what, junk):
        check("%s is refused" % what, counted(bus, "commands_refused", lambda: bus.send("RIM_COMMAND", junk)) == 1)
        f.stands(what)

    for what, junk in refused:
        is_refused(what, junk)
    check("nobody has acknowledged it", not bus.alarms[-1]["flags"] & 4, bus.alarms[-1])
    bus.send("RIM_COMMAND", good)
    check("a sealed command is obeyed", bus.until(lambda: bus.alarms[-1]["flags"] & 4), bus.alarms[-1])
    is_refused("the same datagram again", good)
    describe = [sealed(bus.command_bytes(3), "command", wire, secret, n) for n in (1002, 1001, 900)]
    for what, message, obeyed in (("a later one", describe[0], 1), ("one that came late", describe[1], 1), ("one that came too late", describe[2], 0)):
        had = bus.after("commands")
        bus.send("RIM_COMMAND", message)
        check("%s: obeyed or not" % what, bus.after("commands") - had == obeyed, bus.counters[-1])
    clear = sealed(bus.command_bytes(2, bus.alarms[-1]["seq"], model), "command", wire, secret, 1001)
    is_refused("a counter that came late, used again", clear)
    bus.until(lambda: os.path.exists("key.state"))
    bus.listen(0.3)  # the state that holds the counters is on the medium
    f.daemon.end(signal.SIGKILL)
    f.bus = Bus(wire, port)
    f.bus.key, f.bus.counter, bus = secret, bus.counter, f.bus
    f.daemon = Daemon(rimd, "x.conf", base + conf)
    check("goes on", b"going on" in f.daemon.said, f.daemon.said)
    bus.until(lambda: bus.alarms)
    for what, junk in (("after a kill: the same datagram", good), ("after a kill: a used counter", clear)):
        check("%s is refused" % what, counted(bus, "commands_refused", lambda: bus.send("RIM_COMMAND", junk)) == 1)
    check("and the alarm stands", all(a["state"] != CLEARED for a in bus.alarms) and bus.health[-1]["level"] == ERROR, bus.alarms)
    bus.send("RIM_COMMAND", sealed(bus.command_bytes(2, bus.alarms[-1]["seq"], model), "command", wire, secret, 2000))
    check("a sealed one clears it", bus.until(lambda: bus.alarms[-1]["state"] == CLEARED), bus.alarms[-1])
    f.used("after a kill", 20)
    f.end()
    # Since the first start; of the messages before the kill as many as its state knew of.
    check("counted by their kind", b"with the key: unsealed" in f.daemon.said and b" forged " in f.daemon.said
          and b" replayed " in f.daemon.said, f.daemon.said)
    check("the key is not in the state", secret not in open("key.state", "rb").read())


def watchdog():
    """systemd is told that the loop goes round, and not when it hangs."""
    s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    s.bind(os.path.join(os.getcwd(), "notify"))
    d = Daemon(rimd, "x.conf", base.replace("health_ms = 50", "health_ms = 3600000"),
               env={"NOTIFY_SOCKET": os.path.join(os.getcwd(), "notify"), "WATCHDOG_USEC": "100000"})

    def beats(number):
        return all(select.select([s], [], [], 20)[0] and s.recv(100) == b"WATCHDOG=1" for _ in range(number))

    check("the watchdog is fed", beats(10))
    d.process.send_signal(signal.SIGSTOP)
    while select.select([s], [], [], 0.5)[0]:
        s.recv(100)
    check("a daemon that hangs does not feed it", not select.select([s], [], [], 0.5)[0])
    d.process.send_signal(signal.SIGCONT)
    check("and then goes on", beats(2))
    check("ends", d.end() == 0, d.said)


def confined(address):
    """Rows that come in by another interface, into which somebody else on this computer has brought the group."""
    other = Bus(wire, port, interface=address)
    near = Bus(wire, port)
    for text, taken in (("", 0), ("lcm_interface = 127.0.0.1\n", 0), ("lcm_interface = %s\n" % address, 50)):
        d = Daemon(rimd, "x.conf", base + text)
        bus = other if taken else near
        check("ready", b"ready" in d.said, d.said)
        for t_us, values in log[:50]:
            other.row(t_us, values)
        bus.after("rows")
        check("'%s': rows of another interface" % text.strip(), bus.after("rows") == taken, bus.counters[-1])
        check("ends", d.end() == 0)


if len(sys.argv) > 4:
    confined(sys.argv[4])
else:
    for part in (commands, times, plans, floods, state, keys, watchdog):
        part()
c.finish()
