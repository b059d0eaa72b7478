/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Overtake: detects and tracks other cars with LiDAR. The only header that users include; C99 and newer, and C++.
 *
 * Units and frames: SI, radians, int64 nanoseconds. Right-handed frames, x forward, y left, z up: sensor, vehicle (rear
 * axle, on the ground), map (east, north, up). The library never prints or aborts, throws no exception to the caller,
 * and does not read the environment.
 *
 * Quick start:
 *   ovt_detector_def def = ovt_default_detector_def();
 *   def.sensors = sensors; def.sensor_count = 3; def.worker_count = 0;
 *   ovt_create_detector(&def, &detector); ovt_create_reader(detector, &reader);
 *   ... ovt_push_ego_pose(detector, &pose); ovt_push_scan(detector, &scan); ...          (any thread, one per sensor)
 *   if (ovt_next_frame(reader, &info) == OVT_OK) ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks);
 *
 * Threads, worker_count other than 1. All of these may run at the same time:
 *
 *   ovt_push_scan, ovt_push_points, ovt_end_scan    one thread per sensor
 *   ovt_push_ego_pose                               one thread
 *   ovt_push_detections                             one thread
 *   ovt_advance, ovt_flush                          one thread for both
 *   the functions of one reader                     one thread
 *   ovt_read_stats, ovt_read_runtime_info           any thread
 *   ovt_create_reader, ovt_destroy_reader           any thread; it calls the def's alloc and free
 *   ovt_destroy_detector                            while no other call is in the detector, except readers' calls
 *
 * Threads, worker_count 1 (the default): the library starts no thread. Every push finishes all work that it makes
 * possible before it returns. ovt_push_scan, ovt_push_points, ovt_end_scan, ovt_push_detections, ovt_advance and
 * ovt_flush belong to one thread; a second thread that calls one of them during such a call gets OVT_WRONG_THREAD.
 *
 * Stack of a thread that calls the library: 512 KiB; 64 KiB where worker_count is not 1. Each call computes in the
 * usual floating-point mode (round to nearest, no traps), on_frame and log run in it, and the thread gets its own back.
 *
 * fork(): the child may exec or exit. There ovt_destroy_... do nothing, and no other call is allowed. The child does
 * not get the detector's blocks (MADV_DONTFORK, not with `alloc`), so the parent keeps its pages. Stacks and the heap
 * belong to the process: the parent copies their pages, one fault each, after each fork.
 *
 * Compatibility: structs that the caller fills (and ovt_stats) start with struct_size, which their _init (or
 * ovt_default_...) function sets. For structs that the library fills, the inline functions pass the size to the
 * ..._sized functions. New versions append fields and never renumber enum values. A field that is not in the caller's
 * header has its default.
 */
/* clang-format off */
#ifndef OVERTAKE_H
#define OVERTAKE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define OVT_VERSION_MAJOR 0
#define OVT_VERSION_MINOR 2
#define OVT_VERSION_PATCH 0
#define OVT_VERSION (OVT_VERSION_MAJOR * 10000 + OVT_VERSION_MINOR * 100 + OVT_VERSION_PATCH)

#define OVT_API __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* ---- status and version ---------------------------------------------------------------------------------------- */

typedef enum ovt_status {
  OVT_OK = 0,
  OVT_BAD_ARGUMENT = 1,     /* a null pointer, or a count, stride, type or value out of bounds; nothing changed */
  OVT_BAD_VERSION = 2,      /* header and library do not match, or struct_size is unknown; nothing changed */
  OVT_UNKNOWN_NAME = 3,     /* no preset, parameter or ISA of that name */
  OVT_OUT_OF_RANGE = 4,     /* a parameter's value is outside its limits; at create also values that do not fit
                               together: an even smooth.window, smooth.order not below it, tracker hits above
                               tracker.window, more than 1,000 points of a path */
  OVT_NO_MEMORY = 5,        /* the allocator had no memory; nothing was kept */
  OVT_NO_THREADS = 6,       /* the system refused a thread */
  OVT_NO_FRAME = 7,         /* the reader has no (new) finished frame, or the frame no scan of that sensor */
  OVT_DUPLICATE = 8,        /* stamp equal to the last one of that sensor or stream, or a piece with a point that
                               came before; counted, not used */
  OVT_LATE = 9,             /* ego pose older than the last one, or piece of a scan that ended; counted, not used */
  OVT_TOO_MANY = 10,        /* more points, readers or rows than the def's capacity */
  OVT_INTERNAL = 11,        /* an exception was caught; counted, the next call works */
  OVT_NOT_KEPT = 12,        /* not available: keep_images was 0 at create */
  OVT_WRONG_THREAD = 13,    /* called from on_frame; worker_count 1 and another thread is in a call; or two threads push
                               scans of one sensor at the same time */
  OVT_NOT_COMPUTED = 14     /* the detector's method has no such image or stage */
} ovt_status;

OVT_API const char* ovt_status_text(ovt_status status);      /* one sentence, static memory, never null */

/* Of a library that is older than the header, the later fields are 0. */
typedef struct ovt_build_info {
  uint32_t version;                                          /* OVT_VERSION of the library */
  const char* version_text;                                  /* "0.2.0" */
  const char* commit;                                        /* git commit it was built from, or "unknown" */
  const char* compiler;                                      /* "g++ 12.2.0" */
  const char* isas;                                          /* ISAs that this CPU can run: "ref" or "ref sse2 avx2" */
} ovt_build_info;
OVT_API void ovt_read_build_info_sized(ovt_build_info* out, size_t out_size);
static inline void ovt_read_build_info(ovt_build_info* out) { ovt_read_build_info_sized(out, sizeof *out); }

/* ---- parameters ------------------------------------------------------------------------------------------------ */

/* Parameters of all presets. Text names (for files and command lines) are "group.name" with angles in degrees.
 * ovt_describe_param lists them with units, limits and meaning; ovt_reads_param tells which of them a preset reads. */
