// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// An MCAP file in ranges. The summary gives chunks, channels and attachments; without a summary (a log that was cut
// off)
// the records are walked from the start, which reads only their heads. A chunk is read as a whole, in one request.
import { McapIndexedReader } from "@mcap/core";
import { crc32 } from "@foxglove/crc";
import { ZSTDDecoder } from "zstddec";
import { decodeText, viewOf } from "./messages";
import { Fault, RangeFile } from "./range_file";

export interface Channel { id: number; topic: string; encoding: string; schema: string; messages: number | null }
export interface Chunk {
  offset: number; length: number; begin: bigint; end: bigint; channels: Set<number>;
  indexLength: number;       // of the message indexes behind the chunk
  verified: boolean;         // its checksum was compared
}
export interface Message { channel: number; time: bigint; data: Uint8Array }
export interface Attachment { name: string; offset: number; length: number }
interface Unpacked { records: Uint8Array; messages: Message[]; crc: number }

const kMagic = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6, kMessageIndex = 7, kAttachment = 9, kMetadata = 12,
    kDataEnd = 15;
const kCacheBytes = 26 << 20, kWalkWindow = 16 << 10, kLargestChunk = 1 << 28;

const zstd = new ZSTDDecoder();

export class McapLog {
  readonly channels = new Map<number, Channel>();
  readonly chunks: Chunk[] = [];
  readonly attachments: Attachment[] = [];
  readonly metadata: { name: string; entries: [string, string][] }[] = [];
  cut: string | null = null;  // why the log has no summary
  readonly losses: string[] = [];  // sentences: what of the summary could not be read
  private readonly schemas = new Map<number, string>();
  private readonly cache = new Map<Chunk, Unpacked>();
  private cacheBytes = 0;
  private readonly stampsOf = new Map<number, bigint[]>();  // of a walk, by channel

  constructor(readonly file: RangeFile) {}

  async open(): Promise<void> {
    await zstd.init();
    if (this.file.length < kMagic.length)
      throw new Fault("damaged", this.file.length === 0 ? "The log is empty: 0 bytes."
          : "The log ends within its first bytes.");
    const magic = await this.file.read(0, kMagic.length);
    if (kMagic.some((byte, i) => byte !== magic[i])) throw new Fault("damaged", "This file is not an MCAP file.");
    try {
      const reader = await McapIndexedReader.Initialize({
        readable: { size: async () => BigInt(this.file.length),
            read: (offset, length) => this.file.read(Number(offset), Number(length)) },
      });
      for (const [id, schema] of reader.schemasById) this.schemas.set(id, schema.name);
      for (const c of reader.channelsById.values())
        this.addChannel(c.id, c.schemaId, c.topic, c.messageEncoding,
            Number(reader.statistics?.channelMessageCounts.get(c.id) ?? 0));
      for (const c of reader.chunkIndexes)
        this.chunks.push({ offset: Number(c.chunkStartOffset), length: Number(c.chunkLength), begin: c.messageStartTime,
            end: c.messageEndTime,
                           channels: new Set(c.messageIndexOffsets.keys()), indexLength: Number(c.messageIndexLength),
                               verified: false });
      for (const a of reader.attachmentIndexes)
        this.attachments.push({ name: a.name, offset: Number(a.offset), length: Number(a.length) });
      await this.readMetadata(reader);
    } catch (error) {
      if (error instanceof Fault && error.kind !== "damaged") throw error;
      this.channels.clear();
      this.chunks.length = this.attachments.length = this.metadata.length = 0;
      this.cut = error instanceof Error ? error.message : String(error);
      return;
    }
    if (this.chunks.length === 0 && this.channels.size > 0)
      throw new Fault("unknown", "This log is not divided into chunks, so the page cannot read a part of it.");
  }

  private async readMetadata(reader: McapIndexedReader): Promise<void> {
    try {
      for await (const m of reader.readMetadata()) this.metadata.push({ name: m.name, entries: [...m.metadata] });
    } catch (error) {
      if (error instanceof Fault && error.kind !== "damaged") throw error;
      this.losses.push("The log's metadata cannot be read.");
    }
  }

  private addChannel(id: number, schema: number, topic: string, encoding: string, messages: number | null): void {
    this.channels.set(id, { id, topic, encoding, schema: this.schemas.get(schema) ?? "", messages });
  }

