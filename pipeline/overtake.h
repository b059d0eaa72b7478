/* Copyright 2026 The Overtake authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Overtake: sees and tracks other cars with LiDAR. The only header users include; C99 and newer, C++ too.
 *
 * Units and frames: SI, radians, int64 nanoseconds. Right-handed frames, x forward, y left, z up: sensor, vehicle (rear
 * axle, on the ground), map (east, north, up). Nothing prints, aborts, throws across, or reads the environment.
 *
 * Quick start:
 *   ovt_detector_def def = ovt_default_detector_def();
 *   def.sensors = sensors; def.sensor_count = 3;
 *   ovt_create_detector(&def, &detector); ovt_create_reader(detector, &reader);
 *   ... ovt_push_ego_pose(detector, &pose); ovt_push_scan(detector, &scan); ...          (any thread, one per sensor)
 *   if (ovt_next_frame(reader, &info) == OVT_OK) ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks);
 *
 * Threads, worker_count other than 1: ovt_push_scan one thread per sensor; ovt_push_ego_pose, ovt_push_detections one
 * thread each; ovt_advance and ovt_flush one thread for both; a reader one thread; ovt_read_stats,
 * ovt_read_runtime_info, ovt_create_reader, ovt_destroy_reader any (the def's alloc and free run on the thread that
 * creates and destroys). All of these may run at the same time. ovt_destroy_detector: when no other call is in the
 * detector, but for the readers'.
 * With worker_count 1, the default, there are no threads at all: every push finishes the work it makes possible before
 * it returns, and ovt_push_scan, ovt_push_detections, ovt_advance, ovt_flush belong to one thread together; a second
 * one that comes while it is inside gets OVT_WRONG_THREAD.
 *
 * fork(): the child may exec or exit; there ovt_destroy_... do nothing, and no other call may be made. The detector's
 * blocks are not the child's (MADV_DONTFORK, not with `alloc`), so the parent's frames keep their pages; stacks and the
 * heap are the process' and fault once after each fork.
 *
 * Compatibility: structs that the caller fills (and ovt_stats) start with struct_size, set by their
 * _init (or ovt_default_...) function; those that the library fills are passed with their size by the inline functions
 * that call the ..._sized ones. Fields are appended, enum values never renumbered. A field that the caller's header did
 * not know has its default.
 */
/* clang-format off */
#ifndef OVERTAKE_H
#define OVERTAKE_H

#include <stddef.h>
#include <stdint.h>

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
  OVT_BAD_ARGUMENT = 1,     /* a null, a count, stride, type or value out of its bounds; nothing changed */
  OVT_BAD_VERSION = 2,      /* header and library do not fit, or struct_size is unknown; nothing changed */
  OVT_UNKNOWN_NAME = 3,     /* no preset, parameter or ISA of that name */
  OVT_OUT_OF_RANGE = 4,     /* a parameter's value is outside its limits */
  OVT_NO_MEMORY = 5,        /* the allocator had none; nothing was kept */
  OVT_NO_THREADS = 6,       /* the system refused a thread */
  OVT_NO_FRAME = 7,         /* the reader has no (new) finished frame */
  OVT_DUPLICATE = 8,        /* stamp equal to the last one of that sensor or stream; counted, not used */
  OVT_LATE = 9,             /* ego pose older than the last one; counted, not used */
  OVT_TOO_MANY = 10,        /* more points, readers or rows than the def's capacity */
  OVT_INTERNAL = 11,        /* an exception was caught; counted, the next call works */
  OVT_NOT_KEPT = 12,        /* not available: keep_images was 0 at create */
  OVT_WRONG_THREAD = 13,    /* this is on_frame, or worker_count 1 and a call of another thread is under way */
  OVT_NOT_COMPUTED = 14     /* the detector's method has no such image or stage */
} ovt_status;

OVT_API const char* ovt_status_text(ovt_status status);      /* one sentence, static memory, never null */

typedef struct ovt_build_info {
  uint32_t version;                                          /* OVT_VERSION of the library */
  const char* version_text;                                  /* "0.2.0" */
  const char* commit;                                        /* git commit it was built from, or "unknown" */
  const char* compiler;                                      /* "g++ 12.2.0" */
  const char* isas;                                          /* what this CPU can run here: "ref" or "ref sse2 avx2" */
} ovt_build_info;
OVT_API void ovt_read_build_info_sized(ovt_build_info* out, size_t out_size);
static inline void ovt_read_build_info(ovt_build_info* out) { ovt_read_build_info_sized(out, sizeof *out); }

/* ---- parameters ------------------------------------------------------------------------------------------------ */

/* The method's parameters, grouped as in the paper. Text names (for files and command lines) are "group.name" with
 * angles in degrees: ovt_describe_param lists them with units, limits and meaning. */
