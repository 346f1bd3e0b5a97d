#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""others.py --rim RIM --work DIR [--measured DIR] [--seconds 15] [--seed 1] [--only SET ...]: rim diagnose beside what a user would take otherwise.

The same rows and hold-outs for all: sparse regression (pysindy's STLSQ over polynomials, signs and magnitudes; columns scaled, threshold .1; and
with the threshold that contiguous blocks choose) and symbolic regression (pyoperon, so many seconds). What is regressed is z - m over the x. and u.
columns and m. Only rim is told of the hold-out before it is judged there: it drops terms that make it worse, as it would for its user.
Printed: which of the right terms are named, how many terms or nodes, of the RMSE on the hold-out how much is left, and whether the set's bar is
met: no fewer right terms than any other, at most 1.05 times the least error, with fewer terms than the one that leaves it; where that one has no
more terms than rim, as few.
The measured machines are skipped, saying so, where they are not; the simulated ones are tests/hidden/physics.py's, strangers.py's and strays.py's."""
import argparse
import csv
import glob
import json
import os
import subprocess
import sys
import warnings

import numpy
from pysindy import STLSQ
from pyoperon.sklearn import SymbolicRegressor

warnings.simplefilter("ignore")
FRICTION = ("sign", "linear")
# machine of physics.py: channel, its velocity (or what the law is of), the right terms
SIMULATED = {
    "pendulum": ("rate_radps", "x.rate_radps", FRICTION), "motor": ("current_A", "x.omega_radps", FRICTION),
    "back_emf": ("domega_radps", "x.omega_radps", ("linear",)), "ship": ("dturn_degps", "x.turn_degps", ("drag",)),
    "arm": ("torque1_Nm", "x.qd1_radps", FRICTION), "cylinder": ("force_N", "x.stroke_mps", FRICTION),
    "train": ("dv_mps", "x.speed_mps", ("drag",)), "thruster": ("speed_mps", None, ()), "payload": ("dv_mps", None, ()),
    "tyres": ("yaw_radps", None, ()), "belt": ("belt_mps", None, ()), "tank": ("dlevel_mm", None, ()), "furnace": ("dT_K", None, ()),
    "spring": ("force_N", None, ()), "drone": ("dclimb_mps", None, ()),
}
STRANGERS = {
    "press": ("force_kN", "x.rod_mmps", FRICTION), "swing": ("alpha_radps2", "x.theta_dot", FRICTION), "copter": ("ax_mps2", "x.vx_mps", ("linear",)),
    "boat": ("du_mps", "x.u_mps", ("drag",)), "winch": ("torque", None, ()), "sensor": ("p_bar", None, ()), "payarm": ("tau_Nm", "x.qd_radps", FRICTION),
    "oven": ("dT_degC", None, ()), "servo": ("angle_deg", None, ()), "valve": ("flow", None, ()),
}
# of strays.py: of the right terms the cause, and the columns of the sparse regression that say it; no column: nothing of it can
STRAYS = {
    "propeller": ("thrust_N", None, (("product", "u.prop_rps*x.airspeed_mps"),)), "cogging": ("amps", "x.rotor_radps", ("sign", ("periodic",))),
    "strapdown": ("ax", None, (("gain", "m", "x.table_x_mps2"), ("coupling", "x.table_y_mps2"))),
    "runway": ("along_mps2", "x.ground_speed_mps", ("drag",)), "strut": ("force_N", "x.stroke_mmps", ("sign", "drag", ("coupling", "x.stroke_mm"))),
    "sonar": ("echo_m", None, (("product", "x.water_degC*m", "x.depth_plan_m*x.water_degC"),)),
    "balance": ("shown_g", None, (("coupling", "x.room_degC"),)), "hoist": ("cage_m", None, (("product", "x.drum_m*x.rope_kN", "x.rope_kN*m"),)),
    "survey": ("along_mps", None, (("delay",),)), "peltier": ("cold_degC", None, (("coupling", "x.hot_degC"),)),
}
CAUSES = {"sign": "coulomb_friction", "linear": "viscous_friction", "drag": "quadratic_drag"}


