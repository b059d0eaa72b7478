# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Recordings as arrays, runs and simulated races.
import contextlib
import dataclasses
import gc
import json
import os
import pathlib
import pickle
import re
import sqlite3
import struct
import subprocess
import sys
import tempfile

import numpy
import pytest

import overtake
from conftest import a_sensor, car_tail, in_a_forked_child


def test_a_race_and_its_truth(race):
    truth = race.truth
    assert race.frame_count == 40 and set(truth["frame"]) == set(range(40))
    cars = len(set(truth["car"]))
    assert cars > 1 and len(truth["x_m"]) == 40 * cars
    own = truth["is_ego"]
    assert numpy.all(truth["speed_mps"] > 0) and own.sum() == 40 and list(truth["name"][own])[0] == "ego"
    # The nearest car of the truth is where the last frame's confirmed track is.
    *_, frame = overtake.run(race)
    rows = (truth["frame"] == frame.number) & ~own
    assert numpy.all(abs(truth["stamp_ns"][rows] - frame.stamp_ns) < 60_000_000)
    tracks = frame.tracks
    confirmed = tracks.state == overtake.TrackState.CONFIRMED
    distances = numpy.hypot(truth["x_m"][rows][:, None] - tracks.x_m[confirmed],
                            truth["y_m"][rows][:, None] - tracks.y_m[confirmed])
    assert confirmed.any() and distances.min(axis=0).max() < 2


def test_a_temporary_race_is_removed():
    race = overtake.simulate("demo", seconds=0.1)
    path = pathlib.Path(race.path)
    assert path.exists() and os.fspath(race) == race.path
    del race
    assert not path.parent.exists()


def temporary_folders():
    return set(pathlib.Path(tempfile.gettempdir()).glob("overtake_*"))


def test_a_temporary_race_lives_as_long_as_something_reads_it():
    before = temporary_folders()

    def made():
        return temporary_folders() - before

    recording = overtake.open(overtake.simulate("demo", seconds=0.1))
    assert len(list(recording)) == 6 == len(list(recording)) and len(made()) == 1
    scans = iter(recording)
    del recording
    assert len(list(scans)) == 6 and len(made()) == 1
    del scans
    assert not made()
    run = overtake.run(overtake.simulate("demo", seconds=0.1), copy_labels=True)
    assert len(made()) == 1
    frames = list(run)
    del run
    assert not made() and all(len(frame.labels()) > 10_000 for frame in frames) and len(frames) == 2
    for one in overtake.open(overtake.simulate("demo", seconds=0.1)):
        assert len(made()) == 1
    del one
    assert not made()


def test_seconds_that_are_no_race_are_refused():
    before = temporary_folders()
    for seconds in (0, -1, 0.01, float("nan")):
        with pytest.raises(ValueError, match="seconds: 0.05 or more is needed"):
            overtake.simulate("demo", seconds=seconds)
    assert temporary_folders() == before


def test_a_run_with_params_keeps_the_period_of_its_rig(tmp_path):
    overtake.simulate("demo", seconds=0.1, out=os.fspath(tmp_path / "race"))
    rig = tmp_path / "race" / "rig.toml"
    text = rig.read_text()
    assert "period_s = 0.05" in text
    rig.write_text(text.replace("period_s = 0.05", "period_s = 0.1"))

    def period(**options):
        config = overtake.run(tmp_path / "race", rig=rig, **options).config
        return float(re.search(r"\[frame\]\nperiod_s = (\S+)", config)[1])
    assert period(preset="best") == period(params=overtake.Params("best")) == 0.1
    params = overtake.Params("best")
    params.frame.period_s = 0.04
    assert period(params=params) == 0.04
    params.frame.period_s = 0.05    # also the default of the library
    for same in (params, params.copy(), pickle.loads(pickle.dumps(params))):
        assert period(params=same) == 0.05
    assert period(params=pickle.loads(pickle.dumps(overtake.Params("best")))) == 0.1
    (tmp_path / "config.toml").write_text("[gate]\nmin_points = 8\n")
    with pytest.raises(ValueError, match="config and Params are both whole sets of parameters: give params as a dict"):
        period(params=params, config=tmp_path / "config.toml")
    assert period(params={"frame.period_s": 0.05}, config=tmp_path / "config.toml") == 0.05


