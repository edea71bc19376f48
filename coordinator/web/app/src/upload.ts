// Sends files to the coordinator: each under its digest, in pieces, and what it has already not again.
import { sha256 } from "@noble/hashes/sha2";
import { bytesToHex } from "@noble/hashes/utils";

import { failure } from "./api";

const kPieceBytes = 1 << 20; // what the coordinator, and most servers in between, take at once
const kAskFirstBytes = 1 << 16; // of larger files it is asked first whether they are there
const kTries = 8;
const kFirstDelayMs = 500;

export interface Sent {
  name: string;
  digest: string;
  size: number;
}

const digests = new WeakMap<File, string>();

/** crypto.subtle would need all of a file in memory, and a page over TLS. */
export async function digestOf(file: File, signal: AbortSignal): Promise<string> {
  const known = digests.get(file);
  if (known) return known;
  const hash = sha256.create();
  const reader = file.stream().getReader();
  for (;;) {
    signal.throwIfAborted();
    const { done, value } = await reader.read();
    if (done) break;
    hash.update(value);
  }
  const digest = bytesToHex(hash.digest());
  digests.set(file, digest);
  return digest;
}

const pause = (ms: number) => new Promise((resolve) => setTimeout(resolve, ms));

/** Again after a while where it says that it is busy or, unless the request should not come `once` too often, nobody
 * answers: connections get lost, and come back. */
export async function insist(request: () => Promise<Response>, signal: AbortSignal, once = false): Promise<Response> {
  for (let tried = 1; ; tried++) {
    let problem: Error;
    try {
      const answer = await request();
      if (answer.ok) return answer;
      problem = await failure(answer);
      if (answer.status !== 429 && answer.status !== 503) throw problem;
    } catch (error) {
      // What fetch throws when nobody answers is a TypeError.
      if (!(error instanceof TypeError)) throw error;
      if (once) throw new Error("the connection was lost; the list of jobs tells whether the job is there");
      problem = new Error("the coordinator can't be reached");
    }
    if (tried === kTries) throw problem;
    await pause(kFirstDelayMs * 1.6 ** tried);
    signal.throwIfAborted();
  }
}

/** Sends one file. `told` gets how many more bytes are there. */
export async function sendFile(file: File, told: (bytes: number) => void, signal: AbortSignal): Promise<{ digest: string; size: number }> {
  const digest = await digestOf(file, signal);
  let at = 0;
  for (let first = true; ; first = false) {
    const length = first && file.size > kAskFirstBytes ? 0 : kPieceBytes;
    // Not sent as a file: the browser would refuse those that changed in a way that says nothing.
    const piece = await file.slice(at, at + length).arrayBuffer();
    const answer = await insist(
      () => fetch(`/api/v1/blobs/${digest}?size=${file.size}&offset=${at}`, {
        method: "PUT", headers: { "X-Lightmill": "1", "Content-Type": "application/octet-stream" }, body: piece, signal,
      }),
      signal,
    );
    const { received, complete } = (await answer.json()) as { received: number; complete: boolean };
    told(received - at);
    at = received;
    if (complete) return { digest, size: file.size };
  }
}
