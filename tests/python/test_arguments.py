# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# What push_scan takes, and how it refuses the rest.
import array
import re
import tracemalloc

import numpy
import pytest

import overtake
from conftest import a_sensor, car_tail, push_tails

ORDER = ("x", "y", "z", "intensity", "layer")


def results(points, fields=None, time_unit_ns=1.0):
    """All detections and points that 3 scans of these points give."""
    with overtake.Detector(a_sensor(), preset="best") as detector:
        for k in range(3):
            status = detector.push_scan(points, k * 50_000_000, "front", fields=fields, time_unit_ns=time_unit_ns)
            assert status is overtake.Status.OK
        frame = detector.next_frame()
        assert len(frame.detections) == 1
        values = {**frame.detections.to_dict(), **frame.labels().to_dict()}
    return {name: column.tobytes() for name, column in values.items()}


def matrix(dtype="f4", order="C"):
    tail = car_tail()
    return numpy.asarray(numpy.column_stack([tail[name] for name in ORDER]), dtype=dtype, order=order)


def records(dtype=None, align=True):
    tail = car_tail()
    dtype = dtype or numpy.dtype([("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", "f4"), ("ring", "u2")],
                                 align=align)
    out = numpy.zeros(360, dtype)
    for name in dtype.names:
        out[name] = tail.get(name, tail["layer"])
    return out


def at_odd_address(values):
    copy = numpy.zeros(values.nbytes + 1, "u1")[1:].view(values.dtype)
    copy[:] = values
    return copy


def spread(column, step):
    wide = numpy.zeros(len(column) * step, column.dtype)
    wide[::step] = column
    return wide[::step]


def overlapping(column):
    return numpy.lib.stride_tricks.as_strided(column, (360,), (2,))


def c_records():
    """Records in a buffer that is no NumPy array."""
    wide = records()
    return memoryview(wide)


