# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Frames, their tables and arrays: values, and how long they live. tests/test_python.sh runs this file under the address
# sanitizer, too, in builds with it.
import gc
import sys
import weakref

import numpy
import pytest

import overtake
from conftest import a_sensor, car_tail, in_a_forked_child, push_tails


def table_of_every_kind(frame):
    return [frame.detections, frame.tracks, frame.clusters, frame.labels("front")]


def arrays_of(frame):
    arrays = [frame.image(name) for name in ("range", "labels", "pixel_point", "nonground")]
    for table in table_of_every_kind(frame):
        arrays += [getattr(table, name) for name in table.columns if getattr(table, name) is not None]
    return arrays


def test_values_of_a_frame(detector):
    push_tails(detector)
    frame = detector.next_frame()
    assert frame.sequence == frame.number == 19 and frame.stamp_ns == 19 * 50_000_000
    assert frame.sensors == ["front"] and frame.sensor_mask == 1
    assert overtake.Flag.NO_EGO in frame.flags and overtake.Flag.NO_MAP in frame.flags
    assert frame.detection_count == len(frame.detections) == 1
    assert frame.track_count == len(frame.tracks) == 1
    assert frame.point_count == len(frame.labels()) == 360
    assert abs(frame.detections.x_m[0] - 31.8) < 0.3
    assert frame.tracks.state.tolist() == [overtake.TrackState.CONFIRMED]
    assert abs(frame.tracks.speed_mps[0] - 10) < 1
    assert frame.detections.track[0] == frame.tracks.id[0]
    labels = frame.labels("front")
    assert labels.label_count == 1 and labels.cluster_of_label.shape == (2,)
    assert numpy.array_equal(labels.layer, car_tail()["layer"]) and numpy.array_equal(labels.y_m, car_tail()["y"])
    assert frame.image("range").shape == (32, 857) and frame.image("range").dtype == numpy.float32
    assert frame.image("nonground").dtype == bool and frame.image("nonground").sum() > 100
    assert (frame.image("labels") == 1).sum() == (frame.image("nonground_repaired")).sum()
    assert frame.times()["frame"] > 0 and frame.times("front")["segment"] > 0
    assert "<overtake.Frame 19: 1 detections, 1 tracks>" == repr(frame)
    assert detector.next_frame() is None


def test_tables_as_dicts(detector):
    push_tails(detector)
    frame = detector.next_frame()
    tracks = frame.tracks.to_dict()
    assert set(tracks) == set(frame.tracks.columns)
    path_points = frame.tracks.path_points
    assert path_points > 0 and tracks["path_x_m"].shape == (1, path_points)
    covariance = tracks["covariance"]
    assert covariance.shape == (1, 5, 5) and numpy.array_equal(covariance[0], covariance[0].T)
    assert numpy.linalg.eigvalsh(covariance[0]).min() > 0
    for name, column in frame.detections.to_dict().items():
        assert column.flags.writeable and column.base is None, name
        assert len(column) == 1


def test_pandas(detector):
    pandas = pytest.importorskip("pandas")
    push_tails(detector)
    frame = detector.next_frame()
    table = frame.tracks.to_pandas()
    assert isinstance(table, pandas.DataFrame) and len(table) == 1
    assert table["speed_mps"][0] == frame.tracks.speed_mps[0] and "path_x_m" not in table
    assert len(frame.labels().to_pandas()) == 360


def test_columns_that_a_preset_does_not_compute_are_none():
    with overtake.Detector(a_sensor(), preset="paper") as detector:
        push_tails(detector, 3)
        frame = detector.next_frame()
        assert frame.detections.var_x is None and "var_x" not in frame.detections.to_dict()
        assert frame.tracks.existence is None
        with pytest.raises(overtake.NotComputedError):
            frame.image("height")
    with overtake.Detector(a_sensor(), preset="best") as detector:
        detector.push_scan({name: column[:0] for name, column in car_tail().items()}, 0)
        assert detector.next_frame().detections.var_x.shape == (0,)


def test_arrays_are_read_only(detector):
    push_tails(detector, 3)
    for array in arrays_of(detector.next_frame()):
        with pytest.raises(ValueError):
            array[...] = 0
        assert not array.flags.owndata


