// The picture of a job: zoom, pan, exposure, where the noise is, without noise, and another job beside it.
import type { PictureKind } from "./api";
import { Cleanup, h, perFrame, setText } from "./dom";
import { PictureSource } from "./picture_source";
import { store } from "./store";
import type { Curve } from "./tone";
import { drawDivider, drawLegend, drawNote, valueText } from "./viewer_parts";

const kMovingSide = 800; // kSmallMix of coordinator/web/light_mix, which has it at hand
const kCurves: Curve[] = ["srgb", "filmic", "aces", "none"];

export class Viewer {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", { tabIndex: 0, role: "img", "aria-label": "Picture of the job. Arrows move it, plus and minus zoom." });
  private readonly legend = h("div", { class: "legend", hidden: true });
  private readonly status = h("div", { class: "viewer-status mono" });
  private readonly note = h("p", { class: "viewer-note", role: "status", hidden: true });
  private readonly message = h("div", { class: "viewer-message" });
  private readonly exposureInput = h("input", { type: "range", min: "-10", max: "10", step: "0.25", value: "0", "aria-label": "Exposure in stops", oninput: () => this.expose(Number(this.exposureInput.value)) });
  private readonly exposureText = h("output", { class: "mono" }, "0");
  private readonly splitInput = h("input", { type: "range", min: "0", max: "1", step: "0.005", value: "0.5", class: "split", hidden: true, "aria-label": "Divider between A and B", oninput: () => { this.split = Number(this.splitInput.value); this.draw(); } });
  private readonly errorButton = h("button", { type: "button", title: "where the noise is (n)", "aria-pressed": "false", onclick: () => this.toggle("error-map") }, "Noise");
  private readonly denoisedButton = h("button", { type: "button", title: "without most of its noise (o)", "aria-pressed": "false", onclick: () => this.toggle("denoised") }, "Denoised");
  private readonly mixButton = h("button", { type: "button", title: "as the sliders beside it mix the lights (m)", "aria-pressed": "false", hidden: true, onclick: () => this.toggle("light-mix") }, "Light mix");
  private readonly zoomText = h("output", { class: "mono" });
  private readonly other = h("select", { "aria-label": "Compare with", title: "another job beside this one (b)", onchange: () => this.compare(this.other.value) });
  private readonly png = h("a", { title: "as it shows here" }, "PNG");
  private a: PictureSource;
  private b: PictureSource | undefined;
  private kind: PictureKind = "image";
  private mix = "?mix=";
  private exposure = 0;
  private curve: Curve = "srgb";
  private split = 0.5;
  /** Screen pixels per picture pixel; 0: fitted. */
  private zoom = 0;
  private x = 0; // of the picture's middle, in picture pixels from the centre of the view
  private y = 0;
  private pointer: { x: number; y: number } | undefined;
  private readonly draw: () => void;
  private choices = "?";

