# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Made by tools/python/make_stubs.py from the library's table of parameters.
import typing


class frame_group:
    """Parameters frame.*"""
    period_s: float
    """period of the sensors (number, 0.001 to 10 s)"""
    tolerance_s: float
    """scans this close to a frame's first stamp belong to it (number, 0 to 10 s)"""
    scan_limit: float
    """a scan in pieces that has not ended after so many periods is closed as incomplete; 0: never (number, 0 to
    1000 periods)"""

class segment_group:
    """Parameters segment.*"""
    parts: int
    """a worker without work of its own takes part in another's segmentation, cut into up to so many parts; 1: off
    (whole number, 1 to 4)"""

class gaps_group:
    """Parameters gaps.*"""
    limit_m: float
    """an empty pixel is filled if its two neighbours' ranges differ by less (number, 0 to 1000 m)"""
    limit_share: float
    """the same as a share of the nearer range; the larger limit applies (number, 0 to 1)"""

class angle_group:
    """Parameters angle.*"""
    skip_deg: float
    """neighbouring layers closer than this give no angle (number, 0 to 10 deg)"""

class smooth_group:
    """Parameters smooth.*"""
    window: int
    """Savitzky-Golay window, odd (sz_SG) (whole number, 1 to 15 rows)"""
    order: int
    """Savitzky-Golay polynomial order (whole number, 0 to 6)"""

class ground_group:
    """Parameters ground.*"""
    threshold_deg: float
    """a steeper slope is not ground (th_gnd) (number, 0 to 90 deg)"""

class running_ground_group:
    """Parameters running_ground.*"""
    height_m: float
    """a pixel this high over the running ground is still ground, at the last ground pixel of its column (number, 0
    to 10 m)"""
    known_per_m: float
    """this height grows by so much per metre from the last ground pixel, where the road is known (number, 0 to 1
    m/m)"""
    known_limit_m: float
    """up to this height, where the road is known (number, 0 to 10 m)"""
    known_slope: float
    """the ground's slope may differ by so much from the known road (number, 0 to 1 m/m)"""
    known_reach_m: float
    """the ground's slope is measured over this distance, where the road is known (number, 0.1 to 1000 m)"""
    guess_reach_m: float
    """like known_reach_m, where the road is not known (number, 0.1 to 1000 m)"""
    guess_per_m: float
    """like known_per_m, where the road is not known (number, 0 to 1 m/m)"""
    guess_limit_m: float
    """like known_limit_m, where the road is not known (number, 0 to 10 m)"""
    guess_slope: float
    """the ground's slope may differ by so much from the shape that is fitted to the scan, where the road is not
    known (number, 0 to 1 m/m)"""
    level_reach_m: float
    """a level plane counts as ground up to this far from the last ground pixel (apron beside a banked track)
    (number, 0 to 100 m)"""
    free_level_m: float
    """like level_reach_m, without a map or an ego pose on it (at most 1 m outside of the circuit) (number, 0 to 100
    m)"""
    level_slack: float
    """... also when it rises by so much more (number, 0 to 1 m/m)"""
    foot_deg: float
    """ground below an obstacle belongs to it when the two pixels are a steeper pair (number, 1 to 89 deg)"""
    fade_m: float
    """a road has no returns beyond this, for a sensor 1 m over it; grows with the root of its height over the road
    (number, 1 to 1000 m)"""
    start_per_m: float
    """as known_per_m and guess_per_m, until the slope is measured (the attitude of the pose errs) (number, 0 to 1
    m/m)"""
    start_limit_m: float
    """as known_limit_m and guess_limit_m, until the slope is measured (number, 0 to 10 m)"""

class smoke_group:
    """Parameters smoke.*"""
    dark_share: float
    """smoke is darker than this share of the ground's median intensity (0: nothing is smoke) (number, 0 to 1000)"""
    near_share: float
    """in smoke at most this share of the neighbouring pixels has about the same range (number, 0 to 1)"""
    reach_m: float
    """neighbouring pixels of smoke differ in range by less (number, 0 to 1000 m)"""