typedef struct ovt_params {
  size_t struct_size;
  double frame_period_s;             /* frame.period_s             sensors' period; of several rates, the fastest's */
  double frame_tolerance_s;          /* scans this close to a frame's first stamp join it */
  double gaps_limit_m;               /* gaps.limit_m */
  double gaps_limit_share;           /* gaps.limit_share */
  double angle_skip_rad;             /* angle.skip_deg */
  int32_t smooth_window;             /* smooth.window              sz_SG */
  int32_t smooth_order;              /* smooth.order */
  double ground_threshold_rad;       /* ground.threshold_deg       th_gnd */
  int32_t repair_window;             /* repair.window              w_s, columns */
  double repair_range_limit_m;       /* repair.range_limit_m       th_r */
  double cluster_threshold_rad;      /* cluster.threshold_deg      th_seg */
  double label_own_limit_m;          /* label.own_limit_m */
  double label_loser_limit_m;        /* label.loser_limit_m */
  double merge_distance_m;           /* merge.distance_m           th_mrg */
  int32_t merge_columns;             /* merge.columns              K */
  int32_t gate_min_points;           /* gate.min_points */
  double gate_slack;                 /* gate.slack                 share of the vehicle's length */
  double gate_map_margin_m;          /* this far outside the circuit counts as on it */
  double vehicle_length_m;           /* vehicle.length_m           of the cars to find */
  double vehicle_width_m;            /* vehicle.width_m */
  double pose_margin_m;              /* pose.margin_m */
  int32_t pose_min_var_points;       /* pose.min_var_points */
  double tracker_q_x, tracker_q_y;   /* tracker.q_x ...            Q_diag, per 50 ms */
  double tracker_q_speed, tracker_q_course, tracker_q_yaw_rate;
  double tracker_r_x, tracker_r_y;   /* tracker.r_x tracker.r_y    R_diag, m^2 */
  double tracker_birth_sigma_speed, tracker_birth_sigma_course_rad, tracker_birth_sigma_yaw_rate;
  double tracker_birth_speed_share;  /* tracker.birth_speed_share  of the ego speed */
  double tracker_gate_d2;            /* tracker.gate_d2            Mahalanobis distance squared */
  double tracker_gate_m;             /* tracker.gate_m             distance */
  int32_t tracker_window;            /* tracker.window             N */
  int32_t tracker_confirm_hits;      /* tracker.confirm_hits       M_c */
  int32_t tracker_keep_hits;         /* tracker.keep_hits          M_e */
  double tracker_max_silence_s;      /* tracker.max_silence_s */
  double tracker_predict_after;      /* tracker.predict_after      periods without a frame until tracks are predicted */
  double tracker_horizon_s, tracker_horizon_step_s;
  /* since 0.2 */
  double gate_ego_margin_m;          /* ego farther outside: the map is not used */
  double tracker_work_limit;         /* tracker.work_limit         the tracker's steps per frame, about 2 ns each; a
                                        count, not a time. OVT_FLAG_WORK_LIMIT */
  const char* method;                /* name of the preset, set by ovt_params_init (static memory): selects the
                                        detector's steps, rules and tracker. Null: "paper". The caller's own text must
                                        be valid during each call that reads it; create keeps no pointer to it */
  /* From here on: read by preset best only */
  double running_ground_height_m;    /* running_ground.height_m ...  ground removal; heights in m, slopes in m/m */
  double running_ground_known_per_m, running_ground_known_limit_m, running_ground_known_slope;
  double running_ground_known_reach_m, running_ground_guess_reach_m;
  double running_ground_guess_per_m, running_ground_guess_limit_m, running_ground_guess_slope;
  double running_ground_level_reach_m, running_ground_level_slack, running_ground_foot_rad;
  double join_gap_m;                 /* join.gap_m                 between clusters of one car */
  double join_slack_m;               /* join.slack_m               added to the vehicle's length and width */
  double join_bound_m;               /* join.bound_m               outside of the circuit */
  double gate_height_m;              /* gate.height_m              of a cluster, from its lowest to its highest point */
  double gate_width_slack_m;         /* gate.width_slack_m         added to the vehicle's width */
  double gate_inside_m;              /* gate.inside_m              centre of a car to the bounds of the circuit */
  double gate_range_m;               /* gate.range_m               centre of a car to the vehicle's origin */
  double gate_own_back_m;            /* gate.own_back_m ...        box of the own car, from the vehicle's origin */
  double gate_own_front_m, gate_own_side_m;
  double pose_front_length_m;        /* pose.front_length_m */
  double pose_angle_sigma_rad;       /* pose.angle_sigma_deg       of the line of sight, in var_x, var_y and cov_xy */
  double class_debris_m;             /* class.debris_m             size of OVT_CLASS_DEBRIS, at most */
  double ego_heading_wall_length_m;  /* ego_heading.wall_length_m ...  the ego heading, learned from walls */
  double ego_heading_wall_reach_m;   /* ego_heading.wall_reach_m */
  double ego_heading_wall_scatter_m; /* ego_heading.wall_scatter_m */
  double ego_heading_wall_sigma_rad; /* ego_heading.wall_sigma_deg */
  double ego_heading_wall_memory_s;  /* ego_heading.wall_memory_s */
  double ego_heading_constant_sigma_rad; /* ego_heading.constant_sigma_deg */
  double ego_heading_mounting_sigma_rad; /* ego_heading.mounting_sigma_deg */
  double ego_heading_slip_sigma_rad; /* ego_heading.slip_sigma_deg per m/s^2 */
  double gate_lowest_m, gate_top_m;  /* gate.lowest_m gate.top_m   heights of a cluster's points over the ground;
                                        the first at most the second */
  double smoke_dark_share;           /* smoke.dark_share           of the ground's intensity; 0: nothing is smoke */
  double smoke_near_share;           /* smoke.near_share           of the neighbouring pixels */
  double smoke_reach_m;              /* smoke.reach_m              difference of their ranges */
  double running_ground_fade_m;      /* running_ground.fade_m */
  double running_ground_start_per_m, running_ground_start_limit_m;
  double cut_threshold_rad;          /* cut.threshold_deg          weak links of clusters that may be two cars */
  double cut_step_m;                 /* cut.step_m */
  double cut_from, cut_to;           /* cut.from cut.to            in lengths of the vehicle; the first at most the
                                        second */
  double gate_wall_m;                /* gate.wall_m                without a map, from the line of a wall; 0: off */
  /* lane_tracker.q_along ...: the tracker */
  double lane_tracker_q_along, lane_tracker_q_across, lane_tracker_q_speed;
  double lane_tracker_q_course, lane_tracker_q_yaw_rate, lane_tracker_lane_s, lane_tracker_stand_mps;
  double lane_tracker_part_share, lane_tracker_steady_lag, lane_tracker_manoeuvre_gain;
  double lane_tracker_birth_speed_share, lane_tracker_birth_sigma_share, lane_tracker_birth_sigma_course_rad;
  double lane_tracker_birth_sigma_yaw_rate, lane_tracker_p_detect, lane_tracker_half_m, lane_tracker_p_hidden;
  double lane_tracker_p_wing, lane_tracker_clutter_per_m2, lane_tracker_clutter_reach_m;
  double lane_tracker_clutter_area_m2, lane_tracker_hit_score, lane_tracker_unknown_score, lane_tracker_low_m;
  double lane_tracker_low_score, lane_tracker_car_points, lane_tracker_sparse_score, lane_tracker_thin_score;
  double lane_tracker_confirm_score, lane_tracker_drop_score;
  double lane_tracker_most_score, lane_tracker_coast_s, lane_tracker_coast_sigma_m;
  int32_t lane_tracker_confirm_hits, lane_tracker_tentative_misses;
  double lane_tracker_path_turn_s, lane_tracker_path_speed, lane_tracker_path_across;
  double running_ground_free_level_m; /* running_ground.free_level_m  level_reach_m without a map or a pose on
                                        it (at most 1 m outside of the circuit, 100 ms away) */
  double pose_profile_points;         /* pose.profile_points */
  double frame_scan_limit;           /* frame.scan_limit           periods after which a scan in pieces is closed; 0:
                                        never. Read by every preset */
  int32_t segment_parts;             /* segment.parts              with several workers: one that is idle takes
                                        parts of another's segmentation, which is cut into up to so many. 1: none. The
                                        results are the same; each worker and the intake need 1.4 MB more for each
                                        further part (32 x 857 pixels; more for larger images). Parts above
                                        worker_count and worker_count 1: no effect. Read by every preset */
  double cut_in_line_from;           /* cut.in_line_from           in lengths of the vehicle */
  double cut_in_line_width;          /* cut.in_line_width          in widths of the vehicle */
  double cut_in_line_step_m;         /* cut.in_line_step_m */
  double cut_abreast_from;           /* cut.abreast_from           in widths of the vehicle */
  double cut_abreast_step_m;         /* cut.abreast_step_m */
  double gate_free_range_m;          /* gate.free_range_m          gate.range_m without a map or a pose, if smaller */
  double ego_heading_lever_sigma_m;  /* ego_heading.lever_sigma_m */
  double cut_strip_m;                /* cut.strip_m */
  double cut_wall_m;                 /* cut.wall_m */
} ovt_params;

typedef struct ovt_param_info {
  const char* name;                  /* "tracker.confirm_hits" */
  const char* unit;                  /* of the text form: "m", "deg", "" */
  const char* text;                  /* one sentence */
  int32_t is_integer;
  double value_default, value_min, value_max;   /* in the unit of the text form; default of preset "paper", and of
                                        "best" for the parameters that only best reads. ovt_params_init gives those of
                                        any preset */
} ovt_param_info;

/* preset: "paper" or "best". A struct of the first version cannot hold the preset's name, so for any but "paper" it
 * gets OVT_BAD_VERSION. */
OVT_API ovt_status ovt_params_init(ovt_params* params, size_t struct_size, const char* preset);
/* Names of the presets, "paper" first; static memory. NULL when index is negative or not smaller than their number. */
OVT_API const char* ovt_preset_name(int32_t index);
OVT_API int32_t ovt_param_count(void);
/* Non-zero when the method of `params` (null: paper) reads parameter `index`. Other parameters have no effect, but
 * ovt_create_detector checks their limits, too. */
OVT_API int32_t ovt_reads_param(const ovt_params* params, int32_t index);
OVT_API ovt_status ovt_describe_param_sized(int32_t index, ovt_param_info* out, size_t out_size);
static inline ovt_status ovt_describe_param(int32_t index, ovt_param_info* out) {
  return ovt_describe_param_sized(index, out, sizeof *out);
}
/* Text form. `value` is one number in the unit of the text form. Without OVT_OK nothing changes. */
OVT_API ovt_status ovt_set_param(ovt_params* params, const char* name, const char* value);
OVT_API ovt_status ovt_get_param(const ovt_params* params, const char* name, double* value);

/* ---- definitions: the input of ovt_create_detector ------------------------------------------------------------- */

enum { OVT_MAX_SENSORS = 8 };

typedef struct ovt_sensor_def {
  size_t struct_size;
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;        /* T_vehicle_sensor; z must point up (an inverted
                                                                sensor: turn its points by half a turn about x) */
  int32_t rows, cols;                /* image size; 1 to 1,024 and 1 to 16,384, default 32 x 857 */
  double azimuth_left_rad, azimuth_right_rad;                /* left and right edge of the image, default +-60 deg */
  int32_t wraps;                     /* non-zero: the columns cover a full turn from azimuth_left on */
  double range_min_m, range_max_m;   /* points outside are dropped */
  int32_t layer_first, layer_last;   /* layers of this sensor; others are dropped */
  int32_t point_capacity;            /* points per scan; a larger scan is refused and counted (pushed, dropped) */
  /* since 0.2 */
  double compensated_to_s;           /* NaN, the default: points are as measured. Else the driver has compensated them
                                        for the motion of the vehicle: all are placed as seen this long after the
                                        scan's stamp, +-1 s (0: at the stamp). Push the times of measurement with
                                        them all the same: other cars moved between */
} ovt_sensor_def;
OVT_API ovt_status ovt_sensor_def_init(ovt_sensor_def* def, size_t struct_size);

/* Race track map. Columns of `count` points in driving direction; create copies them. Either a centre line with widths,
 * or two bounds (then x_m to width_right_m are null). OVT_BAD_ARGUMENT: fewer than 3 points; a null column, except
 * banking_rad; values that are not finite; points beyond 1e8 m; equal neighbouring points (closer than 1e-6 m; the last
 * point of a closed line may repeat the first one); widths that are negative or beyond 4e8 m; banking beyond 1 rad; a
 * map that is nowhere 1 m wide; bounds that are swapped or run in opposite directions; a centre line and bounds.
 * Places on the map are by these points. Its headings and curvatures, too; in stretches of 50 m whose points are noisy
 * (a curvature that errs by more than 0.002 per m) they are smoothed over 3 to 12 m to either side.
 * banking_rad: angle of the road across the line, positive where the right side is higher. Only preset best reads it,
 * and only of a centre line (beside bounds it is not read). Null, or 0 everywhere: unknown, and best takes the cross
 * slope from the attitude of the ego poses. */
