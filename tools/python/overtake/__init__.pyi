# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
import enum
import os
import typing

import numpy
import numpy.typing

from ._params import Params as Params

_Floats = numpy.typing.NDArray[numpy.float32]
_Doubles = numpy.typing.NDArray[numpy.float64]
_Ints = numpy.typing.NDArray[numpy.int32]
_Longs = numpy.typing.NDArray[numpy.int64]
_Ids = numpy.typing.NDArray[numpy.uint64]
_Flags = numpy.typing.NDArray[numpy.uint32]
_Bytes = numpy.typing.NDArray[numpy.uint8]
_Array = numpy.typing.NDArray[typing.Any]
_Numbers = typing.Sequence[float] | _Array
_OptionalNumbers = _Numbers | None
_Path = str | bytes | os.PathLike[str] | os.PathLike[bytes]
_OptionalPath = _Path | None
_SensorKey = str | int
_Fields = typing.Sequence[str | None] | None
_Points = _Array | typing.Mapping[str, typing.Any] | typing.Any
_ParamValues = Params | typing.Mapping[str, float] | None
_RigName = _Path | Rig | None

__version__: str
preset_names: tuple[str, ...]
image_names: tuple[str, ...]
stage_names: tuple[str, ...]
reason_names: tuple[str, ...]
scenario_names: tuple[str, ...]

# generated: Status
class Status(enum.IntEnum):
    """What became of a call, as ovt_status of the C API."""
    OK = 0
    BAD_ARGUMENT = 1
    BAD_VERSION = 2
    UNKNOWN_NAME = 3
    OUT_OF_RANGE = 4
    NO_MEMORY = 5
    NO_THREADS = 6
    NO_FRAME = 7
    DUPLICATE = 8
    LATE = 9
    TOO_MANY = 10
    INTERNAL = 11
    NOT_KEPT = 12
    WRONG_THREAD = 13
    NOT_COMPUTED = 14
# end

# generated: Flag
class Flag(enum.IntFlag):
    """Bits of Frame.flags, as OVT_FLAG_... of the C API."""
    NO_EGO = 1
    NO_MAP = 2
    SENSOR_MISSING = 4
    SENSOR_STALE = 8
    EGO_STALE = 16
    CLOUD_DEGRADED = 32
    NO_DATA = 64
    OVERFLOW = 128
    CLOCK_JUMP = 256
    DEADLINE_MISSED = 512
    EXTERNAL = 1024
    OUT_OF_SEQUENCE = 2048
    PREDICTION = 4096
    EXCEPTION = 8192
    EGO_OFF_MAP = 16384
    WORK_LIMIT = 32768
    CLOCK_SUSPECT = 65536
    EGO_HEADING = 131072
    SCAN_INCOMPLETE = 262144
    NO_GROUND = 524288
    EGO_JUMP = 1048576
    VIEW_BLOCKED = 2097152
# end

# generated: TrackFlag
class TrackFlag(enum.IntFlag):
    """Bits of Tracks.flags."""
    COASTING = 1
    UNOBSERVED = 2
    STALE = 4
# end

# generated: TrackState
class TrackState(enum.IntEnum):
    """Values of Tracks.state."""
    TENTATIVE = 0
    CONFIRMED = 1
# end

# generated: Visibility
class Visibility(enum.IntEnum):
    """Values of Tracks.visibility."""
    SEEN = 0
    MISSED = 1
    HIDDEN = 2
    OWN_SHADOW = 3
    OUTSIDE = 4
# end

# generated: View
class View(enum.IntEnum):
    """Values of Detections.view: the side of the car that the sensor faces."""
    REAR = 0
    FRONT = 1
    SIDE = 2
# end

# generated: ObjectClass
class ObjectClass(enum.IntEnum):
    """Values of object_class."""
    UNKNOWN = 0
    CAR = 1
    DEBRIS = 2
# end

# generated: Reference
class Reference(enum.IntEnum):
    """Frame of reference: the vehicle (rear axle, on the ground) or the map."""
    VEHICLE = 0
    MAP = 1
