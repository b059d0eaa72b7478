// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Decodes the messages that the page shows: Foxglove's protobuf types, ROS 2's CDR types, and JSON. A message that ends
// early throws RangeError.
import type { Matrix } from "../types";

export interface Field { name: string; offset: number; type: number }  // type: as in foxglove.PackedElementField
export interface Packed { frame: string; stride: number; fields: Field[]; data: Uint8Array }
export interface RawImage { rows: number; cols: number; encoding: string; step: number; data: Uint8Array }
export interface Transform { parent: string; child: string; matrix: Matrix }
export interface Pose { frame: string; child: string; matrix: Matrix; speed_mps: number }

const text = new TextDecoder();
export const decodeText = (bytes: Uint8Array): string => text.decode(bytes);
export const decodeJson = (bytes: Uint8Array): unknown => JSON.parse(text.decode(bytes));

export function viewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

// ---- protobuf: a callback for each field. value is a number for varints, the field's bytes otherwise.
type Visit = (field: number, value: number, bytes: Uint8Array) => void;
const kNothing = new Uint8Array(0);

export function visitFields(bytes: Uint8Array, visit: Visit): void {
  let at = 0;
  const varint = (): number => {
    let value = 0;
    for (let shift = 1; ; shift *= 128) {
      if (at >= bytes.length) throw new RangeError("a message ends early");
      const byte = bytes[at++];
      value += (byte & 127) * shift;
      if (byte < 128) return value;
    }
  };
  const take = (length: number): Uint8Array => {
    if (at + length > bytes.length) throw new RangeError("a message ends early");
    return bytes.subarray(at, (at += length));
  };
  while (at < bytes.length) {
    const key = varint(), field = Math.floor(key / 8), kind = key & 7;
    if (kind === 0) visit(field, varint(), kNothing);
    else if (kind === 1) visit(field, 0, take(8));
    else if (kind === 2) visit(field, 0, take(varint()));
    else if (kind === 5) visit(field, 0, take(4));
    else throw new RangeError("a message has a field of an unknown kind");
  }
}

const f64 = (bytes: Uint8Array): number => viewOf(bytes).getFloat64(0, true);
const u32 = (bytes: Uint8Array): number => viewOf(bytes).getUint32(0, true);

function decodeNumbers(bytes: Uint8Array, count: number): number[] {
  const out = new Array<number>(count).fill(0);
  visitFields(bytes, (field, _, value) => { if (field <= count) out[field - 1] = f64(value); });
  return out;
}

export function poseMatrix([x, y, z]: number[], [qx, qy, qz, qw]: number[]): Matrix {
  return [1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qz * qw), 2 * (qx * qz - qy * qw), 0,
          2 * (qx * qy - qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + qx * qw), 0,
          2 * (qx * qz + qy * qw), 2 * (qy * qz - qx * qw), 1 - 2 * (qx * qx + qy * qy), 0, x, y, z, 1];
}

export function decodeTransform(bytes: Uint8Array): Transform {
  let parent = "", child = "", at = [0, 0, 0], turn = [0, 0, 0, 1];
  visitFields(bytes, (field, _, value) => {
    if (field === 2) parent = decodeText(value);
    if (field === 3) child = decodeText(value);
    if (field === 4) at = decodeNumbers(value, 3);
    if (field === 5) turn = decodeNumbers(value, 4);
  });
  return { parent, child, matrix: poseMatrix(at, turn) };
}

export function decodeCloud(bytes: Uint8Array): Packed {
  const cloud: Packed = { frame: "", stride: 0, fields: [], data: kNothing };
  visitFields(bytes, (field, _, value) => {
    if (field === 2) cloud.frame = decodeText(value);
    if (field === 4) cloud.stride = u32(value);
    if (field === 6) cloud.data = value;
    if (field !== 5) return;
    const packed: Field = { name: "", offset: 0, type: 0 };
    visitFields(value, (inner, number, content) => {
      if (inner === 1) packed.name = decodeText(content);
      if (inner === 2) packed.offset = u32(content);
      if (inner === 3) packed.type = number;
    });
    cloud.fields.push(packed);
  });
  return cloud;
}

export function decodeImage(bytes: Uint8Array): RawImage {
  const image: RawImage = { rows: 0, cols: 0, encoding: "", step: 0, data: kNothing };
  visitFields(bytes, (field, _, value) => {
    if (field === 2) image.cols = u32(value);
    if (field === 3) image.rows = u32(value);
    if (field === 4) image.encoding = decodeText(value);
    if (field === 5) image.step = u32(value);
    if (field === 6) image.data = value;
  });
  return image;
}

// The lines of a SceneUpdate as x y pairs; a loop ends where it begins.
export function decodeLines(bytes: Uint8Array): Float64Array[] {
  const lines: Float64Array[] = [];
  visitFields(bytes, (field, _, entity) => {
    if (field !== 2) return;
    visitFields(entity, (inner, _number, line) => {
      if (inner !== 11) return;
      const points: number[] = [];
      let type = 0;
      visitFields(line, (part, number, value) => {
        if (part === 1) type = number;
        if (part === 5) points.push(...decodeNumbers(value, 2));
      });
      if (type === 1) points.push(points[0], points[1]);
      lines.push(Float64Array.from(points));
    });
  });
  return lines;
}

