// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads one log, or one live run. Of several requests for a frame only the newest is answered; the background work
// stops
// for each request.
import { LiveReader } from "./reader/live_reader";
import { LogReader } from "./reader/log_reader";
import { Fault } from "./reader/range_file";
import type { Frame, FromWorker, ToWorker } from "./types";

const scope = self as unknown as { postMessage(message: FromWorker, transfer: Transferable[]): void;
    onmessage: ((event: MessageEvent<ToWorker>) => void) | null };
const post = (message: FromWorker, transfer: Transferable[] = []): void => scope.postMessage(message, transfer);

type FrameRequest = Extract<ToWorker, { type: "frame" }>;
let reader: LogReader | null = null;
let wanted: FrameRequest | null = null;
const numbersWanted: FrameRequest[] = [];  // of two logs' comparison: all are answered
let running = false;
let live: LiveReader | null = null;

function buffersOf(frame: Frame): Transferable[] {
  return [...frame.clouds.flatMap((c) => [c.position.buffer, ...Object.values(c.fields).map((f) => f.buffer)]),
          ...frame.images.map((i) => i.values.buffer), frame.road.z_m.buffer];
}

function report(error: unknown): void {
  if (error instanceof Fault) post({ type: "fault", kind: error.kind, text: error.message });
  else post({ type: "fault", kind: "damaged",
      text: `The log cannot be read: ${error instanceof Error ? error.message : String(error)}.` });
}

async function answer(request: FrameRequest): Promise<void> {
  try {
    const frame = await reader!.readFrame(request.index, request.images, request.numbersOnly);
    if (frame) post({ type: "frame", id: request.id, frame, traffic: reader!.traffic }, buffersOf(frame));
    else post({ type: "noframe", id: request.id });
    if (frame && request.ahead && !wanted) await reader!.readAhead();
  } catch (error) {
    report(error);
    post({ type: "noframe", id: request.id });
  }
}

async function pump(): Promise<void> {
  if (running || !reader) return;
  running = true;
  for (;;) {
    await new Promise((done) => setTimeout(done, 0));  // lets newer requests in
    const request = wanted ?? numbersWanted.shift();
    if (request === wanted) wanted = null;
    if (request) {
      await answer(request);
      continue;
    }
    try {
      if (!await reader.step()) break;
    } catch (error) {
      report(error);
      break;
    }
  }
  running = false;
  if (wanted || numbersWanted.length > 0) void pump();
}

scope.onmessage = async ({ data }) => {
  if (data.type === "open") {
    const opening = new LogReader(data.entry, post);
    try {
      await opening.open();
      reader = opening;
    } catch (error) {
      report(error);
    }
  } else if (data.type === "connect") {
    live = new LiveReader(data.url, post, buffersOf);
    live.connect();
  } else if (data.type === "frame") {
    if (live) live.setImages(data.images);
    else if (data.numbersOnly) numbersWanted.push(data);
    else wanted = data;
  } else if (data.type === "history") {
    reader?.wantHistory(data.center, data.all);
  }
  void pump();
};