typedef struct ovt_map_def {
  size_t struct_size;
  int32_t closed;                    /* non-zero: the last point is followed by the first */
  int32_t count;
  const double *x_m, *y_m, *width_left_m, *width_right_m, *banking_rad;
  int32_t left_count, right_count;
  const double *left_x_m, *left_y_m, *right_x_m, *right_y_m;
} ovt_map_def;
OVT_API ovt_status ovt_map_def_init(ovt_map_def* def, size_t struct_size);

typedef enum ovt_push_policy {
  OVT_PUSH_REPLACE = 0,   /* live: the newest scan replaces a pending one. The producer does not wait for the library's
                             threads; only for another caller that closes this sensor's open scan in pieces at that
                             moment: some microseconds, if that thread keeps its CPU */
  OVT_PUSH_WAIT = 1       /* replay: a push waits until there is room; no scan is replaced */
} ovt_push_policy;

enum {                               /* ovt_detector_def.memory: what to request; ovt_runtime_info: what was granted */
  OVT_MEMORY_LOCK = 1,               /* mlock of the detector's blocks: they are never paged out. Stacks and code may
                                        still fault: see OVT_MEMORY_LOCK_PROCESS */
  OVT_MEMORY_HUGE = 2,               /* transparent huge pages (madvise) for blocks from 2 MiB on; not with `alloc` */
  OVT_MEMORY_LOCK_PROCESS = 4        /* mlockall: stacks, code and all later memory of the whole process, also after
                                        the detector is gone. With OVT_MEMORY_LOCK: no page fault after create */
};

typedef enum ovt_log_level { OVT_LOG_ERROR = 0, OVT_LOG_WARNING = 1, OVT_LOG_INFO = 2 } ovt_log_level;

typedef struct ovt_detector ovt_detector;
typedef struct ovt_reader ovt_reader;

/* Called by ovt_create_... only. Null, or a C++ exception: no memory. */
typedef void* ovt_alloc_fn(size_t bytes, size_t alignment, void* user);
typedef void ovt_free_fn(void* block, size_t bytes, void* user);
/* Logs one sentence per call, on the thread where the event happens: several threads may call it at the same time. It
 * calls no function of the detector. Logs create-time information (ISA, workers, refused requests, or why no detector
 * was created), and later each exception of a stage or of on_frame, the first refused call (and of each sensor the
 * first one of two producers), the first push with a bad argument, and that frames hang. Events of scans, points and
 * tracks are counters (ovt_stats) and flags, never log lines. */
typedef void ovt_log_fn(ovt_log_level level, const char* text, void* user);
/* Called for every finished frame, in order, one call at a time, on the thread that finished the frame: with
 * worker_count 1 the thread whose push, advance, flush or destroy finished it, else a thread of the library, or the
 * one that calls ovt_destroy_detector. The tracks of the next frame wait for on_frame, and other readers see the frame
 * only afterwards. The reader is valid during the call only and is positioned at that frame. From on_frame call only
 * ovt_read_...(reader) and ovt_set_path_horizon: ovt_push_scan, ovt_push_points, ovt_end_scan, ovt_push_detections,
 * ovt_advance and ovt_flush of the same detector return OVT_WRONG_THREAD, also in the on_frame of another detector that
 * is called from this one, and ovt_destroy_detector would wait for itself. on_frame may use the process's task
 * scheduler; its thread runs no stage of the detector meanwhile. */
typedef void ovt_frame_fn(ovt_reader* reader, void* user);

/* Start from ovt_default_detector_def(), then change what you need. Create copies everything. */
typedef struct ovt_detector_def {
  size_t struct_size;
  uint32_t version;                  /* OVT_VERSION of the caller's header */
  const ovt_sensor_def* sensors;
  int32_t sensor_count;              /* 1 to 8; 0: no LiDAR, only the tracker with pushed detections */
  const ovt_params* params;          /* NULL: preset paper */
  const ovt_map_def* map;            /* NULL: no map; psi_REF is the ego heading and no map gate applies */
  int32_t worker_count;              /* 1: no graph, no threads; n: a graph on n workers; 0: one per usable CPU, at
                                        least two */
  const char* isa;                   /* NULL: the best; "ref": the scalar reference; see ovt_build_info.isas */
  int32_t push_policy;               /* ovt_push_policy */
  int32_t cluster_capacity;          /* per sensor and per frame, 4,096: fences and mesh make 1,000 small clusters */
  int32_t candidate_capacity;        /* per frame and per push of detections, 256; at most 4,096, the tracker's limit */
  int32_t track_capacity;            /* 256; at most 4,096. If all detections and tracks are in each other's gates, a
                                        frame costs 0.2 ms with 64 of each, 5 with 256, 35 with 1,024, 140 with 4,096
                                        (bench/README.md); 256 spread over 600 m x 600 m 0.5. Up to five times as much
                                        if detections are at unrelated places in each frame. See tracker.work_limit */
  int32_t frames_in_flight;          /* frames in work at once, 3; one more while a frame waits for its sensors */
  int32_t reader_capacity;           /* readers that may exist at once, 4 */
  int32_t ego_pose_capacity;         /* ego poses kept, 1,024; at least 512 */
  ovt_alloc_fn* alloc;               /* NULL: the C library's */
  ovt_free_fn* free;
  ovt_log_fn* log;                   /* NULL: silent */
  ovt_frame_fn* on_frame;            /* NULL: poll with a reader */
  void* user;
  /* since 0.2 */
  const int32_t* cpus;               /* the library's threads run on these CPUs only: worker i on cpus[i % cpu_count],
                                        the intake on any. NULL: any CPU. worker_count 0 then is one per listed CPU,
                                        at least two. Workers come from a pool of the process: between frames other work
                                        of that pool may run on them, with these CPUs and this policy */
  int32_t cpu_count;
  int32_t fifo_priority;             /* 1 to 99: SCHED_FIFO for the library's threads, if the system allows it; 0: no */
  int32_t memory;                    /* OVT_MEMORY_... bits; default OVT_MEMORY_HUGE */
  int32_t spin_us;                   /* the library's threads look for work this long before they sleep: saves a
                                        wake-up, keeps the CPU busy; 0 to 1,000,000, default 0 */
  int64_t deadline_ns;               /* limit from the push of a frame's last scan to its tracks. A later frame is
                                        published with OVT_FLAG_DEADLINE_MISSED; 0: none */
  int64_t watchdog_ns;               /* the next push or advance logs and counts (stats.stalled) a frame that is in work
                                        for longer; 0: never; default 1 s. No effect with worker_count 1, where the
                                        caller waits for the frame */
  int32_t keep_images;               /* non-zero, the default: a frame keeps every image for ovt_read_image; 0: only
                                        OVT_IMAGE_PIXEL_POINT, and with preset best OVT_IMAGE_HEIGHT. Each worker then
                                        reuses one scratch copy of the others, which stays in its cache: less time, and
                                        less memory unless workers are many */
  int32_t stream;                    /* non-zero: the first steps of the segmentation run in ovt_push_points, while the
                                        pieces of a scan arrive; takes more memory. 0, the default: all work begins with
                                        the end of the scan. The results are the same */
} ovt_detector_def;
OVT_API ovt_status ovt_detector_def_init(ovt_detector_def* def, size_t struct_size);

/* Without `params` a detector has preset "paper", the publication to the letter. For a car, take preset "best":
 *   ovt_params params;
 *   ovt_params_init(&params, sizeof params, "best");
 *   def.params = &params; */
static inline ovt_detector_def ovt_default_detector_def(void) {
  ovt_detector_def def;
  memset(&def, 0, sizeof def);
  ovt_detector_def_init(&def, sizeof def);
  def.version = OVT_VERSION;
  return def;
}
static inline ovt_sensor_def ovt_default_sensor_def(void) {
  ovt_sensor_def def;
  memset(&def, 0, sizeof def);
  ovt_sensor_def_init(&def, sizeof def);
  return def;
}
static inline ovt_map_def ovt_default_map_def(void) {
  ovt_map_def def;
  memset(&def, 0, sizeof def);
  ovt_map_def_init(&def, sizeof def);
  return def;
}
/* Preset "paper". */
static inline ovt_params ovt_default_params(void) {
  ovt_params params;
  memset(&params, 0, sizeof params);
  ovt_params_init(&params, sizeof params, "paper");
  return params;
}

/* ---- create and destroy ---------------------------------------------------------------------------------------- */

OVT_API ovt_status ovt_create_detector(const ovt_detector_def* def, ovt_detector** out);
/* The same. `error`, if not null, is the caller's memory of error_size bytes; it receives a sentence that names the
 * wrong field ("" on OVT_OK). */
OVT_API ovt_status ovt_create_detector_verbose(const ovt_detector_def* def, ovt_detector** out, char* error,
                                               size_t error_size);
/* Order of a shut-down: stop the producers, ovt_flush if readers need the last frames, destroy the readers, destroy the
 * detector. NULL is allowed. Finishes all frames of the scans and detections that were pushed, also the open frame (not
 * scans in pieces that are not ended, nor those that are held because of their stamp): on_frame is called for them, so
 * `user` must outlive this call. Readers that still exist stay valid until destroyed, but get no new frames; with the
 * def's alloc and free, `user` must outlive the last of them, too. */
