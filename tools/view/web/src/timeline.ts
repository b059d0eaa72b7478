// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The time line: the latency of every frame, marks where a deadline was missed or scans were lost, the loop, the
// playhead.
import type { App } from "./app";
import { button, clockText, el, fixed, icon, kIcons, select, setText } from "./dom";
import { nearestEntry } from "./pairs";
import type { FrameTable } from "./types";

export const kFlags: [number, string][] = [
  [1, "no ego pose"], [2, "no map"], [4, "sensor missing"], [8, "sensor silent"], [16, "ego pose old"],
      [32, "cloud degraded"],
  [64, "no data"], [128, "overflow"], [256, "clock jump"], [512, "deadline missed"], [1024, "external"],
      [2048, "out of sequence"],
  [4096, "prediction"], [8192, "exception"], [16384, "ego off map"], [32768, "work limit"], [65536, "clock suspect"],
  [131072, "ego heading unknown"], [262144, "scan incomplete"],
  [524288, "no ground"], [1048576, "ego pose jumped"], [2097152, "view blocked"]];
export const flagNames = (flags: number): string[] =>
    kFlags.filter(([bit]) => Math.floor(flags / bit) % 2 === 1).map(([, name]) => name);

export const lostText = (scans: number): string => `${scans} ${scans === 1 ? "scan" : "scans"} lost`;

const kMissed = "#ff5c5c", kLost = "#ffb020", kBar = "#2e5f94", kBarB = "#7d5a2c";

// What is marked on a frame.
export function marksOf(table: FrameTable, index: number): { missed: boolean; lost: boolean } {
  const flags = table.flags[index], has = (bit: number): boolean => Number.isFinite(flags) &&
      Math.floor(flags / bit) % 2 === 1;
  const took = Number.isFinite(table.latency_us[index]) ? table.latency_us[index] : table.frame_us[index];
  return { missed: has(512) || (table.deadline_us !== null && took > table.deadline_us),
      lost: table.lostScans[index] > 0 || has(4) || has(262144) };
}

// What is drawn in a column of pixels: of all its frames the tallest bar and every mark.
interface Column { x: number; height: number; absent: boolean; missed: boolean; lost: boolean }

export class Timeline {
  readonly root = el("footer", { class: "timeline" });
  private readonly canvas = el("canvas");
  private readonly still = document.createElement("canvas");  // what does not move with the playhead
  private readonly tip = el("div", { class: "tip" });
  private readonly clock = el("div", { class: "clock" });
  private readonly playButton = icon("play", "play or pause (space)", () => this.playOrPause());
  private readonly speed = select([0.1, 0.25, 0.5, 1, 2, 4].map((v) => [String(v), `${v}\u00d7`] as const), "speed",
      (v) => this.app.setSpeed(Number(v)));
  private readonly loop = button("loop", "loop: drag with shift on the time line, or [ and ]", () => this.toggleLoop());
  private width = 0;
  private height = 0;
  marked = { missed: 0, lost: 0 };
  drawn = { bars: 0, labels: 0 };  // for tests

  constructor(private readonly app: App) {
    const controls = el("div", { class: "controls" },
      icon("first", "first frame (Home)", () => app.step(-1e9)),
          icon("back", "a frame back (left; with shift a second)", () => app.step(-1)), this.playButton,
      icon("forward", "a frame on (right; with shift a second)", () => app.step(1)),
          icon("last", "last frame (End)", () => app.step(1e9)), this.speed, this.loop);
    const area = el("div", { class: "area" }, this.canvas, this.tip);
    this.root.append(el("div", { class: "left" }, controls, this.clock), area);
    app.on(["table", "settings"], () => this.drawStill());
    app.on(["table", "settings", "clock", "frame"], () => this.draw());
    new ResizeObserver(() => { this.drawStill(); this.draw(); }).observe(area);
    this.watch(area);
    document.addEventListener("keydown", (e) => this.key(e));
  }

  private playOrPause(): void {
    if (this.app.playing) this.app.pause();
    else this.app.play();
  }
  private toggleLoop(): void {
    const { app } = this, { state } = app;
    state.loop = state.loop || !app.entry ? null : [app.entry.stamp, app.last];
    app.changed("settings");
  }

