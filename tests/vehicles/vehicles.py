# SPDX-License-Identifier: MIT
"""Ordinary vehicles that nobody tunes for, none of them a ground robot: run(vehicle, seed, fault).

The interface is a set of names (VEHICLES, FAULTS, RATE, LENGTH, COLUMNS, SIGMA) and run(), so that
grade.py can grade any such module. common.py says what is drawn, README.md what for.
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import common
from arm import Arm
from engine import Engine
from quadrotor import Quadrotor
from satellite import Satellite
from submarine import Submarine
from tank import Tank

KIND = {"quadrotor": Quadrotor, "satellite": Satellite, "submarine": Submarine, "tank": Tank,
        "engine": Engine, "arm": Arm}
VEHICLES = tuple(KIND)
FAULTS = {v: k.SENSOR_FAULTS + tuple(k.PHYSICAL) for v, k in KIND.items()}
RATE = {v: k.DT for v, k in KIND.items()}
LENGTH = {v: k.ROWS for v, k in KIND.items()}
COLUMNS = {v: list(k.COLUMNS) for v, k in KIND.items()}
SIGMA = {v: k.SIGMA for v, k in KIND.items()}


def run(vehicle, seed, fault=None, longer=1.0):
    """(columns, rows, truth) of one run; truth is None where `fault` is None. See common.make.

    longer: how many times as long as usual the run lasts.
    """
    kind = KIND[vehicle]
    if longer != 1.0:
        kind = type(kind.__name__, (kind,), {"ROWS": int(kind.ROWS * longer)})
    columns, rows, truth, _ = common.make(kind, seed, fault)
    return columns, rows, truth