typedef struct ovt_params {
  size_t struct_size;
  double frame_period_s;             /* frame.period_s             sensors' period */
  double frame_tolerance_s;          /* frame.tolerance_s          scans this close to its first stamp join a frame */
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
  double gate_map_margin_m;          /* gate.map_margin_m          this far outside the track still counts */
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
  double gate_ego_margin_m;          /* gate.ego_margin_m          ego farther out: the map is not used */
  double tracker_work_limit;         /* tracker.work_limit         steps of the tracker for one frame, some 2 ns each;
                                        counted, never timed. OVT_FLAG_WORK_LIMIT */
  const char* method;                /* the preset's name, as ovt_params_init sets it: which steps, rules and tracker
                                        the detector runs. Null: "paper" */
} ovt_params;

typedef struct ovt_param_info {
  const char* name;                  /* "tracker.confirm_hits" */
  const char* unit;                  /* of the text form: "m", "deg", "" */
  const char* text;                  /* one sentence */
  int32_t is_integer;
  double value_default, value_min, value_max;   /* in the unit of the text form; default of preset "paper" */
} ovt_param_info;

OVT_API ovt_status ovt_params_init(ovt_params* params, size_t struct_size, const char* preset);   /* "paper" */
OVT_API int32_t ovt_param_count(void);
/* Non-zero when the method of `params` (null: paper) reads parameter `index`. The others change nothing. */
OVT_API int32_t ovt_reads_param(const ovt_params* params, int32_t index);
OVT_API ovt_status ovt_describe_param_sized(int32_t index, ovt_param_info* out, size_t out_size);
static inline ovt_status ovt_describe_param(int32_t index, ovt_param_info* out) {
  return ovt_describe_param_sized(index, out, sizeof *out);
}
/* Text form. `value` is one number in the unit of the text form. Nothing changes unless OVT_OK. */
OVT_API ovt_status ovt_set_param(ovt_params* params, const char* name, const char* value);
OVT_API ovt_status ovt_get_param(const ovt_params* params, const char* name, double* value);

/* ---- definitions: what a detector is made of ------------------------------------------------------------------- */

enum { OVT_MAX_SENSORS = 8 };

typedef struct ovt_sensor_def {
  size_t struct_size;
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;        /* T_vehicle_sensor */
  int32_t rows, cols;                /* image size; any, default 32 x 857 */
  double azimuth_left_rad, azimuth_right_rad;                /* left and right edge of the image, default +-60 deg */
  int32_t wraps;                     /* non-zero: the columns cover a full turn starting at azimuth_left */
  double range_min_m, range_max_m;   /* points outside are dropped */
  int32_t layer_first, layer_last;   /* layers of this sensor; others are dropped */
  int32_t point_capacity;            /* points a scan may hold; one of more is counted (pushed, dropped) and refused */
} ovt_sensor_def;
OVT_API ovt_status ovt_sensor_def_init(ovt_sensor_def* def, size_t struct_size);

/* Track map. Columns of `count` points in driving direction; copied on create. Either a centre line with widths, or two
 * bounds (then centre_* and width_* are null). Points beyond 1e8 m and widths beyond 4e8 m are OVT_BAD_ARGUMENT. */
typedef struct ovt_map_def {
  size_t struct_size;
  int32_t closed;                    /* non-zero: the last point is followed by the first */
  int32_t count;
  const double *x_m, *y_m, *width_left_m, *width_right_m, *banking_rad;   /* banking may be null */
  int32_t left_count, right_count;
  const double *left_x_m, *left_y_m, *right_x_m, *right_y_m;
} ovt_map_def;
OVT_API ovt_status ovt_map_def_init(ovt_map_def* def, size_t struct_size);

typedef enum ovt_push_policy {
  OVT_PUSH_REPLACE = 0,   /* live: the newest scan replaces one that waits; the producer never blocks */
  OVT_PUSH_WAIT = 1       /* replay: a push waits until there is room; nothing is dropped */
} ovt_push_policy;

enum {                               /* ovt_detector_def.memory: what to try; ovt_runtime_info says what was obtained */
  OVT_MEMORY_LOCK = 1,               /* mlock of the detector's blocks: they are never paged out. Stacks and code may
                                        still fault, see OVT_MEMORY_LOCK_PROCESS */
  OVT_MEMORY_HUGE = 2,               /* transparent huge pages (madvise) for blocks from 2 MiB on; not with `alloc` */
  OVT_MEMORY_LOCK_PROCESS = 4        /* mlockall: stacks, code and all later memory of the whole process; stays after
                                        the detector. With it and OVT_MEMORY_LOCK no page fault after create */
};

typedef enum ovt_log_level { OVT_LOG_ERROR = 0, OVT_LOG_WARNING = 1, OVT_LOG_INFO = 2 } ovt_log_level;

typedef struct ovt_detector ovt_detector;
typedef struct ovt_reader ovt_reader;

typedef void* ovt_alloc_fn(size_t bytes, size_t alignment, void* user);   /* null: none; ovt_create_... only */
typedef void ovt_free_fn(void* block, size_t bytes, void* user);
/* One sentence each, on the thread where it happens. Create logs the ISA, the workers and what the system refused;
 * later each caught exception is logged. What happens to scans, points and tracks is counted (ovt_stats) and flagged,
 * never logged. */
