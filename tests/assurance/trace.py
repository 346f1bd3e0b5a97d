#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""trace.py FILE: every requirement of FILE (rows '| A1 | sentence | reason | code | test |') names code and a test that
are there. Code and tests are `path` or `path:name`; the name must stand in that file. Exit 1 where a requirement has
none, names one that is not there, or has a number twice."""
import os
import re
import sys

problems, numbers, tests = [], [], 0
for row in open(sys.argv[1]):
    cells = [c.strip() for c in row.strip().strip("|").split("|")]
    if not re.fullmatch(r"[A-Z]\d+", cells[0]):
        continue
    number = cells[0]
    if number in numbers:
        problems.append("%s stands twice" % number)
    numbers.append(number)
    if len(cells) != 5:
        problems.append("%s has %d cells, not 5" % (number, len(cells)))
        continue
    for what, cell in (("code", cells[3]), ("test", cells[4])):
        named = re.findall(r"`([^`]+)`", cell)
        if not named:
            problems.append("%s has no %s" % (number, what))
        for one in named:
            path, _, name = one.partition(":")
            if not os.path.isfile(path):
                problems.append("%s: there is no %s" % (number, path))
            elif name and name not in open(path, encoding="utf-8").read():
                problems.append("%s: %s has no '%s'" % (number, path, name))
            tests += what == "test"
for p in problems:
    print("trace: " + p, file=sys.stderr)
if not numbers:
    sys.exit("trace: no requirement in %s" % sys.argv[1])
print("%d requirements, %d tests named" % (len(numbers), tests))
sys.exit(len(problems) > 0)
