// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Two logs: how they are drawn, where they differ, and the differences of their configurations, counts and times.
import type { App } from "../app";
import { button, Choice, el, fixed, setText } from "../dom";
import { configDifference, finiteSorted, quantile } from "../pairs";
import { DataTable } from "../table";
import type { FrameTable } from "../types";

interface Row { name: string; a: number; b: number; digits: number }

export class ComparePanel {
  readonly root = el("section", { class: "compare" });
  private readonly layout: Choice<"side" | "overlay">;
  private readonly found = el("div", { class: "found" });
  private readonly pairs = el("div", { class: "hint" });
  private readonly counts: DataTable<Row>;
  private readonly now: DataTable<Row>;
  private readonly config = new DataTable<{ key: string; a: string; b: string }>([
    { title: "parameter", value: (r) => r.key, words: true }, { title: "A", value: (r) => r.a, words: true },
        { title: "B", value: (r) => r.b, words: true }]);
  private readonly configHead = el("h3");

  constructor(private readonly app: App) {
    const columns = [{ title: "", value: (r: Row) => r.name, words: true },
        { title: "A", value: (r: Row) => r.a, text: (r: Row) => fixed(r.a, r.digits) },
      { title: "B", value: (r: Row) => r.b, text: (r: Row) => fixed(r.b, r.digits) },
          { title: "B \u2212 A", value: (r: Row) => r.b - r.a, text: (r: Row) => fixed(r.b - r.a, r.digits) }];
    this.counts = new DataTable<Row>(columns);
    this.now = new DataTable<Row>(columns);
    this.layout = new Choice([["side", "side by side", "one camera, two views"],
        ["overlay", "overlaid", "B dashed over A"]], (value) => {
      app.state.compare = value;
      app.changed("settings");
    });
    const next = button("next frame in which they differ (n)", "detections, tracks, their places and states", () => {
      if (app.searching) app.searching = false;
      else void app.nextDifference();
    }, "next");
    this.root.append(el("div", { class: "row" }, this.layout.root, next), this.found, this.pairs,
        el("h3", {}, "This frame"), this.now.root,
                     el("h3", {}, "All frames"), this.counts.root, this.configHead, this.config.root);
    app.on(["info", "table", "settings", "faults"], () => this.draw());
    app.on(["frame", "settings"], () => this.drawNow());
  }

  private draw(): void {
    const { app } = this, [a, b] = app.logs;
    if (app.state.tab !== "compare" || !a || !b) return;
    this.layout.show(app.state.compare);
    setText(this.found, app.difference);
    const only = [0, 1].map((i) => app.entries.filter((e) => e.frames[1 - i] < 0).length),
        both = app.entries.length - only[0] - only[1];
    setText(this.pairs, `${both} frames in both logs, ${only[0]} in A only, ${only[1]} in B only`);
    this.counts.set(rowsOf(a.table, b.table));
    const differences = configDifference(a.info?.config ?? "", b.info?.config ?? "");
    setText(this.configHead, `Configuration: ${differences.length} ${differences.length === 1 ? "value differs"
        : "values differ"}`);
    this.config.set(differences);
  }

  private drawNow(): void {
    const { app } = this;
    if (app.state.tab !== "compare") return;
    const frames = app.logs.map((l) => l.frame), rows: Row[] = [];
    const add = (name: string, digits: number, of: (frame: NonNullable<typeof frames[0]>) => number): void => {
      const [a, b] = frames.map((f) => (f ? of(f) : NaN));
      rows.push({ name, a, b, digits });
    };
    add("points", 0, (f) => f.clouds.reduce((sum, c) => sum + c.count, 0));
    add("detections", 0, (f) => f.detections.length);
    add("tracks", 0, (f) => f.tracks.length);
    add("confirmed tracks", 0, (f) => f.tracks.filter((t) => t.state === "confirmed").length);
    add("frame, ms", 3, (f) => (f.times.find((t) => t.sensor === "" && t.stage === "frame")?.us ?? NaN) / 1000);
    this.now.set(rows);
  }
}

function rowsOf(a: FrameTable | null, b: FrameTable | null): Row[] {
  const rows: Row[] = [{ name: "frames", a: a?.stamps.length ?? NaN, b: b?.stamps.length ?? NaN, digits: 0 }];
  const sum = (values?: Float64Array): number => {
    const known = values ? finiteSorted(values) : new Float64Array(0);
    return known.length === 0 ? NaN : known.reduce((s, v) => s + v, 0);
  };
  for (const [name, key] of [["points", "points"], ["detections", "detections"], ["tracks", "tracks"],
      ["confirmed tracks", "confirmed"], ["lost scans", "lostScans"]] as const)
    rows.push({ name, a: sum(a?.[key]), b: sum(b?.[key]), digits: 0 });
  for (const [name, share] of [["frame p50, ms", 0.5], ["frame p99, ms", 0.99], ["frame max, ms", 1]] as const) {
    const [x, y] = [a, b].map((t) => quantile(finiteSorted(t?.frame_us ?? new Float64Array(0)), share) / 1000);
    rows.push({ name, a: x, b: y, digits: 3 });
  }
  return rows;
}
