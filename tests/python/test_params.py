# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Parameters as attributes, made from the library's table.
import json
import keyword
import subprocess

import pytest

import overtake


def test_every_parameter_is_an_attribute_with_its_unit(program):
    listed = json.loads(subprocess.run([program, "params", "--json"], check=True, capture_output=True).stdout)
    params = overtake.Params("best")
    assert len(params) == len(listed["parameters"]) > 50
    for row in listed["parameters"]:
        group, name = (word + "_" * keyword.iskeyword(word) for word in row["name"].split("."))
        part = getattr(params, group)
        text = getattr(type(part), name).__doc__
        assert row["text"] in text and f"{row['min']:g} to {row['max']:g}" in text
        assert text.rstrip(")").endswith(row["unit"])
        assert getattr(part, name) == pytest.approx(row["default"], rel=1e-9, abs=1e-12), row["name"]
        assert params.has_effect(row["name"]) == row["has_effect"]
        assert isinstance(getattr(part, name), int if row["integer"] else float)


def test_values_are_set_and_read():
    params = overtake.Params("paper")
    params.ground.threshold_deg = 12.5
    params["tracker.confirm_hits"] = 5
    params.update({"gate.min_points": 9})
    assert (params["ground.threshold_deg"], params.tracker.confirm_hits, params.gate.min_points) == (12.5, 5, 9)
    other = params.copy()
    other.gate.min_points = 3
    assert params.gate.min_points == 9 and other.to_dict()["gate.min_points"] == 3
    assert params.preset == "paper" and "threshold_deg = 12.5" in repr(params.ground)


def test_wrong_names_and_values():
    params = overtake.Params()
    assert params.preset == "best"
    with pytest.raises(AttributeError, match="no parameter 'tracker.confirm_hit'; did you mean 'confirm_hits'"):
        params.tracker.confirm_hit = 3
    with pytest.raises(AttributeError, match="'traker' is no parameter"):
        params.traker = 3
    with pytest.raises(LookupError, match="no parameter 'tracker.confirm_hit'; did you mean 'tracker.confirm_hits'"):
        params["tracker.confirm_hit"]
    with pytest.raises(overtake.OutOfRangeError, match="confirm_hits is 99; it takes a whole number from 1 to 64"):
        params.tracker.confirm_hits = 99
    with pytest.raises(overtake.Error, match="whole number"):
        params.tracker.confirm_hits = 2.5
    with pytest.raises(TypeError):
        params.tracker.confirm_hits = "many"
    with pytest.raises(ValueError, match="preset is 'paper', but params are those of 'best'"):
        overtake.Detector(overtake.Sensor(), "paper", params=params)


def test_a_detector_copies_its_parameters():
    params = overtake.Params("best")
    with overtake.Detector(overtake.Sensor(), params=params) as detector:
        params.gate.min_points = 50
        assert detector.params.gate.min_points != 50
