# SPDX-License-Identifier: MIT
"""bus.py: the other side of rimd in tests: LCM datagrams by hand, from lib/wire's descriptions alone.

Everything goes over the loopback interface; no library beyond Python's own."""
import hashlib
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import time

def begin():
    """The arguments RIMD WIRE DIR of a test, a port of its own, its checks, and the head of every configuration; DIR is
    the current folder from here on."""
    rimd, wire, here = sys.argv[1:4]
    os.chdir(here)
    port = 20000 + os.getpid() % 20000
    checks = Checks()
    base = "image = toy.rim\nlcm = udpm://239.255.76.67:%d?ttl=0\nhealth_ms = 50\n" % port
    return rimd, wire, here, port, checks, checks.check, base


MESSAGE, FRAGMENT = 0x4C433032, 0x4C433033


def fingerprint(name, wire, cache={}):
    """lcm-gen's fingerprint of a type, from a message that rimd or librim packed: held elsewhere
    (tests/lib) to lcm-gen's own. Here it is computed again, from the .lcm file."""
    if name in cache:
        return cache[name]
    value = 0x12345678

    def mix(v, c):
        v = ((v << 8) ^ ((v >> 55 if v < 1 << 63 else (v >> 55) | ~0x1FF) & (1 << 64) - 1)) + c
        return v & (1 << 64) - 1

    def text(v, s):
        v = mix(v, len(s))
        for ch in s.encode():
            v = mix(v, ch)
        return v

    import re
    body = re.sub(r"//[^\n]*", "", open(os.path.join(wire, "rim_%s_t.lcm" % name)).read())
    for kind, member, sizes in re.findall(r"(\w+)\s+(\w+)((?:\[\d+\])*)\s*;", body):
        if kind == "package":
            continue
        value = text(value, member)
        value = text(value, kind)
        sizes = re.findall(r"\d+", sizes)
        value = mix(value, len(sizes))
        for size in sizes:
            value = mix(value, 0)
            value = text(value, size)
    value = ((value << 1) + (value >> 63)) & (1 << 64) - 1
    cache[name] = value
    return value


def sealed(message, name, wire, key, counter):
    """A packed command or observation as a sender with a key sends it (firmware/SECURITY.md)."""
    body = struct.pack(">Q", fingerprint("sealed_" + name, wire)) + message[8:] + struct.pack(">Q", counter)
    return body + hashlib.blake2b(body, key=key, digest_size=16).digest()


ALARM = ">QddIII7B4h4d4d3h3d9d3d3d4d"
ALARM_NAMES = ["t_s", "since_s", "seq", "model_id", "observations", "detector", "state", "level", "kind", "flags",
               "channels", "dims"]
COUNTERS = ["sequence", "rows", "wrong_length", "not_finite", "time_back", "future", "gaps", "incomplete",
            "clock_resets", "stale", "overruns", "step_us", "commands", "commands_refused", "lcm_malformed",
            "lcm_fragments", "lcm_other", "lcm_refused", "lcm_unsent", "can_frames", "can_other", "can_refused",
            "can_errors", "can_bus_off", "can_down", "can_full", "can_unsent", "input_lost", "state_failures",
            "restarts", "state_refused"]
HEALTH = ["t_s", "sequence", "model_id", "observations", "rejected", "gaps", "alarms", "dropped", "level", "flags"]
ENTRY = ["t_s", "to_entry_s", "sequence", "alarm_sequence", "plan_sequence", "model_id", "pose", "flags"]
OK, WARN, ERROR, STALE = range(4)
NONE, RAISED, UPDATED, CLEARED = range(4)


def plan_message(wire, t_us, sequence, poses, count=None):
    """RIM_PLAN's bytes. poses: (after_s, x, y, z, w, x, y, z)."""
    padded = list(poses) + [(0.0,) * 8] * (64 - len(poses))
    return struct.pack(">QqIi512d", fingerprint("plan", wire), t_us, sequence, len(poses) if count is None else count,
                       *[p[0] for p in padded], *[x for p in padded for x in p[1:4]], *[x for p in padded for x in p[4:]])


