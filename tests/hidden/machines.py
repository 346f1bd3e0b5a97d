#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""machines.py --seed N --family F --out DIR --truth FILE: logs of machines whose physics the simulation lacks.

Families that nature (C++) does not draw: friction with a dead band, delays through limits, drifts that begin late, slopes
within a band, friction on a measured force, sizes that differ from log to log, regions that go on beyond the data, laws
that are in no catalogue; and, as nulls, machines whose prediction starts from a noisy reading of its own state, or whose
noise is not white. Nothing is shared with the engine, not even random numbers. Same truth as nature writes (README.md)."""
import argparse
import json
import math
import os
import random

ROWS, DT = 2200, 0.1
FAMILIES = {  # family: what a diagnosis should call it
    "dead_band": "coulomb_friction", "limited_delay": "delay", "late_drift": "drift", "slope_band": "slope",
    "force_friction": "coulomb_friction", "force_drag": "quadratic_drag", "differing_drag": "quadratic_drag",
    "open_region": "bias", "stribeck": "coulomb_friction", "law_product": "unknown", "law_wave": "unknown",
    "law_decay": "unknown", "law_root": "unknown",
}
NULLS = ["noisy_start", "coloured", "coarse", "wild"]


def smooth(rng, span, slow, rows=ROWS):
    """A sum of three sines about zero, within some `span`."""
    parts = [(span * rng.uniform(.2, .5), rng.uniform(1, 3) / slow, rng.uniform(0, 6.28)) for _ in range(3)]
    return [sum(a * math.sin(w * i * DT + p) for a, w, p in parts) for i in range(rows)]


def clamp(x, most):
    return max(-most, min(most, x))


class Rover:
    """Two channels: the changes of speed and turn rate within a row."""
    sd = {"dv_mps": .010, "dw_radps": .020}

    def __init__(self, rng):
        self.kv, self.kw = rng.uniform(1.2, 2.5), rng.uniform(1.5, 3)
        self.most_v, self.most_w = rng.uniform(.03, .06), rng.uniform(.08, .15)
        self.extra = ["x.extra%d" % k for k in range(6)]

    def step(self, v, w, uv, uw):
        return clamp((uv - v) * self.kv * DT, self.most_v), clamp((uw - w) * self.kw * DT, self.most_w)

    def log(self, rng, effect, noise, late=0, channel="dv_mps"):
        uv, uw = smooth(rng, .9, 3.0), smooth(rng, 1.2, 2.5)
        extras = [smooth(rng, 1.0, rng.uniform(4, 20)) for _ in self.extra]
        heat = smooth(rng, 8.0, 30.0)
        x, y, a, v, w = rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-3, 3), 0.0, 0.0
        names = ["x.x_m", "x.y_m", "x.heading_rad", "x.v_mps", "x.w_radps", "u.v_mps", "u.w_radps", "x.heat_degC"]
        rows, truth, m_of = [], [], []
        for i in range(ROWS):
            heading = (a + math.pi) % (2 * math.pi) - math.pi
            m = dict(zip(self.sd, self.step(v, w, uv[i], uw[i])))
            then = dict(zip(self.sd, self.step(v, w, uv[max(0, i - late)], uw[max(0, i - late)])))
            t = {c: m[c] + (then[c] - m[c] if late and c == channel else 0.0) for c in m}
            place = {"x": x, "y": y, "a": heading, "v": v, "w": w, "t": i * DT, "heat": 20 + heat[i], "e": extras[0][i],
                     "f": extras[1][i]}
            t[channel] += effect(place)
            rows.append([x, y, heading, v, w, uv[i], uw[i], 20 + heat[i]] + [e[i] for e in extras])
            truth.append(t)
            m_of.append(m)
            x, y = x + DT * v * math.cos(a), y + DT * v * math.sin(a)
            x, y = x - .004 * x, y - .004 * y
            a, v, w = a + DT * w, v + t["dv_mps"], w + t["dw_radps"]
        return names + self.extra, rows, m_of, truth, measure(rng, self.sd, truth, noise)


class Slide:
    """One channel: the force on an axis, by inverse dynamics."""
    sd = {"force_N": 2.0}

    def __init__(self, rng):
        self.mass = rng.uniform(5, 60)
        self.name = rng.choice(["x.velocity_mps", "x.velocity", "x.speed_mps", "x.rate"])

    def log(self, rng, effect, noise, late=0, channel="force_N"):
        q = smooth(rng, .5, 2.0)
        names = ["x.position_m", self.name, "x.warmth_degC"]
        heat = smooth(rng, 5.0, 40.0)
        rows, truth, m_of = [], [], []
        for i in range(ROWS):
            v = (q[min(i + 1, ROWS - 1)] - q[max(i - 1, 0)]) / (2 * DT)
            acc = (q[min(i + 1, ROWS - 1)] - 2 * q[i] + q[max(i - 1, 0)]) / DT / DT
            m_of.append({"force_N": self.mass * acc})
            truth.append({"force_N": self.mass * acc + effect({"x": q[i], "v": v, "t": i * DT, "e": heat[i]})})
            rows.append([q[i], v, 30 + heat[i]])
        return names, rows, m_of, truth, measure(rng, self.sd, truth, noise)


class Noisy:
    """One channel: a speed whose prediction starts from its own noisy reading. Nothing is wrong."""
    def __init__(self, rng):
        self.noise, self.pull = rng.uniform(.01, .02), rng.uniform(.5, 2.0)
        self.sd = {"v_mps": math.sqrt(self.noise ** 2 * (1 + (1 - DT * self.pull) ** 2) + .004 ** 2)}

    def log(self, rng, effect, noise, late=0, channel="v_mps"):
        u = smooth(rng, 1.0, 3.0)
        v, rows, truth, m_of, z = 0.0, [], [], [], []
        read = v + self.noise * rng.gauss(0, 1)
        for i in range(ROWS):
            m = read + DT * self.pull * (u[i] - read)
            v += DT * self.pull * (u[i] - v) + .004 * rng.gauss(0, 1)
            rows.append([read, u[i]])
            read = v + self.noise * rng.gauss(0, 1)
            m_of.append({"v_mps": m})
            truth.append({"v_mps": m})
            z.append({"v_mps": read})
        return ["x.v_mps", "u.v_mps"], rows, m_of, truth, z


def measure(rng, sd, truth, noise):
    out, last = [], {c: rng.gauss(0, 1) for c in sd}
    for row in truth:
        z = {}
        for c in sd:
            white = rng.gauss(0, 1)
            if noise == "coloured":
                white = last[c] = .5 * last[c] + math.sqrt(.75) * white
            if noise == "wild":
                white /= math.sqrt(sum(rng.gauss(0, 1) ** 2 for _ in range(5)) / 5) * math.sqrt(5 / 3)
            z[c] = row[c] + sd[c] * white
            if noise == "coarse":
                z[c] = .5 * sd[c] * round(z[c] / (.5 * sd[c]))
        out.append(z)
    return out


def draw(rng, family):
    """World, effect of a place for every log, rows of delay, channel."""
    rover, slide = Rover(rng), Slide(rng)
    sign = lambda v: (v > 0) - (v < 0)
    turn = rng.random() < .5 and family not in ("slope_band",)
    channel, own = ("dw_radps", "w") if turn else ("dv_mps", "v")
    sd = Rover.sd[channel] * rng.uniform(.8, 1.5)
    side = rng.choice([-1, 1])
    same = lambda f: [f] * 4
    if family == "dead_band":
        return rover, same(lambda p: -sd * sign(p[own]) * (abs(p[own]) > .04)), 0, channel
    if family == "limited_delay":
        return rover, same(lambda p: 0.0), rng.randint(2, 4), channel
    if family == "late_drift":
        start = rng.uniform(.25, .55) * ROWS * DT
        return rover, same(lambda p: side * 2 * sd * max(0, p["t"] - start) / (ROWS * DT - start)), 0, channel
    if family == "slope_band":
        low = rng.uniform(-1.2, 0)
        high, phase = low + rng.uniform(.8, 1.6), rng.uniform(0, 6.28)
        return rover, same(lambda p: 1.4 * sd * math.cos(p["a"] - phase) * (low < p["x"] < high)), 0, channel
    if family == "open_region":
        level = rng.uniform(20, 24)
        return rover, same(lambda p: side * sd * (p["heat"] > level)), 0, channel
    if family == "force_friction":
        c, d = rng.uniform(3, 10), rng.uniform(3, 20)
        return slide, same(lambda p: c * sign(p["v"]) + d * p["v"]), 0, "force_N"
    if family == "stribeck":
        c, d, s, w = rng.uniform(3, 6), rng.uniform(3, 15), rng.uniform(4, 8), rng.uniform(.04, .1)
        return slide, same(lambda p: sign(p["v"]) * (c + s * math.exp(-(p["v"] / w) ** 2)) + d * p["v"]), 0, "force_N"
    if family == "force_drag":
        d = rng.uniform(20, 60)
        return slide, same(lambda p: d * p["v"] * abs(p["v"])), 0, "force_N"
    if family == "differing_drag":
        k = [sd * rng.uniform(.5, 3) for _ in range(3)]
        k.append(sum(k) / 3)
        return rover, [lambda p, c=c: -c * p[own] * abs(p[own]) * (1.2 if turn else 2.5) for c in k], 0, channel
    if family == "law_product":
        return rover, same(lambda p: sd * p["e"] * p["f"] * p["f"] * 2.5), 0, channel
    if family == "law_wave":
        k = rng.uniform(3, 6)
        return rover, same(lambda p: 1.2 * sd * math.sin(k * p["e"])), 0, channel
    if family == "law_decay":
        k = rng.uniform(1.5, 4)
        return rover, same(lambda p: 2 * sd * math.exp(-k * abs(p["e"])) * (1 if p["e"] > 0 else 1)), 0, channel
    if family == "law_root":
        return rover, same(lambda p: 2 * sd * sign(p[own]) * math.sqrt(abs(p[own]))), 0, channel
    if family == "noisy_start":
        return Noisy(rng), same(lambda p: 0.0), 0, "v_mps"
    return rover, same(lambda p: 0.0), 0, channel


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--family", default="each")
    parser.add_argument("--out")
    parser.add_argument("--truth")
    o = parser.parse_args()
    every = list(FAMILIES) + NULLS
    family = every[o.seed % len(every)] if o.family == "each" else o.family
    if family not in every:
        parser.error("no family '%s': %s" % (family, " ".join(every)))
    rng = random.Random("%s %d" % (family, o.seed))
    world, effects, late, channel = draw(rng, family)
    noise = family if family in NULLS else "white"
    many = family == "differing_drag"
    logs = [world.log(rng, effects[k if k < 3 and many else -1], noise, late, channel) for k in range(4 if many else 3)]
    os.makedirs(o.out, exist_ok=True)
    hidden = family in FAMILIES
    truth = {"schema": "rim-hidden-truth/1", "seed": o.seed, "family": family, "attempts": 1, "noise": noise,
             "world": type(world).__name__.lower(), "noise_parameter": 0, "effects": [], "logs": [], "holdout": {},
             "channels": [{"name": c, "sd": s} for c, s in world.sd.items()]}
    if hidden:
        truth["effects"].append({"family": family, "cause": FAMILIES[family], "kind": "mean", "channel": channel,
                                 "gate": None})
    for k, (names, rows, m, t, z) in enumerate(logs):
        held = k == len(logs) - 1
        name = "holdout_1.csv" if held else "run_%d.csv" % (k + 1)
        with open(os.path.join(o.out, name), "w", encoding="utf-8") as out:
            out.write(",".join(["t_s"] + names + [p + c for c in world.sd for p in ("z.", "m.", "sd.")]) + "\n")
            for i, row in enumerate(rows):
                cells = [i * DT] + row
                for c, s in world.sd.items():
                    cells += [z[i][c], m[i][c], s]
                out.write(",".join("%.9g" % x for x in cells) + "\n")
        difference = [(t[i][channel] - m[i][channel]) / world.sd[channel] for i in range(ROWS)]
        truth["logs"].append({"file": name, "holdout": held, "rows": ROWS,
                              "effect_sd": {channel: [round(d, 4) for d in difference]} if hidden else {},
                              "acts": [int(abs(d) > .1) for d in difference]})
        if held:
            for c, s in world.sd.items():
                square = lambda a: sum((z[i][c] - a[i][c]) ** 2 for i in range(ROWS)) / ROWS
                nll = lambda a: .5 * (square(a) / s / s + math.log(2 * math.pi * s * s))
                truth["holdout"][c] = {"rmse_before": math.sqrt(square(m)), "rmse_true": math.sqrt(square(t)),
                                       "nll_before": nll(m), "nll_true": nll(t)}
    with open(o.truth, "w", encoding="utf-8") as out:
        json.dump(truth, out)


if __name__ == "__main__":
    main()