# end

class Error(RuntimeError):
    """A call failed. `status` is the overtake.Status, or None."""
    status: Status | None

class ArgumentError(Error, ValueError): ...
class VersionError(Error): ...
class UnknownNameError(Error, LookupError): ...
class OutOfRangeError(Error, ValueError): ...
class OutOfMemoryError(Error, MemoryError): ...
class NoThreadsError(Error): ...
class NoFrameError(Error): ...
class TooManyError(Error): ...
class InternalError(Error): ...
class NotKeptError(Error): ...
class WrongThreadError(Error): ...
class NotComputedError(Error): ...
class ReleasedError(Error, ValueError): ...
class FileError(Error, ValueError): ...
class DamageWarning(UserWarning): ...

class _Columns:
    columns: tuple[str, ...]
    def __len__(self) -> int: ...
    def to_dict(self) -> dict[str, _Array]:
        """Copies of all columns, by name; they do not hold the frame."""
    def to_pandas(self) -> typing.Any:
        """A pandas.DataFrame of the columns with one value per row (needs pandas)."""

class Detections(_Columns):
    """Detected objects: columns of len(detections) rows, vehicle frame at each row's stamp."""
    # generated: Detections
    @property
    def stamp_ns(self) -> _Longs:
        """(n,), ns: mean stamp of its points."""
    @property
    def x_m(self) -> _Floats:
        """(n,), m: centre of the imposed rectangle (best: of the car, by the side that is seen), vehicle frame at
        stamp_ns."""
    @property
    def y_m(self) -> _Floats:
        """(n,), m: centre of the imposed rectangle."""
    @property
    def z_m(self) -> _Floats:
        """(n,), m: centroid of the points."""
    @property
    def heading_rad(self) -> _Floats:
        """(n,), rad: heading_ref_rad or heading_var_rad; best: psi_VAR without its error and to the front, if the
        ends tell it."""
    @property
    def heading_source(self) -> _Ints:
        """(n,): psi_REF (map or ego heading) or psi_VAR (the points). Values: 0 ref, 1 var."""
    @property
    def length_m(self) -> _Floats:
        """(n,), m: extent of the points along the heading."""
    @property
    def width_m(self) -> _Floats:
        """(n,), m: extent of the points across the heading."""
    @property
    def point_count(self) -> _Ints:
        """(n,): number of points."""
    @property
    def inliers_ref(self) -> _Ints:
        """(n,): points in the rectangle at psi_REF (eq. 5)."""
    @property
    def inliers_var(self) -> _Ints:
        """(n,): points in the rectangle at psi_VAR (eq. 5)."""
    @property
    def heading_ref_rad(self) -> _Floats:
        """(n,), rad: psi_REF."""
    @property
    def heading_var_rad(self) -> _Floats:
        """(n,), rad: psi_VAR."""
    @property
    def ref_x_m(self) -> _Floats:
        """(n,), m: centre of the rectangle imposed at psi_REF."""
    @property
    def ref_y_m(self) -> _Floats:
        """(n,), m: centre of the rectangle imposed at psi_REF."""
    @property
    def var_x_m(self) -> _Floats:
        """(n,), m: centre of the rectangle imposed at psi_VAR."""
    @property
    def var_y_m(self) -> _Floats:
        """(n,), m: centre of the rectangle imposed at psi_VAR."""
    @property
    def sensor_mask(self) -> _Ints:
        """(n,): bit s: sensor s holds points of it."""
    @property
    def cluster(self) -> _Ints:
        """(n,): row of the merged cluster."""
    @property
    def map_s_m(self) -> _Floats:
        """(n,), m: centroid along the centre line; 0 where the map is not used."""
    @property
    def map_d_m(self) -> _Floats:
        """(n,), m: centroid across the centre line; 0 where the map is not used."""
    @property
    def track(self) -> _Ids:
        """(n,): id of the track that took it, 0 none."""
    @property
    def var_x(self) -> _Floats | None:
        """(n,), m^2: variance of x_m, vehicle frame. None with preset paper."""
    @property
    def var_y(self) -> _Floats | None:
        """(n,), m^2: variance of y_m. None with preset paper."""
    @property
    def cov_xy(self) -> _Floats | None:
        """(n,), m^2: covariance of x_m and y_m. None with preset paper."""
    @property
    def view(self) -> _Ints | None:
        """(n,): side of the car that the sensor faces. Values: 0 rear, 1 front, 2 side. None with preset paper."""
    @property
    def object_class(self) -> _Ints | None:
        """(n,): what the points can be. Values: 0 unknown, 1 car, 2 debris. None with preset paper."""
    @property
    def road_z_m(self) -> _Floats | None:
        """(n,), m: height of the road under the car, vehicle frame. None with preset paper."""
    @property
    def height_m(self) -> _Floats | None:
        """(n,), m: height of the highest point over the road. None with preset paper."""
    @property
    def ego_offset_rad(self) -> _Floats | None:
        """(n,), rad: added to the ego heading on the way to the map, at stamp_ns. None with preset paper."""
    # end

