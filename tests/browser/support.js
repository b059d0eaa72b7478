// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the tests of the page share: a browser with software rendering, pages on a server, and waiting.
"use strict";
const { spawn } = require("child_process");
const fs = require("fs");
const path = require("path");

let puppeteer;
try {
  puppeteer = require("../node/node_modules/puppeteer-core");
} catch (error) {
  if (error.code !== "MODULE_NOT_FOUND") throw error;
  console.log("skipped: node modules for tests are not installed (tools/setup --node)");
  process.exit(77);
}

const kPatience_ms = 30000;
const kLong = process.env.OVT_TEST_LONG === "1";  // more places, more seeks

// A test throws it where something optional is missing.
class Skip extends Error {}

async function launch() {
  return puppeteer.launch({ browser: "chrome", headless: true, executablePath: "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
           "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--disable-background-networking"] });
}

// Firefox draws WebGL only on a display: that of an Xvfb, which ends with it. Null if one of the two is not installed.
async function launchFirefox() {
  const firefox = "/usr/bin/firefox-esr", xvfb = "/usr/bin/Xvfb";
  if (!fs.existsSync(firefox) || !fs.existsSync(xvfb)) return null;
  const server = spawn(xvfb, ["-displayfd", "3", "-screen", "0", "1280x900x24", "-nolisten", "tcp"],
      { stdio: ["ignore", "ignore", "ignore", "pipe"] });
  const display = await new Promise((done) => server.stdio[3].once("data", (text) => done(String(text).trim())));
  const browser = await puppeteer.launch({ browser: "firefox", headless: false, executablePath: firefox,
    extraPrefsFirefox: { "webgl.force-enabled": true }, env: { ...process.env, DISPLAY: `:${display}` } });
  browser.once("disconnected", () => server.kill());
  return browser;
}

// Programs that a failed test leaves behind.
const children = new Set();
function start(program, words, stdio) {
  const child = spawn(program, words, { stdio });
  children.add(child);
  child.once("exit", () => children.delete(child));
  return child;
}
function stopAll() { for (const child of children) child.kill("SIGKILL"); }

// Starts `overtake view WORDS...`; resolves to { url, process, stop } when it has printed its address.
function startView(overtake, words, errors = "inherit") {
  const child = start(overtake, ["view", ...words, "--no-open"], ["ignore", "pipe", errors]);
  const ended = new Promise((done) => child.once("exit", done));
  const stop = (signal = "SIGINT") => {
    child.kill(signal);
    return ended;
  };
  return new Promise((done, refuse) => {
    let text = "";
    child.once("exit", (code) => refuse(new Error(`overtake view ended: ${code}`)));
    child.stdout.on("data", (bytes) => {
      text += bytes;
      const url = /^http:\S+$/m.exec(text);
      if (url) done({ url: url[0], process: child, stop });
    });
  });
}

// A page that records what it asks for, and each of its errors.
async function open(browser, url, fragment = "", { width = 1280, height = 800, settled = true } = {}) {
  const page = await browser.newPage(), errors = [], hosts = new Set(), requests = [];
  await page.setViewport({ width, height });
  page.on("console", (message) => { if (message.type() === "error" ||
      /Refused to|Content Security/.test(message.text())) errors.push(message.text()); });
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("request", (request) => { const { protocol, host } = new URL(request.url());
      if (protocol !== "data:") hosts.add(host);
    requests.push({ url: request.url(), range: request.headers().range }); });
  await page.goto(url + (fragment ? `#${fragment}` : ""));
  if (settled) await settle(page);
  return { page, errors, hosts, requests };
}

const until = (page, condition, ...values) =>
    page.waitForFunction(condition, { timeout: kPatience_ms, polling: 30 }, ...values);
// Waits until the frame that is asked for is shown, drawn included.
async function settle(page) {
  await until(page, () => window.overtake?.app.isSettled && window.overtake.app.changes.size === 0);
}
async function goto(page, entry) {
  await page.evaluate((i) => window.overtake.app.seek(i), entry);
  await settle(page);
}

const kSourceRoot = path.resolve(__dirname, "../..");
module.exports = { kLong, Skip, start, stopAll, launch, launchFirefox, startView, open, until, settle, goto, kSourceRoot };
