# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# What sensors do in practice, on simulated races: dirt on a window, intensities that are signals.
import math

import numpy
import pytest

import overtake


def frames_of(race, preset="best", change=None):
    detector = overtake.Detector(rig=overtake.load_rig(race.path), map=overtake.load_map(race.path), preset=preset,
                                 every_frame=True, frame_capacity=64)
    for scan in overtake.open(race):
        for pose in scan.ego_poses:
            detector.push_ego_pose(**pose)
        if change:
            detector.push_scan(change(scan), scan.stamp_ns, scan.sensor)
        else:
            detector.push(scan)
        yield from detector.frames()
    detector.flush()
    yield from detector.frames()


def place_in(table, time_s):
    """The places in the map of the cars but the ego at that time: an array of rows (x, y)."""
    stamps = numpy.array(table["stamp_ns"])
    at = stamps == stamps[numpy.argmin(abs(stamps - time_s))]
    at &= ~numpy.array(table["is_ego"], bool)
    return numpy.stack([numpy.array(table["x_m"])[at], numpy.array(table["y_m"])[at]], axis=1)


def test_dirt_on_a_window_is_told_and_ends_no_track():
    race = overtake.simulate("dirty_window", seed=1, seconds=6)
    ids, blocked, begin_ns = [], [], None
    for frame in frames_of(race):
        begin_ns = frame.stamp_ns if begin_ns is None else begin_ns
        time_s = (frame.stamp_ns - begin_ns) / 1e9
        is_told = overtake.Flag.VIEW_BLOCKED in frame.flags
        assert is_told == (frame.blocked_mask != 0)
        blocked.append((time_s, frame.blocked_mask))
        if 0.4 < time_s < 2.9 or 5.1 < time_s:
            assert frame.blocked_mask == 2, time_s  # the left sensor is dirty from the start
            assert frame.blocked_sensor == 1
            assert math.degrees(frame.blocked_rad) == pytest.approx(6, abs=1)
            assert math.degrees(frame.blocked_left_rad) == pytest.approx(13, abs=0.6)
        if 3.4 < time_s < 4.9:
            assert frame.blocked_mask == 3, time_s
            assert frame.blocked_sensor == 0
            assert math.degrees(frame.blocked_rad) == pytest.approx(9, abs=1)
            assert math.degrees(frame.blocked_left_rad) == pytest.approx(4.5, abs=0.6)
        tracks = frame.tracks
        confirmed = numpy.flatnonzero(tracks.state == overtake.TrackState.CONFIRMED)
        cars = place_in(race.truth, frame.stamp_ns)
        ahead = cars[0]  # the opponent
        near = [i for i in confirmed if math.hypot(tracks.x_m[i] - ahead[0], tracks.y_m[i] - ahead[1]) < 5]
        if time_s > 1:
            assert len(near) == 1, time_s
            ids.append(tracks.id[near[0]])
            if 3.2 < time_s < 4.9:
                assert tracks.visibility[near[0]] in (overtake.Visibility.MISSED, overtake.Visibility.OUTSIDE)
            if 3.4 < time_s < 4.9:
                assert tracks.visibility[near[0]] == overtake.Visibility.OUTSIDE
                assert overtake.TrackFlag.UNOBSERVED in overtake.TrackFlag(int(tracks.flags[near[0]]))
    assert len(ids) > 80 and len(set(ids)) == 1
    assert all(mask == 0 for time_s, mask in blocked if time_s < 0.2)


def test_the_paper_looks_for_no_dirt():
    race = overtake.simulate("dirty_window", seed=1, seconds=1)
    for frame in frames_of(race, "paper"):
        assert overtake.Flag.VIEW_BLOCKED not in frame.flags and frame.blocked_rad == 0


