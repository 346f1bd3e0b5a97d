# SPDX-License-Identifier: MIT
"""write_formats.py FOLDER: one small log in every format, each written by the format's own library
(an ArduPilot log, which no library writes, and a ULog to begin with, by the published layout)."""

import json
import os
import struct
import sys

import numpy as np

ROWS, PERIOD_S = 40, 0.05
NAMES = ("cmd", "speed", "temp")


def samples():
    """t_s [40] and values [40, 3], exact in float32."""
    t_s = np.round(np.arange(ROWS) * PERIOD_S, 9)
    k = np.arange(ROWS)
    return t_s, np.stack([(k // 8) % 3 * 0.5, (k % 7) * 0.25, 20 + k * 0.125], axis=1)


T_S, VALUES = samples()
NS = [1_700_000_000_000_000_000 + round(1e9 * t) for t in T_S]


def csv(folder):
    with open(f"{folder}/rover.csv", "w", encoding="ascii") as out:
        out.write("t_s," + ",".join(NAMES) + "\n")
        for t, row in zip(T_S, VALUES):
            out.write(f"{t:.9g}," + ",".join(f"{v:.9g}" for v in row) + "\n")


def hdf5(folder):
    import h5py

    with h5py.File(f"{folder}/rover.h5", "w") as file:
        file["t_s"] = T_S
        for i, name in enumerate(NAMES):
            file[name] = VALUES[:, i]
        file["gain"] = 3.0


def mat5(folder):
    import scipy.io

    fields = {"t_s": T_S, **{n: VALUES[:, i] for i, n in enumerate(NAMES)}, "title": "rover"}
    scipy.io.savemat(f"{folder}/rover5.mat", fields)


def mat73(folder):
    """As MATLAB lays it out: a 512-byte block before the HDF5 file, arrays transposed."""
    import h5py

    with h5py.File(f"{folder}/rover73.mat", "w", userblock_size=512) as file:
        for name, values in [("t_s", T_S), *((n, VALUES[:, i]) for i, n in enumerate(NAMES))]:
            file[name] = values[np.newaxis, :]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with open(f"{folder}/rover73.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def parquet(folder):
    import pyarrow
    import pyarrow.parquet

    columns = {"t_s": T_S, **{n: VALUES[:, i] for i, n in enumerate(NAMES)}}
    pyarrow.parquet.write_table(pyarrow.table(columns), f"{folder}/rover.parquet")


def mdf4(folder):
    import asammdf

    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(VALUES[:, i], T_S, name=n) for i, n in enumerate(NAMES)])
        file.save(f"{folder}/rover.mf4", overwrite=True)


def mcap_ros2(folder):
    from mcap_ros2.writer import Writer

    with open(f"{folder}/rover.mcap", "wb") as file:
        writer = Writer(file)
        schema = writer.register_msgdef(
            "rover_msgs/State", "\n".join(f"float64 {n}" for n in NAMES)
        )
        for ns, row in zip(NS, VALUES):
            message = dict(zip(NAMES, row.tolist()))
            writer.write_message("/state", schema, message, log_time=ns, publish_time=ns)
        writer.finish()


def mcap_json(folder):
    from mcap.writer import Writer

    with open(f"{folder}/rover_json.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("state", "jsonschema", b"{}")
        channel = writer.register_channel("/state", "json", schema)
        for ns, row in zip(NS, VALUES):
            data = json.dumps(dict(zip(NAMES, row.tolist()))).encode()
            writer.add_message(channel, ns, data, ns)
        writer.finish()


def rosbag2(folder):
    from pathlib import Path

    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    vector = store.types["geometry_msgs/msg/Vector3"]
    kind = vector.__msgtype__
    with Writer(Path(folder) / "rover_bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        connection = bag.add_connection("/state", kind, typestore=store)
        for ns, row in zip(NS, VALUES):
            bag.write(connection, ns, store.serialize_cdr(vector(*row.tolist()), kind))


def ulog(folder):
    """A minimal file by the layout that PX4 publishes, which pyulog then reads and writes again."""
    import pyulog

    def message(kind, data):
        return struct.pack("<HB", len(data), ord(kind)) + data

    text = b"rover:uint64_t timestamp;double cmd;double speed;double temp;"
    raw = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000)
    raw += message("B", bytes(40)) + message("F", text)
    raw += message("A", struct.pack("<BH", 0, 0) + b"rover")
    for t, row in zip(T_S, VALUES):
        raw += message("D", struct.pack("<HQ3d", 0, 5_000_000 + round(1e6 * t), *row))
    path = f"{folder}/first.ulg"
    with open(path, "wb") as file:
        file.write(raw)
    log = pyulog.ULog(path)
    log.write_ulog(f"{folder}/rover.ulg")
    os.unlink(path)


def ardupilot(folder):
    def define(kind, length, name, fields, labels):
        return b"\xa3\x95\x80" + struct.pack(
            "<BB4s16s64s", kind, length, name.encode(), fields.encode(), labels.encode()
        )

    size = 3 + 8 + 12
    raw = define(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    raw += define(130, size, "ROVR", "Qfff", "TimeUS,cmd,speed,temp")
    for t, row in zip(T_S, VALUES):
        raw += b"\xa3\x95" + struct.pack("<BQ3f", 130, 7_000_000 + round(1e6 * t), *row)
    with open(f"{folder}/rover.bin", "wb") as file:
        file.write(raw)


DBC = """VERSION ""
BU_: rover
BO_ 291 State: 6 rover
 SG_ cmd : 0|16@1- (0.125,0) [0|0] "" rover
 SG_ speed : 16|16@1- (0.125,0) [0|0] "m/s" rover
 SG_ temp : 32|16@1- (0.125,0) [0|0] "degC" rover
"""


def candump(folder):
    import cantools

    with open(f"{folder}/rover.dbc", "w", encoding="ascii") as file:
        file.write(DBC)
    state = cantools.database.load_file(f"{folder}/rover.dbc").messages[0]
    with open(f"{folder}/rover.candump", "w", encoding="ascii") as file:
        for ns, row in zip(NS, VALUES):
            data = state.encode(dict(zip(NAMES, row.tolist()))).hex().upper()
            file.write(f"({ns // 10**9}.{ns % 10**9 // 1000:06d}) can0 123#{data}\n")


def lcm_log(folder):
    import importlib
    import subprocess

    import lcm

    with open(f"{folder}/state.lcm", "w", encoding="ascii") as file:
        file.write("package rover;\nstruct state { double cmd; double speed; double temp; }\n")
    subprocess.run(["lcm-gen", "-p", "--ppath", folder, f"{folder}/state.lcm"], check=True)
    sys.path.insert(0, folder)
    state_type = importlib.import_module("rover").state
    log = lcm.EventLog(f"{folder}/rover.lcmlog", "w", overwrite=True)
    for ns, row in zip(NS, VALUES):
        state = state_type()
        state.cmd, state.speed, state.temp = row.tolist()
        log.write_event(ns // 1000, "STATE", state.encode())
    log.close()


def ccsds(folder):
    from spacepackets.ccsds import PacketType, SpacePacketHeader

    with open(f"{folder}/packets.csv", "w", encoding="ascii") as file:
        file.write("name,data_type,bit_length\nt_ms,uint,32\n")
        file.write("".join(f"{n},float,64\n" for n in NAMES))
    with open(f"{folder}/rover.ccsds", "wb") as file:
        for i, (t, row) in enumerate(zip(T_S, VALUES)):
            data = struct.pack(">I3d", round(1000 * t), *row)
            header = SpacePacketHeader(
                packet_type=PacketType.TM, apid=42, seq_count=i, data_len=len(data) - 1
            )
            file.write(header.pack() + data)


def json_lines(folder):
    with open(f"{folder}/rover.jsonl", "w", encoding="ascii") as file:
        for t, row in zip(T_S, VALUES):
            line = {"t_s": round(float(t), 9), "state": dict(zip(NAMES, row.tolist()))}
            file.write(json.dumps(line) + "\n")


# Its file, options of the reader, columns t_s cmd speed temp as the reader names them, and what a
# unit of time there is in seconds.
FORMATS = {
    "hdf5": (hdf5, "rover.h5", [], ("t_s", "cmd", "speed", "temp"), 1.0),
    "mat5": (mat5, "rover5.mat", [], ("t_s", "cmd", "speed", "temp"), 1.0),
    "mat73": (mat73, "rover73.mat", [], ("t_s", "cmd", "speed", "temp"), 1.0),
    "parquet": (parquet, "rover.parquet", [], ("t_s", "cmd", "speed", "temp"), 1.0),
    "mdf4": (mdf4, "rover.mf4", [], ("t_s", "cmd", "speed", "temp"), 1.0),
    "mcap": (mcap_ros2, "rover.mcap", [],
             ("t_s", "/state.cmd", "/state.speed", "/state.temp"), 1.0),
    "mcap_json": (mcap_json, "rover_json.mcap", [],
                  ("t_s", "/state.cmd", "/state.speed", "/state.temp"), 1.0),
    "rosbag2": (rosbag2, "rover_bag", [], ("t_s", "/state.x", "/state.y", "/state.z"), 1.0),
    "ulog": (ulog, "rover.ulg", [], ("t_s", "rover.cmd", "rover.speed", "rover.temp"), 1.0),
    "ardupilot": (ardupilot, "rover.bin", [], ("t_s", "ROVR.cmd", "ROVR.speed", "ROVR.temp"), 1.0),
    "candump": (candump, "rover.candump", ["--dbc", "rover.dbc"],
                ("t_s", "State.cmd", "State.speed", "State.temp"), 1.0),
    "lcm": (lcm_log, "rover.lcmlog", ["--types", "state.lcm"],
            ("t_s", "STATE.cmd", "STATE.speed", "STATE.temp"), 1.0),
    "ccsds": (ccsds, "rover.ccsds", ["--packets", "packets.csv"],
              ("t_ms", "cmd", "speed", "temp"), 1e-3),
    "json_lines": (json_lines, "rover.jsonl", [],
                   ("t_s", "state.cmd", "state.speed", "state.temp"), 1.0),
}

if __name__ == "__main__":
    csv(sys.argv[1])
    for write, *_ in FORMATS.values():
        write(sys.argv[1])