def test_wrong_arguments_are_named(race):
    for seed, error in ((-1, ValueError), (2**64, ValueError), (1.5, TypeError), ("1", TypeError)):
        with pytest.raises(error, match=f"seed is {re.escape(repr(seed))}; .* is needed"):
            overtake.simulate("demo", seed, seconds=0.1)
    for seconds in ("a", [1]):
        with pytest.raises(TypeError, match=f"seconds is {re.escape(repr(seconds))}; a number is needed"):
            overtake.simulate("demo", seconds=seconds)
    with pytest.raises(TypeError, match="ego is 3; a text is needed"):
        overtake.simulate("demo", seconds=0.1, ego=3)
    for rows in ("x", 1.5):
        with pytest.raises(TypeError, match=f"tracks is {rows!r}; a whole number is needed"):
            overtake.run(race, capacities={"tracks": rows})


def test_the_name_of_a_race_is_read_as_by_the_command(tmp_path):
    overtake.simulate("demo", seconds=0.1, out=os.fspath(tmp_path / "race.MCAP"))
    assert (tmp_path / "race.MCAP").is_file()
    with pytest.raises(overtake.FileError, match=r"race\.mcp: a log's name ends in \.mcap, not in \.mcp"):
        overtake.simulate("demo", seconds=0.1, out=os.fspath(tmp_path / "race.mcp"))


def test_a_race_that_fails_leaves_no_folder():
    before = temporary_folders()
    with pytest.raises(overtake.FileError, match="no car is named 'nobody'"):
        overtake.simulate("demo", ego="nobody")
    assert temporary_folders() == before


def test_a_forked_child_removes_no_race():
    race = overtake.simulate("demo", seconds=0.1)
    path = pathlib.Path(race.path)
    code = "import os, sys, overtake; race = overtake.simulate('demo', seconds=0.1); print(race.path, flush=True)\n" \
           "if os.fork() == 0: sys.exit(0)\n" \
           "os.wait(); print(os.path.exists(race.path))"
    told = subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, capture_output=True, text=True)
    log, found = told.stdout.split()
    assert found == "True" and told.stderr == "" and not os.path.exists(os.path.dirname(log))

    def give_up():
        nonlocal race
        del race
        gc.collect()

    assert in_a_forked_child(give_up) == ["returned"] and path.exists()


def test_a_forked_child_raises_instead_of_reading(race):
    run, recording = overtake.run(race), overtake.open(race)
    scans = iter(recording)
    frames, scan = [next(run)], next(scans)
    told = in_a_forked_child(lambda: next(run), lambda: list(run), lambda: run.stats, lambda: frames[0].detections)
    assert len(told) == 4 and all(line.startswith("ReleasedError: this process was forked") for line in told), told
    told = in_a_forked_child(lambda: next(scans), lambda: list(scans))
    assert told == ["ReleasedError: this process was forked after the recording was opened: open it again here"] * 2
    # What was read before is there, and what is opened there can be read there.
    assert in_a_forked_child(lambda: scan.points["x"].sum(), lambda: next(iter(recording)),
                             lambda: next(overtake.run(race)), lambda: run.progress) == ["returned"] * 4
    frames += run
    assert [frame.number for frame in frames] == list(range(race.frame_count))
    assert len(list(scans)) == 3 * race.frame_count - 1


