# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Parameters as attributes, made from the library's table.
import copy
import json
import keyword
import os
import pickle
import shutil
import subprocess
import sys

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


def test_copies_are_independent_and_equal():
    params = overtake.Params("paper")
    params.gate.min_points = 9
    made = [params.copy(), copy.copy(params), copy.deepcopy(params), pickle.loads(pickle.dumps(params))]
    for other in made:
        assert other == params and other.preset == "paper" and other.gate.min_points == 9
    params.gate.min_points = 4
    for other in made:
        assert other != params and other.gate.min_points == 9
    assert params != overtake.Params("best") and params != 3


def test_a_detector_copies_its_parameters():
    params = overtake.Params("best")
    with overtake.Detector(overtake.Sensor(), params=params) as detector:
        params.gate.min_points = 50
        assert detector.params.gate.min_points != 50


COMMA = """
import locale, sys, overtake
locale.setlocale(locale.LC_ALL, "comma.UTF-8")
assert locale.localeconv()["decimal_point"] == "," and locale.str(1.5) == "1,5"
params = overtake.Params("best")
params.ground.threshold_deg = 12.5
params["frame.period_s"] = 0.0125
assert (params.ground.threshold_deg, params["frame.period_s"]) == (12.5, 0.0125), params.to_dict()
try:
    params.ground.threshold_deg = 90.5
except overtake.OutOfRangeError as error:
    assert "threshold_deg is 90.5; it takes a number from 0 to 90 deg" in str(error), error
for name, value in overtake.Params("best").to_dict().items():
    params[name] = value
assert params.to_dict() == overtake.Params("best").to_dict()
overtake.Detector(overtake.Sensor(), "paper", params={"ground.threshold_deg": 12.5}).close()
if overtake._overtake.has_files:
    run = overtake.run(overtake.simulate("demo", seconds=0.2), preset="paper", params={"ground.threshold_deg": 12.5})
    frames = list(run)
    print(run.config, run.hash)
"""


def test_a_locale_with_a_decimal_comma_changes_nothing(tmp_path):
    if shutil.which("localedef") is None:
        pytest.skip("no localedef (Debian's package locales)")
    made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", tmp_path / "comma.UTF-8"], capture_output=True,
                          text=True)
    if not (tmp_path / "comma.UTF-8").is_dir():
        pytest.skip(f"no locale with a decimal comma: {made.stderr.strip()}")
    run = {"capture_output": True, "text": True, "cwd": tmp_path}
    comma = subprocess.run([sys.executable, "-c", COMMA], env={**os.environ, "LOCPATH": str(tmp_path)}, **run)
    assert comma.returncode == 0, comma.stderr
    plain = COMMA[:COMMA.index("locale.setlocale")] + COMMA[COMMA.index("params ="):]
    there = subprocess.run([sys.executable, "-c", plain], **run)
    assert there.returncode == 0, there.stderr

    def without_paths(text):
        return [line for line in text.splitlines() if "overtake_" not in line]

    assert without_paths(comma.stdout) == without_paths(there.stdout)
