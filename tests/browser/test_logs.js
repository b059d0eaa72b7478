// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Two logs, logs of sensors alone, damaged logs, and a server that ends.
"use strict";
const assert = require("assert");
const fs = require("fs");
const path = require("path");
const { kLong, open, settle, goto, until, startView } = require("./support");
const { readLog, writeLog, damageChunks } = require("./mcap_file");

const faults = (page) => page.evaluate(() => overtake.app.faults.map((f) => `${f.kind}: ${f.text}`));
// Draws no points: for tests that look at no picture.
const kBare = "images=none&off=sensor:front,sensor:left,sensor:right",
    kSmall = { settled: false, width: 480, height: 360 };
const kPlaces = kLong ? 20 : 8;  // of damage
const rewrite = async (from, to, change) => writeLog(to, await readLog(from), change);
const json = (bytes) => JSON.parse(Buffer.from(bytes).toString());

module.exports = {
  "compare: frames pair by stamp, also where one log lacks some; unpaired ones say so": async (
      { browser, logs, work, view }) => {
    const file = path.join(work, "gaps.mcap"), lacks = [0, 7, 8, 39];
    await rewrite(logs.b, file, (log) => {
      const frames = json(log.attachments.get("frames")), keep = (list) => list.filter((_, i) => !lacks.includes(i));
      const gone = lacks.map((i) => BigInt(frames.stamp_ns[i]));
      for (const [key, value] of Object.entries(frames))
        if (Array.isArray(value) && value.length === frames.count) frames[key] = keep(value);
      for (const stage of frames.stages) stage.us = keep(stage.us);
      frames.count = frames.stamp_ns.length;
      log.attachments.set("frames", JSON.stringify(frames));
      return { ...log, frames: log.frames.filter((f) => !gone.includes(f.stamp)) };
    });
    const { page } = await open(browser, (await view(logs.b, file)).url, "tab=compare&images=none");
    assert.strictEqual(await page.evaluate(() => overtake.app.entries.length), 40);
    for (const k of [0, 6, 7, 8, 9, 38, 39]) {
      await goto(page, k);
      const seen = await page.evaluate(() => overtake.app.logs.map((l) => (l.frame ? String(l.frame.stamp) : null)));
      assert.ok(seen[0] !== null);
      assert.strictEqual(seen[1], lacks.includes(k) ? null : seen[0]);
    }
    assert.ok(await page.evaluate(() => [...document.querySelectorAll(".label.corner")].some((l) => !l.hidden &&
        l.textContent === "no frame of this log here")));
    assert.strictEqual(await page.evaluate(() => document.querySelector(".compare .hint").textContent),
        "36 frames in both logs, 4 in A only, 0 in B only");
    await goto(page, 5);
    await page.keyboard.press("n");  // the table tells
    await until(page, () => !overtake.app.searching && overtake.app.difference.startsWith("log B has no frame"));
    await settle(page);
    assert.strictEqual(await page.evaluate(() => overtake.app.at), 7);
  },

  "compare: the next difference finds a moved track that no count shows": async ({ browser, logs, work, view }) => {
    const file = path.join(work, "moved.mcap");
    await rewrite(logs.b, file, (log) => {
      const id = [...log.channels].find(([, c]) => c.topic === "/tracks/numbers")[0],
          message = log.frames[23].messages.find((m) => m.channel === id), tracks = json(message.data);
      tracks.tracks[0].x_m += 0.3;
      message.data = Buffer.from(JSON.stringify(tracks));
      return log;
    });
    const { page } = await open(browser, (await view(logs.b, file)).url, "tab=compare&images=none");
    await page.click(".compare .next");
    await until(page, () => !overtake.app.searching && overtake.app.at > 0);
    await settle(page);
    assert.strictEqual(await page.evaluate(() => overtake.app.at), 23);
    assert.match(await page.evaluate(() => document.querySelector(".found").textContent),
        /^track \d+:\d+ lies 0\.30 m apart$/);
    await page.click(".compare .next");
    await until(page, () => !overtake.app.searching);
    assert.strictEqual(await page.evaluate(() => overtake.app.difference), "no difference in the frames that follow");
  },

  "compare: side by side with one camera, or overlaid; differences of configuration, counts and times": async (
      { browser, logs, view }) => {
    const { page, errors } = await open(browser, (await view(logs.a, logs.b)).url, "tab=compare&images=none");
    await goto(page, 20);
    const look = () => page.evaluate(() => {
      const { app, view } = overtake, half = view.root.clientWidth / 2,
          at = [0, 1].map((i) => view.project(i, [20, 2, 0]));
      const { pixels, width, height } = view.readPixels(), lit = [0, 0];
      for (let y = 0; y < height; ++y)
        for (let x = 0; x < width; ++x) { const i = 4 * (y * width + x);
            if (pixels[i] + pixels[i + 1] + pixels[i + 2] > 70) ++lit[x < width / 2 ? 0 : 1]; }
      return { shift: [at[1][0] - at[0][0] - half, at[1][1] - at[0][1]], at: at[0], lit, layout: app.state.compare,
          dashed: view.scenes[1].segmentsOf("tracks"), points: view.scenes.map((s) => s.counts.points) };
    });
    const before = await look();
    assert.ok(Math.abs(before.shift[0]) < 1e-6 && Math.abs(before.shift[1]) < 1e-6, "both halves show the same place");
    assert.ok(before.lit[0] > 3000 && before.lit[1] > 3000, String(before.lit));
    const box = await page.evaluate(() => { const { left, top, width, height } =
        overtake.view.canvas.getBoundingClientRect(); return { x: left + width * 0.75, y: top + height * 0.6 }; });
    await page.mouse.move(box.x, box.y);  // drags in the right half
    await page.mouse.down();
    await page.mouse.move(box.x - 80, box.y + 20, { steps: 4 });
    await page.mouse.up();
    const after = await look();
    assert.ok(Math.hypot(after.at[0] - before.at[0], after.at[1] - before.at[1]) > 5, "the left half moves, too");
    assert.ok(Math.abs(after.shift[0]) < 1e-6 && Math.abs(after.shift[1]) < 1e-6);
    const tables = await page.evaluate(() => [...document.querySelectorAll(".compare table")].map(
        (t) => [...t.tBodies[0].rows].map((r) => [...r.cells].map((c) => c.textContent))));
    const config = Object.fromEntries(tables[2].map(([key, a, b]) => [key, [a, b]]));
    assert.deepStrictEqual(config.preset, ['"paper"', '"best"']);
    const counted = await page.evaluate(() => overtake.app.logs.map(
        (l) => l.table.detections.reduce((s, v) => s + v, 0)));
    assert.deepStrictEqual(tables[1].find((r) => r[0] === "detections").slice(1),
        [String(counted[0]), String(counted[1]), String(counted[1] - counted[0])]);
    assert.ok(tables[1].some((r) => r[0] === "frame p99, ms" && Number(r[1]) > 0 && Number(r[2]) > 0));
    await page.evaluate(() => { const made = [...document.querySelectorAll(".compare .choice button")].find(
        (b) => b.textContent === "overlaid"); made.click(); });
    await until(page, () => overtake.view.scenes[1].counts.points === 0);
    const overlaid = await look();
    assert.deepStrictEqual(overlaid.at, [overlaid.at[0], overlaid.at[1]]);
    assert.strictEqual(await page.evaluate(() => { const { view } = overtake,
        [a, b] = [0, 1].map((i) => view.project(i, [20, 2, 0])); return a[0] === b[0] && a[1] === b[1]; }), true);
    assert.ok(overlaid.dashed > before.dashed, "the lines of B are dashed");
    assert.deepStrictEqual(errors, []);
  },

  "sensors alone: race.mcap shows clouds and poses, and says what it lacks": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.race)).url);
    await goto(page, 20);
    const seen = await page.evaluate(() => { const { app, view } = overtake, { frame } = app.logs[0];
        return { counts: view.scenes[0].counts, ego: frame.ego, sensors: frame.clouds.map((c) => c.sensor),
        coloring: view.scenes[0].coloring, legend: document.querySelector(".legend b").textContent,
        images: document.querySelector(".images").hidden, truth: frame.truth.length,
        mounts: frame.clouds.map((c) => c.vehicleFromSensor[12]) }; });
    assert.ok(seen.counts.points > 60000 && seen.ego !== null);
    assert.deepStrictEqual(seen.sensors, ["front", "left", "right"]);
    assert.ok(seen.mounts.every((x) => x > 1), "sensors stand where /tf_static has them");
    assert.strictEqual(seen.coloring, "height");
    assert.strictEqual(seen.legend, "height: the log has no label");
    assert.ok(seen.truth > 0 && seen.images);
    assert.ok((await faults(page)).some((t) => t.includes("no labels, clusters, detections or tracks") &&
        t.includes("overtake run")));
    assert.ok(await page.evaluate(() => document.querySelector(".fault.notice").textContent.includes("overtake run")));
  },

  "schemas: a log without a known one says which it has; an unknown topic beside known ones is named": async (
      { browser, logs, work, view }) => {
    const other = path.join(work, "other.mcap"), some = path.join(work, "some.mcap");
    const log = await readLog(logs.b, (t) => t < 1700000000200000000n);
    writeLog(other, log, (l) => ({ ...l, channels: new Map([...l.channels].map(
        ([id, c]) => [id, { ...c, schema: `acme.Thing${id}` }])), attachments: new Map() }));
    const { page } = await open(browser, (await view(other)).url, "", { settled: false });
    await until(page, () => overtake.app.faults.length > 0);
    assert.match((await faults(page))[0], /^unknown: The page draws none of this log's schemas: .*acme\.Thing/);
    await until(page, () => document.querySelector(".fault.unknown") !== null);
    writeLog(some, log, (l) => { l.channels.set(99, { topic: "/radar", encoding: "json", schema: "acme.Radar",
        schemaEncoding: "jsonschema", schemaData: Buffer.from("{}") });
        l.frames[0].messages.push({ channel: 99, time: l.frames[0].stamp, data: "{}" }); return l; });
    const { page: second } = await open(browser, (await view(some)).url);
    assert.ok((await faults(second)).some((t) => t.includes("does not draw the topic /radar (acme.Radar)")));
  },

  "names: nothing of a log becomes HTML": async ({ browser, logs, work, view }) => {
    const file = path.join(work, "<img src=x onerror=hit()>.mcap"), evil = "<img src=x onerror='window.hit=1'><b>x</b>";
    await rewrite(logs.b, file, (log) => {
      for (const c of log.channels.values()) c.topic = c.topic.replace("/front/", `/${evil}/`);
      log.channels.set(98, { topic: `/${evil}`, encoding: "json", schema: evil, schemaEncoding: "jsonschema",
          schemaData: Buffer.from("{}") });
      log.frames[0].messages.push({ channel: 98, time: log.frames[0].stamp, data: "{}" });
      for (const { messages } of log.frames)
        for (const m of messages) {
          const { schema } = log.channels.get(m.channel);
          if (schema === "overtake.Tracks") { const v = json(m.data);
              for (const t of v.tracks)
            Object.assign(t, { visibility: evil, class: evil }); m.data = Buffer.from(JSON.stringify(v)); }
          if (schema === "overtake.Detections") { const v = json(m.data);
              for (const d of v.detections)
            Object.assign(d, { class: evil, heading_source: evil, [evil]: evil });
                m.data = Buffer.from(JSON.stringify(v)); }
          if (schema === "overtake.Truth") { const v = json(m.data); for (const c of v.cars) c.name = evil;
              m.data = Buffer.from(JSON.stringify(v)); }
          if (schema === "overtake.Counters") m.data = Buffer.from(JSON.stringify({ ...json(m.data), [evil]: 1 }));
        }
      const frames = json(log.attachments.get("frames"));
      frames.sensors[0] = evil;
      for (const s of frames.stages) s.stage = s.stage === "merge" ? evil : s.stage;
      log.attachments.set("frames", JSON.stringify(frames));
      log.attachments.set("config.toml", `[${evil}]\nname = "${evil}"\n`);
      return log;
    });
    const { page, errors } = await open(browser, (await view(logs.b, file)).url,
        `series=frame,${encodeURIComponent(evil)}`);
    await goto(page, 20);
    for (const tab of ["objects", "latency", "compare", "log"]) {
      await page.evaluate((t) => { overtake.app.state.tab = t; overtake.app.changed("settings"); }, tab);
      await settle(page);
      if (tab === "objects") await page.evaluate(() => overtake.app.select({ log: 1, kind: "detection", row: 0 }));
      // The names are shown as text.
      await until(page, () => document.body.innerText.includes("<img src=x"));
      assert.deepStrictEqual(await page.evaluate(() => [document.querySelectorAll("img").length,
          document.querySelectorAll("main b:not(.legend b)").length, window.hit ?? 0]), [0, 0, 0]);
    }
    assert.deepStrictEqual(errors, []);
  },

  "damage: a log cut at many places is usable up to the cut, or a sentence says why not": async (
      { browser, logs, work, overtake }) => {
    const whole = fs.readFileSync(logs.short), file = path.join(work, "cut.mcap");
    let shown = 0, told = 0;
    for (let i = 0; i < kPlaces; ++i) {
      const size = i === 0 ? 4 : i === 1 ? 30 : i === kPlaces - 1 ? whole.length - 3
          : Math.floor(whole.length * i / kPlaces);
      fs.writeFileSync(file, whole.subarray(0, size));
      let server;
      try {
        server = await startView(overtake, [file], "ignore");
      } catch {
        ++told;  // the command refuses a file that is no MCAP file
        continue;
      }
      const { page, errors } = await open(browser, server.url, kBare, kSmall);
      await until(page, () => window.overtake && (overtake.app.isSettled ||
          overtake.app.faults.some((f) => f.kind !== "notice")));
      const lines = await faults(page);
      assert.ok(lines.some((t) => t.startsWith("damaged: ")), `cut at ${size}: ${lines}`);
      if (!lines.some((t) => t.includes("nothing can be shown"))) {
        await settle(page);
        await until(page, () => overtake.app.logs[0].tableComplete);
        const frames = await page.evaluate(() => overtake.app.entries.length);
        assert.ok(frames > 0 && frames <= 10);
        await goto(page, Math.max(0, frames - 3));
        assert.ok(await page.evaluate(() => overtake.app.logs[0].frame !== null));
        ++shown;
      } else {
        ++told;
      }
      assert.deepStrictEqual(errors, []);
      await page.close();
      await server.stop();
    }
    assert.ok(shown >= kPlaces * 0.6 && told >= 1, `${shown} shown, ${told} told`);
  },

  "damage: a log without its index shows what the whole log shows, and says only what the log lacks": async (
      { browser, logs, work, view }) => {
    const cut = (from, name) => {
      fs.writeFileSync(path.join(work, name), fs.readFileSync(from).subarray(0, -3));
      return path.join(work, name);
    };
    const look = async (file) => {
      const { page, errors } = await open(browser, (await view(file)).url, "images=front,range");
      await until(page, () => overtake.app.logs[0].tableComplete && overtake.app.underWay.size === 0);
      await settle(page);
      const seen = await page.evaluate(() => { const { app, view } = overtake, [{ info, frame }] = app.logs;
          return { kind: info.kind, sensors: info.sensors, images: info.images, map: info.map.length,
          topics: info.topics.map((t) => t.topic), panel: !document.querySelector(".images").hidden, at: app.at,
          shown: frame.images.map((i) => `${i.sensor} ${i.name}`), counts: { ...view.scenes[0].counts, trails: 0 },
          mounts: frame.clouds.map((c) => c.vehicleFromSensor), ego: frame.ego }; });
      assert.deepStrictEqual(errors, []);
      const told = await faults(page);
      await page.close();
      return { seen, told };
    };
    const whole = await look(logs.b), without = await look(cut(logs.b, "no_index.mcap"));
    assert.ok(whole.seen.panel && whole.seen.map > 0 && whole.seen.shown.length === 1, JSON.stringify(whole.seen));
    assert.deepStrictEqual(without.seen, whole.seen);
    assert.deepStrictEqual(without.told.map((t) => t.slice(0, 34)), ["damaged: The log has no index: it "]);
    // What the log does lack is told at the end of the walk.
    const bare = path.join(work, "bare.mcap");
    await rewrite(logs.short, bare, (log) => {
      const lacks = (m) => { const { topic, schema } = log.channels.get(m.channel);
          return topic === "/map" || schema === "foxglove.RawImage"; };
      for (const f of log.frames) f.messages = f.messages.filter((m) => !lacks(m));
      for (const id of [...log.channels.keys()]) if (lacks({ channel: id })) log.channels.delete(id);
      return log;
    });
    const { told } = await look(cut(bare, "no_index.mcap"));
    assert.deepStrictEqual(told.slice(1), ["notice: The log has no images (`--mcap-images none`).",
        "notice: The log has no map."]);
  },

  "damage: a flipped byte in each of many places is told, and the rest is shown": async (
      { browser, logs, work, view }) => {
    const whole = fs.readFileSync(logs.short), file = path.join(work, "flipped.mcap");
    for (let i = 0; i < kPlaces; ++i) {
      const bytes = Buffer.from(whole), at = Math.floor(whole.length * (i + 0.5) / kPlaces);
      bytes[at] ^= 0x55;
      fs.writeFileSync(file, bytes);
      const { page: flipped, errors } = await open(browser, (await view(file)).url,
          kBare.replace("none", "front,range"), kSmall);
      await until(flipped, () => window.overtake && (overtake.app.isSettled ||
          overtake.app.faults.some((f) => f.kind !== "notice")));
      // The chunk with the byte is read when a frame in it is shown.
      const told = () => flipped.evaluate(() => overtake.app.faults.some((f) => f.kind === "damaged"));
      for (let k = 0; k < 10 && !await told(); ++k) {
        await flipped.evaluate((n) => overtake.app.seek(n), k);
        await until(flipped, () => overtake.app.logs.every((l) => !l.isBusy));
      }
      await until(flipped, () => overtake.app.faults.some((f) => f.kind === "damaged")).catch(() => {
        throw new Error(`nothing told of byte ${at} of ${whole.length}`);
      });
      assert.deepStrictEqual(errors, []);
      await flipped.close();
    }
  },

  "damage: a chunk of the map, of the sensors' transforms or of clouds hides nothing but itself": async (
      { browser, logs, work, view }) => {
    const file = path.join(work, "damaged.mcap"), log = await readLog(logs.b),
        chunksOf = (chunks, topic) => {
          const id = [...log.channels].find(([, c]) => c.topic === topic)[0];
          return chunks.filter((c) => c.offsets.has(id));
        };
    let chunks = writeLog(file, await readLog(logs.b));
    assert.strictEqual(chunksOf(chunks, "/map").length, 1);
    damageChunks(file, [chunksOf(chunks, "/map")[0], chunksOf(chunks, "/front/points")[5]]);
    const { page, errors } = await open(browser, (await view(file)).url, "images=none");
    const look = () => page.evaluate(() => ({ index: overtake.app.logs[0].frame.index,
        ...overtake.view.scenes[0].counts, map: overtake.app.logs[0].info.map.length }));
    const before = await look();  // the map's chunk holds the first frame's numbers, too
    assert.ok(before.index === 0 && before.points > 60000 && before.tracks === 0 && before.map === 0,
        JSON.stringify(before));
    await goto(page, 5);
    const without = await look();
    assert.ok(without.points === 0 && without.detections > 0, JSON.stringify(without));
    await goto(page, 6);
    const whole = await look();
    assert.ok(whole.points > 60000 && whole.detections > 0, JSON.stringify(whole));
    const told = await faults(page);
    for (const text of ["damaged: The map in the log cannot be read: it is not drawn.",
        "damaged: A part of the log is damaged: a chunk does not unpack. Frames in it lack "
            + "/front/points, /left/points, /right/points."])
      assert.ok(told.includes(text), `${text}: ${told.join(" | ")}`);
    assert.deepStrictEqual(errors, []);

    const race = await readLog(logs.race, (t) => t < 1700000000300000000n);
    log.channels = race.channels;
    const statics = [...race.channels].find(([, c]) => c.topic === "/tf_static")[0];
    const rest = race.messages.filter((m) => m.channel !== statics), [first] = race.messages;
    // The transforms in a chunk of their own.
    chunks = writeLog(file, { ...race, messages: [...race.messages.filter((m) => m.channel === statics).map(
        (m) => ({ ...m, time: first.time - 1n })), ...rest] });
    const [own] = chunksOf(chunks, "/tf_static");
    assert.strictEqual(own.offsets.size, 1);
    damageChunks(file, [own]);
    const { page: sensors } = await open(browser, (await view(file)).url, "images=none");
    await goto(sensors, 2);
    assert.ok(await sensors.evaluate(() => overtake.view.scenes[0].counts.points > 60000));
    assert.ok((await faults(sensors)).some((t) => t.startsWith("damaged: The transforms on /tf_static cannot be read")));
  },

  "odd content: ids that are no numbers, holes in lists and images without pixels are left out with a sentence": async (
      { browser, logs, work, view }) => {
    const file = path.join(work, "odd.mcap");
    let tracks = 0, detections = 0;
    await rewrite(logs.b, file, (log) => {
      for (const m of log.frames[20].messages) {
        const { schema, topic } = log.channels.get(m.channel);
        const edit = (change) => { const v = json(m.data); change(v); m.data = Buffer.from(JSON.stringify(v)); };
        if (schema === "overtake.Tracks") edit((v) => {
          tracks = v.tracks.length;
          v.tracks.push(null, 7, { ...v.tracks[0], id: "x" }, { ...v.tracks[0], id: 1.5 },
              { ...v.tracks[0], path: { x_m: 5 } });
        });
        if (schema === "overtake.Detections") edit((v) => {
          detections = v.detections.length;
          v.detections.push({ ...v.detections[0], track: "none" });
        });
        if (schema === "overtake.Truth") edit((v) => { v.cars = [null]; });
        if (schema === "overtake.Times") edit((v) => { v.stages.push("junk"); });
        if (topic === "/front/image/range") m.data = Buffer.concat([Buffer.from([0x22, 5]), Buffer.from("32FC1")]);
        if (topic === "/left/points")  // fields that lie outside of the points: no offset fits a stride of 1
          m.data = Buffer.concat([Buffer.from([0x25, 1, 0, 0, 0, 0x2a, 10, 0x0a, 1, 120, 0x15, 9, 0, 0, 0, 0x18, 7,
              0x32, 3, 1, 2, 3])]);
      }
      return log;
    });
    const { page, errors } = await open(browser, (await view(file)).url, "images=front,range,labels");
    await goto(page, 20);
    const seen = await page.evaluate(() => ({ tracks: overtake.app.logs[0].frame.tracks.length,
        rows: [...document.querySelectorAll(".objects table")].map((t) => t.tBodies[0].rows.length),
        images: overtake.app.logs[0].frame.images.map((i) => i.name), ...overtake.view.scenes[0].counts }));
    assert.ok(tracks > 0 && detections > 0);
    assert.deepStrictEqual([seen.tracks, seen.detections, seen.rows, seen.images],
        [tracks, detections, [tracks, detections], ["labels"]]);
    assert.ok(seen.points > 30000, "the other sensors' points are shown");
    const told = await faults(page);
    for (const text of [...["tracks", "detections", "cars", "stages"].map(
        (name) => `A frame has ${name} that cannot be read: they are not shown.`),
        "A message on /front/image/range cannot be read: it has no pixels.",
        "The points of left cannot be read: the field x lies outside of a point."])
      assert.ok(told.includes(`notice: ${text}`), `${text}: ${told.join(" | ")}`);
    assert.ok(!told.some((t) => t.includes("cannot be drawn")), told.join(" | "));
    await goto(page, 21);
    assert.ok(await page.evaluate(() => overtake.app.logs[0].frame.images.length === 2));
    assert.deepStrictEqual(errors, []);
  },

  "odd content: a log that claims a million frames of two centuries, and a path to the moon, are drawn": async (
      { browser, logs, work, view }) => {
    const claims = path.join(work, "claims.mcap"), far = path.join(work, "far.mcap"), count = 1000000;
    await rewrite(logs.short, claims, (log) => {
      const first = log.frames[0].stamp, frames = { version: 1, count, lost_scans: new Array(count).fill(1),
          stamp_ns: Array.from({ length: count }, (_, i) => String(first + BigInt(i) * 7000000000000n)) };
      log.attachments.set("frames", JSON.stringify(frames));
      return log;
    });
    const { page, errors } = await open(browser, (await view(claims)).url, kBare);
    const seen = await page.evaluate(() => ({ entries: overtake.app.entries.length, ...overtake.timeline.marked,
        ...overtake.timeline.drawn, width: document.querySelector(".area").clientWidth,
        points: overtake.app.logs[0].frame.clouds.length }));
    assert.deepStrictEqual([seen.entries, seen.lost, seen.points], [count, count, 3]);
    assert.ok(seen.bars > seen.width && seen.bars <= 2 * (seen.width + 1), `${seen.bars} rectangles`);
    assert.ok(seen.labels > 1 && seen.labels < seen.width / 70 + 2, `${seen.labels} labels`);
    assert.deepStrictEqual(errors, []);
    await page.close();
    await rewrite(logs.b, far, (log) => {
      for (const m of log.frames.flatMap((f) => f.messages))
        if (log.channels.get(m.channel).schema === "overtake.Tracks") {
          const v = json(m.data);
          for (const t of v.tracks) t.path.x_m[3] = 384e6;
          m.data = Buffer.from(JSON.stringify(v));
        }
      return log;
    });
    const { page: overlaid } = await open(browser, (await view(logs.b, far)).url, `${kBare}&compare=overlay`);
    await goto(overlaid, 39);
    const paths = await overlaid.evaluate(() => ({ drawn: overtake.view.scenes[1].counts.paths,
        segments: overtake.view.scenes[1].segmentsOf("paths") }));
    assert.ok(paths.drawn > 0 && paths.segments > 500 && paths.segments < 10000 * paths.drawn, JSON.stringify(paths));
  },

  "damage: a log without summary, without the frames record, and with a broken one": async (
      { browser, logs, work, view }) => {
    const plain = path.join(work, "plain.mcap"), broken = path.join(work, "broken.mcap");
    await rewrite(logs.b, plain, (log) => { log.attachments.delete("frames"); return log; });
    const { page } = await open(browser, (await view(plain)).url, "images=none&tab=latency");
    await until(page, () => overtake.app.logs[0].tableComplete && overtake.app.underWay.size === 0 &&
        overtake.latency.plot.values[1]?.filter((v) => v !== null).length === 40);
    const table = await page.evaluate(() => { const { table } = overtake.app.logs[0];
        return { frames: table.stamps.length, detections: [...table.detections], tracks: [...table.tracks],
        us: [...table.frame_us] }; });
    const record = json((await readLog(logs.b, () => false)).attachments.get("frames"));
    assert.strictEqual(table.frames, 40);
    assert.deepStrictEqual([table.detections, table.tracks], [record.detections, record.tracks]);
    table.us.forEach((us, i) => assert.ok(Math.abs(us - record.frame_us[i]) < 0.6));
    await rewrite(logs.b, broken, (log) => { log.attachments.set("frames", "{\"stamp_ns\": ["); return log; });
    const { page: second } = await open(browser, (await view(broken)).url, "images=none");
    assert.ok((await faults(second)).some((t) => t.startsWith("damaged: The attachment `frames` cannot be read")));
    await until(second, () => overtake.app.logs[0].tableComplete);  // a seek goes to a frame that is known
    await goto(second, 12);
    assert.strictEqual(await second.evaluate(() => overtake.app.logs[0].frame.index), 12);
  },

  "faults: a log that changes while it is open is never mixed with the old one": async (
      { browser, logs, work, view }) => {
    const file = path.join(work, "changing.mcap");
    fs.copyFileSync(logs.b, file);
    const { page } = await open(browser, (await view(file)).url, kBare);
    fs.copyFileSync(logs.a, file);
    await page.evaluate(() => overtake.app.seek(30));
    await until(page, () => overtake.app.faults.some((f) => f.kind === "changed"));
    assert.match((await faults(page))[0], /The log changed while it was open.*Reload the page/);
    await until(page, () => document.querySelector(".fault.changed") !== null);
    assert.strictEqual(await page.evaluate(() => overtake.app.logs[0].frame), null);
  },

  "faults: a server that ends is asked again until it answers": async ({ browser, logs, overtake }) => {
    const server = await startView(overtake, [logs.b]), port = new URL(server.url).port,
        { page } = await open(browser, server.url, kBare);
    await server.stop();
    await page.evaluate(() => overtake.app.seek(25));
    await until(page, () => overtake.app.faults.some((f) => f.kind === "gone"));
    await until(page, () => document.querySelector(".fault.gone")?.textContent.includes("does not answer"));
    const again = await startView(overtake, [logs.b, "--port", port]);
    await until(page, () => overtake.app.logs[0].frame.index === 25 &&
        overtake.app.faults.every((f) => f.kind !== "gone"));
    await again.stop();
  },

  "faults: without WebGL2, a sentence": async ({ browser, logs, view }) => {
    const page = await browser.newPage();
    await page.evaluateOnNewDocument(() => { HTMLCanvasElement.prototype.getContext = () => null; });
    await page.goto((await view(logs.b)).url);
    await until(page, () => document.querySelector(".stop p")?.textContent.includes("WebGL2"));
  },
};
