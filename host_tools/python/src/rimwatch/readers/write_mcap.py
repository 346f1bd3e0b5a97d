# SPDX-License-Identifier: MIT
"""Verdicts and alarms as MCAP, for Foxglove and PlotJuggler beside the log: `rim replay --mcap`.

Messages are JSON with a JSON schema, whose numbers both plot. An alarm is written twice: whole, as
rim.Alarm, and as a foxglove.Log, the schema by which Foxglove's Log panel lists texts by severity."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, Iterable

from .table import need

_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}
_VERDICT = {"type": "object", "properties": {
    name: _NUMBER for name in ("t_s", "ln_anom", "threshold", "score", "level")}}
_ALARM = {"type": "object", "properties": {
    "t_s": _NUMBER, "seq": _NUMBER, "state": _TEXT, "kind": _TEXT, "level": _TEXT,
    "detector": _TEXT, "sentence": _TEXT, "ln_anom": _NUMBER, "threshold": _NUMBER,
    "p_value": _NUMBER, "observations": _NUMBER, "since_s": _NUMBER, "since_sd_s": _NUMBER,
    "channels": {"type": "array", "items": _TEXT}, "features": {"type": "array", "items": _TEXT},
    "shift": {"type": "object", "additionalProperties": _NUMBER},
    "shift_sd": {"type": "object", "additionalProperties": _NUMBER}}}
# As https://github.com/foxglove/foxglove-sdk has it in schemas/jsonschema/Log.json.
_LOG = {"title": "Log", "type": "object", "properties": {
    "timestamp": {"type": "object", "title": "Time", "properties": {
        "sec": {"type": "integer", "minimum": 0},
        "nsec": {"type": "integer", "minimum": 0, "maximum": 999999999}}},
    "level": {"oneOf": [{"title": title, "const": value} for value, title in enumerate(
        ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"))]},
    "message": _TEXT, "name": _TEXT, "file": _TEXT, "line": {"type": "integer", "minimum": 0}}}
_SEVERITY = {"OK": 2, "WARN": 3, "WARNING": 3, "STALE": 3, "OUT_OF_RANGE": 3, "ERROR": 4}


def _log_of(alarm: Dict[str, Any], time_ns: int, name: str) -> Dict[str, Any]:
    """What a person reads of an alarm. One that is cleared is no warning any more."""
    level = 2 if alarm["state"] == "cleared" else _SEVERITY.get(alarm["level"], 0)
    return {"timestamp": {"sec": time_ns // 10**9, "nsec": time_ns % 10**9}, "level": level,
            "message": f"{alarm['state']}: {alarm['sentence']}", "name": name, "file": "", "line": 0}


def write(lines: Iterable[str], path: str) -> int:
    """Lines are JSON objects with "topic", whether it is an "alarm", and the message. Messages are
    at t_s of their log, in nanoseconds from 0. Returns how many lines were written; the file appears
    whole or not at all."""
    module = need("mcap.writer", "mcap", "to be written as MCAP")
    channels: Dict[str, int] = {}
    temporary = f"{path}.tmp.{os.getpid()}"
    count = 0
    try:
        with open(temporary, "wb") as file:
            writer = module.Writer(file)
            writer.start(library="rimwatch")
            kinds = {name: writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
                     for name, schema in (("rim.Verdict", _VERDICT), ("rim.Alarm", _ALARM),
                                          ("foxglove.Log", _LOG))}

            def put(topic: str, kind: str, time_ns: int, message: Dict[str, Any]) -> None:
                if topic not in channels:
                    channels[topic] = writer.register_channel(topic, "json", kinds[kind])
                writer.add_message(channels[topic], time_ns, json.dumps(message).encode(), time_ns,
                                   count)

            for line in lines:
                record: Dict[str, Any] = json.loads(line)
                topic, message = record["topic"], record["message"]
                time_ns = max(0, round(1e9 * message["t_s"]))
                put(topic, "rim.Alarm" if record["alarm"] else "rim.Verdict", time_ns, message)
                if record["alarm"]:
                    log = topic.rsplit("/", 1)[0]
                    put(log + "/log", "foxglove.Log", time_ns, _log_of(message, time_ns, log[1:]))
                count += 1
            writer.finish()
        os.replace(temporary, path)
    finally:
        if os.path.exists(temporary):
            os.unlink(temporary)
    return count
