# SPDX-License-Identifier: MIT
"""rimwatch: finds where a vehicle's model of itself is wrong.

The same objects as the program `rim` and as the onboard library: a replay here gives the digest and
the alarms of `rim replay`, a diagnosis the findings of `rim diagnose`.

A log is a path (CSV, ULog, MCAP, ... with a `schema` where its columns have other names) or a
DataFrame whose columns begin with their role (`u.` command, `s.` sensor, `x.` context, `z. m. sd.`
measured and predicted) and whose index, or column `t_s`, is the time in seconds.

    >>> import rimwatch
    >>> image = rimwatch.train(rimwatch.example_logs(20))
    >>> rimwatch.replay(rimwatch.example_logs(1, first=21, bias=0.3), image).raised
    1
"""

import os as _os
import sys as _sys

_here = _os.path.dirname(_os.path.abspath(__file__))
# The readers run as a program of their own, by this interpreter, as `rim` runs them.
_os.environ.setdefault("RIM_PYTHON", _sys.executable)
_os.environ.setdefault("RIM_READERS", _here)
if _os.path.isdir(_os.path.join(_here, "data")):
    _os.environ.setdefault("RIM_DATA", _os.path.join(_here, "data"))

from ._core import DataError, UsageError, Verdict, __version__  # noqa: E402
from .diagnosis import Diagnosis, Extension, Finding, diagnose  # noqa: E402
from .example import example_diagnosis, example_logs  # noqa: E402
from .logs import read, read_raw  # noqa: E402
from .monitor import Image, Monitor, Replay, Run, replay, train  # noqa: E402

__all__ = [
    "DataError", "Diagnosis", "Extension", "Finding", "Image", "Monitor", "Replay", "RimDetector",
    "Run", "UsageError", "Verdict", "__version__", "diagnose", "example_diagnosis", "example_logs", "read",
    "read_raw", "replay", "train",
]


def __getattr__(name):
    if name == "RimDetector":  # scikit-learn is asked for only by who uses it
        from .detector import RimDetector

        return RimDetector
    raise AttributeError(f"module 'rimwatch' has no attribute '{name}'")
