// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The logs, the frame that is shown, the clock and what is selected. Panels listen for changes; all changes of one
// picture reach a panel together.
import { entryAt, frameDifference, nearestEntry, pairFrames, tableDifference, type Entry } from "./pairs";
import { LogView, type Listener } from "./log_view";
import { State, type Selection } from "./state";
import type { FaultKind, LogList } from "./types";
import type { PickedPoint } from "./view3d";

const kFragmentPause_ms = 300;

export type Change = "info" | "table" | "frame" | "selection" | "settings" | "history" | "hover" | "clock" | "faults" |
  "run";
export interface FaultLine { log: number; kind: FaultKind; text: string; id?: string }

export class App implements Listener {
  readonly state = new State();
  readonly logs: LogView[] = [];
  readonly faults: FaultLine[] = [];
  readonly underWay = new Map<string, { what: string; share: number }>();
  entries: Entry[] = [];
  at = -1;             // the entry that is asked for
  hover: PickedPoint | null = null;
  playing = false;
  searching = false;   // for the next difference
  difference = "";
  live = false;
  private readonly listeners: { changes: Change[]; act: (changed: Set<Change>) => void }[] = [];
  private readonly changes = new Set<Change>();
  private clockBase = { wall_ms: 0, stamp: 0n };
  private fragment = "";
  private fragmentTimer: number | null = null;
  private imagesAsked = "";
  private startAt: bigint | null = null;

  start(list: LogList): void {
    this.live = list.live;
    this.state.decode(location.hash);
    this.startAt = this.state.at ?? (list.at === null ? null : BigInt(list.at));
    const sources = list.live ? [null] : list.logs.slice(0, 2);
    for (const [i, entry] of sources.entries()) this.logs.push(new LogView(i, entry, this));
    this.playing = list.live;
    window.addEventListener("hashchange", () => this.readFragment());
  }

  on(changes: Change[], act: (changed: Set<Change>) => void): void { this.listeners.push({ changes, act }); }
  changed(...changes: Change[]): void { for (const change of changes) this.changes.add(change); }
  // Once a picture: the clock, then the panels.
  tick(now_ms: number): void {
    if (this.playing && !this.live) this.advance(now_ms);
    if (this.changes.size === 0) return;
    const changes = new Set(this.changes);
    this.changes.clear();
    if (changes.has("settings") || changes.has("info")) this.followImages();
    for (const { changes: wanted, act } of this.listeners) if (wanted.some((c) => changes.has(c))) act(changes);
    if (["settings", "selection", "frame", "clock"].some((c) => changes.has(c as Change)) && !this.playing)
      this.writeFragment();
  }

  get entry(): Entry | undefined { return this.entries[this.at]; }
  get isSettled(): boolean {
    return this.at >= 0 && this.logs.every((l) => !l.isBusy &&
        (l.frame?.index ?? -1) === (this.entry?.frames[l.index] ?? -1));
  }
  get first(): bigint { return this.entries[0]?.stamp ?? 0n; }
  get last(): bigint { return this.entries[this.entries.length - 1]?.stamp ?? 0n; }
  seconds(stamp: bigint): number { return Number(stamp - this.first) / 1e9; }

  // ---- which frame
  goto(entry: number): void {
    if (this.entries.length === 0 || this.live) return;
    this.at = Math.min(Math.max(entry, 0), this.entries.length - 1);
    this.state.at = this.entries[this.at].stamp;
    this.request();
    this.changed("clock");
  }
  gotoStamp(stamp: bigint): void { this.goto(nearestEntry(this.entries, stamp)); }
  seek(entry: number): void {
    this.goto(entry);
    this.rebaseClock();
  }
  step(frames: number): void {
    this.pause();
    this.seek(this.at + frames);
  }
  stepSeconds(seconds: number): void {
    if (!this.entry) return;
    this.pause();
    const to = nearestEntry(this.entries, this.entry.stamp + BigInt(Math.round(seconds * 1e9)));
    this.seek(to);
  }

