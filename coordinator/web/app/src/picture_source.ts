// One picture that follows a job: fetched when the job got on, and toned when it is drawn.
import { fetchPicture, type Picture, type PictureKind } from "./api";
import { store } from "./store";
import { type Curve, errorColours, errorScale, type ErrorScale, toned } from "./tone";

const kLeastSpacingMs = 1500; // between two fetches of a picture
const kUnreadSpacingMs = 250; // while the light of a mix is being read, which is soon done

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
  private query = "";
  /** `before` is shown until there is a picture. */
  constructor(
    readonly job: string,
    readonly kind: PictureKind,
    private readonly changed: () => void,
    private before?: PictureSource,
  ) {
    if (before && !before.picture) this.before = before.before;
  }

  /** From now on with this query; asks for it as soon as the answer under way is there. */
  ask(query: string): void {
    if (query === this.query) return;
    this.query = query;
    this.next = 0;
    this.poll();
  }

  /** Fetches if the job got on since, no sooner than is good for both sides. */
  poll(): void {
    const row = store.job(this.job);
    if (!row || this.busy || document.hidden || store.connection.state === "lost") return;
    const query = this.query;
    const mark = `${row.spp} ${row.state} ${query}`;
    if (mark === this.fetched) return;
    const now = performance.now();
    if (now < this.next) {
      clearTimeout(this.timer);
      this.timer = window.setTimeout(() => this.poll(), this.next - now);
      return;
    }
    this.busy = true;
    let spacing = kLeastSpacingMs;
    fetchPicture(this.job, this.kind, query, this.picture, this.abort.signal)
      .then((picture) => {
        if (!picture) {
          // None yet, or not any more: then the last one stays.
          if (this.picture) this.picture.stale = true;
          const mixed = this.kind === "light-mix";
          if (mixed && row.packets_done > 0) spacing = kUnreadSpacingMs;
          this.problem = row.packets_done === 0 ? "" : mixed ? "reading the light of the groups…" : "being denoised: that takes a while…";
          this.fetched = row.packets_done === 0 && row.state !== "running" ? mark : "";
          return;
        }
        const same = picture.half !== undefined && picture.half === this.picture?.half;
        this.picture = picture.width > 0 && picture.height > 0 ? picture : undefined;
        this.problem = this.picture ? "" : "not enough samples yet to tell the noise";
        if (this.picture) this.before = undefined;
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
        this.next = query === this.query ? performance.now() + Math.max(spacing, 3 * took) : 0;
        this.changed();
        this.poll(); // the job may have got on, or the try may have failed
      });
  }
  /** Drawn anew only when the picture or the tones changed. */
  canvas(exposure: number, curve: Curve): HTMLCanvasElement | undefined {
    if (!this.picture) return this.before?.canvas(exposure, curve);
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
  /** The tones are others now. */
  retone(): void {
    if (this.kind !== "error-map") this.image = undefined;
    this.before?.retone();
  }
  close(): void {
    clearTimeout(this.timer);
    this.abort.abort();
  }
}
