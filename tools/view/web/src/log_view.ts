// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The page's side of one log: its worker, what is known of it, and the frame that is shown.
import type { FaultKind, Frame, FrameTable, FromWorker, LogEntry, LogInfo, ToWorker, Traffic } from "./types";

export interface Listener {
  readonly takesLiveFrames: boolean;  // false: paused
  opened(log: LogView): void;
  tableChanged(log: LogView, forgotten: number): void;
  frameArrived(log: LogView, live: boolean): void;
  reset(log: LogView): void;
  historyGrew(log: LogView): void;
  progress(log: LogView, what: string, share: number): void;
  fault(log: LogView, kind: FaultKind, text: string, id?: string): void;
}

export class LogView {
  info: LogInfo | null = null;
  table: FrameTable | null = null;
  tableComplete = false;
  frame: Frame | null = null;
  readonly history = new Map<number, Float64Array>();
  historyShare = 0;
  traffic: Traffic = { requests: 0, bytes: 0, opened: null };
  received = 0;  // frames of a live run
  dropped = 0;   // of them: not drawn, because newer ones had come
  private readonly worker = new Worker("worker.js");
  private pending: { id: number; index: number } | null = null;
  private next: { index: number; images: string[]; ahead: boolean } | null = null;
  private lastId = 0;
  private readonly numbers = new Map<number, (frame: Frame | null) => void>();

  constructor(readonly index: number, entry: LogEntry | null, private readonly listener: Listener) {
    this.worker.onmessage = (event: MessageEvent<FromWorker>) => this.receive(event.data);
    this.worker.onerror = (event) => listener.fault(this, "unknown", `The page's worker failed: ${event.message}`);
    if (entry) this.send({ type: "open", entry });
    else this.send({ type: "connect", url: `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/` });
  }

  get isBusy(): boolean { return this.pending !== null; }
  get name(): string { return this.info?.name ?? ""; }

  private send(message: ToWorker): void { this.worker.postMessage(message); }

  // Of several requests the newest is read next; those before it are forgotten.
  request(index: number, images: string[], ahead: boolean): void {
    this.next = { index, images, ahead };
    if (!this.pending) this.sendNext();
  }
  private sendNext(): void {
    const next = this.next;
    this.next = null;
    if (!next) return;
    this.pending = { id: ++this.lastId, index: next.index };
    this.send({ type: "frame", id: this.lastId, numbersOnly: false, ...next });
  }

  // Detections and tracks of any frame. Only while no other frame is asked for.
  readNumbers(index: number): Promise<Frame | null> {
    const id = ++this.lastId;
    this.send({ type: "frame", id, index, images: [], numbersOnly: true, ahead: false });
    return new Promise((done) => this.numbers.set(id, done));
  }

  wantHistory(all: boolean): void {
    if (this.frame) this.send({ type: "history", center: this.frame.index, all });
  }
  setLiveImages(images: string[]): void {
    this.send({ type: "frame", id: 0, index: 0, images, numbersOnly: false, ahead: false });
  }

  private receive(message: FromWorker): void {
    switch (message.type) {
      case "opened": this.info = message.info; this.listener.opened(this); break;
      case "table":
        if (message.forgotten) this.forget(message.forgotten);
        this.table = message.table; this.tableComplete = message.complete;
        this.listener.tableChanged(this, message.forgotten ?? 0);
        break;
      case "progress": this.listener.progress(this, message.what, message.share); break;
      case "traffic": this.traffic = message.traffic; break;
      case "frame":
      case "noframe": this.receiveFrame(message); break;
      case "live":
        this.received = message.received;
        this.dropped = message.dropped;
        if (!this.listener.takesLiveFrames) break;
        this.frame = message.frame;
        this.listener.frameArrived(this, true);
        break;
      case "reset":
        this.table = this.frame = null;
        this.history.clear();
        this.received = this.dropped = 0;
        this.listener.reset(this);
        break;
      case "history":
        for (const { index, rows } of message.rows) this.history.set(index, rows);
        this.historyShare = message.share;
        this.listener.historyGrew(this);
        break;
      case "fault": this.listener.fault(this, message.kind, message.text, message.id); break;
    }
  }

  // The first rows left the table of a live run. A shown frame that is among them stays, with a negative index.
  private forget(count: number): void {
    const kept = [...this.history].filter(([index]) => index >= count);
    this.history.clear();
    for (const [index, rows] of kept) this.history.set(index - count, rows);
    if (this.frame) this.frame.index -= count;
  }

  private receiveFrame(message: Extract<FromWorker, { type: "frame" | "noframe" }>): void {
    const frame = message.type === "frame" ? message.frame : null;
    if (message.type === "frame") this.traffic = message.traffic;
    const waiting = this.numbers.get(message.id);
    if (waiting) {
      this.numbers.delete(message.id);
      waiting(frame);
      return;
    }
    if (this.pending?.id !== message.id) return;
    this.pending = null;
    if (frame || !this.next) this.frame = frame;  // a frame that cannot be read is not shown as another one
    this.sendNext();
    this.listener.frameArrived(this, false);
  }
}