class Bus:
    """A member of the group on one interface, that of loopback unless told."""
    own = set()  # inodes of this process's sockets

    def __init__(self, wire, port, group="239.255.76.67", interface="127.0.0.1"):
        self.wire, self.to = wire, (group, port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.socket.bind(self.to)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                               socket.inet_aton(group) + socket.inet_aton(interface))
        Bus.own.add(str(os.fstat(self.socket.fileno()).st_ino))
        self.sequence = self.datagrams = 0
        self.key, self.counter = None, 0  # with a key rows are sealed
        self.daemon = None  # whose messages are waited for
        self.alarms, self.health, self.counters, self.entries, self.models, self.raw = [], [], [], [], [], {}
        self.records = []  # bytes of the alarms, in the order in which they came

    def datagram(self, data):
        self.socket.sendto(data, self.to)

    def send(self, channel, payload):
        self.datagram(struct.pack(">II", MESSAGE, self.datagrams & 0xFFFFFFFF) + channel.encode() + b"\0" + payload)
        self.datagrams += 1

    def fragments(self, channel, payload, size, order=None):
        """As liblcm cuts it: size bytes of payload a datagram, sent in that order."""
        parts = (len(payload) + size - 1) // size
        for i in order if order is not None else range(parts):
            head = struct.pack(">IIIIHH", FRAGMENT, self.datagrams & 0xFFFFFFFF, len(payload), i * size, i, parts)
            self.datagram(head + (channel.encode() + b"\0" if i == 0 else b"") + payload[i * size:(i + 1) * size])
        self.datagrams += 1

    def observation(self, t_us, values, sequence=None, count=None):
        if sequence is None:
            sequence, self.sequence = self.sequence, self.sequence + 1
        padded = list(values) + [0.0] * (128 - len(values))
        return struct.pack(">QqIi128d", fingerprint("observation", self.wire), t_us, sequence & 0xFFFFFFFF,
                           len(values) if count is None else count, *padded)

    def wait_for_readers(self, most=40000):
        """Until no socket on this port but our own has more than so many bytes waiting: on a busy machine a reader that
        does not get its turn would lose datagrams. Its queue holds some 200 kB; the wait ends after 30 s."""
        port = "%04X" % self.to[1]
        end = time.monotonic() + 30
        while time.monotonic() < end:
            with open("/proc/self/net/udp") as table:
                lines = [line.split() for line in table][1:]
            if all(int(f[4].split(":")[1], 16) <= most for f in lines if f[1].endswith(":" + port) and f[9] not in Bus.own):
                return
            time.sleep(0.002)

    def row(self, t_us, values, **more):
        message = self.observation(t_us, values, **more)
        if self.key:
            self.counter += 1
            message = sealed(message, "observation", self.wire, self.key, self.counter)
        self.send("RIM_OBSERVATION", message)
        if self.datagrams % 16 == 0:
            self.wait_for_readers()

    def command_bytes(self, code, sequence=0, model=0):
        return struct.pack(">QIIB", fingerprint("command", self.wire), sequence, model, code)

    def command(self, code, sequence=0, model=0):
        self.send("RIM_COMMAND", self.command_bytes(code, sequence, model))

    def answer(self, code):
        """A command about the alarm of the newest record that came."""
        self.command(code, sequence=self.alarms[-1]["seq"], model=self.alarms[-1]["model_id"])

    def plan(self, t_us, sequence, poses, count=None):
        """poses: (after_s, x, y, z, w, x, y, z)."""
        self.send("RIM_PLAN", plan_message(self.wire, t_us, sequence, poses, count))

    def take(self, data):
        if data[:4] != struct.pack(">I", MESSAGE) or b"\0" not in data[8:]:
            return
        channel, payload = data[8:].split(b"\0", 1)
        name = channel.decode()
        self.raw[name] = payload
        if name == "RIM_ALARM":
            field = struct.unpack(ALARM, payload)
            assert field[0] == fingerprint("alarm", self.wire)
            alarm = dict(zip(ALARM_NAMES, field[1:13]))
            alarm.update(channel=field[13:17], shift=field[17:21], feature=field[25:28], center=field[28:31],
                         lower=field[40:43], upper=field[43:46], ln_anom=field[-4], threshold=field[-3], p_value=field[-2], since_sd_s=field[-1])
            self.alarms.append(alarm)
            self.records.append(payload)
        elif name == "RIM_HEALTH":
            field = struct.unpack(">Qd7IBB", payload)
            assert field[0] == fingerprint("health", self.wire)
            self.health.append(dict(zip(HEALTH, field[1:])))
        elif name == "RIM_ENTRY":
            field = struct.unpack(">Qdd5IB", payload)
            assert field[0] == fingerprint("entry", self.wire)
            self.entries.append(dict(zip(ENTRY, field[1:])))
        elif name == "RIM_MODEL":
            field = struct.unpack(">Q7IBB768s96s24d", payload)
            assert field[0] == fingerprint("model", self.wire)
            part = dict(zip(("model_id", "features", "outcomes", "period_us", "block_rows", "first", "count"), field[1:8]))
            names = [field[10][64 * i:64 * i + 64].rstrip(b"\0").decode() for i in range(part["count"])]
            units = [field[11][8 * i:8 * i + 8].rstrip(b"\0").decode() for i in range(part["count"])]
            part.update(quantities=list(zip(names, units, field[12:24], field[24:36])))
            self.models.append(part)
        elif name == "RIM_COUNTERS":
            field = struct.unpack(">Q31I", payload)
            assert field[0] == fingerprint("counters", self.wire)
            self.counters.append(dict(zip(COUNTERS, field[1:])))

    def listen(self, seconds):
        """Takes what comes for so long."""
        end = time.monotonic() + seconds
        while True:
            rest = end - time.monotonic()
            if not select.select([self.socket], [], [], max(rest, 0.0))[0]:
                return
            self.take(self.socket.recv(65536))

    def until(self, condition, seconds=20.0):
        """Listens until the condition holds, or the daemon has ended; whether it did."""
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end or (self.daemon and self.daemon.process.poll() is not None):
                self.listen(0.0)
                return condition()
            self.listen(0.02)
        return True

    def after(self, counter, seconds=20.0):
        """The counters of a message that was made after now."""
        self.listen(0.0)
        had = len(self.counters)
        assert self.until(lambda: len(self.counters) >= had + 2, seconds), "no counters" + (
            "; rimd: %s, %s" % (self.daemon.process.poll(), self.daemon.hear()) if self.daemon else "")
        return self.counters[-1][counter]


