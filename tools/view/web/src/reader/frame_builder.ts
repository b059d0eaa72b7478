// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One frame from its messages. All that a frame draws is in the vehicle's frame, or in the map's frame with the ego
// pose.
import { kHistory } from "../types";
import type { Car, Cloud, Detection, Ego, Frame, Image, Matrix, Road, Track, TrackPath } from "../types";
import * as decode from "./messages";

export interface TopicMessage { topic: string; schema: string; encoding: string; data: Uint8Array }

export const kCloudSchemas = ["foxglove.PointCloud", "sensor_msgs/msg/PointCloud2"];
export const kOdometry = "nav_msgs/msg/Odometry";
export const kFrameSchemas = new Set([...kCloudSchemas, kOdometry, "foxglove.FrameTransform", "foxglove.RawImage",
    "tf2_msgs/msg/TFMessage",
  "overtake.Detections", "overtake.Tracks", "overtake.Times", "overtake.Counters", "overtake.Truth",
      "overtake.CarStates"]);

export const sensorOf = (topic: string): string => topic.replace(/^\//, "").replace(/\/(points|image\/.*)$/, "");

const kCell_m = 4, kSide = 96, kMostItems = 5000;

function multiply(a: Matrix, b: Matrix): Matrix {
  const out = new Array<number>(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      out[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
  return out;
}
const kIdentity: Matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

const planar = (m: Matrix): Ego => ({ x_m: m[12], y_m: m[13], yaw_rad: Math.atan2(m[1], m[0]) });

// The objects in a list of a JSON message that fit; [] if there is no list: a log can hold anything. What is left out
// is told.
function list<T extends object>(frame: Frame, message: unknown, key: string, fits: (item: T) => boolean = () =>
    true): T[] {
  const value = (message as Record<string, unknown> | null)?.[key], all: unknown[] = Array.isArray(value) ? value : [];
  const good = all.filter((item): item is T => typeof item === "object" && item !== null && fits(item as T));
  if (good.length < all.length) frame.missing.push(`A frame has ${key} that cannot be read: they are not shown.`);
  if (good.length > kMostItems)
    frame.missing.push(`A frame has more than ${kMostItems} ${key}: the others are not shown.`);
  return good.slice(0, kMostItems);
}
const isId = (id: unknown): boolean => typeof id === "string" && /^\d{1,20}$/.test(id);
const isNumbers = (value: unknown): boolean => Array.isArray(value) && value.length <= kMostItems;

interface Mounted { cloud: decode.Packed; sensor: string }

export function buildFrame(index: number, stamp: bigint, messages: TopicMessage[], statics: decode.Transform[]): Frame {
  const frame: Frame = { index, stamp, ego: null, clouds: [], images: [], detections: [], tracks: [],
      tracksInMap: false, pathStep_s: 0.1,
                         truth: [], truthInMap: true, times: [], counters: null,
                             road: { cell_m: kCell_m, side: kSide, z_m: new Float32Array(0) }, missing: [],
                             read_ms: 0 };
  const parents = new Map(statics.map((t) => [t.child, t]));
  const mounted: Mounted[] = [];
  let vehicle = "vehicle";
  for (const { topic, schema, encoding, data } of messages) {
    try {
      if (schema === "foxglove.FrameTransform") {
        const t = decode.decodeTransform(data);
        if (t.child === "vehicle" && t.parent === "map") frame.ego = planar(t.matrix);
        else parents.set(t.child, t);
      } else if (schema === "tf2_msgs/msg/TFMessage") {
        for (const t of decode.decodeTfMessage(data)) parents.set(t.child, t);
      } else if (schema === kOdometry && encoding === "cdr") {
        const pose = decode.decodeOdometry(data);
        if (topic.includes("opponent"))
          frame.truth.push({ name: "opponent", ...planar(pose.matrix), heading_rad: planar(pose.matrix).yaw_rad,
              speed_mps: pose.speed_mps, length_m: 4.921, width_m: 1.886 });
        else if (!topic.includes("truth") || !frame.ego)
          frame.ego = planar(pose.matrix), vehicle = pose.child || vehicle;
      } else if (schema === "foxglove.PointCloud") {
        mounted.push({ cloud: decode.decodeCloud(data), sensor: sensorOf(topic) });
      } else if (schema === "sensor_msgs/msg/PointCloud2") {
        mounted.push({ cloud: decode.decodePointCloud2(data), sensor: sensorOf(topic) });
      } else if (schema === "foxglove.RawImage") {
        frame.images.push(unpackImage(topic, data));
      } else if (encoding === "json") {
        readJson(frame, schema, decode.decodeJson(data));
      }
    } catch (error) {
      frame.missing.push(`A message on ${topic} cannot be read: ${error instanceof Error ? error.message
          : String(error)}.`);
    }
  }
  for (const { cloud, sensor } of mounted) {
    try {
      frame.clouds.push(unpackCloud(cloud, sensor, findMount(cloud.frame, vehicle, parents, frame)));
    } catch (error) {
      frame.missing.push(`The points of ${sensor} cannot be read: ${error instanceof Error ? error.message
          : String(error)}.`);
    }
  }
  frame.clouds.sort((a, b) => a.sensor.localeCompare(b.sensor));
  frame.road = estimateRoad(frame.clouds);
  return frame;
}

function findMount(name: string, vehicle: string, parents: Map<string, decode.Transform>, frame: Frame): Matrix {
  let matrix = kIdentity, at = name;
  for (let steps = 0; steps < 8 && at !== vehicle; ++steps) {
    const up = parents.get(at);
    if (!up) break;
    matrix = multiply(up.matrix, matrix);
    at = up.parent;
  }
  if (at === name && at !== vehicle)
    frame.missing.push(
        `No transform leads from the frame ${name} to the vehicle: its points are drawn as if `
            + "its origin was the vehicle's.");
  return matrix;
}

function unpackCloud(cloud: decode.Packed, sensor: string, vehicleFromSensor: Matrix): Cloud {
  // aligned
  if (cloud.stride % 4 === 0 && cloud.data.byteOffset % 4 !== 0) cloud = { ...cloud, data: cloud.data.slice() };
  const count = cloud.stride > 0 ? Math.floor(cloud.data.length / cloud.stride) : 0;
  const out: Cloud = { sensor, count, position: new Float32Array(3 * count), fields: {}, vehicleFromSensor };
  for (const field of cloud.fields) {
    if (field.offset + decode.sizeOfType(field.type) > cloud.stride)
      throw new RangeError(`the field ${field.name} lies outside of a point`);
    const axis = "xyz".indexOf(field.name);
    if (field.name.length === 1 && axis >= 0) {
      decode.unpackField(cloud, field, out.position, 3, axis);
    } else {
      const name = field.name === "ring" ? "layer" : field.name;
      decode.unpackField(cloud, field, out.fields[name] = new Float32Array(count), 1, 0);
    }
  }
  return out;
}

function unpackImage(topic: string, data: Uint8Array): Image {
  const raw = decode.decodeImage(data), pixel = raw.encoding === "32FC1" ? 4 : raw.encoding === "rgb8" ? 3 : 1;
  if (raw.rows === 0 || raw.cols === 0) throw new RangeError("it has no pixels");
  if (raw.step !== raw.cols * pixel || raw.data.length !== raw.rows * raw.step)
    throw new RangeError("its size does not fit its pixels");
  const bytes = raw.data.slice();
  return { sensor: sensorOf(topic), name: topic.split("/image/")[1] ?? topic, rows: raw.rows, cols: raw.cols,
      encoding: raw.encoding,
           values: pixel === 4 ? new Float32Array(bytes.buffer) : bytes };
}

function readJson(frame: Frame, schema: string, message: unknown): void {
  const all = (message ?? {}) as Record<string, unknown>;
  if (schema === "overtake.Detections") {
    frame.detections = list<Detection>(frame, message, "detections", (d) => d.track === undefined || isId(d.track));
    for (const detection of frame.detections) detection.track ??= "0";
  }
  if (schema === "overtake.Times") frame.times = list(frame, message, "stages");
  if (schema === "overtake.Counters") frame.counters = all as Record<string, number | number[]>;
  if (schema === "overtake.Tracks") {
    const none: TrackPath = { x_m: [], y_m: [], var_x: [], var_y: [], cov_xy: [], speed_mps: [] };
    frame.tracks = list<Track>(frame, message, "tracks", (t) => isId(t.id) &&
        Object.keys(none).every((key) => isNumbers({ ...none, ...t.path }[key as keyof TrackPath])));
    frame.tracksInMap = all.frame === "map";
    frame.pathStep_s = Number(all.path_step_s ?? 0.1);
    for (const track of frame.tracks) track.path = { ...none, ...track.path }, track.covariance ??= [0, 0, 0];
  }
  if (schema !== "overtake.Truth" && schema !== "overtake.CarStates") return;
  frame.truthInMap = all.frame !== "vehicle";
  frame.truth = list<Car & { is_ego?: boolean; id?: unknown }>(frame, message, "cars").filter((car) => !car.is_ego)
    .map((car) => ({ ...car, name: String(car.name ?? car.id ?? "car") }));
}

// The mean height of the points labelled ground in each cell; of the lowest points where there are no labels. Cells
// without points take the next cell's.
function estimateRoad(clouds: Cloud[]): Road {
  const cells = kSide * kSide, sum = new Float32Array(cells), count = new Uint16Array(cells),
      lowest = new Float32Array(cells).fill(Infinity);
  const half = kSide / 2;
  for (const { count: points, position: p, fields, vehicleFromSensor: m } of clouds)
    for (let i = 0, k = 0; i < points; ++i, k += 3) {
      if (fields.label && fields.label[i] !== 0) continue;
      const x = p[k], y = p[k + 1], z = p[k + 2];
      const column = Math.floor((m[0] * x + m[4] * y + m[8] * z + m[12]) / kCell_m) + half;
      const row = Math.floor((m[1] * x + m[5] * y + m[9] * z + m[13]) / kCell_m) + half;
      if (!(column >= 0 && column < kSide && row >= 0 && row < kSide)) continue;
      const cell = row * kSide + column, height = m[2] * x + m[6] * y + m[10] * z + m[14];
      sum[cell] += height;
      ++count[cell];
      if (height < lowest[cell]) lowest[cell] = height;
    }
  const z_m = new Float32Array(cells).fill(NaN), labelled = clouds.some((c) => c.fields.label);
  for (let i = 0; i < cells; ++i) if (count[i] > 0) z_m[i] = labelled ? sum[i] / count[i] : lowest[i];
  const carry = (from: number, step: number): void => {
    for (let n = 0, at = from, last = NaN; n < kSide; ++n, at += step) {
      if (Number.isNaN(z_m[at])) z_m[at] = last;
      last = z_m[at];
    }
  };
  for (let i = 0; i < kSide; ++i) carry(i * kSide + half, 1);  // outwards from the vehicle's column
  for (let i = 0; i < kSide; ++i)
    for (const [from, step] of [[i * kSide + kSide - 1, -1], [i, kSide], [cells - kSide + i, -kSide]])
      carry(from, step);
  for (let i = 0; i < cells; ++i) if (Number.isNaN(z_m[i])) z_m[i] = 0;
  for (const step of [1, kSide])  // a cell's few points scatter: means of three
    for (let i = step, before = z_m[0]; i + step < cells; ++i) {
      const mean = ((step === 1 ? before : z_m[i - step]) + z_m[i] + z_m[i + step]) / 3;
      before = z_m[i];
      z_m[i] = mean;
    }
  return { cell_m: kCell_m, side: kSide, z_m };
}

export function historyRows(frame: { tracks: Track[]; tracksInMap: boolean; ego: Ego | null }): Float64Array {
  const rows = new Float64Array(frame.tracks.length * kHistory.length);
  frame.tracks.forEach((t, i) => {
    const id = BigInt(t.id), from = frame.tracksInMap ? frame.ego : { x_m: 0, y_m: 0 };
    rows.set([Number(id & 0xffffffffn), Number(id >> 32n), t.state === "confirmed" ? 1 : 0, t.x_m, t.y_m, t.speed_mps,
        t.covariance[0],
              t.covariance[2], t.hits, t.existence ?? NaN, from ? Math.hypot(t.x_m - from.x_m, t.y_m - from.y_m) : NaN,
                  t.flags], i * kHistory.length);
  });
  return rows;
}
