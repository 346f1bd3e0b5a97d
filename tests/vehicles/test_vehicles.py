#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The generators and the grader themselves: run by hand or by `python3 -m unittest`; seeds are fixed here."""
import functools
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)

import blind
import fleet
import foundry
import grade
import harbour
import kin
import orchard
import quay
import town
import verdict
import vehicles as V
import wrong_input
import yard

SEED = 4711
LONG = bool(os.environ.get("RIM_LONG"))

# All of the module that is graded from, the first of each other; all of all with RIM_LONG.
KINDS = [(M, v) for M in (V, blind, fleet, foundry, harbour, kin, orchard, quay, town, yard)
         for v in M.VEHICLES[:None if LONG or M is V else 1]]


def some(M, vehicle):
    """Every eighth of a vehicle's faults, beginning with another one for each; all with RIM_LONG."""
    step = 1 if LONG else 8
    return M.FAULTS[vehicle][KINDS.index((M, vehicle)) % step::step]


@functools.lru_cache(None)
def drawn(M, vehicle, fault=None):
    return M.run(vehicle, SEED, fault)


class Generators(unittest.TestCase):
    def test_same_seed_same_run(self):
        for M, v in KINDS:
            self.assertEqual(M.run(v, SEED), drawn(M, v))
            if v == M.VEHICLES[0] or LONG:
                self.assertNotEqual(drawn(M, v)[1], M.run(v, SEED + 1)[1])

    def test_runs_are_whole_and_finite(self):
        for M, v in KINDS:
            columns, rows, truth = drawn(M, v)
            self.assertIsNone(truth)
            self.assertEqual(len(rows), M.LENGTH[v])
            self.assertTrue(all(len(r) == len(columns) and all(map(math.isfinite, r)) for r in rows))
            self.assertTrue(5 <= sum(c.startswith("s.") for c in columns) <= 15)

    def test_a_fault_leaves_the_rows_before_it_as_they_were(self):
        for M, v in KINDS:
            healthy = drawn(M, v)[1]
            for fault in some(M, v):
                _, rows, truth = drawn(M, v, fault)
                self.assertIn(1, truth["rows"], (v, fault))
                first = truth["rows"].index(1)
                self.assertEqual(rows[:first], healthy[:first], (v, fault))
                self.assertNotEqual(rows, healthy, (v, fault))

    def test_truth_speaks_of_columns_that_exist(self):
        for M, v in KINDS:
            for fault in some(M, v):
                columns, rows, t = drawn(M, v, fault)
                self.assertTrue(set(t["columns"]) | set(t["features"]) <= set(columns), (v, fault))
                self.assertTrue(set(t["columns"].values()) <= {-1, 0, 1})
                if t["onset"]:
                    first = t["rows"].index(1) * M.RATE[v]
                    self.assertGreaterEqual(first, t["onset"] - 1e-9, (v, fault))

    def test_bias_has_the_size_that_is_told(self):
        healthy = V.run("tank", SEED)[1]
        columns, rows, t = V.run("tank", SEED, "bias:inflow")
        i = columns.index("s.inflow_Lps")
        self.assertAlmostEqual(rows[-1][i] - healthy[-1][i], t["size"], places=9)
        self.assertEqual(math.copysign(1, t["size"]), t["columns"]["s.inflow_Lps"])