class Tracks(_Columns):
    """Tracked objects: columns of len(tracks) rows, in the frame of reference Frame.reference."""
    # generated: Tracks
    @property
    def publish_ns(self) -> int:
        """stamp that the tracks are predicted to"""
    @property
    def id(self) -> _Ids:
        """(n,): slot in the low half, generation in the high half; never reused."""
    @property
    def state(self) -> _Ints:
        """(n,): by the life cycle: M of N hits (paper), existence score (best). Values: 0 tentative, 1
        confirmed."""
    @property
    def measured_ns(self) -> _Longs:
        """(n,), ns: stamp of its last measurement."""
    @property
    def x_m(self) -> _Doubles:
        """(n,), m: position."""
    @property
    def y_m(self) -> _Doubles:
        """(n,), m: position."""
    @property
    def speed_mps(self) -> _Doubles:
        """(n,), m/s: speed along the course."""
    @property
    def course_rad(self) -> _Doubles:
        """(n,), rad: direction of the speed."""
    @property
    def yaw_rate_rps(self) -> _Doubles:
        """(n,), rad/s: change of the course."""
    @property
    def heading_rad(self) -> _Doubles:
        """(n,), rad: of the car: the way it points."""
    @property
    def length_m(self) -> _Doubles:
        """(n,), m: extent of the last detection."""
    @property
    def width_m(self) -> _Doubles:
        """(n,), m: extent of the last detection."""
    @property
    def age(self) -> _Ints:
        """(n,): iterations since its initiation in which a sensor could see it."""
    @property
    def hits(self) -> _Ints:
        """(n,): hits among the last N iterations."""
    @property
    def detection(self) -> _Ints:
        """(n,): row of this frame's detections, -1 none."""
    @property
    def path_points(self) -> int:
        """points of each predicted path"""
    @property
    def path_step_s(self) -> float:
        """time between two points of a path"""
    @property
    def path_x_m(self) -> _Doubles:
        """(n, path_points), m: predicted position, (k + 1) * path_step_s after publish_ns."""
    @property
    def path_y_m(self) -> _Doubles:
        """(n, path_points), m: predicted position, (k + 1) * path_step_s after publish_ns."""
    @property
    def path_course_rad(self) -> _Doubles:
        """(n, path_points), rad: predicted course, (k + 1) * path_step_s after publish_ns."""
    @property
    def path_speed_mps(self) -> _Doubles:
        """(n, path_points), m/s: predicted speed, (k + 1) * path_step_s after publish_ns."""
    @property
    def path_var_x(self) -> _Doubles:
        """(n, path_points), m^2: variance of x_m, (k + 1) * path_step_s after publish_ns."""
    @property
    def path_var_y(self) -> _Doubles:
        """(n, path_points), m^2: variance of y_m, (k + 1) * path_step_s after publish_ns."""
    @property
    def path_cov_xy(self) -> _Doubles:
        """(n, path_points), m^2: covariance of x_m and y_m, (k + 1) * path_step_s after publish_ns."""
    @property
    def flags(self) -> _Flags:
        """(n,): health: 1 coasting, 2 unobserved, 4 stale."""
    @property
    def existence(self) -> _Doubles | None:
        """(n,): probability that the track is a car. None with preset paper."""
    @property
    def object_class(self) -> _Ints | None:
        """(n,): what most of its detections were. Values: 0 unknown, 1 car, 2 debris. None with preset paper."""
    @property
    def visibility(self) -> _Ints | None:
        """(n,): why the newest frame has a detection of it, or none. Values: 0 seen, 1 missed, 2 hidden, 3
        own_shadow, 4 outside. None with preset paper."""
    @property
    def unseen_s(self) -> _Doubles | None:
        """(n,), s: time since its last detection or faint points. None with preset paper."""
    @property
    def heading_sigma_rad(self) -> _Doubles | None:
        """(n,), rad: standard deviation of heading_rad. None with preset paper."""
    @property
    def path_steady_along_m(self) -> _Doubles | None:
        """(n, path_points), m: standard deviation along course_rad of a car that keeps its speed and its place on
        the road, (k + 1) * path_step_s after publish_ns. None with preset paper."""
    @property
    def path_steady_across_m(self) -> _Doubles | None:
        """(n, path_points), m: the same across course_rad, (k + 1) * path_step_s after publish_ns. None with preset
        paper."""
    @property
    def covariance(self) -> _Doubles:
        """(n, 5, 5): covariance of x_m, y_m, speed_mps, course_rad, yaw_rate_rps. Symmetric; the library has the
        lower triangle, as columns."""
    # end

