// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: node tests/node/read_live.js URL PROTOCOL MODE
//
// A client of a live run, by @foxglove/ws-protocol. MODE:
//   all       subscribes to every channel, decodes every message, ends with the run
//   numbers   the same, of the topics that end in /numbers, a second after it learned of them
//   stall     subscribes to every channel, reads until the first message of a frame and then never again
//   twice     as all, but leaves after 20 messages and connects again
// The last line of output is JSON: messages by topic, statuses, connections. Exit code 77 if modules are missing.
"use strict";

let protocol, ws, decoding;
try {
  protocol = require("@foxglove/ws-protocol");
  ws = require("ws");
  decoding = require("./decoders.js");
} catch (error) {
  if (error.code !== "MODULE_NOT_FOUND") throw error;
  console.log("skipped: node modules for tests are not installed (tools/setup --node)");
  process.exit(77);
}

const [url, subprotocol, mode] = process.argv.slice(2);
const fail = (text) => { console.log("FAILED: " + text); process.exitCode = 1; };
decoding.onFault(fail);
const seen = { connections: 0, messages: {}, statuses: [], order: true };

function connect() {
  const socket = new ws.WebSocket(url, [subprotocol], { perMessageDeflate: true });
  const client = new protocol.FoxgloveClient({ ws: socket });
  const channels = new Map(), decoders = new Map();
  let count = 0, last = 0n, info = false, begun = false;
  ++seen.connections;
  client.on("open", () => { if (socket.protocol !== subprotocol) fail(`the subprotocol is '${socket.protocol}'`); });
  client.on("serverInfo", (event) => {
    info = true;
    if (!event.name.startsWith("overtake ")) fail(`the server's name is '${event.name}'`);
  });
  client.on("status", (event) => seen.statuses.push(event.message));
  client.on("advertise", (list) => {
    if (!info) fail("channels come before serverInfo");
    const subscribe = () => {
      for (const channel of list)
        if (mode !== "numbers" || channel.topic.endsWith("/numbers")) channels.set(client.subscribe(channel.id), channel);
    };
    if (mode === "numbers") setTimeout(subscribe, 1000);
    else subscribe();
  });
  client.on("message", (event) => {
    const channel = channels.get(event.subscriptionId);
    if (!channel) return fail(`a message of subscription ${event.subscriptionId}, which is not there`);
    if (!decoders.has(channel.id)) {
      const data = channel.schemaEncoding === "protobuf" ? Buffer.from(channel.schema, "base64") : Buffer.from(channel.schema);
      decoders.set(channel.id, decoding.decoderOf({ name: channel.schemaName, data }, channel.encoding));
    }
    try {
      decoders.get(channel.id)(new Uint8Array(event.data.buffer, event.data.byteOffset, event.data.byteLength));
    } catch (error) {
      fail(`a message on ${channel.topic}: ${error.message}`);
    }
    if (channel.topic === "/times") {
      if (event.timestamp < last) seen.order = false;
      last = event.timestamp;
    }
    seen.messages[channel.topic] = (seen.messages[channel.topic] ?? 0) + 1;
    ++count;
    const begins = channel.topic !== "/map" && !begun;  // the map may come before the other channels are told
    if (begins) console.log("first message");
    begun ||= begins;
    if (mode === "stall" && begins) {
      socket._socket.pause();
      setInterval(() => {}, 1000);  // a paused socket alone does not keep node from ending
    }
    if (mode === "twice" && count === 20 && seen.connections === 1) client.close();
  });
  client.on("error", (error) => { if (mode !== "stall") fail(`the connection: ${error.message}`); });
  client.on("close", () => {
    if (mode === "twice" && seen.connections === 1) return connect();
    console.log(JSON.stringify(seen));
    process.exit();
  });
}
connect();
