// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The 3-D objects of one log's frame, in the vehicle's frame: float32 then holds millimetres. Positions in the map's
// frame are brought there with the ego pose in double precision.
import * as THREE from "three";
import { canColor, colorCloud, scaleOf, type Coloring, type Scale } from "./colors";
import { fixed, shortId } from "./dom";
import { Lines, type Point } from "./lines";
import type { LogView } from "./log_view";
import type { Selection, State } from "./state";
import { kHistory, type Cloud, type Detection, type Frame, type Road, type Track } from "./types";

export interface Label { at: Point; text: string; kind: string }
// Something that a click can select: an upright box.
export interface Target { selection: Selection; center: Point; heading_rad: number; length_m: number; width_m: number }

export const kColors = { detection: 0x4da3ff, ref: 0xffffff, variance: 0xffa530, confirmed: 0x3ddc84,
    tentative: 0x98a2b0, truth: 0xff6ad5,
                         map: 0x5d6b80, ego: 0xe8ecf2, ring: 0x262d38, selected: 0xffe14d };
const kSecondHue = { detection: 0xc58bff, confirmed: 0xffb347, tentative: 0xb09a80 };
const kTrail_s = 3, kMostTrail = 1000, kEllipsePoints = 32, kWidestEllipse_m = 10, kRings_m = [25, 50, 100, 150, 200];
const kLineLayers = ["rings", "map", "truth", "trails", "paths", "covariance", "headings", "detections", "tracks",
    "ego"] as const;
const kWidths_px: Record<string, number> = { rings: 1, map: 1.5, trails: 2, covariance: 1.2, headings: 1.8,
    detections: 2, tracks: 2.6, paths: 2 };

interface CloudObject { points: THREE.Points; capacity: number; colors: Uint32Array }

export class LogScene {
  readonly scene = new THREE.Scene();
  readonly root = new THREE.Group();
  readonly labels: Label[] = [];
  readonly targets: Target[] = [];
  readonly counts = { points: 0, detections: 0, tracks: 0, paths: 0, trails: 0, truth: 0 };
  scale: Scale | null = null;
  coloring: Coloring = "label";   // the one that is drawn: the chosen one may need what the log lacks
  private readonly lines = new Map<string, Lines>();
  private readonly clouds = new Map<string, CloudObject>();
  private readonly material = new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
  private readonly marker: THREE.Points;
  vehicle = { length_m: 4.921, width_m: 1.886 };

  constructor(readonly log: LogView) {
    this.root.matrixAutoUpdate = false;
    this.scene.add(this.root);
    kLineLayers.forEach((layer, i) => {
      const lines = new Lines(kWidths_px[layer] ?? 2, i);
      this.lines.set(layer, lines);
      this.root.add(lines.object);
    });
    const geometry = new THREE.BufferGeometry().setAttribute("position",
        new THREE.BufferAttribute(new Float32Array(3), 3));
    this.marker = new THREE.Points(geometry, new THREE.PointsMaterial(
        { size: 9, sizeAttenuation: false, color: kColors.selected, depthTest: false }));
    this.marker.visible = false;
    this.marker.frustumCulled = false;
    this.marker.renderOrder = 20;
    this.root.add(this.marker);
  }

  setResolution(width: number, height: number): void {
    for (const lines of this.lines.values()) lines.setResolution(width, height);
  }
  segmentsOf(layer: string): number { return this.lines.get(layer)?.segments ?? 0; }

  // Marks a point: linked from the images, or picked.
  mark(sensor: string | null, point = 0): void {
    const cloud = this.log.frame?.clouds.find((c) => c.sensor === sensor);
    this.marker.visible = cloud !== undefined && point < cloud.count;
    if (!this.marker.visible || !cloud) return;
    const position = this.marker.geometry.getAttribute("position") as THREE.BufferAttribute;
    position.copyArray(pointAt(cloud, point));
    position.needsUpdate = true;
  }
  get marked(): Point | null {
    return this.marker.visible ? [...(this.marker.geometry.getAttribute("position").array as Float32Array)] as Point
        : null;
  }

