// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The 3-D view: one canvas, one camera, a viewport a log (side by side, or both in the same one), texts above it, and
// what lies under the pointer. A picture is drawn only after a change.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { el, setText } from "./dom";
import type { Point } from "./lines";
import { LogScene, pointAt } from "./log_scene";
import type { Selection, State } from "./state";
import type { Ego } from "./types";

interface Viewport { scene: LogScene; left: number; width: number }
export interface PickedPoint { log: number; sensor: string; point: number }

const kBackground = 0x0d1014, kPickRadius_px = 7, kLetter_px = 6.2, kLine_px = 14,
    kMostLabels = 300;
const kStart = { position: new THREE.Vector3(-17, 0, 10), target: new THREE.Vector3(16, 0, 0) }, kTopHeight_m = 90,
    kTopTarget = new THREE.Vector3(22, 0, 0);

export class View3d {
  readonly root = el("div", { class: "view3d" });
  readonly scenes: LogScene[] = [];
  private readonly overlay = el("div", { class: "labels" });
  private readonly renderer: THREE.WebGLRenderer;
  private readonly perspective = new THREE.PerspectiveCamera(55, 1, 0.3, 3000);
  private readonly top = new THREE.OrthographicCamera(-1, 1, 1, -1, -500, 1000);
  private readonly controls: Record<"3d" | "top", OrbitControls>;
  private anchor: Ego | null = null;
  private dirty = true;
  private readonly pool: HTMLElement[] = [];
  pictures = 0;
  onCamera: () => void = () => {};
  onPick: (selection: Selection | null) => void = () => {};
  onHover: (point: PickedPoint | null) => void = () => {};