def test_folders_and_logs_hold_the_same_scans(tmp_path):
    folder = overtake.simulate("demo", 3, tmp_path / "race", seconds=0.2)
    log = overtake.simulate("demo", 3, tmp_path / "race.mcap", seconds=0.2)
    for one, other in zip(overtake.open(folder), overtake.open(log)):
        assert (one.sensor, one.frame, len(one)) == (other.sensor, other.frame, len(other))
        for name in ("x", "y", "z", "layer", "intensity"):
            assert numpy.array_equal(one.points[name], other.points[name]), name
        # The folder's files have the times of points only: a scan's stamp is that of its first point.
        assert numpy.array_equal(one.stamp_ns + one.points["time"].astype("i8"),
                                 other.stamp_ns + other.points["time"].astype("i8"))
    assert overtake.run(folder).sensors == ["front", "left", "right"]


def test_results_and_other_files_are_not_overwritten(tmp_path):
    out = tmp_path / "precious.mcap"
    out.write_text("mine")
    with pytest.raises(overtake.FileError, match="force"):
        overtake.simulate("demo", out=out, seconds=0.05)
    assert out.read_text() == "mine"
    overtake.simulate("demo", out=out, seconds=0.05, force=True)
    assert out.read_bytes().startswith(b"\x89MCAP")


def test_wrong_scenarios(tmp_path):
    with pytest.raises(overtake.FileError, match="did you mean 'overtake'"):
        overtake.simulate("overtaek", out=tmp_path / "a.mcap")
    with pytest.raises(overtake.FileError, match="no car is named 'nobody'"):
        overtake.simulate("demo", ego="nobody", out=tmp_path / "a.mcap")
    assert "demo" in overtake.scenario_names


def test_scans_of_a_race(race):
    recording = overtake.open(race)
    scans = list(recording)
    assert recording.sensors == ["front", "left", "right"] and recording.damage == ""
    assert len(scans) == 3 * race.frame_count and [scan.sensor for scan in scans[:3]] == recording.sensors
    scan = scans[0]
    assert scan.points["x"].dtype == numpy.float32 and scan.points["layer"].dtype == numpy.uint16
    assert scan.points["time"].dtype == numpy.int32 and 0 <= scan.points["time"].max() < 60_000_000
    assert len(scan) == len(scan.points["x"]) > 10_000
    assert scan.ego_poses and set(scan.ego_poses[0]) >= {"stamp_ns", "x_m", "y_m", "yaw_rad", "speed_mps"}
    assert scans[1].ego_poses == []
    assert len(list(recording)) == len(scans)
    assert list(overtake.open(race, ego="none"))[0].ego_poses == []


def test_arrays_of_a_scan_outlive_it(race):
    scans = list(overtake.open(race))
    kept = scans[5].points["x"]
    copy = kept.copy()
    del scans
    assert kept.tobytes() == copy.tobytes()


def write_pcd(path, columns):
    dtype = numpy.dtype([(name, column.dtype) for name, column in columns.items()])
    records = numpy.zeros(len(columns["x"]), dtype)
    for name, column in columns.items():
        records[name] = column
    fields = "".join(f" {name}" for name in dtype.names)
    sizes = "".join(f" {dtype[name].itemsize}" for name in dtype.names)
    kinds = "".join(f" {dtype[name].kind.upper()}" for name in dtype.names)
    header = (f"VERSION .7\nFIELDS{fields}\nSIZE{sizes}\nTYPE{kinds}\nCOUNT{' 1' * len(dtype)}\nWIDTH {len(records)}\n"
              f"HEIGHT 1\nPOINTS {len(records)}\nDATA binary\n")
    path.write_bytes(header.encode() + records.tobytes())


def test_files_without_a_rig_give_all_their_fields(tmp_path):
    tail = car_tail()
    columns = {"x": tail["x"], "y": tail["y"], "z": tail["z"], "ring": tail["layer"],
               "colour": numpy.arange(360, dtype="u2"), "weight": numpy.linspace(0, 1, 360)}
    for frame in (12, 13):
        write_pcd(tmp_path / f"{frame:06d}_front.pcd", columns)
    scans = list(overtake.open(tmp_path))
    assert [(scan.sensor, scan.frame, scan.stamp_ns) for scan in scans] == [("front", 0, 0), ("front", 1, 0)]
    assert set(scans[0].points) == set(columns)
    for name, column in columns.items():
        assert scans[1].points[name].dtype == column.dtype and numpy.array_equal(scans[1].points[name], column)
    assert len(list(overtake.open(tmp_path / "000013_front.pcd"))) == 1


