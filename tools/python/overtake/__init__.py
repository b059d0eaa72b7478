# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
"""Overtake: detects and tracks other cars with LiDAR.

    for frame in overtake.run("race.mcap", rig="racecar"):
        print(frame.tracks.x_m, frame.tracks.speed_mps)

    with overtake.Detector(rig="racecar", preset="best") as detector:
        detector.push_scan(points, stamp_ns, "front")
        frame = detector.next_frame()

Units are SI: m, s, rad, m/s; stamps are nanoseconds. Frames of reference are right-handed: x forward, y left, z up.
"""
import collections.abc
import dataclasses
import os
import typing

from . import _overtake
from ._overtake import (  # noqa: F401: the package's names
    ArgumentError, Clusters, Detections, Error, Flag, Frame, InternalError, Labels, NoFrameError, NoThreadsError,
    NotComputedError, NotKeptError, ObjectClass, OutOfMemoryError, OutOfRangeError, Reference, ReleasedError, Status,
    TooManyError, TrackFlag, Tracks, TrackState, UnknownNameError, VersionError, View, Visibility, WrongThreadError,
    build_info, image_names, preset_names, reason_names, stage_names)
from ._params import Params  # noqa: F401
from ._paths import to_path as _to_path

__version__ = build_info()["version"]


@dataclasses.dataclass
class Sensor:
    """One LiDAR: its place in the vehicle, its image, its limits. Lengths in m, angles in rad."""

    name: str = "sensor"
    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    rows: int = 32
    cols: int = 857
    azimuth_left_rad: float = 1.0471975511965977
    azimuth_right_rad: float = -1.0471975511965977
    wraps: bool = False
    range_min_m: float = 0.5
    range_max_m: float = 300.0
    layer_first: int = 0
    layer_last: int = 65535
    point_capacity: int = 65536
    compensated_to_s: typing.Optional[float] = None


@dataclasses.dataclass
class Rig:
    """The sensors of a vehicle. load_rig reads one by name or from a TOML file."""

    sensors: typing.List[Sensor]
    name: str = ""
    period_s: float = 0.05
    capacities: typing.Dict[str, int] = dataclasses.field(default_factory=dict)
    source: str = ""


@dataclasses.dataclass
class Map:
    """A race track: a centre line with widths, or two bounds, in driving direction. Arrays (n,) in m.

    banking_rad: (n,), rad, at most 1: the road across the line, positive where the right side is higher.
    """

    closed: bool = True
    x_m: typing.Any = None
    y_m: typing.Any = None
    width_left_m: typing.Any = None
    width_right_m: typing.Any = None
    banking_rad: typing.Any = None
    left_x_m: typing.Any = None
    left_y_m: typing.Any = None
    right_x_m: typing.Any = None
    right_y_m: typing.Any = None


def _need_files(what):
    if not _overtake.has_files:
        raise ImportError(f"{what} needs the tools: this package was built with OVT_TOOLS=OFF")


def load_rig(name):
    """The Rig of a built-in name ("racecar", "av21", ...), of a TOML file, or of a simulated log."""
    _need_files("load_rig")
    fields = _overtake.load_rig(_to_path(name, "rig"))
    return Rig(sensors=[Sensor(**sensor) for sensor in fields["sensors"]], name=fields["name"],
               period_s=fields["period_s"], capacities=fields["capacities"], source=os.fsdecode(name))


def load_map(path):
    """The Map of a file: a centre line with widths, a race line table, "FILE1,FILE2" with two bounds, or a log.

    Banking whose turns lean outwards on the whole has the opposite sign (see Map): it is turned round, with a
    UserWarning.
    """
    _need_files("load_map")
    return Map(**_overtake.load_map(_to_path(path, "map")))


def _to_rig(rig):
    if isinstance(rig, Rig):
        return rig
    if isinstance(rig, (str, bytes, os.PathLike)):
        return load_rig(rig)
    if isinstance(rig, Sensor):
        return Rig([rig])
    sensors = [Sensor(**sensor) if isinstance(sensor, dict) else sensor for sensor in rig]
    for sensor in sensors:
        if not isinstance(sensor, Sensor):
            raise TypeError(f"rig holds a {type(sensor).__name__}; a name, a Rig, or a list of Sensor is needed")
    return Rig(sensors)


def _to_map(track_map):
    if track_map is None:
        return None
    if isinstance(track_map, collections.abc.Mapping):
        for name in track_map:
            if name not in Map.__dataclass_fields__:
                raise TypeError(f"map has no column '{name}' (it has: {', '.join(Map.__dataclass_fields__)})")
        track_map = Map(**track_map)
    if isinstance(track_map, (str, bytes, os.PathLike)):
        track_map = load_map(track_map)
    if not isinstance(track_map, Map):
        raise TypeError(f"map is a {type(track_map).__name__}; a path, a Map or a dict of columns is needed")
    return {name: value for name, value in vars(track_map).items() if value is not None}


def _to_params(preset, params, period_s):
    if isinstance(params, Params):
        if preset is not None and preset != params.preset:
            raise ValueError(f"preset is '{preset}', but params are those of '{params.preset}'")
        return params.copy()
    made = Params("best" if preset is None else preset)
    if period_s is not None:
        made["frame.period_s"] = period_s
    made.update(params or {})
    for name in params or {}:
        if not made.has_effect(name):
            raise ValueError(f"{name} has no effect: preset {made.preset} does not read it")
    return made


