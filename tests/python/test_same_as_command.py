# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Detections and tracks of overtake.run, and of a Detector that is fed from overtake.open, equal those of
# `overtake run`: on every recording of OVERTAKE_DATA and on a simulated race, with both presets.
import csv
import os
import pathlib
import subprocess

import numpy
import pytest

import overtake

DATA = os.environ.get("OVERTAKE_DATA", "")
RECORDINGS = {"racecar": "av21", "kitti": "hdl64", "nuscenes": "nuscenes", "av2": "av2",
              "formats/hesai_xt16.pcd": "hdl32", "formats/vlp32_compressed.pcd": "hdl32"}

# Columns of the CSV files with another name in Python, and the names of their values.
NAMES = {"points": "point_count", "class": "object_class"}
WORDS = {"heading_source": ["ref", "var"], "view": ["rear", "front", "side"], "class": ["unknown", "car", "debris"],
         "state": ["tentative", "confirmed"], "visibility": ["seen", "missed", "hidden", "own_shadow", "outside"]}
OF_THE_FRAME = {"frame", "name", "ahead_m", "left_m"}


def recordings():
    if not DATA or not pathlib.Path(DATA).is_dir():
        return [pytest.param(None, None, marks=pytest.mark.skip("no recorded data (OVERTAKE_DATA)"))]
    return [pytest.param(pathlib.Path(DATA) / name, rig, id=name) for name, rig in RECORDINGS.items()]


def values_of(table, column):
    if column in ("var_x", "var_y") and isinstance(table, overtake.Tracks):
        axis = "xy".index(column[-1])
        return table.covariance[:, axis, axis]
    return getattr(table, NAMES.get(column, column))


def check_rows(path, tables):
    """tables: number and table of each frame. The file has their rows, in this order, with the same numbers."""
    with open(path) as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(table) for _, table in tables)
    numbers = [number for number, table in tables for _ in range(len(table))]
    assert [int(row["frame"]) for row in rows] == numbers
    compared = 0
    for column in rows[0] if rows else []:
        if column in OF_THE_FRAME:
            continue
        stamps = column == "stamp_ns" and isinstance(tables[0][1], overtake.Tracks)
        ours = (numpy.concatenate([numpy.full(len(table), table.publish_ns) for _, table in tables]) if stamps else
                numpy.concatenate([values_of(table, column) for _, table in tables]))
        words = WORDS.get(column)
        theirs = [words.index(row[column]) if words else row[column] for row in rows]
        assert numpy.array_equal(ours, numpy.array(theirs).astype(ours.dtype)), column
        compared += 1
    return compared


def run_command(program, out, path, *options):
    done = subprocess.run([program, "run", path, "--out", out, *options], check=True, capture_output=True, text=True)
    return next(line.split()[-1] for line in done.stdout.splitlines() if line.startswith("Hash of all"))


def compare(program, tmp_path, path, rig, preset):
    options = ["--preset", preset] + (["--rig", rig] if rig else [])
    printed = run_command(program, tmp_path / "out", path, *options)
    run = overtake.run(path, rig=rig, preset=preset)
    frames = list(run)
    assert run.hash == printed and len(frames) > 0
    compared = check_rows(tmp_path / "out" / "detections.csv", [(f.number, f.detections) for f in frames])
    compared += check_rows(tmp_path / "out" / "tracks.csv", [(f.number, f.tracks) for f in frames])

    # The same from the parts: Detector, open.
    own = rig is None
    with overtake.Detector(path if own else rig, preset, path if own else None, keep_images=False,
                           every_frame=True) as detector:
        for scan in overtake.open(path, rig):
            detector.push(scan)
        detector.flush()
        again = list(detector.frames())
    assert len(again) == len(frames)
    for one, other in zip(frames, again):
        for ours, theirs in ((one.detections, other.detections), (one.tracks, other.tracks)):
            assert {n: c.tobytes() for n, c in ours.to_dict().items()} == {
                n: c.tobytes() for n, c in theirs.to_dict().items()}
    return compared


@pytest.mark.parametrize("preset", overtake.preset_names)
@pytest.mark.parametrize("path, rig", recordings())
def test_recordings(program, tmp_path, path, rig, preset):
    if not path.exists():
        pytest.skip(f"no {path}")
    compare(program, tmp_path, path, rig, preset)


@pytest.mark.skipif(not DATA or not pathlib.Path(DATA).is_dir(), reason="no recorded data (OVERTAKE_DATA)")
def test_no_recording_is_left_out(program):
    folders = {pathlib.Path(DATA) / name for name in RECORDINGS}
    compared = 0
    for path in sorted(pathlib.Path(DATA).rglob("*")):
        if path in folders or path.parent in folders and path.is_file():
            compared += 1
            continue
        if any(folder.is_relative_to(path) for folder in folders):
            continue       # the folder of several recordings
        done = subprocess.run([program, "info", path], capture_output=True, text=True)
        assert done.returncode == 1 and "holds no recording" in done.stderr, f"{path} is not compared: {done.stdout}"
    assert compared > 0


@pytest.mark.parametrize("preset", overtake.preset_names)
def test_a_simulated_race(program, tmp_path, race, preset):
    assert compare(program, tmp_path, race.path, None, preset) > 20


def test_parameters_workers_and_pieces(program, tmp_path, race):
    printed = run_command(program, tmp_path / "out", race.path, "--set", "tracker.confirm_hits=4", "--set",
                          "gate.min_points=7", "--map", "none", "--preset", "paper")
    params = {"tracker.confirm_hits": 4, "gate.min_points": 7}
    for options in ({"params": params, "preset": "paper"}, {"params": params, "preset": "paper", "workers": 2},
                    {"params": params, "preset": "paper", "stream": True},
                    {"config": tmp_path / "out" / "config.toml"}):
        run = overtake.run(race, map="none", **options)
        assert len(list(run)) > 30 and run.hash == printed, options
    whole = overtake.Params("paper")
    whole.update(params)
    run = overtake.run(race, map="none", params=whole)
    list(run)
    assert run.hash == printed


def test_a_last_frame_that_waits_for_a_sensor(program, tmp_path):
    folder = tmp_path / "race"
    race = overtake.simulate("demo", 1, folder, seconds=0.3)
    (folder / f"{race.frame_count - 1:06d}_right.pcd").unlink()
    printed = run_command(program, tmp_path / "out", folder)
    run = overtake.run(folder)
    frames = list(run)
    assert [len(frame.sensors) for frame in frames] == [3] * (race.frame_count - 1) + [2] and run.hash == printed


def test_the_log_of_a_race_is_that_of_the_command(program, tmp_path, race):
    subprocess.run([program, "simulate", "overtake", "--seed", "7", "--seconds", "2", "--quiet", "--out",
                    tmp_path / "race.mcap"], check=True)
    assert (tmp_path / "race.mcap").read_bytes() == pathlib.Path(race.path).read_bytes()
