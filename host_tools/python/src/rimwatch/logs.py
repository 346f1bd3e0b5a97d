# SPDX-License-Identifier: MIT
"""Logs in and out of tables."""

from __future__ import annotations

import os
from typing import Iterable, List, Optional, Sequence, Union

import numpy as np
import pandas as pd

from . import _core

LogLike = Union[str, "os.PathLike[str]", pd.DataFrame]


def read(path: Union[str, "os.PathLike[str]"], schema: Optional[str] = None,
         skip_bad_time: bool = False) -> pd.DataFrame:
    """The rows of a log that a monitor can use, by role.

    path: CSV (also packed by gzip or Zstandard), an LCM event log, or any format of `readers/`.
    schema: TOML that says what foreign columns are (`rim schema` proposes one). skip_bad_time:
    leave out rows whose time repeats or runs back, instead of raising. Returns float64 columns
    named by role, indexed by `t_s` in seconds; `.attrs` has "path", "units", "row" (data row in the
    file of each row) and "rows_in_file". Raises DataError with file, row, column and reason.

    >>> import tempfile, rimwatch
    >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
    ...     _ = file.write("t_s,u.cmd_mps,s.speed_mps\\n0,1,0.9\\n0.1,1,1.0\\n")
    ...     _ = file.flush()
    ...     frame = rimwatch.read(file.name)
    >>> list(frame.columns), frame.index.name, frame.attrs["units"]["s.speed_mps"]
    (['u.cmd_mps', 's.speed_mps'], 't_s', 'm/s')
    """
    return frame_of(_core.read_log(os.fspath(path), schema or "", skip_bad_time))


def read_raw(path: Union[str, "os.PathLike[str]"], dbc: str = "", packets: str = "",
             types: Sequence[str] = (), rows: str = "") -> pd.DataFrame:
    """The table that a file of another format holds, under its own names: to look at before a
    schema is written. dbc, packets, types, rows: as in a schema's [reader]. Raises
    rimwatch.readers.ReadError.

    >>> import json, tempfile, rimwatch
    >>> with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as file:
    ...     _ = file.write(json.dumps({"t": 0.0, "imu": {"gx": 0.5}}) + "\\n")
    ...     _ = file.flush()
    ...     list(rimwatch.read_raw(file.name).columns)
    ['t', 'imu.gx']
    """
    from . import readers

    options = readers.Options(dbc, packets, tuple(types), rows)
    return pd.DataFrame(readers.read(os.fspath(path), options).columns)


def frame_of(log: "_core.Log") -> pd.DataFrame:
    """A table of a log, with what it needs to become the same log again."""
    names = log.names
    frame = pd.DataFrame(log.values, columns=names, index=pd.Index(log.t_s, name="t_s"))
    frame.attrs.update(path=log.path, units=dict(zip(names, log.units)),
                       row=log.row.astype("uint32").tolist(), rows_in_file=log.rows_in_file)
    return frame


def log_of(given: LogLike, schema: Optional[str] = None, name: str = "log") -> "_core.Log":
    """The log of a path or of a table; columns without a role are left out."""
    if not isinstance(given, pd.DataFrame):
        return _core.read_log(os.fspath(given), schema or "", False)
    frame = given
    if "t_s" in frame.columns:
        frame = frame.set_index("t_s")
    if frame.columns.duplicated().any():
        twice = frame.columns[frame.columns.duplicated()][0]
        raise _core.DataError(f"{name}: column '{twice}': stands twice")
    roles = ("x.", "u.", "s.", "z.", "m.", "sd.")
    columns = [c for c in frame.columns if isinstance(c, str) and c.startswith(roles)]
    if not columns:
        raise _core.DataError(f"{name}: no column has a role (x. u. s. z. m. sd.)")
    units = frame.attrs.get("units", {})
    values = np.ascontiguousarray(frame[columns].to_numpy(dtype="float64"))
    times = np.ascontiguousarray(frame.index.to_numpy(dtype="float64"))
    path = str(frame.attrs.get("path", name))
    log = _core.make_log(path, columns, [str(units.get(c, "")) for c in columns], times, values)
    row = frame.attrs.get("row")
    if row is not None and len(row) == len(log.t_s) == len(frame):
        log = log.with_rows(row, frame.attrs["rows_in_file"])
    return log


def logs_of(given: Union[LogLike, Iterable[LogLike]], schema: Optional[str] = None,
            what: str = "log") -> List["_core.Log"]:
    """The logs of one or of several paths or tables."""
    if isinstance(given, (str, os.PathLike, pd.DataFrame)):
        given = [given]
    return [log_of(one, schema, f"{what} {i + 1}") for i, one in enumerate(given)]