@pytest.mark.parametrize("rig", (None, "av21"))
def test_damaged_files_of_a_folder_are_left_out(tmp_path, rig):
    columns = {name: column for name, column in car_tail().items() if name in "xyz"}
    columns["ring"] = car_tail()["layer"]
    for frame in (12, 14):
        write_pcd(tmp_path / f"{frame:06d}_front.pcd", columns)
    (tmp_path / "000013_front.pcd").write_bytes(b"no cloud")
    recording = overtake.open(tmp_path, rig)
    lost = "1 file could not be read, the others are done; .*13_front"
    with pytest.warns(overtake.DamageWarning, match=lost) as told:
        scans = list(recording)
    assert len(told) == 1 and "before" not in str(told[0].message)
    assert [scan.path[-9:] for scan in scans] == ["front.pcd"] * 2 and scans[-1].path.endswith("14_front.pcd")
    assert recording.damage == "" and "13_front.pcd" in recording.losses
    for frame in (12, 14):
        (tmp_path / f"{frame:06d}_front.pcd").write_bytes(b"no cloud")
    scans = iter(overtake.open(tmp_path, rig))
    with pytest.raises(overtake.FileError, match="12_front.pcd"):
        next(scans)
    with pytest.warns(overtake.DamageWarning):
        assert list(scans) == []


def test_names_may_be_any_bytes(tmp_path):
    folder = os.fsencode(tmp_path)
    columns = {name: numpy.ones(3, "f4") for name in ("x", "y", "z", "caf?")}
    write_pcd(tmp_path / "plain.pcd", columns)
    pcd = (tmp_path / "plain.pcd").read_bytes().replace(b"caf?", b"caf\xe9")
    (tmp_path / "plain.pcd").unlink()
    with open(folder + b"/1_fr\xf6nt.pcd", "wb") as file:
        file.write(pcd)
    recording = overtake.open(tmp_path)
    scan, = recording
    assert [os.fsencode(name) for name in recording.sensors] == [os.fsencode(scan.sensor)] == [b"fr\xf6nt"]
    assert os.fsencode(list(scan.points)[-1]) == b"caf\xe9"
    assert repr(scan) == "<overtake.Scan of fr\\xf6nt, frame 0: 3 points>"


def cloud_message(columns, stamp_ns):
    """A sensor_msgs/PointCloud2 in CDR; every column is float32."""
    body = bytearray()

    def put(kind, *values):
        body.extend(bytes(-len(body) % struct.calcsize(kind)))
        body.extend(struct.pack("<" + kind * len(values), *values))

    def put_text(text):
        put("I", len(text) + 1)
        body.extend(text.encode() + b"\0")

    points = numpy.column_stack([columns[name] for name in columns]).astype("f4")
    put("I", stamp_ns // 10**9, stamp_ns % 10**9)
    put_text("lidar")
    put("I", 1, len(points), len(columns))
    for place, name in enumerate(columns):
        put_text(name)
        put("I", 4 * place)
        put("B", 7)                     # FLOAT32
        put("I", 1)
    put("B", 0)
    put("I", 4 * len(columns), points.nbytes, points.nbytes)
    body.extend(points.tobytes() + b"\1")
    return b"\0\1\0\0" + bytes(body)


def write_db3(path, messages):
    with contextlib.closing(sqlite3.connect(path)) as bag, bag:
        bag.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                    "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
        bag.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT "
                    "NULL, data BLOB NOT NULL)")
        bag.execute("INSERT INTO topics VALUES(1, '/lidar/points', 'sensor_msgs/msg/PointCloud2', 'cdr', '')")
        for number, message in enumerate(messages):
            bag.execute("INSERT INTO messages VALUES(?, 1, ?, ?)", (number + 1, 10**9 + number, message))