  private key(e: KeyboardEvent): void {
    const { app } = this, target = e.target as HTMLElement;
    if (e.ctrlKey || e.metaKey || e.altKey || target.tagName === "INPUT" || target.tagName === "SELECT") return;
    const setLoop = (end: 0 | 1): void => {
      if (!app.entry) return;
      const loop: [bigint, bigint] = app.state.loop ?? [app.first, app.last];
      loop[end] = app.entry.stamp;
      app.state.loop = loop[0] < loop[1] ? loop : null;
      app.changed("settings");
    };
    const keys: Record<string, () => void> = {
      ArrowLeft: () => (e.shiftKey ? app.stepSeconds(-1) : app.step(-1)),
          ArrowRight: () => (e.shiftKey ? app.stepSeconds(1) : app.step(1)),
      Home: () => app.step(-1e9), End: () => app.step(1e9), " ": () => this.playOrPause(), "[": () => setLoop(0),
          "]": () => setLoop(1),
      n: () => void app.nextDifference(), Escape: () => app.select(null),
    };
    if (!keys[e.key]) return;
    e.preventDefault();
    keys[e.key]();
  }

  private watch(area: HTMLElement): void {
    let dragging = false, loopFrom: bigint | null = null;
    const stampAt = (e: PointerEvent): bigint => {
      const share = Math.min(1, Math.max(0, (e.clientX - area.getBoundingClientRect().left) / this.width));
      return this.app.first + BigInt(Math.round(share * Number(this.app.last - this.app.first)));
    };
    const move = (e: PointerEvent): void => {
      const stamp = stampAt(e), { app } = this;
      if (loopFrom !== null && stamp !== loopFrom) {
        app.state.loop = stamp > loopFrom ? [loopFrom, stamp] : [stamp, loopFrom];
        app.changed("settings");
      } else if (dragging) {
        app.seek(nearestEntry(app.entries, stamp));
      }
      this.showTip(e, stamp);
    };
    area.addEventListener("pointerdown", (e) => {
      if (this.app.entries.length === 0 || this.app.live) return;
      area.setPointerCapture(e.pointerId);
      if (e.shiftKey) loopFrom = stampAt(e);
      else dragging = true;
      move(e);
    });
    area.addEventListener("pointermove", move);
    area.addEventListener("pointerup", () => { dragging = false; loopFrom = null; });
    area.addEventListener("pointerleave", () => { this.tip.hidden = true; });
  }

  private showTip(e: PointerEvent, stamp: bigint): void {
    const { app } = this;
    if (app.entries.length === 0) return;
    const i = nearestEntry(app.entries, stamp), entry = app.entries[i], table = app.logs[0].table,
        frame = entry.frames[0];
    const parts = [`frame ${i}`, `${clockText(app.seconds(entry.stamp))} s`];
    if (table && frame >= 0) {
      parts.push(`${fixed(table.frame_us[frame] / 1000, 2)} ms`);
      if (table.lostScans[frame] > 0) parts.push(lostText(table.lostScans[frame]));
      parts.push(...flagNames(table.flags[frame]));
    }
    this.tip.hidden = false;
    setText(this.tip, parts.join("  \u00b7  "));
    const box = this.root.getBoundingClientRect(), left = (this.canvas.getBoundingClientRect().left);
    this.tip.style.left = `${Math.min(e.clientX - left, box.right - left - this.tip.offsetWidth - 8)}px`;
  }

  private x(stamp: bigint): number {
    const whole = Number(this.app.last - this.app.first);
    return whole > 0 ? Number(stamp - this.app.first) / whole * (this.width - 1) : 0;
  }