def test_arrays_keep_their_frame_while_the_detector_goes_on():
    detector = overtake.Detector(a_sensor(), preset="best", frame_capacity=2)
    push_tails(detector, 3)
    frame = detector.next_frame()
    arrays = arrays_of(frame)
    before = [array.copy() for array in arrays]
    del frame
    gc.collect()
    push_tails(detector, 30, first=3)
    assert detector.next_frame().sequence == 32
    detector.close()
    del detector
    gc.collect()
    for array, copy in zip(arrays, before):
        assert array.tobytes() == copy.tobytes()


def test_tables_keep_their_frame():
    with overtake.Detector(a_sensor(), preset="best", frame_capacity=1) as detector:
        push_tails(detector, 3)
        detections = detector.next_frame().detections
        x_m = detections.x_m.copy()
        push_tails(detector, 10, first=3)
        with pytest.raises(overtake.TooManyError):
            detector.next_frame()
    assert detections.x_m.tobytes() == x_m.tobytes()


def test_a_released_frame_and_its_tables_raise(detector):
    push_tails(detector, 3)
    frame = detector.next_frame()
    tables = table_of_every_kind(frame)
    x_m, ranges, copies = frame.detections.x_m, frame.image("range"), frame.detections.x_m.copy()
    frame.release()
    assert frame.released
    for use in (lambda: frame.detections, lambda: frame.tracks, lambda: frame.clusters, lambda: frame.labels(),
                lambda: frame.image("range"), lambda: frame.times(), lambda: frame.tracks_at(10**9)):
        with pytest.raises(overtake.ReleasedError, match="was released"):
            use()
    for table in tables:
        for name in table.columns:
            with pytest.raises(overtake.ReleasedError):
                getattr(table, name)
        with pytest.raises(ValueError):
            table.to_dict()
    frame.release()
    push_tails(detector, 30, first=3)
    assert x_m.tobytes() == copies.tobytes() and ranges.shape == (32, 857)


def test_a_frame_is_a_context():
    with overtake.Detector(a_sensor(), frame_capacity=1) as detector:
        for k in range(5):
            push_tails(detector, 1, first=k)
            with detector.next_frame() as frame:
                assert frame.sequence == k
            assert frame.released


def test_arrays_hold_the_slot_of_a_released_frame():
    with overtake.Detector(a_sensor(), preset="best", frame_capacity=1) as detector:
        push_tails(detector, 3)
        frame = detector.next_frame()
        x_m = frame.detections.x_m
        part = x_m[:1]
        frame.release()
        push_tails(detector, 1, first=3)
        with pytest.raises(overtake.TooManyError, match="all 1 frames of frame_capacity are held"):
            detector.next_frame()
        del x_m
        with pytest.raises(overtake.TooManyError):
            detector.next_frame()
        del part
        assert detector.next_frame().sequence == 3


@pytest.mark.parametrize("take", [
    lambda frame: frame.tracks.x_m, lambda frame: frame.tracks.covariance, lambda frame: frame.tracks.path_x_m[0, :2],
    lambda frame: frame.tracks_at(frame.stamp_ns + 10**8).x_m, lambda frame: frame.image("nonground"),
    lambda frame: frame.labels().x_m, lambda frame: frame.clusters.center_x_m, lambda frame: frame.image("labels"),
], ids=["tracks", "covariance", "path", "tracks_at", "bits", "labels", "clusters", "image"])
def test_every_array_holds_its_frame(take):
    with overtake.Detector(a_sensor(), preset="best", frame_capacity=1) as detector:
        push_tails(detector, 10)
        frame = detector.next_frame()
        array = take(frame)
        before = array.tobytes()
        assert len(before) > 0
        frame.tracks_at(frame.stamp_ns + 10**9)     # uses the reader's memory again
        frame.release()
        del frame
        push_tails(detector, 10, first=10)
        with pytest.raises(overtake.TooManyError, match="all 1 frames of frame_capacity are held"):
            detector.next_frame()
        assert array.tobytes() == before
        del array
        assert detector.next_frame().sequence == 19


