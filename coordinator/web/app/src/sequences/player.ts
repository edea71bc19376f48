// The chosen frame, large, and the sequence as it moves. A frame is shown once its picture is there, so playing
// waits for slow ones; frames without a picture are passed over.
import { Cleanup, h, perFrame, setText } from "../dom";
import { hasPicture, PictureCache, reducedPictures } from "../thumbnails/picture_cache";
import type { Frame } from "./types";

const kSide = 960; // of a picture
const kMostKept = 72; // pictures: up to about 150 MB
const kAhead = 24; // frames that are fetched before they are played
const kAtOnce = 4; // fetches
const kMostWaitMs = 4000; // for a frame's picture, before it is passed over

export class Player {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", { role: "img", "aria-label": "Picture of the frame" });
  private readonly message = h("div", { class: "viewer-message" });
  private readonly status = h("span", { class: "mono" });
  private readonly playButton = h("button", { type: "button", title: "play, pause (space)", onclick: () => this.toggle() });
  private readonly loopButton = h("button", { type: "button", title: "begin anew at the end (l)", onclick: () => this.toggleLoop() }, "Loop");
  private readonly scrub = h("input", { type: "range", class: "scrub", min: "0", max: "0", step: "1", value: "0", "aria-label": "Frame", oninput: () => this.choose(Number(this.scrub.value)) });
  private readonly cache: PictureCache;
  private readonly draw: () => void;
  private frames: Frame[] = [];
  private place = 0;
  private fps = 24;
  private playing = false;
  private loop = true;
  private due = 0; // when the next frame is to come
  private request = 0;

  constructor(
    private readonly choose: (place: number) => void,
    private readonly thumbnail: (job: string) => HTMLCanvasElement | undefined,
    cleanup: Cleanup,
  ) {
    this.draw = perFrame(() => this.drawNow());
    this.cache = new PictureCache(reducedPictures(kSide, kMostKept, kAtOnce), this.draw);
    const button = (text: string, label: string, run: () => void) => h("button", { type: "button", title: label, "aria-label": label, onclick: run }, text);
    this.element = h("section", { class: "viewer player", "aria-label": "Player" },
      h("div", { class: "stage" }, this.canvas, this.message),
      h("div", { class: "viewer-tools" },
        button("|◂", "first frame (Home)", () => this.choose(0)), button("◂", "frame before (←)", () => this.step(-1)), this.playButton,
        button("▸", "next frame (→)", () => this.step(1)), button("▸|", "last frame (End)", () => this.choose(this.frames.length - 1)),
        this.loopButton, this.scrub, this.status));
    const observer = new ResizeObserver(this.draw);
    observer.observe(this.canvas);
    document.addEventListener("visibilitychange", this.draw);
    cleanup.add(() => {
      observer.disconnect();
      document.removeEventListener("visibilitychange", this.draw);
      cancelAnimationFrame(this.request);
      this.cache.close();
    });
    this.showButtons();
  }

  show(frames: Frame[], place: number, fps: number): void {
    this.frames = frames;
    this.place = place;
    this.fps = fps > 0 ? fps : 24;
    this.draw();
  }
  /** It plays. */
  get moves(): boolean {
    return this.playing;
  }
  key(key: string): boolean {
    const keys: { [key: string]: () => void } = {
      " ": () => this.toggle(),
      l: () => this.toggleLoop(),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      Home: () => this.choose(0),
      End: () => this.choose(this.frames.length - 1),
    };
    const run = keys[key];
    run?.();
    return !!run;
  }

  private step(by: number): void {
    this.choose(Math.min(this.frames.length - 1, Math.max(0, this.place + by)));
  }
  private toggleLoop(): void {
    this.loop = !this.loop;
    this.showButtons();
  }
  private toggle(): void {
    this.playing = !this.playing && this.frames.some(hasPicture);
    cancelAnimationFrame(this.request);
    if (this.playing) {
      if (this.next() === undefined) this.choose(Math.max(0, this.frames.findIndex(hasPicture)));
      this.due = performance.now() + 1000 / this.fps;
      this.request = requestAnimationFrame((now) => this.advance(now));
    }
    this.showButtons();
    this.draw();
  }
  private showButtons(): void {
    setText(this.playButton, this.playing ? "▮▮" : "▶");
    this.playButton.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.loopButton.setAttribute("aria-pressed", String(this.loop));
  }
  /** The place of the next frame with a picture. */
  private next(from = this.place): number | undefined {
    const count = this.frames.length;
    for (let i = from + 1; i < (this.loop ? from + 1 + count : count); i++) {
      if (hasPicture(this.frames[i % count]!)) return i % count;
    }
    return undefined;
  }
  private advance(now: number): void {
    if (!this.playing) return;
    this.request = requestAnimationFrame((time) => this.advance(time));
    if (now < this.due) return;
    const to = this.next();
    if (to === undefined) return this.toggle();
    if (!this.cache.get(this.frames[to]!.id) && now < this.due + kMostWaitMs) return;
    // What was late is not made up for by haste.
    const spacing = 1000 / this.fps;
    this.due = Math.max(this.due + spacing, now);
    this.choose(to);
  }
  private wantPictures(): void {
    const wanted: Frame[] = [];
    const count = this.frames.length;
    for (let i = 0, at: number | undefined = this.place; at !== undefined && i < Math.min(count, this.playing ? kAhead : 3); i++) {
      wanted.push(this.frames[at]!);
      at = this.next(at);
    }
    const before = this.frames[this.place - 1];
    if (!this.playing && before) wanted.push(before);
    this.cache.want(wanted);
  }
  private drawNow(): void {
    const frame = this.frames[this.place];
    this.scrub.max = String(Math.max(0, this.frames.length - 1));
    this.scrub.value = String(this.place);
    this.scrub.setAttribute("aria-valuetext", frame ? `frame ${frame.number}` : "none");
    setText(this.status, frame ? `frame ${frame.number} · ${this.frames[0]!.number} … ${this.frames.at(-1)!.number} · ${this.fps} fps` : "");
    if (!frame) return;
    this.wantPictures();
    const large = this.cache.get(frame.id);
    const image = hasPicture(frame) ? large ?? this.thumbnail(frame.id) : undefined;
    this.canvas.dataset["frame"] = image ? String(frame.number) : "";
    this.canvas.dataset["ready"] = String(!!large);
    this.canvas.setAttribute("aria-label", `Picture of frame ${frame.number}`);
    const text = hasPicture(frame) ? "loading the picture…" : frame.state === "failed" ? `failed: ${frame.message ?? ""}` : `${frame.state}: no picture yet`;
    setText(this.message, image ? "" : text);
    this.message.hidden = !!image;
    this.paint(image);
  }
  private paint(image: HTMLCanvasElement | undefined): void {
    const { canvas } = this;
    const width = Math.round(canvas.clientWidth * devicePixelRatio);
    const height = Math.round(canvas.clientHeight * devicePixelRatio);
    if (width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const g = canvas.getContext("2d")!;
    g.clearRect(0, 0, width, height);
    if (!image) return;
    const scale = Math.min(width / image.width, height / image.height);
    g.imageSmoothingQuality = "high";
    g.drawImage(image, (width - image.width * scale) / 2, (height - image.height * scale) / 2, image.width * scale, image.height * scale);
  }
}