  private drawStill(): void {
    const ratio = devicePixelRatio, area = this.canvas.parentElement!, { app } = this;
    this.width = area.clientWidth;
    this.height = area.clientHeight;
    for (const canvas of [this.canvas, this.still])
      Object.assign(canvas, { width: Math.max(1, this.width * ratio), height: Math.max(1, this.height * ratio) });
    const g = this.still.getContext("2d")!, base = this.height - 16, top = 12;
    g.scale(ratio, ratio);
    this.marked = { missed: 0, lost: 0 };
    const tables = app.logs.map((l) => l.table), deadline = tables[0]?.deadline_us ?? null;
    let highest = deadline ?? 0;
    for (const table of tables) for (const us of table?.frame_us ?? []) if (us > highest) highest = us;
    const bar = Math.max(1, this.width / Math.max(1, app.entries.length) - 0.5);
    const columns = tables.map(() => Array.from({ length: this.width + 1 }, (): Column => (
        { x: NaN, height: -1, absent: false, missed: false, lost: false })));
    for (const entry of app.entries) {
      const x = this.x(entry.stamp);
      for (const [log, table] of tables.entries()) {
        const frame = entry.frames[log], column = columns[log][Math.floor(x)];
        if (!column) continue;
        if (Number.isNaN(column.x)) column.x = x;
        if (!table || frame < 0) {
          column.absent = true;
          continue;
        }
        const us = table.frame_us[frame], marks = marksOf(table, frame),
            height = Number.isFinite(us) && highest > 0 ? us / highest * (base - top) : 2;
        if (height > column.height) column.height = height;
        if (marks.missed) ++this.marked.missed, column.missed = true;
        if (marks.lost) ++this.marked.lost, column.lost = true;
      }
    }
    this.drawn = { bars: 0, labels: 0 };
    const fill = (color: string, x: number, y: number, width: number, height: number): void => {
      g.fillStyle = color;
      g.fillRect(x, y, width, height);
      ++this.drawn.bars;
    };
    for (const [log, list] of columns.entries())
      for (const { x, height, absent, missed, lost } of list) {
        if (absent) fill("#3b2f4d", x, base - 3, bar, 3);
        if (height >= 0) fill(log === 0 ? kBar : kBarB, x, base - height, log === 0 ? bar : Math.max(1, bar / 2), height);
        if (missed) fill(kMissed, x, 0, Math.max(2, bar), 6);
        if (lost) fill(kLost, x, 6, Math.max(2, bar), 5);
      }
    if (deadline !== null) {
      g.fillStyle = "rgba(255,92,92,0.55)";
      g.fillRect(0, base - deadline / highest * (base - top), this.width, 1);
    }
    g.fillStyle = "#7d8797";
    g.font = "10px system-ui, sans-serif";
    const whole = app.seconds(app.last), most = Math.max(1, this.width / 70);
    let step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600].find((s) => whole / s < most) ?? 1200;
    while (whole / step > most) step *= 2;  // a log of odd stamps lasts for years
    for (let s = 0; whole > 0 && s <= whole; s += step) {
      const x = s / whole * (this.width - 1);
      ++this.drawn.labels;
      g.fillRect(x, base, 1, 3);
      g.fillText(`${Number(s.toFixed(1))} s`, Math.min(x + 3, this.width - 30), this.height - 4);
    }
  }

  private draw(): void {
    const { app } = this, g = this.canvas.getContext("2d")!, ratio = devicePixelRatio;
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.clearRect(0, 0, this.canvas.width, this.canvas.height);
    g.drawImage(this.still, 0, 0);
    g.scale(ratio, ratio);
    if (app.state.loop) {
      const [a, b] = app.state.loop.map((stamp) => this.x(stamp));
      g.fillStyle = "rgba(255,225,77,0.13)";
      g.fillRect(a, 0, b - a, this.height - 16);
      g.fillStyle = "#ffe14d";
      g.fillRect(a, 0, 1, this.height - 16);
      g.fillRect(b, 0, 1, this.height - 16);
    }
    if (app.entry) {
      const x = this.x(app.entry.stamp);
      g.fillStyle = "#f2f5f9";
      g.fillRect(Math.round(x) - 0.75, 0, 1.5, this.height - 14);
      g.beginPath();
      g.moveTo(x - 5, 0);
      g.lineTo(x + 5, 0);
      g.lineTo(x, 7);
      g.fill();
    }
    this.playButton.querySelector("path")!.setAttribute("d", kIcons[app.playing ? "pause" : "play"]);
    this.speed.value = String(app.state.speed);
    this.loop.classList.toggle("on", app.state.loop !== null);
    setText(this.clock, app.entry ? `${clockText(app.seconds(app.entry.stamp))}  /  ${clockText(app.seconds(app.last))}`
        : "");
  }
}
