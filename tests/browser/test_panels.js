// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Images and their link with the 3-D view, tables, selection, plots.
"use strict";
const assert = require("assert");
const { execFileSync } = require("child_process");
const fs = require("fs");
const path = require("path");
const { open, settle, goto, until } = require("./support");
const { readLog, writeLog } = require("./mcap_file");

// A NumPy file of float32, int32 or bytes: { rows, cols, values }.
function readNpy(file) {
  const bytes = fs.readFileSync(file), length = bytes.readUInt16LE(8), head = bytes.toString("latin1", 10, 10 + length);
  const [rows, cols] = /\((\d+), (\d+)\)/.exec(head).slice(1).map(Number), body = bytes.subarray(10 + length),
      type = /'descr': '([^']+)'/.exec(head)[1];
  const get = { "<f4": (i) => body.readFloatLE(4 * i), "<i4": (i) => body.readInt32LE(4 * i), "|u1": (i) => body[i],
      "|b1": (i) => body[i] }[type];
  return { rows, cols, at: (r, c) => get(r * cols + c) };
}

const csv = (file) => {
  const [head, ...lines] = fs.readFileSync(file, "utf8").trim().split("\n").map((line) => line.split(","));
  return lines.map((values) => Object.fromEntries(head.map((name, i) => [name, values[i]])));
};