OVT_API void ovt_destroy_detector(ovt_detector* detector);

/* What create granted of the def's requests. worker_count is smaller than requested when something else in the process
 * limits the threads of the task scheduler. When no thread is left, create fails with OVT_NO_THREADS. A limit that the
 * process sets after create takes workers away. If none is left, no frame ends while the limit exists, and calls that
 * wait for frames do not return: ovt_flush, ovt_destroy_detector, pushes with OVT_PUSH_WAIT. */
typedef struct ovt_runtime_info {
  const char* isa;
  int32_t worker_count;
  int32_t pinned;                    /* threads of the library pinned to their CPU */
  int32_t fifo;                      /* threads of the library that run SCHED_FIFO */
  int64_t memory_bytes;              /* of all blocks of the detector */
  int64_t locked_bytes, huge_bytes;  /* of memory_bytes: mlocked; advised as huge pages */
  int32_t process_locked;            /* non-zero: mlockall succeeded */
} ovt_runtime_info;
OVT_API ovt_status ovt_read_runtime_info_sized(ovt_detector* detector, ovt_runtime_info* out, size_t out_size);
static inline ovt_status ovt_read_runtime_info(ovt_detector* detector, ovt_runtime_info* out) {
  return ovt_read_runtime_info_sized(detector, out, sizeof *out);
}

/* ---- input ----------------------------------------------------------------------------------------------------- */

typedef enum ovt_type {
  OVT_NONE = 0, OVT_F32 = 1, OVT_F64 = 2, OVT_I8 = 3, OVT_U8 = 4, OVT_I16 = 5, OVT_U16 = 6, OVT_I32 = 7, OVT_U32 = 8
} ovt_type;

/* One field of a scan: value i is at (const char*)data + i * stride. OVT_NONE: the field is absent. */
typedef struct ovt_column {
  const void* data;
  size_t size_bytes;                 /* readable bytes from data on; the library reads nothing beyond */
  size_t stride;                     /* at least the type's size. Neither data nor stride need be aligned: packed
                                        records, such as PointCloud2 of 22 bytes a point, are read where they lie */
  int32_t type;                      /* ovt_type */
} ovt_column;

/* One member of an array of records: scan.x = OVT_FIELD(points, count, x, OVT_F32). `records` is the array, or a
 * pointer to its first record; it must not be null, and the macro evaluates it more than once. size_bytes reaches from
 * the member of the first record to the end of the last record; 0 if count is 0 or less. */
static inline ovt_column ovt_make_column(const void* records, const void* member, int64_t count, size_t record_size,
                                         int32_t type) {
  ovt_column column;
  column.data = member;
  column.size_bytes =
    count > 0 ? (size_t)count * record_size - (size_t)((const char*)member - (const char*)records) : 0;
  column.stride = record_size;
  column.type = type;
  return column;
}
#define OVT_FIELD(records, count, member, type) \
  ovt_make_column((records), &(records)->member, (int64_t)(count), sizeof *(records), (type))

/* One scan of one sensor, sensor frame.
 *   x, y, z      float32 or float64; as measured, not compensated for the motion of the vehicle during the scan, unless
 *                ovt_sensor_def.compensated_to_s says so
 *   layer        any integer, or floats that hold integers; 0..65535. The id of the point's ring
 *   intensity    any type, optional; absent: 0. A reflectivity, or a signal that falls with the range (smoke is dark)
 *   time         any type, optional: the point's offset after the scan's stamp, in units of time_unit_ns. Beyond
 *                +-2.147 s it counts as 0, like an absent time. So subtract the stamp from times since 1970 or since
 *                midnight before: without offsets a scan is not corrected for the motion during it */
typedef struct ovt_points {
  size_t struct_size;
  int32_t sensor;                    /* index in the def */
  int32_t count;                     /* may be 0: an empty scan, whose columns have types all the same, is valid */
  int64_t stamp_ns;
  ovt_column x, y, z, layer, intensity, time;
  double time_unit_ns;
  /* since 0.2 */
  int32_t first;                     /* ovt_push_points: index in the scan of the first of these points; -1, the
                                        default: they follow all that came before. ovt_push_scan does not read it */
} ovt_points;
OVT_API ovt_status ovt_points_init(ovt_points* points, size_t struct_size);
static inline ovt_points ovt_default_points(void) {
  ovt_points points;
  memset(&points, 0, sizeof points);
  ovt_points_init(&points, sizeof points);
  return points;
}

/* Copies one scan into its sensor's mailbox. With OVT_PUSH_REPLACE, a scan that still waited there is dropped and
 * counted. The stamp decides how the scan is used:
 *
 *   equal to the sensor's last stamp              not used: OVT_DUPLICATE
 *   equal to an earlier one that was used, at     not used: OVT_OK, counted as `dup`
 *   most 0.5 s older than the newest stamp
 *   new, but preset best: the points are those    not used from the second such scan on, while the ego vehicle moves
 *   of the sensor's scan before                   and if the sensor ever saw other points: OVT_OK, counted as `dup`
 *   within frame.tolerance_s of the first stamp   used: joins that frame
 *   of the open frame, which lacks the sensor
 *   up to 0.5 s older than the newest stamp       used: a separate frame, which the tracker inserts at its stamp, up to
 *                                                 31 iterations back (frames and pushed detections): beyond that its
 *                                                 measurements are late (ovt_stats.measurements_late)
 *   older than that                               not used: counted as `late`
 *   ahead of the other sensors by more than       held until the other sensors have delivered newer stamps. Used when
 *   frame.tolerance_s + frame.period_s            they come within frame.tolerance_s of it, or within the sum if
 *                                                 they had a gap or it is no further from its sensor's last good
 *                                                 stamp than they came meanwhile; when more sensors have such a
 *                                                 stamp than continue without it (a common gap); or when no other
 *                                                 sensor is good (if they went on without it before, or if it is
 *                                                 new: after 24 of its stamps). Else counted as `late`;
 *                                                 suspect_mask names the sensor. ovt_flush ends the wait:
 *                                                 counted as `late`. Not held, but used, if the sensor came there with
 *                                                 a stamp in each of its intervals (the others lose scans). So it is
 *                                                 if the others' scans take longer on their way: if it is ahead by at
 *                                                 most frame.tolerance_s more than its last 8 to 16 good stamps were
 *                                                 when they came, and by 0.5 s less twice the sum at most. Not held,
 *                                                 but `late`, if it is over 1 s (3 periods, if longer) ahead of the
 *                                                 newest stamp
 *   else                                          used
 *
 * Two sensors form no majority. If one steps ahead, it is the suspect. If two drift apart, both are used up to 0.5 s
 * less twice the sum of tolerance and period; beyond that the one ahead is the suspect. Of three sensors and more, one
 * whose scans always arrive earlier than those of all others, by more than the sum, may be a suspect: their clocks
 * agree.
 * After a gap of over 1 s (3 periods, if longer), or when a clock went back, the library accepts the third consistent
 * stamp in a row, if more sensors report the new time than deliver good stamps (OVT_FLAG_CLOCK_JUMP: the tracker
 * restarts). The two scans before it are counted as `dropped`. Stamps are consistent if each is newer than the last by
 * up to that gap, or by up to 10 s and half to twice the step before: so a single sensor, or without sensors a source
 * of detections, may be as slow as that, and its gaps up to twice its interval. In the first two rounds of three or
 * more sensors, while only one of them has a good stamp, the majority decides at once; and the first scan of all
 * decides against the time of detections that were pushed before. */
OVT_API ovt_status ovt_push_scan(ovt_detector* detector, const ovt_points* scan);

/* A scan in pieces (packets, lines), of any size and number: each call copies more points of the scan with this stamp,
 * the last call ends it. The results are, byte for byte, those of one ovt_push_scan of the whole scan; nothing of a
 * scan is used before its end. The first piece, or the end of a scan without points, begins a scan; stamp_ns is that of
 * the whole scan in every piece. Pieces may differ in the types of their fields and in time_unit_ns.
 *
 * With `first`, the index of its first point, each piece goes to its place. Without (-1) lost, doubled and reordered
 * pieces cannot be recognised.
 *
 *   a piece out of order within its scan          used; the results do not depend on the order
 *   a piece with a point that came before         not used at all: OVT_DUPLICATE (pieces_dup)
 *   a piece that is lost                          the scan has fewer points: incomplete
 *   a piece of a scan that is over                not used: OVT_LATE (pieces_late). A scan is over if it is one of the
 *                                                 last eight that ended, or up to 1 s older than the open scan, also
 *                                                 if no piece of it came before. Except where the open scan is over
 *                                                 three intervals newer than the last one, and the piece's stamp is
 *                                                 nearer to the last one: then the open scan's stamp is wrong. It is
 *                                                 closed (scans_unended), and the piece begins its scan
 *   more points than point_capacity               OVT_TOO_MANY: the whole scan is dropped, as by ovt_push_scan, and the
 *                                                 other pieces of this scan are refused too (pieces_dropped)
 *
 * ovt_end_scan: point_count is the number of points that the sensor sent, so that a lost last piece is noticed; -1:
 * unknown. Not above the index of each point that came: OVT_BAD_ARGUMENT, and the scan stays open. It may be above
 * point_capacity: the missing points are only counted. OVT_LATE, not counted, if the scan is over (as above).
 * OVT_TOO_MANY if it was dropped for its points.
 * A scan that is not ended is closed, as incomplete (scans_unended), by the next scan of its sensor, by ovt_flush, when
 * ovt_advance reports a time that is frame.scan_limit periods after its stamp, or when the stamps of another sensor's
 * scans, those that were pushed whole or ended by ovt_end_scan, have advanced by as much since its first piece. From
 * one stamp to the next, at most half of that time counts: most of a longer step may lie before the first piece. For a
 * sensor slower than frame.period_s the periods are its own intervals, known from its second scan on. Never by a clock
 * of the machine.
 * An incomplete scan is used: OVT_FLAG_SCAN_INCOMPLETE, incomplete_mask, points_missing. What it does not show is not
 * free: no track counts a miss for it, and no object in it is OVT_CLASS_DEBRIS.
 * With OVT_PUSH_REPLACE, the end of a scan replaces a scan that still waits; an open scan replaces nothing. A scan
 * counts as pushed when it ends. */
