# SPDX-License-Identifier: MIT
"""The Python package against the command line. Arguments: the program rim, a folder for files.
Seeds are those of rimwatch.example_logs: 1 to 20. Last line: N passed, N failed."""

import contextlib
import doctest
import functools
import inspect
import json
import os
import subprocess
import sys
import warnings

import numpy as np
import pandas as pd

import rimwatch
import rimwatch.detector
import rimwatch.example

RIM, FOLDER = sys.argv[1], os.path.abspath(sys.argv[2])
counts = {True: 0, False: 0}


def check(what, good, seen=""):
    counts[bool(good)] += 1
    if not good:
        print("FAILED:", what, seen)


def rim(*arguments, code=(0,)):
    done = subprocess.run([RIM, *arguments], cwd=FOLDER, capture_output=True, text=True,
                          check=False)
    check(f"rim {arguments[0]}: exit {done.returncode}", done.returncode in code, done.stderr)
    return done.stdout


def refused(what, error, text, call):
    try:
        call()
    except error as reason:
        check(what, text in str(reason), str(reason))
    else:
        check(what, False, "no error")


def write(frame, name):
    path = os.path.join(FOLDER, name)
    with open(path, "w", encoding="ascii") as file:
        file.write(",".join(["t_s", *frame.columns]) + "\n")
        for t, row in zip(frame.index, frame.to_numpy()):
            file.write(",".join([repr(float(t)), *(repr(float(v)) for v in row)]) + "\n")
    return path


def test_same_as_the_command_line():
    frames = rimwatch.example_logs(20)
    paths = [write(frame, f"run_{i}.csv") for i, frame in enumerate(frames)]
    rim("train", *paths, "--out", "cart.rim", "--quick")
    image = rimwatch.train(frames)
    check("the image of tables and of files", image.data == open(f"{FOLDER}/cart.rim", "rb").read())
    check("the image of paths", rimwatch.train(paths).data == image.data)
    flights = [rimwatch.example_logs(1, first=21, bias=b)[0] for b in (0.0, 0.3)]
    names = [write(frame, f"flight_{i}.csv") for i, frame in enumerate(flights)]
    said = rim("replay", *names, "--model", "cart.rim", "--alarms", "a.jsonl", "--labels", "l.csv",
               "--trace", "t.csv")
    result = rimwatch.replay(names, f"{FOLDER}/cart.rim")
    check("digest", said.splitlines()[-1] == f"digest {result.digest}", said)
    check("digest of tables", rimwatch.replay(flights, image).digest == result.digest)
    lines = [json.loads(line) for line in open(f"{FOLDER}/a.jsonl", encoding="utf-8")]
    check("alarms", lines == [a for run in result.runs for a in run.alarms] and lines, lines)
    labels, trace = pd.read_csv(f"{FOLDER}/l.csv"), pd.read_csv(f"{FOLDER}/t.csv")
    findings = pd.concat([run.rows["finding"] for run in result.runs]).to_numpy()
    check("labels", (labels["finding"].to_numpy() == findings).all() and findings.any())
    rows = pd.concat([run.rows for run in result.runs])
    check("trace, read by pandas as it is", list(trace.columns)[:4] == ["t_s", "ln_anom",
          "threshold", "score"] and np.allclose(trace["score"], rows["score"], rtol=1e-8))
    check("healthy", result.runs[0].healthy and not result.runs[1].healthy)
    check("words", result.runs[1].text in said)
    one = rimwatch.Monitor(image)
    for t, row in zip(flights[1].index, flights[1].to_numpy()):
        verdict = one.step(t, row)
    alone = rimwatch.replay(flights[1], image)
    check("step by step", one.digest == alone.digest, one.digest)
    one.reset()
    for t, row in zip(flights[1].index, flights[1].to_numpy().tolist()):
        verdict = one.step(float(t), row)
    check("with lists", one.digest == alone.digest and verdict.level == "ERROR")
    image.save(f"{FOLDER}/saved.rim")
    check("saved", rimwatch.Image.load(f"{FOLDER}/saved.rim").data == image.data)
    check("in words", "flight image" in str(image) and "<pre>" in image._repr_html_())


