# SPDX-License-Identifier: MIT
"""Recordings of buses: MDF4 by asammdf, candump text by cantools, LCM event logs by lcm, CCSDS
packets by ccsdspy."""

from __future__ import annotations

import importlib
import os
import pkgutil
import re
import struct
import subprocess
import sys
import tempfile
from typing import Any, Dict, Tuple

from .messages import fields_of
from .table import Options, ReadError, Table, Topics, as_column, flatten, need


def mdf4(path: str, options: Options) -> Table:
    """The channels of every group, held to the times of the group with most samples; a name that
    several groups have is GROUP.NAME."""
    module = need("asammdf", "asammdf", "an MDF4 file")
    topics = Topics()
    with module.MDF(path) as file:
        for index in file.virtual_groups:
            signals = file.select(
                [(None, g, c) for g, cs in file.included_channels(index)[index].items() for c in cs]
            )
            fields: Dict[str, Any] = {}
            for signal in signals:
                fields.update(flatten(signal.name, signal.samples))
            if signals and len(signals[0].timestamps) > 0:
                topics.add_arrays(f"group{index}", signals[0].timestamps, fields)
    table = topics.table(options.rows, start=0.0)
    return _without_groups(table)


def _without_groups(table: Table) -> Table:
    short = [name.split(".", 1)[-1] for name in table.columns]
    names = [s if short.count(s) == 1 else n for s, n in zip(short, table.columns)]
    return Table(dict(zip(names, table.columns.values())), table.notes)


_FRAME = re.compile(r"\((\d+\.\d+)\)\s+\S+\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?:#[0-9A-Fa-f])?"
                    r"((?:[0-9A-Fa-f]{2})*)")


def candump(path: str, options: Options) -> Table:
    """Columns MESSAGE.SIGNAL of the frames that the DBC describes."""
    module = need("cantools", "cantools", "a candump log")
    if not options.dbc:
        raise ReadError("holds CAN frames: a DBC says what they mean (--dbc, or [reader] dbc)")
    bus = module.database.load_file(options.dbc)
    known = {(m.frame_id, m.is_extended_frame): m for m in bus.messages}
    topics = Topics(1e-6)
    wrong = 0
    with open(path, encoding="ascii", errors="replace") as file:
        for line in file:
            frame = _FRAME.match(line)
            if frame is None:
                wrong += bool(line.strip())
                continue
            message = known.get((int(frame[2], 16), len(frame[2]) == 8))
            if message is None:
                continue
            try:
                values = message.decode(bytes.fromhex(frame[3]), decode_choices=False)
            except Exception:  # too short for its description
                wrong += 1
                continue
            topics.add(message.name, round(float(frame[1]) * 1e6), values)
    table = topics.table(options.rows)
    if wrong:
        table.notes.append(f"{wrong} lines are no frame that {options.dbc} can decode")
    return table


def _lcm_types(files: Tuple[str, ...], folder: str) -> Dict[bytes, Any]:
    """Fingerprint to class, of the types that lcm-gen makes of the .lcm files."""
    try:
        subprocess.run(["lcm-gen", "-p", "--ppath", folder, *files], check=True,
                       capture_output=True, text=True)
    except FileNotFoundError as reason:
        raise ReadError("is an LCM event log; lcm-gen, which makes readers of its types, is not "
                        "installed: apt-get install liblcm-bin") from reason
    except subprocess.CalledProcessError as reason:
        raise ReadError(f"its types: lcm-gen: {reason.stderr.strip()}") from reason
    sys.path.insert(0, folder)
    found = {}
    for module in pkgutil.walk_packages([folder]):
        if module.ispkg:
            package = importlib.import_module(module.name)
            found.update({n: t for n, t in vars(package).items() if isinstance(t, type)})
        else:
            one = importlib.import_module(module.name)
            found.update({n: t for n, t in vars(one).items() if isinstance(t, type)})
    sys.path.remove(folder)
    return {struct.pack(">Q", t._get_hash_recursive([])): t
            for t in found.values() if hasattr(t, "_get_hash_recursive")}


def lcm_log(path: str, options: Options) -> Table:
    """Columns CHANNEL.FIELD of the messages whose types are given."""
    module = need("lcm", "lcm", "an LCM event log")
    if not options.types:
        raise ReadError("is an LCM event log: the .lcm files of its types say what is in it "
                        "(--types, or [reader] types)")
    topics = Topics(1e-6)
    unknown = set()
    with tempfile.TemporaryDirectory() as folder:
        types = _lcm_types(options.types, folder)
        for event in module.EventLog(path, "r"):
            kind = types.get(event.data[:8])
            if kind is None:
                unknown.add(event.channel)
                continue
            topics.add(event.channel, event.timestamp, fields_of(kind.decode(event.data)))
    table = topics.table(options.rows)
    if unknown:
        table.notes.append("of other types than those given: " + ", ".join(sorted(unknown)))
    return table


def ccsds(path: str, options: Options) -> Table:
    """The fields of CCSDS packets of fixed length, as a file of ccsdspy describes them, and those
    of the primary header. The time is a field of the packet: a schema's [time] names it."""
    module = need("ccsdspy", "ccsdspy", "a file of CCSDS packets")
    if not options.packets:
        raise ReadError("holds CCSDS packets: a table of their fields says what is in them "
                        "(--packets, or [reader] packets)")
    try:
        packet = module.FixedLength.from_file(options.packets)
    except Exception as reason:
        raise ReadError(f"{options.packets}: {reason}") from reason
    fields = packet.load(path, include_primary_header=True)
    table = Table()
    for name, values in fields.items():
        for key, column in flatten(name, values).items():
            table.columns[key] = as_column(column)
    return table