  // The records from the start, for a log without a summary. Yields after each chunk; share is of the file's bytes.
  async *walk(): AsyncGenerator<number> {
    let window = new Uint8Array(0), begin = 0;
    const size = this.file.length;
    const at = async (offset: number, length: number): Promise<Uint8Array> => {
      if (offset < begin || offset + length > begin + window.length) {
        begin = offset;
        window = await this.file.read(offset, Math.min(Math.max(length, kWalkWindow),
            size - offset)) as Uint8Array<ArrayBuffer>;
      }
      return window.subarray(offset - begin, offset - begin + length);
    };
    for (let offset = kMagic.length; offset + 9 <= size; ) {
      const head = await at(offset, 9), op = head[0], length = Number(viewOf(head).getBigUint64(1, true));
      if (op === kDataEnd || op === 0) return;
      if (offset + 9 + length > size) return;  // cut within this record
      if (op === kChunk && length >= 40) {
        const view = viewOf(await at(offset + 9, 28));
        this.chunks.push({ offset, length: 9 + length, begin: view.getBigUint64(0, true),
            end: view.getBigUint64(8, true),
                           channels: new Set(), indexLength: 0, verified: false });
      } else if (op === kMessageIndex && this.chunks.length > 0) {
        const chunk = this.chunks[this.chunks.length - 1];
        chunk.indexLength += 9 + length;
        this.addStamps(await at(offset + 9, length), chunk);
      } else if (op === kAttachment && length < kLargestChunk) {
        this.attachments.push({ name: parseAttachment(await this.file.read(offset + 9, length)).name, offset,
            length: 9 + length });
      } else if (op === kMetadata && length < 1 << 20) {
        this.metadata.push(parseMetadata(await at(offset + 9, length)));
      } else if (op === kSchema || op === kChannel) {
        this.addRecord(op, await at(offset + 9, length));
      }
      offset += 9 + length;
      if (op === kMessageIndex) {
        const chunk = this.chunks[this.chunks.length - 1];
        if ([...chunk.channels].some((id) => !this.channels.has(id))) await this.learnChannels(chunk);
        yield offset / size;
      }
    }
  }

  // All channels of a chunk whose indexes are only partly walked.
  private async learnChannels(chunk: Chunk): Promise<void> {
    try {
      for (const { channel } of await this.messagesIn(chunk)) chunk.channels.add(channel);
    } catch (error) {
      ifDamaged(error);
    }
  }

  private addStamps(content: Uint8Array, chunk: Chunk): void {
    const view = viewOf(content), channel = view.getUint16(0, true);
    const stamps = this.stampsOf.get(channel) ?? [];
    this.stampsOf.set(channel, stamps);
    if (content.length > 6) chunk.channels.add(channel);
    for (let k = 6; k + 16 <= content.length; k += 16) stamps.push(view.getBigUint64(k, true));
  }
  stampsSeen(channel: number): bigint[] { return this.stampsOf.get(channel) ?? []; }

  // The stamps of a channel's messages in one chunk, from the message indexes behind it.
  async readStamps(chunk: Chunk, channel: number): Promise<bigint[]> {
    const stamps: bigint[] = [], bytes = await this.file.read(chunk.offset + chunk.length, chunk.indexLength),
        view = viewOf(bytes);
    for (let at = 0; at + 9 <= bytes.length; ) {
      const length = Number(view.getBigUint64(at + 1, true));
      if (bytes[at] === kMessageIndex && view.getUint16(at + 9, true) === channel)
        for (let k = at + 15; k + 16 <= at + 9 + length; k += 16) stamps.push(view.getBigUint64(k, true));
      at += 9 + length;
    }
    return stamps;
  }

  async readAttachment(name: string): Promise<Uint8Array | null> {
    const found = this.attachments.find((a) => a.name === name);
    return found ? parseAttachment((await this.file.read(found.offset, found.length)).subarray(9)).data : null;
  }

  channelOf(topic: string): Channel | undefined {
    for (const channel of this.channels.values()) if (channel.topic === topic) return channel;
    return undefined;
  }

  chunksOf(channels: ReadonlySet<number>, from: bigint, to: bigint): Chunk[] {
    return this.chunks.filter((c) => c.begin <= to && c.end >= from && [...channels].some((id) => c.channels.has(id)));
  }

  // Damaged chunks are left out and given to `lose`.
  async read(channels: ReadonlySet<number>, from: bigint, to: bigint,
      lose: (chunk: Chunk, fault: Fault) => void): Promise<Message[]> {
    const found: Message[] = [];
    for (const chunk of this.chunksOf(channels, from, to)) {
      const messages = await this.messagesIn(chunk).catch((error: unknown) => {
        lose(chunk, ifDamaged(error));
        return [];
      });
      for (const message of messages)
        if (channels.has(message.channel) && message.time >= from && message.time <= to) found.push(message);
    }
    return found;
  }

  isCached(chunk: Chunk): boolean { return this.cache.has(chunk); }

