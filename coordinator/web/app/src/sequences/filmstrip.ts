// The frames side by side: only those in sight are in the document, and only their pictures are fetched.
import { Cleanup, h, perFrame, setClass, setText } from "../dom";
import { hasPicture, PictureCache, thumbnails } from "../thumbnails/picture_cache";
import type { Frame } from "./types";

const kCell = 116; // pixels from one frame to the next
const kOverscan = 2; // frames beyond either edge
const kMostKept = 80; // thumbnails, but for those in sight
const kSettleMs = 120; // after scrolling, before pictures are asked for

interface Slot {
  cell: HTMLElement;
  picture: HTMLElement;
  text: HTMLElement;
  state: HTMLElement;
}

export class Filmstrip {
  readonly element: HTMLElement;
  private readonly scroller: HTMLElement;
  private readonly film = h("div", { class: "film", role: "presentation" });
  private readonly slots: Slot[] = [];
  private readonly cache: PictureCache;
  private readonly draw: () => void;
  private frames: Frame[] = [];
  private chosen = 0;
  private timer = 0; // until pictures are asked for
  private first = 0; // in sight when it was set
  private last = 0;

  constructor(
    private readonly choose: (place: number) => void,
    private readonly open: (frame: Frame) => void,
    cleanup: Cleanup,
  ) {
    this.draw = perFrame(() => this.drawNow());
    this.cache = new PictureCache(thumbnails(kMostKept), this.draw);
    this.scroller = h("div", {
      class: "film-scroll", tabIndex: 0, role: "listbox", "aria-label": "Frames", "aria-orientation": "horizontal",
      onscroll: this.draw,
      onclick: (event: MouseEvent) => this.at(event, this.choose),
      ondblclick: (event: MouseEvent) => this.at(event, (place) => this.open(this.frames[place]!)),
      onkeydown: (event: KeyboardEvent) => {
        if (event.key !== "Enter" || !this.frames[this.chosen]) return;
        event.preventDefault();
        this.open(this.frames[this.chosen]!);
      },
    }, this.film);
    this.element = h("section", { class: "filmstrip", "aria-label": "Filmstrip" }, this.scroller);
    const observer = new ResizeObserver(this.draw);
    observer.observe(this.scroller);
    document.addEventListener("visibilitychange", this.draw);
    cleanup.add(() => {
      observer.disconnect();
      document.removeEventListener("visibilitychange", this.draw);
      clearTimeout(this.timer);
      this.cache.close();
    });
  }

  show(frames: Frame[], chosen: number): void {
    this.frames = frames;
    if (chosen !== this.chosen) {
      this.chosen = chosen;
      this.reveal();
    }
    this.draw();
  }
  focus(): void {
    this.scroller.focus({ preventScroll: true });
  }
  /** What there is of a frame's picture. */
  thumbnail(job: string): HTMLCanvasElement | undefined {
    return this.cache.get(job);
  }

  private at(event: MouseEvent, run: (place: number) => void): void {
    const cell = (event.target as Element).closest<HTMLElement>(".film-cell");
    if (cell?.dataset["place"]) run(Number(cell.dataset["place"]));
  }
  private reveal(): void {
    const view = this.scroller;
    this.film.style.width = `${this.frames.length * kCell}px`;
    const left = this.chosen * kCell;
    if (left >= view.scrollLeft && left + kCell <= view.scrollLeft + view.clientWidth) return;
    view.scrollLeft = left - (view.clientWidth - kCell) / 2;
  }
  private drawNow(): void {
    const view = this.scroller;
    this.film.style.width = `${this.frames.length * kCell}px`;
    const inSight = (pixels: number) => Math.min(this.frames.length, Math.max(0, pixels));
    const first = inSight(Math.floor(view.scrollLeft / kCell) - kOverscan);
    const last = inSight(Math.ceil((view.scrollLeft + view.clientWidth) / kCell) + kOverscan);
    while (this.slots.length < last - first) this.addSlot();
    let active = "";
    // A frame keeps its slot while the strip moves, so that pictures stay where they are.
    const taken = new Set<Slot>();
    const count = Math.max(1, this.slots.length);
    for (let place = first; place < last; place++) {
      const slot = this.slots[place % count]!;
      taken.add(slot);
      this.drawSlot(slot, this.frames[place]!, place);
      if (place === this.chosen) active = slot.cell.id;
    }
    for (const slot of this.slots) if (!taken.has(slot)) this.hideSlot(slot);
    if (active) view.setAttribute("aria-activedescendant", active);
    else view.removeAttribute("aria-activedescendant");
    if (first !== this.first || this.timer === 0) {
      this.first = first;
      clearTimeout(this.timer);
      this.timer = window.setTimeout(() => {
        this.timer = 0;
        this.cache.want(this.frames.slice(first, this.last));
      }, kSettleMs);
    }
    this.last = last;
  }
  private addSlot(): void {
    const picture = h("div", { class: "film-picture" });
    const text = h("span");
    const state = h("span", { class: "state" });
    const cell = h("div", { class: "film-cell", role: "option", id: `film-${this.slots.length}` }, picture, h("div", { class: "film-text" }, text, state));
    this.slots.push({ cell, picture, text, state });
    this.film.append(cell);
  }
  private hideSlot(slot: Slot): void {
    slot.cell.hidden = true;
    slot.picture.replaceChildren();
    delete slot.cell.dataset["id"];
  }
  private drawSlot(slot: Slot, frame: Frame, place: number): void {
    const { cell, picture } = slot;
    cell.hidden = false;
    cell.dataset["id"] = frame.id;
    cell.dataset["place"] = String(place);
    cell.style.transform = `translateX(${place * kCell}px)`;
    cell.setAttribute("aria-selected", String(place === this.chosen));
    cell.setAttribute("aria-posinset", String(place + 1));
    cell.setAttribute("aria-setsize", String(this.frames.length));
    cell.title = frame.message ?? "";
    setText(slot.text, String(frame.number));
    setText(slot.state, frame.state);
    setClass(slot.state, `state ${frame.state}`);
    setClass(cell, `film-cell ${frame.state}`);
    const canvas = hasPicture(frame) ? this.cache.get(frame.id) : undefined;
    if (picture.firstElementChild === (canvas ?? null)) return;
    picture.replaceChildren(...(canvas ? [canvas] : []));
  }
}