def write_ply(path, columns):
    names = "".join(f"property float {name}\n" for name in columns)
    rows = numpy.column_stack(list(columns.values())).astype("f4")
    path.write_bytes(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{names}end_header\n".encode() +
                     rows.tobytes())


def test_open_reads_what_info_knows(program, race, tmp_path):
    tail = car_tail()
    columns = {"x": tail["x"], "y": tail["y"], "z": tail["z"], "intensity": tail["intensity"]}
    write_pcd(tmp_path / "a.pcd", columns)
    write_ply(tmp_path / "a.ply", columns)
    (tmp_path / "a.bin").write_bytes(numpy.column_stack(list(columns.values())).astype("f4").tobytes())
    (tmp_path / "a.pcd.bin").write_bytes(numpy.column_stack([*columns.values(), tail["layer"]]).astype("f4").tobytes())
    write_db3(tmp_path / "a.db3", [cloud_message(columns, stamp_ns) for stamp_ns in (5 * 10**9, 6 * 10**9)])
    (tmp_path / "bag").mkdir()
    write_db3(tmp_path / "bag" / "bag_0.db3", [cloud_message(columns, 5 * 10**9)])
    names = ("a.pcd", "a.ply", "a.bin", "a.pcd.bin", "a.db3", "bag")
    paths = [tmp_path / name for name in names] + [pathlib.Path(race.path)]
    listed = subprocess.run([program, "info", "--help"], check=True, capture_output=True, text=True).stdout
    endings = set(re.findall(r"\((\.[\w.]+)\)", listed.split("Formats, ")[1]))
    assert endings == {"".join(path.suffixes) for path in paths} - {""}
    for path in paths:
        told = json.loads(subprocess.run([program, "info", path, "--json"], check=True, capture_output=True).stdout)
        scans = list(overtake.open(path))     # without a rig, but a race has its own: the clouds of its sensors
        if told["topics"]:
            clouds = [topic for topic in told["topics"] if topic["name"].endswith("/points")]
            assert {topic["type"] for topic in clouds} == {"sensor_msgs/msg/PointCloud2"}
            assert len(scans) == sum(topic["messages"] for topic in clouds)
            assert sum(map(len, scans)) == sum(topic["points"] for topic in clouds)
            assert {scan.sensor.strip("/").split("/")[0] for scan in scans} == {
                topic["name"].split("/")[1] for topic in clouds}
        else:
            assert [len(scan) for scan in scans] == [told["scans"][0]["points_of_first"]] == [360]
            assert list(scans[0].points) == [field.split()[0] for field in told["scans"][0]["fields"].split(", ")]
        if path.suffix != ".mcap":
            for name, column in columns.items():
                assert numpy.array_equal(scans[0].points[name], column), (path, name)
    assert [scan.stamp_ns for scan in overtake.open(tmp_path / "a.db3")] == [5 * 10**9, 6 * 10**9]