class Grader(unittest.TestCase):
    VEHICLES = ["tank", "arm"] if LONG else ["tank"]
    COMMAND = [sys.executable, os.path.join(HERE, "grade.py"), "--vehicles", ",".join(VEHICLES), "--train", "1",
               "--healthy", "2", "--per", "1"]
    FAULTS = sum(len(V.FAULTS[v]) for v in VEHICLES)

    @classmethod
    def setUpClass(cls):
        cls.logs = tempfile.TemporaryDirectory()
        subprocess.run(cls.COMMAND + ["--csv", cls.logs.name], check=True, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.logs.cleanup()

    def grade(self, oracle, *more):
        """Exit status and figures of grade.py with a rim that is the oracle."""
        out = os.path.join(self.logs.name, "g.json")
        command = self.COMMAND + ["--rim", os.path.join(HERE, "oracle.py"), "--from", self.logs.name, "--json", out]
        k = subprocess.run(command + list(more), capture_output=True, text=True,
                           env=dict(os.environ, ORACLE=oracle))
        self.assertTrue(os.path.exists(out), k.stderr)
        with open(out) as f:
            figures = json.load(f)["figures"]["all"]
        os.remove(out)
        return k.returncode, figures, k.stdout

    def test_all_that_is_right_counts(self):
        all_of_it = "found=1,named=1,sign=1,size=1,covered=1,onset=1,region=1,f1=1,false=0,wrong=0"
        code, f, _ = self.grade("right", "--require", all_of_it)
        self.assertEqual(code, 0)
        self.assertEqual((f["found"]["n"], f["found"]["share"], f["f1_median"]), (self.FAULTS, 1.0, 1.0))

    def test_all_that_is_wrong_counts(self):
        code, f, text = self.grade("wrong", "--require", "sign=.9")
        self.assertEqual(code, 1)
        self.assertIn("FAILED: sign", text)
        asked = ("false", "found", "sign", "size", "covered", "region")
        self.assertEqual([f[k]["share"] for k in asked], [1, 1, 0, 0, 0, 0])
        self.assertEqual((f["onset"]["k"], f["f1_median"]), (0, 0))
        self.assertGreater(f["wrong"]["share"], .5)

    def test_nothing_found_is_no_share_of_what_was_not_asked(self):
        code, f, _ = self.grade("silent", "--require", "named=.5")
        self.assertEqual(code, 1)
        self.assertEqual(f["found"]["share"], 0)
        self.assertNotIn("named", f)

    def test_logs_that_are_not_there_are_named_once(self):
        with tempfile.TemporaryDirectory() as empty:
            k = subprocess.run(self.COMMAND + ["--from", empty], capture_output=True, text=True)
            self.assertEqual((k.returncode, k.stdout, os.listdir(empty)), (1, "", []))
            n = self.FAULTS + 3 * len(self.VEHICLES)
            self.assertEqual(k.stderr, "grade.py: %d of %d logs are not in %s, the first of them tank/train_000.csv\n"
                             % (n, n, empty))


class Pieces(unittest.TestCase):
    def test_what_begins_early_is_not_cut_away(self):
        for k in range(20):
            rows = [[.1 * i, 0] for i in range(1000)]
            truth = {"onset": 2., "rows": [0] * 20 + [1] * 980}
            case = grade.Case("tank", "faulty", 0, "leak", "tank/leak_%02d" % k)
            kept, said = grade.cut(case, rows, truth)
            self.assertEqual(len(kept), 1000)
            self.assertEqual((said["onset"], len(said["rows"])), (2., 1000))

    def test_wilson_against_a_table(self):
        low, high = verdict.wilson(8, 10)
        self.assertAlmostEqual(low, .4902, places=3)
        self.assertAlmostEqual(high, .9433, places=3)
        self.assertEqual(verdict.wilson(0, 0), (0.0, 1.0))

    def test_f1(self):
        self.assertEqual(verdict.f1([1, 1, 0, 0], [1, 0, 1, 0]), .5)
        self.assertEqual(verdict.f1([0, 0], [0, 0]), 1.0)

    def test_healthy_is_a_verdict_not_a_word(self):
        self.assertTrue(wrong_input.HEALTHY.search("LOG: healthy: nothing found in 60 rows"))
        self.assertFalse(wrong_input.HEALTHY.search("at most 1 healthy run in 25 shows as much"))

    def test_the_rate_of_rows_is_not_a_sensor_called_rate(self):
        self.assertTrue(wrong_input.RATE.search("rows come at 1 Hz, the image wants 10 Hz"))
        self.assertTrue(wrong_input.TIME.search("column 't_s': steps of 100 s"))
        self.assertFalse(wrong_input.TIME.search("rate z scatters 2.1 times as much as predicted at t = 9 s"))

    def test_a_column_is_told_from_another(self):
        self.assertTrue(wrong_input.says("speed 3.6 is beyond the 0 to 1.1 it was trained on", "s.speed_mps"))
        self.assertTrue(wrong_input.says("wheel y 900 rad/s is out of range", "s.wheel_y_radps"))
        self.assertFalse(wrong_input.says("gyro scatters .05 times", "s.speed_mps"))


if __name__ == "__main__":
    print("seed %d" % SEED)
    unittest.main()
