// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One frame: what is drawn is what the log and the result files hold.
"use strict";
const assert = require("assert");
const fs = require("fs");
const path = require("path");
const { open, goto } = require("./support");
const { readLog, writeLog } = require("./mcap_file");

// Rows of a CSV file as objects, grouped by stamp or frame.
function readCsv(file) {
  const [head, ...lines] = fs.readFileSync(file, "utf8").trim().split("\n").map((line) => line.split(","));
  return lines.map((values) => Object.fromEntries(head.map((name, i) => [name, values[i]])));
}

const state = (page) => page.evaluate(() => {
  const { app, view } = overtake, [log] = app.logs;
  return { stamp: String(log.frame.stamp), counts: view.scenes[0].counts,
      tracks: log.frame.tracks.map((t) => [t.id, t.state, t.x_m, t.y_m]),
           detections: log.frame.detections.map((d) => [d.x_m, d.y_m, d.points]),
               points: log.frame.clouds.reduce((s, c) => s + c.count, 0),
           header: document.querySelector(".facts").textContent,
               rows: [...document.querySelectorAll(".objects table")].map((t) => t.tBodies[0].rows.length) };
});

// Sets the layers and sensors that are drawn, and counts the pixels that are not background.
const lit = (page, on) => page.evaluate((layers) => {
  const { app, view } = overtake, all = ["map", "detections", "headings", "tracks", "covariance", "paths", "trails",
      "truth", "names", "rings", ...app.logs[0].info.sensors.map((s) => `sensor:${s}`)];
  app.state.off = new Set(all.filter((name) => !layers.includes(name)));
  view.update();
  const { pixels } = view.readPixels();
  let count = 0;
  for (let i = 0; i < pixels.length; i += 4)
    if (Math.abs(pixels[i] - 13) + Math.abs(pixels[i + 1] - 16) + Math.abs(pixels[i + 2] - 20) > 12) ++count;
  return count;
}, on);

