// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A run that is under way, by the Foxglove WebSocket protocol. Only the newest whole frame is decoded.
import type { Frame, FromWorker, LogInfo } from "../types";
import { buildFrame, historyRows, kCloudSchemas, kFrameSchemas, sensorOf, type TopicMessage } from "./frame_builder";
import { TableBuilder } from "./frame_table";
import { decodeLines, viewOf } from "./messages";

interface Advertised { id: number; topic: string; encoding: string; schemaName: string }

const kSubprotocols = ["foxglove.sdk.v1", "foxglove.websocket.v1"], kLongestWait_ms = 4000, kKeptFrames = 2400,
    kMessageData = 1;

export class LiveReader {
  private readonly channels = new Map<number, Advertised>();
  private readonly subscribed = new Map<number, number>();  // subscription to channel; the page uses equal numbers
  private builder = new TableBuilder();
  private socket: WebSocket | null = null;
  private images: string[] = [];
  private collecting: TopicMessage[] = [];
  private collectingStamp = -1n;
  private newest: { stamp: bigint; messages: TopicMessage[] } | null = null;
  private decoding = false;
  private received = 0;  // frames
  private dropped = 0;   // of them: newer ones had come
  private session: string | null = null;
  private wait_ms = 250;
  private map: Float64Array[] = [];

  constructor(private readonly url: string, private readonly post: (message: FromWorker, transfer?: Transferable[]) =>
      void,
              private readonly buffersOf: (frame: Frame) => Transferable[]) {}

  connect(): void {
    const socket = new WebSocket(this.url, kSubprotocols);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.readText(data)
        : this.readData(new Uint8Array(data as ArrayBuffer)));
    socket.onopen = () => {
      this.wait_ms = 250;
      this.post({ type: "fault", kind: "back", text: "Connected to the run." });
    };
    socket.onclose = () => {
      this.channels.clear();
      this.subscribed.clear();
      this.post({ type: "fault", kind: "gone",
          text: "The run does not answer: it ended, or it has not begun. The page keeps trying." });
      setTimeout(() => this.connect(), this.wait_ms);
      this.wait_ms = Math.min(2 * this.wait_ms, kLongestWait_ms);
    };
  }

  setImages(topics: string[]): void {
    this.images = topics;
    this.subscribe();
  }

  private readText(text: string): void {
    const message = JSON.parse(text) as { op: string; channels?: Advertised[]; channelIds?: number[]; message?: string;
        id?: string; sessionId?: string };
    if (message.op === "serverInfo") {
      this.beginSession(message.sessionId ?? null);
    } else if (message.op === "advertise") {
      for (const channel of message.channels ?? []) this.channels.set(channel.id, channel);
      this.subscribe();
      this.post({ type: "opened", info: this.describe() });
    } else if (message.op === "unadvertise") {
      for (const id of message.channelIds ?? []) this.channels.delete(id), this.subscribed.delete(id);
    } else if (message.op === "status" && message.message) {
      this.post({ type: "fault", kind: "notice", text: message.message, id: message.id ?? message.message });
    }
  }

  // Frames of another run do not belong on the time line of the one before.
  private beginSession(session: string | null): void {
    const isOther = this.session !== null && session !== this.session;
    this.session = session;
    if (!isOther) return;
    this.builder = new TableBuilder();
    this.collecting = [];
    this.newest = null;
    this.map = [];
    this.received = this.dropped = 0;
    this.post({ type: "reset" });
  }

  private subscribe(): void {
    const wanted = (c: Advertised): boolean =>
      c.schemaName === "foxglove.RawImage" ? this.images.includes(c.topic)
          : kFrameSchemas.has(c.schemaName) || c.topic === "/map";
    const add = [...this.channels.values()].filter((c) => wanted(c) && !this.subscribed.has(c.id));
    const drop = [...this.subscribed.keys()].filter((id) => !this.channels.has(id) || !wanted(this.channels.get(id)!));
    for (const c of add) this.subscribed.set(c.id, c.id);
    for (const id of drop) this.subscribed.delete(id);
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    if (add.length > 0)
      this.socket.send(JSON.stringify({ op: "subscribe", subscriptions: add.map(
          (c) => ({ id: c.id, channelId: c.id })) }));
    if (drop.length > 0) this.socket.send(JSON.stringify({ op: "unsubscribe", subscriptionIds: drop }));
  }

  private readData(bytes: Uint8Array): void {
    const view = viewOf(bytes), channel = this.channels.get(bytes.length > 13 ? view.getUint32(1, true) : -1);
    if (bytes[0] !== kMessageData || !channel) return;
    const stamp = view.getBigUint64(5, true), data = bytes.subarray(13);
    if (channel.topic === "/map") {
      this.map = decodeLines(data);
      this.post({ type: "opened", info: this.describe() });
      return;
    }
    // The counters come between two frames: they are those of the next one.
    if (stamp !== this.collectingStamp)
      this.collecting = this.collecting.filter((m) => m.schema === "overtake.Counters");
    this.collectingStamp = stamp;
    this.collecting.push({ topic: channel.topic, schema: channel.schemaName, encoding: channel.encoding, data });
    if (channel.schemaName !== "overtake.Times") return;  // the last message of a frame
    ++this.received;
    if (this.newest) ++this.dropped;
    this.newest = { stamp, messages: this.collecting };
    this.collecting = [];
    if (!this.decoding) {
      this.decoding = true;
      setTimeout(() => this.decodeNewest(), 0);  // after the messages that already wait
    }
  }

  private decodeNewest(): void {
    this.decoding = false;
    const newest = this.newest;
    this.newest = null;
    if (!newest) return;
    const begin_ms = performance.now();
    const forgotten = this.builder.stamps.length >= kKeptFrames ? kKeptFrames / 4 : 0;
    this.builder.dropFirst(forgotten);
    const index = this.builder.add(newest.stamp), frame = buildFrame(index, newest.stamp, newest.messages, []);
    this.builder.setTimes(index, frame.times);
    this.builder.set(index, "detections", frame.detections.length);
    this.builder.set(index, "tracks", frame.tracks.length);
    this.builder.set(index, "confirmed", frame.tracks.filter((t) => t.state === "confirmed").length);
    this.builder.set(index, "points", frame.clouds.reduce((sum, c) => sum + c.count, 0));
    frame.read_ms = performance.now() - begin_ms;
    this.post({ type: "table", table: this.builder.table(), complete: true, forgotten });
    this.post({ type: "history", rows: [{ index, rows: historyRows(frame) }], share: 1 });
    this.post({ type: "live", frame, received: this.received, dropped: this.dropped }, this.buffersOf(frame));
  }

  private describe(): LogInfo {
    const channels = [...this.channels.values()], images: Record<string, string[]> = {};
    for (const c of channels)
      if (c.schemaName === "foxglove.RawImage")
        (images[sensorOf(c.topic)] ??= []).push(c.topic.split("/image/")[1] ?? c.topic);
    return { name: "live", bytes: 0, kind: "view",
        sensors: channels.filter((c) => kCloudSchemas.includes(c.schemaName)).map((c) => sensorOf(c.topic)), images,
             topics: channels.map((c) => ({ topic: c.topic, schema: c.schemaName, encoding: c.encoding, messages: null,
                 group: "" })),
             config: null, metadata: [], map: this.map, missing: [], live: true };
  }
}