  update(state: State, overlaid: boolean): void {
    const frame = this.log.frame;
    for (const lines of this.lines.values()) lines.begin(), lines.dashed = overlaid;
    this.labels.length = this.targets.length = 0;
    Object.assign(this.counts, { points: 0, detections: 0, tracks: 0, paths: 0, trails: 0, truth: 0 });
    for (const { points } of this.clouds.values()) points.visible = false;
    if (frame) {
      const selection = state.selection?.log === this.log.index ? state.selection : null;
      if (!overlaid) this.drawClouds(frame, state);
      if (!overlaid && state.isOn("rings")) this.drawRings(frame.road);
      if (!overlaid && state.isOn("map")) this.drawMap(frame);
      if (!overlaid) this.drawEgo(frame.road);
      frame.detections.forEach((d, row) => this.drawDetection(d, row, frame, state, selection, overlaid));
      for (const track of frame.tracks) this.drawTrack(track, frame, state, selection, overlaid);
      if (state.isOn("truth") && !overlaid) this.drawTruth(frame, state);
    }
    for (const lines of this.lines.values()) lines.end();
  }

  private drawClouds(frame: Frame, state: State): void {
    const any = frame.clouds;
    this.coloring = any.every((c) => canColor(state.coloring, c)) ? state.coloring : "height";
    this.scale = scaleOf(this.coloring, any);
    this.material.size = state.pointSize * Math.min(devicePixelRatio, 2);
    frame.clouds.forEach((cloud) => {
      if (!state.isOn(`sensor:${cloud.sensor}`)) return;
      const object = this.cloudObject(cloud), geometry = object.points.geometry;
      const position = geometry.getAttribute("position") as THREE.BufferAttribute,
          color = geometry.getAttribute("color") as THREE.BufferAttribute;
      (position.array as Float32Array).set(cloud.position);
      colorCloud(cloud, Math.max(0, this.log.info?.sensors.indexOf(cloud.sensor) ?? 0), this.coloring, this.scale,
          object.colors);
      for (const [attribute, size] of [[position, 3], [color, 4]] as const) {
        attribute.clearUpdateRanges();
        attribute.addUpdateRange(0, cloud.count * size);
        attribute.needsUpdate = true;
      }
      geometry.setDrawRange(0, cloud.count);
      object.points.matrix.fromArray(cloud.vehicleFromSensor);
      object.points.visible = true;
      this.counts.points += cloud.count;
    });
  }