class Daemon:
    """rimd, started and ready."""

    def __init__(self, program, config, text, *options, env=None, wait=True):
        open(config, "w").write(text)
        self.said = b""
        self.process = subprocess.Popen([program, *options, config], stderr=subprocess.PIPE,
                                        env=dict(os.environ, **(env or {})))
        os.set_blocking(self.process.stderr.fileno(), False)
        if wait:
            end = time.monotonic() + 20
            while b"ready" not in self.hear() and self.process.poll() is None and time.monotonic() < end:
                time.sleep(0.01)

    def hear(self):
        self.said += self.process.stderr.read() or b""
        return self.said

    def end(self, how=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(how)
        code = self.process.wait(20)
        self.hear()
        return code


class Flight:
    """A daemon, a bus to it, and the rows of a log, each played once and in order."""

    def __init__(self, daemon, bus, log):
        self.daemon, self.bus, self.log, self.next = daemon, bus, log, 0
        bus.daemon = daemon

    def play(self, number):
        """So many true rows."""
        for t_us, values in self.log[self.next:self.next + number]:
            self.bus.row(t_us, values)
            self.bus.listen(0.0002)
        self.next += number
        assert self.next <= len(self.log), "the log is too short"

    def wait_until_used(self):
        """Until the daemon has used all rows that were played, none of which it may refuse: it is in no step then."""
        assert self.bus.until(lambda: self.bus.counters and self.bus.counters[-1]["rows"] == self.next, 120.0), \
            "rows are not used: %s" % self.bus.counters[-1:]


class Checks:
    def __init__(self):
        self.passed = self.failed = self.skipped = 0

    def check(self, what, good, more=""):
        if good:
            self.passed += 1
        else:
            self.failed += 1
            print("FAILED: %s %s" % (what, more), flush=True)

    def finish(self):
        line = "%d passed, %d failed" % (self.passed, self.failed)
        print(line + (", %d skipped" % self.skipped if self.skipped else ""))
        raise SystemExit(self.failed > 0)


def read_rows(path):
    """t_us and values of every row of a CSV log."""
    lines = [line for line in open(path) if not line.startswith("#")][1:]
    for line in lines:
        field = line.split(",")
        yield round(float(field[0]) * 1e6), [float(x) for x in field[1:]]
