// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tracks and detections of the frame as tables; all numbers and the plots of what is selected.
import type { App } from "../app";
import { kReasons } from "../colors";
import { degrees, el, fixed, setText, shortId } from "../dom";
import type { LogView } from "../log_view";
import { Plot } from "../plot";
import { DataTable } from "../table";
import { kHistory, type Detection, type Track } from "../types";

interface TrackRow { log: LogView; track: Track; distance_m: number }
interface DetectionRow { log: LogView; row: number; detection: Detection }

const kTrackFlags: [number, string][] = [[1, "coasting"], [2, "unobserved"], [4, "stale"]];
const kPlots = [["speed", "m/s", 1, 5], ["distance", "m", 1, 10], ["sigma", "m", 2, 6], ["hits", "", 0, 8]] as const;

export class ObjectsPanel {
  readonly root = el("section", { class: "objects" });
  private readonly logColumn = { title: "log", value: (r: { log: LogView }) => "AB"[r.log.index], words: true };
  private readonly tracks: DataTable<TrackRow>;
  private readonly detections: DataTable<DetectionRow>;
  private readonly trackHead = el("h3");
  private readonly detectionHead = el("h3");
  private readonly chosenHead = el("h3");
  private readonly chosen = el("dl", { class: "fields" });
  private readonly plotBox = el("div", { class: "plots" });
  readonly plots: Plot[];
  private readonly share = el("div", { class: "hint" });
  private readonly hint = el("div", { class: "hint" });

  constructor(private readonly app: App) {
    const two = app.logs.length > 1;
    this.tracks = new DataTable<TrackRow>([
      ...(two ? [this.logColumn] : []),
      { title: "id", hint: "slot:generation", value: (r) => shortId(r.track.id), words: true },
      { title: "state", value: (r) => r.track.state, words: true },
      { title: "m/s", hint: "speed", value: (r) => r.track.speed_mps, text: (r) => fixed(r.track.speed_mps, 1) },
      { title: "p", hint: "existence: probability that the track is a car", value: (r) => r.track.existence ?? NaN,
          text: (r) => fixed(r.track.existence, 2) },
      { title: "m", hint: "distance from the vehicle", value: (r) => r.distance_m,
          text: (r) => fixed(r.distance_m, 1) },
      { title: "\u03c3 m", hint: "standard deviation of the position", value: (r) => sigma(r.track),
          text: (r) => fixed(sigma(r.track), 2) },
      { title: "hits", hint: "hits among the last N iterations", value: (r) => r.track.hits },
      { title: "age", hint: "iterations since its initiation", value: (r) => r.track.age },
      { title: "seen", hint: "why the newest frame has a detection of it, or none",
          value: (r) => r.track.visibility ?? flagText(r.track), words: true },
    ], (r) => app.select({ log: r.log.index, kind: "track", id: r.track.id }),
        (r) => r.track.state === "confirmed" ? "confirmed" : "tentative");
    this.detections = new DataTable<DetectionRow>([
      ...(two ? [this.logColumn] : []),
      { title: "#", hint: "row", value: (r) => r.row },
      { title: "points", value: (r) => r.detection.points },
      { title: "m", hint: "distance from the vehicle", value: (r) => Math.hypot(r.detection.x_m, r.detection.y_m),
          text: (r) => fixed(Math.hypot(r.detection.x_m, r.detection.y_m), 1) },
      { title: "x", hint: "m ahead", value: (r) => r.detection.x_m, text: (r) => fixed(r.detection.x_m, 1) },
      { title: "y", hint: "m to the left", value: (r) => r.detection.y_m, text: (r) => fixed(r.detection.y_m, 1) },
      { title: "heading", hint: "degrees", value: (r) => r.detection.heading_rad,
          text: (r) => degrees(r.detection.heading_rad) },
      { title: "by", hint: "heading of the map (ref) or of the points (var)", value: (r) => r.detection.heading_source,
          words: true },
      { title: "class", value: (r) => r.detection.class ?? "\u2013", words: true },
      { title: "track", value: (r) => r.detection.track === "0" ? "\u2013" : shortId(r.detection.track), words: true },
    ], (r) => app.select({ log: r.log.index, kind: "detection", row: r.row }));
    this.plots = kPlots.map(([, unit, digits]) => new Plot({ height: 96, unit, digits,
        onClick: (s) => app.gotoStamp(app.first + BigInt(Math.round(s * 1e9))) }));
    this.plots.forEach((plot, i) => this.plotBox.append(el("h4", {},
        ["speed, m/s", "distance, m", "standard deviation of the position, m", "hits of the last N"][i]), plot.root));
    this.root.append(this.trackHead, el("div", { class: "scroll" }, this.tracks.root), this.detectionHead,
        el("div", { class: "scroll" }, this.detections.root),
                     this.chosenHead, this.hint, this.chosen, this.share, this.plotBox);
    app.on(["frame", "selection", "info", "settings"], () => this.draw());
    app.on(["history", "selection", "table", "settings"], () => this.drawPlots());
    app.on(["clock"], () => this.plots.forEach((p) => p.showNow(app.entry ? app.seconds(app.entry.stamp) : NaN)));
  }

