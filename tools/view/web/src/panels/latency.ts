// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The time of every stage over the whole race, its quantiles and its histogram.
import type { App } from "../app";
import { el, fixed, setText } from "../dom";
import { finiteSorted, quantile } from "../pairs";
import { Plot, type Series } from "../plot";
import { DataTable } from "../table";

interface StageRow { key: string; log: number; values: Float64Array; sorted: Float64Array }

const kColors = ["#4da3ff", "#3ddc84", "#ffb020", "#ff6ad5", "#c58bff", "#5ee0e6", "#f2e35c", "#ff8a70"], kBins = 48,
    kNone = new Float64Array(0);

export class LatencyPanel {
  readonly root = el("section", { class: "latency" });
  readonly plot: Plot;
  private readonly head = el("h3", {}, "Time of each frame, ms");
  private readonly table: DataTable<StageRow>;
  private readonly histogram = el("canvas", { class: "histogram" });
  private readonly histogramHead = el("h3");
  private rows: StageRow[] = [];

  constructor(private readonly app: App) {
    this.plot = new Plot({ height: 190, unit: "ms", digits: 3,
        onClick: (s) => app.gotoStamp(app.first + BigInt(Math.round(s * 1e9))),
                           lines: () => this.limits().map(({ ms, color }) => ({ value: ms, color })) });
    const ms = (row: StageRow, share: number): number => quantile(row.sorted, share) / 1000;
    this.table = new DataTable<StageRow>([
      ...(app.logs.length > 1 ? [{ title: "log", value: (r: StageRow) => "AB"[r.log], words: true }] : []),
      { title: "stage", value: (r) => r.key, words: true },
      { title: "p50 ms", value: (r) => ms(r, 0.5), text: (r) => fixed(ms(r, 0.5), 3) },
      { title: "p99 ms", value: (r) => ms(r, 0.99), text: (r) => fixed(ms(r, 0.99), 3) },
      { title: "max ms", value: (r) => ms(r, 1), text: (r) => fixed(ms(r, 1), 3) },
      { title: "now ms", value: (r) => this.nowOf(r), text: (r) => fixed(this.nowOf(r), 3) },
      { title: "frames", value: (r) => r.sorted.length },
    ], (r) => this.toggleSeries(r.key));
    this.root.append(this.head, this.plot.root, this.histogramHead, this.histogram, el("h3", {}, "Stages"),
        el("div", { class: "hint" },
        "A click on a row adds it to the plot or takes it away. A click in the plot goes to the frame."),
        this.table.root);
    app.on(["table", "settings"], () => this.draw());
    app.on(["clock"], () => this.drawNow());
    new ResizeObserver(() => this.drawHistogram()).observe(this.histogram);
  }

  // The deadline, and the period of the scans: the lines of the plot.
  private limits(): { name: string; ms: number; color: string }[] {
    const { deadline_us = null, period_us = null } = this.app.logs[0]?.table ?? {}, list = [];
    if (deadline_us !== null) list.push({ name: "deadline", ms: deadline_us / 1000, color: "#ff5c5c" });
    if (period_us !== null) list.push({ name: "period", ms: period_us / 1000, color: "#5a6575" });
    return list;
  }
  private nowOf(row: StageRow): number { return (row.values[this.app.entry?.frames[row.log] ?? -1] ?? NaN) / 1000; }

  private toggleSeries(key: string): void {
    const { state } = this.app;
    state.series = state.series.includes(key) ? state.series.filter((k) => k !== key) : [...state.series, key];
    if (state.series.length === 0) state.series = ["frame"];
    this.app.changed("settings");
  }

  private collect(): void {
    this.rows = [];
    for (const log of this.app.logs) {
      const { table } = log;
      if (!table) continue;
      const add = (key: string, values: Float64Array): void => {
        const sorted = finiteSorted(values);
        if (sorted.length > 0) this.rows.push({ key, log: log.index, values, sorted });
      };
      add("frame", table.frame_us);
      add("latency", table.latency_us);
      for (const s of table.stages)
        if (s.sensor !== "" || s.stage !== "frame") add(s.sensor === "" ? s.stage : `${s.sensor}/${s.stage}`, s.us);
    }
  }

  private draw(): void {
    const { app } = this;
    if (app.state.tab !== "latency") return;
    this.collect();
    const x = app.entries.map((e) => app.seconds(e.stamp)), series: Series[] = [];
    for (const key of app.state.series)
      for (const row of this.rows.filter((r) => r.key === key)) {
        const values = app.entries.map((e) => {
          const us = row.values[e.frames[row.log]];
          return us === undefined || Number.isNaN(us) ? null : us / 1000;
        });
        series.push({ name: app.logs.length > 1 ? `${"AB"[row.log]} ${key}` : key,
            color: kColors[series.length % kColors.length], values, dashed: row.log === 1 });
      }
    this.plot.set(x, series);
    const limits = this.limits().map(({ name, ms }) => `; ${name} ${fixed(ms, 1)}`);
    setText(this.head, `Time of each frame, ms${limits.join("")}`);
    this.drawNow();
    this.drawHistogram();
  }

  private drawNow(): void {
    const { app } = this;
    if (app.state.tab !== "latency") return;
    this.table.set(this.rows, (r) => app.state.series.includes(r.key));
    this.plot.showNow(app.entry ? app.seconds(app.entry.stamp) : NaN);
  }

  private drawHistogram(): void {
    const key = this.app.state.series[0], shown = this.rows.filter((r) => r.key === key), ratio = devicePixelRatio;
    const width = this.histogram.clientWidth, height = this.histogram.clientHeight;
    if (width === 0) return;
    Object.assign(this.histogram, { width: width * ratio, height: height * ratio });
    const g = this.histogram.getContext("2d")!;
    g.scale(ratio, ratio);
    setText(this.histogramHead, `Histogram: ${key}`);
    const sorted = shown.map((r) => r.sorted), high = Math.max(...sorted.map((s) => quantile(s, 1)), 1),
        base = height - 16;
    for (const [i, values] of sorted.entries()) {
      const counts = histogramOf(values, high), most = Math.max(...counts, 1), bar = width / kBins;
      g.fillStyle = i === 0 ? "#2e6fb5" : "rgba(255,176,32,0.55)";
      counts.forEach((count, k) => { if (count > 0) g.fillRect(k * bar, base - Math.max(1, count / most * (base - 14)),
          bar - 1, Math.max(1, count / most * (base - 14))); });
      g.font = "10px system-ui, sans-serif";
      for (const [name, share] of [["p50", 0.5], ["p99", 0.99], ["max", 1]] as const) {
        const x = Math.min(quantile(values, share) / high * width, width - 1);
        g.fillStyle = "#d6dbe3";
        g.fillRect(x, 12, 1, base - 12);
        if (i === 0) g.fillText(name, Math.min(x + 3, width - 24), share === 0.99 ? 20 : 10);
      }
    }
    g.fillStyle = "#7d8797";
    g.fillText("0", 1, height - 4);
    g.fillText(`${fixed(high / 1000, 2)} ms`, width - 52, height - 4);
  }
  // For tests.
  quantilesOf(key: string, log = 0): number[] {
    this.collect();
    const row = this.rows.find((r) => r.key === key && r.log === log);
    return [0.5, 0.99, 1].map((share) => quantile(row?.sorted ?? kNone, share));
  }
}

export function histogramOf(values: Float64Array, high: number): number[] {
  const counts = new Array<number>(kBins).fill(0);
  for (const v of values) ++counts[Math.min(kBins - 1, Math.max(0, Math.floor(v / high * kBins)))];
  return counts;
}
