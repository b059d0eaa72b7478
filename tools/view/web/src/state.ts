// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the user chose, as the fragment of the page's address: an address sent to a colleague shows the same picture.
import { kColorings, type Coloring } from "./colors";

export type Selection = { log: number; kind: "track"; id: string } | { log: number; kind: "detection"; row: number } |
  { log: number; kind: "point"; sensor: string; point: number };

export const kLayers = [
  ["map", "map", "lines of the map (or centre line with widths)"],
  ["detections", "detections", "imposed rectangles"],
  ["headings", "headings", "both headings of a detection; the used one is bright"],
  ["tracks", "tracks", "boxes of the tracks"],
  ["covariance", "covariance", "ellipses of two standard deviations"],
  ["paths", "paths", "predicted paths with growing ellipses"],
  ["trails", "trails", "where a track was in the last 3 s"],
  ["truth", "truth", "the other cars' true positions, where the log has them"],
  ["names", "names", "texts beside tracks and detections"],
  ["rings", "rings", "distance from the vehicle"],
] as const;

export const kTabs = ["objects", "latency", "compare", "log"] as const;
export type Tab = typeof kTabs[number];

export class State {
  at: bigint | null = null;
  coloring: Coloring = "label";
  pointSize = 2;
  view: "3d" | "top" = "3d";
  follow: "vehicle" | "map" = "vehicle";
  off = new Set<string>();   // layers, and "sensor:NAME"
  tab: Tab = "objects";
  imagesOpen = true;
  imageSensor = "";
  imageNames: string[] = ["range"];
  compare: "side" | "overlay" = "side";
  speed = 1;
  loop: [bigint, bigint] | null = null;
  selection: Selection | null = null;
  camera: number[] | null = null;  // position and target in the vehicle's frame, zoom
  series = ["frame"];              // of the latency plot: STAGE or SENSOR/STAGE

  isOn(name: string): boolean { return !this.off.has(name); }

  encode(): string {
    const parts: [string, string | null][] = [
      ["at", this.at === null ? null : String(this.at)],
      ["colour", this.coloring === "label" ? null : this.coloring],
      ["size", this.pointSize === 2 ? null : String(this.pointSize)],
      ["view", this.view === "3d" ? null : this.view],
      ["follow", this.follow === "vehicle" ? null : this.follow],
      ["off", [...this.off].join(",") || null],
      ["tab", this.tab === "objects" ? null : this.tab],
      ["images", this.imagesOpen ? [this.imageSensor, ...this.imageNames].join(",") : "none"],
      ["compare", this.compare === "side" ? null : this.compare],
      ["speed", this.speed === 1 ? null : String(this.speed)],
      ["loop", this.loop && this.loop.join(",")],
      ["select", this.selection && encodeSelection(this.selection)],
      ["camera", this.camera && this.camera.map((v) => Number(v.toFixed(2))).join(",")],
      ["series", this.series.join(",") === "frame" ? null : this.series.join(",")],
    ];
    return parts.filter((part) => part[1]).map(([key, value]) => `${key}=${encodeURIComponent(value!)}`).join("&");
  }

  // Unknown keys and values that do not fit are left out.
  decode(fragment: string): void {
    const values = new Map<string, string>();
    for (const part of fragment.replace(/^#/, "").split("&")) {
      const [key, value = ""] = part.split("=");
      try {
        values.set(key, decodeURIComponent(value));
      } catch { /* a broken escape */ }
    }
    const list = (key: string): string[] => (values.get(key) ?? "").split(",").filter((s) => s !== "");
    const one = <T extends string>(key: string, all: readonly T[], other: T): T =>
        all.find((v) => v === values.get(key)) ?? other;
    this.at = stampOf(values.get("at"));
    this.coloring = one("colour", kColorings, "label");
    this.pointSize = Math.min(8, Math.max(1, Number(values.get("size") ?? 2) || 2));
    this.view = one("view", ["3d", "top"], "3d");
    this.follow = one("follow", ["vehicle", "map"], "vehicle");
    this.off = new Set(list("off"));
    this.tab = one("tab", kTabs, "objects");
    this.imagesOpen = values.get("images") !== "none";
    if (this.imagesOpen && values.has("images"))
      [this.imageSensor = "", ...this.imageNames] = values.get("images")!.split(",");
    this.compare = one("compare", ["side", "overlay"], "side");
    this.speed = Math.min(4, Math.max(0.1, Number(values.get("speed") ?? 1) || 1));
    const [from, to] = list("loop").map(stampOf);
    this.loop = from != null && to != null ? [from, to] : null;
    this.selection = decodeSelection(values.get("select") ?? "");
    const camera = list("camera").map(Number);
    this.camera = camera.length === 7 && camera.every(Number.isFinite) ? camera : null;
    this.series = values.has("series") ? list("series") : ["frame"];
  }
}

const stampOf = (text: string | undefined): bigint | null => (text && /^\d{1,19}$/.test(text) ? BigInt(text) : null);

function encodeSelection(s: Selection): string {
  return s.kind === "track" ? `${s.log},track,${s.id}` : s.kind === "detection" ? `${s.log},detection,${s.row}`
      : `${s.log},point,${s.point},${s.sensor}`;
}
function decodeSelection(text: string): Selection | null {
  const [logText, kind, number, sensor] = text.split(","), log = Number(logText);
  if (!/^\d+$/.test(number ?? "") || !(log === 0 || log === 1)) return null;
  if (kind === "track") return { log, kind, id: number };
  if (kind === "detection") return { log, kind, row: Number(number) };
  return kind === "point" && sensor ? { log, kind, point: Number(number), sensor } : null;
}