OVT_API ovt_status ovt_push_points(ovt_detector* detector, const ovt_points* piece);
OVT_API ovt_status ovt_end_scan(ovt_detector* detector, int32_t sensor, int64_t stamp_ns, int32_t point_count);

typedef struct ovt_ego_pose {
  size_t struct_size;
  int64_t stamp_ns;
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;        /* T_map_vehicle */
  double speed_mps, yaw_rate_rps;                            /* along x; about z */
} ovt_ego_pose;
OVT_API ovt_status ovt_ego_pose_init(ovt_ego_pose* pose, size_t struct_size);
/* A frame uses the poses pushed before its last scan; the ground removal of preset best, which runs while scans arrive,
 * those pushed before the scan itself. Stamps must grow. The third increasing stamp in a row that is over 0.5 s older,
 * or within the last step forward, means that the clock went back. A pose that is newer than the last one by more than
 * two intervals and 10 ms (150 ms while the interval is unknown) returns OVT_OK and waits for the next pose: if that
 * one continues from it, both are used, else the waiting pose is dropped. Poses that stepped ahead of the sensors by
 * more than frame.tolerance_s plus frame.period_s, beyond their usual lead, are not used while they stay ahead: frames
 * use the earlier poses, which become stale, and set OVT_SUSPECT_EGO. OVT_BAD_ARGUMENT, and the pose is not used, for
 * values that no car's pose has: x, y or z beyond 1e8 m, an angle beyond 1e6 rad, a speed beyond 1e3 m/s, a yaw rate
 * beyond 100 rad/s, NaN. If speed and yaw rate are not measured, push those of the last poses: poses between these are
 * found with them, and new tracks begin near the speed.
 * With OVT_PUSH_WAIT and workers it waits for the scans that were pushed before, if it would overwrite poses that they
 * use: so the poses of a frame do not depend on worker_count, if one thread pushes poses and scans.
 * Preset best: roll and pitch that are both 0, or stay the same over a way, mean that nothing measured them (a
 * localisation in the plane). Such a pose tells no heights of the road, and on the circuit of a map with banking it
 * gets the attitude of a vehicle on the bank. A place that is held at speed is moved on, and not used after 0.15 s
 * (ego_held); a yaw rate that the yaws contradict is replaced (ego_rates_wrong); a place with noise is smoothed
 * (ego_noisy). See pipeline/README.md, "Poses that contradict themselves". */
OVT_API ovt_status ovt_push_ego_pose(ovt_detector* detector, const ovt_ego_pose* pose);

typedef enum ovt_reference { OVT_REFERENCE_VEHICLE = 0, OVT_REFERENCE_MAP = 1 } ovt_reference;

/* Detections of another detector (radar, neural network), all with one stamp: one iteration of the tracker, in the
 * order of stamps with the frames. Push them when they come, before or after the scans of the same time: scans that
 * come later are inserted (OVT_FLAG_OUT_OF_SEQUENCE) and still share a frame. Detections that are 3 periods newer than
 * the first stamp of the open frame close it. Without an ego pose, rows in the map (reference) are lost once scans are
 * tracked in the vehicle frame (ovt_stats.measurements_lost): the first scan ends the tracks of such rows.
 * Columns of `count`, aligned as doubles (else OVT_BAD_ARGUMENT); all but x and y may be null, or NaN per row, but
 * var_x and var_y go together (one without the other: OVT_BAD_ARGUMENT); without cov_xy the variances are independent.
 * Rows that still wait from an earlier push follow the push policy. More than candidate_capacity rows: OVT_TOO_MANY,
 * external_dropped. Where the source of rows looks is not known: a push without a row for a track counts as a miss of
 * that track; with preset best only if an earlier row was one of its hits.
 * While a sensor delivers good stamps, detections never move the clock. If their source began after
 * all sensors had stopped, it becomes the clock after 24 pushes, or when ovt_advance reports the sensors' silence. If
 * detections are ahead of the sensors by more than frame.tolerance_s plus frame.period_s, they are held until the
 * sensors come near them. They are dropped (OVT_SUSPECT_DETECTIONS) when the sensors advance by more than that and are
 * still behind, when more than eight pushes wait, or at ovt_flush. Without sensors, detections are the clock. */
typedef struct ovt_external_detections {
  size_t struct_size;
  int64_t stamp_ns;
  int32_t count;
  int32_t reference;                 /* ovt_reference of x, y, heading and covariance */
  const double *x_m, *y_m, *heading_rad, *var_x, *var_y, *cov_xy;
  /* Of the object's box: along and across its heading, and upwards from the road. Its detector's confidence that it is
   * a car, 0 to 1. Preset `best`: of a new track, a row of a low score or a low box counts less (pipeline/README.md,
   * "Pushed rows"); `paper` reads neither height nor score.
   * A value that no car has counts as NaN (row_values_ignored): a heading beyond 1e6 rad, a length or width below 0 or
   * above 1e3 m, a height beyond 1e3 m, a score outside of 0 to 1, infinity. So does a covariance that is not positive
   * definite, or whose variances are not in 1e-12 to 1e12 m2: it becomes tracker.r_x and r_y. A row whose x or y is
   * NaN or beyond 1e8 m is not used (measurements_rejected). */
  const double *length_m, *width_m, *height_m, *score;
} ovt_external_detections;
OVT_API ovt_status ovt_external_detections_init(ovt_external_detections* detections, size_t struct_size);
OVT_API ovt_status ovt_push_detections(ovt_detector* detector, const ovt_external_detections* detections);

/* Reports the current time: closes a frame that has waited for a sensor for 1.5 periods since its first stamp, and
 * predicts the tracks when no frame came for tracker.predict_after (OVT_FLAG_PREDICTION). The next scan of any sensor
 * closes such a frame, too, so ovt_advance is needed only when all sensors may be silent. Works the same in replay and
 * live use: the library never reads a clock for this. now_ns is in the time of the sensors' stamps: in live use,
 * subtract the usual time from a scan's stamp to its push, or frames close before their last scans come. A call that
 * closes a frame predicts nothing. The time is used after what was pushed before the call. With several workers and
 * OVT_PUSH_REPLACE the call does not wait; if another one comes before this time is used, only the later time is. */
OVT_API ovt_status ovt_advance(ovt_detector* detector, int64_t now_ns);
/* Closes scans in pieces that are not ended (not one whose producer is in a call at that moment) and the open frame,
 * and returns when every pushed scan is finished. */
OVT_API ovt_status ovt_flush(ovt_detector* detector);

/* ---- output: readers and frames -------------------------------------------------------------------------------- */

/* Each reader belongs to one thread. Its results stay valid until its next ovt_next_frame, or until the on_frame
 * callback returns. ovt_read_tracks writes into the reader, so its columns are also invalid after the next
 * ovt_read_tracks. */
OVT_API ovt_status ovt_create_reader(ovt_detector* detector, ovt_reader** out);
OVT_API void ovt_destroy_reader(ovt_reader* reader);