  constructor(private readonly state: State) {
    THREE.ColorManagement.enabled = false;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    this.renderer.setScissorTest(true);
    const canvas = this.renderer.domElement;
    this.root.append(canvas, this.overlay);
    for (const camera of [this.perspective, this.top]) camera.up.set(0, 0, 1);
    const make = (camera: THREE.Camera): OrbitControls => {
      const controls = new OrbitControls(camera, canvas);
      controls.screenSpacePanning = false;
      controls.maxPolarAngle = Math.PI * 0.495;
      controls.enabled = false;
      controls.addEventListener("change", () => this.invalidate());
      controls.addEventListener("end", () => this.onCamera());
      return controls;
    };
    this.controls = { "3d": make(this.perspective), top: make(this.top) };
    this.controls.top.enableRotate = false;
    this.controls.top.screenSpacePanning = true;
    this.controls.top.mouseButtons.LEFT = THREE.MOUSE.PAN;
    this.resetCamera();
    new ResizeObserver(() => this.resize()).observe(this.root);
    this.watchPointer(canvas);
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      setTimeout(() => this.renderer.forceContextRestore(), 500);
    });
    canvas.addEventListener("webglcontextrestored", () => this.invalidate());
  }

  get canvas(): HTMLCanvasElement { return this.renderer.domElement; }
  private get camera(): THREE.PerspectiveCamera | THREE.OrthographicCamera {
    return this.state.view === "top" ? this.top : this.perspective;
  }

  invalidate(): void { this.dirty = true; }

  resetCamera(): void {
    this.perspective.position.copy(kStart.position);
    this.controls["3d"].target.copy(kStart.target);
    this.top.position.copy(kTopTarget).add(new THREE.Vector3(-0.01, 0, 300));
    this.top.zoom = 1;
    this.controls.top.target.copy(kTopTarget);
    this.anchor = null;
    for (const controls of Object.values(this.controls)) controls.update();
    this.invalidate();
  }

  // The vehicle of another run stands elsewhere on the map.
  forgetPlace(): void { this.anchor = null; }

  // The camera in the vehicle's frame: position, target, zoom.
  get cameraState(): number[] {
    const inverse = this.anchorMatrix(this.scenes[0]?.log.frame?.ego ?? null).invert();
    const place = (v: THREE.Vector3): number[] => v.clone().applyMatrix4(inverse).toArray();
    return [...place(this.camera.position), ...place(this.controls[this.state.view].target), this.camera.zoom];
  }
  set cameraState(c: number[]) {
    this.anchor = this.scenes[0]?.log.frame?.ego ?? null;
    this.camera.position.set(c[0], c[1], c[2]);
    this.controls[this.state.view].target.set(c[3], c[4], c[5]);
    this.camera.zoom = c[6];
    this.camera.updateProjectionMatrix();
    this.controls[this.state.view].update();
    this.invalidate();
  }

  // Where the vehicle is in the space of the camera: the origin, or, with the map standing still, as it moved.
  private anchorMatrix(ego: Ego | null): THREE.Matrix4 {
    if (this.state.follow === "vehicle" || !ego) {
      if (this.state.follow === "vehicle") this.anchor = null;
      return new THREE.Matrix4();
    }
    this.anchor ??= ego;
    const { x_m, y_m, yaw_rad } = this.anchor, c = Math.cos(yaw_rad), s = Math.sin(yaw_rad), dx = ego.x_m - x_m,
        dy = ego.y_m - y_m;
    return new THREE.Matrix4().makeRotationZ(ego.yaw_rad - yaw_rad).setPosition(dx * c + dy * s, dy * c - dx * s, 0);
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.root;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight);
    this.invalidate();
  }

  private get isOverlaid(): boolean { return this.scenes.length > 1 && this.state.compare === "overlay"; }
  private viewports(): Viewport[] {
    const width = this.root.clientWidth, share = this.isOverlaid ? 1 : this.scenes.length || 1;
    return this.scenes.map((scene, i) => ({ scene, left: this.isOverlaid ? 0 : i * width / share,
        width: width / share }));
  }

  // Brings the scenes to the state; the picture follows.
  update(): void {
    for (const view of this.viewports()) {
      view.scene.update(this.state, this.isOverlaid && view.scene !== this.scenes[0]);
      view.scene.root.matrix.copy(this.anchorMatrix(view.scene.log.frame?.ego ?? null));
    }
    for (const [name, controls] of Object.entries(this.controls)) controls.enabled = name === this.state.view;
    this.invalidate();
  }

  renderIfDirty(): void {
    if (!this.dirty || this.root.clientWidth === 0) return;
    this.dirty = false;
    this.render();
  }

  render(): void {
    const height = this.root.clientHeight, viewports = this.viewports();
    ++this.pictures;
    this.renderer.setScissor(0, 0, this.root.clientWidth, height);
    this.renderer.setClearColor(kBackground);
    this.renderer.clear();
    for (const { scene, left, width } of viewports) {
      this.aim(width / height);
      scene.setResolution(width, height);
      this.renderer.setViewport(left, 0, width, height);
      this.renderer.setScissor(left, 0, width, height);
      this.renderer.render(scene.scene, this.camera);
    }
    this.placeLabels(viewports, height);
  }

  private aim(aspect: number): void {
    this.perspective.aspect = aspect;
    const half = kTopHeight_m / 2;
    Object.assign(this.top, { left: -half * aspect, right: half * aspect, top: half, bottom: -half });
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  // From the log's vehicle frame to CSS pixels of the canvas; null behind the camera.
  project(log: number, point: Point): [number, number] | null {
    const view = this.viewports()[log], height = this.root.clientHeight;
    if (!view) return null;
    this.aim(view.width / height);
    const at = new THREE.Vector3(...point).applyMatrix4(view.scene.root.matrix).project(this.camera);
    return at.z > 1 || at.z < -1 ? null : [view.left + (at.x + 1) / 2 * view.width, (1 - at.y) / 2 * height];
  }

  private placeLabels(viewports: Viewport[], height: number): void {
    let used = 0;
    const taken: [number, number, number][] = [];  // left, right, top of texts that are placed: others move below them
    const put = (x: number, y: number, kind: string, text: string): void => {
      const label = this.pool[used] ?? this.overlay.appendChild(el("span"));
      this.pool[used++] = label;
      label.className = `label ${kind}`;
      setText(label, text);
      label.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
      label.hidden = false;
    };
    viewports.forEach(({ scene, left, width }, i) => {
      if (viewports.length > 1)
        put(left + 12, this.isOverlaid ? height - 52 + 18 * i : height - 34, `corner log${i}`,
            `${"AB"[i]}  ${scene.log.name}${this.isOverlaid && i === 1 ? "  (dashed)" : ""}`);
      for (const label of scene.labels) {
        const at = this.project(i, label.at);
        if (!at || at[0] < left || at[0] > left + width - 30 || at[1] < 40 || at[1] > height) continue;
        if (used >= kMostLabels) break;
        const right = at[0] + kLetter_px * label.text.length;
        let top = at[1];
        if (label.kind !== "ring") {
          for (const [a, b, t] of taken) if (at[0] < b && right > a && Math.abs(top - t) < kLine_px) top = t + kLine_px;
          taken.push([at[0], right, top]);
          taken.sort((a, b) => a[2] - b[2]);
        }
        put(at[0], top, label.kind, label.text);
      }
      if (viewports.length > 1 && !scene.log.frame)
        put(left + width / 2 - 90, height / 2, "corner", "no frame of this log here");
    });
    for (let i = used; i < this.pool.length; ++i) this.pool[i].hidden = true;
  }

  // ---- the pointer
  private watchPointer(canvas: HTMLCanvasElement): void {
    let down: [number, number] | null = null, hover: [number, number] | null = null;
    canvas.addEventListener("pointerdown", (e) => { down = [e.offsetX, e.offsetY]; });
    canvas.addEventListener("pointerup", (e) => {
      if (down && Math.hypot(e.offsetX - down[0], e.offsetY - down[1]) < 4)
        this.onPick(this.pick(e.offsetX, e.offsetY));
      down = null;
    });
    canvas.addEventListener("pointermove", (e) => {
      if (e.buttons !== 0) return;
      if (!hover) requestAnimationFrame(() => {
        if (hover) this.onHover(this.pointAt(...hover));
        hover = null;
      });
      hover = [e.offsetX, e.offsetY];
    });
    canvas.addEventListener("pointerleave", () => { hover = null; this.onHover(null); });
    canvas.addEventListener("dblclick", () => { this.resetCamera(); this.update(); this.onCamera(); });
  }

  // A point under the pointer, else a box.
  pick(x: number, y: number): Selection | null {
    const point = this.pointAt(x, y);
    return point ? { kind: "point", ...point } : this.targetAt(x, y);
  }

  // The box of a track or detection under the pointer; the nearest one.
  targetAt(x: number, y: number): Selection | null {
    let best: Selection | null = null, nearest = Infinity;
    this.viewports().forEach(({ scene, left, width }) => {
      if (x < left || x > left + width) return;
      this.aim(width / this.root.clientHeight);
      const caster = new THREE.Raycaster();
      caster.setFromCamera(new THREE.Vector2((x - left) / width * 2 - 1, 1 - y / this.root.clientHeight * 2),
          this.camera);
      const ray = caster.ray.applyMatrix4(scene.root.matrix.clone().invert());
      for (const t of scene.targets) {
        const inverse = new THREE.Matrix4().makeRotationZ(t.heading_rad).setPosition(...t.center).invert();
        const size = new THREE.Vector3(t.length_m, t.width_m, 1.4).multiplyScalar(0.5), hit = new THREE.Vector3();
        if (!ray.clone().applyMatrix4(inverse).intersectBox(new THREE.Box3(size.clone().negate(), size), hit)) continue;
        const distance = hit.applyMatrix4(inverse.invert()).distanceTo(ray.origin);
        if (distance < nearest) nearest = distance, best = t.selection;
      }
    });
    return best;
  }

  // Of the visible points within a few pixels, the one nearest to the camera; nearly equal ones by pixels.
  pointAt(x: number, y: number): PickedPoint | null {
    let best: PickedPoint | null = null, least = Infinity;
    const height = this.root.clientHeight;
    this.viewports().forEach(({ scene, left, width }, log) => {
      if (x < left || x > left + width || (this.isOverlaid && log > 0)) return;
      this.aim(width / height);
      const whole = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix,
          this.camera.matrixWorldInverse).multiply(scene.root.matrix);
      for (const cloud of scene.log.frame?.clouds ?? []) {
        if (!this.state.isOn(`sensor:${cloud.sensor}`)) continue;
        const m = whole.clone().multiply(new THREE.Matrix4().fromArray(cloud.vehicleFromSensor)).elements,
            p = cloud.position;
        for (let i = 0, k = 0; i < cloud.count; ++i, k += 3) {
          const w = m[3] * p[k] + m[7] * p[k + 1] + m[11] * p[k + 2] + m[15];
          if (!(w > 0)) continue;
          const dx = left + ((m[0] * p[k] + m[4] * p[k + 1] + m[8] * p[k + 2] + m[12]) / w + 1) / 2 * width - x;
          if (Math.abs(dx) > kPickRadius_px) continue;
          const dy = (1 - (m[1] * p[k] + m[5] * p[k + 1] + m[9] * p[k + 2] + m[13]) / w) / 2 * height - y;
          const away = Math.hypot(dx, dy), depth = (m[2] * p[k] + m[6] * p[k + 1] + m[10] * p[k + 2] + m[14]) / w;
          const cost = away + (this.state.view === "top" ? 0 : depth * 40);
          if (away <= kPickRadius_px && cost < least) least = cost, best = { log, sensor: cloud.sensor, point: i };
        }
      }
    });
    return best;
  }

  // For tests: the canvas' pixels, r g b a, from the top left, in device pixels.
  readPixels(): { width: number; height: number; pixels: Uint8Array } {
    this.render();
    const gl = this.renderer.getContext(), width = gl.drawingBufferWidth, height = gl.drawingBufferHeight,
        raw = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, raw);
    const pixels = new Uint8Array(raw.length);
    for (let row = 0; row < height; ++row)
      pixels.set(raw.subarray(4 * width * (height - 1 - row), 4 * width * (height - row)), 4 * width * row);
    return { width, height, pixels };
  }
  pointPosition(p: PickedPoint): Point | null {
    const cloud = this.scenes[p.log]?.log.frame?.clouds.find((c) => c.sensor === p.sensor);
    return cloud && p.point < cloud.count ? pointAt(cloud, p.point) : null;
  }
}
