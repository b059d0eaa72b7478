# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings, runs and simulated races."""
import operator
import os
import shutil
import tempfile
import weakref

from . import _overtake
from ._overtake import Run
from ._params import Params
from ._paths import to_path

scenario_names = tuple(_overtake.scenario_names())


def _options(path, rig, **more):
    if rig is not None and not isinstance(rig, (str, bytes, os.PathLike)):
        if not getattr(rig, "source", ""):
            raise TypeError("rig: a recording needs a name or a TOML file, because it also tells topics and file names")
        from . import load_rig     # which imports this module
        if rig != load_rig(rig.source):
            raise ValueError(f"rig was changed after load_rig: a recording reads {rig.source} again, so change a file")
        rig = rig.source
    options = {"rig": rig, "urdf": None, "preset": None, "map": None, "ego": None,
               "config": None, "isa": None, "set": [], "capacity": [], "workers": None, **more}
    for name in ("rig", "urdf", "map", "ego", "config"):
        if options[name] is not None:
            options[name] = to_path(options[name], name)
    return {"input": to_path(path, "path"), **options}


class Recording:
    """The scans of a recording, in its order. Each iteration reads it from the start.

    sensors: names of its sensors. damage: why the last iteration ended early, "" where it did not. losses: what it left
    out, because it could not be read, "" for nothing.
    """

    def __init__(self, path, rig=None, *, map=None, ego=None, urdf=None):
        self._source = path     # a Race: its log is there as long as it is read
        self._options = _options(path, rig, map=map, ego=ego, urdf=urdf)
        self._iterator = _overtake.open_recording(self._options, path)
        self._fresh = True
        self.path = os.fsdecode(self._options["input"])
        self.sensors = self._iterator.sensors

    @property
    def damage(self):
        return self._iterator.damage

    @property
    def losses(self):
        return self._iterator.losses

    def __iter__(self):
        if not self._fresh:
            self._iterator = _overtake.open_recording(self._options, self._source)
        self._fresh = False
        return self._iterator

    def __fspath__(self):
        return self.path

    def __repr__(self):
        return f"<overtake.Recording {self.path}: {', '.join(self.sensors)}>"


def open(path, rig=None, *, map=None, ego=None, urdf=None):
    """A Recording of any format that `overtake info` knows: a file or folder; iterate for its Scans.

    rig: a built-in name or a TOML file; None: that of a simulated log. With a rig, scans have the columns that
    Detector.push_scan takes and the own poses to push before them; ego: a CSV file of poses, or "none". Without a rig,
    scans have the fields of the file; those of a bag x, y, z, intensity, layer and time, where it has them.
    """
    return Recording(path, rig, map=map, ego=ego, urdf=urdf)


def run(path, rig=None, preset=None, map=None, workers=1, params=None, *, ego=None, config=None, urdf=None, isa=None,
        capacities=None, stream=False, copy_labels=False, copy_images=False, path_horizon_s=None):
    """Detects and tracks on a recording, as `overtake run` does: iterate for its Frames.

    rig       a built-in name or a TOML file; None: that of a simulated log
    preset    "best" (default) or "paper"
    map, ego  a track map and a CSV of own poses; None: those of the recording; "none": without
    params    {"gate.min_points": 9}, of what the preset reads, or Params
    config    the config.toml of an earlier result; capacities: {"tracks": 512}; stream: push scans in pieces

    Every frame comes once, in order. Its detections and tracks are copies, so frames may be kept; copy_labels and
    copy_images copy these, too (several MB a frame). path_horizon_s 0: tracks without predicted paths, which is faster.
    A damaged recording gives a DamageWarning at its end.
    """
    whole = params if isinstance(params, Params) else None
    if whole is not None and config is not None:
        raise ValueError("config and Params are both whole sets of parameters: give params as a dict")
    if whole is not None and preset is not None and preset != whole.preset:
        raise ValueError(f"preset is '{preset}', but params are those of '{whole.preset}'")
    pairs = [f"{name}={_number_text(name, value)}"
             for name, value in ({} if whole is not None else params or {}).items()]
    return Run(_options(path, rig, preset=whole.preset if whole is not None else preset, map=map, ego=ego,
                        config=config, urdf=urdf, isa=isa, workers=workers, set=pairs,
                        capacity=[f"{name}={_whole_number(name, rows)}" for name, rows in (capacities or {}).items()],
                        stream=stream,
                        copy_labels=copy_labels, copy_images=copy_images, path_horizon_s=path_horizon_s),
               None if whole is None else whole._set, path)


def _number(name, value):
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = None
    if number is None or isinstance(value, str):
        raise TypeError(f"{name} is {value!r}; a number is needed")
    return number


def _whole_number(name, value):
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; a whole number is needed") from None


def _number_text(name, value):
    number = _number(name, value)
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)


def _remove(folder, process):
    if os.getpid() == process:      # not in a forked child, which has a copy of the Race
        shutil.rmtree(folder, ignore_errors=True)


class Race:
    """A simulated race: its log at `path`, and the truth.

    truth: a dict of arrays, one row per car and frame: frame, stamp_ns, car, name, is_ego, x_m, y_m, z_m, heading_rad,
    course_rad, speed_mps, yaw_rate_rps, s_m, d_m (map frame), ego_x_m, ego_y_m, ego_heading_rad (vehicle frame).
    overtake.run(race) and overtake.open(race) read it.
    """

    def __init__(self, scenario, seed, path, made, folder):
        self.scenario, self.seed, self.path = scenario, seed, path
        self.truth, self.frame_count, self.seconds = made["truth"], made["frame_count"], made["seconds"]
        if folder is not None:
            weakref.finalize(self, _remove, folder, os.getpid())

    def __fspath__(self):
        return self.path

    def __repr__(self):
        return f"<overtake.Race {self.scenario}, seed {self.seed}: {self.frame_count} frames in {self.path}>"


def simulate(scenario, seed=1, out=None, *, seconds=None, ego=None, workers=0, force=False):
    """Simulates a race with its truth: a Race.

    scenario: a built-in one (overtake.scenario_names) or a TOML file. out: LOG.mcap or a folder; None: a temporary log,
    removed with the Race and what reads it (about 7 MB a frame for three sensors of 27 thousand points). seconds: end
    earlier. ego: the car that carries the sensors. The log is byte for byte that of `overtake simulate`.
    """
    seed = _whole_number("seed", seed)
    if not 0 <= seed < 2**64:
        raise ValueError(f"seed is {seed}; 0 to {2**64 - 1} is needed")
    if ego is not None and not isinstance(ego, str):
        raise TypeError(f"ego is {ego!r}; a text is needed")
    if seconds is not None and not _number("seconds", seconds) >= 0.05:
        raise ValueError(f"seconds: 0.05 or more is needed, not {seconds}")
    folder = None
    if out is None:
        folder = tempfile.mkdtemp(prefix="overtake_")
        out = os.path.join(folder, "race.mcap")
    try:
        made = _overtake.simulate(to_path(scenario, "scenario"), seed, to_path(out, "out"), seconds or 0.0, ego or "",
                                  workers, force)
        return Race(os.fsdecode(scenario), seed, os.fsdecode(out), made, folder)
    except BaseException:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