enum {                               /* ovt_frame_info.flags */
  OVT_FLAG_NO_EGO = 1,               /* tracks are in the vehicle frame: no frame had an ego pose so far, and no rows
                                        pushed in the map came first. See ego_known */
  OVT_FLAG_NO_MAP = 2,               /* no map: no map gate, psi_REF is the ego heading */
  OVT_FLAG_SENSOR_MISSING = 4,       /* not every sensor is in this frame (never set for pushed detections) */
  OVT_FLAG_SENSOR_STALE = 8,         /* a sensor is silent for more than 1.5 periods (see stale_mask); one whose
                                        interval is over 1.5 times that of the fastest, up to 4 periods, from its ninth
                                        scan on: for more than 1.5 of its own intervals */
  OVT_FLAG_EGO_STALE = 16,           /* the nearest ego pose is over 100 ms away in time */
  OVT_FLAG_CLOUD_DEGRADED = 32,      /* more than half of a scan's points are bad (points_bad: not_finite to
                                        layer_dropped), or it has no good one; or more than 3 of 4 are in a pixel that a
                                        point at another range won (dust, second_return), as with a wrong layer */
  OVT_FLAG_NO_DATA = 64,             /* no valid point, or a prediction: this is not "all clear" */
  OVT_FLAG_OVERFLOW = 128,           /* a capacity was reached; the nearest were kept, of clusters first those of
                                        three points or more */
  OVT_FLAG_CLOCK_JUMP = 256,
  OVT_FLAG_DEADLINE_MISSED = 512,
  OVT_FLAG_EXTERNAL = 1024,          /* an iteration of pushed detections */
  OVT_FLAG_OUT_OF_SEQUENCE = 2048,   /* older than an earlier frame: the tracker inserted it at its stamp, and its
                                        tracks are those of the newest stamp (tracks_stamp_ns) */
  OVT_FLAG_PREDICTION = 4096,        /* made by ovt_advance: contains no sensor, the tracks are predicted */
  OVT_FLAG_EXCEPTION = 8192,         /* a stage threw. In a segmentation: the frame does not contain that sensor. In a
                                        later stage: the frame has no detections and the tracks are predicted */
  OVT_FLAG_EGO_OFF_MAP = 16384,      /* the ego pose is outside of the circuit by more than gate.ego_margin_m or, if
                                        that is larger, gate.map_margin_m (a jump, a wrong map, the pit lane): this
                                        frame does not use the map. No map gate, psi_REF is the ego heading, map_s_m and
                                        map_d_m are 0, and new tracks take the ego course */
  OVT_FLAG_WORK_LIMIT = 32768,       /* dense clutter needed more work than tracker.work_limit. Either a late frame was
                                        not used (its rows are measurements_late), or each track was compared with the
                                        nearest detections only, and the assignment is not the cheapest */
  OVT_FLAG_CLOCK_SUSPECT = 65536,    /* stamps of a source were refused (see suspect_mask) */
  OVT_FLAG_EGO_HEADING = 131072,     /* ego_heading_offset_rad is not known well: too few walls were seen so far, or
                                        the walls of this frame contradict it. Never set if the method does not correct
                                        the ego heading */
  OVT_FLAG_SCAN_INCOMPLETE = 262144, /* a scan in pieces lacks points, or did not end (see incomplete_mask): this is not
                                        "all clear" */
  OVT_FLAG_NO_GROUND = 524288,       /* preset best: of a scan of 1000 good points or more, not counting objects that
                                        begin nearer than 3 m, fewer than 1 of 50 is ground. Something is in front of
                                        the sensor, or the ego poses' pitch or roll, the mounting or the map is wrong:
                                        then its cars are lost among the road's points. This is not "all clear" */
  OVT_FLAG_EGO_JUMP = 1048576,       /* preset best, with ego poses in the map: the ego pose is 0.5 m or more from
                                        where the places before lead (0.65 m at 10 Hz, 2 m at 5 Hz); if less than 5 m,
                                        the pushed speed, yaw rate and heading do not lead there either, and the tracks
                                        that no pushed row was a hit of have moved with it. After a farther jump tracks
                                        that are not seen again soon end */
  OVT_FLAG_VIEW_BLOCKED = 2097152    /* preset best: for 0.25 s a sensor has no return in 3 deg or more of its columns
                                        (see blocked_mask): something is on its window, a part of the own car is in
                                        front of it, its driver crops the view, or it looks over a crest into the sky.
                                        Cars behind that are not seen, and a track that is lost there counts as outside
                                        of the view. Told by scans of which 20 % are ground; a scan out of sequence has
                                        what the newest ones have shown. Azimuths of the def that end at the own car
                                        keep it from being set for ever */
};

enum {                               /* ovt_frame_info.suspect_mask, besides bit s for sensor s */
  OVT_SUSPECT_DETECTIONS = 256,      /* pushed detections */
  OVT_SUSPECT_EGO = 512              /* ego poses */
};

typedef struct ovt_frame_info {
  int64_t sequence;                  /* from 0, no gaps */
  int64_t first_stamp_ns, stamp_ns;  /* stamps of the first and the last scan */
  uint32_t sensor_mask;              /* bit s: the frame contains sensor s */
  uint32_t flags;
  int32_t reference;                 /* ovt_reference of the tracks */
  int32_t ego_known;                 /* non-zero: the ego pose at stamp_ns is known */
  double ego_x_m, ego_y_m, ego_yaw_rad, ego_speed_mps;
  int32_t point_count, cluster_count, candidate_count;       /* candidates: before the map gate; best: without those
                                        that are no solid body */
  int32_t detection_count, track_count;
  /* since 0.2 */
  uint32_t stale_mask;               /* bit s: sensor s is silent (OVT_FLAG_SENSOR_STALE): its view is unknown */
  int32_t refiltered;                /* iterations that the tracker repeated because of a late stamp */
  int64_t latency_ns;                /* from the last scan's push to the tracks, by the steady clock; -1: no scan */
  int64_t tracks_stamp_ns;           /* stamp_ns, or the newest frame's stamp if this frame came out of sequence */
  double ego_off_map_m;              /* largest distance of the ego pose outside of the circuit during this frame: 0
                                        on it, and without a map or a pose; at most 1e9. See OVT_FLAG_EGO_OFF_MAP */
  int32_t gated_points, gated_size;  /* clusters with fewer than gate.min_points points; longer than a vehicle, with
                                        preset best also wider, higher, too high over the ground, or no solid body of a
                                        car (smoke, rain, a piece of road, a sign, a reflector) */
  int32_t gated_map;                 /* candidates outside of the circuit; best: nearer to a bound than
                                        gate.inside_m and no car beyond doubt, or, where no bounds are known, at a
                                        wall or behind it */
  int32_t overflow_candidates;       /* candidates beyond candidate_capacity */
                                     /* cluster_count = gated_points + gated_size + gated_own + candidate_count;
                                        candidate_count = gated_map + gated_range + overflow_candidates
                                        + detection_count */
  uint32_t suspect_mask;             /* sources with a refused stamp, set in each frame closed after it until the third
                                        good stamp of the source in a row (ego poses: for three frames) or a clock jump.
                                        Bit s: sensor s; OVT_SUSPECT_... */
  int32_t gated_own, gated_range;    /* preset best: clusters of the own car's points; candidates out of range */
  /* Error of the ego heading (slip, a constant, noise) at stamp_ns: detections go to the map, and to the tracks, with
     ego_yaw_rad + ego_heading_offset_rad. The pushed poses and ego_yaw_rad stay as they are. 0: preset paper, no ego
     pose. See OVT_FLAG_EGO_HEADING */
  double ego_heading_offset_rad;
  double ego_heading_sigma_rad;      /* its standard deviation */
  int32_t ego_wall_points;           /* points of walls that this frame compared with the map's bounds */
  uint32_t incomplete_mask;          /* bit s: the scan of sensor s is incomplete (ovt_push_points) */
  uint32_t blocked_mask;             /* bit s: a part of the view of sensor s is blocked (OVT_FLAG_VIEW_BLOCKED) */
  float blocked_rad;                 /* the widest such part of the frame's sensors, 0: none */
  float blocked_left_rad;            /* its left edge, an azimuth of the sensor blocked_sensor, in (-pi, pi] */
  int32_t blocked_sensor;
} ovt_frame_info;

/* Moves the reader to the latest finished frame; `out` may be null. OVT_NO_FRAME when there is no newer one: the reader
 * keeps its frame. */
OVT_API ovt_status ovt_next_frame_sized(ovt_reader* reader, ovt_frame_info* out, size_t out_size);
OVT_API ovt_status ovt_read_info_sized(ovt_reader* reader, ovt_frame_info* out, size_t out_size);
static inline ovt_status ovt_next_frame(ovt_reader* reader, ovt_frame_info* out) {
  return ovt_next_frame_sized(reader, out, sizeof *out);
}
static inline ovt_status ovt_read_info(ovt_reader* reader, ovt_frame_info* out) {
  return ovt_read_info_sized(reader, out, sizeof *out);
}

/* ---- output: detections and tracks ----------------------------------------------------------------------------- */

/* The library returns no NaN and no infinity, for any input, except in the points of ovt_labels, which are as pushed.
 * Unknown values are 0, and another field tells that they are unknown:
 *   ego pose                        ovt_frame_info.ego_known
 *   map_s_m, map_d_m                OVT_FLAG_NO_MAP, OVT_FLAG_EGO_OFF_MAP, and the age of the ego pose
 *   length_m, width_m of a track    0 itself: only pushed detections without a size updated the track */

typedef enum ovt_view {              /* side of a car that the sensor faces: where it sees the car's end */
  OVT_VIEW_REAR = 0, OVT_VIEW_FRONT = 1, OVT_VIEW_SIDE = 2
} ovt_view;

typedef enum ovt_object_class {
  OVT_CLASS_UNKNOWN = 0,             /* too few points, partly hidden, among smoke */
  OVT_CLASS_CAR = 1,
  OVT_CLASS_DEBRIS = 2               /* smaller than what a car would show at this distance */
} ovt_object_class;

/* Columns of `count`, vehicle frame at each row's stamp. Here and in every other table, a column that the detector's
 * method does not compute is null. */