module.exports = {
  "page: asks only its own server, with no error under its content policy": async ({ browser, logs, view }) => {
    const server = await view(logs.b), { page, errors, hosts, requests } = await open(browser, server.url);
    await goto(page, 20);
    assert.deepStrictEqual(errors, []);
    assert.deepStrictEqual([...hosts], [new URL(server.url).host]);
    const own = await page.evaluate(() => overtake.app.logs[0].traffic.requests);
    assert.strictEqual(requests.filter((r) => r.url.includes("/log/0")).length, own,
        "the browser and the page count the same requests");
    const icon = await page.evaluate(async () => (await fetch(document.querySelector("link[rel=icon]").href)).status);
    assert.strictEqual(icon, 200);
    assert.strictEqual(await page.title(), "b.mcap \u2013 overtake view");
  },

  "frame: points, detections and tracks are those of the log and of the CSV files": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url);
    const detections = readCsv(path.join(logs.resultsB, "detections.csv")),
        tracks = readCsv(path.join(logs.resultsB, "tracks.csv"));
    const timing = readCsv(path.join(logs.resultsB, "timing.csv"));
    const stamps = [...new Set(timing.map((r) => r.stamp_ns))];
    for (const k of [0, 7, 20, 39]) {
      await goto(page, k);
      const seen = await state(page), wantedTracks = tracks.filter((t) => t.stamp_ns === stamps[k]),
          wantedDetections = detections.filter((d) => Number(d.frame) === k);
      assert.strictEqual(seen.stamp, stamps[k]);
      assert.strictEqual(seen.counts.points, seen.points);
      assert.ok(seen.points > 60000);
      assert.deepStrictEqual(seen.tracks.map(([id, text]) => `${id} ${text}`).sort(),
          wantedTracks.map((t) => `${t.id} ${t.state}`).sort());
      for (const [id, , x, y] of seen.tracks) {
        const row = wantedTracks.find((t) => t.id === id);
        assert.ok(Math.hypot(x - row.x_m, y - row.y_m) < 1e-6);
      }
      assert.strictEqual(seen.counts.tracks, wantedTracks.length);
      assert.strictEqual(seen.counts.detections, wantedDetections.length);
      assert.deepStrictEqual(seen.detections.map((d) => d[2]), wantedDetections.map((d) => Number(d.points)));
      assert.deepStrictEqual(seen.rows, [wantedTracks.length, wantedDetections.length]);
      assert.ok(seen.header.includes(`frame ${k} of 40`) && seen.header.includes(stamps[k]), seen.header);
    }
  },

  "frame: points of 29 bytes in another order, as version 0.1 wrote them, are read": async (
      { browser, logs, work, view }) => {
    const file = path.join(work, "old.mcap"), log = await readLog(logs.b, (t) => t < 1700000000100000000n);
    const varint = (v) => { const out = []; for (; v > 127; v = Math.floor(v / 128)) out.push(v & 127 | 128);
        return [...out, v]; };
    const part = (field, bytes) => Buffer.concat([Buffer.from([field << 3 | 2, ...varint(bytes.length)]),
        Buffer.from(bytes)]);
    const fixed32 = (field, v) => { const b = Buffer.alloc(5); b[0] = field << 3 | 5; b.writeUInt32LE(v, 1); return b;
        };
    const layout = [["x", 0, 7], ["y", 4, 7], ["z", 8, 7], ["intensity", 12, 7], ["layer", 16, 6], ["label", 20, 6],
        ["cluster", 24, 6], ["reason", 28, 1]];
    const from = [0, 4, 8, 12, 24, 16, 20, 28];  // where each field is in the points of 32 bytes
    const first = log.messages[0].time, { page: now } = await open(browser, (await view(logs.b)).url, "images=none");
    const sums = (p) => p.evaluate(() => overtake.app.logs[0].frame.clouds.map((c) => [c.sensor, c.count,
        ...[c.position, ...Object.keys(c.fields).sort().map((n) => c.fields[n])].map(
            (f) => f.reduce((s, v) => s + v, 0))]));
    const wanted = await sums(now);
    writeLog(file, { ...log, messages: log.messages.filter((m) => m.time === first), attachments: new Map() },
        (all) => {
      for (const m of all.frames[0].messages) {
        const { schema, topic } = all.channels.get(m.channel);
        if (schema !== "foxglove.PointCloud") continue;
        const count = wanted.find(([sensor]) => topic === `/${sensor}/points`)[1], data = m.data.slice(-32 * count);
        const old = Buffer.alloc(29 * count);
        for (let i = 0; i < count; ++i)
          layout.forEach(([, offset, type], k) => {
            for (let b = 0; b < (type === 1 ? 1 : 4); ++b) old[29 * i + offset + b] = data[32 * i + from[k] + b];
          });
        const fields = layout.map(([name, offset, type]) =>
          part(5, Buffer.concat([part(1, Buffer.from(name)), fixed32(2, offset), Buffer.from([3 << 3, type])])));
        m.data = Buffer.concat([part(2, Buffer.from(topic.split("/")[1])), fixed32(4, 29), ...fields, part(6, old)]);
      }
      return all;
    });
    const { page } = await open(browser, (await view(file)).url, "images=none");
    assert.deepStrictEqual(await sums(page), wanted);
  },

  "frame: each layer and each sensor changes the picture": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url);
    await goto(page, 35);
    await page.waitForFunction(() => overtake.app.logs[0].history.size > 30);  // trails
    const changes = async (layers) => {
      const empty = await lit(page, []);
      for (const layer of layers) {
        const count = await lit(page, [layer]);
        assert.ok(count > empty + 5, `${layer} draws nothing: ${count} lit pixels, ${empty} without it`);
      }
    };
    await changes(["map", "rings", "sensor:front", "sensor:left", "sensor:right"]);
    assert.ok(await lit(page, ["sensor:front", "sensor:left", "sensor:right", "map"]) > 0.02 * 800 * 500);
    await page.evaluate(() => {  // behind the track
      const { app, view } = overtake;
      app.state.off.clear();
      view.update();
      const [x, y, z] = view.scenes[0].targets.find((t) => t.selection.kind === "track").center;
      view.cameraState = [x - 13, y - 1, z + 6, x, y, z, 1];
    });
    await changes(["detections", "headings", "tracks", "covariance", "paths", "trails", "truth"]);
    const names = () => page.evaluate(() => document.querySelectorAll(".label.track:not([hidden])").length);
    await lit(page, ["tracks", "names"]);
    const named = await names();
    await lit(page, ["tracks"]);
    assert.deepStrictEqual([named > 0, await names()], [true, 0]);
  },

  "camera: from above, what is ahead is up, and heights do not matter": async ({ browser, logs, view }) => {
    const { page, errors } = await open(browser, (await view(logs.b)).url, "images=none");
    await goto(page, 20);
    const inSpace = await lit(page, ["sensor:front", "sensor:left", "sensor:right"]);
    await page.click(".toolbar button[data-value=top]");
    await page.waitForFunction(() => overtake.app.state.view === "top" &&
        document.querySelector(".toolbar button[data-value=top]").classList.contains("on"));
    const seen = await page.evaluate(() => {
      const { view } = overtake, at = (...p) => view.project(0, p);
      return { low: at(20, 0, 0), high: at(20, 0, 5), ahead: at(30, 0, 0), left: at(20, 10, 0),
          height: view.root.clientHeight, width: view.root.clientWidth };
    });
    const scale = seen.height / 90, near = (got, wanted) => Math.hypot(got[0] - wanted[0], got[1] - wanted[1]) < 0.5;
    assert.ok(near(seen.low, seen.high), "a parallel view straight down");
    assert.ok(near(seen.ahead, [seen.low[0], seen.low[1] - 10 * scale]), JSON.stringify(seen));
    assert.ok(near(seen.left, [seen.low[0] - 10 * scale, seen.low[1]]), JSON.stringify(seen));
    assert.ok(Math.abs(seen.low[0] - seen.width / 2) < 1);
    const empty = await lit(page, []), above = await lit(page, ["sensor:front", "sensor:left", "sensor:right"]);
    assert.ok(above > empty + 2000 && above !== inSpace, `${above} lit pixels, ${empty} without points`);
    await page.click(".toolbar button[data-value='3d']");
    await page.waitForFunction(() => overtake.app.state.view === "3d");
    assert.ok(await page.evaluate(() => Math.abs(overtake.view.project(0, [20, 0, 0])[1]
        - overtake.view.project(0, [20, 0, 5])[1]) > 20));
    assert.deepStrictEqual(errors, []);
  },

  "camera: it stays on the map, or follows the vehicle": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none");
    // Where the vehicle, and a place on the map 30 m ahead of its first place, lie in the picture.
    const look = async (k, place) => {
      await goto(page, k);
      return page.evaluate((p) => {
        const { app, view } = overtake, { ego } = app.logs[0].frame, c = Math.cos(ego.yaw_rad), s = Math.sin(ego.yaw_rad);
        const [x, y] = p ?? [ego.x_m + 30 * c, ego.y_m + 30 * s], dx = x - ego.x_m, dy = y - ego.y_m;
        return { place: [x, y], vehicle: view.project(0, [5, 0, 0]),
            at: view.project(0, [dx * c + dy * s, dy * c - dx * s, 0]) };
      }, place);
    };
    const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    await page.click(".toolbar button[data-value=map]");
    await page.waitForFunction(() => overtake.app.state.follow === "map");
    const first = await look(20), later = await look(25, first.place);
    assert.ok(apart(first.at, later.at) < 0.5, `the map moves by ${apart(first.at, later.at)} pixels`);
    assert.ok(apart(first.vehicle, later.vehicle) > 20, "the vehicle stands still");
    await page.click(".toolbar button[data-value=vehicle]");
    await page.waitForFunction(() => overtake.app.state.follow === "vehicle");
    const followed = await look(20, first.place), after = await look(25, first.place);
    assert.ok(apart(followed.vehicle, after.vehicle) < 0.5 && apart(followed.at, after.at) > 20);
  },

  "frame: the corners of the boxes lie where a pinhole camera puts them, and are drawn there": async (
      { browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url);
    await goto(page, 30);
    const { boxes, camera, size, ratio } = await page.evaluate(() => {
      const { app, view } = overtake;
      app.state.off = new Set(["map", "detections", "headings", "covariance", "paths", "trails", "truth", "names",
          "rings", "sensor:front", "sensor:left", "sensor:right"]);
      view.update();
      const to = view.scenes[0].targets[0].center, from = [to[0] - 6, to[1] - 11, to[2] + 7];
      view.cameraState = [...from, ...to, 1];
      view.update();
      const boxes = view.scenes[0].targets.map((t) => ({ ...t,
          corners: [[1, 1, -1], [1, -1, -1], [-1, -1, 1], [-1, 1, 1]].map(([a, b, c]) => {
        const along = a * t.length_m / 2, across = b * t.width_m / 2, cos = Math.cos(t.heading_rad),
            sin = Math.sin(t.heading_rad);
        const place = (u, v) => [t.center[0] + cos * u - sin * v, t.center[1] + sin * u + cos * v,
            t.center[2] + 0.6 * c];
        const point = place(along, across);  // beyond: in line with the edges, outside of the box
        return { point, at: view.project(0, point),
            beyond: [place(along + 0.35 * a, across), place(along, across + 0.35 * b)] };
      }) }));
      return { boxes, camera: { from, to, fov: 55 }, size: [view.root.clientWidth, view.root.clientHeight],
          ratio: devicePixelRatio };
    });
    assert.ok(boxes.length > 0);
    const sub = (a, b) => a.map((v, i) => v - b[i]), dot = (a, b) => a.reduce((s, v, i) => s + v * b[i], 0);
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
        unit = (a) => a.map((v) => v / Math.hypot(...a));
    const ahead = unit(sub(camera.to, camera.from)), right = unit(cross(ahead, [0, 0, 1])), up = cross(right, ahead),
        focal = size[1] / 2 / Math.tan(camera.fov * Math.PI / 360);
    const { pixels, width } = await page.evaluate(() => { const { pixels, width } = overtake.view.readPixels();
        return { pixels: [...pixels], width }; });
    const pinhole = (point) => {
      const d = sub(point, camera.from), depth = dot(d, ahead);
      return [size[0] / 2 + focal * dot(d, right) / depth, size[1] / 2 - focal * dot(d, up) / depth];
    };
    const isGreen = ([x, y]) => {  // within two pixels
      for (let dy = -2; dy <= 2; ++dy)
        for (let dx = -2; dx <= 2; ++dx) {
          const i = 4 * ((Math.round(y * ratio) + dy) * width + Math.round(x * ratio) + dx);
          if (pixels[i + 1] > 90 && pixels[i + 1] > pixels[i] * 1.3) return true;
        }
      return false;
    };
    let outside = 0;
    for (const { corners } of boxes)
      for (const { point, at, beyond } of corners) {
        const wanted = pinhole(point);
        assert.ok(Math.hypot(wanted[0] - at[0], wanted[1] - at[1]) < 1, `${wanted} and ${at}`);
        assert.ok(isGreen(wanted), `no line at ${wanted}`);
        outside += beyond.filter((p) => isGreen(pinhole(p))).length;
      }
    // Another edge of the box may pass behind one of them.
    assert.ok(outside <= boxes.length, `${outside} lines go on beyond the corners of ${boxes.length} boxes`);
  },
};