class Clusters(_Columns):
    """Merged clusters before any gate: columns of len(clusters) rows, vehicle frame."""
    # generated: Clusters
    @property
    def point_count(self) -> _Ints:
        """(n,): number of points."""
    @property
    def min_x_m(self) -> _Floats:
        """(n,), m: smallest coordinate of its points, vehicle frame."""
    @property
    def min_y_m(self) -> _Floats:
        """(n,), m: smallest coordinate."""
    @property
    def min_z_m(self) -> _Floats:
        """(n,), m: smallest coordinate."""
    @property
    def max_x_m(self) -> _Floats:
        """(n,), m: largest coordinate."""
    @property
    def max_y_m(self) -> _Floats:
        """(n,), m: largest coordinate."""
    @property
    def max_z_m(self) -> _Floats:
        """(n,), m: largest coordinate."""
    @property
    def center_x_m(self) -> _Floats:
        """(n,), m: centroid of the points."""
    @property
    def center_y_m(self) -> _Floats:
        """(n,), m: centroid of the points."""
    @property
    def center_z_m(self) -> _Floats:
        """(n,), m: centroid of the points."""
    @property
    def stamp_ns(self) -> _Longs:
        """(n,), ns: mean stamp of its points."""
    @property
    def sensor_mask(self) -> _Ints:
        """(n,): bit s: sensor s holds points of it."""
    # end

class Labels(_Columns):
    """The points of one sensor's scan with their labels, in the order of the push."""
    # generated: Labels
    @property
    def stamp_ns(self) -> int:
        """stamp of the scan"""
    @property
    def label(self) -> _Ints:
        """(n,): -1 none, 0 ground, clusters of this sensor from 1."""
    @property
    def reason(self) -> _Bytes:
        """(n,): 0 labelled, else the reason why not."""
    @property
    def label_count(self) -> int:
        """clusters of this sensor"""
    @property
    def cluster_of_label(self) -> _Ints:
        """(label_count + 1,): row of the merged cluster, -1 none."""
    @property
    def x_m(self) -> _Floats:
        """(n,), m: as pushed, sensor frame."""
    @property
    def y_m(self) -> _Floats:
        """(n,), m: as pushed."""
    @property
    def z_m(self) -> _Floats:
        """(n,), m: as pushed."""
    @property
    def intensity(self) -> _Floats:
        """(n,): as pushed."""
    @property
    def layer(self) -> _Ints:
        """(n,): ring; -1 if it was not a 16-bit integer."""
    # end