def compensate(scan, rig, poses, to_s):
    """The points as the sensor would see them to_s after the scan's stamp."""
    mounting = rig.sensors[[sensor.name for sensor in rig.sensors].index(scan.sensor)]
    points = {name: numpy.array(column) for name, column in dict(scan.points).items()}
    at_s = (scan.stamp_ns - poses[0]["stamp_ns"]) / 1e9
    stamps_s = numpy.array([pose["stamp_ns"] - poses[0]["stamp_ns"] for pose in poses]) / 1e9
    place = {name: numpy.array([pose[name] for pose in poses]) for name in ("x_m", "y_m", "yaw_rad")}
    place["yaw_rad"] = numpy.unwrap(place["yaw_rad"])

    def pose_at(time_s):
        return [numpy.interp(time_s, stamps_s, place[name]) for name in ("x_m", "y_m", "yaw_rad")]

    c, s = math.cos(mounting.yaw_rad), math.sin(mounting.yaw_rad)
    x = mounting.x_m + c * points["x"] - s * points["y"]
    y = mounting.y_m + s * points["x"] + c * points["y"]
    from_x, from_y, from_yaw = pose_at(at_s + points["time"] * 1e-9)
    map_x = from_x + numpy.cos(from_yaw) * x - numpy.sin(from_yaw) * y
    map_y = from_y + numpy.sin(from_yaw) * x + numpy.cos(from_yaw) * y
    to_x, to_y, to_yaw = pose_at(at_s + to_s)
    x = numpy.cos(to_yaw) * (map_x - to_x) + numpy.sin(to_yaw) * (map_y - to_y) - mounting.x_m
    y = numpy.cos(to_yaw) * (map_y - to_y) - numpy.sin(to_yaw) * (map_x - to_x) - mounting.y_m
    points["x"], points["y"] = (c * x + s * y).astype("f4"), (c * y - s * x).astype("f4")
    return points


@pytest.mark.parametrize("to_s", [None, 0.0, 0.05])
def test_clouds_that_the_driver_compensated(to_s):
    race = overtake.simulate("overtake", seed=2, seconds=2)
    rig, poses = overtake.load_rig(race.path), [pose for scan in overtake.open(race) for pose in scan.ego_poses]
    errors = {}
    for told in {None, to_s}:
        for sensor in rig.sensors:
            sensor.compensated_to_s = told
        detector = overtake.Detector(rig=rig, map=overtake.load_map(race.path), preset="best", every_frame=True,
                                     frame_capacity=64)
        found = errors.setdefault(told, [])

        def look():
            for frame in detector.frames():
                if frame.ego_speed_mps < 30:
                    continue
                tracks = frame.tracks
                cars = place_in(race.truth, frame.stamp_ns)
                for i in numpy.flatnonzero(tracks.state == overtake.TrackState.CONFIRMED):
                    found.append(numpy.min(numpy.hypot(*(cars - (tracks.x_m[i], tracks.y_m[i])).T)))

        for scan in overtake.open(race):
            for pose in scan.ego_poses:
                detector.push_ego_pose(**pose)
            points = scan.points if to_s is None else compensate(scan, rig, poses, to_s)
            detector.push_scan(points, scan.stamp_ns, scan.sensor)
            look()
        detector.flush()
        look()
        assert len(found) > 25
    assert numpy.median(errors[to_s]) < 0.35
    if to_s is not None:
        assert numpy.median(errors[None]) > 0.8  # not told


@pytest.mark.parametrize("power", [0, -2])
def test_intensities_that_are_signals_make_no_smoke(power):
    race = overtake.simulate("las_vegas_15", seed=1, seconds=2)

    def as_signal(scan):
        points = {name: numpy.array(column) for name, column in dict(scan.points).items()}
        range_m = numpy.sqrt(points["x"]**2 + points["y"]**2 + points["z"]**2)
        points["intensity"] = (points["intensity"] * (range_m / 10)**power).astype("f4")
        return points

    seen = frames = 0
    for frame in frames_of(race, change=as_signal):
        ahead = place_in(race.truth, frame.stamp_ns)[0] - (frame.ego_x_m, frame.ego_y_m)
        range_m = math.hypot(*ahead)
        detections = frame.detections
        frames += 1
        seen += any(abs(math.hypot(x, y) - range_m) < 3 for x, y in zip(detections.x_m, detections.y_m))
    assert frames > 35 and seen >= 0.95 * frames
