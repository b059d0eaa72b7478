// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: node tests/browser/serve.js PAGES LOG [LOG2]. Serves the page from a folder, for work on the page without the
// executable (node tools/view/web/build.mjs PAGES). The routes and heads are those of `overtake view`.
"use strict";
const fs = require("fs");
const http = require("http");
const path = require("path");

const kMime = { ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml", ".txt": "text/plain" };
const kPolicy = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self' data: ws:; style-src 'self' 'unsafe-inline'; worker-src 'self'";

function tagOf(file) {
  const { size, mtimeMs, ino } = fs.statSync(file);
  return `"${size}-${Math.round(mtimeMs * 1000)}-${ino}"`;
}

// Listens on 127.0.0.1; resolves to { url, requests, close }. requests grows by { path, range, bytes } a request.
function serve(pages, logs, port = 0) {
  const requests = [];
  const server = http.createServer((request, response) => {
    const { pathname } = new URL(request.url, "http://127.0.0.1"), record = { path: pathname, range: request.headers.range, bytes: 0 };
    requests.push(record);
    const log = /^\/log\/(\d)$/.exec(pathname);
    if (pathname === "/logs.json") {
      const list = logs.map((file, i) => ({ url: `/log/${i}`, name: path.basename(file), bytes: String(fs.statSync(file).size), etag: tagOf(file) }));
      response.writeHead(200, { "Content-Type": "application/json", "Cache-Control": "no-store" }).end(JSON.stringify({ version: "dev", live: false, at: null, logs: list }));
    } else if (log && logs[log[1]]) {
      const file = logs[log[1]], etag = tagOf(file), size = fs.statSync(file).size, range = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
      if (request.headers["if-match"] && request.headers["if-match"] !== etag) return response.writeHead(412).end();
      if (!range || +range[1] >= size) return response.writeHead(416).end();
      const start = +range[1], end = Math.min(+range[2], size - 1);
      record.bytes = end - start + 1;
      response.writeHead(206, { "Content-Length": record.bytes, "Content-Range": `bytes ${start}-${end}/${size}`, ETag: etag, "Cache-Control": "no-store" });
      fs.createReadStream(file, { start, end }).pipe(response);
    } else {
      const file = path.join(pages, path.basename(pathname === "/" ? "index.html" : pathname));
      if (!fs.existsSync(file)) return response.writeHead(404).end();
      response.writeHead(200, { "Content-Type": kMime[path.extname(file)] ?? "application/octet-stream", "Content-Security-Policy": kPolicy }).end(fs.readFileSync(file));
    }
  });
  return new Promise((done) => server.listen(port, "127.0.0.1", () => done({
    url: `http://127.0.0.1:${server.address().port}/`, requests,
    close: () => new Promise((closed) => { server.close(closed); server.closeAllConnections(); }) })));
}

module.exports = { serve };
if (require.main === module) serve(process.argv[2], process.argv.slice(3), 8123).then(({ url }) => console.log(url));
