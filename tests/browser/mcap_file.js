// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// MCAP files for tests: reads a log's messages, and writes logs with chosen chunks, attachments and holes.
"use strict";
const fs = require("fs");
const core = require("../node/node_modules/@mcap/core");
const fzstd = require("../node/node_modules/fzstd");

// { channels: id -> { topic, encoding, schema, schemaEncoding, schemaData }, messages, attachments: name -> bytes };
// messages
// of the frames whose stamps keep() accepts.
async function unpackLog(path, keep) {
  const file = fs.openSync(path, "r"), size = fs.fstatSync(file).size;
  const read = async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    fs.readSync(file, bytes, 0, bytes.length, Number(offset));
    return bytes;
  };
  const reader = await core.McapIndexedReader.Initialize({ readable: { size: async () => BigInt(size), read },
      decompressHandlers: { zstd: (b) => fzstd.decompress(b) } });
  const channels = new Map(), messages = [], attachments = new Map();
  for (const c of reader.channelsById.values()) {
    const s = reader.schemasById.get(c.schemaId);
    channels.set(c.id, { topic: c.topic, encoding: c.messageEncoding, schema: s.name, schemaEncoding: s.encoding,
        schemaData: s.data });
  }
  for await (const m of reader.readMessages())
    if (keep(m.logTime)) messages.push({ channel: m.channelId, time: m.logTime, data: m.data.slice() });
  for await (const a of reader.readAttachments()) attachments.set(a.name, a.data);
  fs.closeSync(file);
  return { channels, messages, attachments };
}

// Unpacking in JavaScript takes seconds: whole logs are kept. The caller gets copies of all but the messages' bytes.
const known = new Map();
async function readLog(path, keep = null) {
  const log = keep ? await unpackLog(path, keep) : known.get(path) ?? await unpackLog(path, () => true);
  if (!keep) known.set(path, log);
  return { channels: new Map([...log.channels].map(([id, c]) => [id, { ...c }])),
           messages: log.messages.map((m) => ({ ...m })), attachments: new Map(log.attachments) };
}

const bytesOf = (data) => (typeof data === "string" ? Buffer.from(data)
    : Buffer.from(data.buffer ?? data, data.byteOffset ?? 0, data.byteLength));
const u16 = (v) => { const b = Buffer.alloc(2); b.writeUInt16LE(v); return b; };
const u32 = (v) => { const b = Buffer.alloc(4); b.writeUInt32LE(v); return b; };
const u64 = (v) => { const b = Buffer.alloc(8); b.writeBigUInt64LE(BigInt(v)); return b; };
const text = (s) => Buffer.concat([u32(Buffer.byteLength(s)), Buffer.from(s)]);
const sized = (b) => Buffer.concat([u32(b.length), b]);
const record = (op, ...parts) => { const content = Buffer.concat(parts);
    return Buffer.concat([Buffer.from([op]), u64(content.length), content]); };
const kMagic = Buffer.from([0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a]);

