// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the worker sends to the page and back: one log has one worker.

export interface LogEntry { url: string; name: string; bytes: string; etag: string | null }
export interface LogList { version: string; live: boolean; at: string | null; logs: LogEntry[] }

// Column-major, as three.js has it.
export type Matrix = number[];

// One sensor's scan in the sensor's frame. Each field has one value a point.
export interface Cloud {
  sensor: string;
  count: number;
  position: Float32Array;               // x y z
  fields: Record<string, Float32Array>;  // intensity, layer, label, cluster, reason, ...: those that the message has
  vehicleFromSensor: Matrix;
}

export interface Image {
  sensor: string;
  name: string;
  rows: number;
  cols: number;
  encoding: string;  // 32FC1, mono8 or rgb8
  values: Float32Array | Uint8Array;
}

export interface Detection {
  stamp_ns: string; x_m: number; y_m: number; z_m: number; heading_rad: number; heading_source: string;
  length_m: number; width_m: number; points: number; inliers_ref: number; inliers_var: number;
  heading_ref_rad: number; heading_var_rad: number; ref_x_m: number; ref_y_m: number; var_x_m: number; var_y_m: number;
  sensor_mask: number; cluster: number; track: string; class?: string; view?: string;
  [other: string]: number | string | undefined;
}

export interface TrackPath {
  x_m: number[]; y_m: number[]; var_x: number[]; var_y: number[]; cov_xy: number[]; speed_mps: number[];
}
export interface Track {
  id: string; state: string; x_m: number; y_m: number; speed_mps: number; course_rad: number; yaw_rate_rps: number;
  covariance: number[]; heading_rad: number; length_m: number; width_m: number; age: number; hits: number;
  detection: number; flags: number; path: TrackPath; existence?: number; class?: string; visibility?: string;
  unseen_s?: number;
}

export interface Car {
  name: string; x_m: number; y_m: number; heading_rad: number; speed_mps: number; length_m: number; width_m: number;
}

export interface StageTime { sensor: string; stage: string; us: number }

export interface Ego { x_m: number; y_m: number; yaw_rad: number }

// Heights of the road under the sensors' points: a square of cells around the vehicle, vehicle frame.
export interface Road { cell_m: number; side: number; z_m: Float32Array }

export interface Frame {
  index: number;
  stamp: bigint;
  ego: Ego | null;
  clouds: Cloud[];
  images: Image[];
  detections: Detection[];
  tracks: Track[];
  tracksInMap: boolean;
  pathStep_s: number;
  truth: Car[];
  truthInMap: boolean;
  times: StageTime[];
  counters: Record<string, number | number[]> | null;
  road: Road;
  missing: string[];  // sentences
  read_ms: number;
}

export interface StageColumn { sensor: string; stage: string; us: Float64Array }

// One row a frame; NaN is unknown.
export interface FrameTable {
  stamps: BigInt64Array;
  deadline_us: number | null;
  period_us: number | null;
  frame_us: Float64Array;
  latency_us: Float64Array;
  points: Float64Array;
  detections: Float64Array;
  tracks: Float64Array;
  confirmed: Float64Array;
  flags: Float64Array;
  lostScans: Float64Array;
  stages: StageColumn[];
}

// Compact rows of a frame's tracks, for trails and plots: kHistory numbers a track.
export const kHistory = ["slot", "generation", "confirmed", "x_m", "y_m", "speed_mps", "var_x", "var_y", "hits",
  "existence", "distance_m", "flags"] as const;
export interface HistoryRows { index: number; rows: Float64Array }

export interface LogInfo {
  name: string;
  bytes: number;
  kind: "view" | "race" | "other";
  sensors: string[];
  images: Record<string, string[]>;  // by sensor
  topics: { topic: string; schema: string; encoding: string; messages: number | null; group: string }[];
  config: string | null;
  metadata: { name: string; entries: [string, string][] }[];
  map: Float64Array[];  // polylines x y, map frame
  missing: string[];    // sentences
  live: boolean;
}

export interface Traffic { requests: number; bytes: number; opened: { requests: number; bytes: number } | null }

export type FaultKind = "gone" | "back" | "changed" | "damaged" | "unknown" | "notice";

export type ToWorker =
  | { type: "open"; entry: LogEntry }
  | { type: "connect"; url: string }
  | { type: "frame"; id: number; index: number; images: string[]; numbersOnly: boolean; ahead: boolean }
  | { type: "history"; center: number; all: boolean };

export type FromWorker =
  | { type: "opened"; info: LogInfo }  // again when a walk over a log without index found more
  | { type: "table"; table: FrameTable; complete: boolean; forgotten?: number }  // forgotten: first rows that left it
  | { type: "progress"; what: string; share: number }
  | { type: "frame"; id: number; frame: Frame; traffic: Traffic }
  | { type: "live"; frame: Frame; received: number; dropped: number }  // frames so far
  | { type: "reset" }                                                  // another run answers: its frames follow
  | { type: "history"; rows: HistoryRows[]; share: number }
  | { type: "traffic"; traffic: Traffic }
  | { type: "noframe"; id: number }
  | { type: "fault"; kind: FaultKind; text: string; id?: string };  // replaces the one with the same id