  private draw(): void {
    const { app } = this, selection = app.state.selection;
    if (app.state.tab !== "objects") return;
    const tracks: TrackRow[] = [], detections: DetectionRow[] = [];
    for (const log of app.logs) {
      const frame = log.frame;
      if (!frame) continue;
      const from = frame.tracksInMap ? frame.ego ?? { x_m: NaN, y_m: NaN } : { x_m: 0, y_m: 0 };
      for (const track of frame.tracks)
        tracks.push({ log, track, distance_m: Math.hypot(track.x_m - from.x_m, track.y_m - from.y_m) });
      frame.detections.forEach((detection, row) => detections.push({ log, row, detection }));
    }
    setText(this.trackHead, `Tracks  ${tracks.length}`);
    setText(this.detectionHead, `Detections  ${detections.length}`);
    this.tracks.set(tracks, (r) => selection?.log === r.log.index &&
        (selection.kind === "track" ? selection.id === r.track.id :
      selection.kind === "detection" && selection.row === r.track.detection));
    this.detections.set(detections, (r) => selection?.log === r.log.index &&
        (selection.kind === "detection" ? selection.row === r.row :
      selection.kind === "track" && selection.id === r.detection.track));
    this.drawChosen(tracks, detections);
  }

  private drawChosen(tracks: TrackRow[], detections: DetectionRow[]): void {
    const selection = this.app.state.selection;
    let head = "", fields: [string, string, string?][] = [];
    if (!selection) {
      head = "Nothing selected";
      fields = [["", "Click a point, a box or a row."]];
    } else if (selection.kind === "track") {
      const row = tracks.find((r) => r.log.index === selection.log && r.track.id === selection.id);
      head = `Track ${shortId(selection.id)}`;
      fields = row ? trackFields(row) : [["", "not in this frame"]];
    } else if (selection.kind === "detection") {
      const row = detections.find((r) => r.log.index === selection.log && r.row === selection.row);
      head = `Detection ${selection.row}`;
      fields = row ? detectionFields(row.detection) : [["", "not in this frame"]];
    } else {
      head = `Point ${selection.point} of ${selection.sensor}`;
      fields = this.pointFields(this.app.logs[selection.log], selection.sensor, selection.point);
    }
    setText(this.chosenHead, head);
    setText(this.hint, fields.length === 1 ? fields[0][1] : "");
    this.chosen.replaceChildren(...(fields.length === 1 ? []
        : fields).flatMap(([name, value, title]) => [el("dt", {}, name), el("dd", { title }, value)]));
  }

  private pointFields(log: LogView | undefined, sensor: string, point: number): [string, string][] {
    const cloud = log?.frame?.clouds.find((c) => c.sensor === sensor);
    if (!cloud || point >= cloud.count) return [["", "not in this frame"]];
    const [x, y, z] = cloud.position.subarray(3 * point, 3 * point + 3), m = cloud.vehicleFromSensor;
    const place = [0, 1, 2].map((r) => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);
    const rows: [string, string][] = [["in the sensor's frame, m", `${fixed(x, 3)}  ${fixed(y, 3)}  ${fixed(z, 3)}`],
      ["in the vehicle's frame, m", place.map((v) => fixed(v, 3)).join("  ")],
          ["range, m", fixed(Math.hypot(x, y, z), 3)]];
    for (const [name, values] of Object.entries(cloud.fields)) {
      const value = values[point], word = name === "reason" ? kReasons[value]?.[0] : undefined;
      rows.push([name, word ? `${value}  ${word}` : Number.isInteger(value) ? String(value) : fixed(value, 3)]);
    }
    return rows;
  }

