#!/usr/bin/env python3
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/make_db3.py SCANS OUT.db3 [--layout ring|none|line_index] [--vehicle N] [--ego ego.csv]
#        [--opponent ego.csv] [--fault NAME|all]
#
# A rosbag2 recording out of a folder of binary PCD scans FRAME_SENSOR.pcd, written with Python's sqlite3 and a
# separate CDR encoder: it shares no code with the reader. Three layouts Luminar's drivers have used: float32 ring; no
# ring; line_index (uint16) at byte 44 of 56. --fault seeds one thing that is wrong; the list is in FAULTS below. With
# all OUT.db3 is a folder and gets FAULT.db3 for each.
import argparse
import functools
import math
import os
import re
import sqlite3
import struct
import sys

FAULTS = ["frame_id", "vehicle_frame", "unordered", "duplicate", "millimetres", "empty_sensor", "missing_sensor",
          "mounting_height", "mounting_pitch", "gap", "time_unit", "time_us", "nan", "ego_degrees", "ego_missing",
          "ego_clock", "short_cloud", "swapped", "period", "float_lines", "shuffled", "cdr_cut", "bad_row", "ego_nan"]
YAW = {"front": 0.0, "left": math.radians(120), "right": math.radians(-120)}
PLACE = {"front": (2.342, 0.0, 0.646), "left": (1.549, 0.267, 0.741), "right": (1.549, -0.267, 0.741)}


class Cdr:
    def __init__(self):
        self.out = bytearray()

    def put(self, form, *values):
        size = struct.calcsize("<" + form[-1])
        self.out += bytes(-len(self.out) % size)
        self.out += struct.pack("<" + form, *values)

    def text(self, value):
        raw = value.encode() + b"\0"
        self.put("I", len(raw))
        self.out += raw

    def header(self, stamp_ns, frame_id):
        self.put("i", stamp_ns // 10**9)
        self.put("I", stamp_ns % 10**9)
        self.text(frame_id)

    def bytes(self):
        return b"\0\1\0\0" + bytes(self.out)


def cloud_message(stamp_ns, frame_id, fields, step, data):
    cdr = Cdr()
    cdr.header(stamp_ns, frame_id)
    cdr.put("I", 1)
    cdr.put("I", len(data) // step)
    cdr.put("I", len(fields))
    for name, offset, datatype in fields:
        cdr.text(name)
        cdr.put("I", offset)
        cdr.put("B", datatype)
        cdr.put("I", 1)
    cdr.put("B", 0)
    cdr.put("I", step)
    cdr.put("I", len(data))
    cdr.put("I", len(data))
    cdr.out += data
    cdr.put("B", 1)
    return cdr.bytes()


def odometry_message(stamp_ns, x, y, z, roll, pitch, yaw, speed, yaw_rate):
    cdr = Cdr()
    cdr.header(stamp_ns, "map")
    cdr.text("base_link")
    cr, sr, cp, sp, cy, sy = (f(a / 2) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    cdr.put("7d", x, y, z, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy)
    cdr.put("36d", *[0.0] * 36)
    cdr.put("6d", speed, 0, 0, 0, 0, yaw_rate)
    cdr.put("36d", *[0.0] * 36)
    return cdr.bytes()


@functools.lru_cache(None)
def read_pcd(path):
    raw = open(path, "rb").read()
    end = raw.index(b"DATA binary\n") + len(b"DATA binary\n")
    head = dict(line.split(None, 1) for line in raw[:end].decode().splitlines() if line and line[0] != "#")
    names, sizes, types = head["FIELDS"].split(), head["SIZE"].split(), head["TYPE"].split()
    letter = {("F", "4"): "f", ("F", "8"): "d", ("U", "1"): "B", ("U", "2"): "H", ("U", "4"): "I", ("I", "4"): "i",
              ("I", "8"): "q"}
    form = struct.Struct("<" + "".join(letter[t, s] for t, s in zip(types, sizes)))
    points = form.iter_unpack(raw[end:end + form.size * int(head["POINTS"])])
    rows = [dict(zip(names, p)) for p in points]
    if "t" in names and sizes[names.index("t")] == "8":  # absolute times
        first = min((row["t"] for row in rows), default=0)
        rows = [dict(row, t=row["t"] - first) for row in rows]
    return rows


def layout_of(name, with_time):
    """Fields (name, offset, datatype), point_step, struct format, the PCD field of each value."""
    if name == "ring":
        fields, form, from_ = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 7)], "fffff", \
            ["x", "y", "z", "intensity", "ring"]
    elif name == "none":
        fields, form, from_ = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7)], "ffff", \
            ["x", "y", "z", "intensity"]
    else:
        fields = [("x", 8, 7), ("y", 12, 7), ("z", 16, 7), ("reflectance", 24, 7), ("existence_probability_percent", 42, 2),
                  ("line_index", 44, 4)]
        form, from_ = "8xfff4xf14xB1xH10x", ["x", "y", "z", "intensity", None, "ring"]
    if with_time and name != "line_index":
        fields, form, from_ = fields + [("t", struct.calcsize("<" + form), 6)], form + "I", from_ + ["t"]
    elif with_time:
        fields, form, from_ = fields + [("t", 48, 6)], "8xfff4xf14xB1xH2xI4x", from_ + ["t"]
    return fields, struct.calcsize("<" + form), struct.Struct("<" + form), from_


