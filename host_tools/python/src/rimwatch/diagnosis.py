# SPDX-License-Identifier: MIT
"""What a simulation gets wrong: where, why, the extended model and what it gains."""

from __future__ import annotations

import html
import json
import os
import tempfile
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Union

import numpy as np
import pandas as pd

from . import _core
from .logs import LogLike, frame_of, log_of, logs_of

#: Takes the rows of a log, gives predictions by the name of what they predict: {"speed_mps": ...}.
Simulate = Callable[[pd.DataFrame], Mapping[str, Any]]


@dataclass(frozen=True)
class Finding:
    """A deviation that was claimed; `facts` has every field of diagnosis.json.

    >>> import rimwatch
    >>> finding = rimwatch.example_diagnosis().findings[0]
    >>> finding.channel, finding.p_value < 0.01, str(finding) == finding.sentence
    ('current_A', True, True)
    """

    channel: str
    cause: str
    sentence: str
    expression: str
    parameters: Dict[str, Dict[str, Any]]
    region: Dict[str, Any]
    p_value: float
    separable: bool
    facts: Dict[str, Any]

    def __str__(self) -> str:
        return self.sentence


class Extension:
    """The terms that a diagnosis found: call it with a log, it gives the log with the predictions
    (m. and sd. columns) of the extended model.

    >>> import rimwatch
    >>> extension, log = rimwatch.example_diagnosis().extension, rimwatch.example_logs(1)[0]
    >>> corrected = extension(log.rename(columns={"s.current_A": "z.current_A"}).assign(
    ...     **{"m.current_A": 0.4 + 0.64 * log["s.speed_mps"]}))
    >>> bool((corrected["z.current_A"] - corrected["m.current_A"]).std() < 0.05)
    True
    """

    def __init__(self, toml: str) -> None:
        self.toml = toml

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"]) -> "Extension":
        """Of an extension.toml, as `rim diagnose` and `save` write it. It is read when it is called.

        >>> import tempfile, rimwatch
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     rimwatch.Extension("# none").save(f"{folder}/none.toml")
        ...     print(rimwatch.Extension.load(f"{folder}/none.toml"))
        # none
        """
        with open(path, encoding="utf-8") as file:
            return cls(file.read())

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """For `rim simulate`, `rim replay` and `rim diagnose --extension`.

        >>> import os, tempfile, rimwatch
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     rimwatch.Extension("# none").save(f"{folder}/none.toml")
        ...     os.listdir(folder)
        ['none.toml']
        """
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.toml)

    def __call__(self, frame: LogLike) -> pd.DataFrame:
        with tempfile.NamedTemporaryFile("w", suffix=".toml", encoding="utf-8") as file:
            file.write(self.toml)
            file.flush()
            return frame_of(_core.extended(file.name, log_of(frame)))

    def __repr__(self) -> str:
        return self.toml


