// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: node build.mjs FOLDER [--embed PAGES_CPP]. Bundles the page into FOLDER. --embed also writes the files,
// compressed, as a C++ source (pages.h), and the files that it depends on to PAGES_CPP.d.
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, extname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url)), out = process.argv[2] && resolve(process.argv[2]);
if (!out) throw new Error("usage: node build.mjs FOLDER [--embed PAGES_CPP]");
mkdirSync(out, { recursive: true });
const { metafile } = await build({
  absWorkingDir: here, entryPoints: { app: "src/main.ts", worker: "src/worker.ts" }, outdir: out, bundle: true,
      minify: true, format: "iife",
  target: "es2022", legalComments: "none", metafile: true, logLevel: "warning", loader: { ".css": "css" },
});
for (const name of ["index.html", "favicon.svg"]) copyFileSync(join(here, "src", name), join(out, name));

// The licence of each package that is in the bundle, with the notices of what a package itself contains.
const packages = [...new Set(Object.keys(metafile.inputs).map(
    (path) => /node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1]).filter(Boolean))].sort();
let notice = "overtake view contains these packages.\n";
for (const name of packages) {
  const folder = join(here, "node_modules", name),
      { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((f) => /^licen[sc]e/i.test(f));
  if (!file) throw new Error(`${name} has no licence file`);
  notice += `\n---- ${name} ${version} (${license})\n\n${readFileSync(join(folder, file), "utf8").trim()}\n`;
}
const zstd = /\/\*\*\n(\* BSD License[\s\S]*?)\*\//.exec(
    readFileSync(join(here, "node_modules/zstddec/dist/zstddec.mjs"), "utf8"));
if (!zstd) throw new Error("the notice of Zstandard is not where it was");
notice += `\n---- Zstandard, as WebAssembly in zstddec\n\n${zstd[1].replace(/^ ?\* ?/gm, "").trim()}\n`;
writeFileSync(join(out, "THIRD_PARTY.txt"), notice);

if (process.argv[3] === "--embed") {
  const target = resolve(process.argv[4]);
  const mimes = { ".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8",
      ".css": "text/css; charset=utf-8",
                  ".svg": "image/svg+xml", ".txt": "text/plain; charset=utf-8" };
  let arrays = "", rows = "";
  ["index.html", "app.js", "worker.js", "app.css", "favicon.svg", "THIRD_PARTY.txt"].forEach((name, i) => {
    const bytes = gzipSync(readFileSync(join(out, name)), { level: 9 });
    arrays += `constexpr unsigned char kPage${i}[] = {${bytes.join(",").replace(/(.{110}[^,]*,)/g, "$1\n")}};\n`;
    rows += `    {"/${name}", "${mimes[extname(name)]}", kPage${i}, sizeof kPage${i}},\n`;
  });
  mkdirSync(dirname(target), { recursive: true });
  writeFileSync(target,
      `// Written by tools/view/web/build.mjs.\n#include "tools/view/web/pages.h"\n\n` +
      `namespace overtake::cli {\nnamespace {\n\n${arrays}` +
    `constexpr Page kPages[] = {\n${rows}};\n\n}  // namespace\n\n` +
      `std::span<const Page> pages() { return kPages; }\n\n}  // namespace overtake::cli\n`);
  const inputs = [...Object.keys(metafile.inputs), "src/index.html",
      "src/favicon.svg"].map((path) => resolve(here, path).replaceAll(" ", "\\ "));
  writeFileSync(`${target}.d`, `${target}: ${inputs.join(" ")}\n`);
}