  request(): void {
    const entry = this.entry;
    if (!entry) return;
    for (const log of this.logs) {
      const index = entry.frames[log.index];
      if (index >= 0) log.request(index, this.imageTopics(log), this.playing);
      else log.frame = null, this.changed("frame");
    }
  }

  // The range image comes with every other one: it links pixels and points.
  imageTopics(log: LogView): string[] {
    const sensor = this.imageSensor, names = log.info?.images[sensor];
    if (!this.state.imagesOpen || !names) return [];
    return ["range", ...this.state.imageNames].filter((name, i, all) => names.includes(name) &&
        all.indexOf(name) === i).map((name) => `/${sensor}/image/${name}`);
  }
  // Asks for the images that the settings want.
  private followImages(): void {
    const topics = this.logs.map((log) => this.imageTopics(log)), text = JSON.stringify(topics);
    if (text === this.imagesAsked) return;
    this.imagesAsked = text;
    if (this.live) this.logs.forEach((log, i) => log.setLiveImages(topics[i]));
    else this.request();
  }
  get imageSensor(): string {
    const all = this.logs[0]?.info?.sensors ?? [];
    return all.includes(this.state.imageSensor) ? this.state.imageSensor : all[0] ?? "";
  }

  // ---- the clock
  play(): void {
    if (this.playing || this.entries.length === 0) return;
    this.playing = true;
    if (!this.live && this.at >= this.entries.length - 1)
      this.goto(this.state.loop ? entryAt(this.entries, this.state.loop[0]) : 0);
    this.rebaseClock();
    this.changed("clock");
  }
  pause(): void {
    this.playing = false;
    this.changed("clock");
  }
  setSpeed(speed: number): void {
    this.state.speed = speed;
    this.rebaseClock();
    this.changed("settings", "clock");
  }
  private rebaseClock(): void { this.clockBase = { wall_ms: performance.now(), stamp: this.entry?.stamp ?? 0n }; }

  // Frames that the clock has passed are skipped, never queued.
  private advance(now_ms: number): void {
    const { wall_ms, stamp } = this.clockBase, loop = this.state.loop;
    const to = stamp + BigInt(Math.round((now_ms - wall_ms) * 1e6 * this.state.speed));
    if (loop && to > loop[1] && (this.entry?.stamp ?? 0n) <= loop[1]) {
      this.goto(entryAt(this.entries, loop[0]));
      this.rebaseClock();
      return;
    }
    const entry = entryAt(this.entries, to);
    if (entry > this.at) this.goto(entry);
    if (this.at === this.entries.length - 1) this.pause();
  }

