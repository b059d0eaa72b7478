// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Firefox: load, seek, one picture.
"use strict";
const assert = require("assert");
const { launchFirefox, open, goto, Skip } = require("./support");

module.exports = {
  "firefox: loads the page, seeks, draws a picture": async ({ logs, view }) => {
    const firefox = await launchFirefox();
    if (!firefox) throw new Skip("no firefox-esr or no Xvfb (tools/setup --node)");
    try {
      const { page } = await open(firefox, (await view(logs.b)).url, "images=none", { width: 800, height: 600 });
      await goto(page, 30);
      const seen = await page.evaluate(() => {
        const { app, view } = overtake, { pixels } = view.readPixels();
        let lit = 0;
        for (let i = 0; i < pixels.length; i += 4) if (pixels[i] + pixels[i + 1] + pixels[i + 2] > 90) ++lit;
        return { index: app.logs[0].frame.index, points: view.scenes[0].counts.points, lit };
      });
      assert.strictEqual(seen.index, 30);
      assert.ok(seen.points > 60000 && seen.lit > 3000, JSON.stringify(seen));
    } finally {
      await firefox.close();
    }
  },
};
