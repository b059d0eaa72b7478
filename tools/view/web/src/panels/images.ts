// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The images of one sensor, six pixels a row, with their scale and the value under the pointer.
import type { App } from "../app";
import { scaleColor, type Rgb } from "../colors";
import { el, fixed, select, setText, toggle } from "../dom";
import { columnsOf, PixelLink } from "../links";
import type { LogView } from "../log_view";
import type { Frame, Image } from "../types";

const kRowPixels = 6, kUndefined: Rgb = [70, 30, 70], kObstacle: Rgb = [250, 215, 90], kRoad: Rgb = [60, 60, 60],
    kTrimmed = 200;
const kOrder = ["range", "angle_smooth", "height", "range_repaired", "nonground", "labels"];

interface Colored { low: string; high: string; unit: string; share: (value: number) => number;
    text: (value: number) => string }

// The colours of an image of numbers: those of `overtake inspect`.
function scaleOfImage(image: Image): Colored {
  const values = image.values as Float32Array, degree = 180 / Math.PI;
  if (image.name.startsWith("angle"))
    return { low: "0", high: "90", unit: "\u00b0 (0 is level)", share: (v) => (v < 0 ? NaN : v / (Math.PI / 2)),
        text: (v) => (v < 0 ? "undefined" : `${fixed(v * degree, 2)} \u00b0`) };
  if (image.name === "height")
    return { low: "-0.5", high: "2.0", unit: "m over the road", share: (v) => (v + 0.5) / 2.5,
        text: (v) => `${fixed(v, 3)} m` };
  const known = values.filter((v) => v > 0).sort(), skip = Math.floor(known.length / kTrimmed);
  const low = known.length > 0 ? known[skip] : 1,
      high = Math.max(low * 1.001, known.length > 0 ? known[known.length - 1 - skip] : 2);
  return { low: fixed(low, 1), high: fixed(high, 1), unit: "m (log)",
      share: (v) => (v > 0 ? Math.log(v / low) / Math.log(high / low) : NaN),
           text: (v) => (v > 0 ? `${fixed(v, 3)} m` : "no return") };
}

function paint(image: Image, ranges: Image | undefined, scale: Colored): ImageData {
  const out = new ImageData(image.cols, image.rows), { values } = image;
  for (let i = 0, to = 0; i < image.rows * image.cols; ++i, to += 4) {
    let color: Rgb = [0, 0, 0];
    if (image.encoding === "rgb8") color = [values[3 * i], values[3 * i + 1], values[3 * i + 2]];
    else if (image.encoding === "mono8")
      color = values[i] > 0 ? kObstacle : (ranges?.values[i] ?? 0) > 0 ? kRoad : [0, 0, 0];
    else if (image.name.startsWith("angle") && values[i] < -1.5) color = kUndefined;
    else if (image.name !== "height" || !ranges || ranges.values[i] > 0) {
      const share = scale.share(values[i]);
      if (!Number.isNaN(share)) color = scaleColor(share);
    }
    out.data.set(color, to);
    out.data[to + 3] = 255;
  }
  return out;
}

class Strip {
  readonly canvas = el("canvas");
  private readonly cross = el("div", { class: "cross" });
  private readonly title = el("span", { class: "name" });
  private readonly value = el("span", { class: "value" });
  private readonly low = el("span");
  private readonly high = el("span");
  private readonly bar = el("i");
  readonly root = el("div", { class: "strip" }, el("div", { class: "head" }, this.title, this.value,
      el("span", { class: "scale" }, this.low, this.bar, this.high)),
                     el("div", { class: "picture" }, this.canvas, this.cross));
  image: Image | null = null;
  private scale: Colored | null = null;

  show(image: Image, ranges: Image | undefined, prefix: string): void {
    this.image = image;
    this.scale = scaleOfImage(image);
    setText(this.title, `${prefix}${image.sensor} ${image.name}`);
    const numbers = image.encoding === "32FC1";
    setText(this.low, numbers ? this.scale.low : "");
    setText(this.high, numbers ? `${this.scale.high} ${this.scale.unit}` : image.encoding === "mono8"
        ? "yellow: not ground" : "a colour a cluster");
    this.bar.hidden = !numbers;
    Object.assign(this.canvas, { width: image.cols, height: image.rows });
    this.canvas.style.height = `${image.rows * kRowPixels}px`;
    this.canvas.getContext("2d")!.putImageData(paint(image, ranges, this.scale), 0, 0);
  }

  pixelAt(e: PointerEvent): { row: number; col: number } {
    const box = this.canvas.getBoundingClientRect(), { rows, cols } = this.image!;
    const at = (share: number, count: number): number => Math.min(count - 1, Math.max(0, Math.floor(share * count)));
    return { row: at((e.clientY - box.top) / box.height, rows), col: at((e.clientX - box.left) / box.width, cols) };
  }

  mark(pixel: { row: number; col: number } | null, extra: string): void {
    this.cross.hidden = pixel === null || !this.image;
    if (!pixel || !this.image) {
      setText(this.value, "");
      return;
    }
    this.cross.style.left = `${(pixel.col + 0.5) / this.image.cols * 100}%`;
    this.cross.style.top = `${(pixel.row + 0.5) / this.image.rows * 100}%`;
    setText(this.value, `row ${pixel.row}  col ${pixel.col}:  ${this.textAt(pixel.row, pixel.col)}${extra}`);
  }

  textAt(row: number, col: number): string {
    const i = row * this.image!.cols + col, { values, encoding } = this.image!;
    if (encoding === "rgb8") return `rgb ${values[3 * i]} ${values[3 * i + 1]} ${values[3 * i + 2]}`;
    return encoding === "mono8" ? (values[i] > 0 ? "not ground" : "ground or no return") : this.scale!.text(values[i]);
  }
}