def slipping(frame):
    """Measured speed beside a prediction that knows nothing of a loss above 1 m/s."""
    true = frame["s.speed_mps"] * np.where(frame["u.cmd_mps"] > 1.0, 0.9, 1.0)
    return pd.DataFrame({"u.cmd_mps": frame["u.cmd_mps"], "z.speed_mps": true,
                         "m.speed_mps": frame["s.speed_mps"]
                         + np.random.default_rng(1).normal(0.0, 0.01, len(frame)),
                         "sd.speed_mps": 0.02})


def test_diagnosis():
    frames = [slipping(frame) for frame in rimwatch.example_logs(4, first=11)]
    paths = [write(frame, f"slip_{i}.csv") for i, frame in enumerate(frames)]
    rim("diagnose", *paths[:3], "--holdout", paths[3], "--out", "found", code=(1,))
    theirs = json.load(open(f"{FOLDER}/found/diagnosis.json", encoding="utf-8"))
    ours = rimwatch.diagnose(paths[:3], holdout=paths[3])
    same = {k: v for k, v in ours.facts.items() if k not in ("command",)}
    check("findings", same["findings"] == theirs["findings"] and theirs["findings"])
    check("gain", same["gain"] == theirs["gain"])
    tables = rimwatch.diagnose(frames[:3], holdout=frames[3])
    check("of tables", tables.facts["findings"] == theirs["findings"])
    check("not adequate", not ours.adequate and ours.findings[0].channel == "speed_mps", str(ours))
    corrected = ours.extension(frames[3])
    before = (frames[3]["z.speed_mps"] - frames[3]["m.speed_mps"]).std()
    after = (corrected["z.speed_mps"] - corrected["m.speed_mps"]).std()
    check("the extension corrects", after < 0.7 * before, (before, after))
    check("the report", "<iframe srcdoc=" in ours._repr_html_() and "speed" in ours._repr_html_())
    ours.save(f"{FOLDER}/saved")
    check("saved", sorted(os.listdir(f"{FOLDER}/saved")) == sorted(os.listdir(f"{FOLDER}/found")))
    called = []

    def simulate(rows):
        called.append(len(rows))
        return {"speed_mps": rows["x.known"], "sd.speed_mps": np.full(len(rows), 0.02)}

    own = [f[["u.cmd_mps", "z.speed_mps"]].rename(columns={"z.speed_mps": "s.speed_mps"})
           .assign(**{"x.known": f["m.speed_mps"]}) for f in frames]
    own_found = rimwatch.diagnose(own[:3], holdout=own[3], simulate=simulate)
    check("one's own simulation", own_found.findings and called == [600] * 4, str(own_found))
    refused("a simulation of nothing", rimwatch.DataError, "neither as z. nor as s.",
            lambda: rimwatch.diagnose(own[:3], simulate=lambda rows: {"heat_K": rows["x.known"]}))


def integrated(runs, first):
    """A falling speed with drag, and a simulation that knows no drag."""
    frames = []
    for seed in range(first, first + runs):
        draw, v, rows = np.random.default_rng(seed), 20.0, []
        for _ in range(300):
            push = draw.uniform(-1.0, 1.0)
            rows.append((push, v))
            v = v + 0.1 * (push - 0.02 * v * abs(v)) + draw.normal(0.0, 0.005)
        u, s = np.array(rows).T
        frames.append(pd.DataFrame({"u.push_mps2": u, "x.speed_mps": s,
                                    "z.speed_mps": np.append(s[1:], np.nan)},
                                   index=pd.Index(np.arange(300) / 10.0, name="t_s")).iloc[:-1])
    return frames


