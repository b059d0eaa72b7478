// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which point a pixel of the range image holds, and the other way round. The pixel's range is exactly the point's, and
// its column follows from the azimuth; the row then needs no model of the sensor.
import { readToml } from "./pairs";
import type { Cloud, Image } from "./types";

interface Columns { left_rad: number; perColumn: number; cols: number }

const kSameRange = 2e-6;  // relative: float32 sums in another order

// The sensor's columns from the log's configuration; null without one.
export function columnsOf(config: string | null, sensor: string): Columns | null {
  const values = readToml(config ?? "");
  for (let i = 0; values.has(`rig.sensor[${i}].name`); ++i) {
    if (values.get(`rig.sensor[${i}].name`) !== `"${sensor}"`) continue;
    const number = (key: string): number => Number(values.get(`rig.sensor[${i}].${key}`));
    const cols = number("cols"), left = number("azimuth_left_deg"), right = number("azimuth_right_deg");
    const span = left - right > 0 ? left - right : 360;
    return Number.isFinite(left) && cols > 0 ? { left_rad: left * Math.PI / 180,
        perColumn: cols / (span * Math.PI / 180), cols } : null;
  }
  return null;
}

export class PixelLink {
  private readonly range: Float32Array;
  private order: Uint32Array | null = null;

  constructor(private readonly cloud: Cloud, private readonly image: Image, private readonly columns: Columns | null) {
    const p = cloud.position;
    this.range = Float32Array.from({ length: cloud.count }, (_, i) => Math.hypot(p[3 * i], p[3 * i + 1], p[3 * i + 2]));
  }

  private columnOf(point: number): number | null {
    if (!this.columns) return null;
    const right = this.columns.left_rad - Math.atan2(this.cloud.position[3 * point + 1],
        this.cloud.position[3 * point]);
    const turn = 2 * Math.PI;
    return Math.floor((right < 0 ? right + turn : right >= turn ? right - turn : right) * this.columns.perColumn);
  }

  pointOf(row: number, col: number): number | null {
    const value = (this.image.values as Float32Array)[row * this.image.cols + col];
    if (!(value > 0)) return null;
    this.order ??= Uint32Array.from(this.range.keys()).sort((a, b) => this.range[a] - this.range[b]);
    const order = this.order;
    let low = 0, high = order.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.range[order[middle]] < value * (1 - kSameRange)) low = middle + 1;
      else high = middle;
    }
    let best: number | null = null, least = Infinity;
    for (; low < order.length && this.range[order[low]] <= value * (1 + kSameRange); ++low) {
      const column = this.columnOf(order[low]), apart = column === null ? 0 : Math.abs(column - col);
      const cost = apart + Math.abs(this.range[order[low]] - value) / value / kSameRange;
      if (apart <= 1 && cost < least) least = cost, best = order[low];
    }
    return best;
  }

  // Null: another point won its pixel, or it was not used.
  pixelOf(point: number): { row: number; col: number } | null {
    const { rows, cols } = this.image, values = this.image.values as Float32Array, column = this.columnOf(point),
        range = this.range[point];
    if (!(range > 0)) return null;
    const candidates = column === null ? Array.from({ length: cols }, (_, i) => i) : [column, column - 1, column + 1];
    for (const col of candidates)
      for (let row = 0; row < rows && col >= 0 && col < cols; ++row)
        if (Math.abs(values[row * cols + col] - range) <= range * kSameRange) return { row, col };
    return null;
  }
}
