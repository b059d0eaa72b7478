// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A file on the server, read in ranges. A server that does not answer is asked again until it does; a file that changed
// is never read further.
import type { FaultKind } from "../types";

export class Fault extends Error {
  constructor(readonly kind: FaultKind, text: string) { super(text); }
}

const kFirstWait_ms = 250, kLongestWait_ms = 4000;

export class RangeFile {
  requests = 0;
  bytes = 0;
  private changed = false;
  private gone = false;

  constructor(readonly url: string, readonly length: number, private readonly etag: string | null,
              private readonly report: (fault: Fault) => void) {}

  async read(offset: number, length: number): Promise<Uint8Array> {
    if (length === 0) return new Uint8Array(0);
    if (offset < 0 || offset + length > this.length)
      throw new Fault("damaged", "The log ends before a record that its index names.");
    for (let wait_ms = kFirstWait_ms; ; wait_ms = Math.min(2 * wait_ms, kLongestWait_ms)) {
      if (this.changed) throw this.changeFault();
      let body: Uint8Array | null = null;
      try {
        body = await this.request(offset, length);
      } catch (error) {
        if (error instanceof Fault) throw error;
      }
      if (body) {
        if (this.gone) this.report(new Fault("back", "The server answers again."));
        this.gone = false;
        this.bytes += body.length;
        return body;
      }
      this.gone = true;
      this.report(new Fault("gone",
          "The server does not answer. Is `overtake view` still running? The page keeps asking."));
      await new Promise((done) => setTimeout(done, wait_ms));
    }
  }

  private async request(offset: number, length: number): Promise<Uint8Array> {
    const headers: Record<string, string> = { Range: `bytes=${offset}-${offset + length - 1}` };
    if (this.etag) headers["If-Match"] = this.etag;
    ++this.requests;
    const response = await fetch(this.url, { headers, cache: "no-store" });
    if (response.status === 412 || response.status === 416 || response.status === 404 || response.status === 410) {
      this.changed = true;
      throw this.changeFault();
    }
    if (response.status !== 206)
      throw new Fault("unknown", `The server answered ${response.status} to a request for a part of the log.`);
    const body = new Uint8Array(await response.arrayBuffer());
    if (body.length !== length) throw new Error("the transfer ended early");
    return body;
  }

  private changeFault(): Fault {
    return new Fault("changed",
        "The log changed while it was open: another run wrote it anew, or it is gone. "
            + "Reload the page to read it from the start.");
  }
}
