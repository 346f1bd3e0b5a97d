# SPDX-License-Identifier: MIT
"""A table of named columns, and how topics that come at different times become one."""

from __future__ import annotations

import csv
import importlib
from dataclasses import dataclass, field
from typing import Any, Dict, IO, List, Sequence, Tuple


class ReadError(Exception):
    """The file cannot be read; the text says why."""


class MissingPackage(ReadError):
    """The package that reads a format is not installed."""


@dataclass(frozen=True)
class Options:
    """What some formats need beside the file; paths and names, empty where not given."""

    dbc: str = ""
    packets: str = ""
    types: Tuple[str, ...] = ()
    rows: str = ""


def need(module: str, package: str, what: str) -> Any:
    """The module; MissingPackage names the command that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError as reason:
        raise MissingPackage(
            f"is {what}; its reader is not installed ({reason}). This installs it: "
            f"python3 -m pip install {package}"
        ) from reason


@dataclass
class Table:
    """Columns of equal length: numbers as float64 arrays, anything else as lists of texts."""

    columns: Dict[str, Any] = field(default_factory=dict)
    notes: List[str] = field(default_factory=list)

    def rows(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def write_csv(self, to: IO[str]) -> None:
        """Numbers with all their digits, what is not a number as an empty field."""
        writer = csv.writer(to, lineterminator="\n")
        writer.writerow([name.replace('"', "'").replace("\n", " ") for name in self.columns])
        texts = [_texts(column) for column in self.columns.values()]
        writer.writerows(zip(*texts))


def _texts(column: Any) -> List[str]:
    if isinstance(column, list):
        return [str(value).replace('"', "'").replace("\n", " ") for value in column]
    return ["" if value != value else repr(value) for value in column.tolist()]


def as_column(values: Any) -> Any:
    """Numbers, truth values and times (as seconds) as float64; anything else as texts."""
    import numpy as np

    array = np.asarray(values)
    if array.dtype.kind == "M":
        ns = array.astype("datetime64[ns]").astype("int64")
        return np.where(np.isnat(array), np.nan, ns / 1e9)
    if array.dtype.kind == "m":
        return array.astype("timedelta64[ns]").astype("int64") / 1e9
    if array.dtype.kind in "biuf":
        return array.astype("float64")
    if array.dtype.kind == "S":
        return [value.decode("utf-8", "replace") for value in array.tolist()]
    return ["" if value is None else str(value) for value in array.tolist()]


def flatten(name: str, values: Any) -> Dict[str, Any]:
    """A column of each field of a structure and of each place of an array of rows x places."""
    import numpy as np

    array = np.asarray(values)
    if array.dtype.names:
        out: Dict[str, Any] = {}
        for key in array.dtype.names:
            out.update(flatten(f"{name}.{key}", array[key]))
        return out
    if array.ndim <= 1:
        return {name: as_column(np.atleast_1d(array))}
    flat = array.reshape(array.shape[0], -1)
    if flat.shape[1] == 1:
        return {name: as_column(flat[:, 0])}
    return {f"{name}[{i}]": as_column(flat[:, i]) for i in range(flat.shape[1])}


class Topics:
    """Messages by topic: values that come together, each with its own time, in units of unit_s
    seconds: whole numbers of nanoseconds since 1970 keep digits that seconds would lose."""

    def __init__(self, unit_s: float = 1.0) -> None:
        self._unit_s = unit_s
        self._times: Dict[str, List[float]] = {}
        self._values: Dict[str, Dict[str, List[Any]]] = {}

    def add(self, topic: str, time: float, values: Dict[str, Any]) -> None:
        """One message. A field that an earlier message had not is empty there."""
        times = self._times.setdefault(topic, [])
        columns = self._values.setdefault(topic, {})
        for key, value in values.items():
            column = columns.setdefault(key, [])
            column.extend([None] * (len(times) - len(column)))
            column.append(value)
        times.append(time)

    def add_arrays(self, topic: str, times: Sequence[float], values: Dict[str, Any]) -> None:
        self._times[topic] = times  # type: ignore[assignment]
        self._values[topic] = values

    def table(self, rows: str = "", start: float | None = None) -> Table:
        """One table: a row for each message of topic `rows` (default: the topic with most), with
        the newest value of every other topic beside it, as an onboard program would hold it. t_s
        counts from the first message of all, or from start. A place before a topic's first
        message is empty. O(n log n)."""
        import numpy as np

        if not self._times:
            raise ReadError("holds no message that can be read")
        base = rows or max(self._times, key=lambda name: len(self._times[name]))
        if base not in self._times:
            raise ReadError(f"has no topic '{base}'; it has " + ", ".join(sorted(self._times)))
        zero = start if start is not None else min(t[0] for t in self._times.values())
        at = np.asarray(self._times[base])
        keep = np.concatenate(([True], np.diff(np.maximum.accumulate(at)) > 0))
        table = Table({"t_s": np.round((at[keep] - zero) * self._unit_s, 9)})
        if not keep.all():
            table.notes.append(
                f"{int((~keep).sum())} messages of {base} at a time that repeats or runs back are "
                "left out"
            )
        for topic in sorted(self._times):
            times = np.asarray(self._times[topic])
            order = np.argsort(times, kind="stable")
            place = np.searchsorted(times[order], at[keep], side="right") - 1
            for key, values in self._values[topic].items():
                column = _numbers(values, len(times))
                table.columns[f"{topic}.{key}"] = _held(column, order, place)
        return table


def _numbers(values: Any, rows: int) -> Any:
    import numpy as np

    if isinstance(values, list):
        values = values + [None] * (rows - len(values))
        if all(value is None or isinstance(value, (bool, int, float)) for value in values):
            return np.array([np.nan if v is None else float(v) for v in values])
        return ["" if value is None else str(value) for value in values]
    return as_column(values)


def _held(column: Any, order: Any, place: Any) -> Any:
    import numpy as np

    if isinstance(column, list):
        return [column[order[p]] if p >= 0 else "" for p in place]
    return np.where(place >= 0, column[order][np.maximum(place, 0)], np.nan)