class LogWriter {
  constructor(path, channels) {
    this.file = fs.openSync(path, "w");
    this.offset = 0;
    this.channels = channels;
    this.chunks = [];
    this.attachments = [];
    this.counts = new Map();
    this.first = null;
    this.last = 0n;
    this.described = false;
    this.put(Buffer.concat([kMagic, record(1, text(""), text("tests/browser"))]));
  }
  put(bytes) {
    fs.writeSync(this.file, bytes, 0, bytes.length, this.offset);
    this.offset += bytes.length;
  }
  // A record of an unknown kind that the file system stores as a hole.
  hole(length) {
    this.put(Buffer.concat([Buffer.from([0x80]), u64(length)]));
    this.offset += length;
  }
  descriptions() {
    const parts = [];
    for (const [id, c] of this.channels) {
      parts.push(record(3, u16(id), text(c.schema), text(c.schemaEncoding), sized(bytesOf(c.schemaData))));
      parts.push(record(4, u16(id), u16(id), text(c.topic), text(c.encoding), u32(0)));
    }
    return Buffer.concat(parts);
  }
  chunk(messages) {
    const parts = this.described ? [] : [this.descriptions()], index = new Map();
    this.described = true;
    let at = parts.reduce((sum, p) => sum + p.length, 0), begin = null, end = 0n;
    for (const { channel, time, data } of messages) {
      const made = record(5, u16(channel), u32(0), u64(time), u64(time), bytesOf(data));
      if (!index.has(channel)) index.set(channel, []);
      index.get(channel).push(u64(time), u64(at));
      at += made.length;
      parts.push(made);
      begin = begin === null || time < begin ? time : begin;
      end = time > end ? time : end;
      this.counts.set(channel, (this.counts.get(channel) ?? 0) + 1);
    }
    const records = Buffer.concat(parts), start = this.offset;
    this.put(record(6, u64(begin), u64(end), u64(records.length), u32(0), text(""), u64(records.length), records));
    const length = this.offset - start, offsets = new Map(), indexStart = this.offset;
    for (const [channel, entries] of index) {
      offsets.set(channel, this.offset);
      this.put(record(7, u16(channel), sized(Buffer.concat(entries))));
    }
    this.chunks.push({ begin, end, start, length, offsets, indexLength: this.offset - indexStart,
        size: records.length });
    this.first = this.first === null || begin < this.first ? begin : this.first;
    this.last = end > this.last ? end : this.last;
  }
  attach(name, type, data) {
    const start = this.offset, bytes = bytesOf(data);
    this.put(record(9, u64(0), u64(0), text(name), text(type), u64(bytes.length), bytes, u32(0)));
    this.attachments.push(record(10, u64(start), u64(this.offset - start), u64(0), u64(0), u64(bytes.length),
        text(name), text(type)));
  }
  close() {
    this.put(record(15, u32(0)));
    const summary = this.offset, map = (entries, key, value) =>
        sized(Buffer.concat([...entries].map(([k, v]) => Buffer.concat([key(k), value(v)]))));
    this.put(this.descriptions());
    this.put(record(11, u64([...this.counts.values()].reduce((a, b) => a + b, 0)), u16(this.channels.size),
        u32(this.channels.size), u32(this.attachments.length), u32(0),
      u32(this.chunks.length), u64(this.first ?? 0n), u64(this.last), map(this.counts, u16, u64)));
    for (const c of this.chunks)
      this.put(record(8, u64(c.begin), u64(c.end), u64(c.start), u64(c.length), map(c.offsets, u16, u64),
          u64(c.indexLength), text(""), u64(c.size), u64(c.size)));
    for (const a of this.attachments) this.put(a);
    this.put(Buffer.concat([record(2, u64(summary), u64(0), u32(0)), kMagic]));
    fs.closeSync(this.file);
  }
}

// Writes a log as the viewer's writer does, in three groups, after change({ channels, frames, attachments }): a frame
// is { stamp, messages }. Returns its chunks: one of each group a frame.
function writeLog(path, { channels, messages, attachments }, change = (log) => log) {
  const byStamp = new Map();
  for (const m of messages) byStamp.set(m.time, [...(byStamp.get(m.time) ?? []), m]);
  const log = change({ channels, frames: [...byStamp].map(([stamp, list]) => ({ stamp, messages: list })),
      attachments });
  const writer = new LogWriter(path, log.channels),
      group = (m) => ({ "foxglove.PointCloud": 1, "foxglove.RawImage": 2 })[log.channels.get(m.channel).schema] ?? 0;
  for (const { messages: list } of log.frames)
    for (const g of [0, 1, 2]) {
      const part = list.filter((m) => group(m) === g);
      if (part.length > 0) writer.chunk(part);
    }
  for (const [name, data] of log.attachments) writer.attach(name, "application/json", data);
  writer.close();
  return writer.chunks;
}

// Makes chunks of such a file unreadable: the length of the first record is beyond the chunk.
function damageChunks(path, chunks) {
  const file = fs.openSync(path, "r+");
  for (const { start } of chunks) fs.writeSync(file, Buffer.from([255, 255, 255]), 0, 3, start + 9 + 40 + 4);
  fs.closeSync(file);
}

module.exports = { readLog, writeLog, damageChunks, LogWriter };
