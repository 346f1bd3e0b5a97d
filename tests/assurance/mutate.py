#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""mutate.py BUILD [--number N] [--seed S] [--jobs J] [--files GLOB [--lines N,M]]: do the unit tests notice a wrong operator?

N places are drawn from all places of lib/src where an operator fits: relations (< <= > >= == !=), && and ||, + - * /
between operands, ++ and --, a constant 0 or 1, a condition negated, a statement left out. Each mutant's file is
compiled into a copy of BUILD's library, so that it stops at what C does not define (`make test-sanitized` looks at
that too), and the tests of its own source (test_NAME and test_NAME_*), of the whole library (ALWAYS) and of the
other sources of its room run against it, as far as they link that source, the cheapest first, until a case notices. One that none of these notices meets the tests of its own
source again under the address sanitizer, as `make check` runs them: what reads or writes beyond an array is noticed.
A test that takes ten times and five seconds more than without a mutant, or --seconds, has noticed: its loop does not end. A
mutant that does not compile is drawn again. Prints each survivor, then the share killed with Wilson's 95 %
interval and the seed; exit 0. A survivor is either a missing test or an equivalent program: a reader decides, and
writes the latter into --equivalent, rows 'PATH | line | mutated line | reason': such a mutant is not drawn, nor is the
smaller or larger of two numbers by <= instead of <. A row whose
line is not in PATH any more is a mistake, exit 1.
SIGTERM ends it early: the share is then of those tried so far, which are a sample as well."""
import argparse
import concurrent.futures
import fnmatch
import glob
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

arguments = argparse.ArgumentParser()
arguments.add_argument("build")
arguments.add_argument("--number", type=int, default=40)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("--jobs", type=int, default=2)
arguments.add_argument("--files", default="*")
arguments.add_argument("--lines", default="", help="only these, as 'N,M,...'")
arguments.add_argument("--seconds", type=int, default=60)
arguments.add_argument("--equivalent", default="tests/assurance/equivalent.txt")
o = arguments.parse_args()
FLAGS = "-std=c11 -O1 -ffp-contract=off -fno-math-errno -fno-tree-slp-vectorize -w -Ilib/include -Ilib/src -Itests/lib".split()
ADDRESS = ["-fsanitize=address"]
DEFINED = ["-fsanitize=undefined", "-fno-sanitize=alignment,vptr", "-fsanitize-undefined-trap-on-error"]
HEADERS = glob.glob("tests/lib/*.h") + glob.glob("lib/src/*/*.h") + glob.glob("lib/include/rim/**/*.h", recursive=True)
work = os.path.join(o.build, "mutate")
os.makedirs(work, exist_ok=True)
shared = dict(re.findall(r"(\w+/\w+)=(\w+)", re.sub(r"\\\n", " ", open("tests/Dir.mk").read())))
ALWAYS = ["bits", "bits_search", "bits_monitor", "bits_explained", "bits_alarms", "ends", "monitor_ends", "select_ends", "monitor", "guard", "monitor_trained", "monitor_alarms", "integrand", "exact", "describe", "cause", "contrary", "search_means", "search_coarse", "refused_wire", "refused_plan", "refused_search", "refused_monitor"]
RULES = [(r"(?<![<>=!\-+&|])<(?![<=])", ["<=", ">="]), (r"<=", ["<", ">"]), (r"(?<![>\-])>(?![>=])", [">=", "<="]),
         (r">=", [">", "<"]), (r"==", ["!="]), (r"!=", ["=="]), (r"&&", ["||"]), (r"\|\|", ["&&"]),
         (r"(?<=[\w\])]) \+ (?=[\w(])", [" - "]), (r"(?<=[\w\])]) - (?=[\w(])", [" + "]),
         (r"(?<=[\w\])]) \* (?=[\w(])", [" / "]), (r"(?<=[\w\])]) / (?=[\w(])", [" * "]),
         (r"\+\+", ["--"]), (r"(?<![\w.])0u?(?![\w.])", ["1"]), (r"(?<![\w.])1u?(?![\w.])", ["0", "2"]),
         (r"(?<=if )\((?=.*\)$)", ["(!("])]


def places(path):
    found, depth, comment = [], 0, False
    for number, line in enumerate(open(path).read().split("\n")):
        code = re.sub(r"/\*.*?\*/", lambda m: " " * len(m.group()), line)
        if comment:
            comment = "*/" not in code
            continue
        if "/*" in code:
            comment, code = True, code[:code.index("/*")]
        if depth > 0 and not code.lstrip().startswith(("#", "_Static_assert", "case ")):
            for rule, put in RULES:
                for m in re.finditer(rule, code):
                    if code[:m.start()].count('"') % 2 == 0:
                        found += [(path, number, m.start(), m.end(), p) for p in put]
            if re.match(r"\s+[\w>.\[\]()*&-]+ ?([-+*|&^]?=|\().*;$", code) and not re.match(r"\s+(return|const|double|uint|float|bool|size_t)", code):
                found.append((path, number, 0, len(line), ""))
        depth += code.count("{") - code.count("}")
    return found


def mutated(place):
    path, number, begin, end, put = place
    lines = open(path).read().split("\n")
    line = lines[number]
    if put == "(!(":  # the whole condition
        line = line[:begin] + "(!(" + line[end:] + ")"
    else:
        line = line[:begin] + put + line[end:]
    lines[number] = line
    return "\n".join(lines), line


def equivalents(path):
    """(source, line, mutated line), all stripped: programs that do the same."""
    known = set()
    for number, text in enumerate(open(path), 1):
        if text.startswith("#") or not text.strip():
            continue
        parts = [part.strip() for part in text.split(" | ")]
        if len(parts) != 4 or parts[1] not in [line.strip() for line in open(parts[0])]:
            sys.exit("mutate: %s:%d: four parts are needed, and a line that is in the source" % (path, number))
        known.add(tuple(parts[:3]))
    return known


# The smaller or larger of two: where they are equal both are the same number.
SAME = re.compile(r"(?<![-+*/%&|] )\b([\w.>\[\]-]+) [<>]=? ([\w.>\[\]-]+) \? (?:\1 : \2|\2 : \1)(?![\w.(\[]| [-+*/%<>&|=?])")


def is_choice(place):
    """Whether only what is chosen of two equal numbers differs."""
    path, number, begin, end, put = place
    line = open(path).read().split("\n")[number]
    return put.strip("=") == line[begin:end].strip("=") and any(m.start(2) - 5 < begin < m.start(2) for m in SAME.finditer(line))


def is_known(place):
    if is_choice(place):
        return True
    return (place[0], open(place[0]).read().split("\n")[place[1]].strip(), mutated(place)[1].strip() or "(left out)") in known


def of_source(name):
    """test_NAME and test_NAME_*: those that there are."""
    paths = glob.glob("tests/lib/test_%s.c" % name) + sorted(glob.glob("tests/lib/test_%s_*.c" % name))
    return [os.path.basename(path)[5:-2] for path in paths]


def tests_of(path, own_only=False):
    room, name = path.split("/")[2], os.path.basename(path)[:-2]
    own = shared.get(room + "/" + name, name)
    own_tests = of_source(own)
    mates = [os.path.basename(p)[:-2] for p in sorted(glob.glob("lib/src/%s/*.c" % room))]
    mates = [shared.get(room + "/" + m, m) for m in mates]
    if own_only:
        return own_tests
    return list(dict.fromkeys(own_tests + ALWAYS + [test for mate in mates for test in of_source(mate)]))


def is_held_to_lcm_gen(test):
    return "#include <rim_" in open("tests/lib/test_%s.c" % test).read()


compiling = threading.Lock()


def object_of(test, sanitizer):
    with compiling:
        return compiled(test, sanitizer)


def compiled(test, sanitizer):
    out = os.path.join(work, "test_%s%s.o" % (test, "_address" if sanitizer else ""))
    source = "tests/lib/test_%s.c" % test
    if not os.path.exists(out) or os.path.getmtime(out) < max(map(os.path.getmtime, [source, *HEADERS])):
        extra = ["-isystem", os.path.join(o.build, "lcmgen")] if is_held_to_lcm_gen(test) else []
        subprocess.run(["gcc", *FLAGS, *sanitizer, *extra, "-c", source, "-o", out], check=True)
    return out


def killed_by(place):
    """The test that notices; None: it survives; False: it does not compile."""
    text, _ = mutated(place)
    own_work = os.path.join(work, threading.current_thread().name)
    os.makedirs(own_work, exist_ok=True)
    source = os.path.join(own_work, os.path.basename(place[0]))
    open(source, "w").write(text)
    made = os.path.join(own_work, os.path.basename(place[0])[:-2] + ".o")
    library = os.path.join(own_work, "librim.a")
    if not put_into(library, place[0], source, made, DEFINED):
        return False
    tests = tests_of(place[0])
    for test in tests:
        find_limit(test)
    own = tests_of(place[0], own_only=True)
    tests = [test for test in tests if os.path.basename(place[0])[:-2] in linked[test]]  # the others do not run it
    for test in sorted(tests, key=lambda test: limits[test, False] * (0.2 if test in own else 1.0)):
        status = run_test(test, library, own_work)
        if status != 0:
            return test if status is not None else test + " (too long)"
    put_into(library, place[0], source, made, ADDRESS)
    for test in tests_of(place[0], own_only=True):
        find_limit(test, ADDRESS)
        if run_test(test, library, own_work, ADDRESS) != 0:
            return test + " (address)"
    return None


def put_into(library, path, source, made, sanitizer):
    """The library with this source in place of its own; whether it compiles."""
    include = ["-I", os.path.dirname(path)]
    if subprocess.run(["gcc", *FLAGS, *sanitizer, *include, "-c", source, "-o", made], stderr=subprocess.DEVNULL).returncode:
        return False
    shutil.copy(os.path.join(o.build, "librim.a"), library)
    subprocess.run(["ar", "r", library, made], check=True, stderr=subprocess.DEVNULL)
    return True


def run_test(test, library, folder, sanitizer=()):
    """Links and runs; the exit status, or None when it takes too long."""
    program = os.path.join(folder, "test_" + test)
    extra = glob.glob(os.path.join(o.build, "lcmgen", "*.c")) if is_held_to_lcm_gen(test) else []
    subprocess.run(["gcc", *FLAGS, *sanitizer, object_of(test, sanitizer), *extra, "-I", os.path.join(o.build, "lcmgen"), "-o", program, library,
                    "-lcmocka", "-lm", "-Wl,-Map=" + program + ".map"], check=True)
    with subprocess.Popen([program], stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as running:
        late = []
        limit = threading.Timer(limits.get((test, bool(sanitizer)), o.seconds), lambda: (late.append(True), running.kill()))
        limit.start()
        failed = any(b"[  FAILED  ]" in line for line in running.stdout)  # the cases after the first that fails say no more
        if failed:
            running.kill()
        status = running.wait()
        limit.cancel()
    return 1 if failed else None if late else status


def find_limit(test, sanitizer=()):
    """How long this test may take. One that fails by itself would take credit for every mutant."""
    with finding:
        if (test, bool(sanitizer)) in limits:
            return
        own_work = os.path.join(work, "limits")
        os.makedirs(own_work, exist_ok=True)
        began = time.monotonic()
        if run_test(test, os.path.join(o.build, "librim.a"), own_work, sanitizer) != 0:
            print("mutate: test_%s fails without a mutant" % test, flush=True)
            os._exit(1)
        linked[test] = set(re.findall(r"librim\.a\((\w+)\.o\)", open(os.path.join(own_work, "test_" + test + ".map")).read()))
        limits[test, bool(sanitizer)] = min(o.seconds, 5 + 10 * (time.monotonic() - began))


limits, linked, finding = {}, {}, threading.Lock()
files = [p for p in sorted(glob.glob("lib/src/*/*.c")) if fnmatch.fnmatch(p, o.files)]
known = equivalents(o.equivalent)
lines = [int(line) - 1 for line in o.lines.split(",") if line]
everything = [place for path in files for place in places(path) if not lines or place[1] in lines]
print("%d places in %d files, seed %d" % (len(everything), len(files), o.seed), flush=True)
draw = random.Random(o.seed)
draw.shuffle(everything)
killed = tried = alike = 0
ended = []
signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
waiting, ahead = [], iter(everything)  # in the order in which they were drawn
with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
    while tried < o.number and not ended:
        while len(waiting) < o.jobs and (place := next(ahead, None)) is not None:
            if is_known(place):
                alike += 1
            else:
                waiting.append((place, pool.submit(killed_by, place)))
        if not waiting:
            break
        place, answer = waiting.pop(0)
        who = answer.result()
        if who is False:
            continue
        tried += 1
        killed += who is not None
        if who is None:
            print("survives: %s:%d: %s" % (place[0], place[1] + 1, mutated(place)[1].strip() or "(left out) " +
                                          open(place[0]).read().split("\n")[place[1]].strip()), flush=True)
if tried == 0:
    sys.exit("mutate: no place to try")
p, z = killed / tried, 1.96
middle, half = p + z * z / (2 * tried), z * math.sqrt(p * (1 - p) / tried + z * z / (4 * tried * tried))
print("equivalent, and not tried: %d" % alike)
print("killed %d of %d: %.1f %% [%.1f, %.1f]" % (killed, tried, 100 * p, 100 * (middle - half) / (1 + z * z / tried),
                                                 100 * (middle + half) / (1 + z * z / tried)))