def test_wrong_recordings(tmp_path):
    with pytest.raises(overtake.FileError, match="no such file"):
        overtake.open(tmp_path / "missing.mcap")
    with pytest.raises(overtake.FileError, match="holds no recording"):
        overtake.open(tmp_path)
    with pytest.raises(overtake.FileError, match="--rig is needed"):
        write_pcd(tmp_path / "000000_front.pcd", {"x": numpy.zeros(1, "f4")})
        overtake.run(tmp_path)
    with pytest.raises(ValueError, match="did you mean 'av21'"):
        overtake.run(tmp_path, rig="av22")
    with pytest.raises(TypeError, match="needs a name or a TOML file"):
        overtake.run(tmp_path, rig=[a_sensor()])
    with pytest.raises(overtake.FileError, match="tracker.confirm_hits is '99'"):
        overtake.run(tmp_path, rig="av21", params={"tracker.confirm_hits": 99})
    for value in ("many", "3", None, [3]):
        with pytest.raises(TypeError, match="tracker.confirm_hits is .*; a number is needed"):
            overtake.run(tmp_path, rig="av21", params={"tracker.confirm_hits": value})
    for wrong in (-1, float("nan"), 1000):
        with pytest.raises(ValueError, match=f"path_horizon_s is {wrong}; 0 to .* s .tracker.horizon_s. is needed"):
            overtake.run(tmp_path, rig="av21", path_horizon_s=wrong)
    with pytest.raises(TypeError, match="workers is 'two'; a whole number is needed"):
        overtake.run(tmp_path, rig="av21", workers="two")
    with pytest.raises(ValueError, match="workers is -3; 0 to 256 is needed"):
        overtake.run(tmp_path, rig="av21", workers=-3)
    for workers in (-1, 257, 1000000):
        with pytest.raises(ValueError, match=f"workers is {workers}; 0 to 256 is needed"):
            overtake.simulate("demo", workers=workers)
    rig = overtake.load_rig("av21")
    rig.sensors[0].z_m += 0.1
    with pytest.raises(ValueError, match="rig was changed after load_rig: a recording reads av21 again"):
        overtake.open(tmp_path, rig)
    for track in (overtake.Map(), {"x_m": [0, 1]}, 3):
        with pytest.raises(TypeError, match=f"map is a {type(track).__name__}; a path is needed"):
            overtake.run(tmp_path, rig="av21", map=track)
    with pytest.raises(ValueError, match="no path holds a zero byte"):
        overtake.run(os.fspath(tmp_path) + "\0", rig="av21")


def test_a_recording_without_a_usable_point(tmp_path):
    columns = {name: numpy.full(3, numpy.nan, "f4") for name in ("x", "y", "z", "ring")}
    write_pcd(tmp_path / "000000_front.pcd", columns)
    with pytest.raises(overtake.FileError, match="holds no usable point in 1 scan"):
        list(overtake.run(tmp_path, rig="av21"))


def test_paths_may_be_any_bytes(tmp_path):
    folder = os.fsencode(tmp_path) + b"/race\xff"
    made = overtake.simulate("demo", seconds=0.1, out=folder)
    assert made.path == os.fsdecode(folder) and os.path.isdir(folder)
    for path in (folder, os.fsdecode(folder), pathlib.Path(os.fsdecode(folder)), made):
        recording = overtake.open(path)
        assert len(list(recording)) == 6 and recording.path == made.path
        assert next(iter(recording)).path.startswith(made.path)
        assert len(list(overtake.run(path))) == 2
    with pytest.raises(overtake.FileError, match="race.*/missing: no such folder"):
        overtake.open(folder + b"/missing", rig="av21")
    assert len(overtake.load_map(folder + b"/map.csv").x_m) > 100


def test_numpy_scalars_are_numbers(race):
    values = {"lane_tracker.confirm_hits": (4, numpy.int64(4), numpy.uint8(4), numpy.float32(4), numpy.array(4)),
              "gate.min_points": (7, numpy.int16(7)),
              "cluster.threshold_deg": (2.5, numpy.float32(2.5), numpy.float64(2.5))}
    plain = {name: kinds[0] for name, kinds in values.items()}
    config = overtake.run(race, params=plain).config
    assert "confirm_hits = 4" in config and "threshold_deg = 2.5" in config
    for name in plain:
        for value in values[name]:
            assert overtake.run(race, params={**plain, name: value}).config == config, (name, value)
            params = overtake.Params("best")
            params[name] = value
            assert params[name] == plain[name]
    run = overtake.run(race, workers=numpy.int64(1), capacities={"tracks": numpy.int32(99)},
                       path_horizon_s=numpy.float32(1), copy_labels=numpy.bool_(True))
    assert "tracks = 99" in run.config and len(next(run).labels("left")) > 10_000
    small = overtake.simulate("demo", numpy.int64(3), seconds=numpy.float64(0.1))
    assert small.frame_count == 2


