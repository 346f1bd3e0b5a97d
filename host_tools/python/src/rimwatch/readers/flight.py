# SPDX-License-Identifier: MIT
"""Logs of autopilots: ULog by pyulog, ArduPilot's dataflash logs by pymavlink."""

from __future__ import annotations

from typing import Any, Dict

from .table import Options, ReadError, Table, Topics, need


def ulog(path: str, options: Options) -> Table:
    """Columns TOPIC.FIELD; TOPIC[1].FIELD for a topic's further instances."""
    module = need("pyulog", "pyulog", "a ULog (PX4) file")
    log = module.ULog(path)
    topics = Topics(1e-6)
    for data in log.data_list:
        times = data.data["timestamp"].astype("int64")
        fields = {key: value for key, value in data.data.items() if key != "timestamp"}
        name = data.name if data.multi_id == 0 else f"{data.name}[{data.multi_id}]"
        if len(times) > 0:
            topics.add_arrays(name, times, fields)
    return topics.table(options.rows)


def ardupilot(path: str, options: Options) -> Table:
    """Columns MESSAGE.FIELD; MESSAGE[I].FIELD where a message says its instance."""
    module = need("pymavlink.DFReader", "pymavlink", "an ArduPilot dataflash log")
    log = module.DFReader_binary(path)
    topics = Topics(1e-6)
    while True:
        message = log.recv_msg()
        if message is None:
            break
        values: Dict[str, Any] = message.to_dict()
        name = values.pop("mavpackettype")
        time_us = values.pop("TimeUS", None)
        if time_us is None:
            continue  # formats, units, parameters of old firmware: no samples
        instance = values.get("I", 0)
        name = name if not instance else f"{name}[{instance}]"
        topics.add(name, time_us, values)
    try:
        return topics.table(options.rows)
    except ReadError as reason:
        raise ReadError(f"is no ArduPilot dataflash log, or {reason}") from reason