  private cloudObject(cloud: Cloud): CloudObject {
    const known = this.clouds.get(cloud.sensor);
    if (known && known.capacity >= cloud.count) return known;
    if (known) {
      this.root.remove(known.points);
      known.points.geometry.dispose();
    }
    const capacity = Math.ceil(cloud.count * 1.25 / 1024) * 1024 + 1024, colors = new Uint32Array(capacity);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * capacity),
        3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Uint8Array(colors.buffer), 4,
        true).setUsage(THREE.DynamicDrawUsage));
    const points = new THREE.Points(geometry, this.material);
    points.frustumCulled = false;
    points.matrixAutoUpdate = false;
    const made = { points, capacity, colors };
    this.clouds.set(cloud.sensor, made);
    this.root.add(points);
    return made;
  }

  private drawRings(road: Road): void {
    const lines = this.lines.get("rings")!, z = roadAt(road, 0, 0);
    lines.paint(kColors.ring);
    for (const radius of kRings_m) {
      lines.strip(circle(0, 0, z - 0.1, radius, radius, 0, 96), true);
      this.labels.push({ at: [radius, 0, z], text: `${radius} m`, kind: "ring" });
    }
  }

  private drawMap(frame: Frame): void {
    const lines = this.lines.get("map")!, ego = frame.ego;
    if (!ego) return;
    const place = fromMap(frame);
    (this.log.info?.map ?? []).forEach((line, k, all) => {
      lines.paint(kColors.map, all.length === 3 && k === 0 ? 0.55 : 1);
      let last: Point | null = null;
      for (let i = 0; i + 1 < line.length; i += 2) {
        const [x, y] = place(line[i], line[i + 1]), next: Point = [x, y, roadAt(frame.road, x, y) + 0.02];
        if (last) lines.segment(last, next);
        last = next;
      }
    });
  }

  private drawEgo(road: Road): void {
    const lines = this.lines.get("ego")!, z = roadAt(road, 0, 0), half = this.vehicle.width_m / 2;
    const back = -0.2 * this.vehicle.length_m, front = back + this.vehicle.length_m;
    lines.paint(kColors.ego);
    lines.strip([[back, half, z], [front - 1.2, half, z], [front, 0, z], [front - 1.2, -half, z], [back, -half, z]],
        true);
  }

  private drawDetection(d: Detection, row: number, frame: Frame, state: State, selection: Selection | null,
      overlaid: boolean): void {
    const z = Number.isFinite(d.z_m) ? d.z_m : roadAt(frame.road, d.x_m, d.y_m) + 0.5,
        { length_m, width_m } = this.vehicle;
    const picked = selection?.kind === "detection" && selection.row === row ||
        (selection?.kind === "track" && d.track === selection.id);
    if (state.isOn("detections")) {
      const lines = this.lines.get("detections")!;
      lines.paint(picked ? kColors.selected : overlaid ? kSecondHue.detection : kColors.detection);
      lines.strip(rectangle(d.x_m, d.y_m, z, d.heading_rad, length_m, width_m), true);
      this.targets.push({ selection: { log: this.log.index, kind: "detection", row }, center: [d.x_m, d.y_m, z],
          heading_rad: d.heading_rad, length_m, width_m });
      ++this.counts.detections;
      if (state.isOn("names") && (picked || d.track === "0"))
        this.labels.push({ at: [d.x_m, d.y_m, z], text: `${d.points} points, ${d.heading_source}`,
            kind: overlaid ? "detection second" : "detection" });
    }
    if (!state.isOn("headings")) return;
    const lines = this.lines.get("headings")!;
    lines.paint(kColors.ref, d.heading_source === "ref" ? 1 : 0.35);
    drawArrow(lines, [d.ref_x_m, d.ref_y_m, z + 0.3], d.heading_ref_rad, 4);
    lines.paint(kColors.variance, d.heading_source === "var" ? 1 : 0.35);
    drawArrow(lines, [d.var_x_m, d.var_y_m, z + 0.3], d.heading_var_rad, 4);
  }

  private drawTrack(t: Track, frame: Frame, state: State, selection: Selection | null, overlaid: boolean): void {
    const place = t && frame.tracksInMap ? fromMap(frame) : (x: number, y: number): [number, number] => [x, y];
    const turn = frame.tracksInMap && frame.ego ? frame.ego.yaw_rad : 0, [x, y] = place(t.x_m, t.y_m),
        confirmed = t.state === "confirmed";
    const detection = frame.detections[t.detection], z = roadAt(frame.road, x, y), heading_rad = t.heading_rad - turn,
        { length_m, width_m } = this.vehicle;
    const picked = selection?.kind === "track" && selection.id === t.id ||
      (selection?.kind === "detection" && detection !== undefined && selection.row === t.detection);
    const hue = picked ? kColors.selected : overlaid ? (confirmed ? kSecondHue.confirmed : kSecondHue.tentative)
        : confirmed ? kColors.confirmed : kColors.tentative;
    const share = confirmed || picked ? 1 : 0.6;
    if (state.isOn("tracks")) {
      const lines = this.lines.get("tracks")!;
      lines.paint(hue, share);
      drawBox(lines, x, y, z, heading_rad, length_m, width_m, 1.2);
      this.targets.push({ selection: { log: this.log.index, kind: "track", id: t.id }, center: [x, y, z + 0.6],
          heading_rad, length_m, width_m });
      ++this.counts.tracks;
      if (state.isOn("names") && (confirmed || picked)) {
        const existence = t.existence === undefined ? "" : `  p ${fixed(t.existence, 2)}`;
        this.labels.push({ at: [x, y, z + 1.6], text: `${shortId(t.id)}  ${fixed(t.speed_mps, 1)} m/s${existence}`,
                           kind: `track${picked ? " picked" : overlaid ? " second" : ""}` });
      }
    }
    if (state.isOn("covariance")) {
      const lines = this.lines.get("covariance")!;
      lines.paint(hue, share);
      drawEllipse(lines, x, y, z + 0.05, t.covariance[0], t.covariance[1], t.covariance[2], turn);
    }
    if (state.isOn("paths") && (confirmed || picked)) this.drawPath(t, frame, place, turn, [x, y, z], hue);
    if (state.isOn("trails")) this.drawTrail(t, frame, place, hue);
  }

  private drawPath(t: Track, frame: Frame, place: (x: number, y: number) => [number, number], turn: number, from: Point,
      hue: number): void {
    const lines = this.lines.get("paths")!, points: Point[] = [[from[0], from[1], from[2] + 0.1]],
        every = Math.max(1, Math.round(0.5 / frame.pathStep_s));
    ++this.counts.paths;
    t.path.x_m.forEach((px, k) => {
      const [x, y] = place(px, t.path.y_m[k]), z = roadAt(frame.road, x, y) + 0.1;
      points.push([x, y, z]);
      lines.paint(hue, 0.45);
      if ((k + 1) % every === 0) drawEllipse(lines, x, y, z, t.path.var_x[k], t.path.cov_xy[k], t.path.var_y[k], turn);
    });
    lines.paint(hue, 0.9);
    lines.strip(points);
  }

  private drawTrail(t: Track, frame: Frame, place: (x: number, y: number) => [number, number], hue: number): void {
    const id = BigInt(t.id), slot = Number(id & 0xffffffffn), generation = Number(id >> 32n), points: Point[] = [],
        stamps = this.log.table?.stamps;
    if (!stamps) return;
    const oldest = Math.max(0, frame.index - kMostTrail);
    for (let index = frame.index; index >= oldest && Number(frame.stamp - stamps[index]) <= kTrail_s * 1e9; --index) {
      const rows = this.log.history.get(index);
      for (let k = 0; rows && k < rows.length; k += kHistory.length)
        if (rows[k] === slot && rows[k + 1] === generation) {
          const [x, y] = place(rows[k + 3], rows[k + 4]);
          points.push([x, y, roadAt(frame.road, x, y) + 0.08]);
        }
    }
    if (points.length < 2) return;
    const lines = this.lines.get("trails")!;
    ++this.counts.trails;
    points.forEach((point, i) => {
      lines.paint(hue, 0.75 * (1 - i / points.length) + 0.1);
      if (i > 0) lines.segment(points[i - 1], point);
    });
  }

  private drawTruth(frame: Frame, state: State): void {
    const lines = this.lines.get("truth")!, inMap = frame.truthInMap, turn = inMap ? frame.ego?.yaw_rad ?? 0 : 0;
    const place = inMap ? fromMap(frame) : (x: number, y: number): [number, number] => [x, y];
    if (inMap && !frame.ego) return;
    for (const car of frame.truth) {
      const [x, y] = place(car.x_m, car.y_m), z = roadAt(frame.road, x, y), heading = car.heading_rad - turn;
      lines.paint(kColors.truth);
      drawBox(lines, x, y, z, heading, car.length_m || this.vehicle.length_m, car.width_m || this.vehicle.width_m, 1.0);
      drawArrow(lines, [x, y, z + 1], heading, 3.5);
      if (state.isOn("names"))
        this.labels.push({ at: [x, y, z], text: `truth ${car.name}${car.speed_mps == null ? ""
            : `  ${fixed(car.speed_mps, 1)} m/s`}`, kind: "truth" });
      ++this.counts.truth;
    }
  }
}