typedef void ovt_log_fn(ovt_log_level level, const char* text, void* user);
/* Called for every finished frame, in order, one call at a time, on the thread that finished it: with worker_count 1
 * the one whose push, advance or flush did, else one of the library's. The next frame's tracks wait for it, and other
 * readers see the frame only afterwards. The reader is valid during the call only and is positioned at that frame.
 * Call nothing of the detector but ovt_read_...(reader): ovt_push_scan, ovt_push_detections, ovt_advance and ovt_flush
 * of the same detector return OVT_WRONG_THREAD there, ovt_destroy_detector would wait for itself. */
typedef void ovt_frame_fn(ovt_reader* reader, void* user);

/* Start from ovt_default_detector_def(), then change what you mean to change. Everything is copied on create. */
typedef struct ovt_detector_def {
  size_t struct_size;
  uint32_t version;                  /* OVT_VERSION of the caller's header */
  const ovt_sensor_def* sensors;
  int32_t sensor_count;              /* 1 to 8; 0: no LiDAR, the tracker alone on pushed detections */
  const ovt_params* params;          /* NULL: preset paper */
  const ovt_map_def* map;            /* NULL: no map; psi_REF is the ego heading and no map gate applies */
  int32_t worker_count;              /* 1: no graph, no threads; n: a graph on n workers; 0: one per usable CPU,
                                        two at least */
  const char* isa;                   /* NULL picks the best; "ref" the scalar reference; see ovt_build_info.isas */
  int32_t push_policy;               /* ovt_push_policy */
  int32_t cluster_capacity;          /* per sensor and per frame, 1,024 */
  int32_t candidate_capacity;        /* 256; at most 4,096, as much as the tracker takes; also a push of detections */
  int32_t track_capacity;            /* 256; at most 4,096. Where all detections and tracks are in each other's gates a
                                        frame costs 0.2 ms with 64 of each, 5 with 256, 35 with 1,024, 140 with 4,096
                                        (bench/README.md); 256 spread over 600 m x 600 m 0.5. See tracker.work_limit */
  int32_t frames_in_flight;          /* frames worked on at once, 3 */
  int32_t reader_capacity;           /* readers that may exist at once, 4 */
  int32_t ego_pose_capacity;         /* ego poses remembered, 1,024 */
  ovt_alloc_fn* alloc;               /* NULL: the C library's */
  ovt_free_fn* free;
  ovt_log_fn* log;                   /* NULL: silent */
  ovt_frame_fn* on_frame;            /* NULL: poll with a reader */
  void* user;
  /* since 0.2 */
  const int32_t* cpus;               /* our threads run on these CPUs only: worker i on cpus[i % cpu_count], the intake
                                        on any of them. NULL: anywhere. worker_count 0 is then one per CPU of these */
  int32_t cpu_count;
  int32_t fifo_priority;             /* 1 to 99: SCHED_FIFO of our threads, where the system allows it; 0: as started */
  int32_t memory;                    /* OVT_MEMORY_... bits; default OVT_MEMORY_HUGE */
  int32_t spin_us;                   /* our threads look for work this long before they sleep: a wake-up less in the
                                        latency for a busy CPU; 0 to 1,000,000, default 0 */
  int64_t deadline_ns;               /* from the push of a frame's last scan to its tracks: later, the frame is
                                        published with OVT_FLAG_DEADLINE_MISSED; 0: none */
  int64_t watchdog_ns;               /* a frame in work for longer is logged and counted (stats.stalled) at the next
                                        push or advance; 0: never; default 1 s. Nothing with worker_count 1: there the
                                        frame is in work while the caller waits */
  int32_t keep_images;               /* non-zero, the default: a frame keeps every image for ovt_read_image; 0: only
                                        OVT_IMAGE_PIXEL_POINT. The others are each worker's scratch, then, which stays
                                        in its cache: less time, and less memory unless there are many workers */
} ovt_detector_def;
OVT_API ovt_status ovt_detector_def_init(ovt_detector_def* def, size_t struct_size);

static inline ovt_detector_def ovt_default_detector_def(void) {
  ovt_detector_def def;
  ovt_detector_def_init(&def, sizeof def);
  def.version = OVT_VERSION;
  return def;
}
static inline ovt_sensor_def ovt_default_sensor_def(void) {
  ovt_sensor_def def;
  ovt_sensor_def_init(&def, sizeof def);
  return def;
}
static inline ovt_map_def ovt_default_map_def(void) {
  ovt_map_def def;
  ovt_map_def_init(&def, sizeof def);
  return def;
}
static inline ovt_params ovt_default_params(void) {
  ovt_params params;
  ovt_params_init(&params, sizeof params, "paper");
  return params;
}

/* ---- life ------------------------------------------------------------------------------------------------------ */

OVT_API ovt_status ovt_create_detector(const ovt_detector_def* def, ovt_detector** out);
/* The same; `error`, when not null, is the caller's memory of error_size bytes and receives a sentence that names the
 * field at fault ("" on OVT_OK). */
