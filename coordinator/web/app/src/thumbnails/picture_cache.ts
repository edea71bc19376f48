// Small pictures of the jobs or frames that are wanted now, a few fetched at a time. The others are dropped, the
// least recently wanted first.
import { fetchReduced, fetchThumbnail, type SmallPicture } from "./small_pictures";

/** A job, or a frame of a sequence. */
export interface Pictured {
  id: string;
  state: string;
  spp: number;
}

/** Where pictures come from, how many are kept beyond those that are wanted, and how many are fetched at once. */
export interface PictureOptions {
  load: (job: string, signal: AbortSignal) => Promise<SmallPicture | undefined>;
  most: number;
  atOnce: number;
  spacingMs: number; // between two fetches of a job's picture
  againMs: number; // after one that failed, or was a little old
}

/** Pictures of at most `side` pixels, as new as they can be. */
export function reducedPictures(side: number, most: number, atOnce: number): PictureOptions {
  return { load: (job, signal) => fetchReduced(job, side, signal), most, atOnce, spacingMs: 2000, againMs: 1000 };
}
/** Thumbnails, which the coordinator has at hand, and makes anew seldom. */
export function thumbnails(most: number): PictureOptions {
  return { load: fetchThumbnail, most, atOnce: 6, spacingMs: 15000, againMs: 3000 };
}

interface Entry {
  canvas?: HTMLCanvasElement;
  /** State and samples of the frame that it shows. */
  mark: string;
  next: number;
}

/** Whether there is anything to see of it. */
export function hasPicture(frame: Pictured): boolean {
  return frame.spp > 0;
}

const markOf = (frame: Pictured) => `${frame.state} ${frame.spp}`;

export class PictureCache {
  private readonly entries = new Map<string, Entry>(); // least recently wanted first
  private readonly running = new Map<string, AbortController>();
  private wanted: Pictured[] = [];
  private timer = 0;
  private closed = false;

  constructor(
    private readonly options: PictureOptions,
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
  want(frames: Pictured[]): void {
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
      if (this.entries.size <= Math.max(this.options.most, ids.size)) break;
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
      if (this.running.size >= this.options.atOnce) return;
      const entry = this.entries.get(frame.id);
      if (this.running.has(frame.id) || entry?.mark === markOf(frame)) continue;
      if (entry && entry.next > now) soonest = Math.min(soonest, entry.next);
      else void this.fetch(frame);
    }
    if (soonest < Infinity) this.timer = window.setTimeout(() => this.pump(), soonest - now);
  }
  private async fetch(frame: Pictured): Promise<void> {
    const abort = new AbortController();
    this.running.set(frame.id, abort);
    const old = this.entries.get(frame.id);
    try {
      const picture = await this.options.load(frame.id, abort.signal);
      const fresh = picture && !picture.stale;
      const wait = fresh ? this.options.spacingMs : this.options.againMs;
      this.entries.set(frame.id, { ...old, ...(picture && { canvas: picture.canvas }), mark: fresh ? markOf(frame) : "", next: performance.now() + wait });
    } catch {
      if (!abort.signal.aborted) this.entries.set(frame.id, { ...old, mark: "", next: performance.now() + this.options.againMs });
    } finally {
      this.running.delete(frame.id);
    }
    if (this.closed) return;
    if (!abort.signal.aborted) this.changed(frame.id);
    this.pump();
  }
}