  // ---- from the logs
  get takesLiveFrames(): boolean { return this.playing; }
  opened(log: LogView): void {
    for (const text of log.info?.missing ?? []) this.fault(log, "notice", text);
    if (!this.live) this.request();  // a walk found more of the log: it may be in the shown frame
    this.changed("info");
  }
  tableChanged(log: LogView, forgotten: number): void {
    if (forgotten > 0) this.at = Math.max(-1, this.at - forgotten), this.changed("clock");
    const shown = this.entry;
    if (this.live || this.logs.every((l) => l.table)) this.entries = pairFrames(this.logs.map((l) => l.table));
    this.changed("table");
    if (this.entries.length === 0 || this.live) return;
    if (shown) {
      this.at = nearestEntry(this.entries, shown.stamp);
      const { frames } = this.entries[this.at];
      if (frames.some((frame, i) => frame !== shown.frames[i])) this.request();  // another log has the stamp, too
    } else if (this.startAt === null || log.tableComplete || this.startAt <= this.last) {
      if (this.startAt === null) this.goto(0);
      else this.gotoStamp(this.startAt);
      this.rebaseClock();
    }
  }
  frameArrived(log: LogView, live: boolean): void {
    if (!live && (this.entry?.frames[log.index] ?? -1) < 0) log.frame = null;  // asked for before the clock went on
    if (live) {
      this.at = this.entries.length - 1;
      this.state.at = null;
      this.changed("clock");
    } else if (log.frame) {
      log.wantHistory(this.state.selection?.kind === "track");
    }
    if (log.frame) for (const text of log.frame.missing) this.fault(log, "notice", text);
    this.changed("frame");
  }
  // Another run answers: what was known of the one before is gone.
  reset(log: LogView): void {
    this.entries = [];
    this.at = -1;
    this.state.at = this.state.loop = this.state.selection = null;
    for (let i = this.faults.length - 1; i >= 0; --i)
      if (this.faults[i].log === log.index && this.faults[i].kind === "notice") this.faults.splice(i, 1);
    this.changed("run", "table", "frame", "selection", "history", "faults", "clock");
  }
  historyGrew(): void { this.changed("history"); }
  progress(log: LogView, what: string, share: number): void {
    const key = `${log.index} ${what}`;
    if (share >= 1) this.underWay.delete(key);
    else this.underWay.set(key, { what, share });
    this.changed("faults");
  }
  fault(log: LogView, kind: FaultKind, text: string, id?: string): void {
    const same = this.faults.find((f) => id !== undefined && f.id === id && f.log === log.index);
    if (same) same.text = text, this.changed("faults");
    if (same) return;
    if (kind === "back") {
      for (let i = this.faults.length - 1; i >= 0; --i)
        if (this.faults[i].kind === "gone" && this.faults[i].log === log.index) this.faults.splice(i, 1);
    } else if (!this.faults.some((f) => f.text === text && f.log === log.index)) {
      this.faults.push({ log: log.index, kind, text, id });
    }
    this.changed("faults");
  }

  // ---- selection
  select(selection: Selection | null): void {
    this.state.selection = selection;
    if (selection?.kind === "track") this.logs[selection.log]?.wantHistory(true);
    this.changed("selection");
  }
  setHover(point: PickedPoint | null): void {
    const old = this.hover;
    if (old?.point === point?.point && old?.sensor === point?.sensor && old?.log === point?.log) return;
    this.hover = point;
    this.changed("hover");
  }
  toggleLayer(name: string): void {
    if (!this.state.off.delete(name)) this.state.off.add(name);
    this.changed("settings");
  }

  // ---- two logs
  // Goes to the next entry whose numbers differ: by the tables where they tell, else by the messages.
  async nextDifference(): Promise<void> {
    if (this.logs.length < 2 || this.searching || !this.logs.every((l) => l.table)) return;
    this.searching = true;
    this.pause();
    this.difference = "searching ...";
    this.changed("faults");
    const tables = this.logs.map((l) => l.table);
    let found = "";
    for (let i = this.at + 1; i < this.entries.length && found === "" && this.searching; ++i) {
      const entry = this.entries[i];
      found = tableDifference(tables, entry);
      if (found === "") {
        const frames = [];
        for (const log of this.logs) frames.push(await log.readNumbers(entry.frames[log.index]));
        if (frames[0] && frames[1]) found = frameDifference(frames[0], frames[1]);
      }
      if (found !== "") this.seek(i);
    }
    this.difference = found || (this.searching ? "no difference in the frames that follow" : "stopped");
    this.searching = false;
    this.changed("faults", "clock");
  }

  // ---- the fragment
  private readFragment(): void {
    if (location.hash.replace(/^#/, "") === this.fragment) return;
    const at = this.state.at;
    this.state.decode(location.hash);
    if (this.state.at !== null && this.state.at !== at) this.gotoStamp(this.state.at), this.rebaseClock();
    this.changed("settings", "selection");
    this.request();
  }
  // Browsers refuse more than some 100 changes of the address in 30 s: the last one of a quick series is written.
  writeFragment(): void {
    this.fragmentTimer ??= window.setTimeout(() => {
      this.fragmentTimer = null;
      this.fragment = this.state.encode();
      history.replaceState(null, "", `#${this.fragment}`);
    }, kFragmentPause_ms);
  }
}