// ---- CDR (little endian): alignment counts from the end of the four bytes of its header.
class Cdr {
  private at = 4;
  private readonly view: DataView;
  constructor(private readonly bytes: Uint8Array) {
    this.view = viewOf(bytes);
    if (bytes.length < 4 || bytes[1] !== 1) throw new RangeError("a CDR message is not in little endian");
  }
  private next(size: number): number {
    const at = this.at + ((size - ((this.at - 4) % size)) % size);
    this.at = at + size;
    return at;
  }
  u8(): number { return this.view.getUint8(this.next(1)); }
  u32(): number { return this.view.getUint32(this.next(4), true); }
  f64(): number { return this.view.getFloat64(this.next(8), true); }
  f64s(count: number): number[] { return Array.from({ length: count }, () => this.f64()); }
  raw(length: number): Uint8Array {
    if (this.at + length > this.bytes.length) throw new RangeError("a message ends early");
    return this.bytes.subarray(this.at, (this.at += length));
  }
  string(): string {
    const length = this.u32();
    return decodeText(this.raw(length)).replace(/\0$/, "");
  }
  header(): string {  // std_msgs/Header: the frame
    this.u32();
    this.u32();
    return this.string();
  }
}

// From sensor_msgs/PointField's types to those of foxglove.PackedElementField.
const kPointField = [0, 2, 1, 4, 3, 6, 5, 7, 8];

export function decodePointCloud2(bytes: Uint8Array): Packed {
  const cdr = new Cdr(bytes), frame = cdr.header();
  cdr.u32();
  cdr.u32();
  const fields: Field[] = [];
  for (let count = cdr.u32(); count > 0; --count) {
    const name = cdr.string(), offset = cdr.u32(), type = kPointField[cdr.u8()] ?? 0;
    cdr.u32();
    fields.push({ name, offset, type });
  }
  if (cdr.u8() !== 0) throw new RangeError("a point cloud is in big endian");
  const stride = cdr.u32();
  cdr.u32();
  return { frame, stride, fields, data: cdr.raw(cdr.u32()) };
}

export function decodeOdometry(bytes: Uint8Array): Pose {
  const cdr = new Cdr(bytes), frame = cdr.header(), child = cdr.string();
  const at = cdr.f64s(3), turn = cdr.f64s(4);
  cdr.f64s(36);
  const velocity = cdr.f64s(3);
  return { frame, child, matrix: poseMatrix(at, turn), speed_mps: Math.hypot(velocity[0], velocity[1]) };
}

export function decodeTfMessage(bytes: Uint8Array): Transform[] {
  const cdr = new Cdr(bytes), out: Transform[] = [];
  for (let count = cdr.u32(); count > 0; --count) {
    const parent = cdr.header(), child = cdr.string();
    out.push({ parent, child, matrix: poseMatrix(cdr.f64s(3), cdr.f64s(4)) });
  }
  return out;
}

// ---- points
type Getter = (view: DataView, at: number) => number;
const kGetters: Getter[] = [
  () => NaN, (v, a) => v.getUint8(a), (v, a) => v.getInt8(a), (v, a) => v.getUint16(a, true),
      (v, a) => v.getInt16(a, true),
  (v, a) => v.getUint32(a, true), (v, a) => v.getInt32(a, true), (v, a) => v.getFloat32(a, true),
      (v, a) => v.getFloat64(a, true),
];

// In bytes; 0: a type that is not known.
export const sizeOfType = (type: number): number => [0, 1, 1, 2, 2, 4, 4, 4, 8][type] ?? 0;

// The field's value of each point, as float32: labels and layers are exact up to 2^24.
export function unpackField(cloud: Packed, field: Field, out: Float32Array, outStride: number, outAt: number): void {
  const count = cloud.stride > 0 ? Math.floor(cloud.data.length / cloud.stride) : 0;
  const aligned = (size: number): boolean =>
    cloud.data.byteOffset % size === 0 && cloud.stride % size === 0 && field.offset % size === 0;
  if ((field.type === 7 || field.type === 6 || field.type === 5) && aligned(4)) {
    const words = Math.floor(cloud.data.byteLength / 4), step = cloud.stride / 4;
    const make = field.type === 7 ? Float32Array : field.type === 6 ? Int32Array : Uint32Array;
    const values = new make(cloud.data.buffer as ArrayBuffer, cloud.data.byteOffset, words);
    for (let i = 0, at = field.offset / 4, to = outAt; i < count; ++i, at += step, to += outStride)
      out[to] = values[at];
    return;
  }
  const view = viewOf(cloud.data), get = kGetters[field.type] ?? kGetters[0];
  for (let i = 0, at = field.offset, to = outAt; i < count; ++i, at += cloud.stride, to += outStride)
    out[to] = get(view, at);
}
