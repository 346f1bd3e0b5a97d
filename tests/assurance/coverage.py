#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""coverage.py BUILD FLOORS [--show PART]: lines, branches and MC/DC of lib/src and firmware that the tests ran, room by
room, from clang's profiles in BUILD/profile and the programs in BUILD.

A branch is an outcome of a condition; MC/DC is, of the conditions of the decisions with && or ||, the share shown to
change its decision alone. FLOORS holds rows 'ROOM LINES BRANCHES MCDC' in %, and exceptions: 'PATH | text of a line |
reason' for a line that no test can run. Such a line counts as run; one that is not there any more, or that a test runs
after all, is a mistake. Exit 1 for a room below its floor, and for such a mistake. --show PART: every line, branch and
condition of the files whose name holds PART that no test ran."""
import argparse
import collections
import glob
import json
import os
import subprocess
import sys

arguments = argparse.ArgumentParser()
arguments.add_argument("build")
arguments.add_argument("floors")
arguments.add_argument("--llvm", default="-19")
arguments.add_argument("--show")
o = arguments.parse_args()
ROOTS = ("lib/src", "firmware/rimd", "firmware/transport")
here = os.getcwd()


def export(kind):
    programs = [p for p in sorted(glob.glob(os.path.join(o.build, "tests", "*", "test_*"))) if os.access(p, os.X_OK) and "." not in os.path.basename(p)]
    command = ["llvm-cov" + o.llvm, "export", "-format=" + kind, os.path.join(o.build, "rimd"), "-instr-profile=" + merged]
    for p in programs:
        command += ["-object", p]
    return subprocess.run(command + list(ROOTS), check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout


profiles = glob.glob(os.path.join(o.build, "profile", "*.profraw"))
if not profiles:
    sys.exit("coverage: no profile in %s/profile" % o.build)
merged = os.path.join(o.build, "all.profdata")
subprocess.run(["llvm-profdata" + o.llvm, "merge", "-sparse", "-o", merged] + profiles, check=True)

lines = collections.defaultdict(dict)  # file -> line -> times
for text in export("lcov").split("\n"):
    if text.startswith("SF:"):
        name = os.path.relpath(text[3:], here)
    elif text.startswith("DA:"):
        line, times = text[3:].split(",")[:2]
        lines[name][int(line)] = lines[name].get(int(line), 0) + int(times)
# Of an inline function in a header, what any of the units that include it has run.
branches, conditions = collections.defaultdict(dict), collections.defaultdict(dict)  # file -> where -> run?
for f in json.loads(export("text"))["data"][0]["files"]:
    name = os.path.relpath(f["filename"], here)
    for b in f["branches"]:
        for which, times in (("true", b[4]), ("false", b[5])):
            where = b[0], b[1], which
            branches[name][where] = branches[name].get(where, False) or times > 0
    for m in f["mcdc_records"]:
        for i, shown in enumerate(m[-1]):
            where = m[0], m[1], "condition %d" % (i + 1)
            conditions[name][where] = conditions[name].get(where, False) or shown

floors, excepted, problems = {}, collections.defaultdict(list), []
for number, text in enumerate(open(o.floors), 1):
    text = text.rstrip("\n")
    if "|" in text and not text.startswith("#"):
        path, code, reason = [part.strip() for part in text.split(" | ", 2)]
        excepted[path].append((number, code, reason))
    elif text.split("#")[0].split():
        words = text.split()
        floors[words[0]] = tuple(float(w) for w in words[1:4])
for path, all_of in excepted.items():
    source = open(path).read().split("\n")
    for number, code, reason in all_of:
        missed = [n for n, times in lines[path].items() if times == 0 and source[n - 1].strip() == code]
        if not missed or not reason:
            problems.append("%s:%d: '%s' of %s is run, or is not there, or has no reason" % (o.floors, number, code, path))
        for n in missed:
            lines[path][n] = -1  # by exception


def room(name):
    return "/".join(name.split("/")[:3]) if name.startswith("lib/") else "/".join(name.split("/")[:2])


def shares(names):
    run = [times != 0 for name in names for times in lines[name].values()]
    taken = [good for name in names for good in branches[name].values()]
    shown = [good for name in names for good in conditions[name].values()]
    return [(100.0 * sum(x) / max(len(x), 1), len(x)) for x in (run, taken, shown)]


def line_of(what, names, more=""):
    (a, n), (b, k), (c, m) = shares(names)
    print("%-32s %6d %6.1f %8d %6.1f %6d %6.1f%s" % (what, n, a, k, b, m, c, more))


rooms = collections.defaultdict(list)
for name in sorted(lines):
    rooms[room(name)].append(name)
print("%-32s %6s %6s %8s %6s %6s %6s" % ("room", "lines", "%", "branches", "%", "MC/DC", "%"))
for what in sorted(rooms):
    got = [share for share, _ in shares(rooms[what])]
    low = what not in floors or any(g < need for g, need in zip(got, floors[what]))
    line_of(what, rooms[what], "  BELOW %s" % (floors.get(what),) if low else "")
    if low:
        problems.append("%s is below its floor" % what)
    for name in rooms[what]:
        if len(rooms[what]) > 1 and any(n > 0 and s < g - 0.05 for (s, n), g in zip(shares([name]), got)):
            line_of("  " + name.split("/")[-1], [name])
low = any(share < need for (share, _), need in zip(shares(lines), floors.get("all", ())))
line_of("all", sorted(lines), "  BELOW %s" % (floors["all"],) if low else "")
if low:
    problems.append("all is below its floor")
print("lines by exception: %d" % sum(times == -1 for name in lines for times in lines[name].values()))
if o.show:
    for name in (n for n in sorted(lines) if o.show in n):
        source = open(name).read().split("\n")
        for n in sorted(n for n, times in lines[name].items() if times == 0):
            print("%s:%d: %s" % (name, n, source[n - 1].strip()))
        for (line, column, which), good in sorted({**branches[name], **conditions[name]}.items()):
            if not good:
                print("%s:%d:%d %s   %s" % (name, line, column, which, source[line - 1].strip()))
for what in set(floors) - set(rooms) - {"all"}:
    problems.append("%s is in %s, and nothing of it was run" % (what, o.floors))
for p in problems:
    print("coverage: " + p, file=sys.stderr)
sys.exit(len(problems) > 0)