OVT_API ovt_status ovt_create_detector_verbose(const ovt_detector_def* def, ovt_detector** out, char* error,
                                               size_t error_size);
/* Order of a shut-down: stop the producers, ovt_flush if the last frames matter, destroy the readers, destroy the
 * detector. NULL is fine. Waits for frames under way; readers still alive stay valid until destroyed, without new
 * frames. */
OVT_API void ovt_destroy_detector(ovt_detector* detector);

/* What create obtained of what the def asked for. worker_count is less where something else in the process limits the
 * threads of the scheduler below; where it leaves none create fails with OVT_NO_THREADS. */
typedef struct ovt_runtime_info {
  const char* isa;
  int32_t worker_count;
  int32_t pinned;                    /* threads of ours that were pinned to their CPU */
  int32_t fifo;                      /* ... that run SCHED_FIFO */
  int64_t memory_bytes;              /* of all blocks the detector took */
  int64_t locked_bytes, huge_bytes;  /* of these, mlocked; advised to be huge pages */
  int32_t process_locked;            /* non-zero: mlockall held */
} ovt_runtime_info;
OVT_API ovt_status ovt_read_runtime_info_sized(ovt_detector* detector, ovt_runtime_info* out, size_t out_size);
static inline ovt_status ovt_read_runtime_info(ovt_detector* detector, ovt_runtime_info* out) {
  return ovt_read_runtime_info_sized(detector, out, sizeof *out);
}

/* ---- input ----------------------------------------------------------------------------------------------------- */

typedef enum ovt_type {
  OVT_NONE = 0, OVT_F32 = 1, OVT_F64 = 2, OVT_I8 = 3, OVT_U8 = 4, OVT_I16 = 5, OVT_U16 = 6, OVT_I32 = 7, OVT_U32 = 8
} ovt_type;

/* One field of a scan: value i lies at (const char*)data + i * stride. OVT_NONE: absent. */
typedef struct ovt_column {
  const void* data;
  size_t size_bytes;                 /* readable bytes from data on; nothing beyond is read */
  size_t stride;                     /* at least the type's size and a multiple of it; data aligned to the type */
  int32_t type;                      /* ovt_type */
} ovt_column;

/* A member of an array of records: scan.x = OVT_FIELD(points, count, x, OVT_F32). `records` is the array, or a pointer
 * to its first record, never null, and is evaluated three times. size_bytes reaches from the first record's member to
 * the end of the last record; 0 where count is 0 or less. */
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

/* One scan of one sensor, sensor frame. x y z float32 or float64; layer any integer or float32 that holds integers
 * 0..65535; intensity any type; time any type, optional: the point's offset after the scan's stamp in units of
 * time_unit_ns. */
typedef struct ovt_points {
  size_t struct_size;
  int32_t sensor;                    /* index in the def */
  int32_t count;                     /* may be 0: an empty scan is a scan */
  int64_t stamp_ns;
  ovt_column x, y, z, layer, intensity, time;
  double time_unit_ns;
} ovt_points;
OVT_API ovt_status ovt_points_init(ovt_points* points, size_t struct_size);
static inline ovt_points ovt_default_points(void) {
  ovt_points points;
  ovt_points_init(&points, sizeof points);
  return points;
}

/* Copies one scan into its sensor's mailbox; one that still waited there is dropped and counted (OVT_PUSH_REPLACE).
 * Stamps decide what becomes of it: the sensor's last stamp again is OVT_DUPLICATE; up to 0.5 s older than the newest
 * of all sensors it is a frame of its own that the tracker takes in at its place in time; older it is counted `late`.
 * A stamp ahead of the other sensors by more than frame.tolerance_s plus frame.period_s is kept until these have
 * spoken: it is used when they come near it, when more sensors say the same than go on without it (a common gap), or
 * when no other is good; else it is counted `late`, and the sensor is named in suspect_mask. ovt_flush ends the
 * waiting: `late`.
 * Of two sensors none is the majority: one that steps ahead is the suspect; two that drift apart are both used up to
 * 0.5 s less twice the sum of tolerance and period, and beyond that the one ahead is the suspect.
 * After a gap of over 1 s, or when a clock went back, the third stamp in a row that agrees is believed, when more
 * sensors say so than deliver good stamps (OVT_FLAG_CLOCK_JUMP: the tracker starts anew); the two before it are
 * `dropped`. */
OVT_API ovt_status ovt_push_scan(ovt_detector* detector, const ovt_points* scan);

typedef struct ovt_ego_pose {
  size_t struct_size;
  int64_t stamp_ns;
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;        /* T_map_vehicle */
  double speed_mps, yaw_rate_rps;                            /* along x; about z */
} ovt_ego_pose;
OVT_API ovt_status ovt_ego_pose_init(ovt_ego_pose* pose, size_t struct_size);
/* A frame uses the poses pushed before its last scan. Stamps grow; the third in a row that is over 0.5 s older, and
 * grows, is a clock that went back. A pose ahead of the rhythm of those before it, by more than two intervals and
 * 10 ms, is OVT_OK and waits for the next one: when that goes on from it both are used, else it is dropped. Poses that
 * stepped ahead of the sensors by more than frame.tolerance_s plus frame.period_s, beyond what they lead by as a rule,
 * are not used while they do: frames see the poses before them, which grow old, and name OVT_SUSPECT_EGO.
 * OVT_BAD_ARGUMENT for a value that is no pose of a car: x, y or z beyond 1e8 m, an angle beyond 1e6 rad, a speed
 * beyond 1e3 m/s, a yaw rate beyond 100 rad/s, NaN. Such a pose is not used. */