  async messagesIn(chunk: Chunk): Promise<Message[]> {
    const known = this.cache.get(chunk);
    if (known) {
      this.cache.delete(chunk);  // the order of the map is the order of use
      this.cache.set(chunk, known);
      return known.messages;
    }
    const unpacked = this.unpack(await this.file.read(chunk.offset, chunk.length));
    this.cache.set(chunk, unpacked);
    this.cacheBytes += unpacked.records.length;
    for (const [old, { records }] of this.cache) {
      if (this.cacheBytes <= kCacheBytes || this.cache.size <= 2) break;
      this.cache.delete(old);
      this.cacheBytes -= records.length;
    }
    return unpacked.messages;
  }

  // Compares the checksum of a chunk that is in memory. False: the chunk is damaged.
  verifyOne(): boolean {
    for (const [chunk, { records, crc }] of this.cache)
      if (!chunk.verified) {
        chunk.verified = true;
        if (crc !== 0 && crc32(records) !== crc) return false;
        break;
      }
    return true;
  }
  get hasUnverified(): boolean {
    for (const chunk of this.cache.keys()) if (!chunk.verified) return true;
    return false;
  }

  private unpack(bytes: Uint8Array): Unpacked {
    const view = viewOf(bytes), damaged = new Fault("damaged",
        "A part of the log is damaged: a chunk does not unpack.");
    if (bytes.length < 49 || bytes[0] !== kChunk) throw damaged;
    const size = Number(view.getBigUint64(25, true)), crc = view.getUint32(33, true),
        nameLength = view.getUint32(37, true);
    if (nameLength > 64 || size > kLargestChunk) throw damaged;
    const compression = decodeText(bytes.subarray(41, 41 + nameLength));
    const packed = bytes.subarray(41 + nameLength + 8);
    let records: Uint8Array;
    if (compression === "zstd") {
      try {
        records = zstd.decode(packed, size);
      } catch {
        throw damaged;
      }
    } else if (compression === "") {
      records = packed;
    } else {
      throw new Fault("unknown",
          `The log is compressed with ${compression}; the page reads zstd and uncompressed logs.`);
    }
    if (records.length !== size) throw damaged;
    const messages: Message[] = [], inner = viewOf(records);
    for (let at = 0; at + 9 <= size; ) {
      const op = records[at], length = Number(inner.getBigUint64(at + 1, true)), content = at + 9;
      at = content + length;
      if (at > size) throw damaged;
      if (op === kMessage && length >= 22) {
        messages.push({ channel: inner.getUint16(content, true), time: inner.getBigUint64(content + 6, true),
            data: records.subarray(content + 22, at) });
        continue;
      }
      try {
        this.addRecord(op, records.subarray(content, at));
      } catch {  // RangeError: its texts are longer than the record
        throw damaged;
      }
    }
    return { records, messages, crc };
  }

  private addRecord(op: number, content: Uint8Array): void {
    const view = viewOf(content);
    let at = 2;
    const string = (): string => {
      const length = view.getUint32(at, true);
      at += 4 + length;
      return decodeText(content.subarray(at - length, at));
    };
    if (op === kSchema && !this.schemas.has(view.getUint16(0, true)))
      this.schemas.set(view.getUint16(0, true), string());
    if (op === kChannel && !this.channels.has(view.getUint16(0, true))) {
      at = 4;
      this.addChannel(view.getUint16(0, true), view.getUint16(2, true), string(), string(), null);
    }
  }
}

// The fault of a damaged part, without which the page goes on; throws any other error.
function ifDamaged(error: unknown): Fault {
  if (error instanceof Fault && error.kind === "damaged") return error;
  throw error;
}

function parseAttachment(content: Uint8Array): { name: string; data: Uint8Array } {
  const view = viewOf(content), nameLength = view.getUint32(16, true), typeAt = 20 + nameLength;
  const dataAt = typeAt + 4 + view.getUint32(typeAt, true);
  const length = Number(view.getBigUint64(dataAt, true));
  return { name: decodeText(content.subarray(20, typeAt)), data: content.subarray(dataAt + 8, dataAt + 8 + length) };
}

function parseMetadata(content: Uint8Array): { name: string; entries: [string, string][] } {
  const view = viewOf(content);
  let at = 0;
  const string = (): string => {
    const length = view.getUint32(at, true);
    at += 4 + length;
    return decodeText(content.subarray(at - length, at));
  };
  const name = string(), entries: [string, string][] = [], end = at + 4 + view.getUint32(at, true);
  for (at += 4; at < end; ) entries.push([string(), string()]);
  return { name, entries };
}
