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