class repair_group:
    """Parameters repair.*"""
    window: int
    """NGRIR window, odd (w_s) (whole number, 1 to 31 columns)"""
    range_limit_m: float
    """NGRIR joins pairs whose ranges differ by less (th_r) (number, 0 to 1000 m)"""

class cluster_group:
    """Parameters cluster.*"""
    threshold_deg: float
    """neighbouring pixels join if beta exceeds this (th_seg) (number, 0.01 to 89 deg)"""

class cut_group:
    """Parameters cut.*"""
    threshold_deg: float
    """in a cluster that may be two cars, neighbouring pixels join only if beta exceeds this (number, 0.01 to 89
    deg)"""
    step_m: float
    """... but pixels one above the other whose ranges differ by less stay joined (number, 0 to 1000 m)"""
    from_: float
    """such clusters are longer than this, in lengths of the vehicle (number, 0 to 1000)"""
    to: float
    """... and shorter than this; a longer one is a wall (both 0: no cluster is cut) (number, 0 to 1000)"""
    in_line_from: float
    """a shorter one may be parts of two cars in line, if it is longer than this, in lengths of the vehicle (number,
    0 to 1000)"""
    in_line_width: float
    """... and narrower than this, in widths of the vehicle (number, 0 to 1000)"""
    in_line_step_m: float
    """... then pixels whose ranges differ by less stay joined (number, 0 to 1000 m)"""
    abreast_from: float
    """a cluster shorter than cut.from may be two cars side by side, if it is wider than this, in widths of the
    vehicle (number, 0 to 1000)"""
    abreast_step_m: float
    """... then pixels side by side whose ranges differ by less stay joined (number, 0 to 1000 m)"""
    strip_m: float
    """a near cluster that is no single car is two cars side by side, if an empty strip at least as wide divides it;
    0: never (number, 0 to 10 m)"""
    wall_m: float
    """what is farther in front of a wall, and may be a car, is no part of the wall; 0: never (number, 0 to 10 m)"""

class label_group:
    """Parameters label.*"""
    own_limit_m: float
    """a repaired pixel's own return takes the pixel's label within this range difference (number, 0.001 to 1000
    m)"""
    loser_limit_m: float
    """a point hidden behind the pixel's winner takes its label within this range difference (number, 0 to 1000
    m)"""

class merge_group:
    """Parameters merge.*"""
    distance_m: float
    """clusters closer than this across a seam are merged (th_mrg) (number, 0 to 100 m)"""
    columns: int
    """columns compared on each side of a seam (K) (whole number, 1 to 64 columns)"""

class join_group:
    """Parameters join.*"""
    gap_m: float
    """clusters of one car are at most this far apart along psi_REF, and across it (number, 0 to 100 m)"""
    slack_m: float
    """joined clusters may be longer and wider than the vehicle by this much (number, 0 to 100 m)"""
    bound_m: float
    """a cluster farther outside the circuit is joined with no other, but for what may be a car near on its apron
    (number, -100 to 1000 m)"""

