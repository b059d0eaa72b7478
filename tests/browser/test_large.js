// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A log of 4.6 GB, with offsets beyond 2^32: requests, bytes, memory; and the processor's time a frame. It has 2,200 frames; every 50th holds the
// real clouds and images, the others a few points, and holes in the file take the place of the rest.
"use strict";
const assert = require("assert");
const { execFileSync } = require("child_process");
const fs = require("fs");
const path = require("path");
const { kLong, open, settle, goto } = require("./support");
const { readLog, LogWriter } = require("./mcap_file");

const kFrames = 2200, kBytes = 4.6e9, kRealEvery = 50, kFrame_ns = 50000000n;

// A PointCloud message with its first points alone: field 6 (data) is the last one.
function shorten(data, points) {
  const bytes = Buffer.from(data.buffer, data.byteOffset, data.byteLength);
  for (let at = 0; at < bytes.length;) {
    const key = bytes[at], start = at++, varint = () => { let v = 0, s = 1, b;
        do { b = bytes[at++]; v += (b & 127) * s; s *= 128; } while (b > 127); return v; };
    if ((key & 7) === 2) {
      const length = varint();
      if (key >> 3 === 6) {
        const size = points * 32, head = [key];
        for (let v = size; ; v = Math.floor(v / 128)) { head.push(v > 127 ? v & 127 | 128 : v); if (v < 128) break; }
        return Buffer.concat([bytes.subarray(0, start), Buffer.from(head), bytes.subarray(at, at + size)]);
      }
      at += length;
    } else {
      at += (key & 7) === 1 ? 8 : (key & 7) === 5 ? 4 : 0;
      if ((key & 7) === 0) varint();
    }
  }
  throw new Error("no data");
}

async function makeLarge(from, file) {
  const { channels, messages, attachments } = await readLog(from, (t) => t < 1700000000170000000n),
      writer = new LogWriter(file, channels);
  const stamps = [...new Set(messages.map((m) => m.time))],
      of = (stamp, schema) => messages.filter((m) => m.time === stamp &&
      (schema ? channels.get(m.channel).schema === schema
      : !["foxglove.PointCloud", "foxglove.RawImage"].includes(channels.get(m.channel).schema)));
  const [first] = stamps, all = [];
  const small = of(first, "foxglove.PointCloud").map((m) => ({ ...m, data: shorten(m.data, 100) }));
  let numbers = [];
  for (let i = 0; i < kFrames; ++i) {
    const time = first + BigInt(i) * kFrame_ns, move = (m) => ({ ...m, time }), real = i % kRealEvery === 0,
        clouds = real ? of(first, "foxglove.PointCloud") : small;
    all.push(time);
    // The numbers of ten frames share a chunk.
    numbers.push(...of(i === 0 ? first : stamps[1]).map(move));
    if (i % 10 === 9) writer.chunk(numbers), numbers = [];
    writer.chunk(clouds.map(move));
    if (real) writer.chunk(of(first, "foxglove.RawImage").map(move));
    const missing = Math.floor(kBytes * (i + 1) / kFrames) - writer.offset;
    if (missing > 100) writer.hole(missing);
  }
  const record = JSON.parse(Buffer.from(attachments.get("frames")).toString()),
      repeat = (list) => all.map((_, i) => list[i % list.length]);
  for (const [key, value] of Object.entries(record))
    if (Array.isArray(value) && value.length === record.count) record[key] = repeat(value);
  for (const s of record.stages) s.us = repeat(s.us);
  Object.assign(record, { count: kFrames, stamp_ns: all.map(String) });
  writer.attach("frames", "application/json", JSON.stringify(record));
  writer.attach("config.toml", "application/toml", attachments.get("config.toml"));
  writer.close();
}

// Seconds of processor time of a process and its threads.
const cpuOf = (pid) => {
  const fields = fs.readFileSync(`/proc/${pid}/stat`, "utf8").replace(/^.*\) /, "").split(" ");
  return (Number(fields[11]) + Number(fields[12])) / 100;
};
const renderers = (browser) => {
  const children = execFileSync("ps", ["-eo", "pid,ppid,args"]).toString().split("\n").map(
      (l) => /^\s*(\d+)\s+(\d+)\s+(.*)$/.exec(l)).filter(Boolean);
  const family = new Set([browser.process().pid]);
  for (let grown = true; grown;) {
    grown = false;
    for (const [, pid, parent] of children)
      if (family.has(Number(parent)) && !family.has(Number(pid))) family.add(Number(pid)), grown = true;
  }
  const typed = (type) => children.filter(([, pid, , words]) => family.has(Number(pid)) &&
      words.includes(`--type=${type}`)).map(([, pid]) => Number(pid));
  return { page: typed("renderer"), gpu: typed("gpu-process") };
};

