// One picture that follows a job: fetched when the job got on, and toned when it is drawn.
import { fetchPicture, type Picture, type PictureKind } from "./api";
import { store } from "./store";
import { type Curve, errorColours, errorScale, type ErrorScale, toned } from "./tone";

const kLeastSpacingMs = 1500; // between two fetches of a picture

export class PictureSource {
  picture: Picture | undefined;
  image: HTMLCanvasElement | undefined;
  scale: ErrorScale | undefined;
  problem = "";
  private fetched = "";
  private next = 0;
  private busy = false;
  private abort = new AbortController();
  private timer = 0;
  constructor(
    readonly job: string,
    readonly kind: PictureKind,
    private readonly changed: () => void,
  ) {}

  /** Fetches if the job got on since, no sooner than is good for both sides. */
  poll(): void {
    const row = store.job(this.job);
    if (!row || this.busy || document.hidden || store.connection.state === "lost") return;
    const mark = `${row.spp} ${row.state}`;
    if (mark === this.fetched) return;
    const now = performance.now();
    if (now < this.next) {
      clearTimeout(this.timer);
      this.timer = window.setTimeout(() => this.poll(), this.next - now);
      return;
    }
    this.busy = true;
    fetchPicture(this.job, this.kind, this.picture, this.abort.signal)
      .then((picture) => {
        if (!picture) {
          // None yet, or not any more: then the last one stays.
          if (this.picture) this.picture.stale = true;
          this.problem = row.packets_done > 0 ? "being denoised: that takes a while…" : "";
          this.fetched = row.packets_done === 0 && row.state !== "running" ? mark : "";
          return;
        }
        const same = picture.half !== undefined && picture.half === this.picture?.half;
        this.picture = picture.width > 0 && picture.height > 0 ? picture : undefined;
        this.problem = this.picture ? "" : "not enough samples yet to tell the noise";
        if (!same) this.image = undefined;
        this.fetched = picture.stale ? "" : mark;
      })
      .catch((error: unknown) => {
        this.problem = error instanceof Error ? error.message : String(error);
      })
      .finally(() => {
        if (this.abort.signal.aborted) return;
        this.busy = false;
        const took = performance.now() - now;
        this.next = performance.now() + Math.max(kLeastSpacingMs, 3 * took);
        this.changed();
        this.poll(); // the job may have got on, or the try may have failed
      });
  }
  /** Drawn anew only when the picture or the tones changed. */
  canvas(exposure: number, curve: Curve): HTMLCanvasElement | undefined {
    if (!this.picture) return undefined;
    if (!this.image) {
      this.image = document.createElement("canvas");
      this.image.width = this.picture.width;
      this.image.height = this.picture.height;
      if (this.kind === "error-map") this.scale = errorScale(this.picture);
      const data = this.scale ? errorColours(this.picture, this.scale) : toned(this.picture, exposure, curve);
      this.image.getContext("2d")!.putImageData(data, 0, 0);
    }
    return this.image;
  }
  close(): void {
    clearTimeout(this.timer);
    this.abort.abort();
  }
}
