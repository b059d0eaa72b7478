// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A run that is under way: overtake run --live.
"use strict";
const assert = require("assert");
const net = require("net");
const path = require("path");
const { start, open, until } = require("./support");

const freePort = () => new Promise((done) => { const s = net.createServer().listen(0, "127.0.0.1",
    () => { const { port } = s.address(); s.close(() => done(port)); }); });

// Starts a run of the race at its own pace, or at another rate.
function startRun(overtake, logs, work, port, rate) {
  const child = start(overtake, ["run", logs.race, "--out", path.join(work, "live"), "--force", "--quiet",
    "--live", String(port), "--rate", String(rate)], "ignore");
  return { child, ended: new Promise((done) => child.once("exit", done)) };
}
async function openWhenUp(browser, url, fragment) {
  for (let i = 0; ; ++i) {
    try {
      return await open(browser, url, fragment, { settled: false });
    } catch (error) {
      if (i > 100) throw error;
      for (const page of (await browser.pages()).slice(1)) await page.close();
      await new Promise((done) => setTimeout(done, 50));
    }
  }
}

module.exports = {
  "live: two pages show the newest frames of a run, one opened at its start and one later; then they reconnect": async (
      { browser, overtake, logs, work }) => {
    const port = await freePort(), url = `http://127.0.0.1:${port}/`, run = startRun(overtake, logs, work, port, 0.05);
    const { page, errors } = await openWhenUp(browser, url, "images=front,range");
    await until(page, () => window.overtake?.app.logs[0].frame && overtake.view.scenes[0].counts.points > 60000);
    const look = (p) => p.evaluate(() => ({ stamp: Number(overtake.app.logs[
        0].frame.stamp - 1700000000000000000n) / 1e9, counts: overtake.view.scenes[0].counts,
        points: overtake.app.logs[0].frame.clouds.reduce((s, c) => s + c.count, 0),
        chip: document.querySelector(".chip.live")?.textContent, entries: overtake.app.entries.length }));
    const first = await look(page);
    assert.ok(first.points > 60000, `${first.points} points`);
    assert.strictEqual(first.chip, "live");
    await until(page, (t) => Number(overtake.app.logs[0].frame.stamp - 1700000000000000000n) / 1e9 > t + 0.2,
        first.stamp);
    await until(page, () => overtake.app.logs[0].frame.images.some((i) => i.name === "range"));
    await until(page, () => overtake.app.logs[0].info.map.length > 0);
    const other = await open(browser, url, "images=none", { settled: false });
    await until(other.page, () => window.overtake?.app.logs[0].frame);
    const later = await look(other.page);
    assert.ok(later.stamp > first.stamp && later.points > 60000);
    await until(other.page, () => overtake.app.logs[0].info.map.length > 0);
    // A pause holds the picture; going on shows the newest frame.
    await other.page.keyboard.press("Space");
    const paused = await look(other.page);
    await new Promise((done) => setTimeout(done, 600));
    assert.strictEqual((await look(other.page)).stamp, paused.stamp);
    await other.page.keyboard.press("Space");
    await until(other.page, (t) => Number(overtake.app.logs[0].frame.stamp - 1700000000000000000n) / 1e9 > t,
        paused.stamp);
    assert.deepStrictEqual(other.errors, []);
    await other.page.close();
    await page.bringToFront();
    run.child.kill("SIGINT");
    await run.ended;
    await until(page, () => overtake.app.faults.some((f) => f.kind === "gone"));
    // the browser's own lines
    assert.ok(errors.every((text) => text.includes("WebSocket") || text.includes("ERR_")), String(errors));
    // The page counts what came, and has the run's counters. The newest frame may come after the word that the run is
    // gone, and a frame's row comes in a message before its counts: the numbers and the text are read together.
    await page.evaluate(() => { overtake.app.state.tab = "log"; overtake.app.changed("settings", "frame"); });
    await until(page, () => { const { app } = overtake, [log] = app.logs;
        return log.received - log.dropped === app.entries.length &&
            document.querySelector(".log .hint")?.textContent === `${log.received} frames received, ${
            log.dropped} of them not drawn because newer ones had come`; });
    const told = await page.evaluate(() => { const [log] = overtake.app.logs;
        return { received: log.received, dropped: log.dropped, counters: log.frame.counters !== null }; });
    assert.ok(told.received > 3 && told.dropped >= 0 && told.counters, JSON.stringify(told));
    await page.evaluate(() => overtake.app.select({ log: 0, kind: "point", sensor: "front", point: 1 }));
    // Another run on the same port: nothing of the one before remains.
    const next = startRun(overtake, logs, work, port, 0.1);
    await until(page, (n) => overtake.app.faults.every((f) => f.kind !== "gone") &&
        overtake.app.logs[0].frame !== null && overtake.app.logs[0].received < n, told.received);
    const fresh = await page.evaluate(() => { const { app } = overtake, [log] = app.logs;
        return { sorted: app.entries.every((e, i, all) => i === 0 || e.stamp > all[i - 1].stamp),
        rows: app.entries.length, received: log.received, history: log.history.size,
        selection: app.state.selection, map: log.info.map.length }; });
    // One row may be there before the frame's number.
    assert.ok(fresh.sorted && fresh.rows <= fresh.received + 1 && fresh.history <= fresh.rows &&
        fresh.selection === null, JSON.stringify(fresh));
    await until(page, () => overtake.app.logs[0].info.map.length > 0);
    next.child.kill("SIGINT");
    await next.ended;
  },
};
