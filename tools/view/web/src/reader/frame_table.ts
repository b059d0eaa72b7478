// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The numbers of every frame: from the attachment `frames`, or collected one by one.
import type { FrameTable, StageTime } from "../types";

const kColumns = ["frame_us", "latency_us", "points", "detections", "tracks", "confirmed", "flags",
    "lostScans"] as const;
type Column = typeof kColumns[number];

export class TableBuilder {
  readonly stamps: bigint[] = [];
  private readonly columns = new Map<Column, number[]>(kColumns.map((name) => [name, []]));
  private readonly stages = new Map<string, { sensor: string; stage: string; us: number[] }>();

  add(stamp: bigint): number { return this.stamps.push(stamp) - 1; }
  set(index: number, column: Column, value: number): void { this.columns.get(column)![index] = value; }
  setTimes(index: number, times: StageTime[]): void {
    for (const { sensor, stage, us } of times) {
      const key = `${sensor}\n${stage}`;
      if (!this.stages.has(key)) this.stages.set(key, { sensor, stage, us: [] });
      this.stages.get(key)!.us[index] = us;
      if (sensor === "" && stage === "frame") this.set(index, "frame_us", us);
    }
  }
  dropFirst(count: number): void {
    this.stamps.splice(0, count);
    for (const column of [...this.columns.values(), ...[...this.stages.values()].map((s) => s.us)])
      column.splice(0, count);
  }

  table(): FrameTable {
    const count = this.stamps.length;
    const full = (values: number[]): Float64Array => Float64Array.from({ length: count }, (_, i) => values[i] ?? NaN);
    const columns = Object.fromEntries(kColumns.map((name) => [name, full(this.columns.get(name)!)])) as Record<Column,
        Float64Array>;
    return { stamps: BigInt64Array.from(this.stamps), deadline_us: null, period_us: null, ...columns,
             stages: [...this.stages.values()].map((s) => ({ sensor: s.sensor, stage: s.stage, us: full(s.us) })) };
  }
}

// Null if the attachment has no stamps.
export function readFrames(json: unknown): FrameTable | null {
  const all = (json ?? {}) as Record<string, unknown>;
  if (!Array.isArray(all.stamp_ns)) return null;
  const count = all.stamp_ns.length;
  const column = (values: unknown): Float64Array => {
    const from = Array.isArray(values) ? values : [];
    return Float64Array.from({ length: count }, (_, i) => typeof from[i] === "number" ? from[i] as number : NaN);
  };
  const stages = (Array.isArray(all.stages) ? all.stages : []) as { sensor: string; stage: string; us: unknown }[];
  return { stamps: BigInt64Array.from(all.stamp_ns, (text) => BigInt(text as string)),
           deadline_us: typeof all.deadline_us === "number" ? all.deadline_us : null,
           period_us: typeof all.period_us === "number" ? all.period_us : null,
           frame_us: column(all.frame_us), latency_us: column(all.latency_us), points: column(all.points),
               detections: column(all.detections),
           tracks: column(all.tracks), confirmed: column(all.confirmed), flags: column(all.flags),
               lostScans: column(all.lost_scans),
           stages: stages.map((s) => ({ sensor: String(s.sensor), stage: String(s.stage), us: column(s.us) })) };
}
