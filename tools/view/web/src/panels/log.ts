// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a log holds: topics, counters, configuration, and what was read of it.
import type { App } from "../app";
import { bytesText, el, setText } from "../dom";
import { DataTable } from "../table";
import type { LogInfo } from "../types";

export class LogPanel {
  readonly root = el("section", { class: "log" });

  constructor(app: App) {
    for (const log of app.logs) {
      const head = el("h3"), traffic = el("div", { class: "hint" }), facts = el("dl", { class: "fields" }),
          config = el("pre");
      const counters = new DataTable<{ name: string;
          value: number }>([{ title: "counter", value: (r) => r.name, words: true },
          { title: "value", value: (r) => r.value }]);
      const topics = new DataTable<LogInfo["topics"][0]>([{ title: "topic", value: (r) => r.topic, words: true },
          { title: "schema", value: (r) => r.schema, words: true },
        { title: "messages", value: (r) => r.messages ?? NaN,
            text: (r) => (r.messages === null ? "\u2013" : String(r.messages)) }]);
      this.root.append(head, traffic, facts, el("details", { open: "" }, el("summary", {}, "Counters at this frame"),
          counters.root),
                       el("details", {}, el("summary", {}, "Topics"), topics.root),
                           el("details", {}, el("summary", {}, "Configuration"), config));
      app.on(["info", "settings"], () => {
        const info = log.info;
        if (!info) return;
        setText(head, `${app.logs.length > 1 ? `${"AB"[log.index]}  ` : ""}${info.name}${info.live ? ""
            : `, ${bytesText(info.bytes)}`}`);
        topics.set(info.topics);
        setText(config, info.config ?? "The log holds no configuration.");
        facts.replaceChildren(...info.metadata.flatMap((m) =>
            m.entries.flatMap(([key, value]) => [el("dt", {}, `${m.name} ${key}`), el("dd", {}, value)])));
      });
      app.on(["frame", "settings"], () => {
        if (app.state.tab !== "log") return;
        const { requests, bytes, opened } = log.traffic;
        setText(traffic, log.info?.live
            ? `${log.received} frames received, ${log.dropped} of them not drawn because newer ones had come` :
          `read so far: ${requests} requests, ${bytesText(bytes)}${opened
              ? `; to open: ${opened.requests} requests, ${bytesText(opened.bytes)}` : ""}`);
        counters.set(Object.entries(log.frame?.counters ?? {}).flatMap(([name, value]) =>
          (Array.isArray(value) ? value.map((v, i) => ({ name: `${name}[${i}]`, value: v }))
              : [{ name, value }])).filter((r) => r.value !== 0));
      });
    }
    this.root.append(el("p", {}, el("a", { href: "THIRD_PARTY.txt", target: "_blank", rel: "noopener" },
        "licences of the packages that this page contains")));
  }
}