export class ImagesPanel {
  readonly root = el("section", { class: "images" });
  private readonly bar = el("div", { class: "bar" });
  private readonly body = el("div", { class: "body" });
  private readonly strips: { log: number; strip: Strip }[] = [];
  private links = new Map<number, { frame: Frame; sensor: string; link: PixelLink | null }>();
  private pointed: { row: number; col: number } | null = null;

  constructor(private readonly app: App) {
    this.root.append(this.bar, this.body);
    app.on(["info", "settings"], () => this.drawBar());
    app.on(["info", "settings", "frame"], () => this.draw());
    app.on(["hover", "selection", "frame"], () => this.mark());
  }

  private drawBar(): void {
    const { app } = this, { state } = app, images = app.logs[0]?.info?.images ?? {}, sensors = Object.keys(images);
    this.root.hidden = sensors.length === 0;
    if (sensors.length === 0) return;
    const pickSensor = select(sensors.map((s) => [s, s] as const), "sensor",
        (s) => { state.imageSensor = s; app.changed("settings"); });
    pickSensor.value = app.imageSensor;
    const known = images[app.imageSensor] ?? [],
        names = [...kOrder.filter((n) => known.includes(n)), ...known.filter((n) => !kOrder.includes(n))];
    const open = toggle(state.imagesOpen ? "\u25be images" : "\u25b8 images", "open or close",
        () => { state.imagesOpen = !state.imagesOpen; app.changed("settings"); });
    const chips = names.map((name) => {
      const chip = toggle(name.replace("_", " "), name, () => {
        state.imageNames = state.imageNames.includes(name) ? state.imageNames.filter((n) => n !== name)
            : [...state.imageNames, name];
        app.changed("settings");
      });
      chip.classList.toggle("on", state.imageNames.includes(name));
      return chip;
    });
    this.bar.replaceChildren(open, ...(state.imagesOpen ? [pickSensor, ...chips] : []));
    this.body.hidden = !state.imagesOpen;
  }

  private draw(): void {
    const { app } = this;
    if (!app.state.imagesOpen) return;
    let used = 0;
    for (const name of app.state.imageNames)
      for (const log of app.logs) {
        const image = log.frame?.images.find((i) => i.sensor === app.imageSensor && i.name === name);
        if (!image) continue;
        const { strip } = this.strips[used] ?? (this.strips[used] = { log: 0, strip: this.makeStrip(used) });
        this.strips[used++].log = log.index;
        if (strip.image !== image)
          strip.show(image, log.frame!.images.find((i) => i.name === "range"),
              app.logs.length > 1 ? `${"AB"[log.index]}  ` : "");
      }
    this.strips.forEach(({ strip }, i) => { strip.root.hidden = i >= used; });
  }

  private makeStrip(number: number): Strip {
    const strip = new Strip();
    this.body.append(strip.root);
    const link = (): PixelLink | null => this.linkOf(this.app.logs[this.strips[number].log]);
    strip.canvas.addEventListener("pointermove", (e) => {
      this.pointed = strip.pixelAt(e);
      const point = link()?.pointOf(this.pointed.row, this.pointed.col) ?? null;
      this.app.setHover(point === null ? null : { log: this.strips[number].log, sensor: this.app.imageSensor, point });
      this.mark();
    });
    strip.canvas.addEventListener("pointerleave", () => {
      this.pointed = null;
      this.app.setHover(null);
      this.mark();
    });
    strip.canvas.addEventListener("click", (e) => {
      const pixel = strip.pixelAt(e as PointerEvent), point = link()?.pointOf(pixel.row, pixel.col) ?? null;
      if (point !== null)
        this.app.select({ log: this.strips[number].log, kind: "point", sensor: this.app.imageSensor, point });
    });
    return strip;
  }

  // The link of pixels and points in the log's frame.
  linkOf(log: LogView): PixelLink | null {
    const frame = log.frame, sensor = this.app.imageSensor, known = this.links.get(log.index);
    if (!frame) return null;
    if (known?.frame === frame && known.sensor === sensor) return known.link;
    const cloud = frame.clouds.find((c) => c.sensor === sensor),
        image = frame.images.find((i) => i.sensor === sensor && i.name === "range");
    const link = cloud && image ? new PixelLink(cloud, image, columnsOf(log.info?.config ?? null, sensor)) : null;
    this.links.set(log.index, { frame, sensor, link });
    return link;
  }

  private mark(): void {
    const { app } = this, chosen = app.state.selection?.kind === "point" ? app.state.selection : null,
        point = app.hover ?? chosen;
    for (const { log, strip } of this.strips) {
      let pixel = this.pointed, extra = "";
      if (point && point.log === log && point.sensor === app.imageSensor) {
        pixel ??= this.linkOf(app.logs[log])?.pixelOf(point.point) ?? null;
        const cloud = app.logs[log].frame?.clouds.find((c) => c.sensor === point.sensor),
            label = cloud?.fields.label?.[point.point];
        if (label !== undefined) extra = `   point ${point.point}, label ${label}`;
      } else if (pixel) {
        extra = "   no point";
      }
      strip.mark(pixel, extra);
    }
  }
  // For tests: the value that the panel shows for a pixel.
  valueAt(strip: number, row: number, col: number): { text: string; value: number } {
    const { image } = this.strips[strip].strip;
    return { text: this.strips[strip].strip.textAt(row, col),
        value: image ? image.values[row * image.cols + col] : NaN };
  }
}