def read(paths, channel):
    """Features (rows x columns), their names, z - m, and the first row of every file."""
    x, r, names, starts = [], [], None, []
    for path in paths:
        starts.append(len(r))
        with open(path, encoding="utf-8") as lines:
            for row in csv.DictReader(lines):
                names = [n for n in row if n[:2] in ("x.", "u.", "s.")]
                x.append([float(row[n]) for n in names] + [float(row["m." + channel])])
                r.append(float(row["z." + channel]) - float(row["m." + channel]))
    return numpy.array(x), names + ["m"], numpy.array(r), starts


def library(x, names):
    """Columns and names of the sparse regression: 1, f, f g, f^3, sign f, |f|, f |f|."""
    columns, of = [numpy.ones(len(x))], ["1"]
    for i, a in enumerate(names):
        f = x[:, i]
        for text, column in ((a, f), (a + "^3", f ** 3), ("sign(%s)" % a, numpy.sign(f)), ("abs(%s)" % a, abs(f)),
                             ("%s*abs(%s)" % (a, a), f * abs(f))):
            columns.append(column)
            of.append(text)
        for j in range(i, len(names)):
            columns.append(f * x[:, j])
            of.append("%s*%s" % (a, names[j]))
    return numpy.column_stack(columns), of


def sparse(theta, r, threshold):
    """Coefficients of STLSQ with every column and the target scaled to one."""
    scale = numpy.sqrt((theta ** 2).mean(0)) + 1e-300
    size = numpy.sqrt((r ** 2).mean()) + 1e-300
    model = STLSQ(threshold=threshold, alpha=1e-6, max_iter=50)
    model.fit(theta / scale, (r / size)[:, None])
    return numpy.asarray(model.coef_).ravel() * size / scale


def cross_validated(theta, r):
    """The threshold that predicts contiguous fifths best from the rest."""
    best, of_best = .1, numpy.inf
    part = numpy.arange(len(r)) * 5 // len(r)
    for threshold in (.01, .02, .05, .1, .2, .4):
        left = sum(((r - theta @ sparse(theta[part != k], r[part != k], threshold))[part == k] ** 2).sum() for k in range(5))
        if left < of_best:
            best, of_best = threshold, left
    return best


def named(of, coefficients, velocity, wanted):
    texts = {t for t, c in zip(of, coefficients) if c != 0}
    forms = {"sign": "sign(%s)" % velocity, "linear": velocity, "drag": "%s*abs(%s)" % (velocity, velocity)}
    also = {"drag": "%s*%s" % (velocity, velocity)}  # where the speed never changes its sign
    return sum(bool(texts.intersection(w[1:])) if isinstance(w, tuple) else forms[w] in texts or also.get(w) in texts for w in wanted)


def rms(a):
    return float(numpy.sqrt((a ** 2).mean()))


