# SPDX-License-Identifier: MIT
"""A small vehicle for examples and tests."""

from __future__ import annotations

import functools
from typing import List

import numpy as np
import pandas as pd

from .diagnosis import Diagnosis, diagnose


def example_logs(runs: int, first: int = 1, bias: float = 0.0,
                 rows: int = 600) -> List[pd.DataFrame]:
    """Runs of a cart at 10 Hz: command, speed and motor current. Each has a seed of its own, its
    number from `first`. bias: added to the current's reading, in A, from the middle of the run on.
    The same numbers on every machine.

    >>> import rimwatch
    >>> rimwatch.example_logs(1)[0].shape
    (600, 3)
    """
    return [_cart(np.random.default_rng(first + i), bias, rows) for i in range(runs)]


@functools.lru_cache(maxsize=1)
def example_diagnosis() -> Diagnosis:
    """What is wrong with a simulation of the cart's current that knows a fifth too little of the
    gain: seconds for the first call.

    >>> import rimwatch
    >>> [finding.channel for finding in rimwatch.example_diagnosis().findings][:1]
    ['current_A']
    """
    return diagnose(example_logs(3),
                    simulate=lambda rows: {"current_A": 0.4 + 0.64 * rows["s.speed_mps"]})


def _cart(draw: np.random.Generator, bias: float, rows: int) -> pd.DataFrame:
    t_s = np.arange(rows) * 0.1
    levels = draw.uniform(0.0, 2.0, rows // 30 + 1)
    command = np.repeat(levels, 30)[:rows]
    speed = np.zeros(rows)
    for k in range(1, rows):
        speed[k] = speed[k - 1] + 0.2 * (command[k - 1] - speed[k - 1])
    current = 0.4 + 0.8 * speed + np.where(t_s > t_s[rows // 2], bias, 0.0)
    values = {"u.cmd_mps": command, "s.speed_mps": speed + draw.normal(0.0, 0.02, rows),
              "s.current_A": current + draw.normal(0.0, 0.02, rows) + draw.normal(0.0, 0.005)}
    return pd.DataFrame(values, index=pd.Index(np.round(t_s, 9), name="t_s"))