class gate_group:
    """Parameters gate.*"""
    min_points: int
    """a cluster with fewer points is not a vehicle (whole number, 1 to 1e+06 points)"""
    slack: float
    """a cluster may be longer than the vehicle by this share (number, 0 to 10)"""
    map_margin_m: float
    """preset paper: a cluster this far outside the circuit counts as on it; see also gate.ego_margin_m (number,
    -100 to 1000 m)"""
    ego_margin_m: float
    """the map is not used while the ego vehicle is farther outside the circuit (gate.map_margin_m, if larger)
    (number, 0 to 1e+06 m)"""
    height_m: float
    """a higher cluster is not a vehicle (number, 0.1 to 100 m)"""
    width_slack_m: float
    """a cluster may be wider than the vehicle by the share of gate.slack and this (number, 0 to 100 m)"""
    inside_m: float
    """the centre of a car is at least this far inside the circuit's bounds, unless it is a car beyond doubt
    (number, -100 to 100 m)"""
    lowest_m: float
    """a cluster whose lowest point is higher over the ground (from 70 m on, up to twice as high) is not a vehicle
    (beams, wires, tops of walls); at most gate.top_m (number, 0 to 100 m)"""
    top_m: float
    """a cluster whose highest point is higher over the ground is not a vehicle, but for a tenth of its points where
    the ground errs (number, 0.1 to 100 m)"""
    range_m: float
    """a farther candidate is not a detection (number, 1 to 1e+06 m)"""
    free_range_m: float
    """a farther candidate is not a detection where no bounds of the circuit are known (number, 1 to 1e+06 m)"""
    wall_m: float
    """without a map: what lies within this of the line of a wall, or behind the wall, is no car (0: it may be)
    (number, 0 to 10 m)"""
    own_back_m: float
    """the own car reaches this far behind its origin (number, 0 to 100 m)"""
    own_front_m: float
    """the own car reaches this far ahead of its origin (number, 0 to 100 m)"""
    own_side_m: float
    """the own car reaches this far to both sides (number, 0 to 100 m)"""

class vehicle_group:
    """Parameters vehicle.*"""
    length_m: float
    """length of the vehicles to find (number, 0.1 to 100 m)"""
    width_m: float
    """width of the vehicles to find (number, 0.1 to 100 m)"""

class pose_group:
    """Parameters pose.*"""
    margin_m: float
    """points this far outside a rectangle count as inside (number, 0 to 10 m)"""
    min_var_points: int
    """with fewer points psi_VAR = psi_REF (whole number, 1 to 1e+06 points)"""
    front_length_m: float
    """the front end of a car counts as seen if at least this length is seen (number, 0 to 100 m)"""
    profile_points: float
    """so many points count for the place along a race car by the heights of its parts; 0: the ends of the box alone
    (number, 0 to 1000 points)"""
    angle_sigma_deg: float
    """standard deviation of the line of sight, in the covariance of detections; the ego heading adds its own
    (number, 0 to 10 deg)"""

class class_group:
    """Parameters class.*"""
    debris_m: float
    """a smaller object is debris, where a car would show more (number, 0 to 10 m)"""

class tracker_group:
    """Parameters tracker.*"""
    q_x: float
    """process noise of x in 50 ms (number, 0 to 1e+06 m^2)"""
    q_y: float
    """process noise of y in 50 ms (number, 0 to 1e+06 m^2)"""
    q_speed: float
    """process noise of the speed in 50 ms (number, 0 to 1e+06 m^2/s^2)"""
    q_course: float
    """process noise of the course in 50 ms (number, 0 to 1e+06 rad^2)"""
    q_yaw_rate: float
    """process noise of the yaw rate in 50 ms (number, 0 to 1e+06 rad^2/s^2)"""
    r_x: float
    """measurement noise of x (number, 1e-06 to 1e+06 m^2)"""
    r_y: float
    """measurement noise of y (number, 1e-06 to 1e+06 m^2)"""
    birth_sigma_speed: float
    """standard deviation of a new track's speed; preset best: without an ego pose (number, 0.001 to 1000 m/s)"""
    birth_sigma_course_deg: float
    """standard deviation of a new track's course (0.2 rad); preset best: off the map, at least 1 rad (number, 0.01
    to 360 deg)"""
    birth_sigma_yaw_rate: float
    """standard deviation of a new track's yaw rate; preset best: off the map, at least 0.5 (number, 0.0001 to 100
    rad/s)"""
    birth_speed_share: float
    """a new track's speed as a share of the ego speed (number, 0 to 10)"""
    gate_d2: float
    """gate: largest squared Mahalanobis distance of a detection (number, 0 to 1e+06)"""
    gate_m: float
    """gate: largest distance of a detection (number, 0 to 1e+06 m)"""
    window: int
    """life cycle window (N) (whole number, 1 to 64 iterations)"""
    confirm_hits: int
    """hits among the last N iterations that confirm a track (M_c) (whole number, 1 to 64 hits)"""
    keep_hits: int
    """a track with fewer hits among the last N iterations is deleted (M_e) (whole number, 0 to 64 hits)"""
    max_silence_s: float
    """a track without a hit for this long is deleted (number, 0.01 to 60 s)"""
    predict_after: float
    """ovt_advance predicts the tracks if no frame came for this long (number, 0 to 10000 periods)"""
    horizon_s: float
    """predicted path: how far (number, 0 to 60 s)"""
    horizon_step_s: float
    """predicted path: time between points (number, 0.001 to 60 s)"""
    work_limit: float
    """limit of the tracker's work per frame; a step takes about 2 ns (number, 10000 to 1e+15 steps)"""

