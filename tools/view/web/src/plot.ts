// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A plot over time (uPlot) that follows its container's width and jumps on a click.
import uPlot from "uplot";
import { el } from "./dom";

export interface Series { name: string; color: string; values: (number | null)[]; dashed?: boolean }
export interface PlotOptions { height: number; unit: string; digits: number; onClick: (seconds: number) => void;
    lines?: () => { value: number; color: string }[] }

const kAxis = { stroke: "#8690a0", grid: { stroke: "#1f252e", width: 1 },
    ticks: { stroke: "#2a313c", width: 1, size: 4 }, font: "10px system-ui, sans-serif" };

export class Plot {
  readonly root = el("div", { class: "plot" });
  private plot: uPlot | null = null;
  private signature = "";
  private now = NaN;
  private data: uPlot.AlignedData = [[]];

  constructor(private readonly options: PlotOptions) {
    new ResizeObserver(() => {
      if (this.plot && this.root.clientWidth > 0)
        this.plot.setSize({ width: this.root.clientWidth, height: options.height });
    }).observe(this.root);
  }

  set(x: number[], series: Series[]): void {
    this.data = [x, ...series.map((s) => s.values)];
    if (x.length === 0) {  // uPlot finds no axes for no data
      this.plot?.destroy();
      this.plot = null;
      return;
    }
    const signature = series.map((s) => `${s.name}|${s.color}|${s.dashed}`).join("\n");
    if (this.plot && signature === this.signature) this.plot.setData(this.data);
    else this.build(series);
    this.signature = signature;
  }
  // The values as drawn, for tests.
  get values(): uPlot.AlignedData { return this.data; }
  // Where a value of x lies, in pixels from the plot's left edge.
  position(x: number): number {
    return this.plot ? this.plot.valToPos(x, "x") + this.plot.over.getBoundingClientRect().left : NaN;
  }

  showNow(seconds: number): void {
    this.now = seconds;
    if (this.data[0].length > 0) this.plot?.redraw(false);
  }

  private build(series: Series[]): void {
    const { height, unit, digits, onClick, lines } = this.options;
    this.plot?.destroy();
    const text = (value: number | null): string => (value == null ? "\u2013" : `${value.toFixed(digits)} ${unit}`);
    this.plot = new uPlot({
      width: Math.max(200, this.root.clientWidth), height, legend: { show: series.length > 1, live: true },
          cursor: { y: false, drag: { x: true, y: false } },
      scales: { x: { time: false } },
      axes: [{ ...kAxis, size: 24, values: (_, ticks) => ticks.map((t) => `${Number(t.toFixed(2))} s`) },
          { ...kAxis, size: 44 }],
      series: [{ label: "time", value: (_, v) => (v == null ? "\u2013" : `${v.toFixed(3)} s`) },
          ...series.map((s): uPlot.Series => ({
        label: s.name, stroke: s.color, width: 1.25, dash: s.dashed ? [5, 3] : undefined, spanGaps: false,
            points: { show: false }, value: (_, v) => text(v) }))],
      hooks: { draw: [(u) => {
        const g = u.ctx, box = u.bbox;
        for (const { value, color } of lines?.() ?? []) {
          const y = u.valToPos(value, "y", true);
          if (y < box.top || y > box.top + box.height) continue;
          g.fillStyle = color;
          g.fillRect(box.left, y, box.width, 1);
        }
        const x = u.valToPos(this.now, "x", true);
        if (x >= box.left && x <= box.left + box.width)
          g.fillStyle = "rgba(242,245,249,0.8)", g.fillRect(x - 0.5, box.top, 1.5, box.height);
      }] },
    }, this.data, this.root);
    const over = this.plot.over;
    let down = 0;
    over.addEventListener("mousedown", (e) => { down = e.clientX; });
    over.addEventListener("mouseup", (e) => {
      if (this.plot && Math.abs(e.clientX - down) < 3)
        onClick(this.plot.posToVal(e.clientX - over.getBoundingClientRect().left, "x"));
    });
  }
}