// ---- shapes
export function fromMap(frame: Frame): (x: number, y: number) => [number, number] {
  const { x_m, y_m, yaw_rad } = frame.ego ?? { x_m: 0, y_m: 0, yaw_rad: 0 }, c = Math.cos(yaw_rad),
      s = Math.sin(yaw_rad);
  return (x, y) => [(x - x_m) * c + (y - y_m) * s, (y - y_m) * c - (x - x_m) * s];
}

export function pointAt(cloud: Cloud, i: number): Point {
  const m = cloud.vehicleFromSensor, [x, y, z] = cloud.position.subarray(3 * i, 3 * i + 3);
  return [m[0] * x + m[4] * y + m[8] * z + m[12], m[1] * x + m[5] * y + m[9] * z + m[13],
      m[2] * x + m[6] * y + m[10] * z + m[14]];
}

// Height of the road, bilinear between the middles of the cells.
export function roadAt(road: Road, x: number, y: number): number {
  const clampCell = (v: number): number => Math.min(Math.max(v, 0), road.side - 1.001);
  const cx = clampCell(x / road.cell_m + road.side / 2 - 0.5), cy = clampCell(y / road.cell_m + road.side / 2 - 0.5);
  const i = Math.floor(cx), j = Math.floor(cy), u = cx - i, v = cy - j,
      at = (a: number, b: number): number => road.z_m[b * road.side + a] ?? 0;
  return (at(i, j) * (1 - u) + at(i + 1, j) * u) * (1 - v) + (at(i, j + 1) * (1 - u) + at(i + 1, j + 1) * u) * v;
}

