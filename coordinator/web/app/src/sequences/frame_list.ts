// The frames of one sequence, asked for again and again: all at first, then what changed since.
import { Cleanup } from "../dom";
import { store } from "../store";
import { fetchFrames } from "./requests";
import type { Frame, Sequence } from "./types";

const kSpacingMs = 1000;
const kSlowSpacingMs = 5000; // once nothing is left to come, but for what somebody does to it

export class FrameList {
  sequence: Sequence | undefined;
  /** In the order of their numbers. */
  frames: Frame[] = [];
  problem = "";
  /** All pages have come once. */
  complete = false;
  private readonly places = new Map<string, number>();
  private readonly abort = new AbortController();
  private since = 0;
  private instance = store.session?.instance;
  private timer = 0;
  private busy = false;

  /** `changed` is told the frames that changed, and whether others are at other places than before. */
  constructor(
    private readonly id: string,
    private readonly changed: (frames: Frame[], moved: boolean) => void,
    cleanup: Cleanup,
  ) {
    const visible = () => this.poll();
    document.addEventListener("visibilitychange", visible);
    cleanup.add(() => {
      document.removeEventListener("visibilitychange", visible);
      clearTimeout(this.timer);
      this.abort.abort();
    });
  }

  place(job: string): number | undefined {
    return this.places.get(job);
  }
  /** What an action answered. */
  put(sequence: Sequence): void {
    this.sequence = sequence;
    this.changed([], false);
    this.poll();
  }
  /** Looks now, and then again and again. */
  poll(): void {
    clearTimeout(this.timer);
    if (this.busy || document.hidden || this.abort.signal.aborted) return;
    this.busy = true;
    this.look()
      .then(() => (this.problem = ""))
      .catch((error: unknown) => {
        if (this.abort.signal.aborted) return;
        this.problem = error instanceof Error ? error.message : String(error);
        this.changed([], false);
      })
      .finally(() => {
        this.busy = false;
        if (this.abort.signal.aborted) return;
        const state = this.sequence?.state;
        const ended = state === "done" || state === "failed" || state === "cancelled";
        this.timer = window.setTimeout(() => this.poll(), ended && !this.problem ? kSlowSpacingMs : kSpacingMs);
      });
  }

  private async look(): Promise<void> {
    // Another process counts its versions anew.
    const instance = store.session?.instance;
    if (this.instance && instance !== this.instance) this.since = 0;
    this.instance = instance;
    let next: number | undefined;
    let version: number | undefined;
    do {
      const page = await fetchFrames(this.id, this.since, next, this.abort.signal);
      if (page.sequence) {
        this.sequence = page.sequence;
        version = page.sequence.version;
      }
      next = page.next;
      this.take(page.frames);
    } while (next !== undefined);
    // Frames that change while pages are read are told once more by the next look.
    if (version !== undefined) this.since = version;
    if (!this.complete) {
      this.complete = true;
      this.changed([], false);
    }
  }
  private take(frames: Frame[]): void {
    let moved = false;
    for (const frame of frames) {
      const place = this.places.get(frame.id);
      if (place !== undefined) {
        this.frames[place] = frame;
        continue;
      }
      if (this.frames.length > 0 && this.frames.at(-1)!.number > frame.number) moved = true;
      this.places.set(frame.id, this.frames.length);
      this.frames.push(frame);
    }
    // Frames are added later, too, and may come between.
    if (moved) {
      this.frames.sort((a, b) => a.number - b.number);
      this.frames.forEach((frame, i) => this.places.set(frame.id, i));
    }
    this.changed(frames, moved);
  }
}