class Frame:
    """One finished frame. Its tables and arrays hold its memory until they die."""
    # generated: Frame, but: sensors detections tracks clusters released
    @property
    def sequence(self) -> int:
        """number of the frame"""
    @property
    def first_stamp_ns(self) -> int:
        """first scan's stamp"""
    @property
    def stamp_ns(self) -> int:
        """last scan's stamp"""
    @property
    def sensor_mask(self) -> int:
        """bit s: sensor s is in it"""
    @property
    def flags(self) -> Flag:
        """OVT_FLAG_..."""
    @property
    def reference(self) -> int:
        """frame of reference of the tracks"""
    @property
    def ego_known(self) -> bool:
        """the ego pose at stamp_ns is known"""
    @property
    def ego_x_m(self) -> float:
        """ego pose in the map"""
    @property
    def ego_y_m(self) -> float:
        """ego pose in the map"""
    @property
    def ego_yaw_rad(self) -> float:
        """ego pose in the map"""
    @property
    def ego_speed_mps(self) -> float:
        """ego speed"""
    @property
    def point_count(self) -> int:
        """points of its scans"""
    @property
    def cluster_count(self) -> int:
        """merged clusters"""
    @property
    def candidate_count(self) -> int:
        """candidates before the map gate"""
    @property
    def detection_count(self) -> int:
        """rows of ovt_detections"""
    @property
    def track_count(self) -> int:
        """rows of ovt_tracks"""
    @property
    def stale_mask(self) -> int:
        """bit s: sensor s is silent"""
    @property
    def refiltered(self) -> int:
        """iterations that ran again"""
    @property
    def latency_ns(self) -> int:
        """from its last scan's push to its tracks"""
    @property
    def tracks_stamp_ns(self) -> int:
        """stamp of its tracks"""
    @property
    def ego_off_map_m(self) -> float:
        """distance of the ego pose outside of the circuit"""
    @property
    def gated_points(self) -> int:
        """clusters of fewer points than gate.min_points"""
    @property
    def gated_size(self) -> int:
        """clusters longer than a vehicle"""
    @property
    def gated_map(self) -> int:
        """candidates outside of the circuit"""
    @property
    def overflow_candidates(self) -> int:
        """candidates beyond candidate_capacity"""
    @property
    def suspect_mask(self) -> int:
        """sources with a refused stamp"""
    @property
    def gated_own(self) -> int:
        """clusters of the own car's points"""
    @property
    def gated_range(self) -> int:
        """candidates beyond gate.range_m or gate.free_range_m"""
    @property
    def ego_heading_offset_rad(self) -> float:
        """estimated error of ego_yaw_rad, to add to it"""
    @property
    def ego_heading_sigma_rad(self) -> float:
        """standard deviation of ego_heading_offset_rad"""
    @property
    def ego_wall_points(self) -> int:
        """points of walls compared with the map's bounds"""
    @property
    def incomplete_mask(self) -> int:
        """bit s: the scan of sensor s is incomplete"""
    @property
    def blocked_mask(self) -> int:
        """bit s: a part of the view of sensor s is blocked"""
    @property
    def blocked_rad(self) -> float:
        """widest part of a view that is blocked"""
    @property
    def blocked_left_rad(self) -> float:
        """its left edge, an azimuth of the sensor"""
    @property
    def blocked_sensor(self) -> int:
        """its sensor"""
    @property
    def number(self) -> int:
        """Number of the frame in its recording; of a detector's frame: sequence."""
    # end
    @property
    def sensors(self) -> list[str]: ...
    @property
    def detections(self) -> Detections: ...
    @property
    def tracks(self) -> Tracks: ...
    @property
    def clusters(self) -> Clusters: ...
    @property
    def released(self) -> bool: ...
    def tracks_at(self, publish_ns: int) -> Tracks: ...
    def labels(self, sensor: _SensorKey = 0) -> Labels: ...
    def image(self, name: str, sensor: _SensorKey = 0) -> _Array: ...
    def times(self, sensor: _SensorKey | None = None) -> dict[str, int]: ...
    def release(self) -> None: ...
    def __enter__(self) -> Frame: ...
    def __exit__(self, *error: object) -> None: ...

