// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One log on disk: what it holds, its frames, and work in the background (stamps, numbers of all frames, checksums).
import type { Frame, FrameTable, FromWorker, HistoryRows, LogEntry, LogInfo, Traffic } from "../types";
import { buildFrame, historyRows, kCloudSchemas, kFrameSchemas, kOdometry, sensorOf,
    type TopicMessage } from "./frame_builder";
import { readFrames, TableBuilder } from "./frame_table";
import { McapLog, type Channel, type Chunk } from "./mcap_log";
import { decodeJson, decodeLines, decodeText, decodeTfMessage, type Transform } from "./messages";
import { Fault, RangeFile } from "./range_file";

const kAllTime = 1n << 62n, kTablePause_ms = 400, kTrail_s = 3.2;

export class LogReader {
  private readonly log: McapLog;
  private readonly builder = new TableBuilder();
  private table: FrameTable | null = null;  // complete from the start: the log has the attachment
  private info!: LogInfo;
  private statics: Transform[] = [];
  private reference: Channel | undefined;   // its stamps are the frames'
  private indexer: AsyncGenerator<number> | null = null;
  private describedChannels = 0;            // channels that were known to describe()
  private tablePosted_ms = 0;
  private readonly scanned = new Set<Chunk>();
  private readonly inHistory = new Set<number>();
  private historyWanted: { center: number; all: boolean } | null = null;
  private indexOf = new Map<bigint, number>();
  private openedTraffic: { requests: number; bytes: number } | null = null;
  private nextChunk: bigint | null = null;

  constructor(private readonly entry: LogEntry,
      private readonly post: (message: FromWorker, transfer?: Transferable[]) => void) {
    this.log = new McapLog(new RangeFile(entry.url, Number(entry.bytes), entry.etag,
        (f) => post({ type: "fault", kind: f.kind, text: f.message })));
  }

  get traffic(): Traffic {
    return { requests: this.log.file.requests, bytes: this.log.file.bytes, opened: this.openedTraffic };
  }
  private get stamps(): ArrayLike<bigint> { return this.table?.stamps ?? this.builder.stamps; }
  // What the log or a frame seems to lack may follow.
  private get isWalking(): boolean { return this.log.cut !== null && this.indexer !== null; }

  async open(): Promise<void> {
    await this.log.open();
    if (this.log.cut !== null) {
      this.indexer = this.walkLog();
      for (let first = await this.indexer.next(); !first.done && !this.reference; first = await this.indexer.next());
      if (!this.reference)
        throw new Fault("damaged", "The log was cut off before its first frame was complete: nothing can be shown.");
      this.post({ type: "fault", kind: "damaged",
          text: "The log has no index: it was cut off, or is still being written. "
              + "The frames up to the cut are shown." });
    } else {
      this.findReference();
      this.table = await this.readPart(
          "The attachment `frames` cannot be read: the numbers of all frames are collected from the messages.",
          async () => {
            const frames = await this.log.readAttachment("frames");
            return frames && readFrames(decodeJson(frames));
          }, null);
      if (!this.table) {
        this.indexer = this.collectStamps();
        await this.indexer.next();
      }
    }
    if (!this.reference && !this.table) throw new Fault("unknown", this.describeUnknown());
    await this.describe();
    this.openedTraffic = { requests: this.log.file.requests, bytes: this.log.file.bytes };
    this.post({ type: "opened", info: this.info });
    this.post({ type: "traffic", traffic: this.traffic });
    this.postTable(true);
    for (const text of this.log.losses) this.post({ type: "fault", kind: "damaged", text });
    const reason = this.log.metadata.find((m) => m.name.includes("partial"))?.entries.find(
        ([key]) => key === "reason")?.[1];
    if (reason) this.post({ type: "fault", kind: "notice", text: `The run ended early: ${reason}` });
  }

  // A part that the page can do without: where it is damaged, a sentence says so.
  private async readPart<T>(sentence: string, read: () => Promise<T>, without: T): Promise<T> {
    try {
      return await read();
    } catch (error) {
      if (error instanceof Fault && error.kind !== "damaged") throw error;
      this.post({ type: "fault", kind: "damaged", text: sentence });
      return without;
    }
  }

  private describeUnknown(): string {
    const schemas = [...new Set([...this.log.channels.values()].map((c) => c.schema || c.encoding))];
    return schemas.length === 0 ? "The log holds no messages."
        : `The page draws none of this log's schemas: ${schemas.slice(0, 12).join(", ")}.`;
  }