OVT_API ovt_status ovt_push_ego_pose(ovt_detector* detector, const ovt_ego_pose* pose);

typedef enum ovt_reference { OVT_REFERENCE_VEHICLE = 0, OVT_REFERENCE_MAP = 1 } ovt_reference;

/* Detections of another detector (radar, neural network), all of one stamp: one iteration of the tracker, in the order
 * of stamps with the frames: they close the frame that waits, so push them after the scans of their time. Columns of
 * `count`; heading and covariance may be null, or NaN per row; without cov_xy the variances are taken as
 * independent. Rows pushed before that still wait are treated as the push policy says. More than candidate_capacity
 * rows: OVT_TOO_MANY, external_dropped.
 * Their stamps never move the clock while a sensor delivers good ones: ahead of the sensors by more than
 * frame.tolerance_s plus frame.period_s they are kept until the sensors come near them, or dropped
 * (OVT_SUSPECT_DETECTIONS) when the sensors go on by more than that and are still behind, when more than eight pushes
 * wait, or at ovt_flush. Without sensors they are the clock. */
typedef struct ovt_external_detections {
  size_t struct_size;
  int64_t stamp_ns;
  int32_t count;
  int32_t reference;                 /* ovt_reference of x, y, heading and covariance */
  const double *x_m, *y_m, *heading_rad, *var_x, *var_y, *cov_xy;
} ovt_external_detections;
OVT_API ovt_status ovt_external_detections_init(ovt_external_detections* detections, size_t struct_size);
OVT_API ovt_status ovt_push_detections(ovt_detector* detector, const ovt_external_detections* detections);

/* Names the time: closes a frame that has waited for a sensor for 1.5 periods since its first stamp, and predicts the
 * tracks when no frame came for a while (tracker.predict_after; OVT_FLAG_PREDICTION). Where another sensor goes on, its
 * next scan closes the frame sooner: this is for when all are silent. In replay and live use alike; the library never
 * asks a clock. */
OVT_API ovt_status ovt_advance(ovt_detector* detector, int64_t now_ns);
/* Closes the waiting frame and returns when every pushed scan is finished. */
OVT_API ovt_status ovt_flush(ovt_detector* detector);

/* ---- output ---------------------------------------------------------------------------------------------------- */

/* One reader a thread. What a reader returns stays valid until its next ovt_next_frame, or until the on_frame callback
 * returns; ovt_read_tracks writes into the reader, so its columns stay valid until the next ovt_read_tracks as well. */
OVT_API ovt_status ovt_create_reader(ovt_detector* detector, ovt_reader** out);
OVT_API void ovt_destroy_reader(ovt_reader* reader);

enum {                               /* ovt_frame_info.flags */
  OVT_FLAG_NO_EGO = 1,               /* no ego pose: tracks are in the vehicle frame */
  OVT_FLAG_NO_MAP = 2,               /* no map: no map gate, psi_REF is the ego heading */
  OVT_FLAG_SENSOR_MISSING = 4,       /* not every sensor is in this frame (not said of pushed detections) */
  OVT_FLAG_SENSOR_STALE = 8,         /* a sensor is silent for more than 1.5 periods (stale_mask: which) */
  OVT_FLAG_EGO_STALE = 16,           /* the ego pose is older than 100 ms */
  OVT_FLAG_CLOUD_DEGRADED = 32,      /* more than half of a scan's points are bad */
  OVT_FLAG_NO_DATA = 64,             /* no valid point at all, or a prediction: not "all clear" */
  OVT_FLAG_OVERFLOW = 128,           /* a capacity was reached; nearest first were kept */
  OVT_FLAG_CLOCK_JUMP = 256,
  OVT_FLAG_DEADLINE_MISSED = 512,
  OVT_FLAG_EXTERNAL = 1024,          /* an iteration of pushed detections */
  OVT_FLAG_OUT_OF_SEQUENCE = 2048,   /* older than a frame before it: the tracker took it in at its place in time, and
                                        its tracks are those of the newest stamp (tracks_stamp_ns) */
  OVT_FLAG_PREDICTION = 4096,        /* ovt_advance named this time: no sensor is in it, the tracks are predicted */
  OVT_FLAG_EXCEPTION = 8192,         /* a stage threw: the sensors it belonged to are not in the frame, or, behind the
                                        segmentation, nothing is detected and the tracks are predicted */
  OVT_FLAG_EGO_OFF_MAP = 16384,      /* the ego pose lies outside of the track by more than gate.ego_margin_m (a jump, a
                                        wrong map, the pit lane): the map is not used in this frame. No map gate,
                                        psi_REF is the ego heading, map_s_m and map_d_m are 0, and new tracks take the
                                        ego course */
  OVT_FLAG_WORK_LIMIT = 32768,       /* dense clutter, more work than tracker.work_limit: a late frame was not
                                        taken in (its rows are measurements_late), or each track was compared with the
                                        nearest detections only and the assignment is not the cheapest */
  OVT_FLAG_CLOCK_SUSPECT = 65536     /* stamps of a source were refused (suspect_mask: whose) */
};

