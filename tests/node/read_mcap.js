// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: node tests/node/read_mcap.js FILE.mcap [TOPIC...]
//
// Reads an MCAP file with third-party code: once by its index, once as a stream (which checks every checksum).
// Decodes every message by its schema, checks JSON against its JSON Schema, compares the Foxglove types with
// @foxglove/schemas, and requires messages on each TOPIC. A view's log must also have small topics in chunks of their own
// and a record of all frames. Exit code 77 and a line "skipped: ..." if the node modules are
// missing.
"use strict";
const fs = require("fs");

let core, fzstd, lz4, decoding;
try {
  core = require("@mcap/core");
  fzstd = require("fzstd");
  lz4 = require("lz4js");
  decoding = require("./decoders.js");
} catch (error) {
  if (error.code !== "MODULE_NOT_FOUND") throw error;
  console.log("skipped: node modules for tests are not installed (tools/setup --node)");
  process.exit(77);
}

const [path, ...wanted] = process.argv.slice(2);
const fail = (text) => { console.log("FAILED: " + text); process.exitCode = 1; };
decoding.onFault(fail);
const decompressHandlers = {
  zstd: (bytes, size) => { const out = fzstd.decompress(bytes); if (BigInt(out.length) !== size) fail("zstd size"); return out; },
  lz4: (bytes, size) => { const out = lz4.decompress(bytes); if (BigInt(out.length) !== size) fail("lz4 size"); return out; },
};

// Reads the numbers alone: nearly all of the file must stay unread. The record of the frames must have one row a frame.
async function checkView(indexed, frames, counts, size, bytesRead) {
  const before = bytesRead(), stamps = [];
  for await (const message of indexed.readMessages({ topics: ["/times", "/tracks/numbers"] }))
    if (indexed.channelsById.get(message.channelId).topic === "/times") stamps.push(String(message.logTime));
  const part = (bytesRead() - before) / size;
  if (part > 0.05) fail(`the numbers alone cost ${(100 * part).toFixed(1)} % of the file`);
  if (frames.count !== counts.get("/times") || frames.stamp_ns.join() !== stamps.join()) fail("the frames are not those of /times");
  for (const [key, column] of Object.entries(frames))
    if (Array.isArray(column) && !["sensors", "stages", "reason_names"].includes(key) && column.length !== frames.count)
      fail(`column ${key} of the frames has ${column.length} of ${frames.count} rows`);
  for (const stage of frames.stages)
    if (stage.us.length !== frames.count) fail(`stage ${stage.stage} has ${stage.us.length} of ${frames.count} rows`);
}

async function main() {
  const file = fs.openSync(path, "r"), size = fs.fstatSync(file).size;
  const read = (offset, length) => {
    const bytes = new Uint8Array(length);
    if (fs.readSync(file, bytes, 0, length, offset) !== length) throw Error("the file became shorter");
    return bytes;
  };
  let bytesRead = 0;
  const readable = { size: async () => BigInt(size),
                     read: async (offset, length) => { bytesRead += Number(length); return read(Number(offset), Number(length)); } };
  // As a stream: file order, every checksum. In pieces, because a race does not fit into one buffer.
  const stream = new core.McapStreamReader({ validateCrcs: true, decompressHandlers });
  let appended = 0;
  const nextRecord = () => {
    for (;;) {
      const record = stream.nextRecord();
      if (record || appended === size) return record;
      const length = Math.min(16 << 20, size - appended);
      stream.append(read(appended, length));
      appended += length;
    }
  };
  const counts = new Map(), topics = new Map(), schemaOf = new Map(), decoders = new Map();
  let total = 0, dataEnd = false, attachments = 0;
  for (let record; (record = nextRecord()); ) {
    if (record.type === "Schema") schemaOf.set(record.id, record);
    if (record.type === "Channel") topics.set(record.id, record);
    if (record.type === "Attachment") ++attachments;
    if (record.type === "DataEnd") dataEnd = true;
    if (record.type !== "Message") continue;
    const channel = topics.get(record.channelId);
    if (!decoders.has(channel.id)) decoders.set(channel.id, decoding.decoderOf(schemaOf.get(channel.schemaId), channel.messageEncoding));
    try {
      decoders.get(channel.id)(record.data);
    } catch (error) {
      fail(`message ${total} on ${channel.topic}: ${error.message}`);
    }
    counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
    ++total;
  }
  if (!stream.done() || !dataEnd) fail("the stream does not end as it should");
  // With the index.
  const indexed = await core.McapIndexedReader.Initialize({ readable, decompressHandlers });
  let byIndex = 0, last = 0n;
  for await (const message of indexed.readMessages()) {
    if (message.logTime < last) fail("the index does not give the order of log times");
    last = message.logTime;
    ++byIndex;
  }
  if (byIndex !== total || Number(indexed.statistics.messageCount) !== total) fail(`${total} messages, ${byIndex} by the index`);
  let indexedAttachments = 0, frames = null;
  for await (const attachment of indexed.readAttachments()) {
    indexedAttachments += attachment.data.length > 0 ? 1 : 0;
    if (attachment.name === "frames") frames = JSON.parse(new TextDecoder().decode(attachment.data));
  }
  if (frames) await checkView(indexed, frames, counts, size, () => bytesRead);
  if (indexedAttachments !== attachments) fail("attachments differ");
  for (const topic of wanted)
    if (!counts.get(topic)) fail(`nothing on ${topic}`);
  console.log(`${total} messages on ${counts.size} topics, ${schemaOf.size} schemas, ${attachments} attachments: all decoded, ` +
              `${decoding.compared.size} Foxglove types as published`);
}

main().catch((error) => { fail(error.stack); });