def test_copies_hold_no_frame():
    with overtake.Detector(a_sensor(), preset="best", frame_capacity=1) as detector:
        kept = []
        for k in range(10):
            push_tails(detector, 1, first=k)
            frame = detector.next_frame()
            kept.append((frame.tracks.to_dict(), frame.detections.to_dict(), frame.image("nonground").copy()))
            frame.release()
        ahead = [tracks["x_m"][0] for tracks, _, _ in kept if len(tracks["x_m"])]
        assert len(ahead) > 5 and ahead == sorted(ahead)


def test_frames_are_not_given_twice():
    with overtake.Detector(a_sensor(), preset="best") as detector:
        push_tails(detector, 1)
        first = detector.next_frame()
        assert detector.next_frame() is None
        push_tails(detector, 2, first=1)
        second = detector.next_frame()
        assert (first.sequence, second.sequence) == (0, 2)
        first.release()
        del first
        assert detector.next_frame() is None


def test_tracks_at_another_time(detector):
    push_tails(detector)
    frame = detector.next_frame()
    now = frame.tracks
    x_m = now.x_m.copy()
    later = frame.tracks_at(frame.stamp_ns + 1_000_000_000)
    assert abs(later.x_m[0] - x_m[0] - 10) < 1 and later.publish_ns == frame.stamp_ns + 1_000_000_000
    assert now.x_m.tobytes() == frame.tracks.x_m.tobytes() == x_m.tobytes()


def test_path_horizon():
    with overtake.Detector(a_sensor(), path_horizon_s=0) as detector:
        push_tails(detector, 3)
        tracks = detector.next_frame().tracks
        assert tracks.path_points == 0 and tracks.path_x_m.shape == (len(tracks), 0)
    with overtake.Detector(a_sensor(), path_horizon_s=numpy.float32(0.5), every_frame=True) as detector:
        push_tails(detector, 3)
        tracks = detector.next_frame().tracks
        assert tracks.path_points * tracks.path_step_s == pytest.approx(0.5)
    most_s = overtake.Params("best").tracker.horizon_s
    for wrong in (-0.5, float("nan"), most_s + 0.1):
        with pytest.raises(ValueError, match=f"path_horizon_s is {wrong}; 0 to {most_s:g} s"):
            overtake.Detector(a_sensor(), path_horizon_s=wrong)
    with pytest.raises(TypeError, match="path_horizon_s is 'far'; a number is needed"):
        overtake.Detector(a_sensor(), path_horizon_s="far")


def test_frames_that_were_copied_are_given_after_close():
    detector = overtake.Detector(a_sensor(), every_frame=True)
    push_tails(detector, 2)
    detector.close()
    assert [detector.next_frame().sequence for _ in range(2)] == [0, 1]
    with pytest.raises(overtake.ReleasedError, match="closed"):
        detector.next_frame()


def test_every_frame_comes_in_order_as_a_copy():
    detector = overtake.Detector(a_sensor(), preset="best", workers=2, every_frame=True, copy_labels=True)
    push_tails(detector, 40)
    detector.flush()
    frames = list(detector.frames())
    assert [frame.sequence for frame in frames] == list(range(40))
    detector.close()
    with pytest.raises(overtake.ReleasedError, match="closed"):
        detector.next_frame()
    assert all(len(frame.labels("front")) == 360 for frame in frames)
    assert [len(frame.tracks) for frame in frames][-1] == 1
    with pytest.raises(overtake.NotKeptError, match="copy_images=True"):
        frames[0].image("range")
    with pytest.raises(overtake.NotKeptError, match="the tracks at its stamp only"):
        frames[0].tracks_at(10**9)


def test_copied_images_equal_those_of_the_reader(detector):
    with overtake.Detector(a_sensor(), preset="best", every_frame=True, copy_labels=True, copy_images=True) as copier:
        push_tails(copier, 3)
        push_tails(detector, 3)
        *_, copied = copier.frames()
        frame = detector.next_frame()
        push_tails(copier, 20, first=3)  # reuses the memory that was copied
        for one, other in zip(arrays_of(copied), arrays_of(frame)):
            assert one.tobytes() == other.tobytes()
        assert frame.clusters.to_pandas().equals(copied.clusters.to_pandas())


