# SPDX-License-Identifier: MIT
"""Flight images, the onboard monitor, and replays."""

from __future__ import annotations

import html
import json
import os
from dataclasses import dataclass
from typing import Any, Dict, Iterable, List, Optional, Union

import pandas as pd

from . import _core
from .logs import LogLike, log_of, logs_of

LEVELS = ("OK", "WARN", "ERROR", "STALE", "OUT_OF_RANGE")


class Image:
    """A flight image: models, noise, ranges, thresholds and configuration in one blob.

    >>> import rimwatch
    >>> image = rimwatch.train(rimwatch.example_logs(20))
    >>> image.features
    ['u.cmd_mps', 's.speed_mps', 's.current_A']
    >>> image.outcomes, round(image.period_s, 3), image.promise <= 1 / 21 + 1e-6
    (['s.speed_mps', 's.current_A'], 0.1, True)
    """

    def __init__(self, data: bytes, name: str = "image", report: str = "",
                 warnings: Iterable[str] = ()) -> None:
        self.data = bytes(data)
        self.name = name
        self.report = report  #: what training said, as `rim train` prints it
        self.warnings = list(warnings)
        self.facts: Dict[str, Any] = json.loads(_core.image_json(self.data, name))

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"]) -> "Image":
        """Of a file that `rim train` or `save` wrote. DataError where it is damaged.

        >>> import tempfile, rimwatch
        >>> image = rimwatch.train(rimwatch.example_logs(4))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     image.save(f"{folder}/cart.rim")
        ...     rimwatch.Image.load(f"{folder}/cart.rim").data == image.data
        True
        """
        with open(path, "rb") as file:
            return cls(file.read(), os.fspath(path))

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the file that rimd and `rim` take; it appears whole or not at all.

        >>> import os, tempfile, rimwatch
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     rimwatch.train(rimwatch.example_logs(4)).save(f"{folder}/cart.rim")
        ...     os.listdir(folder)
        ['cart.rim']
        """
        temporary = f"{os.fspath(path)}.tmp.{os.getpid()}"
        try:
            with open(temporary, "wb") as file:
                file.write(self.data)
            os.replace(temporary, path)
        finally:
            if os.path.exists(temporary):
                os.unlink(temporary)

    @property
    def features(self) -> List[str]:
        """Names of a row's values, in the order in which Monitor.step takes them."""
        return [f["name"] for f in self.facts["features"]]

    @property
    def outcomes(self) -> List[str]:
        """Names of what is watched."""
        return [o["name"] for o in self.facts["outcomes"]]

    @property
    def promise(self) -> float:
        """Largest share of healthy runs with any alarm."""
        return float(self.facts["promised_rate"])

    @property
    def period_s(self) -> float:
        """Seconds between rows, as trained; 0: rows have no rate."""
        return float(self.facts["period_s"])

    def __str__(self) -> str:
        return _core.image_text(self.data, self.name)

    def __repr__(self) -> str:
        return f"<Image {self.name}: {len(self.features)} features, {len(self.data)} bytes>"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"


def train(logs: Union[LogLike, Iterable[LogLike]], schema: Optional[str] = None,
          false_alarm: float = 0.05, block_seconds: float = 0.0, flight: bool = False) -> Image:
    """Learns what healthy runs do, as `rim train` does: at least 3, of the same columns and rate.

    false_alarm: wished share of healthy runs with any alarm, 0 to 1; with n runs at least
    1 / (n + 1) is promised. block_seconds: rows that make one observation; 0: some 240 a run.
    flight: search less per row, for small processors. Raises DataError. Seconds to minutes.

    >>> import rimwatch
    >>> rimwatch.train(rimwatch.example_logs(4)).warnings
    []
    """
    made = _core.train(logs_of(logs, schema), false_alarm, block_seconds, flight)
    return Image(made["image"], "image", made["report"], made["warnings"])


@dataclass(frozen=True)
class Run:
    """What the monitor said of one log.

    >>> import rimwatch
    >>> image = rimwatch.train(rimwatch.example_logs(20))
    >>> run = rimwatch.Monitor(image).run(rimwatch.example_logs(1, first=21, bias=0.3)[0])
    >>> run.healthy, run.alarms[-1]["channels"][0], int(run.rows["finding"].max())
    (False, 's.current_A', 1)
    """

    path: str
    text: str  #: a sentence and the counts, as `rim replay` prints them
    doubt: str  #: what keeps silence from being health; empty: nothing
    raised: int  #: alarms
    score: float  #: largest that was held for as many blocks as an alarm needs
    alarm_score: float  #: at which an alarm is raised
    alarms: List[Dict[str, Any]]  #: records, as in the lines of `rim replay --alarms`
    rows: pd.DataFrame  #: by t_s: ln_anom, threshold, score, level (of LEVELS), finding (0: none)

    @property
    def healthy(self) -> bool:
        """Enough was examined, at the rate and within the ranges trained, and nothing found."""
        return self.raised == 0 and not self.doubt

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>"


