# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Tests of the Python package. tests/test_python.sh sets PYTHONPATH to the built package, OVERTAKE_PROGRAM to the
# command line, OVERTAKE_SOURCE to the source tree and OVERTAKE_BUILD to the build tree.
import os
import pathlib

import numpy
import pytest

import overtake

SOURCE = pathlib.Path(os.environ["OVERTAKE_SOURCE"])


def car_tail(ahead_m=20.0):
    """The tail of a car, ahead_m in front of a sensor 1.2 m over the road: columns of 360 points."""
    left, layer = numpy.meshgrid(numpy.arange(45) * 0.04 - 0.9, numpy.arange(8))
    return {"x": numpy.full(360, ahead_m, "f4"), "y": left.ravel().astype("f4"),
            "z": (-0.13 * layer.ravel()).astype("f4"), "layer": (8 + layer.ravel()).astype("u2"),
            "intensity": numpy.linspace(0, 1, 360).astype("f4")}


def a_sensor(**more):
    return overtake.Sensor(**{"name": "front", "z_m": 1.2, **more})


def push_tails(detector, count=20, sensor=0, first=0):
    """Pushes scans of a car that moves away at 10 m/s, 50 ms apart."""
    for k in range(first, first + count):
        detector.push_scan(car_tail(20 + 0.5 * k), k * 50_000_000, sensor)


def in_a_forked_child(*calls):
    """What became of each call in a forked child: "returned", or an error's type and sentence."""
    pipe, end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            for call in calls:
                try:
                    call()
                    told = "returned"
                except BaseException as error:  # noqa: BLE001: the test looks at all of them
                    told = f"{type(error).__name__}: {error}"
                os.write(end, (told.replace("\n", " ") + "\n").encode())
        finally:
            os._exit(0)
    os.close(end)
    with open(pipe) as file:
        told = file.read().splitlines()
    assert os.waitpid(child, 0)[1] == 0
    return told


@pytest.fixture
def detector():
    with overtake.Detector(a_sensor(), preset="best") as made:
        yield made


@pytest.fixture(scope="session")
def race():
    return overtake.simulate("overtake", seed=7, seconds=2)


@pytest.fixture(scope="session")
def program():
    return os.environ["OVERTAKE_PROGRAM"]
