# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# A detector in several Python threads: pushes run without the GIL, and calls that exclude each other raise.
import threading

import numpy
import pytest

import overtake
from conftest import a_sensor, car_tail


def big_scan():
    angle = numpy.linspace(-1, 1, 27_000).astype("f4")
    return {"x": 40 * numpy.cos(angle), "y": 40 * numpy.sin(angle), "z": numpy.zeros(27_000, "f4"),
            "layer": (numpy.arange(27_000) % 32).astype("u2")}


def run_threads(*works):
    failures = []

    def guarded(work):
        try:
            work()
        except BaseException as error:  # noqa: BLE001: the test looks at all of them
            failures.append(error)

    threads = [threading.Thread(target=guarded, args=(work,)) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return failures


def collide(detector, one, other, rounds=3000):
    """Runs both until one of them raises; the other thread then stops."""
    stop = threading.Event()

    def loop(work):
        try:
            for k in range(rounds):
                if stop.is_set():
                    return
                work(k)
        finally:
            stop.set()

    return run_threads(lambda: loop(one), lambda: loop(other))


def test_two_threads_in_one_detector_without_workers_raise():
    points = big_scan()
    with overtake.Detector([a_sensor(), a_sensor(name="left")]) as detector:
        failures = collide(detector, lambda k: detector.push_scan(points, k * 50_000_000, 0),
                           lambda k: detector.push_scan(points, k * 50_000_000, 1))
        assert [type(failure) for failure in failures] == [overtake.WrongThreadError]
        assert failures[0].status is overtake.Status.WRONG_THREAD
        detector.push_scan(car_tail(), 10**13)


def test_two_threads_of_one_sensor_raise():
    points = big_scan()
    with overtake.Detector(a_sensor(point_capacity=100_000), workers=2, push="replace") as detector:
        failures = collide(detector, lambda k: detector.push_scan(points, 2 * k * 50_000_000),
                           lambda k: detector.push_scan(points, (2 * k + 1) * 50_000_000), rounds=100_000)
        assert {type(failure) for failure in failures} == {overtake.WrongThreadError}


def test_a_thread_per_sensor_with_workers():
    points = car_tail()
    sensors = [a_sensor(name=name) for name in ("front", "left", "right")]
    # The sensors of a car are in step: one that ran ahead by a frame would close the frames of the others.
    in_step = threading.Barrier(len(sensors), timeout=60)
    with overtake.Detector(sensors, workers=2, every_frame=True) as detector:
        def produce(sensor):
            for k in range(100):
                in_step.wait()
                assert detector.push_scan(points, k * 50_000_000, sensor) is overtake.Status.OK

        def poses():
            for k in range(100):
                detector.push_ego_pose(k * 50_000_000, 0, 0, 0, 10)

        assert run_threads(*(lambda name=name: produce(name) for name in detector.sensors), poses) == []
        detector.flush()
        stats = detector.stats
        assert stats["pushed"] == 300 == sum(stats[name] for name in ("used", "dropped", "late", "dup"))
        assert stats["used"] == 300
        assert len(list(detector.frames())) == stats["frames"]


def test_a_detector_in_use_is_not_closed():
    points = big_scan()
    detector = overtake.Detector(a_sensor())

    def close(k):
        if not detector.closed:
            detector.close()

    for _ in range(100):
        failures = collide(detector, lambda k: detector.push_scan(points, k * 50_000_000), close)
        assert {type(failure) for failure in failures} <= {overtake.WrongThreadError, overtake.ReleasedError}
        if overtake.WrongThreadError in map(type, failures):
            break
        detector = overtake.Detector(a_sensor())
    else:
        pytest.fail("close() was never called during a push")
    detector.close()


@pytest.mark.skipif(not overtake._overtake.has_files, reason="built without the tools")
def test_one_iterator_in_two_threads_raises(race):
    run = overtake.run(race)

    def pull():
        for _ in run:
            pass

    failures = run_threads(pull, pull)
    assert {type(failure) for failure in failures} <= {overtake.WrongThreadError} and len(failures) == 1