  constructor(
    private readonly job: string,
    cleanup: Cleanup,
    private readonly picked: (other: string) => void,
  ) {
    this.draw = perFrame(() => this.drawNow());
    this.a = new PictureSource(job, "image", this.draw);
    const curves = h("select", { "aria-label": "View: tone curve", title: "tone curve, as --view of lightmill fetch", onchange: () => { this.curve = curves.value as Curve; this.retone(); } },
      ...kCurves.map((name) => h("option", { value: name }, name)));
    const button = (text: string, title: string, run: () => void) => h("button", { type: "button", title, onclick: run }, text);
    const toolbar = h("div", { class: "viewer-tools" },
      button("Fit", "fit the window (0)", () => this.fit()), button("1:1", "a pixel for a pixel (1)", () => this.actual()),
      button("−", "smaller (-)", () => this.zoomBy(1 / 1.5)), button("+", "larger (+)", () => this.zoomBy(1.5)), this.zoomText,
      h("label", { class: "exposure", title: "stops, as --exposure of lightmill fetch; e brighter, d darker" }, "Exposure", this.exposureInput, this.exposureText), h("label", {}, "View", curves), this.errorButton, this.denoisedButton, this.mixButton,
      h("label", {}, "B", this.other),
      h("span", { class: "grow" }),
      h("a", { href: `/api/v1/jobs/${job}/image.exr`, download: `${job}.exr` }, "EXR"), this.png);
    this.element = h("section", { class: "viewer", "aria-label": "Picture" }, toolbar, this.note, h("div", { class: "stage" }, this.canvas, this.message, this.legend, this.splitInput), this.status);
    this.png.download = `${job}.png`;
    this.linkPng();
    this.bindPointer();
    this.canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const step = 40 / this.scaleNow();
      const moves: { [key: string]: [number, number] } = { ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      const move = moves[event.key];
      if (!move) return;
      event.preventDefault();
      this.hold();
      this.x += move[0];
      this.y += move[1];
      this.draw();
    });
    const observer = new ResizeObserver(this.draw);
    observer.observe(this.canvas);
    const unwatch = store.watch(() => this.poll());
    const visible = () => this.poll();
    document.addEventListener("visibilitychange", visible);
    cleanup.add(() => {
      observer.disconnect();
      unwatch();
      document.removeEventListener("visibilitychange", visible);
      this.a.close();
      this.b?.close();
    });
    this.poll();
  }

  /** The job has light groups. */
  offerMix(): void {
    this.mixButton.hidden = false;
  }
  /** Shows a light mix, the image for "". While it is `moving` a small picture does, which comes sooner. */
  showMix(text: string, moving: boolean): void {
    this.mix = `?mix=${encodeURIComponent(text)}${moving ? `&side=${kMovingSide}` : ""}`;
    if (this.kind === "light-mix") this.a.ask(this.mix);
    else if (text) this.toggle("light-mix");
  }
  /** Puts another job beside this one; none for "". */
  compare(other: string): void {
    if (other === (this.b?.job ?? "")) return;
    this.b?.close();
    this.b = other ? new PictureSource(other, this.otherKind(), this.draw) : undefined;
    this.splitInput.hidden = !this.b;
    this.choices = "?";
    this.poll();
    this.draw();
    this.picked(other);
  }
  key(key: string): boolean {
    const keys: { [key: string]: () => void } = {
      "0": () => this.fit(),
      "1": () => this.actual(),
      "+": () => this.zoomBy(1.5),
      "=": () => this.zoomBy(1.5),
      "-": () => this.zoomBy(1 / 1.5),
      e: () => this.expose(this.exposure + 0.5),
      d: () => this.expose(this.exposure - 0.5),
      n: () => this.toggle("error-map"),
      o: () => this.toggle("denoised"),
      m: () => { if (!this.mixButton.hidden) this.toggle("light-mix"); },
      b: () => this.other.focus(),
    };
    const run = keys[key];
    run?.();
    return !!run;
  }

  private poll(): void {
    this.a.poll();
    this.b?.poll();
    this.fillChoices();
  }
  private fillChoices(): void {
    const mine = store.job(this.job);
    if (!mine || document.activeElement === this.other) return;
    // Of the same size first: those are the ones to compare with.
    const rank = (width: number, height: number) => (width === mine.width && height === mine.height ? 0 : 1);
    const jobs = [...store.jobs.values()]
      .filter((job) => job.id !== this.job && job.spp > 0)
      .sort((p, q) => rank(p.width, p.height) - rank(q.width, q.height) || Number(q.id.slice(1)) - Number(p.id.slice(1)))
      .slice(0, 200);
    const chosen = this.b?.job ?? "";
    if (chosen && !jobs.some((job) => job.id === chosen)) {
      const row = store.job(chosen);
      if (row) jobs.unshift(row);
    }
    const key = chosen + jobs.map((job) => job.id).join();
    if (key === this.choices) return;
    this.choices = key;
    this.other.replaceChildren(h("option", { value: "" }, "none"), ...jobs.map((job) => h("option", { value: job.id }, `${job.id} ${job.name}`)));
    this.other.value = chosen;
  }
  /** Shows it, or the image again. */
  private toggle(kind: PictureKind): void {
    this.kind = this.kind === kind ? "image" : kind;
    const switches: [HTMLElement, PictureKind][] = [[this.errorButton, "error-map"], [this.denoisedButton, "denoised"], [this.mixButton, "light-mix"]];
    for (const [button, shows] of switches) button.setAttribute("aria-pressed", String(this.kind === shows));
    const other = this.b?.job;
    this.a.close();
    this.b?.close();
    const alike = this.kind !== "error-map" && this.a.kind !== "error-map";
    this.a = new PictureSource(this.job, this.kind, this.draw, alike ? this.a : undefined);
    if (this.kind === "light-mix") this.a.ask(this.mix);
    this.b = other ? new PictureSource(other, this.otherKind(), this.draw) : undefined;
    this.poll();
    this.draw();
  }
  /** The other job has other lights: it stays as it was rendered. */
  private otherKind(): PictureKind {
    return this.kind === "light-mix" ? "image" : this.kind;
  }
  private expose(stops: number): void {
    this.exposure = Math.min(10, Math.max(-10, stops));
    this.exposureInput.value = String(this.exposure);
    setText(this.exposureText, (this.exposure > 0 ? "+" : "") + this.exposure.toFixed(2).replace(/\.?0+$/, ""));
    this.retone();
  }
  private retone(): void {
    this.linkPng();
    for (const source of [this.a, this.b]) source?.retone();
    this.draw();
  }
  private linkPng(): void {
    this.png.href = `/api/v1/jobs/${this.job}/image.png?view=${this.curve}&exposure=${this.exposure}`;
  }
  private size(): { width: number; height: number } {
    const row = store.job(this.job);
    return { width: row?.width ?? 1, height: row?.height ?? 1 };
  }
  private fitScale(): number {
    const { width, height } = this.size();
    return Math.max(1e-3, Math.min(this.canvas.clientWidth / width, this.canvas.clientHeight / height));
  }
  private scaleNow(): number {
    return this.zoom || this.fitScale();
  }
  private hold(): void {
    if (!this.zoom) this.zoom = this.fitScale();
  }
  private fit(): void {
    this.zoom = this.x = this.y = 0;
    this.draw();
  }
  private actual(): void {
    this.zoom = 1 / devicePixelRatio;
    this.draw();
  }
  /** About a point of the canvas, its middle if none is given. */
  private zoomBy(factor: number, at?: { x: number; y: number }): void {
    const before = this.scaleNow();
    const after = Math.min(64, Math.max(0.02, before * factor));
    if (at) {
      const dx = at.x - this.canvas.clientWidth / 2;
      const dy = at.y - this.canvas.clientHeight / 2;
      this.x += dx / after - dx / before;
      this.y += dy / after - dy / before;
    }
    this.zoom = after;
    this.draw();
  }
  private bindPointer(): void {
    let from: { x: number; y: number } | undefined;
    let dividing = false;
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      dividing = !!this.b && Math.abs(event.offsetX - this.split * canvas.clientWidth) < 8;
      from = { x: event.offsetX, y: event.offsetY };
    });
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = { x: event.offsetX, y: event.offsetY };
      if (from && dividing) {
        this.split = Math.min(1, Math.max(0, event.offsetX / canvas.clientWidth));
        this.splitInput.value = String(this.split);
      } else if (from) {
        this.hold();
        this.x += (event.offsetX - from.x) / this.scaleNow();
        this.y += (event.offsetY - from.y) / this.scaleNow();
        from = { x: event.offsetX, y: event.offsetY };
      }
      this.draw();
    });
    canvas.addEventListener("pointerup", () => (from = undefined));
    canvas.addEventListener("pointercancel", () => (from = undefined));
    canvas.addEventListener("pointerleave", () => {
      this.pointer = undefined;
      this.draw();
    });
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomBy(Math.exp(-event.deltaY / 400), { x: event.offsetX, y: event.offsetY });
    }, { passive: false });
  }
  private drawNow(): void {
    const canvas = this.canvas;
    const ratio = devicePixelRatio;
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const g = canvas.getContext("2d")!;
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.clearRect(0, 0, width, height);
    const size = this.size();
    const scale = this.scaleNow() * ratio;
    const left = width / 2 + this.x * scale - (size.width * scale) / 2;
    const top = height / 2 + this.y * scale - (size.height * scale) / 2;
    const put = (source: PictureSource) => {
      const image = source.canvas(this.exposure, this.curve);
      if (!image) return;
      g.imageSmoothingEnabled = scale < 2 && this.kind !== "error-map";
      g.imageSmoothingQuality = "high";
      g.drawImage(image, left, top, size.width * scale, size.height * scale);
    };
    put(this.a);
    if (this.b) {
      const divider = Math.round(this.split * width);
      g.save();
      g.beginPath();
      g.rect(divider, 0, width - divider, height);
      g.clip();
      g.clearRect(divider, 0, width - divider, height);
      put(this.b);
      g.restore();
      drawDivider(g, divider, height, [this.job, this.b.job]);
    }
    canvas.dataset.ready = String(!!this.a.picture);
    setText(this.zoomText, `${Math.round(scale * 100)}%`);
    const row = store.job(this.job);
    const empty = this.a.picture ? "" : this.a.problem || (row && row.spp === 0 ? "no samples yet" : "loading the picture…");
    setText(this.message, empty || (this.b && !this.b.picture ? `B: ${this.b.problem || "loading…"}` : ""));
    this.message.hidden = this.message.textContent === "";
    drawLegend(this.legend, this.kind === "error-map" ? this.a.scale : undefined);
    drawNote(this.note, this.a.picture, this.b?.picture);
    this.describe((this.pointer ? this.pointer.x * ratio - left : NaN) / scale, (this.pointer ? this.pointer.y * ratio - top : NaN) / scale);
  }
  private describe(px: number, py: number): void {
    const size = this.size();
    const x = Math.floor(px);
    const y = Math.floor(py);
    const a = valueText(this.a.picture, x, y, size);
    setText(this.status, a ? `${x}, ${y}   ${a}${this.b ? `   B ${valueText(this.b.picture, x, y, size)}` : ""}` : `${size.width} × ${size.height}`);
  }
}
