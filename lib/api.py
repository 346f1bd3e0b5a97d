#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""api.py NM ARCHIVE: prints the public headers of the library with their size in lines, the
functions that each declares with the lines of their definition, and what rim/monitor.h pulls in.
Exits 1 when a public symbol of the archive (rim_...) is declared in no public header, when a
header declares a function that the archive does not have, when a public header includes a private
one, or above a limit: at most 14 headers, 110 functions, 400 lines for rim/monitor.h."""
import os
import re
import subprocess
import sys

MOST_HEADERS, MOST_FUNCTIONS, MOST_LINES = 14, 110, 400
ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
INCLUDE = os.path.join(ROOT, "lib/include")


def read(path):
    return open(path, encoding="utf-8").read()


def headers():
    found = []
    for where, folders, names in os.walk(INCLUDE):
        folders.sort()
        found += [os.path.relpath(os.path.join(where, name), INCLUDE) for name in sorted(names)]
    return sorted(found, key=lambda name: (name.count("/"), name))


def without_comments(text):
    return re.sub(r"/\*.*?\*/", "", text, flags=re.S)


def declared(text):
    """Names of the functions that a header declares."""
    code = re.sub(r"^\s*#(.*\\\n)*.*$", "", without_comments(text), flags=re.M)
    return re.findall(r"\b(rimi?_[a-z0-9_]+)\s*\([^;{}]*\)\s*;", code)


def pulled(name, seen):
    """All headers of ours that an include of `name` reads, itself included."""
    if name not in seen and os.path.exists(os.path.join(INCLUDE, name)):
        seen.add(name)
        for other in re.findall(r'#include "([^"]+)"', read(os.path.join(INCLUDE, name))):
            pulled(other, seen)
    return seen


def definitions():
    """Lines of each function's definition in lib/src."""
    sizes = {}
    for where, _, names in os.walk(os.path.join(ROOT, "lib/src")):
        for name in names:
            if not name.endswith(".c"):
                continue
            text = read(os.path.join(where, name))
            for match in re.finditer(r"^[a-z][^;{}()]*\b(rim_[a-z0-9_]+)\([^;{}]*\) \{(?:[^\n]*\}|.*?^\})$", text, re.M | re.S):
                sizes[match.group(1)] = match.group(0).count("\n") + 1
    return sizes


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: api.py NM ARCHIVE")
    symbols = subprocess.check_output([sys.argv[1], "-p", sys.argv[2]], text=True)
    exported = {line.split()[2] for line in symbols.splitlines() if re.fullmatch(r"\S+ T rim_\w+", line)}
    sizes, problems, everywhere = definitions(), [], {}
    names = headers()
    for name in names:
        text = read(os.path.join(INCLUDE, name))
        functions = declared(text)
        print("%-24s %4d lines, %2d functions" % (name, text.count("\n"), len(functions)))
        for function in functions:
            print("  %-40s %3d" % (function, sizes.get(function, 0)))
            if function in everywhere:
                problems.append("%s: declared in %s and in %s" % (function, everywhere[function], name))
            everywhere[function] = name
        for other in re.findall(r'#include "([^"]+)"', text):
            if not os.path.exists(os.path.join(INCLUDE, other)):
                problems.append("%s includes %s, which is not public" % (name, other))
    problems += ["%s is public, and no header declares it" % s for s in sorted(exported - set(everywhere))]
    problems += ["%s declares %s, which the library does not have" % (everywhere[s], s)
                 for s in sorted(set(everywhere) - exported)]
    monitor = sorted(pulled("rim/monitor.h", set()))
    lines = sum(read(os.path.join(INCLUDE, name)).count("\n") for name in monitor)
    print("rim/monitor.h pulls in %d lines of ours: %s" % (lines, " ".join(monitor)))
    print("%d headers (at most %d), %d public functions (at most %d)"
          % (len(names), MOST_HEADERS, len(everywhere), MOST_FUNCTIONS))
    if len(names) > MOST_HEADERS or len(everywhere) > MOST_FUNCTIONS or lines > MOST_LINES:
        problems.append("more than the limits allow")
    for problem in problems:
        print("api: " + problem, file=sys.stderr)
    sys.exit(1 if problems else 0)


main()
