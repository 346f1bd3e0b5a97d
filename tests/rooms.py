#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""rooms.py [FOLDER...]: prints which room includes which, and exits 1 when a file includes another
room than FOLDER/rooms.txt allows, when a room has no line there, or when the rooms form a cycle.

FOLDER is lib, firmware or host_tools (all three without an argument). rooms.txt has one line per
room, 'room: rooms that it may include', and for lib one line per public header, 'rim/X.h = room'.
In firmware, 'lib' in the list of a room allows the library's public headers and 'lib/ROOM' one of
its private rooms; the host tools may use all of the library. Headers that are not in this tree (the system's) are not looked at."""
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SOURCES = {"lib": "lib/src", "firmware": "firmware", "host_tools": "host_tools"}
SUFFIXES = (".c", ".h", ".cpp", ".hpp", ".S")


def read_table(folder, problems):
    """Returns {room: set of allowed rooms} and {public header: room}."""
    path = os.path.join(ROOT, folder, "rooms.txt")
    allowed, public = {}, {}
    if not os.path.exists(path):
        problems.append("%s/rooms.txt: no such file" % folder)
        return allowed, public
    for number, line in enumerate(open(path), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        if "=" in line:
            header, room = (part.strip() for part in line.split("=", 1))
            public[header] = room
        elif ":" in line:
            room, others = line.split(":", 1)
            if room.strip() in allowed:
                problems.append("%s/rooms.txt:%d: room '%s' stands twice" % (folder, number, room))
            allowed[room.strip()] = set(others.split())
        else:
            problems.append("%s/rooms.txt:%d: neither 'room: rooms' nor 'header = room'" % (folder, number))
    return allowed, public


def sources(folder):
    """Yields (path below the root, room) of every source file; a public header has no room yet."""
    base = SOURCES[folder]
    tops = [base] + (["lib/include"] if folder == "lib" else [])
    for top in tops:
        for where, folders, names in os.walk(os.path.join(ROOT, top)):
            folders.sort()
            for name in sorted(names):
                if name.endswith(SUFFIXES):
                    path = os.path.relpath(os.path.join(where, name), ROOT)
                    inside = os.path.relpath(path, top)
                    yield path, (None if top == "lib/include" else inside.split("/")[0]), inside


def includes(path):
    text = open(os.path.join(ROOT, path), encoding="utf-8").read()
    for found in re.finditer(r'^\s*#\s*include\s*[<"]([^">]+)[">]', text, re.M):
        yield text.count("\n", 0, found.start()) + 1, found.group(1)


def exists(*parts):
    return os.path.isfile(os.path.join(ROOT, *parts))


def target(folder, path, name, public):
    """The room that an include leads to: 'room' of this folder, 'lib', 'lib/room', or None."""
    if exists(os.path.dirname(path), name) and "/" not in name:
        return ""  # a file beside this one
    if exists(SOURCES[folder], name) and "/" in name:
        return name.split("/")[0]
    if exists("lib/include", name):
        return public.get(name, "?" + name) if folder == "lib" else "lib"
    if exists("lib/src", name) and "/" in name:
        return "lib/" + name.split("/")[0]
    return None


def find_cycle(graph):
    """A list of rooms that lead back to the first, or an empty one."""
    done = set()

    def walk(room, way):
        if room in way:
            return way[way.index(room):] + [room]
        if room in done:
            return []
        for other in sorted(graph.get(room, ())):
            cycle = walk(other, way + [room])
            if cycle:
                return cycle
        done.add(room)
        return []

    for room in sorted(graph):
        cycle = walk(room, [])
        if cycle:
            return cycle
    return []


def check(folder):
    problems = []
    allowed, public = read_table(folder, problems)
    graph, missing, unnamed = {}, set(), set()
    for path, room, inside in sources(folder):
        room = room or public.get(inside)
        if room is None:
            problems.append("%s: is in no room: add '%s = room' to %s/rooms.txt" % (path, inside, folder))
            continue
        if room not in allowed:
            missing.add(room)
            continue
        edges = graph.setdefault(room, {})
        for line, name in includes(path):
            other = target(folder, path, name, public)
            if other is None or other in ("", room):
                continue
            if other.startswith("?"):
                unnamed.add(other[1:])
                continue
            edges[other] = edges.get(other, 0) + 1
            if folder == "host_tools" and other.split("/")[0] == "lib":
                continue
            if other not in allowed[room]:
                problems.append("%s:%d: room %s may not include room %s (%s)" % (path, line, room, other, name))
    for room in sorted(missing):
        problems.append("%s/rooms.txt: no line for room '%s'" % (folder, room))
    for room in sorted(set(allowed) - set(graph)):
        problems.append("%s/rooms.txt: room '%s' has no source file" % (folder, room))
    cycle = find_cycle(allowed) or find_cycle({room: set(edges) for room, edges in graph.items()})
    if cycle:
        problems.append("%s: the rooms form a cycle: %s" % (folder, " -> ".join(cycle)))
    print("%s:" % folder)
    for room in allowed:
        edges = graph.get(room, {})
        print("  %-14s -> %s" % (room, " ".join("%s(%d)" % (o, edges[o]) for o in sorted(edges)) or "-"))
    return problems


def main():
    folders = sys.argv[1:] or list(SOURCES)
    for folder in folders:
        if folder not in SOURCES:
            sys.exit("rooms.py: '%s' is none of %s" % (folder, ", ".join(SOURCES)))
    problems = [problem for folder in folders for problem in check(folder)]
    for problem in problems:
        print("rooms.py: " + problem, file=sys.stderr)
    sys.exit(1 if problems else 0)


main()
