// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Seeking, playing, the marks on the time line, and the state in the address.
"use strict";
const assert = require("assert");
const path = require("path");
const { open, settle, goto, until } = require("./support");
const { readLog, writeLog } = require("./mcap_file");

const at = (page) => page.evaluate(() => ({ at: overtake.app.at, shown: overtake.app.logs[0].frame?.index,
    playing: overtake.app.playing }));

module.exports = {
  "time line: 100 random seeks end at the asked frame, also those asked faster than answered": async (
      { browser, logs, view }) => {
    const { page, errors } = await open(browser, (await view(logs.b)).url, "images=none&off=sensor:front,sensor:left",
        { width: 640, height: 480 });
    let seed = 1;
    const random = () => (seed = seed * 16807 % 2147483647) % 40;
    for (let i = 0; i < 50; ++i) {
      const k = random();
      await goto(page, k);
      assert.deepStrictEqual(await at(page), { at: k, shown: k, playing: false });
    }
    for (let i = 0; i < 10; ++i) {
      const asked = Array.from({ length: 5 }, random);
      await page.evaluate((list) => { for (const k of list) overtake.app.seek(k); }, asked);
      await settle(page);
      assert.strictEqual((await at(page)).shown, asked[4]);
    }
    for (const [asked, shown] of [[0, 0], [39, 39], [-5, 0], [1000, 39]]) {
      await goto(page, asked);
      assert.strictEqual((await at(page)).shown, shown);
    }
    for (const [stamp, shown] of [["1", 0], ["9000000000000000000", 39]]) {
      await page.evaluate((text) => overtake.app.gotoStamp(BigInt(text)), stamp);
      await settle(page);
      assert.strictEqual((await at(page)).shown, shown);
    }
    assert.deepStrictEqual(errors, []);
  },

  "time line: arrows step a frame, with shift a second; Home, End, click and drag": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none");
    const press = async (...keys) => {
      for (const key of keys.slice(0, -1)) await page.keyboard.down(key);
      await page.keyboard.press(keys[keys.length - 1]);
      for (const key of keys.slice(0, -1)) await page.keyboard.up(key);
      await settle(page);
      return (await at(page)).shown;
    };
    assert.strictEqual(await press("ArrowRight"), 1);
    assert.strictEqual(await press("ArrowRight"), 2);
    assert.strictEqual(await press("ArrowLeft"), 1);
    assert.strictEqual(await press("Shift", "ArrowRight"), 21);
    assert.strictEqual(await press("Shift", "ArrowLeft"), 1);
    assert.strictEqual(await press("End"), 39);
    assert.strictEqual(await press("Home"), 0);
    const box = await page.evaluate(() => { const { left, top, width } =
        document.querySelector(".area").getBoundingClientRect(); return { left, top, width }; });
    const xOf = (k) => box.left + k / 39 * (box.width - 1);
    await page.mouse.click(xOf(26), box.top + 30);
    await settle(page);
    assert.strictEqual((await at(page)).shown, 26);
    await page.mouse.move(xOf(5), box.top + 30);
    await page.mouse.down();
    await page.mouse.move(xOf(11), box.top + 30, { steps: 4 });
    await page.mouse.up();
    await settle(page);
    assert.strictEqual((await at(page)).shown, 11);
  },

  "time line: playing keeps real time, skips frames, pauses, obeys speed and loop": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none&speed=0.5");
    // Samples of the clock: wall time, stamp that is asked for, in s.
    const sample = (ms) => page.evaluate((duration) => new Promise((done) => {
      const { app } = overtake, list = [], begin = performance.now();
      const look = () => {
        list.push([(performance.now() - begin) / 1000, app.seconds(app.entry.stamp), app.logs[0].frame.index, app.at]);
        if (performance.now() - begin < duration) requestAnimationFrame(look);
        else done(list);
      };
      app.play();
      requestAnimationFrame(look);
    }), ms);
    for (const [speed, ms] of [[0.5, 1500], [1, 1200]]) {
      await page.evaluate((v) => { overtake.app.seek(0); overtake.app.setSpeed(v); }, speed);
      await settle(page);
      const samples = await sample(ms);
      await page.evaluate(() => overtake.app.pause());
      const [wall, clock] = samples[samples.length - 1];
      assert.ok(Math.abs(clock - wall * speed) < 0.05 * (1 + speed) + 0.06,
          `speed ${speed}: ${clock} s of the log in ${wall} s`);
      for (let i = 1; i < samples.length; ++i) assert.ok(samples[i][1] >= samples[i - 1][1]);
    }
    // Frames that take long are skipped, never queued: each one that comes is the newest that was asked for.
    await page.evaluate(() => overtake.app.pause());
    await goto(page, 0);
    const slow = await page.evaluate(() => new Promise((done) => {
      const { app } = overtake, [log] = app.logs, receive = log.receive.bind(log), shown = [];
      let waiting = 0, most = 0;
      log.receive = (message) => {
        if (message.type !== "frame") return receive(message);
        most = Math.max(most, ++waiting);
        setTimeout(() => { --waiting; receive(message); shown.push(log.frame.index); }, 300);
      };
      app.setSpeed(1);
      app.play();
      const look = () => {
        if (app.at < 30) return requestAnimationFrame(look);
        app.pause();
        const rest = setInterval(() => {
          if (!app.isSettled) return;
          clearInterval(rest);
          delete log.receive;
          done({ shown, most, last: app.at });
        }, 30);
      };
      look();
    }));
    assert.ok(slow.shown.length < 15 && slow.most === 1, JSON.stringify(slow));
    assert.ok(slow.shown.every((k, i, all) => i === 0 || k > all[i - 1]), JSON.stringify(slow));
    assert.strictEqual(slow.shown[slow.shown.length - 1], slow.last);
    await page.evaluate(() => overtake.app.pause());
    await settle(page);
    const paused = await at(page);
    await new Promise((done) => setTimeout(done, 200));
    assert.deepStrictEqual(await at(page), paused);
    assert.strictEqual(paused.playing, false);
    const loop = await page.evaluate(() => new Promise((done) => {
      const { app } = overtake, seen = new Set();
      app.state.loop = [app.entries[10].stamp, app.entries[14].stamp];
      app.setSpeed(0.25);
      app.seek(10);
      app.play();
      let turns = 0, before = 10;
      const look = () => {
        seen.add(app.at);
        if (app.at < before) ++turns;
        before = app.at;
        if (turns < 2) requestAnimationFrame(look);
        else { app.pause(); done([Math.min(...seen), Math.max(...seen)]); }
      };
      look();
    }));
    assert.ok(loop[0] === 10 && loop[1] >= 12 && loop[1] <= 14, String(loop));
    await page.keyboard.press("Space");
    assert.strictEqual((await at(page)).playing, true);
    await page.keyboard.press("Space");
    assert.strictEqual((await at(page)).playing, false);
  },

  "time line: frames with a missed deadline or lost scans are marked": async ({ browser, logs, work, view }) => {
    const file = path.join(work, "marked.mcap");
    writeLog(file, await readLog(logs.b), (log) => {
      const frames = JSON.parse(Buffer.from(log.attachments.get("frames")).toString());
      frames.deadline_us = 50000;
      frames.flags[5] = 512;
      frames.frame_us[9] = frames.latency_us[9] = 61000;
      frames.lost_scans[12] = 1;
      frames.flags[20] = 4;
      log.attachments.set("frames", JSON.stringify(frames));
      return log;
    });
    const { page } = await open(browser, (await view(file)).url, "images=none");
    assert.deepStrictEqual(await page.evaluate(() => overtake.timeline.marked), { missed: 2, lost: 2 });
    const colors = await page.evaluate(() => [5, 9, 12, 20, 30].map((k) => {
      const canvas = document.querySelector(".area canvas"), g = canvas.getContext("2d"), { app } = overtake;
      const x = Math.round(app.seconds(app.entries[k].stamp) / app.seconds(app.last) * (canvas.width - 1)) + 3;
      return [[...g.getImageData(x, 2, 1, 1).data.slice(0, 3)], [...g.getImageData(x, 8, 1, 1).data.slice(0, 3)]];
    }));
    const red = [255, 92, 92], amber = [255, 176, 32];
    assert.deepStrictEqual([colors[0][0], colors[1][0], colors[2][1], colors[3][1]], [red, red, amber, amber]);
    assert.ok(colors[4][0][0] < 100 && colors[4][1][0] < 100);
    await goto(page, 5);
    assert.strictEqual(await page.evaluate(() => document.querySelector(".chip.bad").textContent), "deadline missed");
    await goto(page, 12);
    assert.strictEqual(await page.evaluate(() => document.querySelector(".chip").textContent), "1 scan lost");
  },

  "time line: a paused live page keeps its frame, with entry and trails, while the first rows leave the table": async (
      { browser, logs, view }) => {
    const { page, errors } = await open(browser, (await view(logs.b)).url, "images=none");
    await goto(page, 30);
    await until(page, () => overtake.app.logs[0].history.size > 30 && overtake.app.changes.size === 0);
    const look = () => page.evaluate(() => { const { app, view } = overtake, [log] = app.logs;
        return { at: app.at, index: log.frame.index, shown: String(log.frame.stamp), entry: String(app.entry?.stamp),
        header: document.querySelector(".facts").textContent, trails: view.scenes[0].segmentsOf("trails"),
        tracks: view.scenes[0].counts.tracks, faults: app.faults.map((f) => f.text) }; });
    const before = await look();
    assert.ok(before.trails === 30 && before.tracks === 1 && before.faults.length === 0, JSON.stringify(before));
    // The messages of a live run whose table forgets rows: the table without them, then the history of a new frame.
    const forget = async (count) => {
      await page.evaluate((n) => {
        const { app } = overtake, [log] = app.logs, table = { ...log.table };
        app.live = true;
        for (const [key, values] of Object.entries(table)) if (ArrayBuffer.isView(values)) table[key] = values.slice(n);
        log.receive({ type: "table", table, complete: true, forgotten: n });
        log.receive({ type: "history", rows: [], share: 1 });
      }, count);
      await until(page, () => overtake.app.changes.size === 0);
      return look();
    };
    assert.deepStrictEqual(await forget(12), { ...before, at: 18, index: 18, trails: 18,
        header: before.header.replace("frame 30 of 40", "frame 18 of 28") });
    // The shown frame is among the next ones.
    assert.deepStrictEqual(await forget(20), { ...before, at: -1, index: -2, entry: "undefined", header: "",
        trails: 0 });
    assert.deepStrictEqual(errors, []);
  },

  "time line: the shown stamp's frame in the second log is read when that log's index reaches it": async (
      { browser, logs, view }) => {
    const { page, errors } = await open(browser, (await view(logs.a, logs.b)).url, "images=none");
    const tables = (frames) => page.evaluate((count) => {
      const [, log] = overtake.app.logs, table = window.whole ??= log.table;
      log.receive({ type: "table", table: { ...table, stamps: table.stamps.slice(0, count) }, complete: count === 40 });
    }, frames);
    const shown = async () => {
      await until(page, () => overtake.app.changes.size === 0 && overtake.app.logs.every((l) => !l.isBusy));
      return page.evaluate(() => ({ at: overtake.app.at, frames: overtake.app.logs.map((l) => l.frame?.index ?? null),
          none: [...document.querySelectorAll(".label.corner")].some((l) => !l.hidden &&
              l.textContent === "no frame of this log here") }));
    };
    await tables(8);
    await goto(page, 30);
    assert.deepStrictEqual(await shown(), { at: 30, frames: [30, null], none: true });
    await tables(24);
    assert.deepStrictEqual(await shown(), { at: 30, frames: [30, null], none: true });
    await tables(40);
    assert.deepStrictEqual(await shown(), { at: 30, frames: [30, 30], none: false });
    assert.deepStrictEqual(errors, []);
  },

  "address: it holds frame, camera, colour, layers, panels and selection, and brings them back": async (
      { browser, logs, view }) => {
    const { url } = await view(logs.b), { page } = await open(browser, url);
    await goto(page, 33);
    await page.evaluate(() => {
      const { app, view } = overtake;
      app.state.coloring = "height";
      app.state.pointSize = 3;
      app.state.tab = "latency";
      app.state.imageNames = ["labels", "range"];
      app.state.imageSensor = "left";
      app.state.loop = [app.entries[3].stamp, app.entries[8].stamp];
      app.toggleLayer("paths");
      app.toggleLayer("sensor:right");
      app.select({ log: 0, kind: "track", id: app.logs[0].frame.tracks[0].id });
      view.cameraState = [1, 2, 30, 40, 5, 6, 1];
      view.onCamera();
      app.changed("settings");
    });
    await page.waitForFunction(() => overtake.app.logs[0].frame.images.length === 2);
    await settle(page);
    const before = await page.evaluate(() => overtake.app.state.encode());
    await until(page, (fragment) => location.hash === `#${fragment}`, before);
    const text = await page.evaluate(() => location.hash);
    const read = (p) => p.evaluate(() => ({ hash: location.hash, shown: String(overtake.app.logs[0].frame.stamp),
        tab: document.querySelector(".tabs .on").textContent,
      camera: overtake.view.cameraState.map((v) => Math.round(v)), points: overtake.view.scenes[0].counts.points,
          coloring: overtake.view.scenes[0].coloring,
      images: overtake.app.logs[0].frame.images.map((i) => `${i.sensor} ${i.name}`),
          loop: overtake.app.state.loop.map(String), selected: overtake.app.state.selection.kind }));
    const here = await read(page), other = await open(browser, url, text.slice(1));
    await new Promise((done) => setTimeout(done, 500));  // a changed address would be written by then
    assert.deepStrictEqual(await read(other.page), here);
    assert.deepStrictEqual(here.camera, [1, 2, 30, 40, 5, 6, 1]);
    await page.bringToFront();
    const stamp = await page.evaluate(() => String(overtake.app.entries[17].stamp));
    await page.evaluate((s) => { location.hash = `#at=${s}&colour=range`; }, stamp);
    await until(page, () => overtake.app.logs[0].frame.index === 17 && overtake.view.scenes[0].coloring === "range");
    const fromServer = await open(browser, (await view(logs.b, "--at", stamp)).url);
    assert.strictEqual(await fromServer.page.evaluate(() => overtake.app.logs[0].frame.index), 17);
  },
};