  private findReference(): void {
    const channels = [...this.log.channels.values()];
    this.reference = channels.find((c) => c.schema === "overtake.Times") ??
        channels.find((c) => c.schema === "overtake.Tracks") ??
      channels.find((c) => kCloudSchemas.includes(c.schema) && c.topic.includes("front")) ??
          channels.find((c) => kCloudSchemas.includes(c.schema));
  }

  private async describe(): Promise<void> {
    this.describedChannels = this.log.channels.size;
    const channels = [...this.log.channels.values()].sort((a, b) => a.topic.localeCompare(b.topic));
    const clouds = channels.filter((c) => kCloudSchemas.includes(c.schema) && !c.topic.startsWith("/truth"));
    const has = (schema: string): boolean => channels.some((c) => c.schema === schema);
    const kind = has("overtake.Tracks") || has("foxglove.PointCloud") ? "view" : clouds.length > 0 ? "race" : "other";
    const images: Record<string, string[]> = {};
    for (const c of channels)
      if (c.schema === "foxglove.RawImage")
        (images[sensorOf(c.topic)] ??= []).push(c.topic.split("/image/")[1] ?? c.topic);
    const config = await this.readPart("The configuration in the log cannot be read.", async () =>
        await this.log.readAttachment("config.toml") ?? await this.log.readAttachment("rig.toml"), null);
    const map = await this.readPart("The map in the log cannot be read: it is not drawn.", () => this.readMap(), null);
    this.statics = await this.readPart(
        "The transforms on /tf_static cannot be read: the sensors' points are drawn as if each sensor was the "
            + "vehicle's origin.", () => this.readStatics(channels), []);
    const missing: string[] = [];
    if (kind === "race")
      missing.push(
          "This is a log of sensors, not of results: it has no labels, clusters, detections or tracks. "
              + "`overtake run LOG --out FOLDER --mcap VIEW.mcap` computes them.");
    if (kind === "view" && !has("foxglove.RawImage")) missing.push("The log has no images (`--mcap-images none`).");
    if (kind === "view" && clouds.length === 0) missing.push("The log has no point clouds.");
    if (map?.length === 0) missing.push("The log has no map.");
    const unknown = channels.filter((c) => !kFrameSchemas.has(c.schema) && c.schema !== "foxglove.SceneUpdate");
    if (unknown.length > 0)
      missing.push(`The page does not draw ${unknown.length === 1 ? "the topic"
          : "the topics"} ${unknown.map((c) => `${c.topic} (${c.schema || c.encoding})`).slice(0, 8).join(", ")}.`);
    this.info = { name: this.entry.name, bytes: Number(this.entry.bytes), kind,
        sensors: clouds.map((c) => sensorOf(c.topic)), images,
             topics: channels.map((c) => ({ topic: c.topic, schema: c.schema, encoding: c.encoding,
                 messages: c.messages, group: "" })),
             config: config && decodeText(config), metadata: this.log.metadata, map: map ?? [],
             missing: this.isWalking ? [] : missing, live: false };
  }

  private async readMap(): Promise<Float64Array[]> {
    const channel = this.log.channelOf("/map");
    if (channel) {
      const chunk = this.log.chunks.find((c) => c.channels.has(channel.id));
      const message = chunk && (await this.log.messagesIn(chunk)).find((m) => m.channel === channel.id);
      return message ? decodeLines(message.data) : [];
    }
    const csv = await this.log.readAttachment("map.csv");
    return csv ? readCenterLine(decodeText(csv)) : [];
  }

  private async readStatics(channels: Channel[]): Promise<Transform[]> {
    const channel = channels.find((c) => c.topic === "/tf_static" && c.encoding === "cdr");
    const chunk = channel && this.log.chunks.find((c) => c.channels.has(channel.id));
    if (!channel || !chunk) return [];
    return (await this.log.messagesIn(chunk)).filter((m) => m.channel === channel.id).flatMap(
        (m) => decodeTfMessage(m.data));
  }