def compare(o, title, fit, held, channel, velocity, wanted):
    x, names, r, _ = read(fit, channel)
    xh, _, rh, _ = read(held, channel)
    theta, of = library(x, names)
    theta_held, _ = library(xh, names)
    rows = []
    for label, threshold in (("pysindy .1", .1), ("pysindy cv", cross_validated(theta, r))):
        c = sparse(theta, r, threshold)
        rows.append((label, named(of, c, velocity, wanted), int((c != 0).sum()), rms(rh - theta_held @ c) / rms(rh)))
    operon = SymbolicRegressor(allowed_symbols="add,sub,mul,div,constant,variable,exp,sin,sqrt,abs,square,tanh", max_time=o.seconds,
                               generations=100000, random_state=o.seed, n_threads=1, max_length=40)
    operon.fit(x, r)
    tree = operon.get_model_string(operon.model_, 3)
    rows.append(("operon", None, len(tree.replace("(", " ").replace(")", " ").split()), rms(rh - operon.predict(xh)) / rms(rh)))
    out = os.path.join(o.work, title.replace(" ", "_"))
    command = [o.rim, "diagnose"] + fit + [a for h in held for a in ("--holdout", h)] + ["--out", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    with open(out + "/diagnosis.json", encoding="utf-8") as text:
        d = json.load(text)
    mine = [f for f in d["findings"] if f["channel"] == channel and f["cause"] not in ("noise", "stuck", "dropout")]
    causes = {f["cause"] for f in mine}
    rows.append(("rim", sum((w[0] if isinstance(w, tuple) else CAUSES[w]) in causes for w in wanted), sum(max(1, len(f["form"]["basis"])) for f in mine),
                 d["gain"]["channels"][channel]["ratio"]))
    for label, right, terms, left in rows:
        print("%-22s %-11s %-7s %5d  %6.3f" % (title, label, "-" if right is None or not wanted else "%d/%d" % (right, len(wanted)), terms, left),
              flush=True)
    found = {label: (right, terms, left) for label, right, terms, left in rows}
    print("%-22s %s" % (title, verdict(found, len(wanted))), flush=True)
    return found


def verdict(found, wanted):
    """Whether rim names no fewer right terms than any other, leaves at most 1.05 times the least error, with fewer terms than who leaves that."""
    right, terms, left = found["rim"]
    others = {label: f for label, f in found.items() if label != "rim"}
    best = min(others, key=lambda label: others[label][2])
    missed = []
    if wanted and right < max(f[0] or 0 for f in others.values()):
        missed.append("fewer right terms")
    if left > 1.05 * others[best][2]:
        missed.append("error %.2f times that of %s" % (left / others[best][2], best))
    if terms > others[best][1]:
        missed.append("%d terms, %s %d" % (terms, best, others[best][1]))
    return "MISSED: " + "; ".join(missed) if missed else "met" if terms < others[best][1] else "met, with as few terms"


def measured(o):
    """Title, files to fit, held out, channel, velocity, right terms."""
    at = lambda *p: sorted(glob.glob(os.path.join(o.measured, *p)))
    if not at("emps", "v_fit1.csv"):
        print("skipped: no measured machines in %s" % o.measured)
        return
    for form, channel in (("v", "velocity_mps"), ("dv", "dv_mps"), ("inv", "force_N")):
        yield "emps " + form, at("emps", form + "_fit*.csv"), at("emps", form + "_pulses.csv"), channel, "x.velocity_mps", FRICTION
    for j in "123":
        yield "arm joint " + j, at("ur10e", "j%s_fit*.csv" % j), at("ur10e", "j%s_hold.csv" % j), "torque_Nm", "x.rate_radps", FRICTION
    runs = at("f1tenth", "run*.csv")
    for channel in ("speed_mps", "turn_radps"):
        yield "car " + channel, runs[:10], runs[10:], channel, None, ()


def simulated(o):
    for machine, (channel, velocity, wanted) in {**SIMULATED, **STRANGERS, **STRAYS}.items():
        drawer = "physics.py" if machine in SIMULATED else "strangers.py" if machine in STRANGERS else "strays.py"
        folder = os.path.join(o.work, "logs", machine)
        os.makedirs(folder, exist_ok=True)
        subprocess.run([sys.executable, os.path.join(os.path.dirname(os.path.abspath(__file__)), drawer), "--seed", str(o.seed), "--family",
                        machine, "--out", folder, "--truth", folder + "/truth.json"], check=True)
        yield machine, sorted(glob.glob(folder + "/run_*.csv")), [folder + "/holdout_1.csv"], channel, velocity, wanted


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rim", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--measured", default="")
    parser.add_argument("--seconds", type=int, default=15)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[], help="the sets whose names begin so")
    o = parser.parse_args()
    os.makedirs(o.work, exist_ok=True)
    print("%-22s %-11s %-7s %5s  %6s   (seed %d, operon %d s)" % ("machine", "tool", "named", "terms", "left", o.seed, o.seconds))
    tables = []
    for case in list(measured(o)) + list(simulated(o)):
        if o.only and not case[0].startswith(tuple(o.only)):
            continue
        tables.append((compare(o, *case), len(case[5])))
    for tool in ("pysindy .1", "pysindy cv", "operon"):
        sets = len(tables)
        better = sum(t["rim"][2] <= 1.05 * t[tool][2] for t, _ in tables)
        fewer = sum(t["rim"][1] < t[tool][1] for t, _ in tables)
        print("rim beside %-11s at most 1.05 times its error in %d of %d sets, fewer terms in %d" % (tool + ":", better, sets, fewer))
    said = [verdict(t, n) for t, n in tables]
    print("bars met in %d of %d sets, in %d of these with as few terms as who leaves least" %
          (sum(v.startswith("met") for v in said), len(said), sum(v.startswith("met,") for v in said)))
    right = lambda tool: sum(t[tool][0] or 0 for t, n in tables if n)
    wanted = sum(n for _, n in tables)
    print("right terms named: rim %d, pysindy .1 %d, pysindy cv %d, of %d" % (right("rim"), right("pysindy .1"), right("pysindy cv"), wanted))


if __name__ == "__main__":
    main()
