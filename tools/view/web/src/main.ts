// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Builds the page.
import "uplot/dist/uPlot.min.css";
import "./page.css";
import { App } from "./app";
import { kColorings, kReasons, kSensorColors, labelColor, scaleColor, type Rgb } from "./colors";
import { button, Choice, el, fixed, select, setText, toggle } from "./dom";
import { LogScene } from "./log_scene";
import { readToml } from "./pairs";
import { ComparePanel } from "./panels/compare";
import { ImagesPanel } from "./panels/images";
import { LatencyPanel } from "./panels/latency";
import { LogPanel } from "./panels/log";
import { ObjectsPanel } from "./panels/objects";
import { kLayers, kTabs, type Tab } from "./state";
import { flagNames, lostText, marksOf, Timeline } from "./timeline";
import type { LogList } from "./types";
import { View3d } from "./view3d";

const rgb = (color: Rgb): string => `rgb(${color.join(" ")})`;
const kFaultTitles: Record<string, string> = { gone: "no answer", changed: "log changed", damaged: "damaged log",
    unknown: "cannot show", notice: "note" };

function fail(text: string): void {
  document.body.replaceChildren(el("main", { class: "stop" }, el("h1", {}, "overtake view"), el("p", {}, text)));
}

// The strip above everything: which log, which frame, what is wrong with it.
function makeHeader(app: App): HTMLElement {
  const logs = el("span", { class: "logs" }), facts = el("span", { class: "facts" }),
      chips = el("span", { class: "chips" }), version = el("b", {}, "overtake view");
  app.on(["info"], () => logs.replaceChildren(...app.logs.map(
      (log) => el("span", { class: `log${log.index}` },
      `${app.logs.length > 1 ? `${"AB"[log.index]}  ` : ""}${log.name}`))));
  app.on(["frame", "clock", "table"], () => {
    const { entry } = app, frame = app.logs[0]?.frame, table = app.logs[0]?.table;
    if (!entry) {
      setText(facts, "");
      return;
    }
    const parts = [`frame ${app.at} of ${app.entries.length}`, String(entry.stamp)];
    if (frame) parts.push(`${frame.clouds.reduce((sum, c) => sum + c.count, 0).toLocaleString("en")} points`,
        `${frame.detections.length} detections`, `${frame.tracks.length} tracks`);
    const us = table?.frame_us[entry.frames[0]];
    if (us !== undefined && Number.isFinite(us)) parts.push(`${fixed(us / 1000, 2)} ms`);
    setText(facts, parts.join("   "));
    const names = table && entry.frames[0] >= 0 ? flagNames(table.flags[entry.frames[0]]) : [],
        lost = table?.lostScans[entry.frames[0]] ?? 0;
    if (lost > 0) names.push(lostText(lost));
    if (table && entry.frames[0] >= 0 && marksOf(table, entry.frames[0]).missed && !names.includes("deadline missed"))
      names.push("deadline missed");
    chips.replaceChildren(...names.map((name) => el("span", { class: name === "deadline missed" ? "chip bad" : "chip" },
        name)));
    if (app.live) chips.prepend(el("span", { class: "chip live" }, app.playing ? "live" : "live, paused"));
  });
  return el("header", {}, version, logs, facts, chips);
}

// One line for each fault; one bar for work under way.
function makeFaults(app: App): HTMLElement {
  const root = el("div", { class: "faults" });
  app.on(["faults"], () => {
    const lines = app.faults.map((fault) => el("div", { class: `fault ${fault.kind}` },
        el("b", {}, kFaultTitles[fault.kind] ?? ""),
      `${app.logs.length > 1 ? `${"AB"[fault.log]}: ` : ""}${fault.text}`, button("\u00d7", "close", () => {
        app.faults.splice(app.faults.indexOf(fault), 1);
        app.changed("faults");
      })));
    const bars = [...app.underWay.values()].map(({ what, share }) => {
      const bar = el("i");
      bar.style.width = `${share * 100}%`;
      return el("div", { class: "work" }, el("span", {}, `${what} ${Math.round(share * 100)} %`), el("u", {}, bar));
    });
    root.replaceChildren(...lines, ...bars);
  });
  return root;
}