  private drawPlots(): void {
    const { app } = this, selection = app.state.selection;
    this.plotBox.hidden = this.share.hidden = selection?.kind !== "track";
    if (selection?.kind !== "track" || app.state.tab !== "objects") return;
    const log = app.logs[selection.log], id = BigInt(selection.id), slot = Number(id & 0xffffffffn),
        generation = Number(id >> 32n);
    const at: number[] = [], columns: (number | null)[][] = kPlots.map(() => []);
    const stamps = log?.table?.stamps;
    for (let index = 0; stamps && index < stamps.length; ++index) {
      const rows = log.history.get(index);
      if (!rows) continue;
      let found = -1;
      for (let k = 0; k < rows.length && found < 0; k += kHistory.length)
        if (rows[k] === slot && rows[k + 1] === generation) found = k;
      if (found < 0 && (at.length === 0 || columns[0][columns[0].length - 1] === null)) continue;  // a gap once
      at.push(app.seconds(stamps[index]));
      kPlots.forEach(([name, , , column], i) => {
        const value = found < 0 ? null : name === "sigma" ? Math.sqrt(Math.max(rows[found + 6], rows[found + 7]))
            : name === "distance" ? rows[found + 10] : rows[found + column];
        columns[i].push(value === null || Number.isNaN(value) ? null : value);
      });
    }
    const complete = log && (log.historyShare >= 1 || log.history.size >= (stamps?.length ?? 0));
    setText(this.share, complete ? "" : `reading the race: ${Math.round((log?.historyShare ?? 0) * 100)} %`);
    this.plots.forEach((plot, i) => plot.set(at, [{ name: kPlots[i][0],
        color: ["#3ddc84", "#4da3ff", "#ffb020", "#c58bff"][i], values: columns[i] }]));
  }
}

const sigma = (t: Track): number => Math.sqrt(Math.max(t.covariance[0], t.covariance[2]));
const flagText = (t: Track): string => kTrackFlags.filter(([bit]) => (t.flags & bit) !== 0).map(
    ([, name]) => name).join(" ") || "seen";

function trackFields({ track: t, distance_m }: TrackRow): [string, string, string?][] {
  const rows: [string, string, string?][] = [["id", shortId(t.id), t.id], ["state", t.state],
      ["existence", fixed(t.existence, 3)], ["position, m", `${fixed(t.x_m, 2)}  ${fixed(t.y_m, 2)}`],
    ["distance, m", fixed(distance_m, 2)], ["speed, m/s", fixed(t.speed_mps, 2)],
    ["course, \u00b0", degrees(t.course_rad)],
        ["heading, \u00b0", degrees(t.heading_rad)],
    ["yaw rate, \u00b0/s", degrees(t.yaw_rate_rps)],
        ["standard deviation x y, m", `${fixed(Math.sqrt(t.covariance[0]), 2)}  ${fixed(Math.sqrt(t.covariance[2]),
        2)}`],
    ["hits, age", `${t.hits}, ${t.age}`], ["detection", t.detection < 0 ? "none" : String(t.detection)],
        ["health", flagText(t)]];
  for (const name of ["visibility", "class"] as const) if (t[name]) rows.push([name, t[name]!]);
  if (t.unseen_s !== undefined) rows.push(["unseen, s", fixed(t.unseen_s, 2)]);
  return rows;
}

function detectionFields(d: Detection): [string, string][] {
  const rows: [string, string][] = [];
  for (const [name, value] of Object.entries(d)) {
    if (value === undefined) continue;
    if (name === "track") rows.push(["track", value === "0" ? "none" : shortId(String(value))]);
    else if (name.endsWith("_rad"))
      rows.push([name.replace(/_rad$/, ", \u00b0").replaceAll("_", " "), degrees(Number(value))]);
    else rows.push([name.replace(/_m$/, ", m").replaceAll("_", " "),
        typeof value === "number" && !Number.isInteger(value) ? fixed(value, 3) : String(value)]);
  }
  return rows;
}