LAYOUTS = {
    "rows": lambda: (matrix(), None),
    "columns": lambda: (matrix(order="F"), None),
    "rows of a wider array": lambda: (numpy.hstack([matrix(), matrix()])[:, :5], None),
    "every other row": lambda: (numpy.repeat(matrix(), 2, axis=0)[::2], None),
    "transposed": lambda: (numpy.ascontiguousarray(matrix().T).T, None),
    "other fields": lambda: (numpy.hstack([matrix()[:, [4, 2, 1, 0, 3]], matrix()[:, :1]]),
                             ("layer", "z", "y", "x", "intensity", None)),
    "structured": lambda: (records(), None),
    "structured, every other one": lambda: (numpy.repeat(records(), 2)[::2], None),
    "structured in a memoryview": lambda: (c_records(), None),
    "packed records": lambda: (records(align=False), None),
    "packed records at an odd address": lambda: (at_odd_address(records(align=False)), None),
    "dict": lambda: (car_tail(), None),
    "dict of strided columns": lambda: ({name: spread(column, 3) for name, column in car_tail().items()}, None),
    "dict of array.array": lambda: ({**car_tail(), "x": array.array("f", car_tail()["x"])}, None),
    "dict with a time of zero": lambda: ({**car_tail(), "time": numpy.zeros(360, "u4")}, None),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_results(layout):
    points, fields = LAYOUTS[layout]()
    assert results(points, fields) == results(car_tail())


@pytest.mark.parametrize("dtype", ["f8", "i1", "u1", "i2", "u2", "i4", "u4", "f4"])
def test_types_of_layers(dtype):
    tail = {**car_tail(), "layer": car_tail()["layer"].astype(dtype)}
    assert results(tail) == results(car_tail())


def test_time_moves_the_stamp_of_a_detection():
    late = {**car_tail(), "time": numpy.full(360, 2.0, "f4")}
    with overtake.Detector(a_sensor(), preset="best") as detector:
        detector.push_scan(late, 1000, time_unit_ns=1e6)
        assert detector.next_frame().detections.stamp_ns.tolist() == [2_001_000]


def test_a_push_copies_nothing_in_python():
    big = numpy.zeros((27_000, 5), "f4")
    big[:, 0] = 30
    columns = {name: numpy.ascontiguousarray(big[:, k]) for k, name in enumerate(ORDER)}
    with overtake.Detector(a_sensor(), preset="paper", keep_images=False) as detector:
        for points in (big, columns, big[::2]):
            detector.push_scan(points, 0)
            tracemalloc.start()
            detector.push_scan(points, 50_000_000)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            assert peak < 10_000


WRONG = {
    "a list": (lambda: [[1, 2, 3, 4, 5]], TypeError, "points is a list; an array is needed"),
    "bytes": (lambda: b"1234", TypeError, "points is a bytes"),
    "one dimension": (lambda: matrix()[:, 0], ValueError, r"points has shape \(360,\); \(n, k\) is needed"),
    "three dimensions": (lambda: matrix()[None], ValueError, r"points has shape \(1, 360, 5\)"),
    "too few columns": (lambda: matrix()[:, :4], ValueError,
                        r"points has 4 columns, but fields names 5 \(x, y, z, intensity, layer\)"),
    "matrix of integers": (lambda: matrix("i4"), TypeError, "x is int32; float32 or float64 is needed"),
    "matrix of halves": (lambda: matrix("f2"), TypeError, "x is float16"),
    "reversed rows": (lambda: matrix()[::-1], ValueError, "x has a stride of -20 bytes"),
    "repeated row": (lambda: numpy.broadcast_to(matrix()[:1], (360, 5)), ValueError, "x has a stride of 0 bytes"),
    "long layer": (lambda: {**car_tail(), "layer": numpy.zeros(360, "i8")}, TypeError, "layer is int64"),
    "boolean intensity": (lambda: {**car_tail(), "intensity": numpy.zeros(360, "?")}, TypeError, "intensity is bool"),
    "big-endian": (lambda: {**car_tail(), "z": car_tail()["z"].astype(">f4")}, TypeError, "z is big-endian float32"),
    "complex": (lambda: {**car_tail(), "y": car_tail()["y"].astype("c8")}, TypeError, "y is complex64"),
    "text": (lambda: {**car_tail(), "y": numpy.zeros(360, "U3")}, TypeError, "y is dtype of kind 'U'"),
    "a mask": (lambda: numpy.ma.masked_array(matrix(), matrix() > 10), TypeError, "points is a masked array"),
    "a mask in a dict": (lambda: {**car_tail(), "z": numpy.ma.masked_array(car_tail()["z"])}, TypeError,
                         "z is a masked array"),
    "two dimensions in a dict": (lambda: {**car_tail(), "x": matrix()}, ValueError, r"x has shape \(360, 5\)"),
    "a list in a dict": (lambda: {**car_tail(), "z": [0.0] * 360}, TypeError, "z is a list"),
    "different lengths": (lambda: {**car_tail(), "z": numpy.zeros(359, "f4")}, ValueError,
                          "z has 359 points, x has 360"),
    "no layer": (lambda: {name: column for name, column in car_tail().items() if name != "layer"}, ValueError,
                 "points has no layer"),
    "no z": (lambda: records(numpy.dtype([("x", "f4"), ("y", "f4"), ("ring", "u2"), ("pad", "u2")])), ValueError,
             "points has no z"),
    "two layers": (lambda: {**car_tail(), "ring": car_tail()["layer"]}, ValueError, "points has two columns layer"),
    "unknown column": (lambda: {**car_tail(), "timestamp": numpy.zeros(360)}, ValueError,
                       "'timestamp' is none of x, y, z, layer or ring or line"),
    "overlapping values": (lambda: {**car_tail(), "x": overlapping(car_tail()["x"])}, ValueError,
                           "x has a stride of 2 bytes; at least 4"),
    "array field": (lambda: numpy.zeros(360, [("x", "f4"), ("y", "f4"), ("z", "f4", 2), ("ring", "u4")]), TypeError,
                    "z is dtype of kind 'V'"),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_points_raise_and_name_the_column(what, detector):
    make, error, sentence = WRONG[what]
    with pytest.raises(error, match=sentence):
        detector.push_scan(make(), 0)
    assert detector.stats["pushed"] == 0


@pytest.mark.parametrize("count", [0, 1])
def test_scans_of_no_point_and_of_one(count, detector):
    for points in (matrix()[:count], {name: column[:count] for name, column in car_tail().items()}, records()[:count],
                   numpy.broadcast_to(matrix()[:1], (1, 5))[:count]):
        stamp = detector.stats["pushed"] * 50_000_000
        assert detector.push_scan(points, stamp) is overtake.Status.OK
        assert detector.next_frame().point_count == count


def test_fields_are_checked(detector):
    with pytest.raises(ValueError, match="fields: 'rang' is none of"):
        detector.push_scan(matrix(), 0, fields=("x", "y", "z", "intensity", "rang"))
    with pytest.raises(ValueError, match="fields has no layer"):
        detector.push_scan(matrix()[:, :3], 0, fields=("x", "y", "z"))
    with pytest.raises(ValueError, match="fields has two columns layer"):
        detector.push_scan(matrix(), 0, fields=("x", "y", "z", "ring", "layer"))
    two = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("ring", "u2"), ("line", "u2")]
    with pytest.raises(ValueError, match="points has two columns layer"):
        detector.push_scan(records(numpy.dtype(two)), 0)


def test_sensors_by_name_and_index(detector):
    assert detector.push_scan(car_tail(), 0, 0) is overtake.Status.OK
    assert detector.push_scan(car_tail(), 50_000_000, "front") is overtake.Status.OK
    with pytest.raises(overtake.UnknownNameError, match=r"no sensor 'left' \(there is: 'front'\)"):
        detector.push_scan(car_tail(), 100_000_000, "left")
    with pytest.raises(LookupError, match="no sensor 1"):
        detector.push_scan(car_tail(), 100_000_000, 1)
    with pytest.raises(LookupError, match="no sensor -1"):
        detector.push_scan(car_tail(), 100_000_000, -1)


def test_what_becomes_of_a_scan_is_a_status(detector):
    assert detector.push_scan(car_tail(), numpy.int64(50_000_000)) is overtake.Status.OK
    assert detector.push_scan(car_tail(), 50_000_000) is overtake.Status.DUPLICATE
    assert detector.stats["dup"] == 1


def test_too_many_points_name_the_capacity():
    with overtake.Detector(a_sensor(point_capacity=100)) as detector:
        sentence = "360 points, but sensor 'front' has point_capacity 100"
        with pytest.raises(overtake.TooManyError, match=sentence) as error:
            detector.push_scan(car_tail(), 0)
        assert error.value.status is overtake.Status.TOO_MANY
        assert detector.stats["dropped"] == 1


def test_pieces_give_the_results_of_the_whole_scan(detector):
    push_tails(detector, 3)
    whole = detector.next_frame().detections.to_dict()
    with overtake.Detector(a_sensor(), preset="best") as other:
        for k in range(3):
            tail, stamp = car_tail(20 + 0.5 * k), k * 50_000_000
            for first in (0, 240, 120):
                piece = {name: column[first:first + 120] for name, column in tail.items()}
                assert other.push_points(piece, stamp, "front", first=first) is overtake.Status.OK
            assert other.push_points(piece, stamp, "front", first=first) is overtake.Status.DUPLICATE
            assert other.end_scan(stamp, "front", point_count=360) is overtake.Status.OK
        pieces = other.next_frame().detections.to_dict()
        assert other.push_points(piece, stamp, "front", first=first) is overtake.Status.LATE
    assert {n: c.tobytes() for n, c in pieces.items()} == {n: c.tobytes() for n, c in whole.items()}


def test_ego_poses_move_the_tracks_to_the_map(detector):
    for k in range(5):
        stamp = k * 50_000_000
        assert detector.push_ego_pose(stamp, x_m=100.0, y_m=50.0, yaw_rad=0.0, speed_mps=10.0) is overtake.Status.OK
        detector.push_scan(car_tail(), stamp)
    assert detector.push_ego_pose(stamp, 0, 0, 0, 0) is overtake.Status.DUPLICATE
    with pytest.raises(overtake.ArgumentError):
        detector.push_ego_pose(stamp + 1, float("nan"), 0, 0, 0)
    frame = detector.next_frame()
    assert frame.reference == overtake.Reference.MAP and frame.ego_known is True and frame.ego_x_m == 100.0
    assert 118 < frame.tracks.x_m[0] < 126 and abs(frame.tracks.y_m[0] - 50) < 1
    assert overtake.Flag.NO_EGO not in frame.flags and overtake.Flag.NO_MAP in frame.flags


def test_detections_of_another_detector():
    with overtake.Detector([], preset="best") as detector:
        for k in range(10):
            detector.push_ego_pose(k * 50_000_000, 0, 0, 0, 20)
            assert detector.push_detections(k * 50_000_000, [20.0 + k, 60], numpy.array([0, 3], "i4"),
                                            score=[0.9, float("nan")]) is overtake.Status.OK
        frame = detector.next_frame()
        assert overtake.Flag.EXTERNAL in frame.flags
        assert sorted(frame.tracks.x_m.round()) == [29, 60]
        assert detector.push_detections(9 * 50_000_000, [1.0], [1.0]) is overtake.Status.DUPLICATE
        with pytest.raises(ValueError, match="y_m has 1 rows, x_m has 2"):
            detector.push_detections(10 * 50_000_000, [1, 2], [1])
        with pytest.raises(TypeError, match="score is dtype of kind 'U'; numbers are needed"):
            detector.push_detections(10 * 50_000_000, [1], [1], score=numpy.array(["a"]))
        with pytest.raises(TypeError, match="x_m is a masked array"):
            detector.push_detections(10 * 50_000_000, numpy.ma.masked_array([1.0], mask=[True]), [1.0])
        for var_x, var_y, cov_xy, sentence in (
                (-1, -1, 0, "a variance is not between"), (0.1, float("nan"), 0, "var_x and var_y are needed together"),
                (float("nan"), float("nan"), 0, "cov_xy needs var_x and var_y"), (0.1, 0.1, 500, "cov_xy is too large")):
            with pytest.raises(ValueError, match=f"row 1: {sentence}"):
                detector.push_detections(10 * 50_000_000, [1, 2], [1, 2], var_x=[0.1, var_x], var_y=[0.1, var_y],
                                         cov_xy=[0, cov_xy])
        with pytest.raises(ValueError, match="reference is 'car'"):
            detector.push_detections(10 * 50_000_000, [1], [1], reference="car")
        with pytest.raises(overtake.TooManyError):
            detector.push_detections(10 * 50_000_000, numpy.zeros(300), numpy.zeros(300))


def test_wrong_definitions_raise_a_sentence():
    with pytest.raises(ValueError, match="two sensors are named 'front'"):
        overtake.Detector([a_sensor(), a_sensor()])
    with pytest.raises(ValueError, match="smooth.window has no effect: preset best does not read it"):
        overtake.Detector(a_sensor(), params={"smooth.window": 5})
    with pytest.raises(overtake.ArgumentError, match="rows"):
        overtake.Detector(a_sensor(rows=-1))
    with pytest.raises(TypeError, match="rows is 'many'; a whole number is needed"):
        overtake.Detector(a_sensor(rows="many"))
    with pytest.raises(overtake.UnknownNameError, match="no preset 'worst'"):
        overtake.Detector(a_sensor(), preset="worst")
    with pytest.raises(TypeError, match="no option 'track_capacities'"):
        overtake.Detector(a_sensor(), track_capacities=3)
    with pytest.raises(ValueError, match="push is 'never'"):
        overtake.Detector(a_sensor(), push="never")
    with pytest.raises(TypeError, match="rig holds a int"):
        overtake.Detector([1])
    with pytest.raises(overtake.Error) as error:
        overtake.Detector(a_sensor(), isa="z80")
    assert error.value.status is overtake.Status.UNKNOWN_NAME
    for capacity in (0, -1):
        with pytest.raises(ValueError, match=f"frame_capacity is {capacity}; 1 or more is needed"):
            overtake.Detector(a_sensor(), frame_capacity=capacity)
    with pytest.raises(TypeError, match="cpus is 'all'; a whole number is needed"):
        overtake.Detector(a_sensor(), cpus=["all"])


def test_wrong_maps_name_the_column():
    wrong = {
        "width_left_m has 2 rows, x_m has 3": (ValueError, {"width_left_m": [1, 2]}),
        "left_y_m has 1 rows, left_x_m has 2": (ValueError, {"left_x_m": [0, 1], "left_y_m": [0]}),
        "banking_rad: could not convert string to float: 'steep'": (ValueError, {"banking_rad": [0, 0, "steep"]}),
        r"banking_rad: float\(\) argument must be": (TypeError, {"banking_rad": [0, 0, {}]}),
        r"banking_rad has shape \(\); \(n,\) is needed": (ValueError, {"banking_rad": numpy.float64(0)}),
        "banking_rad is a float; an array is needed": (TypeError, {"banking_rad": 0.0}),
        "closed is 'yes'; True or False is needed": (TypeError, {"closed": "yes"}),
        "map has no column 'width_m'": (TypeError, {"width_m": [1, 2, 3]}),
        "map has no column '3'": (TypeError, {3: [1, 2, 3]}),
    }
    for sentence, (error, columns) in wrong.items():
        with pytest.raises(error, match=sentence):
            overtake.Detector(a_sensor(), map={"x_m": [0, 1, 2], "y_m": [0, 1, 2], **columns})


def test_wrong_whole_numbers_name_the_argument(detector):
    calls = {"first": lambda value: detector.push_points(car_tail(), 0, first=value),
             "point_count": lambda value: detector.end_scan(0, point_count=value),
             "sensor": lambda value: detector.push_scan(car_tail(), 0, value)}
    for name, call in calls.items():
        for value in (1.5, [1]):
            with pytest.raises(TypeError, match=re.escape(f"{name} is {value!r}; a whole number is needed")):
                call(value)
    assert detector.stats["pushed"] == 0
    detector.push_points(car_tail(), 0, numpy.uint8(0), first=numpy.int64(0))
    assert detector.end_scan(0, point_count=numpy.int16(360)) is overtake.Status.OK


def test_options_reach_the_library():
    with overtake.Detector(a_sensor(), isa="ref", workers=2, track_capacity=1, cpus=[0]) as detector:
        assert detector.runtime_info["isa"] == "ref"
        assert detector.runtime_info["worker_count"] <= 2
        push_tails(detector, 2)
        detector.flush()
        assert detector.stats["frames"] == 2