function makeToolbar(app: App, view: View3d): HTMLElement {
  const { state } = app;
  const set = (act: () => void): void => { act(); app.changed("settings"); };
  const camera = new Choice([["3d", "3-D", "perspective: drag turns, right button moves, wheel zooms"],
      ["top", "from above", "parallel, from above"]] as const, (v) => set(() => { state.view = v; }));
  const follow = new Choice([["vehicle", "follow", "the camera moves with the vehicle"],
      ["map", "stay", "the camera stays on the map"]] as const, (v) => set(() => { state.follow = v; }));
  const coloring = select(kColorings.map((c) => [c, `colour: ${c}`] as const), "colour of the points",
      (v) => set(() => { state.coloring = kColorings.find((c) => c === v)!; }));
  const size = select([1, 2, 3, 4, 6].map((v) => [String(v), `${v} px`] as const), "size of a point",
      (v) => set(() => { state.pointSize = Number(v); }));
  const reset = button("\u2302", "camera to its first place (double click)",
      () => { view.resetCamera(); view.update(); state.camera = null; app.changed("settings"); });
  const layers = el("div", { class: "layers" }), sensors = el("div", { class: "layers" });
  const layerButtons = kLayers.map(([name, text, hint]) => {
    const made = toggle(text, hint, () => app.toggleLayer(name));
    made.dataset.layer = name;
    return made;
  });
  layers.append(...layerButtons);
  app.on(["info", "settings"], () => {
    camera.show(state.view);
    follow.show(state.follow);
    coloring.value = state.coloring;
    size.value = String(state.pointSize);
    kLayers.forEach(([name], i) => layerButtons[i].classList.toggle("on", state.isOn(name)));
    sensors.replaceChildren(...(app.logs[0]?.info?.sensors ?? []).map((name, i) => {
      const made = toggle(name, `points of ${name}`, () => app.toggleLayer(`sensor:${name}`),
          rgb(kSensorColors[i % kSensorColors.length]));
      made.dataset.sensor = name;
      made.classList.toggle("on", state.isOn(`sensor:${name}`));
      return made;
    }));
  });
  return el("div", { class: "toolbar" }, el("div", { class: "row" }, camera.root, follow.root, reset, coloring, size,
      sensors), el("div", { class: "row" }, layers));
}

// What the colours of the points mean.
function makeLegend(app: App, scene: LogScene): HTMLElement {
  const root = el("div", { class: "legend" });
  app.on(["frame", "settings"], () => {
    const frame = scene.log.frame, swatch = (color: string, text: string): HTMLElement =>
        el("span", {}, Object.assign(el("i"), { style: `background:${color}` }), text);
    const { coloring, scale } = scene;
    root.hidden = !frame;
    if (!frame) return;
    const title = el("b", {}, coloring === app.state.coloring ? coloring
        : `${coloring}: the log has no ${app.state.coloring}`);
    if (scale) {
      const stops = Array.from({ length: 9 }, (_, i) => rgb(scaleColor(i / 8))).join(", "),
          digits = scale.high - scale.low > 20 ? 0 : 1;
      root.replaceChildren(title, el("span", {}, fixed(scale.low, digits),
          Object.assign(el("u"), { style: `background:linear-gradient(90deg, ${stops})` }),
          `${fixed(scale.high, digits)} ${scale.unit}${scale.log ? " (log)" : ""}`));
    } else if (coloring === "sensor") {
      root.replaceChildren(title, ...(scene.log.info?.sensors ??
          []).map((name, i) => swatch(rgb(kSensorColors[i % kSensorColors.length]), name)));
    } else if (coloring === "reason") {
      const seen = new Set(frame.clouds.flatMap((c) => [...new Set(c.fields.reason ?? [])]));
      root.replaceChildren(title, ...kReasons.filter((_, i) => seen.has(i)).map(
          ([name, color]) => swatch(rgb(color), name)));
    } else {
      root.replaceChildren(title, swatch(coloring === "label" ? rgb(labelColor(0)) : "rgb(74 58 92)",
          coloring === "label" ? "ground" : "none"),
          el("span", {}, swatch(rgb(labelColor(1)), ""), swatch(rgb(labelColor(2)), ""),
          swatch(rgb(labelColor(3)), "clusters")), coloring === "label" && swatch("rgb(74 58 92)", "no label") || "");
    }
  });
  return root;
}