enum {                               /* ovt_frame_info.suspect_mask, beside bit s for sensor s */
  OVT_SUSPECT_DETECTIONS = 256,      /* pushed detections */
  OVT_SUSPECT_EGO = 512              /* ego poses */
};

typedef struct ovt_frame_info {
  int64_t sequence;                  /* from 0, no holes */
  int64_t first_stamp_ns, stamp_ns;  /* first and last scan's stamp */
  uint32_t sensor_mask;              /* bit s: sensor s is in it */
  uint32_t flags;
  int32_t reference;                 /* ovt_reference of the tracks */
  int32_t ego_known;                 /* the pose at stamp_ns */
  double ego_x_m, ego_y_m, ego_yaw_rad, ego_speed_mps;
  int32_t point_count, cluster_count, candidate_count;       /* candidates: before the map gate */
  int32_t detection_count, track_count;
  /* since 0.2 */
  uint32_t stale_mask;               /* bit s: sensor s is silent for more than 1.5 periods: nothing is known there */
  int32_t refiltered;                /* iterations that a late stamp made the tracker run again */
  int64_t latency_ns;                /* from its last scan's push to its tracks, by the steady clock; -1: no scan */
  int64_t tracks_stamp_ns;           /* stamp_ns, or the newest frame's where this one came out of sequence */
  double ego_off_map_m;              /* how far the ego pose lies outside of the track, at most while this frame was
                                        taken: 0 on the track, and without a map or a pose; at most 1e9. See
                                        OVT_FLAG_EGO_OFF_MAP */
  int32_t gated_points, gated_size;  /* clusters of fewer points than gate.min_points; longer than a vehicle */
  int32_t gated_map;                 /* candidates outside of the track */
  int32_t overflow_candidates;       /* candidates beyond candidate_capacity */
                                     /* cluster_count = gated_points + gated_size + candidate_count;
                                        candidate_count = gated_map + overflow_candidates + detection_count */
  uint32_t suspect_mask;             /* sources of which a stamp was refused, in each frame closed from then on until
                                        the source's third good stamp in a row (ego poses: for three frames) or a
                                        clock jump. Bit s: sensor s; OVT_SUSPECT_... */
} ovt_frame_info;

/* Moves the reader to the latest finished frame. OVT_NO_FRAME when there is none newer: the reader
 * stays where it is. */
OVT_API ovt_status ovt_next_frame_sized(ovt_reader* reader, ovt_frame_info* out, size_t out_size);
OVT_API ovt_status ovt_read_info_sized(ovt_reader* reader, ovt_frame_info* out, size_t out_size);
static inline ovt_status ovt_next_frame(ovt_reader* reader, ovt_frame_info* out) {
  return ovt_next_frame_sized(reader, out, sizeof *out);
}
static inline ovt_status ovt_read_info(ovt_reader* reader, ovt_frame_info* out) {
  return ovt_read_info_sized(reader, out, sizeof *out);
}

/* No float or double that the library hands out is NaN or infinite, whatever was pushed, but for the points of
 * ovt_labels, which are as they were pushed. What is not known is 0 and said by another field: the ego pose by
 * ovt_frame_info.ego_known, map_s_m and map_d_m by OVT_FLAG_NO_MAP, OVT_FLAG_EGO_OFF_MAP and the age of the ego pose,
 * length_m and width_m of a track by being 0 (only pushed detections made it). */

/* Columns of `count`, vehicle frame at each row's stamp. Here and in every other table a column that the detector's
 * method does not compute is null. */
typedef struct ovt_detections {
  int32_t count;
  const int64_t* stamp_ns;
  const float *x_m, *y_m, *z_m;      /* centre of the imposed rectangle; z of the centroid */
  const float* heading_rad;
  const int32_t* heading_source;     /* 0 map or ego heading (psi_REF), 1 points (psi_VAR) */
  const float *length_m, *width_m;   /* extent of the points along and across the heading */
  const int32_t* point_count;
  const int32_t *inliers_ref, *inliers_var;
  const float *heading_ref_rad, *heading_var_rad;
  const float *ref_x_m, *ref_y_m, *var_x_m, *var_y_m;        /* centres of both rectangles */
  const int32_t* sensor_mask;
  const int32_t* cluster;            /* merged cluster; see ovt_labels.cluster_of_label */
  const float *map_s_m, *map_d_m;    /* centroid on the map; 0 without map or ego pose, or when that is off it */
  const uint64_t* track;             /* id it was associated with, 0 none */
} ovt_detections;
OVT_API ovt_status ovt_read_detections_sized(ovt_reader* reader, ovt_detections* out, size_t out_size);
static inline ovt_status ovt_read_detections(ovt_reader* reader, ovt_detections* out) {
  return ovt_read_detections_sized(reader, out, sizeof *out);
}