def spoil_points(points, sensor, index, fault):
    if fault == "nan":
        points = [dict(p, x=math.nan) if i % 3 else p for i, p in enumerate(points)]
    if fault == "millimetres":
        points = [dict(p, x=p["x"] * 1000, y=p["y"] * 1000, z=p["z"] * 1000) for p in points]
    if fault == "mounting_height":
        points = [dict(p, z=p["z"] + 0.8) for p in points]
    if fault == "mounting_pitch":
        c, s = math.cos(math.radians(6)), math.sin(math.radians(6))
        points = [dict(p, x=c * p["x"] + s * p["z"], z=c * p["z"] - s * p["x"]) for p in points]
    if fault == "vehicle_frame":
        c, s = math.cos(YAW[sensor]), math.sin(YAW[sensor])
        x0, y0, z0 = PLACE[sensor]
        points = [dict(p, x=c * p["x"] - s * p["y"] + x0, y=s * p["x"] + c * p["y"] + y0, z=p["z"] + z0) for p in points]
    if fault == "time_unit":
        points = [dict(p, t=min(p.get("t", 0) * 1000, 2**32 - 1)) for p in points]
    if fault == "time_us":
        points = [dict(p, t=p.get("t", 0) // 1000) for p in points]
    if fault == "float_lines":
        points = [dict(p, ring=p["ring"] + 0.5) for p in points]
    if fault == "shuffled":
        points = [points[(i * 7919) % len(points)] for i in range(len(points))]
    if fault == "empty_sensor" and sensor == "right":
        points = []
    return points


def cloud_messages(folder, layout, vehicle, fault):
    names = sorted(n for n in os.listdir(folder) if re.fullmatch(r"\d+_[a-z]+\.pcd", n))
    for name in names:
        frame, sensor = re.fullmatch(r"(\d+)_([a-z]+)\.pcd", name).groups()
        frame = int(frame)
        if fault == "missing_sensor" and sensor == "left":
            continue
        if fault == "gap" and frame == 3:
            continue
        points = spoil_points(read_pcd(os.path.join(folder, name)), sensor, frame, fault)
        fields, step, form, from_ = layout_of(layout, bool(points) and "t" in points[0])
        data = b"".join(form.pack(*(0 if f is None else p[f] for f in from_)) for p in points)
        stamp_ns = frame * (100_000_000 if fault == "period" else 50_000_000)
        if fault == "unordered" and frame == 4:
            stamp_ns -= 120_000_000
        if fault == "duplicate" and frame == 4:
            stamp_ns -= 50_000_000
        frame_id = "luminar_" + sensor
        if fault == "frame_id":
            frame_id = "base_link"
        if fault == "swapped":
            sensor = {"left": "right", "right": "left"}.get(sensor, sensor)
        message = cloud_message(stamp_ns, frame_id, fields, step, data)
        if fault == "short_cloud" and frame == 5:
            message = cloud_message(stamp_ns, frame_id, fields, step, data)
            at = message.index(struct.pack("<I", len(points)))
            message = message[:at] + struct.pack("<I", 2 * len(points)) + message[at + 4:]
        if fault == "cdr_cut" and frame == 5:
            message = message[:200]
        yield stamp_ns if fault not in ("unordered", "duplicate") else frame * 50_000_000, \
            vehicle + "/luminar_%s_points" % sensor, message


def ego_messages(path, vehicle, fault):
    lines = open(path).read().split()
    names = lines[0].split(",")
    for count, line in enumerate(lines[1:]):
        row = dict(zip(names, line.split(",")))
        stamp_ns = int(row["stamp_ns"])
        roll, pitch, yaw = (float(row.get(n, 0)) for n in ("roll_rad", "pitch_rad", "yaw_rad"))
        if fault == "ego_degrees":
            yaw = math.degrees(yaw)
        yaw_rate = math.nan if fault == "ego_nan" and count == 3 else float(row.get("yaw_rate_rps", 0))
        stored = stamp_ns + (40 * 10**9 if fault == "ego_clock" else 0)
        yield stamp_ns, vehicle + "/local_odometry", odometry_message(
            stored, float(row["x_m"]), float(row["y_m"]), float(row.get("z_m", 0)), roll, pitch, yaw,
            float(row["speed_mps"]), yaw_rate)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scans")
    parser.add_argument("out")
    parser.add_argument("--layout", default="ring", choices=["ring", "none", "line_index"])
    parser.add_argument("--vehicle", default="3")
    parser.add_argument("--ego")
    parser.add_argument("--opponent")  # the odometry of another vehicle
    parser.add_argument("--fault", choices=FAULTS + ["all"])
    args = parser.parse_args()
    if args.fault != "all":
        return write(args)
    for fault in FAULTS:
        layout = "none" if fault == "shuffled" else args.layout
        write(argparse.Namespace(**{**vars(args), "fault": fault, "layout": layout,
                                    "out": os.path.join(args.out, fault + ".db3")}))


def write(args):
    vehicle = "/vehicle_" + args.vehicle if args.vehicle else ""
    messages = list(cloud_messages(args.scans, args.layout, vehicle, args.fault))
    if args.ego and args.fault != "ego_missing":
        messages += ego_messages(args.ego, vehicle, args.fault)
    if args.opponent:
        messages += ego_messages(args.opponent, vehicle + "0", None)
    messages.sort(key=lambda m: m[0])
    if os.path.exists(args.out):
        os.remove(args.out)
    db = sqlite3.connect(args.out)
    db.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
               "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
    db.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
               "data BLOB NOT NULL)")
    db.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    ids = {}
    for stamp_ns, topic, data in messages:
        if topic not in ids:
            ids[topic] = len(ids) + 1
            kind = "nav_msgs/msg/Odometry" if topic.endswith("odometry") else "sensor_msgs/msg/PointCloud2"
            db.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (ids[topic], topic, kind))
        db.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", (ids[topic], stamp_ns, data))
    if args.fault == "bad_row":
        db.execute("UPDATE messages SET topic_id = 99 WHERE id = 10")
    db.commit()
    db.close()


if __name__ == "__main__":
    sys.exit(main())