export function rectangle(x: number, y: number, z: number, heading_rad: number, length_m: number,
    width_m: number): Point[] {
  const c = Math.cos(heading_rad), s = Math.sin(heading_rad);
  return [[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]].map(([a, b]) =>
    [x + c * a * length_m - s * b * width_m, y + s * a * length_m + c * b * width_m, z]);
}

function circle(x: number, y: number, z: number, a: number, b: number, turn: number, count: number): Point[] {
  const c = Math.cos(turn), s = Math.sin(turn);
  return Array.from({ length: count }, (_, k) => {
    const u = a * Math.cos(2 * Math.PI * k / count), v = b * Math.sin(2 * Math.PI * k / count);
    return [x + c * u - s * v, y + s * u + c * v, z];
  });
}

// Two standard deviations; none where it would hide the scene.
function drawEllipse(lines: Lines, x: number, y: number, z: number, varX: number, cov: number, varY: number,
    turn: number): void {
  const middle = (varX + varY) / 2, half = Math.hypot((varX - varY) / 2, cov),
      a = 2 * Math.sqrt(Math.max(0, middle + half)), b = 2 * Math.sqrt(Math.max(0, middle - half));
  if (!(a < kWidestEllipse_m)) return;
  lines.strip(circle(x, y, z, a, b, 0.5 * Math.atan2(2 * cov, varX - varY) - turn, kEllipsePoints), true);
}

function drawBox(lines: Lines, x: number, y: number, z: number, heading_rad: number, length_m: number, width_m: number,
    height_m: number): void {
  const low = rectangle(x, y, z, heading_rad, length_m, width_m),
      high = rectangle(x, y, z + height_m, heading_rad, length_m, width_m);
  lines.strip(low, true);
  lines.strip(high, true);
  low.forEach((corner, i) => lines.segment(corner, high[i]));
}

function drawArrow(lines: Lines, [x, y, z]: Point, heading_rad: number, length_m: number): void {
  const tip: Point = [x + length_m * Math.cos(heading_rad), y + length_m * Math.sin(heading_rad), z];
  lines.segment([x, y, z], tip);
  for (const side of [2.65, -2.65])
    lines.segment(tip, [tip[0] + 0.8 * Math.cos(heading_rad + side), tip[1] + 0.8 * Math.sin(heading_rad + side), z]);
}

