#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""coverage.py BUILD FLOORS: lines and branches of lib/src and firmware that the unit tests ran, room by room, from
the gcov data in BUILD. A branch of gcov is a condition's outcome, so this is branch coverage of every operand of
&& and ||. FLOORS holds 'ROOM LINES BRANCHES' in %: exit 1 where a room is below. Files below their room are listed."""
import collections
import glob
import json
import os
import subprocess
import sys
import tempfile

build, floors = sys.argv[1:3]
lines = collections.defaultdict(dict)     # file -> line -> times
branches = collections.defaultdict(dict)  # file -> (line, index) -> times
with tempfile.TemporaryDirectory() as where:
    data = [os.path.abspath(p) for p in glob.glob(os.path.join(build, "**", "*.gcda"), recursive=True)]
    if not data:
        sys.exit("coverage: no .gcda under %s" % build)
    for i, path in enumerate(data):
        subprocess.run(["gcov", "--json-format", "--branch-probabilities", "--stdout", path], check=True, cwd=where,
                       stdout=open(os.path.join(where, "%d.json" % i), "wb"), stderr=subprocess.DEVNULL)
    for name in glob.glob(os.path.join(where, "*.json")):
        for text in open(name):
            if not text.strip():
                continue
            for f in json.loads(text)["files"]:
                of = f["file"]
                if not of.startswith(("lib/src/", "firmware/rimd/", "firmware/transport/")):
                    continue
                for line in f["lines"]:
                    n = line["line_number"]
                    lines[of][n] = lines[of].get(n, 0) + line["count"]
                    for k, b in enumerate(line["branches"]):
                        branches[of][n, k] = branches[of].get((n, k), 0) + b["count"]


def share(table, names):
    all_of = [c for name in names for c in table[name].values()]
    return 100.0 * sum(c > 0 for c in all_of) / max(len(all_of), 1), len(all_of)


def room(name):
    return "/".join(name.split("/")[:3]) if name.startswith("lib/") else "/".join(name.split("/")[:2])


least = {}
for text in open(floors):
    words = text.split("#")[0].split()
    if words:
        least[words[0]] = (float(words[1]), float(words[2]))
rooms = collections.defaultdict(list)
for name in sorted(lines):
    rooms[room(name)].append(name)
failed = False
print("%-24s %8s %8s %9s %9s" % ("room", "lines", "%", "branches", "%"))
for name in sorted(rooms):
    (a, n), (b, k) = share(lines, rooms[name]), share(branches, rooms[name])
    need = least.get(name)
    low = need is None or a < need[0] or b < need[1]
    failed = failed or low
    print("%-24s %8d %8.1f %9d %9.1f%s" % (name, n, a, k, b, "  BELOW %s" % (need,) if low else ""))
    for f in rooms[name]:
        (c, _), (d, _) = share(lines, [f]), share(branches, [f])
        if c < a - 3 or d < b - 8:
            missing = sorted(n for n, count in lines[f].items() if count == 0)
            print("    %-36s %5.1f %5.1f  not run: %s" % (f, c, d, " ".join(map(str, missing[:12]))
                                                         + (" ..." if len(missing) > 12 else "")))
every = sorted(lines)
print("%-24s %8s %8.1f %9s %9.1f" % ("all", "", share(lines, every)[0], "", share(branches, every)[0]))
for name in set(least) - set(rooms):
    print("coverage: %s is in %s, and nothing of it was run" % (name, floors))
    failed = True
sys.exit(failed)