def test_labels_without_copies_say_how_to_get_them():
    with overtake.Detector(a_sensor(), every_frame=True) as detector:
        push_tails(detector, 1)
        with pytest.raises(overtake.NotKeptError, match="copy_labels=True"):
            detector.next_frame().labels()


def test_wrong_names_list_the_right_ones(detector):
    push_tails(detector, 1)
    frame = detector.next_frame()
    with pytest.raises(overtake.UnknownNameError, match="no image 'rnage' .*range_filled"):
        frame.image("rnage")
    with pytest.raises(overtake.UnknownNameError, match="no sensor 'back'"):
        frame.labels("back")
    with overtake.Detector([a_sensor(), a_sensor(name="left")]) as two:
        push_tails(two, 2)
        with pytest.raises(overtake.NoFrameError, match="labels of sensor 'left'"):
            two.next_frame().labels("left")


def test_a_closed_detector_raises():
    detector = overtake.Detector(a_sensor())
    push_tails(detector, 1)
    frame = detector.next_frame()
    detector.close()
    detector.close()
    assert detector.closed
    for use in (lambda: detector.push_scan(car_tail(), 10**9), lambda: detector.next_frame(), lambda: detector.stats,
                lambda: detector.flush(), lambda: detector.push_ego_pose(0, 0, 0, 0, 0), lambda: detector.advance(0),
                lambda: detector.push_detections(0, [], []), lambda: detector.end_scan(0)):
        with pytest.raises(overtake.ReleasedError, match="closed"):
            use()
    assert frame.detections.x_m.shape == (frame.detection_count,)


def test_reference_counts_do_not_grow(detector):
    points = car_tail()
    push_tails(detector, 5)

    def counts():
        gc.collect()
        return [sys.getrefcount(column) for column in points.values()] + [sys.getrefcount(points)]

    before = counts()
    for k in range(5, 105):
        detector.push_scan(points, k * 50_000_000)
        with detector.next_frame() as frame:
            arrays_of(frame)
        with pytest.raises(TypeError):
            detector.push_scan({**points, "x": None, "layer": "text"}, 0)
    assert counts() == before


def test_objects_die_without_the_garbage_collector():
    class Owner(numpy.ndarray):
        pass

    gc.disable()
    try:
        detector = overtake.Detector(a_sensor())
        points = {**car_tail(), "x": car_tail()["x"].view(Owner)}
        died = weakref.ref(points["x"])
        detector.push_scan(points, 0)
        del points
        assert died() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("options", [{}, {"workers": 2}, {"every_frame": True}, {"workers": 2, "every_frame": True}],
                         ids=["latest", "workers", "every_frame", "every_frame and workers"])
def test_a_forked_child_raises_instead_of_reading(options):
    with overtake.Detector(a_sensor(), preset="best", **options) as detector:
        push_tails(detector, 2)
        detector.flush()
        frame = detector.next_frame()
        tracks, before = frame.tracks, frame.sequence
        calls = [lambda: detector.flush(), lambda: detector.next_frame(), lambda: next(detector.frames()),
                 lambda: detector.push_scan(car_tail(), 10**9), lambda: detector.push_points(car_tail(), 10**9),
                 lambda: detector.end_scan(10**9), lambda: detector.push_ego_pose(0, 0, 0, 0, 0),
                 lambda: detector.push_detections(0, [], []), lambda: detector.advance(0), lambda: detector.stats,
                 lambda: detector.runtime_info, lambda: frame.detections, lambda: frame.labels(),
                 lambda: frame.image("range"), lambda: tracks.x_m, lambda: tracks.to_dict()]
        told = in_a_forked_child(*calls)
        assert len(told) == len(calls)
        for line in told:
            assert line.startswith("ReleasedError: this process was forked"), line
        # A child may give them up, or use a detector of its own.
        assert in_a_forked_child(frame.release, detector.close, gc.collect,
                                 lambda: push_tails(overtake.Detector(a_sensor()), 2)) == ["returned"] * 4
        push_tails(detector, 2, first=2)
        detector.flush()
        *_, last = detector.frames()
        assert last.sequence == 3 > before and not detector.closed