module.exports = {
  "large log: 4.6 GB open with 20 requests and 2 MB; many seeks; under 100 MB of heap":
  async ({ browser, logs, work, view }) => {
    const file = path.join(work, "large.mcap");
    if (!fs.existsSync(file)) await makeLarge(logs.b, file);
    const { size, blocks } = fs.statSync(file);
    assert.ok(size > 2 ** 32 + 1e8 && blocks * 512 < 6e8, `${size} bytes, ${blocks * 512} on disk`);
    const { page, errors } = await open(browser, (await view(file)).url, "images=front,range",
        { width: 800, height: 600 });
    const { opened } = await page.evaluate(() => overtake.app.logs[0].traffic);
    assert.ok(opened.requests <= 20 && opened.bytes <= 2e6, JSON.stringify(opened));
    assert.strictEqual(await page.evaluate(() => overtake.app.entries.length), kFrames);
    let seed = 5, read = 0;
    const random = () => (seed = seed * 16807 % 2147483647) % kFrames,
        heap = async () => (await page.metrics()).JSHeapUsedSize, client = await page.createCDPSession();
    const kept = async () => {  // what no collection of garbage frees
      await client.send("HeapProfiler.collectGarbage");
      return heap();
    };
    const seek = async (k) => {
      const before = await page.evaluate(() => overtake.app.logs[0].traffic);
      await goto(page, k);
      const shown = await page.evaluate(() => ({ index: overtake.app.logs[0].frame.index,
          points: overtake.app.logs[0].frame.clouds.reduce((s, c) => s + c.count, 0),
          ...overtake.app.logs[0].traffic }));
      assert.strictEqual(shown.index, k);
      assert.strictEqual(shown.points, k % kRealEvery === 0 ? 73486 : 300);
      assert.ok(shown.requests - before.requests <= 12, `${shown.requests - before.requests} requests`);
      read = Math.max(read, shown.bytes - before.bytes);
    };
    let highest = 0;
    const seekOften = async (times) => {
      for (let i = 0; i < times; ++i)
        await seek(i % 5 === 0 ? random() % (kFrames / kRealEvery) * kRealEvery : random()),
            highest = Math.max(highest, await heap());
      return kept();
    };
    const before = await seekOften(kLong ? 200 : 60), after = await seekOften(kLong ? 100 : 30);
    for (const k of [0, kFrames - 1, 1200, 1400, 2150]) await seek(k);  // offsets below and above 2^31 and 2^32
    assert.ok(highest < 100e6, `${highest} bytes of heap`);
    assert.ok(after < before * 1.1 + 1e6, `${before} bytes of heap kept after some seeks, ${after} after half as many more`);
    assert.ok(read < 8e6, `a seek reads ${read} bytes`);  // not compressed here
    const workers = await Promise.all(page.workers().map(async (w) => (await w.client.send(
        "Runtime.getHeapUsage")).usedSize));
    assert.ok(workers.length === 1 && workers[0] > 1e6 && workers[0] < 100e6, String(workers));
    assert.deepStrictEqual(errors, []);
    console.log(`  opened by ${opened.requests} requests and ${opened.bytes} bytes; heap ${(highest / 1e6).toFixed(
        0)} MB (kept ${(after / 1e6).toFixed(1)} MB), worker ${(workers[0] / 1e6).toFixed(0)} MB; a seek reads ${(read / 1e6).toFixed(1)} MB at most`);
    fs.unlinkSync(file);
  },

  "play: a shown frame takes under 0.3 s of processor time in the page": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none&speed=0.25",
        { width: 800, height: 600 });
    const { page: pages, gpu } = renderers(browser), sum = (pids) => pids.reduce((s, pid) => s + cpuOf(pid), 0);
    const before = { page: sum(pages), gpu: sum(gpu) };
    const shown = await page.evaluate(() => new Promise((done) => {
      const { app } = overtake, seen = new Set();
      app.on(["frame"], () => seen.add(app.logs[0].frame.index));
      app.play();
      setTimeout(() => { app.pause(); done(seen.size); }, 6000);
    }));
    const cost = { page: (sum(pages) - before.page) / shown, gpu: (sum(gpu) - before.gpu) / shown };
    assert.ok(shown > 3, `${shown} frames`);
    assert.ok(cost.page < 0.3, JSON.stringify(cost));
    console.log(`  ${shown} frames: ${cost.page.toFixed(3)} s of processor time a frame in the page, ${cost.gpu.toFixed(
        3)} s in SwiftShader`);
  },
};
