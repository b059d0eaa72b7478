// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Line segments of a few pixels' width in one draw call; the buffers are reused from frame to frame.
import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";

export type Point = [number, number, number];
const kDash_m = 0.8, kMostDashes = 500, kMostSegments = 300_000;  // of a log that claims any number of anything

export class Lines {
  readonly object: LineSegments2;
  private readonly material: LineMaterial;
  private positions = new Float32Array(0);
  private colors = new Float32Array(0);
  private count = 0;
  private color: [number, number, number] = [1, 1, 1];
  dashed = false;

  constructor(width_px: number, order: number) {
    this.material = new LineMaterial({ linewidth: width_px, vertexColors: true, depthTest: true, transparent: false });
    this.object = new LineSegments2(new LineSegmentsGeometry(), this.material);
    this.object.frustumCulled = false;
    this.object.renderOrder = order;
    this.reserve(256);
  }

  setResolution(width: number, height: number): void { this.material.resolution.set(width, height); }
  get segments(): number { return this.count; }
  begin(): void { this.count = 0; }
  // share: brightness of the colour, 1 full.
  paint(rgb: number, share = 1): void {
    this.color = [(rgb >> 16 & 255) / 255 * share, (rgb >> 8 & 255) / 255 * share, (rgb & 255) / 255 * share];
  }

  segment(a: Point, b: Point): void {
    const length = this.dashed ? Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) : 0,
        pieces = this.dashed ? Math.min(kMostDashes, Math.max(1, Math.round(length / kDash_m))) : 1;
    for (let i = 0; i < pieces; ++i) {
      const from = i / pieces, to = this.dashed ? (i + 0.55) / pieces : 1;
      this.put(a.map((v, k) => v + (b[k] - v) * from) as Point, a.map((v, k) => v + (b[k] - v) * to) as Point);
    }
  }
  strip(points: Point[], closed = false): void {
    for (let i = 1; i < points.length; ++i) this.segment(points[i - 1], points[i]);
    if (closed && points.length > 2) this.segment(points[points.length - 1], points[0]);
  }

  private put(a: Point, b: Point): void {
    if (this.count >= kMostSegments) return;
    if (this.count * 6 + 6 > this.positions.length) this.reserve(2 * this.positions.length / 6);
    this.positions.set(a, this.count * 6);
    this.positions.set(b, this.count * 6 + 3);
    this.colors.set(this.color, this.count * 6);
    this.colors.set(this.color, this.count * 6 + 3);
    ++this.count;
  }

  private reserve(segments: number): void {
    const grow = (old: Float32Array<ArrayBuffer>): Float32Array<ArrayBuffer> => {
      const fresh = new Float32Array(segments * 6);
      fresh.set(old);
      return fresh;
    };
    this.positions = grow(this.positions);
    this.colors = grow(this.colors);
    this.object.geometry.dispose();
    const geometry = new LineSegmentsGeometry();
    const attach = (array: Float32Array, first: string, second: string): void => {
      const buffer = new THREE.InstancedInterleavedBuffer(array, 6, 1).setUsage(THREE.DynamicDrawUsage);
      geometry.setAttribute(first, new THREE.InterleavedBufferAttribute(buffer, 3, 0));
      geometry.setAttribute(second, new THREE.InterleavedBufferAttribute(buffer, 3, 3));
    };
    attach(this.positions, "instanceStart", "instanceEnd");
    attach(this.colors, "instanceColorStart", "instanceColorEnd");
    this.object.geometry = geometry;
  }

  end(): void {
    const geometry = this.object.geometry;
    geometry.instanceCount = this.count;
    this.object.visible = this.count > 0;
    for (const name of ["instanceStart", "instanceColorStart"]) {
      const buffer = (geometry.getAttribute(name) as THREE.InterleavedBufferAttribute).data;
      buffer.clearUpdateRanges();
      buffer.addUpdateRange(0, this.count * 6);
      buffer.needsUpdate = true;
    }
  }
}