typedef struct ovt_detections {
  int32_t count;
  const int64_t* stamp_ns;
  const float *x_m, *y_m, *z_m;      /* centre of the imposed rectangle; best: of the car, by the side that is seen.
                                        z of the centroid */
  const float* heading_rad;          /* best: psi_VAR without its error and towards the car's front, where the points
                                        show both of its ends; psi_REF of the map less ego_offset_rad */
  const int32_t* heading_source;     /* 0 map or ego heading (psi_REF), 1 points (psi_VAR) */
  const float *length_m, *width_m;   /* extent of the points along and across the heading */
  const int32_t* point_count;
  const int32_t *inliers_ref, *inliers_var;
  const float *heading_ref_rad, *heading_var_rad;
  const float *ref_x_m, *ref_y_m, *var_x_m, *var_y_m;        /* centres of both rectangles */
  const int32_t* sensor_mask;
  const int32_t* cluster;            /* merged cluster; see ovt_labels.cluster_of_label */
  const float *map_s_m, *map_d_m;    /* centroid on the map; 0 without map or ego pose, or if the pose is off the map */
  const uint64_t* track;             /* id of the associated track, 0 none */
  /* null with preset paper */
  const float *var_x, *var_y, *cov_xy;   /* covariance of x_m, y_m, m^2, axes of the vehicle frame. With an ego pose
                                        it includes the error of the corrected ego heading, by the walls that the
                                        sensor with the most points has seen */
  const int32_t* view;               /* ovt_view, from the sensor with the most points */
  const int32_t* object_class;       /* ovt_object_class; initiates no track if it is OVT_CLASS_DEBRIS */
  const float *road_z_m, *height_m;  /* z of the road under the object, vehicle frame; height of its highest point over
                                        that road */
  const float* ego_offset_rad;       /* the row went to the map with the ego heading at stamp_ns plus this: slip, noise
                                        of the poses, mounting. 0 without ego pose. See OVT_FLAG_EGO_HEADING */
} ovt_detections;
OVT_API ovt_status ovt_read_detections_sized(ovt_reader* reader, ovt_detections* out, size_t out_size);
static inline ovt_status ovt_read_detections(ovt_reader* reader, ovt_detections* out) {
  return ovt_read_detections_sized(reader, out, sizeof *out);
}

/* Publish time for ovt_read_tracks: the frame's time (ovt_frame_info.tracks_stamp_ns). */
#define OVT_AT_FRAME_STAMP INT64_MIN

typedef enum ovt_track_state { OVT_TENTATIVE = 0, OVT_CONFIRMED = 1 } ovt_track_state;

typedef enum ovt_track_flag {        /* ovt_tracks.flags: a track's health */
  OVT_TRACK_COASTING = 1,            /* this frame has no measurement of the track: predicted */
  OVT_TRACK_UNOBSERVED = 2,          /* this frame tells nothing of the track's position, so it is not a miss: no sensor
                                        with a usable point looks there, or (best) the frame is of pushed rows, none of
                                        which was one of the track's hits */
  OVT_TRACK_STALE = 4                /* the last measurement is more than 0.5 s before publish_ns */
} ovt_track_flag;

typedef enum ovt_visibility {        /* why a frame has a detection of a track, or none */
  OVT_VISIBILITY_SEEN = 0,           /* it has one (debris, too), or points too few for one: unseen_s counts from it */
  OVT_VISIBILITY_MISSED = 1,         /* none, although a sensor could see the track's position */
  OVT_VISIBILITY_HIDDEN = 2,         /* none: another confirmed car is in front */
  OVT_VISIBILITY_OWN_SHADOW = 3,     /* none: blind zone straight behind, in the shadow of the own car's rear wing */
  OVT_VISIBILITY_OUTSIDE = 4         /* none: outside of the fields of view of the frame's sensors */
} ovt_visibility;

/* Columns of `count`, by slot. Frame of reference: ovt_frame_info.reference. */
typedef struct ovt_tracks {
  int32_t count;
  int64_t publish_ns;
  const uint64_t* id;                /* never 0, never reused */
  const int32_t* state;              /* ovt_track_state */
  const int64_t* measured_ns;        /* stamp of the last measurement */
  const double *x_m, *y_m, *speed_mps, *course_rad, *yaw_rate_rps;
  const double* covariance[15];      /* lower triangle of P over (x, y, v, course, yaw rate), row by row */
  const double* heading_rad;         /* paper: of the last detection, advanced by the yaw rate (of pushed rows without
                                        one: the course); in the map frame, the course of a confirmed track in motion
                                        decides which end is the front. best:
                                        measured, with a rate of its own, where the car's angle or its front is seen,
                                        else the course (its opposite for a car that rolls backwards) */
  const double *length_m, *width_m;  /* extent of the last detection */
  const int32_t *age, *hits;         /* iterations of the tracker in which a sensor could see the track, its initiation
                                        included; those of the last tracker.window of them (default 20) in which it had
                                        a measurement */
  const int32_t* detection;          /* row of this frame's ovt_detections (of a frame of pushed detections: of the
                                        rows as pushed), -1 none */
  int32_t path_points;               /* predicted path: point k of track i at [i * path_points + k] */
  double path_step_s;                /* ... is at publish_ns + (k + 1) * path_step_s */
  const double *path_x_m, *path_y_m, *path_course_rad, *path_speed_mps, *path_var_x, *path_var_y, *path_cov_xy;
  const uint32_t* flags;             /* since 0.2: ovt_track_flag bits */
  /* null with preset paper */
  const double* existence;           /* probability that the track is a car, 0 to 1, after the newest frame of scans or
                                        pushed rows. A car that was lost, also by a prediction over a long time, keeps
                                        its track and its id, OVT_TENTATIVE, with at most 0.5 when it is lost */
  const int32_t* object_class;       /* ovt_object_class of most of its detections; pushed rows have none */
  const int32_t* visibility;         /* ovt_visibility in the newest frame of scans, or of pushed rows that tell of the
                                        track; `flags` are of this frame, which may be older or a prediction */
  const double* unseen_s;            /* from measured_ns to publish_ns, s; not below 0 */
  const double* heading_sigma_rad;   /* standard deviation of heading_rad, at most pi */
  /* as path_x_m: standard deviations along and across path_course_rad of a car that goes on as it drives, m. Most do:
   * their ellipse of chi-square 2.41 holds about 70 % of all cars. path_var_x, path_var_y and path_cov_xy count those
   * that brake, accelerate or change lanes, too: their ellipse of chi-square 5.99 holds about 95 %. */
  const double *path_steady_along_m, *path_steady_across_m;
} ovt_tracks;
/* How far this reader's ovt_read_tracks predicts paths: 0 (no path is computed; path_points is 0) to tracker.horizon_s,
 * where every reader starts. path_points is horizon_s / tracker.horizon_step_s, rounded. Also from on_frame: its reader
 * keeps it for the next frames. NaN, below 0 or above tracker.horizon_s: OVT_BAD_ARGUMENT, and nothing changes. */
OVT_API ovt_status ovt_set_path_horizon(ovt_reader* reader, double horizon_s);
/* A copy of the tracks after this frame, predicted to publish_ns, at most 59 s from the frame's tracks_stamp_ns.
 * out->publish_ns is the time that they are predicted to. */
OVT_API ovt_status ovt_read_tracks_sized(ovt_reader* reader, int64_t publish_ns, ovt_tracks* out, size_t out_size);
static inline ovt_status ovt_read_tracks(ovt_reader* reader, int64_t publish_ns, ovt_tracks* out) {
  return ovt_read_tracks_sized(reader, publish_ns, out, sizeof *out);
}

/* ---- output: clusters, points and images ----------------------------------------------------------------------- */

/* One row per merged cluster, before any gate; best: after it joined the clusters of one car. Vehicle frame. */
typedef struct ovt_clusters {
  int32_t count;
  const int32_t* point_count;
  const float *min_x_m, *min_y_m, *min_z_m, *max_x_m, *max_y_m, *max_z_m, *center_x_m, *center_y_m, *center_z_m;
  const int64_t* stamp_ns;
  const int32_t* sensor_mask;
} ovt_clusters;
OVT_API ovt_status ovt_read_clusters_sized(ovt_reader* reader, ovt_clusters* out, size_t out_size);
static inline ovt_status ovt_read_clusters(ovt_reader* reader, ovt_clusters* out) {
  return ovt_read_clusters_sized(reader, out, sizeof *out);
}

/* Input points of one sensor, input order. */
typedef struct ovt_labels {
  int32_t count;
  int64_t stamp_ns;
  const int32_t* label;              /* -1 none, 0 ground, clusters of this sensor from 1 */
  const uint8_t* reason;             /* 0 labelled, else why the point has no label: ovt_reason_name */
  int32_t label_count;
  const int32_t* cluster_of_label;   /* [label_count + 1]: row in ovt_clusters, -1 none (ground, no point
                                        left, or table full) */
  const float *x_m, *y_m, *z_m, *intensity;                  /* as pushed, sensor frame, including infinity and, in x, y
                                                                and z, NaN. Subnormal values and an intensity of NaN
                                                                are 0 */
  const int32_t* layer;              /* -1: not an integer in 0..65535 */
} ovt_labels;
/* OVT_NO_FRAME if the frame has no scan of that sensor. */
OVT_API ovt_status ovt_read_labels_sized(ovt_reader* reader, int32_t sensor, ovt_labels* out, size_t out_size);
static inline ovt_status ovt_read_labels(ovt_reader* reader, int32_t sensor, ovt_labels* out) {
  return ovt_read_labels_sized(reader, sensor, out, sizeof *out);
}
OVT_API const char* ovt_reason_name(int32_t reason);         /* null when there is no such reason */