  // ---- one frame
  async readFrame(index: number, images: string[], numbersOnly: boolean): Promise<Frame | null> {
    const begin_ms = performance.now(), stamp = this.stamps[index];
    if (stamp === undefined) return null;
    const wanted = new Map<number, Channel>();
    for (const c of this.log.channels.values()) {
      const isCloud = kCloudSchemas.includes(c.schema), isImage = c.schema === "foxglove.RawImage";
      if (!kFrameSchemas.has(c.schema) || (numbersOnly && (isCloud || isImage)) ||
          (isImage && !images.includes(c.topic))) continue;
      if (isCloud && c.topic.startsWith("/truth")) continue;
      if (c.schema === kOdometry && this.info.kind === "view") continue;
      wanted.set(c.id, c);
    }
    const exact = this.info.kind === "view", reach = exact ? 0n : this.halfPeriod();
    const lost = new Set<string>();  // topics
    let damage: Fault | null = null;
    const messages = await this.log.read(new Set(wanted.keys()), stamp - reach, stamp + reach, (chunk, fault) => {
      damage = fault;
      for (const id of chunk.channels) if (wanted.has(id)) lost.add(wanted.get(id)!.topic);
    });
    // A comparison needs all numbers; and a frame of nothing is none.
    if (damage && (numbersOnly || messages.length === 0)) throw damage;
    if (damage)
      this.post({ type: "fault", kind: "damaged",
          text: `${(damage as Fault).message} Frames in it lack ${[...lost].sort().join(", ")}.` });
    const near = exact ? messages : nearest(messages, stamp);
    const byTopic: TopicMessage[] = near.map((m) => ({ ...wanted.get(m.channel)!, data: m.data }));
    const frame = buildFrame(index, stamp, byTopic, this.statics);
    this.nextChunk = stamp;
    if (this.isWalking) frame.missing = [];
    frame.read_ms = performance.now() - begin_ms;
    return frame;
  }

  private halfPeriod(): bigint {
    const s = this.stamps;
    return s.length > 1 ? (s[1] - s[0]) / 2n + 1n : 50_000_000n;
  }

  // Unpacks the chunk of the clouds that follow the last frame that was read.
  async readAhead(): Promise<void> {
    const ids = new Set([...this.log.channels.values()].filter((c) => kCloudSchemas.includes(c.schema)).map(
        (c) => c.id));
    const from = this.nextChunk;
    this.nextChunk = null;
    if (from === null) return;
    const next = this.log.chunks.find((c) => c.begin > from && [...ids].some((id) => c.channels.has(id)));
    if (next) await this.log.messagesIn(next);
  }

  // ---- work in the background, one chunk a step
  wantHistory(center: number, all: boolean): void { this.historyWanted = { center, all }; }

  // False: nothing is left to do.
  async step(): Promise<boolean> {
    if (this.indexer) {
      const next = await this.indexer.next();
      if (next.done) this.indexer = null;
      if (this.log.cut !== null && (next.done || this.log.channels.size > this.describedChannels)) {
        await this.describe();
        this.post({ type: "opened", info: this.info });
      }
      this.postTable(this.indexer === null);
      this.post({ type: "progress", what: "reading the index", share: next.done ? 1 : next.value });
      return true;
    }
    if (await this.stepNumbers()) return true;
    if (this.log.hasUnverified) {
      if (!this.log.verifyOne())
        this.post({ type: "fault", kind: "damaged",
            text: "A part of the log is damaged: the checksum of a chunk differs. What is shown of it may be wrong." });
      return true;
    }
    return false;
  }

  private postTable(now: boolean): void {
    if (!now && performance.now() - this.tablePosted_ms < kTablePause_ms) return;
    this.tablePosted_ms = performance.now();
    this.post({ type: "table", table: this.table ?? this.builder.table(), complete: this.indexer === null });
  }

  private async *collectStamps(): AsyncGenerator<number> {
    const id = this.reference?.id;
    if (id === undefined) return;
    const chunks = this.log.chunks.filter((c) => c.channels.has(id)).sort((a, b) => (a.begin < b.begin ? -1 : 1)),
        kAtOnce = 8;
    for (let i = 0; i < chunks.length; i += kAtOnce) {
      const lists = await Promise.all(chunks.slice(i, i + kAtOnce).map((c) => this.readPart(
          "An index in the log is damaged: its frames are not listed.", () => this.log.readStamps(c, id), [])));
      this.addStamps(lists.flat());
      yield Math.min(1, (i + kAtOnce) / chunks.length);
    }
  }

  private async *walkLog(): AsyncGenerator<number> {
    let used = 0;
    for await (const share of this.log.walk()) {
      if (!this.reference) this.findReference();
      if (!this.reference) continue;
      const stamps = this.log.stampsSeen(this.reference.id);
      this.addStamps(stamps.slice(used));
      used = stamps.length;
      yield share;
    }
  }

  private addStamps(stamps: bigint[]): void {
    for (const stamp of stamps) {
      if (this.indexOf.has(stamp)) continue;
      this.indexOf.set(stamp, this.builder.add(stamp));
    }
  }