_POLICIES = {"replace": 0, "wait": 1}


class Detector(_overtake.DetectorBase):
    """Detects and tracks other cars: scans and own poses in, frames out.

    rig             a built-in name or a TOML file (load_rig), a Rig, a Sensor, or a list of them; []: no LiDAR, only
                    the tracker with push_detections
    preset          "best" (default) or "paper", the publication to the letter
    map             a path (load_map), a Map, a dict of its columns; None: no map
    workers         1: the calling thread does all work; n: a graph on n threads; 0: one per CPU
    params          Params, or {"gate.min_points": 9}, of what the preset reads. With Params, set frame.period_s to that of the rig
    push            "wait" (default): nothing is dropped; "replace": live, the newest scan replaces a waiting one
    isa             forces an instruction set: "ref", "sse2", "avx2", ...
    keep_images     frames keep every image; False: less time
    frame_capacity  frames that may be held at once (Frame)
    every_frame     next_frame gives every frame in turn, as copies; copy_labels, copy_images: with these
    path_horizon_s  how far tracks have predicted paths, s; 0: none; None: tracker.horizon_s
    options         more of ovt_detector_def: cluster_capacity, candidate_capacity, track_capacity, ego_pose_capacity,
                    frames_in_flight, cpus, fifo_priority, memory, spin_us, deadline_ns, watchdog_ns, stream

    One thread at a time may call it, but with workers other than 1 each sensor, the ego poses and the detections may
    have their own thread. What the library refuses raises WrongThreadError. Do not use it in a forked child.
    """

    def __init__(self, rig="racecar", preset=None, map=None, workers=1, params=None, *, push="wait", isa=None,
                 keep_images=True, frame_capacity=4, every_frame=False, copy_labels=False, copy_images=False,
                 path_horizon_s=None, **options):
        self.rig = _to_rig(rig)
        by_name = isinstance(rig, (str, bytes, os.PathLike, Rig))
        self.params = _to_params(preset, params, self.rig.period_s if by_name else None)
        if push not in _POLICIES:
            raise ValueError(f"push is '{push}'; 'wait' or 'replace' is needed")
        known = {"cluster_capacity", "candidate_capacity", "track_capacity", "ego_pose_capacity", "frames_in_flight",
                 "cpus", "fifo_priority", "memory", "spin_us", "deadline_ns", "watchdog_ns", "stream"}
        for name in options:
            if name not in known:
                raise TypeError(f"Detector has no option '{name}'")
        capacities = {_CAPACITIES[name]: rows for name, rows in self.rig.capacities.items()}
        super().__init__([vars(sensor) for sensor in self.rig.sensors], self.params._set, _to_map(map),
                         {**capacities, **options, "worker_count": workers, "push_policy": _POLICIES[push], "isa": isa,
                          "keep_images": int(keep_images), "frame_capacity": frame_capacity, "every_frame": every_frame,
                          "copy_labels": copy_labels, "copy_images": copy_images, "path_horizon_s": path_horizon_s})

    def push(self, scan):
        """Pushes a Scan of overtake.open: first its own poses, then its points. Returns the scan's Status."""
        for pose in scan.ego_poses:
            self.push_ego_pose(**pose)
        return self.push_scan(scan.points, scan.stamp_ns, scan.sensor)

    def push_detections(self, stamp_ns, x_m, y_m, *, heading_rad=None, var_x=None, var_y=None, cov_xy=None,
                        length_m=None, width_m=None, height_m=None, score=None, reference="map"):
        """Pushes detections of another detector (radar, neural network) that share a stamp.

        Columns (n,): x_m, y_m the centre, heading_rad, var_x, var_y, cov_xy (m^2), length_m, width_m, height_m, score
        (0 to 1). None, or NaN in a row: not measured. reference: "map" or "vehicle".
        """
        return self._push_detections(stamp_ns, {
            "x_m": x_m, "y_m": y_m, "heading_rad": heading_rad, "var_x": var_x, "var_y": var_y, "cov_xy": cov_xy,
            "length_m": length_m, "width_m": width_m, "height_m": height_m, "score": score}, reference)

    def frames(self):
        """The frames that are finished now, one after the other: with every_frame all, else the latest."""
        while (frame := self.next_frame()) is not None:
            yield frame


_CAPACITIES = {"clusters": "cluster_capacity", "candidates": "candidate_capacity", "tracks": "track_capacity",
               "ego_poses": "ego_pose_capacity"}


def track_name(track_id):
    """"34:1": the slot and the generation of a track's id, as the command line prints it."""
    return f"{int(track_id) & 0xffffffff}:{int(track_id) >> 32}"


if _overtake.has_files:
    from ._overtake import DamageWarning, FileError, Scan  # noqa: F401
    from ._files import Race, Recording, Run, open, run, scenario_names, simulate  # noqa: F401
else:
    def open(*args, **kwargs):
        _need_files("open")

    def run(*args, **kwargs):
        _need_files("run")

    def simulate(*args, **kwargs):
        _need_files("simulate")