function makeTabs(app: App, panels: Partial<Record<Tab, HTMLElement>>): HTMLElement {
  const names = kTabs.filter((tab) => panels[tab]);
  const choice = new Choice(names.map((tab) => [tab, tab, tab] as const),
      (tab) => { app.state.tab = tab; app.changed("settings"); });
  choice.root.classList.add("tabs");
  app.on(["info", "settings"], () => {
    if (!panels[app.state.tab]) app.state.tab = "objects";
    choice.show(app.state.tab);
    for (const name of names) panels[name]!.hidden = name !== app.state.tab;
  });
  return el("aside", {}, choice.root, el("div", { class: "panel" }, ...names.map((name) => panels[name]!)));
}

async function start(): Promise<void> {
  const probe = document.createElement("canvas").getContext("webgl2");
  if (!probe) {
    fail("This browser offers no WebGL2, which draws the points. Allow hardware or software rendering in "
        + "its settings, or use another browser.");
    return;
  }
  probe.getExtension("WEBGL_lose_context")?.loseContext();
  let list: LogList;
  try {
    const response = await fetch("logs.json", { cache: "no-store" });
    if (!response.ok) throw new Error(`status ${response.status}`);
    list = await response.json() as LogList;
  } catch (error) {
    fail(`The server does not say which log to show (${error instanceof Error ? error.message
        : String(error)}). Is overtake view still running?`);
    return;
  }
  const app = new App();
  app.start(list);
  const view = new View3d(app.state);
  for (const log of app.logs) view.scenes.push(new LogScene(log));
  let placed = false;
  app.on(["info"], () => view.scenes.forEach((scene) => {
    const values = readToml(scene.log.info?.config ?? ""), length = Number(values.get("vehicle.length_m")),
        width = Number(values.get("vehicle.width_m"));
    if (length > 0 && width > 0) scene.vehicle = { length_m: length, width_m: width };
  }));
  app.on(["frame", "settings", "selection", "history", "info"], () => {
    view.update();
    if (!placed && app.logs[0].frame) {
      placed = true;
      if (app.state.camera) view.cameraState = app.state.camera, view.update();
    }
  });
  app.on(["run"], () => view.forgetPlace());
  const images = new ImagesPanel(app), objects = new ObjectsPanel(app), latency = new LatencyPanel(app),
      logPanel = new LogPanel(app);
  const compare = app.logs.length > 1 ? new ComparePanel(app) : null, timeline = new Timeline(app);
  view.root.append(makeToolbar(app, view), makeLegend(app, view.scenes[0]));
  document.body.replaceChildren(makeHeader(app), makeFaults(app),
    el("main", {}, el("div", { class: "stage" }, view.root, images.root),
       makeTabs(app, { objects: objects.root, latency: latency.root, ...(compare ? { compare: compare.root } : {}),
           log: logPanel.root })), timeline.root);
  document.title = list.live ? "overtake live" : `${list.logs.map((l) => l.name).join(" | ")} \u2013 overtake view`;

  app.on(["hover", "selection", "frame"], () => {
    const chosen = app.state.selection?.kind === "point" ? app.state.selection : null, point = app.hover ?? chosen;
    view.scenes.forEach((scene, i) => scene.mark(point?.log === i ? point.sensor : null, point?.point));
    view.invalidate();
  });
  view.onCamera = () => {
    app.state.camera = view.cameraState;
    app.writeFragment();
  };
  view.onPick = (selection) => app.select(selection);
  view.onHover = (point) => app.setHover(point);
  window.addEventListener("hashchange", () => {
    if (app.state.camera) view.cameraState = app.state.camera;
  });

  // For tests and the console.
  Object.assign(window, { overtake: { app, view, images, objects, latency, compare, timeline, labelColor } });
  app.changed("info", "settings", "faults");
  const picture = (now_ms: number): void => {
    requestAnimationFrame(picture);
    try {
      app.tick(now_ms);
      view.renderIfDirty();
    } catch (error) {
      const log = app.logs[0];
      if (log) app.fault(log, "damaged", `A frame cannot be drawn: ${error instanceof Error ? error.message : error}`);
    }
  };
  requestAnimationFrame(picture);
}

void start();