  // Numbers of all frames: of those near the shown one for the trails; of all for a selected track, and for a log
  // without the attachment.
  private async stepNumbers(): Promise<boolean> {
    const wanted = this.historyWanted, count = this.stamps.length;
    if (this.info.kind !== "view" || count === 0) return false;
    const everything = !this.table || wanted?.all;
    if (!everything && !wanted) return false;
    const ids = new Set([...this.log.channels.values()].filter((c) => c.encoding === "json" ||
        c.topic === "/tf").map((c) => c.id));
    const center = this.stamps[Math.min(wanted?.center ?? 0, count - 1)], reach = BigInt(Math.round(kTrail_s * 1e9));
    let chunks = this.log.chunksOf(ids, center - reach, center).filter((c) => !this.scanned.has(c));
    if (chunks.length === 0 && everything)
      chunks = this.log.chunksOf(ids, -kAllTime, kAllTime).filter((c) => !this.scanned.has(c));
    const chunk = chunks.find((c) => this.log.isCached(c)) ?? chunks[0];
    if (!chunk) {
      if (!this.table)
        this.postTable(true), this.post({ type: "progress", what: "reading the numbers of all frames", share: 1 });
      this.historyWanted = null;
      return false;
    }
    const rows = await this.scan(chunk, ids);
    const share = this.scanned.size / Math.max(1, this.log.chunksOf(ids, -kAllTime, kAllTime).length);
    if (rows.length > 0) this.post({ type: "history", rows, share });
    if (!this.table) {
      this.postTable(false);
      this.post({ type: "progress", what: "reading the numbers of all frames", share });
    }
    return true;
  }

  private async scan(chunk: Chunk, ids: ReadonlySet<number>): Promise<HistoryRows[]> {
    this.scanned.add(chunk);
    if (this.table && this.indexOf.size === 0) this.table.stamps.forEach((stamp, i) => this.indexOf.set(stamp, i));
    const byStamp = new Map<bigint, TopicMessage[]>();
    try {
      for (const m of await this.log.messagesIn(chunk)) {
        if (!ids.has(m.channel)) continue;
        if (!byStamp.has(m.time)) byStamp.set(m.time, []);
        byStamp.get(m.time)!.push({ ...this.log.channels.get(m.channel)!, data: m.data });
      }
    } catch (error) {
      if (error instanceof Fault && error.kind === "damaged")
        this.post({ type: "fault", kind: error.kind, text: error.message });
      else throw error;
    }
    const rows: HistoryRows[] = [];
    for (const [stamp, messages] of byStamp) {
      const index = this.indexOf.get(stamp);
      if (index === undefined) continue;
      const frame = buildFrame(index, stamp, messages, []);
      if (!this.table) {
        if (frame.times.length > 0) this.builder.setTimes(index, frame.times);
        if (messages.some((m) => m.schema === "overtake.Detections"))
          this.builder.set(index, "detections", frame.detections.length);
        if (messages.some((m) => m.schema === "overtake.Tracks")) {
          this.builder.set(index, "tracks", frame.tracks.length);
          this.builder.set(index, "confirmed", frame.tracks.filter((t) => t.state === "confirmed").length);
        }
      }
      if (!messages.some((m) => m.schema === "overtake.Tracks") || this.inHistory.has(index)) continue;
      this.inHistory.add(index);
      rows.push({ index, rows: historyRows(frame) });
    }
    return rows;
  }
}

// Per channel, the message nearest to the stamp.
function nearest<M extends { channel: number; time: bigint }>(messages: M[], stamp: bigint): M[] {
  const best = new Map<number, M>(), distance = (m: M): bigint => (m.time > stamp ? m.time - stamp : stamp - m.time);
  for (const m of messages) {
    const old = best.get(m.channel);
    if (!old || distance(m) < distance(old)) best.set(m.channel, m);
  }
  return [...best.values()];
}

// The lines of a centre line with widths (x, y, width to the right, width to the left), closed: centre, left, right.
function readCenterLine(csv: string): Float64Array[] {
  const rows = csv.split("\n").map((line) => line.split(",").map(Number)).filter((row) => row.length >= 2 &&
      row.every(Number.isFinite));
  const lines: number[][] = [[], [], []];
  rows.forEach(([x, y, right = 0, left = 0], i) => {
    const [before, after] = [rows[(i + rows.length - 1) % rows.length], rows[(i + 1) % rows.length]];
    const dx = after[0] - before[0], dy = after[1] - before[1], norm = Math.max(1e-9, Math.hypot(dx, dy));
    [0, left, -right].forEach((offset, k) => lines[k].push(x - dy / norm * offset, y + dx / norm * offset));
  });
  return rows.length > 1 ? lines.map((line) => Float64Array.from([...line, line[0], line[1]])) : [];
}
