# SPDX-License-Identifier: MIT
"""Logs of messages: MCAP by mcap and mcap-ros2-support, ROS bags by rosbags, JSON lines."""

from __future__ import annotations

import json
from typing import Any, Dict

from .table import Options, ReadError, Table, Topics, as_column, need

_MOST = 64  # places of an array that become columns: images and point clouds are no telemetry


def fields_of(message: Any, prefix: str = "") -> Dict[str, Any]:
    """The numbers and texts of a message by their path: twist.linear.x, ranges[3]. Longer arrays
    than 64 are left out."""
    out: Dict[str, Any] = {}
    for key, value in _members(message):
        _put(out, f"{prefix}{key}", value)
    return out


def _members(message: Any) -> Any:
    if isinstance(message, dict):
        return message.items()
    if hasattr(message, "__dataclass_fields__"):
        return ((key, getattr(message, key)) for key in message.__dataclass_fields__)
    names = getattr(message, "__slots__", None) or vars(message).keys()
    return ((key, getattr(message, key)) for key in names if not key.startswith("_"))


def _put(out: Dict[str, Any], name: str, value: Any) -> None:
    if isinstance(value, (bool, int, float, str)) or value is None:
        out[name] = value
    elif hasattr(value, "dtype") and value.ndim == 0:
        out[name] = value.item()
    elif isinstance(value, (bytes, bytearray, memoryview)):
        return
    elif hasattr(value, "__len__") and not isinstance(value, dict):
        if len(value) <= _MOST:
            for i, item in enumerate(value):
                _put(out, f"{name}[{i}]", item)
    else:
        out.update(fields_of(value, f"{name}."))


def mcap(path: str, options: Options) -> Table:
    """Columns TOPIC.FIELD of the messages of ROS 2 and of JSON, at the times of their log."""
    reader = need("mcap.reader", "mcap mcap-ros2-support", "an MCAP file")
    decoders = []
    with open(path, "rb") as file:
        kinds = {c.message_encoding for c in _channels(reader.make_reader(file))}
    if "cdr" in kinds:
        ros2 = need("mcap_ros2.decoder", "mcap-ros2-support", "an MCAP file of ROS 2 messages")
        decoders.append(ros2.DecoderFactory())
    if "protobuf" in kinds:
        proto = need("mcap_protobuf.decoder", "mcap-protobuf-support", "an MCAP file of protobuf")
        decoders.append(proto.DecoderFactory())
    topics = Topics(1e-9)
    with open(path, "rb") as file:
        source = reader.make_reader(file, decoder_factories=decoders)
        for schema, channel, message in source.iter_messages():
            if channel.message_encoding == "json":
                value = json.loads(message.data)
                value = value if isinstance(value, dict) else {"value": value}
            else:
                value = _decoded(decoders, schema, channel, message)
            if value is not None:
                topics.add(channel.topic, message.log_time, fields_of(value))
    return topics.table(options.rows)


def _channels(reader: Any) -> Any:
    summary = reader.get_summary()
    if summary is not None:
        return summary.channels.values()
    return [channel for _, channel, _ in reader.iter_messages()]


def _decoded(decoders: Any, schema: Any, channel: Any, message: Any) -> Any:
    for factory in decoders:
        decode = factory.decoder_for(channel.message_encoding, schema)
        if decode is not None:
            return decode(message.data)
    return None


def rosbag(path: str, options: Options) -> Table:
    """Columns TOPIC.FIELD of a rosbag2 (its folder, or a .db3 in it) or of a ROS 1 bag."""
    highlevel = need("rosbags.highlevel", "rosbags", "a ROS bag")
    typesys = need("rosbags.typesys", "rosbags", "a ROS bag")
    from pathlib import Path

    place = Path(path)
    if place.suffix == ".db3" and (place.parent / "metadata.yaml").exists():
        place = place.parent
    # Bags of ROS 2 before Iron say names of types alone: those of its standard messages are known.
    known = typesys.get_typestore(typesys.Stores.LATEST)
    topics = Topics(1e-9)
    with highlevel.AnyReader([place], default_typestore=known) as bag:
        for connection, time_ns, raw in bag.messages():
            try:
                message = bag.deserialize(raw, connection.msgtype)
            except KeyError as reason:
                raise ReadError(f"holds messages of an unknown type {reason}") from reason
            topics.add(connection.topic, time_ns, fields_of(message))
    return topics.table(options.rows)


def json_lines(path: str, options: Options) -> Table:
    """A row of each line, which is an object; nested names are joined by points."""
    rows = []
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            if not line.strip():
                continue
            try:
                rows.append(fields_of(json.loads(line)))
            except (ValueError, TypeError, AttributeError) as reason:
                raise ReadError(f"line {number}: no JSON object: {reason}") from reason
    names = list(dict.fromkeys(key for row in rows for key in row))
    table = Table()
    for name in names:
        values = [row.get(name) for row in rows]
        if all(v is None or isinstance(v, (bool, int, float)) for v in values):
            values = [float("nan") if v is None else float(v) for v in values]
        table.columns[name] = as_column(values)
    return table