class Diagnosis:
    """What `rim diagnose` says, with its report for a notebook.

    >>> import rimwatch
    >>> found = rimwatch.example_diagnosis()
    >>> found.adequate, bool(found.gain.loc["current_A", "ratio"] < 0.5)
    (False, True)
    """

    def __init__(self, core: "_core.Diagnosed") -> None:
        self._core = core
        self.facts: Dict[str, Any] = json.loads(core.json())
        self.findings: List[Finding] = [
            Finding(f["channel"], f["cause"], f["sentence"], f["expression"], f["parameters"],
                    f["region"], f["p_value"], f["separable"], f)
            for f in self.facts["findings"]]
        self.adequate: bool = core.adequate  #: nothing was found
        self.extension = Extension(core.extension_toml())

    @property
    def gain(self) -> pd.DataFrame:
        """By channel: rmse_before, rmse_after, ratio and its 95 % interval."""
        return pd.DataFrame(self.facts["gain"]["channels"]).T

    def save(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        """diagnosis.json, labels.csv, extension.toml and report.html, all or none.

        >>> import os, tempfile, rimwatch
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     rimwatch.example_diagnosis().save(f"{folder}/diagnosis")
        ...     sorted(os.listdir(f"{folder}/diagnosis"))
        ['diagnosis.json', 'extension.toml', 'labels.csv', 'report.html']
        """
        self._core.write(os.fspath(folder))

    def __str__(self) -> str:
        lines = [self._core.sentence] + [f"{i}. {f}" for i, f in enumerate(self.findings, 1)]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<Diagnosis: {len(self.findings)} findings>"

    def _repr_html_(self) -> str:
        page = html.escape(self._core.html(), quote=True)
        return f'<iframe srcdoc="{page}" style="width:100%;height:800px;border:0"></iframe>'


class _Simulated:
    """Calls the user's simulation, and makes a log of what it predicts."""

    def __init__(self, simulate: Simulate) -> None:
        self._simulate = simulate

    def __call__(self, log: "_core.Log", outcome: Optional[np.ndarray]) -> Optional["_core.Log"]:
        frame = frame_of(log)
        if outcome is not None:  # rolled out: what was predicted replaces what was measured
            known = [c for c in frame.columns if c.startswith("z.")]
            for i, name in enumerate(known):
                for role in ("z.", "x.", "s."):
                    if role + name[2:] in frame.columns and role != "z.":
                        frame[role + name[2:]] = outcome[:, i]
        attrs = dict(frame.attrs)
        made = dict(self._simulate(frame.copy()))
        for name, values in made.items():
            bare = name.split(".", 1)[1] if name.startswith(("m.", "sd.")) else name
            role = "sd." if name.startswith("sd.") else "m."
            if role == "m." and f"z.{bare}" not in frame.columns:
                if f"s.{bare}" not in frame.columns:
                    raise _core.DataError(f"simulate: predicts '{bare}', which the log has neither "
                                          "as z. nor as s.")
                frame[f"z.{bare}"] = frame[f"s.{bare}"]
                del frame[f"s.{bare}"]
            frame[role + bare] = np.asarray(values, dtype="float64")
        keep = frame.notna().all(axis=1).to_numpy()
        if outcome is not None and not keep.all():
            return None
        attrs["row"] = [r for r, k in zip(attrs["row"], keep) if k]
        frame = frame[keep]
        frame.attrs.update(attrs)
        return log_of(frame)


def diagnose(logs: Union[LogLike, Iterable[LogLike]],
             holdout: Union[LogLike, Iterable[LogLike]] = (), simulate: Optional[Simulate] = None,
             schema: Optional[str] = None, horizon_s: float = 0.0, false_alarm: float = 0.05,
             seed: int = 1, causes: Optional[str] = None) -> Diagnosis:
    """Finds where and why measured logs contradict a simulation, extends it, measures the gain.

    simulate: your simulation, one step: it takes the rows of a log and returns, for each row, the
    mean that it predicts of some outcomes by their bare names, and their standard deviations as
    "sd.NAME" where it knows them; NaN where it cannot tell. With horizon_s it is called again with
    its own predictions in place of the measured state. None: the logs bring m. columns. holdout:
    logs for the gain alone; without them it is cross-validated. Raises DataError.

    >>> import rimwatch
    >>> logs = rimwatch.example_logs(3)
    >>> def cart(rows):  # knows the current but for a fifth of the gain
    ...     return {"current_A": 0.4 + 0.64 * rows["s.speed_mps"]}
    >>> found = rimwatch.diagnose(logs, simulate=cart)
    >>> found.findings[0].channel, found.adequate
    ('current_A', False)
    >>> corrected = found.extension(logs[0].assign(**{
    ...     "z.current_A": logs[0]["s.current_A"], "m.current_A": cart(logs[0])["current_A"]}))
    >>> bool((corrected["z.current_A"] - corrected["m.current_A"]).std() < 0.05)
    True
    """
    given = logs_of(logs, schema)
    held = logs_of(holdout, schema, "hold-out")
    times = given[0].t_s
    step_s = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    options = _core.DiagnoseGiven(false_alarm, horizon_s, seed, causes or "",
                                  "rimwatch.diagnose(...)")
    call = None if simulate is None else _Simulated(simulate)
    return Diagnosis(_core.diagnose(given, held, call, step_s, options))