module.exports = {
  "images: the values under the pointer are those of inspect's NPY files": async (
      { browser, logs, overtake, work, view }) => {
    const out = path.join(work, "inspect");
    execFileSync(overtake, ["inspect", logs.race, "--preset", "paper", "--frame", "20", "--sensor", "left", "--out",
        out, "--quiet", "--force"]);
    const files = fs.readdirSync(out), names = ["range", "angle_smooth", "range_repaired", "nonground", "labels"];
    const { page } = await open(browser, (await view(logs.a)).url, `images=left,${names.join(",")}`, { height: 1400 });
    await goto(page, 20);
    const compared = {};
    for (const [strip, name] of names.entries()) {
      const file = files.find((f) => f === `${name}.npy` || f.endsWith(`_${name}.npy`));
      assert.ok(file, `${name} in ${files}`);
      const npy = readNpy(path.join(out, file));
      const box = await page.evaluate((i) => { const c = document.querySelectorAll(".strip canvas")[i];
          c.scrollIntoView(); const { left, top, width, height } = c.getBoundingClientRect();
          return { left, top, width, height, rows: c.height, cols: c.width }; }, strip);
      assert.deepStrictEqual([box.rows, box.cols, box.height], [npy.rows, npy.cols, npy.rows * 6]);
      for (const [r, c] of [[0, 0], [5, 100], [10, 400], [16, 428], [20, 700], [30, 856]]) {
        await page.mouse.move(box.left + (c + 0.5) / npy.cols * box.width, box.top + (r + 0.5) / npy.rows * box.height);
        const shown = await page.evaluate((i, row, col) => (
            { ...overtake.images.valueAt(i, row, col),
            line: document.querySelectorAll(".strip .value")[i].textContent }), strip, r, c);
        assert.ok(shown.line.startsWith(`row ${r}  col ${c}:  ${shown.text}`),
            `${name} ${r} ${c}: ${JSON.stringify(shown)} ${JSON.stringify(box)}`);
        const value = npy.at(r, c);
        if (name === "range" || name === "range_repaired")
          assert.strictEqual(shown.text, value > 0 ? `${value.toFixed(3)} m` : "no return");
        else if (name === "angle_smooth")
          assert.strictEqual(shown.text, value < 0 ? "undefined" : `${(value * 180 / Math.PI).toFixed(2)} \u00b0`);
        else if (name === "nonground") assert.strictEqual(shown.text === "not ground", value > 0);
        else assert.strictEqual(shown.text, `rgb ${(await page.evaluate((l) => overtake.labelColor(l), value)).join(
            " ")}`);
        compared[name] = (compared[name] ?? 0) + 1;
      }
    }
    assert.deepStrictEqual(Object.values(compared), [6, 6, 6, 6, 6]);
  },

  "images: the height image has the log's values, and no colour where no beam returned": async (
      { browser, logs, view }) => {
    const { channels, messages } = await readLog(logs.b), times = [...new Set(messages.map((m) => m.time))],
        { page } = await open(browser, (await view(logs.b)).url, "images=left,height");
    const read = (name) => {  // the pixels are the field before the last one, the frame of reference
      const { data } = messages.find((m) => m.time === times[20] &&
          channels.get(m.channel).topic === `/left/image/${name}`);
      const view = new DataView(data.buffer, data.byteOffset + data.length - 6 - 4 * 32 * 857);
      return { rows: 32, cols: 857, at: (r, c) => view.getFloat32(4 * (857 * r + c), true) };
    };
    const height = read("height"), range = read("range");
    await goto(page, 20);
    const shown = await page.evaluate(() => {
      const { images, app } = overtake, image = app.logs[0].frame.images.find((i) => i.name === "height"),
          canvas = document.querySelector(".strip canvas"),
          pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data, out = [];
      for (let row = 0; row < image.rows; ++row)
        for (let col = row % 7; col < image.cols; col += 7)
          out.push([row, col, images.valueAt(0, row, col).text,
              [...pixels.subarray(4 * (row * image.cols + col), 4 * (row * image.cols + col) + 3)]]);
      return { out, size: [image.rows, image.cols], scale: document.querySelector(".strip .scale").textContent };
    });
    assert.deepStrictEqual(shown.size, [height.rows, height.cols]);
    assert.ok(shown.scale.includes("2.0 m over the road"), shown.scale);
    let lit = 0;
    const brightness = new Map();
    for (const [row, col, text, color] of shown.out) {
      const value = height.at(row, col);
      assert.strictEqual(text, Number.isFinite(value) ? `${value.toFixed(3)} m` : "\u2013");
      if (!(range.at(row, col) > 0)) {
        assert.deepStrictEqual(color, [0, 0, 0]);
        continue;
      }
      ++lit;
      if (value < -0.45 || value > 1.9) brightness.set(value < 0 ? "low" : "high", color.reduce((a, b) => a + b, 0));
    }
    assert.ok(lit > 1000, `${lit} pixels`);
    assert.ok(!brightness.has("low") || brightness.get("high") > brightness.get("low"));
  },

  "latency: the deadline is a line in the plot, at its value": async ({ browser, logs, work, view }) => {
    const file = path.join(work, "deadline.mcap"), record = JSON.parse(Buffer.from((await readLog(logs.b)).attachments.get(
        "frames")).toString());
    const [least, most] = [Math.min, Math.max].map((pick) => pick(...record.frame_us)),
        deadline_us = Math.round((least + most) / 2);
    writeLog(file, await readLog(logs.b), (log) => {
      log.attachments.set("frames", JSON.stringify({ ...record, deadline_us }));
      return log;
    });
    const red = async (log) => {
      const { page } = await open(browser, (await view(log)).url, "tab=latency&images=none");
      return page.evaluate((ms) => {
        const { plot } = overtake.latency.plot, canvas = document.querySelector(".latency .uplot canvas"),
            y = Math.round(plot.valToPos(ms, "y", true)), { left, width } = plot.bbox;
        let found = 0;
        for (let dy = -1; dy <= 1; ++dy) {
          const line = canvas.getContext("2d").getImageData(left, y + dy, width, 1).data;
          let count = 0;
          for (let i = 0; i < line.length; i += 4) if (line[i] > 120 && line[i] > 1.6 * line[i + 2]) ++count;
          found = Math.max(found, count / width);
        }
        return { found, head: document.querySelector(".latency h3").textContent };
      }, deadline_us / 1000);
    };
    const drawn = await red(file), without = await red(logs.b);
    assert.ok(drawn.found > 0.8, JSON.stringify(drawn));
    assert.ok(drawn.head.includes(`deadline ${(deadline_us / 1000).toFixed(1)}`), drawn.head);
    assert.ok(without.found < 0.1 && !without.head.includes("deadline"), JSON.stringify(without));
  },

  "images: a pixel marks its point in the 3-D view, and a point its pixel": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=front,range", { height: 1000 });
    await goto(page, 20);
    const box = await page.evaluate(() => { const c = document.querySelector(".strip canvas"),
        { left, top, width, height } = c.getBoundingClientRect();
        return { left, top, width, height, rows: c.height, cols: c.width }; });
    // A pixel with a return, in the middle.
    const pixel = await page.evaluate(() => {
      const { app } = overtake, image = app.logs[0].frame.images.find((i) => i.name === "range");
      for (let row = 20; row < image.rows; ++row)
        for (let col = 400; col < image.cols; ++col)
          if (image.values[row * image.cols + col] > 0)
            return { row, col, range: image.values[row * image.cols + col] };
      return null;
    });
    await page.mouse.move(box.left + (pixel.col + 0.5) / box.cols * box.width,
        box.top + (pixel.row + 0.5) / box.rows * box.height);
    await until(page, () => overtake.app.hover !== null);
    const linked = await page.evaluate(() => {
      const { app, view } = overtake, p = app.hover,
          cloud = app.logs[0].frame.clouds.find((c) => c.sensor === p.sensor),
          [x, y, z] = cloud.position.subarray(3 * p.point, 3 * p.point + 3);
      return { range: Math.hypot(x, y, z), azimuth: Math.atan2(y, x), marked: view.scenes[0].marked,
          position: view.pointPosition(p), at: view.project(0, view.pointPosition(p)), ...p };
    });
    assert.ok(Math.abs(linked.range - pixel.range) < 1e-4);
    assert.ok(Math.abs((60 - linked.azimuth * 180 / Math.PI) / 120 * box.cols - pixel.col - 0.5) <= 0.51);
    assert.ok(Math.hypot(...linked.marked.map((v, i) => v - linked.position[i])) < 1e-3,
        "the marker is drawn at the point");
    // And back: points of the view mark the pixel that holds their range.
    const back = await page.evaluate(() => {
      const { app, images } = overtake, [log] = app.logs, link = images.linkOf(log),
          image = log.frame.images.find((i) => i.name === "range");
      const cloud = log.frame.clouds.find((c) => c.sensor === "front");
      let linked = 0, both = 0, wrong = 0;
      for (let i = 0; i < cloud.count; i += 97) {
        const pixel = link.pixelOf(i);
        if (!pixel) continue;
        ++linked;
        const range = Math.hypot(...cloud.position.subarray(3 * i, 3 * i + 3));
        if (Math.abs(image.values[pixel.row * image.cols + pixel.col] - range) > 1e-4) ++wrong;
        if (link.pointOf(pixel.row, pixel.col) === i) ++both;
      }
      return { linked, both, wrong };
    });
    assert.ok(back.linked > 100 && back.wrong === 0 && back.both === back.linked, JSON.stringify(back));
    const at = await page.evaluate((p) => { const { left, top } = overtake.view.canvas.getBoundingClientRect(),
        [x, y] = overtake.view.project(0, overtake.view.pointPosition(p)); return [left + x, top + y]; }, linked);
    await page.mouse.move(0, 0);
    await until(page, () => overtake.app.hover === null);
    await page.mouse.move(...at);
    await until(page, () => overtake.app.hover !== null);
    await until(page, () => !document.querySelector(".strip .cross").hidden);
    assert.match(await page.evaluate(() => document.querySelector(".strip .value").textContent),
        /^row \d+  col \d+:.*point \d+, label/);
  },

  "colours: 50 labels have the colours of the binary's images, in the table and in the pixels": async (
      { browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.a)).url, "images=front,labels,range&size=6");
    // Label of a point against the colour of its pixel in the image that the binary wrote.
    const seen = new Map();
    for (let k = 0; k < 40 && seen.size < 50; k += 2) {
      await goto(page, k);
      for (const sensor of ["front", "left", "right"]) {
        await page.evaluate((s) => { overtake.app.state.imageSensor = s; overtake.app.changed("settings"); }, sensor);
        await until(page, (s) => overtake.app.logs[0].frame.images.some((i) => i.sensor === s && i.name === "labels"),
            sensor);
        const pairs = await page.evaluate((s) => {
          const { app, images } = overtake, [log] = app.logs, link = images.linkOf(log),
              cloud = log.frame.clouds.find((c) => c.sensor === s);
          const image = log.frame.images.find((i) => i.name === "labels" && i.sensor === s), out = {};
          for (let i = 0; i < cloud.count; ++i) {
            const label = cloud.fields.label[i], pixel = label in out ? null : link.pixelOf(i);
            if (label >= 0 && pixel)
              out[label] = [...image.values.subarray(3 * (pixel.row * image.cols + pixel.col),
                  3 * (pixel.row * image.cols + pixel.col) + 3)];
          }
          return out;
        }, sensor);
        for (const [label, color] of Object.entries(pairs)) seen.set(Number(label), color);
      }
    }
    assert.ok(seen.size >= 50, `${seen.size} labels, up to ${Math.max(...seen.keys())}`);
    const table = await page.evaluate((labels) => labels.map((l) => overtake.labelColor(l)), [...seen.keys()]);
    assert.deepStrictEqual(table, [...seen.values()]);
    // The pixels of the 3-D view hold these colours.
    const drawn = await page.evaluate(() => {
      const { app, view } = overtake, { pixels, width } = (app.state.off =
          new Set(["map", "detections", "headings", "tracks", "covariance", "paths", "trails", "truth", "names",
          "rings"]), view.update(), view.readPixels());
      let right = 0, looked = 0;
      for (const cloud of app.logs[0].frame.clouds)
        for (let i = 0; i < cloud.count; i += 53) {
          const at = cloud.fields.label[i] > 0 ? view.project(0,
              view.pointPosition({ log: 0, sensor: cloud.sensor, point: i })) : null;
          if (!at || at[0] < 3 || at[1] < 3 || at[0] > view.root.clientWidth - 3 || at[1] > view.root.clientHeight - 3)
            continue;
          const k = 4 * (Math.floor(at[1]) * width + Math.floor(at[0]));
          ++looked;
          if (overtake.labelColor(cloud.fields.label[i]).every((v, c) => pixels[k + c] === v)) ++right;
        }
      return { right, looked };
    });
    // others lie behind a nearer point
    assert.ok(drawn.looked > 50 && drawn.right > 0.85 * drawn.looked, JSON.stringify(drawn));
  },

  "colours: each of the eight colourings draws its own colours": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none");
    const sums = await page.evaluate(async () => {
      const { app, view } = overtake, out = {};
      for (const coloring of ["label", "cluster", "reason", "intensity", "height", "range", "layer", "sensor"]) {
        app.state.coloring = coloring;
        view.update();
        const { pixels } = view.readPixels();
        let sum = 0;
        for (let i = 0; i < pixels.length; i += 4)
          sum = (sum * 31 + pixels[i] + 7 * pixels[i + 1] + 13 * pixels[i + 2]) % 1000003;
        out[coloring] = `${view.scenes[0].coloring} ${sum}`;
      }
      return out;
    });
    for (const [name, text] of Object.entries(sums)) assert.ok(text.startsWith(`${name} `), text);
    assert.strictEqual(new Set(Object.values(sums).map((t) => t.split(" ")[1])).size, 8, JSON.stringify(sums));
  },

  "selection: a click on a point shows all its fields; on a box or a row selects everywhere": async (
      { browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none");
    await goto(page, 30);
    const target = await page.evaluate(() => {
      const { view, app } = overtake, cloud = app.logs[0].frame.clouds.find((c) => c.sensor === "front"),
          box = view.canvas.getBoundingClientRect();
      for (let i = 0; i < cloud.count; i += 11) {
        const at = view.project(0, view.pointPosition({ log: 0, sensor: "front", point: i }));
        if (at && at[0] > 200 && at[0] < 500 && at[1] > 250 && at[1] < 500 &&
            document.elementFromPoint(box.left + at[0], box.top + at[1]) === view.canvas) {
          const hit = view.pointAt(...at);
          if (hit && hit.point === i)
            return { x: box.left + at[0], y: box.top + at[1], i,
                position: [...cloud.position.subarray(3 * i, 3 * i + 3)], label: cloud.fields.label[i],
                layer: cloud.fields.layer[i] };
        }
      }
      return null;
    });
    await page.mouse.click(target.x, target.y);
    await until(page, () => overtake.app.state.selection?.kind === "point" &&
        document.querySelectorAll(".objects .fields dt").length > 5);
    const fields = await page.evaluate(() => Object.fromEntries(
        [...document.querySelectorAll(".objects .fields dt")].map(
        (dt) => [dt.textContent, dt.nextElementSibling.textContent])));
    assert.strictEqual(fields["in the sensor's frame, m"], target.position.map((v) => v.toFixed(3)).join("  "));
    assert.deepStrictEqual([fields.label, fields.layer], [String(target.label), String(target.layer)]);
    for (const name of ["range, m", "intensity", "cluster", "reason"])
      assert.ok(name in fields, `${name}: ${Object.keys(fields)}`);
    assert.match(fields.reason, /^\d+  \w+/);
    // A row of the tracks.
    await page.click(".objects table tbody tr");
    await until(page, () => overtake.app.state.selection?.kind === "track" &&
        document.querySelector(".objects tr.picked"));
    await until(page, () => document.querySelector(".label.track.picked"));
    const picked = await page.evaluate(() => ({ rows: document.querySelectorAll(".objects tr.picked").length,
        head: document.querySelectorAll(".objects h3")[2].textContent, id: overtake.app.state.selection.id,
        track: overtake.app.logs[0].frame.tracks[0] }));
    assert.strictEqual(picked.head, `Track ${BigInt(picked.id) & 0xffffffffn}:${BigInt(picked.id) >> 32n}`);
    assert.strictEqual(picked.rows, 1 + (picked.track.detection >= 0 ? 1 : 0), "the track's detection is marked, too");
    // Its box in the view.
    await page.keyboard.press("Escape");
    const box = await page.evaluate(() => {
      const { view, app } = overtake, t = view.scenes[0].targets.find((s) => s.selection.kind === "track");
      app.state.off = new Set(["sensor:front", "sensor:left", "sensor:right"]);
      view.cameraState = [t.center[0] - 12, t.center[1] - 3, t.center[2] + 6, ...t.center, 1];
      view.update();
      const at = view.project(0, t.center), { left, top } = view.canvas.getBoundingClientRect();
      return { x: left + at[0], y: top + at[1], id: t.selection.id };
    });
    await page.mouse.click(box.x, box.y);
    await until(page, () => ["track", "detection"].includes(overtake.app.state.selection?.kind));
    await until(page, () => document.querySelector(".objects tr.picked"));
  },

  "tables: a click on a head sorts, a second one the other way": async ({ browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.a)).url, "images=none");
    await goto(page, 0);
    const column = (table, name) => page.evaluate((t, n) => {
      const element = document.querySelectorAll(".objects table")[t],
          i = [...element.tHead.rows[0].cells].findIndex((c) => c.textContent === n);
      element.tHead.rows[0].cells[i].click();
      return [...element.tBodies[0].rows].map((r) => Number(r.cells[i].textContent));
    }, table, name);
    for (const [table, name] of [[0, "m"], [0, "m/s"], [1, "points"], [1, "x"]]) {
      const down = await column(table, name), up = await column(table, name);
      assert.ok(down.length > 2, `${down.length} rows`);
      assert.deepStrictEqual(down, [...down].sort((a, b) => b - a));
      assert.deepStrictEqual(up, [...up].sort((a, b) => a - b));
    }
  },

  "latency: plot and quantiles are those of timing.csv; a click lands on the frame": async (
      { browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "tab=latency&images=none&series=frame,front/ground");
    const rows = csv(path.join(logs.resultsB, "timing.csv")),
        wanted = (sensor, stage) => rows.filter((r) => r.sensor === sensor &&
        r.stage === stage).map((r) => Number(r.time_us));
    const [x, frame, ground] = await page.evaluate(() => overtake.latency.plot.values);
    // The log has whole microseconds from 100 on.
    const same = (got, csvValues) => {
      assert.strictEqual(got.length, csvValues.length);
      got.forEach((ms, i) => assert.ok(Math.abs(ms * 1000 - csvValues[i]) <= (csvValues[i] < 99 ? 0.06 : 0.6),
          `${ms * 1000} and ${csvValues[i]}`));
    };
    same(frame, wanted("", "frame"));
    same(ground, wanted("front", "ground"));
    assert.strictEqual(x.length, 40);
    const sorted = wanted("", "frame").sort((a, b) => a - b),
        quantiles = await page.evaluate(() => overtake.latency.quantilesOf("frame"));
    [0.5, 0.99, 1].forEach((share, i) => assert.ok(Math.abs(quantiles[i] - sorted[Math.ceil(share * 40) - 1]) <= 0.6));
    const shown = await page.evaluate(() => [...document.querySelector(".latency table.data").tBodies[0].rows].map(
        (r) => [...r.cells].map((c) => c.textContent)));
    const first = shown.find((r) => r[0] === "frame");
    assert.deepStrictEqual(first.slice(1, 4), quantiles.map((us) => (us / 1000).toFixed(3)));
    for (const stage of ["merge", "track", "front/segment", "left/ground", "right/clusters"])
      assert.ok(shown.some((r) => r[0] === stage), stage);
    for (const k of [11, 30]) {
      const at = await page.evaluate((i) => { const { app, latency } = overtake,
          over = document.querySelector(".latency .u-over").getBoundingClientRect();
          return [latency.plot.position(app.seconds(app.entries[i].stamp)), over.top + over.height / 2]; }, k);
      await page.mouse.click(...at);
      await until(page, (i) => overtake.app.logs[0].frame.index === i, k);
    }
    const bars = await page.evaluate(() => { const c = document.querySelector(".histogram"),
        d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data; let n = 0;
        for (let i = 0; i < d.length; i += 4) if (d[i] === 46 && d[i + 2] === 181) ++n; return n; });
    assert.ok(bars > 100, "the histogram has bars");
  },

  "plots: a selected track's speed, distance, deviation and hits are those of tracks.csv": async (
      { browser, logs, view }) => {
    const { page } = await open(browser, (await view(logs.b)).url, "images=none");
    await goto(page, 39);
    const id = await page.evaluate(() => { const { app } = overtake, { id } = app.logs[0].frame.tracks[0];
        app.select({ log: 0, kind: "track", id }); return id; });
    const rows = csv(path.join(logs.resultsB, "tracks.csv")).filter((r) => r.id === id);
    await until(page, (n) => overtake.objects.plots[0].values[0].length >= n, rows.length);
    const [speed, distance, sigma, hits] = await page.evaluate(() => overtake.objects.plots.map((p) => p.values[1]));
    assert.strictEqual(speed.length, rows.length);
    rows.forEach((row, i) => {
      assert.ok(Math.abs(speed[i] - row.speed_mps) < 1e-6);
      assert.ok(Math.abs(sigma[i] - Math.sqrt(Math.max(row.var_x, row.var_y))) < 1e-6);
      assert.ok(Math.abs(distance[i] - Math.hypot(row.ahead_m, row.left_m)) < 0.01,
          `${distance[i]} and ${Math.hypot(row.ahead_m, row.left_m)}`);
      assert.strictEqual(hits[i], Number(row.hits));
    });
  },
};
