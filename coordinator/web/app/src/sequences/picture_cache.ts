// Small pictures of the frames that are wanted now, a few fetched at a time. The others are dropped, the least
// recently wanted first.
import { toned } from "../tone";
import { fetchSmallPicture } from "./requests";
import type { Frame } from "./types";

const kLeastSpacingMs = 2000; // between two fetches of a frame's picture
const kAgainMs = 1000; // after one that failed, or was a little old

interface Entry {
  canvas?: HTMLCanvasElement;
  /** State and samples of the frame that it shows. */
  mark: string;
  next: number;
}

/** Whether there is anything to see of it. */
export function hasPicture(frame: Frame): boolean {
  return frame.spp > 0;
}

const markOf = (frame: Frame) => `${frame.state} ${frame.spp}`;

export class PictureCache {
  private readonly entries = new Map<string, Entry>(); // least recently wanted first
  private readonly running = new Map<string, AbortController>();
  private wanted: Frame[] = [];
  private timer = 0;
  private closed = false;

  /** Pictures of at most `side` pixels, at most `most` beyond those that are wanted. */
  constructor(
    private readonly side: number,
    private readonly most: number,
    private readonly atOnce: number,
    private readonly changed: (job: string) => void,
  ) {}

  get(job: string): HTMLCanvasElement | undefined {
    return this.entries.get(job)?.canvas;
  }
  /** How many are kept. */
  get size(): number {
    return this.entries.size;
  }
  /** These are fetched, the first of them first, and those that are not among them no more. */
  want(frames: Frame[]): void {
    this.wanted = frames.filter(hasPicture);
    const ids = new Set(this.wanted.map((frame) => frame.id));
    for (const [job, abort] of this.running) if (!ids.has(job)) abort.abort();
    for (const id of ids) {
      const entry = this.entries.get(id);
      if (!entry) continue;
      this.entries.delete(id);
      this.entries.set(id, entry);
    }
    for (const id of this.entries.keys()) {
      if (this.entries.size <= Math.max(this.most, ids.size)) break;
      if (!ids.has(id)) this.entries.delete(id);
    }
    this.pump();
  }
  close(): void {
    this.closed = true;
    clearTimeout(this.timer);
    for (const abort of this.running.values()) abort.abort();
    this.entries.clear();
    this.wanted = [];
  }

  private pump(): void {
    clearTimeout(this.timer);
    if (this.closed || document.hidden) return;
    const now = performance.now();
    let soonest = Infinity;
    for (const frame of this.wanted) {
      if (this.running.size >= this.atOnce) return;
      const entry = this.entries.get(frame.id);
      if (this.running.has(frame.id) || entry?.mark === markOf(frame)) continue;
      if (entry && entry.next > now) soonest = Math.min(soonest, entry.next);
      else void this.fetch(frame);
    }
    if (soonest < Infinity) this.timer = window.setTimeout(() => this.pump(), soonest - now);
  }
  private async fetch(frame: Frame): Promise<void> {
    const abort = new AbortController();
    this.running.set(frame.id, abort);
    const old = this.entries.get(frame.id);
    try {
      const picture = await fetchSmallPicture(frame.id, this.side, abort.signal);
      const canvas = document.createElement("canvas");
      canvas.width = picture.width;
      canvas.height = picture.height;
      canvas.getContext("2d")!.putImageData(toned(picture, 0, "srgb"), 0, 0);
      const stale = picture.stale ?? false;
      this.entries.set(frame.id, { canvas, mark: stale ? "" : markOf(frame), next: performance.now() + (stale ? kAgainMs : kLeastSpacingMs) });
    } catch {
      if (!abort.signal.aborted) this.entries.set(frame.id, { ...old, mark: "", next: performance.now() + kAgainMs });
    } finally {
      this.running.delete(frame.id);
    }
    if (this.closed) return;
    if (!abort.signal.aborted) this.changed(frame.id);
    this.pump();
  }
}
