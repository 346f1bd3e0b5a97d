# SPDX-License-Identifier: MIT
"""Four machines of public simulators, for `grade.py --module`; README.md says what each one is.

run(vehicle, seed, fault) -> (columns, rows, truth), as in kin.py. It needs the packages of
requirements.txt. What is drawn for the mission, the parameters, the weather and the sensors does
not depend on the fault.
"""
import base
from aircraft import Aircraft
from manipulator import Manipulator
from rocket import Rocket
from rover import Rover

CLASS = {"aircraft": Aircraft, "manipulator": Manipulator, "rover": Rover, "rocket": Rocket}
VEHICLES = tuple(CLASS)
FAULTS = {name: kind.FAULTS for name, kind in CLASS.items()}


def run(vehicle, seed, fault=None):
    return base.run(CLASS[vehicle], vehicle, seed, fault)