class Sensor:
    """One LiDAR: its place in the vehicle, its image, its limits. Lengths in m, angles in rad."""
    name: str
    x_m: float
    y_m: float
    z_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    rows: int
    cols: int
    azimuth_left_rad: float
    azimuth_right_rad: float
    wraps: bool
    range_min_m: float
    range_max_m: float
    layer_first: int
    layer_last: int
    point_capacity: int
    compensated_to_s: float | None
    def __init__(self, name: str = "sensor", x_m: float = 0.0, y_m: float = 0.0, z_m: float = 0.0,
                 roll_rad: float = 0.0, pitch_rad: float = 0.0, yaw_rad: float = 0.0, rows: int = 32, cols: int = 857,
                 azimuth_left_rad: float = ..., azimuth_right_rad: float = ..., wraps: bool = False,
                 range_min_m: float = 0.5, range_max_m: float = 300.0, layer_first: int = 0, layer_last: int = 65535,
                 point_capacity: int = 65536, compensated_to_s: float | None = None) -> None: ...

class Rig:
    """The sensors of a vehicle."""
    sensors: list[Sensor]
    name: str
    period_s: float
    capacities: dict[str, int]
    source: str
    def __init__(self, sensors: list[Sensor], name: str = "", period_s: float = 0.05,
                 capacities: dict[str, int] = ..., source: str = "") -> None: ...

class Map:
    """A race track: a centre line with widths, or two bounds, in driving direction. Arrays (n,) in m.

    banking_rad: (n,), rad, at most 1: the road across the line, positive where the right side is higher.
    """
    closed: bool
    x_m: typing.Any
    y_m: typing.Any
    width_left_m: typing.Any
    width_right_m: typing.Any
    banking_rad: typing.Any
    left_x_m: typing.Any
    left_y_m: typing.Any
    right_x_m: typing.Any
    right_y_m: typing.Any
    def __init__(self, closed: bool = True, x_m: _OptionalNumbers = None, y_m: _OptionalNumbers = None,
                 width_left_m: _OptionalNumbers = None, width_right_m: _OptionalNumbers = None,
                 banking_rad: _OptionalNumbers = None, left_x_m: _OptionalNumbers = None,
                 left_y_m: _OptionalNumbers = None, right_x_m: _OptionalNumbers = None,
                 right_y_m: _OptionalNumbers = None) -> None: ...

class Scan:
    """One scan of one sensor, as arrays."""
    @property
    def sensor(self) -> str: ...
    @property
    def frame(self) -> int: ...
    @property
    def stamp_ns(self) -> int: ...
    @property
    def path(self) -> str: ...
    @property
    def points(self) -> dict[str, _Array]: ...
    @property
    def ego_poses(self) -> list[dict[str, float]]: ...
    def __len__(self) -> int: ...

class Recording:
    """The scans of a recording, in its order. Each iteration reads it from the start."""
    path: str
    sensors: list[str]
    @property
    def damage(self) -> str: ...
    @property
    def losses(self) -> str: ...
    def __init__(self, path: _Path, rig: _RigName = None, *, map: _OptionalPath = None, ego: _OptionalPath = None,
                 urdf: _OptionalPath = None) -> None: ...
    def __iter__(self) -> typing.Iterator[Scan]: ...
    def __fspath__(self) -> str: ...

class Run:
    """The frames of a recording, one after the other: what overtake.run returns."""
    @property
    def stats(self) -> dict[str, int]: ...
    @property
    def hash(self) -> str: ...
    @property
    def damage(self) -> str: ...
    @property
    def progress(self) -> float: ...
    @property
    def sensors(self) -> list[str]: ...
    @property
    def config(self) -> str: ...
    def __iter__(self) -> Run: ...
    def __next__(self) -> Frame: ...

