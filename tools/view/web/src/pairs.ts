// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The frames of one or two logs on one time line, and what differs between two logs.
import type { Frame, FrameTable } from "./types";

// index of the frame in each log; -1: the log has none at this stamp.
export interface Entry { stamp: bigint; frames: number[] }

const kSameStamp_ns = 5_000_000n;

export function pairFrames(tables: (FrameTable | null)[]): Entry[] {
  const [a, b] = tables.map((t) => t?.stamps ?? new BigInt64Array(0));
  if (!b) return Array.from(a, (stamp, i) => ({ stamp, frames: [i] }));
  const entries: Entry[] = [];
  for (let i = 0, j = 0; i < a.length || j < b.length;) {
    const apart = i >= a.length ? kSameStamp_ns + 1n : j >= b.length ? -kSameStamp_ns - 1n : a[i] - b[j];
    if (apart > kSameStamp_ns) entries.push({ stamp: b[j], frames: [-1, j++] });
    else if (apart < -kSameStamp_ns) entries.push({ stamp: a[i], frames: [i++, -1] });
    else entries.push({ stamp: a[i], frames: [i++, j++] });
  }
  return entries;
}

// The entry at or before the stamp; the first one if there is none before.
export function entryAt(entries: Entry[], stamp: bigint): number {
  let low = 0, high = entries.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (entries[middle].stamp <= stamp) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}
export function nearestEntry(entries: Entry[], stamp: bigint): number {
  const i = entryAt(entries, stamp), next = entries[i + 1];
  return next && next.stamp - stamp < stamp - entries[i].stamp ? i + 1 : i;
}

// What the tables alone say of an entry; "" if nothing differs.
export function tableDifference(tables: (FrameTable | null)[], { frames: [a, b] }: Entry): string {
  const [ta, tb] = tables;
  if (!ta || !tb) return "";
  if (a < 0) return "log A has no frame at this stamp";
  if (b < 0) return "log B has no frame at this stamp";
  for (const [name, key] of [["detections", "detections"], ["tracks", "tracks"],
      ["confirmed tracks", "confirmed"]] as const) {
    const x = ta[key][a], y = tb[key][b];
    if (Number.isFinite(x) && Number.isFinite(y) && x !== y) return `${name}: ${x} and ${y}`;
  }
  return "";
}

const kDiffers_m = 0.05;
export function frameDifference(a: Frame, b: Frame): string {
  if (a.detections.length !== b.detections.length)
    return `detections: ${a.detections.length} and ${b.detections.length}`;
  if (a.tracks.length !== b.tracks.length) return `tracks: ${a.tracks.length} and ${b.tracks.length}`;
  for (const [i, d] of a.detections.entries()) {
    const far = Math.hypot(d.x_m - b.detections[i].x_m, d.y_m - b.detections[i].y_m);
    if (far > kDiffers_m) return `detection ${i} lies ${far.toFixed(2)} m apart`;
  }
  for (const t of a.tracks) {
    const same = b.tracks.find((other) => other.id === t.id);
    if (!same) return `track ${BigInt(t.id) & 0xffffffffn}:${BigInt(t.id) >> 32n} is in log A only`;
    const far = Math.hypot(t.x_m - same.x_m, t.y_m - same.y_m);
    if (far > kDiffers_m)
      return `track ${BigInt(t.id) & 0xffffffffn}:${BigInt(t.id) >> 32n} lies ${far.toFixed(2)} m apart`;
    if (t.state !== same.state)
      return `track ${BigInt(t.id) & 0xffffffffn}:${BigInt(t.id) >> 32n} is ${t.state} and ${same.state}`;
  }
  return "";
}

// "section.key" to value, of TOML as `overtake` writes it; a table in a list has its number.
export function readToml(text: string): Map<string, string> {
  const values = new Map<string, string>(), seen = new Map<string, number>();
  let section = "";
  for (const line of text.split("\n")) {
    const head = /^\s*\[(\[)?([^\]]+)\]/.exec(line), pair = /^\s*([\w.-]+)\s*=\s*(.*?)\s*$/.exec(line);
    if (head?.[1]) {
      seen.set(head[2], (seen.get(head[2]) ?? -1) + 1);
      section = `${head[2]}[${seen.get(head[2])}].`;
    } else if (head) {
      section = `${head[2]}.`;
    } else if (pair) {
      values.set(section + pair[1], pair[2]);
    }
  }
  return values;
}

export interface ConfigDifference { key: string; a: string; b: string }
export function configDifference(a: string, b: string): ConfigDifference[] {
  const x = readToml(a), y = readToml(b);
  return [...new Set([...x.keys(), ...y.keys()])].filter((key) => x.get(key) !== y.get(key)).map(
      (key) => ({ key, a: x.get(key) ?? "\u2013", b: y.get(key) ?? "\u2013" }));
}

// Of finite values: the smallest value that at least this share of the values does not exceed.
export function quantile(sorted: Float64Array, share: number): number {
  return sorted.length === 0 ? NaN : sorted[Math.min(sorted.length - 1,
      Math.max(0, Math.ceil(share * sorted.length) - 1))];
}
export function finiteSorted(values: Float64Array): Float64Array { return values.filter(Number.isFinite).sort(); }