/* Publish time of ovt_read_tracks: the frame's own (ovt_frame_info.tracks_stamp_ns). */
#define OVT_AT_FRAME_STAMP INT64_MIN

typedef enum ovt_track_state { OVT_TENTATIVE = 0, OVT_CONFIRMED = 1 } ovt_track_state;

typedef enum ovt_track_flag {        /* ovt_tracks.flags: a track's health */
  OVT_TRACK_COASTING = 1,            /* this frame holds no measurement of it: predicted */
  OVT_TRACK_UNOBSERVED = 2,          /* no sensor of this frame could see its place: no miss is counted */
  OVT_TRACK_STALE = 4                /* its last measurement is more than 0.5 s before publish_ns */
} ovt_track_flag;

/* Columns of `count`, by slot. Frame of reference: ovt_frame_info.reference. */
typedef struct ovt_tracks {
  int32_t count;
  int64_t publish_ns;
  const uint64_t* id;                /* never 0, never reused */
  const int32_t* state;              /* ovt_track_state */
  const int64_t* measured_ns;        /* its last measurement */
  const double *x_m, *y_m, *speed_mps, *course_rad, *yaw_rate_rps;
  const double* covariance[15];      /* lower triangle of P over (x, y, v, course, yaw rate), row by row */
  const double* heading_rad;         /* of the last detection, turned on by the yaw rate; in the map frame the course
                                        of a confirmed track that drives says which end is the front */
  const double *length_m, *width_m;  /* extent of the last detection */
  const int32_t *age, *hits;
  const int32_t* detection;          /* row of this frame's ovt_detections, -1 none */
  int32_t path_points;               /* predicted path: point k of track i at [i * path_points + k] */
  double path_step_s;                /* ... is at publish_ns + (k + 1) * path_step_s */
  const double *path_x_m, *path_y_m, *path_course_rad, *path_speed_mps, *path_var_x, *path_var_y, *path_cov_xy;
  const uint32_t* flags;             /* since 0.2: ovt_track_flag bits */
} ovt_tracks;
/* Tracks after this frame, a copy predicted to publish_ns, but no further than 59 s from the frame's tracks_stamp_ns:
 * out->publish_ns is the time they are really predicted to. */
OVT_API ovt_status ovt_read_tracks_sized(ovt_reader* reader, int64_t publish_ns, ovt_tracks* out, size_t out_size);
static inline ovt_status ovt_read_tracks(ovt_reader* reader, int64_t publish_ns, ovt_tracks* out) {
  return ovt_read_tracks_sized(reader, publish_ns, out, sizeof *out);
}

/* One row per merged cluster, before any gate. Vehicle frame. */
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
  const uint8_t* reason;             /* 0 labelled, else why not: ovt_reason_name */
  int32_t label_count;
  const int32_t* cluster_of_label;   /* [label_count + 1]: row in ovt_clusters, -1 none (ground, or did not fit) */
  const float *x_m, *y_m, *z_m, *intensity;                  /* as pushed, sensor frame: NaN and infinity, too */
  const int32_t* layer;
} ovt_labels;
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
  OVT_IMAGE_NONGROUND = 7,           /* bits */
  OVT_IMAGE_RANGE_REPAIRED = 8,      /* f32, 0 not in it */
  OVT_IMAGE_ELEVATION_REPAIRED = 9,  /* f32 */
  OVT_IMAGE_NONGROUND_REPAIRED = 10, /* bits */
  OVT_IMAGE_LABELS = 11,             /* i32: -1 none, 0 ground, clusters from 1 */
  OVT_IMAGE_COUNT = 12
} ovt_image_id;

typedef enum ovt_image_type { OVT_IMAGE_F32 = 0, OVT_IMAGE_I32 = 1, OVT_IMAGE_BITS = 2 } ovt_image_type;

typedef struct ovt_image {
  const void* data;                  /* row r at (const char*)data + r * stride_bytes; row 0 top, column 0 left */
  int32_t type;                      /* ovt_image_type; bits: uint64 words, column c in bit c % 64 of word c / 64 */
  int32_t rows, cols;
  size_t stride_bytes;
} ovt_image;
/* OVT_NO_FRAME where the frame holds no scan of that sensor, OVT_NOT_KEPT without keep_images (but for
 * OVT_IMAGE_PIXEL_POINT), OVT_NOT_COMPUTED where the detector's method has no such image; paper has all of them. */
OVT_API ovt_status ovt_read_image_sized(ovt_reader* reader, int32_t sensor, ovt_image_id image, ovt_image* out,
                                        size_t out_size);