class Race:
    """A simulated race: its log at `path`, and the truth."""
    scenario: str
    seed: int
    path: str
    truth: dict[str, _Array]
    frame_count: int
    seconds: float
    def __fspath__(self) -> str: ...

class Detector:
    """Detects and tracks other cars: scans and own poses in, frames out."""
    rig: Rig
    params: Params
    def __init__(self, rig: _Path | Rig | Sensor | typing.Sequence[Sensor] = "racecar", preset: str | None = None,
                 map: _Path | Map | typing.Mapping[str, typing.Any] | None = None, workers: int = 1,
                 params: _ParamValues = None, *, push: str = "wait", isa: str | None = None, keep_images: bool = True,
                 frame_capacity: int = 4, every_frame: bool = False, copy_labels: bool = False,
                 copy_images: bool = False, path_horizon_s: float | None = None, **options: typing.Any) -> None: ...
    def push_scan(self, points: _Points, stamp_ns: int, sensor: _SensorKey = 0, fields: _Fields = None,
                  time_unit_ns: float = 1.0) -> Status: ...
    def push_points(self, points: _Points, stamp_ns: int, sensor: _SensorKey = 0, first: int | None = None,
                    fields: _Fields = None, time_unit_ns: float = 1.0) -> Status: ...
    def end_scan(self, stamp_ns: int, sensor: _SensorKey = 0, point_count: int | None = None) -> Status: ...
    def push_ego_pose(self, stamp_ns: int, x_m: float, y_m: float, yaw_rad: float, speed_mps: float,
                      yaw_rate_rps: float = 0.0, z_m: float = 0.0, roll_rad: float = 0.0,
                      pitch_rad: float = 0.0) -> Status: ...
    def push_detections(self, stamp_ns: int, x_m: _Numbers, y_m: _Numbers, *, heading_rad: _OptionalNumbers = None,
                        var_x: _OptionalNumbers = None, var_y: _OptionalNumbers = None, cov_xy: _OptionalNumbers = None,
                        length_m: _OptionalNumbers = None, width_m: _OptionalNumbers = None,
                        height_m: _OptionalNumbers = None, score: _OptionalNumbers = None,
                        reference: str = "map") -> Status: ...
    def push(self, scan: Scan) -> Status: ...
    def advance(self, now_ns: int) -> Status: ...
    def flush(self) -> Status: ...
    def next_frame(self) -> Frame | None: ...
    def frames(self) -> typing.Iterator[Frame]: ...
    def close(self) -> None: ...
    @property
    def closed(self) -> bool: ...
    @property
    def sensors(self) -> list[str]: ...
    @property
    def stats(self) -> dict[str, typing.Any]: ...
    @property
    def runtime_info(self) -> dict[str, typing.Any]: ...
    def __enter__(self) -> Detector: ...
    def __exit__(self, *error: object) -> None: ...

def build_info() -> dict[str, str]: ...
def load_rig(name: _Path) -> Rig: ...
def load_map(path: _Path) -> Map: ...
def track_name(track_id: int) -> str: ...
def open(path: _Path, rig: _RigName = None, *, map: _OptionalPath = None, ego: _OptionalPath = None,
         urdf: _OptionalPath = None) -> Recording: ...
def run(path: _Path, rig: _RigName = None, preset: str | None = None, map: _OptionalPath = None, workers: int = 1,
        params: _ParamValues = None, *, ego: _OptionalPath = None, config: _OptionalPath = None,
        urdf: _OptionalPath = None, isa: str | None = None, capacities: typing.Mapping[str, int] | None = None,
        stream: bool = False, copy_labels: bool = False, copy_images: bool = False,
        path_horizon_s: float | None = None) -> Run: ...
def simulate(scenario: _Path, seed: int = 1, out: _OptionalPath = None, *, seconds: float | None = None,
             ego: str | None = None, workers: int = 0, force: bool = False) -> Race: ...