@dataclass(frozen=True)
class Replay:
    """What the monitor said of several logs, one after another.

    >>> import rimwatch
    >>> image = rimwatch.train(rimwatch.example_logs(20))
    >>> result = rimwatch.replay(rimwatch.example_logs(2, first=21, bias=0.3), image)
    >>> result.raised, len(result.runs), len(result.digest)
    (2, 2, 16)
    """

    runs: List[Run]
    digest: str  #: of every verdict: equal to that of `rim replay`
    image: Image

    @property
    def raised(self) -> int:
        """Alarms in all runs."""
        return sum(run.raised for run in self.runs)

    def __str__(self) -> str:
        return "".join(run.text for run in self.runs) + f"digest {self.digest}\n"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"


def _run(replayer: "_core.Replayer", log: "_core.Log") -> Run:
    said = replayer.replay(log)
    rows = pd.DataFrame(
        {"ln_anom": said["ln_anom"], "threshold": said["threshold"], "score": said["row_score"],
         "level": pd.Categorical.from_codes(said["level"].astype("int8"), categories=LEVELS),
         "finding": said["finding"].astype("uint32")},
        index=pd.Index(said["t_s"], name="t_s"))
    return Run(said["path"], said["text"], said["doubt"], said["raised"], said["score"],
               said["alarm_score"], [json.loads(line) for line in said["alarms"]], rows)


class Monitor:
    """The onboard monitor: rows in, a verdict each.

    >>> import rimwatch
    >>> image = rimwatch.train(rimwatch.example_logs(20))
    >>> monitor = rimwatch.Monitor(image)
    >>> flight = rimwatch.example_logs(1, first=21, bias=0.3)[0]
    >>> for t, row in zip(flight.index, flight.to_numpy()):
    ...     verdict = monitor.step(t, row)
    >>> verdict.level, verdict.score > 1
    ('ERROR', True)
    """

    def __init__(self, image: Union[Image, bytes, str, "os.PathLike[str]"]) -> None:
        self.image = _image(image)
        self._monitor = _core.Monitor(self.image.data)
        #: step(t_s, x, z=None, m=None, sd=None) -> Verdict: one row. t_s: seconds, increasing; x:
        #: the image's features in their order (a list, or a float64 array without a copy); z, m,
        #: sd: measured, predicted mean and its standard deviation of the outcomes, where the image
        #: takes predictions. A value that is not finite makes the verdict invalid. Bounded time.
        self.step = self._monitor.step

    def alarms(self) -> List[Dict[str, Any]]:
        """Records that wait beside those that the verdicts carried (Verdict.alarm_json).

        >>> import rimwatch
        >>> rimwatch.Monitor(rimwatch.train(rimwatch.example_logs(4))).alarms()
        []
        """
        return [json.loads(line) for line in self._monitor.records()]

    def reset(self) -> None:
        """Forgets all rows: another run begins.

        >>> import rimwatch
        >>> monitor = rimwatch.Monitor(rimwatch.train(rimwatch.example_logs(4)))
        >>> start, verdict = monitor.digest, monitor.step(0.0, [0.0, 0.0, 0.4])
        >>> monitor.reset()
        >>> monitor.digest == start
        True
        """
        self._monitor.reset()

    @property
    def digest(self) -> str:
        """A hash of every verdict since the last reset."""
        return f"{self._monitor.digest:016x}"

    def run(self, frame: LogLike, schema: Optional[str] = None) -> Run:
        """A whole log at once, as `rim replay` does it; the rows given to step are not touched.

        >>> import rimwatch
        >>> monitor = rimwatch.Monitor(rimwatch.train(rimwatch.example_logs(20)))
        >>> monitor.run(rimwatch.example_logs(1, first=21)[0]).healthy
        True
        """
        return _run(_core.Replayer(self.image.data, self.image.name), log_of(frame, schema))


def _image(given: Union[Image, bytes, str, "os.PathLike[str]"]) -> Image:
    if isinstance(given, Image):
        return given
    return Image(given) if isinstance(given, bytes) else Image.load(given)


def replay(logs: Union[LogLike, Iterable[LogLike]],
           image: Union[Image, bytes, str, "os.PathLike[str]", None] = None,
           schema: Optional[str] = None, false_alarm: float = 0.05) -> Replay:
    """Runs the onboard monitor over logs, each a run of its own, as `rim replay` does.

    image: of `train`, or a path. None: the logs bring their own predictions (z. m. sd. columns);
    false_alarm is then the largest acceptable share of healthy runs with any alarm. Raises
    DataError.

    >>> import rimwatch
    >>> image = rimwatch.train(rimwatch.example_logs(20))
    >>> healthy, faulty = (rimwatch.replay(rimwatch.example_logs(1, first=21, bias=b), image)
    ...                    for b in (0.0, 0.3))
    >>> healthy.runs[0].healthy, faulty.runs[0].alarms[-1]["channels"][0]
    (True, 's.current_A')
    """
    given = logs_of(logs, schema)
    if image is None:
        made = _core.external_image(given, false_alarm)
        known = Image(made["image"], "calibration", made["report"])
    else:
        known = _image(image)
    replayer = _core.Replayer(known.data, known.name)
    runs = [_run(replayer, log) for log in given]
    return Replay(runs, f"{replayer.digest:016x}", known)


