# SPDX-License-Identifier: MIT
"""Which format a file has, and who reads it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Callable, Tuple

from . import arrays, buses, flight, messages
from .table import MissingPackage, Options, ReadError, Table


@dataclass(frozen=True)
class Format:
    """A format: how it is told, and the function that reads it."""

    name: str
    suffixes: Tuple[str, ...]
    begins: Tuple[bytes, ...]  # first bytes of such a file; none: by the suffix alone
    read: Callable[[str, Options], Table]


FORMATS = (
    Format("ULog (PX4)", (".ulg",), (b"ULog\x01\x12\x35",), flight.ulog),
    Format("ArduPilot dataflash log", (".bin",), (b"\xa3\x95",), flight.ardupilot),
    Format("MCAP", (".mcap",), (b"\x89MCAP0\r\n",), messages.mcap),
    Format("rosbag2", (".db3",), (b"SQLite format 3\0",), messages.rosbag),
    Format("ROS 1 bag", (".bag",), (b"#ROSBAG V2.0",), messages.rosbag),
    Format("MATLAB v7.3", (".mat",), (b"MATLAB 7.3 MAT-file",), arrays.mat73),
    Format("MATLAB v5", (".mat",), (b"MATLAB 5.0 MAT-file",), arrays.mat5),
    Format("HDF5", (".h5", ".hdf5", ".hdf"), (b"\x89HDF\r\n\x1a\n",), arrays.hdf5),
    Format("Parquet", (".parquet", ".pq"), (b"PAR1",), arrays.parquet),
    Format("MDF4", (".mf4", ".mdf"), (b"MDF     ", b"UnFinMF "), buses.mdf4),
    Format("LCM event log", (), (b"\xed\xa1\xda\x01",), buses.lcm_log),
    Format("candump log", (), (), buses.candump),
    Format("CCSDS packets", (".ccsds", ".tlm"), (), buses.ccsds),
    Format("JSON lines", (".jsonl", ".ndjson"), (), messages.json_lines),
)


def format_of(path: str, options: Options = Options()) -> Format:
    """The format of a file, by its first bytes and its suffix. ReadError: none is known."""
    by_name = {f.name: f for f in FORMATS}
    if os.path.isdir(path):
        return by_name["rosbag2"]
    if options.packets:
        return by_name["CCSDS packets"]
    with open(path, "rb") as file:
        head = file.read(64)
    for f in FORMATS:
        if any(head.startswith(begin) for begin in f.begins):
            return f
    if options.dbc and head.startswith(b"("):
        return by_name["candump log"]
    suffix = os.path.splitext(path)[1].lower()
    for f in FORMATS:
        if suffix in f.suffixes and not f.begins:
            return f
    known = ", ".join(f.name for f in FORMATS)
    raise ReadError(f"is of no format that is known here: CSV, {known}")


def read(path: str, options: Options = Options()) -> Table:
    """The whole file as one table. ReadError says what keeps it from being read."""
    try:
        table = format_of(path, options).read(path, options)
    except ReadError:
        raise
    except OSError as reason:
        raise ReadError(f"cannot be read: {reason}") from reason
    except ModuleNotFoundError as reason:  # of what all readers need
        raise MissingPackage(
            f"its reader is not installed ({reason}). This installs it: "
            f"python3 -m pip install {reason.name}"
        ) from reason
    except Exception as reason:  # whatever a reader makes of a damaged file
        name = format_of(path, options).name
        raise ReadError(f"is damaged, or no {name}: {type(reason).__name__}: {reason}") from reason
    if table.rows() == 0:
        raise ReadError("holds no rows")
    return table
