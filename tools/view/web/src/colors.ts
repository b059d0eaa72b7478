// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Colours of points and pixels. labelColor and scaleColor are those of tools/io/image.cpp.
import type { Cloud } from "./types";

export type Rgb = [number, number, number];

const kStops: Rgb[] = [[38, 20, 84], [50, 60, 135], [44, 100, 150], [36, 135, 150], [40, 170, 130], [105, 200, 90],
    [190, 220, 60], [253, 240, 110]];
const kLightness = [1.0, 0.72, 0.86], kGoldenAngle = 0.61803398874989485;  // in turns
const kNoLabel: Rgb = [74, 58, 92], kGround: Rgb = [60, 60, 60];

const clamp = (value: number, low: number, high: number): number => Math.min(Math.max(value, low), high);

export function scaleColor(share: number): Rgb {
  const at = clamp(share, 0, 1) * (kStops.length - 1), stop = Math.min(Math.trunc(at), kStops.length - 2);
  return kStops[stop].map((a, i) => Math.trunc(a + (kStops[stop + 1][i] - a) * (at - stop) + 0.5)) as Rgb;
}

export function labelColor(label: number): Rgb {
  if (label < 0) return [0, 0, 0];
  if (label === 0) return kGround;
  const lightness = kLightness[label % 3], strength = label % 2 ? 0.85 : 0.6, hue = label * kGoldenAngle;
  return [0, 1, 2].map((i) => {
    let h = hue + i / 3;
    h -= Math.trunc(h);
    const ramp = clamp(Math.abs(6 * h - 3) - 1, 0, 1);
    return Math.trunc(255 * lightness * (1 - strength * (1 - ramp)) + 0.5);
  }) as Rgb;
}

export const kReasons: [string, Rgb][] = [
  ["labelled", [84, 92, 104]], ["not finite", [255, 0, 255]], ["zero range", [120, 0, 160]],
      ["range limit", [170, 110, 255]],
  ["bad layer", [255, 90, 90]], ["outside azimuth", [70, 130, 255]], ["layer dropped", [255, 160, 60]],
      ["dust", [240, 220, 90]],
  ["second return", [60, 220, 200]], ["smoke", [200, 200, 210]], ["own body", [110, 220, 110]]];

export const kSensorColors: Rgb[] = [[92, 200, 255], [255, 176, 84], [140, 226, 120], [240, 130, 200], [190, 160, 255],
    [250, 230, 110], [120, 230, 220], [255, 120, 110]];

// The colour scale of 256 steps and the labels' colours as bytes r g b a in one word.
const word = ([r, g, b]: Rgb): number => (255 << 24 | b << 16 | g << 8 | r) >>> 0;
const kScale = Uint32Array.from({ length: 256 }, (_, i) => word(scaleColor(i / 255)));
let labels = new Uint32Array(0);
function labelWord(label: number): number {
  if (!(label >= 0)) return word(kNoLabel);
  if (label >= labels.length && label < 1 << 20)
    labels = Uint32Array.from({ length: 2 * label + 1024 }, (_, i) => word(labelColor(i)));
  return labels[label] ?? word(kNoLabel);
}

export const kColorings = ["label", "cluster", "reason", "intensity", "height", "range", "layer", "sensor"] as const;
export type Coloring = typeof kColorings[number];

export interface Scale { low: number; high: number; unit: string; log: boolean }

// The ends of the scale; null where the colours are categories. Fixed where frames should compare.
export function scaleOf(coloring: Coloring, clouds: Cloud[]): Scale | null {
  if (coloring === "height") return { low: -1, high: 4, unit: "m", log: false };
  if (coloring === "range") return { low: 2, high: 200, unit: "m", log: true };
  if (coloring !== "intensity" && coloring !== "layer") return null;
  let low = Infinity, high = -Infinity;
  for (const cloud of clouds)
    for (const value of cloud.fields[coloring] ?? []) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  return high > low ? { low, high, unit: "", log: false } : { low: 0, high: 1, unit: "", log: false };
}

// True if the cloud has what the colouring needs.
export function canColor(coloring: Coloring, cloud: Cloud): boolean {
  return ["height", "range", "sensor"].includes(coloring) || coloring in cloud.fields;
}

export function colorCloud(cloud: Cloud, sensorIndex: number, coloring: Coloring, scale: Scale | null,
    out: Uint32Array): void {
  const { count, position: p, fields, vehicleFromSensor: m } = cloud;
  if (coloring === "label" || coloring === "cluster") {
    const values = fields[coloring];
    for (let i = 0; i < count; ++i) out[i] = labelWord(values[i] + (coloring === "cluster" && values[i] >= 0 ? 1 : 0));
  } else if (coloring === "reason") {
    const table = kReasons.map(([, color]) => word(color));
    for (let i = 0; i < count; ++i) out[i] = table[fields.reason[i]] ?? word([255, 0, 0]);
  } else if (coloring === "sensor" || !scale) {
    out.fill(word(kSensorColors[sensorIndex % kSensorColors.length]), 0, count);
  } else {
    const map = scale.log ? Math.log : (v: number): number => v;
    const low = map(scale.low), factor = 255 / (map(scale.high) - low), values = fields[coloring];
    for (let i = 0, k = 0; i < count; ++i, k += 3) {
      const value = coloring === "height" ? m[2] * p[k] + m[6] * p[k + 1] + m[10] * p[k + 2] + m[14]
        : coloring === "range" ? Math.sqrt(p[k] * p[k] + p[k + 1] * p[k + 1] + p[k + 2] * p[k + 2]) : values[i];
      out[i] = kScale[Math.round(clamp((map(value) - low) * factor, 0, 255)) || 0];
    }
  }
}