def test_rolled_out():
    def simulate(rows):
        return {"speed_mps": rows["x.speed_mps"] + 0.1 * rows["u.push_mps2"],
                "sd.speed_mps": np.full(len(rows), 0.01)}

    found = rimwatch.diagnose(integrated(3, 1), holdout=integrated(2, 5), simulate=simulate,
                              horizon_s=1.0)
    gains = {g["horizon_s"]: g for g in found.facts["gain"]["table"] if g["where"] == "all"}
    check("rolled out: drag", found.findings[0].cause == "quadratic_drag", str(found))
    # Ten steps add up: ten times the error of one, less what drag itself loses on the way.
    ratio = gains[1.0]["rmse_before"] / gains[0.0]["rmse_before"]
    check("rolled out: errors add up", 6.0 < ratio < 10.5, ratio)
    check("rolled out: corrected", gains[1.0]["ratio"] < 0.1, gains[1.0])


def test_bad_input():
    frame = rimwatch.example_logs(1)[0]
    image = rimwatch.train(rimwatch.example_logs(4))
    refused("a file that is missing", rimwatch.DataError, "none.csv",
            lambda: rimwatch.read("none.csv"))
    refused("no roles", rimwatch.DataError, "no column has a role",
            lambda: rimwatch.replay(pd.DataFrame({"a": [1.0]}), image))
    refused("a column twice", rimwatch.DataError, "stands twice",
            lambda: rimwatch.replay(pd.concat([frame, frame], axis=1), image))
    refused("time that repeats", rimwatch.DataError, "log 1:row 2: column 't_s': time repeats",
            lambda: rimwatch.replay(pd.concat([frame[:1], frame]), image))
    refused("a column that is missing", rimwatch.DataError, "'s.current_A' is missing",
            lambda: rimwatch.replay(frame.drop(columns="s.current_A"), image))
    refused("no image", rimwatch.DataError, "image", lambda: rimwatch.Image(b"nothing"))
    refused("too few runs", rimwatch.DataError, "", lambda: rimwatch.train(frame))
    monitor = rimwatch.Monitor(image)
    refused("a short row", ValueError, "x has 2 values, the image wants 3",
            lambda: monitor.step(0.0, [1.0, 2.0]))
    refused("text in a row", TypeError, "", lambda: monitor.step(0.0, [1.0, "a", 2.0]))
    check("NaN makes no verdict", not monitor.step(0.0, [1.0, float("nan"), 2.0]).valid)
    holes = frame.copy()
    holes.iloc[5, 1] = np.nan
    check("rows with NaN are skipped", "1 skipped" in rimwatch.replay(holes, image).runs[0].text)


def test_interrupted():
    """Ctrl-C: the computation runs beside the thread that hears it, and ends at its next item."""
    import _thread
    import threading

    logs = rimwatch.example_logs(30)
    threading.Timer(0.3, _thread.interrupt_main).start()
    try:
        rimwatch.train(logs)
        check("an interrupted training raises", False)
    except KeyboardInterrupt:
        check("an interrupted training raises", True)
    check("the next training is whole", rimwatch.train(rimwatch.example_logs(4)).warnings == [])


