// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: node tests/browser/run.js OVERTAKE WORK [NAME...]. Runs the tests of the page in headless Chromium: all but
// those of Firefox, or those whose name contains a NAME, or whose file is NAME (test_logs.js). WORK is a folder for
// logs. Exit code 77 and a line "skipped: ..." without the node modules, or if every test was skipped.
"use strict";
const { execFileSync } = require("child_process");
const fs = require("fs");
const path = require("path");
const { Skip, launch, startView, stopAll } = require("./support");

const [overtake, work, ...names] = process.argv.slice(2);
const kFiles = ["test_frame", "test_timeline", "test_panels", "test_logs", "test_large", "test_live", "test_firefox"];

// One simulated overtake, and two views of it: A of preset paper, B of preset best; and a short one.
function makeLogs() {
  const file = (name) => path.join(work, name),
      run = (...words) => execFileSync(overtake, [...words, "--quiet", "--force"],
      { stdio: ["ignore", "ignore", "inherit"] });
  if (!fs.existsSync(file("race.mcap")))
    run("simulate", "overtake", "--seed", "99", "--seconds", "2", "--out", file("race.mcap"));
  for (const [name, preset] of [["a", "paper"], ["b", "best"]])
    if (!fs.existsSync(file(`${name}.mcap`)))
      run("run", file("race.mcap"), "--preset", preset, "--out", file(name), "--mcap", file(`${name}.mcap`));
  if (!fs.existsSync(file("short.mcap"))) {
    run("simulate", "overtake", "--seed", "7", "--seconds", "0.5", "--out", file("short_race.mcap"));
    run("run", file("short_race.mcap"), "--out", file("short"), "--mcap", file("short.mcap"));
  }
  return { short: file("short.mcap"), race: file("race.mcap"), a: file("a.mcap"), b: file("b.mcap"),
      resultsA: file("a"), resultsB: file("b") };
}

async function main() {
  const logs = makeLogs(), browser = await launch();
  const failures = [];  // told once more at the end, where a long output is not cut
  let passed = 0, skipped = 0;
  const servers = [];
  const view = async (...words) => {
    servers.push(await startView(overtake, words));
    return servers[servers.length - 1];
  };
  for (const file of kFiles)
    for (const [name, test] of Object.entries(require(`./${file}`))) {
      const isNamed = names.some((n) => name.includes(n) || n === `${file}.js`);
      if (names.length > 0 ? !isNamed : name.startsWith("firefox")) continue;
      const begin = Date.now();
      try {
        await test({ browser, overtake, work, logs, view });
        ++passed;
        console.log(`passed: ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`);
      } catch (error) {
        if (error instanceof Skip) ++skipped, console.log(`skipped: ${name}: ${error.message}`);
        else failures.push(`FAILED: ${name}: ${error.stack}`), console.log(failures[failures.length - 1]);
      }
      for (const page of (await browser.pages()).slice(1)) await page.close();
      for (const server of servers.splice(0)) await server.stop();
    }
  await browser.close();
  for (const failure of failures) console.log(failure);
  console.log(`${passed} passed, ${skipped} skipped, ${failures.length} failed`);
  stopAll();
  process.exit(failures.length > 0 || passed + skipped === 0 ? 1 : passed === 0 ? 77 : 0);
}

main().catch((error) => {
  console.log(`FAILED: ${error.stack}`);
  stopAll();
  process.exit(1);
});
