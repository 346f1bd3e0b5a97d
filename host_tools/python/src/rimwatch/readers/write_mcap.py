# SPDX-License-Identifier: MIT
"""Verdicts and alarms as MCAP, for Foxglove and PlotJuggler beside the log: `rim replay --mcap`."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, Iterable

from .table import need

_NUMBER = {"type": "number"}
_VERDICT = {"type": "object", "properties": {
    name: _NUMBER for name in ("t_s", "ln_anom", "threshold", "score", "level")}}
_ALARM = {"type": "object", "properties": {
    "t_s": _NUMBER, "seq": _NUMBER, "state": {"type": "string"}, "kind": {"type": "string"},
    "level": {"type": "string"}, "sentence": {"type": "string"}, "ln_anom": _NUMBER,
    "threshold": _NUMBER, "since_s": _NUMBER}}


def write(lines: Iterable[str], path: str) -> int:
    """Lines are JSON objects with "topic", whether it is an "alarm", and the message. Messages are
    at t_s of their log, in nanoseconds from 0. Returns how many were written; the file appears
    whole or not at all."""
    module = need("mcap.writer", "mcap", "to be written as MCAP")
    channels: Dict[str, int] = {}
    temporary = f"{path}.tmp.{os.getpid()}"
    count = 0
    try:
        with open(temporary, "wb") as file:
            writer = module.Writer(file)
            writer.start(library="rimwatch")
            kinds = {alarm: writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
                     for alarm, name, schema in ((False, "rim.Verdict", _VERDICT),
                                                 (True, "rim.Alarm", _ALARM))}
            for line in lines:
                record: Dict[str, Any] = json.loads(line)
                topic, message = record["topic"], record["message"]
                if topic not in channels:
                    channels[topic] = writer.register_channel(topic, "json", kinds[record["alarm"]])
                time_ns = max(0, round(1e9 * message["t_s"]))
                writer.add_message(channels[topic], time_ns, json.dumps(message).encode(), time_ns)
                count += 1
            writer.finish()
        os.replace(temporary, path)
    finally:
        if os.path.exists(temporary):
            os.unlink(temporary)
    return count