class OfShortTables(rimwatch.RimDetector):
    """The checks fit 10 to 30 rows, of which no run can be made: here such a table is repeated, a little
    noise on it, to 400 rows. What is no table of finite numbers goes on as it is."""

    def fit(self, X, y=None, groups=None):
        rows = np.asarray(X)
        short = rows.ndim == 2 and 1 < len(rows) < 400 and rows.shape[1] > 0
        if short and rows.dtype.kind in "iuf" and np.isfinite(rows).all():
            long = np.concatenate([rows] * (400 // len(rows) + 1)).astype("float64")
            noise = np.random.default_rng(7).standard_normal(long.shape)
            long += 0.01 * noise * (1 + np.abs(rows).max())
            X = pd.DataFrame(long, columns=X.columns) if hasattr(X, "columns") else long
        return super().fit(X, y, groups)


def test_detector():
    from sklearn.utils.estimator_checks import check_estimator

    healthy = "all that fit has seen counts as healthy: none of its rows is an outlier"
    order = "rows follow one another in time: their order, and those before them, matter"
    not_for_us = {"check_outliers_train": healthy,
                  "check_methods_sample_order_invariance": order,
                  "check_methods_subset_invariance": order}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        results = check_estimator(OfShortTables(runs=3), on_fail=None)
    failed = {r["check_name"]: str(r["exception"]) for r in results if r["status"] == "failed"}
    passed = sum(r["status"] == "passed" for r in results)
    print(f"estimator checks: {passed} passed of {len(results)}; do not apply: {', '.join(failed)}")
    check("estimator checks", set(failed) == set(not_for_us), failed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        results = check_estimator(rimwatch.RimDetector(runs=3), on_fail=None)
    odd = {r["check_name"]: str(r["exception"]) for r in results if r["status"] == "failed"
           and "cannot learn from these runs" not in str(r["exception"])
           and r["check_name"] not in not_for_us}
    check("a table too short for runs is refused in words", not odd, odd)


def public_things():
    """What the package offers: classes and functions, and the methods of classes. Those of C++ (Verdict,
    the errors, Monitor.step) are shown in the examples of what gives them."""
    for name in rimwatch.__all__:
        thing = getattr(rimwatch, name)
        if name.startswith("__") or thing.__module__ == "rimwatch._core":
            continue
        yield name, thing
        for key, value in vars(thing).items() if inspect.isclass(thing) else ():
            value = value.__func__ if isinstance(value, classmethod) else value
            if not key.startswith("_") and inspect.isfunction(value):
                yield f"{name}.{key}", value


def test_version():
    said = subprocess.run([RIM, "--version"], capture_output=True, text=True).stdout
    check("the version of rim", said.split()[1] == rimwatch.__version__, said)


@contextlib.contextmanager
def learnt_once():
    """Many examples begin with the same model or diagnosis: here each of these is made once, of tables of the
    same values and, where a simulation is given, the same predictions. A diagnosis gets half of the rows, for a
    fifth of the time, but for RIM_LONG."""
    places = [(rimwatch, "train"), (rimwatch.detector, "train"), (rimwatch, "diagnose"), (rimwatch.example, "diagnose"),
              (rimwatch, "example_logs"), (rimwatch, "example_diagnosis")]
    made = [(module, name, getattr(module, name)) for module, name in places]
    results = {}

    def once(function):
        def called(logs, simulate=None, **options):
            if function.__name__ == "diagnose" and not os.environ.get("RIM_LONG"):
                logs = [log[:len(log) // 2] for log in logs]
            given = dict(options, simulate=simulate) if simulate else options
            tables = [log.to_csv() + (pd.DataFrame(simulate(log)).to_csv() if simulate else "") for log in logs]
            key = function.__name__, tuple(tables), tuple(sorted(options.items()))
            if key not in results:
                results[key] = function(logs, **given)
            return results[key]
        return called

    for module, name, thing in made:
        learns = name in ("train", "diagnose")
        setattr(module, name, once(thing) if learns else functools.lru_cache(None)(thing))
    try:
        yield
    finally:
        for module, name, thing in made:
            setattr(module, name, thing)


def test_documentation():
    things = dict(public_things())
    without = [n for n, thing in things.items() if ">>>" not in (inspect.getdoc(thing) or "")]
    check("an example for each", not without and len(things) > 20, without)
    untyped = [n for n, thing in things.items() if inspect.isfunction(thing)
               and set(inspect.signature(thing).parameters) - {"self", "cls"}
               - set(thing.__annotations__)]
    check("types of all arguments", not untyped, untyped)
    with learnt_once():
        for module in ("", "logs", "monitor", "diagnosis", "example", "detector"):
            name = f"rimwatch.{module}".rstrip(".")
            result = doctest.testmod(sys.modules[name])
            check(f"examples of {name}", result.failed == 0 and result.attempted > 0, result)


for test in [value for key, value in list(globals().items()) if key.startswith("test_")]:
    try:
        test()
    except Exception:  # counted, and the others go on
        import traceback

        traceback.print_exc()
        check(test.__name__, False, "raised")
print(f"{counts[True]} passed, {counts[False]} failed")
sys.exit(counts[False] > 0)