static inline ovt_status ovt_read_image(ovt_reader* reader, int32_t sensor, ovt_image_id image, ovt_image* out) {
  return ovt_read_image_sized(reader, sensor, image, out, sizeof *out);
}
OVT_API const char* ovt_image_name(int32_t image);           /* "range", ... null when there is no such image */

typedef enum ovt_stage {
  OVT_STAGE_LOAD = 0, OVT_STAGE_PROJECT = 1, OVT_STAGE_GAPS = 2, OVT_STAGE_ANGLE = 3, OVT_STAGE_SMOOTH = 4,
  OVT_STAGE_GROUND = 5, OVT_STAGE_REPAIR = 6, OVT_STAGE_LINK = 7, OVT_STAGE_LABEL = 8, OVT_STAGE_CLUSTERS = 9,
  OVT_STAGE_SEGMENT = 10,            /* 1..9 of one sensor, from start to end */
  OVT_STAGE_MERGE = 11, OVT_STAGE_GATE = 12, OVT_STAGE_POSE = 13, OVT_STAGE_TRACK = 14,
  OVT_STAGE_FRAME = 15,              /* from the start of the frame's first segmentation to tracks ready */
  OVT_STAGE_COUNT = 16
} ovt_stage;
OVT_API const char* ovt_stage_name(int32_t stage);
/* Nanoseconds a stage took in this frame; sensor -1 for the stages of the whole frame (merge and later). It is -1 when
 * the stage did not run. OVT_NOT_COMPUTED where the detector's method has no such stage; paper has all of them. */
OVT_API ovt_status ovt_read_time(ovt_reader* reader, int32_t sensor, ovt_stage stage, int64_t* ns);

/* When and where a stage of this frame ran, by the steady clock. */
typedef struct ovt_span {
  int64_t start_ns, duration_ns;     /* duration -1: the stage did not run */
  int32_t worker;                    /* -1 the pushing thread or the intake, else the worker's number */
} ovt_span;
OVT_API ovt_status ovt_read_span_sized(ovt_reader* reader, int32_t sensor, ovt_stage stage, ovt_span* out,
                                       size_t out_size);
static inline ovt_status ovt_read_span(ovt_reader* reader, int32_t sensor, ovt_stage stage, ovt_span* out) {
  return ovt_read_span_sized(reader, sensor, stage, out, sizeof *out);
}

/* Counters since create. Every pushed scan ends in exactly one of used, dropped, late, dup. Filled by
 * ovt_read_stats up to its struct_size: start from ovt_default_stats(). */
typedef struct ovt_stats {
  size_t struct_size;
  int64_t pushed, used, dropped, late, dup;
  int64_t frames;
  int64_t points, points_bad[16];    /* points of used scans; without a label, by reason */
  int64_t overflow_clusters, overflow_candidates, overflow_tracks;
  int64_t exceptions, deadline_missed, clock_jumps;
  int64_t ego_poses, ego_dropped;    /* used; refused for their stamp */
  int64_t external, external_dropped;   /* pushes of detections: used; replaced, or refused for stamp or row count */
  /* since 0.2 */
  int64_t in_flight;                 /* frames begun and not finished */
  int64_t stalled;                   /* times the watchdog found a frame in work for too long */
  int64_t refiltered;                /* frames older than the newest that were taken in by re-filtering */
  int64_t measurements, measurements_used, measurements_unborn, measurements_rejected, measurements_late;
                                     /* rows given to the tracker = used + unborn (no slot) + rejected + late */
  /* What became of every point, cluster, detection and track of the finished frames, so that none goes unseen. */
  int64_t points_clustered;          /* points in clusters; the rest of `points` has a reason (points_bad), is ground,
                                        or belongs to a cluster that did not fit */
  int64_t clusters, gated_points, gated_size, gated_map;
                                     /* clusters = gated (as in ovt_frame_info) + overflow_candidates + detections */
  int64_t detections;                /* rows of ovt_detections */
  int64_t measurements_lost;         /* detections and pushed rows that were not given to the tracker: without an ego
                                        pose (OVT_FLAG_EGO_STALE), or where a stage threw (OVT_FLAG_EXCEPTION) */
  int64_t tracks_born;               /* = tracks alive + the five below */
  int64_t tracks_missed;             /* ended by the life cycle: too few hits */
  int64_t tracks_silent;             /* ... by tracker.max_silence_s without a measurement */
  int64_t tracks_displaced;          /* ... tentative, for a nearer detection in a full table */
  int64_t tracks_unsound;            /* ... as their numbers were lost */
  int64_t tracks_forgotten;          /* ... by a jump of the clock, or by the first ego pose */
  int64_t work_limited;              /* frames that met tracker.work_limit (OVT_FLAG_WORK_LIMIT) */
} ovt_stats;
OVT_API ovt_status ovt_stats_init(ovt_stats* stats, size_t struct_size);
static inline ovt_stats ovt_default_stats(void) {
  ovt_stats stats;
  ovt_stats_init(&stats, sizeof stats);
  return stats;
}
OVT_API ovt_status ovt_read_stats(ovt_detector* detector, ovt_stats* out);

#ifdef __cplusplus
}
#endif
#endif