typedef enum ovt_image_id {
  OVT_IMAGE_RANGE = 0,               /* f32 m, 0 empty */
  OVT_IMAGE_ELEVATION = 1,           /* f32 rad */
  OVT_IMAGE_PIXEL_POINT = 2,         /* i32 row of ovt_labels, -1 none */
  OVT_IMAGE_RANGE_FILLED = 3,        /* f32 */
  OVT_IMAGE_ELEVATION_FILLED = 4,    /* f32 */
  OVT_IMAGE_ANGLE = 5,               /* f32 rad, rows - 1; -1 undefined, -2 skipped */
  OVT_IMAGE_ANGLE_SMOOTH = 6,        /* f32 rad, rows - 1; -1 undefined */
  OVT_IMAGE_NONGROUND = 7,           /* bits; best: without smoke */
  OVT_IMAGE_RANGE_REPAIRED = 8,      /* f32, 0: not a non-ground pixel */
  OVT_IMAGE_ELEVATION_REPAIRED = 9,  /* f32 */
  OVT_IMAGE_NONGROUND_REPAIRED = 10, /* bits */
  OVT_IMAGE_LABELS = 11,             /* i32: -1 none, 0 ground, clusters from 1 */
  OVT_IMAGE_HEIGHT = 12,             /* f32 m over the running ground, 0 empty; preset best */
  OVT_IMAGE_COUNT = 13
} ovt_image_id;

typedef enum ovt_image_type { OVT_IMAGE_F32 = 0, OVT_IMAGE_I32 = 1, OVT_IMAGE_BITS = 2 } ovt_image_type;

typedef struct ovt_image {
  const void* data;                  /* row r at (const char*)data + r * stride_bytes; row 0 top, column 0 left */
  int32_t type;                      /* ovt_image_type; bits: uint64 words, column c in bit c % 64 of word c / 64 */
  int32_t rows, cols;
  size_t stride_bytes;
} ovt_image;
/* OVT_NO_FRAME if the frame has no scan of that sensor; OVT_NOT_KEPT without keep_images (except for
 * OVT_IMAGE_PIXEL_POINT, and with preset best OVT_IMAGE_HEIGHT); OVT_NOT_COMPUTED if the detector's method has no such
 * image (paper has no OVT_IMAGE_HEIGHT; best has no OVT_IMAGE_ANGLE and OVT_IMAGE_ANGLE_SMOOTH). */
OVT_API ovt_status ovt_read_image_sized(ovt_reader* reader, int32_t sensor, ovt_image_id image, ovt_image* out,
                                        size_t out_size);
static inline ovt_status ovt_read_image(ovt_reader* reader, int32_t sensor, ovt_image_id image, ovt_image* out) {
  return ovt_read_image_sized(reader, sensor, image, out, sizeof *out);
}
OVT_API const char* ovt_image_name(int32_t image);           /* "range", ... null when there is no such image */

/* ---- output: times and counters -------------------------------------------------------------------------------- */

typedef enum ovt_stage {
  OVT_STAGE_LOAD = 0, OVT_STAGE_PROJECT = 1, OVT_STAGE_GAPS = 2, OVT_STAGE_ANGLE = 3, OVT_STAGE_SMOOTH = 4,
  OVT_STAGE_GROUND = 5, OVT_STAGE_REPAIR = 6, OVT_STAGE_LINK = 7, OVT_STAGE_LABEL = 8, OVT_STAGE_CLUSTERS = 9,
  OVT_STAGE_SEGMENT = 10,            /* 1..9 of one sensor, from start to end */
  OVT_STAGE_MERGE = 11, OVT_STAGE_GATE = 12, OVT_STAGE_POSE = 13, OVT_STAGE_TRACK = 14,
  OVT_STAGE_FRAME = 15,              /* from the start of the frame's first segmentation until its tracks are ready */
  OVT_STAGE_COUNT = 16
} ovt_stage;
OVT_API const char* ovt_stage_name(int32_t stage);
/* Nanoseconds a stage took in this frame; sensor -1 for the stages of the whole frame (merge and later). It is -1 when
 * the stage did not run. OVT_NOT_COMPUTED where the detector's method has no such stage; paper has all of them. */
OVT_API ovt_status ovt_read_time(ovt_reader* reader, int32_t sensor, ovt_stage stage, int64_t* ns);

/* When and where a stage of this frame ran, by the steady clock. */
typedef struct ovt_span {
  int64_t start_ns, duration_ns;     /* duration -1: the stage did not run */
  int32_t worker;                    /* number of the worker; -1: the pushing thread or the intake */
} ovt_span;
OVT_API ovt_status ovt_read_span_sized(ovt_reader* reader, int32_t sensor, ovt_stage stage, ovt_span* out,
                                       size_t out_size);
static inline ovt_status ovt_read_span(ovt_reader* reader, int32_t sensor, ovt_stage stage, ovt_span* out) {
  return ovt_read_span_sized(reader, sensor, stage, out, sizeof *out);
}

/* Counters since create. Every pushed scan ends in exactly one of used, dropped, late, dup. ovt_read_stats fills the
 * struct up to its struct_size: start from ovt_default_stats(). */
typedef struct ovt_stats {
  size_t struct_size;
  int64_t pushed, used, dropped, late, dup;
  int64_t frames;
  int64_t points, points_bad[16];    /* points of used scans; without a label, by reason */
  int64_t overflow_clusters, overflow_candidates, overflow_tracks;
  int64_t exceptions, deadline_missed, clock_jumps;
  int64_t ego_poses, ego_dropped;    /* used; refused because of their stamp, or as their place is held (ego_held) */
  int64_t external, external_dropped;   /* pushes of detections: used; replaced, or refused for stamp or row count */
  /* since 0.2 */
  int64_t in_flight;                 /* frames started and not finished */
  int64_t stalled;                   /* times that the watchdog found a frame in work for too long */
  int64_t refiltered;                /* frames older than the newest that the tracker inserted by re-filtering */
  int64_t measurements, measurements_used, measurements_unborn, measurements_rejected, measurements_late;
                                     /* rows given to the tracker = used + unborn (no free slot) + rejected + late
                                        + measurements_debris */
  /* The result for every point, cluster, detection and track of the finished frames: the sums account for all, but for
     the detections of a frame whose later stages threw (OVT_FLAG_EXCEPTION). */
  int64_t points_clustered;          /* points in clusters of their sensor, also of those beyond the frame's table
                                        (overflow_clusters); each other point of `points` has a reason (points_bad),
                                        is ground, or belongs to a cluster that did not fit in its sensor's table */
  int64_t clusters, gated_points, gated_size, gated_map;
                                     /* clusters = gated (as in ovt_frame_info) + overflow_candidates + detections */
  int64_t detections;                /* rows of ovt_detections */
  int64_t measurements_lost;         /* detections and pushed rows not given to the tracker: no ego pose
                                        (OVT_FLAG_EGO_STALE), or a stage threw (OVT_FLAG_EXCEPTION) */
  int64_t tracks_born;               /* = tracks alive + the five below + tracks_joined */
  int64_t tracks_missed;             /* deleted by the life cycle: too few hits; best: too low an existence score, or
                                        too many misses in a row */
  int64_t tracks_silent;             /* ... by tracker.max_silence_s without a measurement */
  int64_t tracks_displaced;          /* ... tentative, replaced by a nearer detection when the table was full */
  int64_t tracks_unsound;            /* ... because their state was not finite any more */
  int64_t tracks_forgotten;          /* ... by a clock jump, or because their frame of reference changed: by the first
                                        ego pose, or by scans without one after rows in the map */
  int64_t work_limited;              /* frames that reached tracker.work_limit (OVT_FLAG_WORK_LIMIT) */
  int64_t gated_own, gated_range;    /* as in ovt_frame_info */
  int64_t measurements_debris;       /* rows of class debris that no track took: they initiate none */
  int64_t tracks_joined;             /* tracks deleted because their car has an older track, which goes on */
  int64_t pieces, pieces_used, pieces_dup, pieces_late, pieces_dropped;
                                     /* of ovt_push_points: pieces = the four others */
  int64_t scans_incomplete;          /* scans in pieces that lack points or did not end */
  int64_t scans_unended;             /* of these: closed without ovt_end_scan */
  int64_t points_missing;            /* points that incomplete scans are known to lack */
  int64_t row_orders_wrong;          /* with ovt_detector_def.stream: scans whose layers had other rows than expected
                                        from the scan before, so that a part of the work was done again */
  int64_t refused;                   /* calls that returned OVT_WRONG_THREAD; they changed nothing else */
  int64_t bad_arguments;             /* calls of ovt_push_... and ovt_end_scan that returned OVT_BAD_ARGUMENT; the log
                                        tells what was wrong with the first one */
  int64_t row_values_ignored;        /* values of rows of ovt_push_detections that count as not measured although they
                                        are no NaN (see ovt_external_detections); a covariance is one value */
  int64_t ego_held;                  /* preset best: ego poses with x and y of the one before, at more than 1 m/s, after
                                        others that moved: moved on by speed and yaw for 0.15 s, then left out
                                        (ego_dropped) */
  int64_t ego_rates_wrong;           /* preset best: ego poses whose yaw_rate_rps the yaws of the last second contradict
                                        (sign, unit, or never set): the rate of the yaws was used */
  int64_t ego_noisy;                 /* preset best: ego poses whose x, y (over 5 cm) or z (over 3 cm, one sigma) were
                                        smoothed over 0.6 s */
} ovt_stats;
OVT_API ovt_status ovt_stats_init(ovt_stats* stats, size_t struct_size);
static inline ovt_stats ovt_default_stats(void) {
  ovt_stats stats;
  memset(&stats, 0, sizeof stats);
  ovt_stats_init(&stats, sizeof stats);
  return stats;
}
OVT_API ovt_status ovt_read_stats(ovt_detector* detector, ovt_stats* out);

#ifdef __cplusplus
}
#endif
#endif