class ego_heading_group:
    """Parameters ego_heading.*"""
    wall_length_m: float
    """a longer cluster is a wall (number, 1 to 1000 m)"""
    wall_reach_m: float
    """walls are used this far ahead and behind (number, 20 to 500 m)"""
    wall_scatter_m: float
    """largest root mean square distance of the walls from a constant distance to the bounds (number, 0.001 to 10
    m)"""
    wall_sigma_deg: float
    """standard deviation of the heading by the walls of one scan (number, 0.001 to 10 deg)"""
    wall_memory_s: float
    """errors of the walls are correlated for this long (number, 0 to 1000 s)"""
    constant_sigma_deg: float
    """standard deviation of the constant error of the ego heading, before any wall (number, 0 to 45 deg)"""
    mounting_sigma_deg: float
    """standard deviation of the yaw of a sensor's mounting (number, 0 to 45 deg)"""
    slip_sigma_deg: float
    """standard deviation of the slip angle per m/s^2 of acceleration across, before any wall (number, 0 to 10
    deg)"""
    lever_sigma_m: float
    """standard deviation of the distance from the rear axle to the point whose course is the ego heading (number, 0
    to 100 m)"""

class lane_tracker_group:
    """Parameters lane_tracker.*"""
    q_along: float
    """process noise of the place along the course in a second (number, 0 to 1e+06 m^2/s)"""
    q_across: float
    """process noise of the place across the course in a second (number, 0 to 1e+06 m^2/s)"""
    q_speed: float
    """process noise of the speed in a second; at least 1 without a map and from 5 to 25 m/s (number, 0 to 1e+06
    m^2/s^3)"""
    q_course: float
    """process noise of the course in a second; at least 0.0125 without a map (less above 10 m/s) (number, 0 to
    1e+06 rad^2/s)"""
    q_yaw_rate: float
    """process noise of the yaw rate in a second; at least 0.0125 without a map (number, 0 to 1e+06 rad^2/s^3)"""
    lane_s: float
    """the yaw rate goes to that of the lane, and a slow car's to 0, with this time constant (number, 0.01 to 1e+06
    s)"""
    stand_mps: float
    """a track slower than this comes to rest (number, 0 to 1000 m/s)"""
    part_share: float
    """a detection that shows a part of a car counts with up to 1 + this times its covariance (straight behind: 1 +
    10/3 of this): its error lasts (number, 0 to 1000)"""
    steady_lag: float
    """a track whose detections are ahead or behind by this many standard deviations (a fading sum) is in a
    manoeuvre; its speed changes from 0.83 of it on, its course where they lie twice as far to one side (number, 0.1
    to 1e+06)"""
    manoeuvre_gain: float
    """process noise of speed, acceleration, course and yaw rate in a manoeuvre, times the steady one (number, 1 to
    1e+06)"""
    birth_speed_share: float
    """a new track's speed as a share of the ego speed (number, 0 to 10)"""
    birth_sigma_share: float
    """standard deviation of that speed as a share of the ego speed, at least a third of what it lacks to 90 m/s
    (number, 0 to 10)"""
    birth_sigma_course_deg: float
    """standard deviation of a new track's course on the map (number, 0.01 to 360 deg)"""
    birth_sigma_yaw_rate: float
    """standard deviation of a new track's yaw rate on the map (number, 0.0001 to 100 rad/s)"""
    p_detect: float
    """probability that a near car in view is detected (misses come in rows: less than their share) (number, 0.01 to
    0.99)"""
    half_m: float
    """at this distance half of it (number, 1 to 1e+06 m)"""
    p_hidden: float
    """this share of it behind another confirmed car (number, 0 to 1)"""
    p_wing: float
    """at most this in the shadow of the own rear wing (number, 0 to 1)"""
    clutter_per_m2: float
    """density of false detections, at least (number, 1e-09 to 1000 1/m^2)"""
    clutter_reach_m: float
    """detections that no confirmed track explains are counted this far around one (number, 0 to 1e+06 m)"""
    clutter_area_m2: float
    """... each is a density of 1 / this (number, 0.01 to 1e+09 m^2)"""
    hit_score: float
    """a hit adds at most this to the score (log odds), before the features (number, 0 to 100)"""
    unknown_score: float
    """a detection that is not of class car adds (number, -100 to 100)"""
    low_m: float
    """a lower detection is low (number, -100 to 100 m)"""
    low_score: float
    """... and adds this, beyond 80 m with the square of the distance less (number, -100 to 100)"""
    car_points: float
    """points on a car, times the square of its distance in m (number, 1 to 1e+12)"""
    sparse_score: float
    """a detection with less than 0.03 of these points (up to 6 times as many nearer than 60 m) adds (number, -100
    to 100)"""
    thin_score: float
    """one with 0.03 to 0.1 of them adds (likewise) (number, -100 to 100)"""
    confirm_score: float
    """a track is confirmed above this score (number, -100 to 100)"""
    confirm_hits: int
    """... and with this number of hits (whole number, 1 to 64 hits)"""
    drop_score: float
    """a confirmed track is lost below this score (number, -100 to 100)"""
    most_score: float
    """scores are limited to this, up and down (number, 0.1 to 100)"""
    tentative_misses: int
    """a tentative track with more misses in a row is deleted (whole number, 0 to 60)"""
    coast_s: float
    """a confirmed track without a hit for longer is lost (number, 0 to 60 s)"""
    coast_sigma_m: float
    """so is one whose place has a larger standard deviation (without a map at most 3 m, if the car should be seen)
    (number, 0.1 to 1e+06 m)"""
    path_turn_s: float
    """a car is parallel to its lane after about this time: predicted path, and a track that is not seen (number,
    0.01 to 1e+06 s)"""
    path_speed: float
    """predicted path: noise of the speed in a second; less for a steady car, more while its detections run ahead of
    its track or fall behind it (number, 0 to 1e+06 m^2/s^3)"""
    path_across: float
    """standard deviation of a car's own way across its lane in a second: as path_turn_s (number, 0 to 1000 m/s)"""

class Params:
    """The parameters of a preset; each is an attribute of its group."""
    frame: frame_group
    segment: segment_group
    gaps: gaps_group
    angle: angle_group
    smooth: smooth_group
    ground: ground_group
    running_ground: running_ground_group
    smoke: smoke_group
    repair: repair_group
    cluster: cluster_group
    cut: cut_group
    label: label_group
    merge: merge_group
    join: join_group
    gate: gate_group
    vehicle: vehicle_group
    pose: pose_group
    class_: class_group
    tracker: tracker_group
    ego_heading: ego_heading_group
    lane_tracker: lane_tracker_group
    def __init__(self, preset: str = "best", **values: float) -> None: ...
    @property
    def preset(self) -> str: ...
    def __getitem__(self, name: str) -> float: ...
    def __setitem__(self, name: str, value: float) -> None: ...
    def __iter__(self) -> typing.Iterator[str]: ...
    def __len__(self) -> int: ...
    def update(self, values: typing.Mapping[str, float]) -> None: ...
    def to_dict(self) -> dict[str, float]: ...
    def has_effect(self, name: str) -> bool: ...
    def copy(self) -> Params: ...