def test_damage_is_a_warning_and_the_rest_is_read(race, tmp_path):
    whole = pathlib.Path(race.path).read_bytes()
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(whole[:len(whole) // 2])
    with pytest.warns(overtake.DamageWarning, match="torn.mcap"):
        frames = list(overtake.run(torn, rig=race.path, ego="none"))
    assert 5 < len(frames) < race.frame_count
    with pytest.warns(overtake.DamageWarning, match="torn.mcap: .*; the scans are those before it"):
        recording = overtake.open(torn, race.path)
        scans = list(recording)
    assert recording.damage and recording.losses == "" and 3 * len(frames) - 2 <= len(scans) <= 3 * len(frames)


def test_a_map_without_poses_is_an_error(race):
    with pytest.raises(overtake.FileError, match="has no effect without ego poses"):
        overtake.run(race, map=race.path, ego="none")


def test_runs_tell_where_they_are(race):
    run = overtake.run(race, copy_labels=True, copy_images=True)
    frame = next(run)
    assert 0 < run.progress < 0.5 and run.stats["frames"] >= 1 and len(run.hash) == 16
    assert len(frame.labels("left")) > 10_000 and frame.image("labels", "left").max() > 0
    rest = list(run)
    assert run.progress == 1 and run.stats["frames"] == 1 + len(rest) == race.frame_count
    assert list(run) == []
    assert 'preset = "best"' in run.config


def test_banking_of_the_opposite_sign_is_turned_round(race, tmp_path):
    track = overtake.load_map(race.path)
    rows = numpy.column_stack([track.x_m, track.y_m, track.width_right_m, track.width_left_m, -track.banking_rad])
    path = tmp_path / "minus.csv"
    numpy.savetxt(path, rows, delimiter=",", header="x_m,y_m,w_tr_right_m,w_tr_left_m,banking_rad", comments="")
    with pytest.warns(UserWarning, match="minus.csv: its banking has the opposite sign"):
        turned = overtake.load_map(path)
    assert numpy.array_equal(turned.banking_rad, track.banking_rad) and track.banking_rad.max() > 0.1
    with pytest.warns(UserWarning, match="minus.csv: its banking has the opposite sign"):
        for _ in overtake.run(race, map=path):
            pass


def test_columns_that_are_not_read_are_named(race, tmp_path):
    (tmp_path / "ego.csv").write_text("stamp_ns,x_m,y_m,yaw_rad,sped_mps\n0,0,0,0,9\n1000000000,9,0,0,9\n")
    with pytest.warns(UserWarning, match="ego.csv has a column that is not read: sped_mps"):
        overtake.open(race, ego=tmp_path / "ego.csv")


def test_rigs_and_maps(race, tmp_path):
    rig = overtake.load_rig("racecar")
    assert [sensor.name for sensor in rig.sensors] == ["front", "left", "right"] and rig.period_s == 0.05
    track = overtake.load_map(race.path)
    assert len(track.x_m) == len(track.width_left_m) > 100 and track.closed
    with overtake.Detector(rig, map=track) as detector:
        assert detector.params["frame.period_s"] == 0.05
    with overtake.Detector(rig, map={"x_m": [0, 100, 200], "y_m": [0, 0, 10], "width_left_m": [5] * 3,
                                     "width_right_m": [5] * 3, "closed": False}):
        pass
    with pytest.raises(overtake.FileError, match="did you mean 'racecar'"):
        overtake.load_rig("racecra")
    with pytest.raises(ValueError, match="banking_rad is beyond 1 rad"):
        overtake.Detector(rig, map=dataclasses.replace(track, banking_rad=track.banking_rad * 57.3))
    with pytest.raises(TypeError, match="map is a int"):
        overtake.Detector(rig, map=3)
