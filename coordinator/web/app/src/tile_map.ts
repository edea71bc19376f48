// Who is at which part of the image, and what is stuck: the newest rounds' tiles over the cells.
import { Cleanup, h, perFrame, setText } from "./dom";
import * as format from "./format";
import { idNumber, store } from "./store";
import { TileLog } from "./tile_log";
import type { JobDetail, JobNews, Tile } from "./types";

const kSlowSeconds = 30;
const kMaxHeight = 200;
const kMostNamed = 12; // workers in the legend

/** A colour of its own for every worker, evenly over the hues. */
export function workerColour(worker: string, light: number): string {
  return `hsl(${(idNumber(worker) * 137.508) % 360} 58% ${light}%)`;
}

export class TileMap {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", {
    class: "tiles", role: "application", tabIndex: 0, "aria-label": "Map of tiles: arrows go from cell to cell, Enter shows the log of the tile there",
    onpointermove: (event: PointerEvent) => this.hover(event), onpointerleave: () => this.hover(undefined),
    onclick: () => this.choose(this.hovered), onkeydown: (event: KeyboardEvent) => this.key(event), onblur: () => this.hover(undefined),
  });
  private readonly by = h("select", { "aria-label": "Colour by", onchange: () => { this.legendOf = ""; this.draw(); } }, h("option", { value: "state" }, "by state"), h("option", { value: "worker" }, "by worker"));
  private readonly text = h("p", { class: "chart-text" });
  private readonly spoken = h("p", { class: "spoken", "aria-live": "polite" });
  private readonly legend = h("ul", { class: "tile-legend", "aria-label": "Colours" });
  private readonly list = h("ol", { class: "tile-list" });
  private readonly log: TileLog;
  private legendOf = "";
  private cursor: { x: number; y: number } | undefined; // of the keyboard, in cells
  private readonly tiles = new Map<number, Tile>();
  private readonly since = new Map<string, number>(); // when its lease began
  private detail: JobDetail | undefined;
  private complete = 0;
  private hovered: Tile | undefined;
  private readonly draw: () => void;

  constructor(job: string, cleanup: Cleanup) {
    this.log = new TileLog(job, cleanup);
    this.draw = perFrame(() => this.drawNow());
    this.element = h("section", { class: "panel", "aria-label": "Tiles" }, h("header", {}, h("h2", {}, "Tiles"), h("span", { class: "grow" }), this.by), this.canvas, this.legend, this.text, this.spoken, this.list, this.log.element);
    const observer = new ResizeObserver(this.draw);
    observer.observe(this.canvas);
    const timer = setInterval(this.draw, 1000); // ages grow
    document.addEventListener("themechange", this.draw);
    cleanup.add(() => {
      observer.disconnect();
      clearInterval(timer);
      document.removeEventListener("themechange", this.draw);
    });
  }

  take(news: JobNews): void {
    if (news.full) {
      this.tiles.clear();
      this.since.clear();
    }
    if (news.detail) this.detail = news.detail;
    if (news.complete_samples !== undefined) this.complete = news.complete_samples;
    for (const tile of news.tiles ?? []) this.tiles.set(tile.id, tile);
    if (news.first_tile !== undefined) for (const id of this.tiles.keys()) if (id < news.first_tile) this.tiles.delete(id);
    const held = new Set<string>();
    for (const tile of this.tiles.values()) {
      if (tile.state !== "leased") continue;
      const key = `${tile.id} ${tile.attempt}`;
      held.add(key);
      if (!this.since.has(key)) this.since.set(key, Date.now() - 1000 * (tile.leased_seconds ?? 0));
    }
    for (const key of this.since.keys()) if (!held.has(key)) this.since.delete(key);
    if (news.tiles?.some((tile) => tile.id === this.log.tile)) this.log.refresh();
    this.draw();
  }

  private age(tile: Tile): number {
    return (Date.now() - (this.since.get(`${tile.id} ${tile.attempt}`) ?? Date.now())) / 1000;
  }
  private grid(): { x0: number; y0: number; width: number; height: number } | undefined {
    if (!this.detail) return undefined;
    const [x0, y0, x1, y1] = this.detail.crop;
    const cell = this.detail.cell_pixels;
    const left = Math.floor(x0 / cell);
    const top = Math.floor(y0 / cell);
    return { x0: left, y0: top, width: Math.ceil(x1 / cell) - left, height: Math.ceil(y1 / cell) - top };
  }
  private hover(event: PointerEvent | undefined): void {
    const grid = this.grid();
    this.hovered = undefined;
    if (event && grid) {
      const size = this.canvas.clientWidth / grid.width;
      this.hovered = this.tileAt(grid.x0 + Math.floor(event.offsetX / size), grid.y0 + Math.floor(event.offsetY / size));
    }
    this.draw();
  }
  private tileAt(x: number, y: number): Tile | undefined {
    let found: Tile | undefined;
    // The last one that was opened lies on top.
    for (const tile of this.tiles.values()) {
      const c = tile.cells;
      if (c && x >= c[0] && x < c[2] && y >= c[1] && y < c[3] && (tile.state !== "pending" || !found)) found = tile;
    }
    return found;
  }
  private key(event: KeyboardEvent): void {
    const grid = this.grid();
    if (!grid || event.ctrlKey || event.metaKey || event.altKey) return;
    const moves: { [key: string]: [number, number] } = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const move = moves[event.key];
    if (move) {
      const at = this.cursor ?? { x: grid.x0, y: grid.y0 };
      const step = this.cursor ? move : [0, 0];
      const inside = (v: number, low: number, size: number) => Math.min(low + size - 1, Math.max(low, v));
      this.cursor = { x: inside(at.x + step[0]!, grid.x0, grid.width), y: inside(at.y + step[1]!, grid.y0, grid.height) };
      this.hovered = this.tileAt(this.cursor.x, this.cursor.y);
      setText(this.spoken, this.hovered ? this.describe(this.hovered) : "no tile here");
      this.draw();
    } else if (event.key === "Enter") {
      this.choose(this.hovered);
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }
  private choose(tile: Tile | undefined): void {
    if (tile) this.log.show(tile.id);
  }
  private drawNow(): void {
    const grid = this.grid();
    if (!grid || this.canvas.clientWidth === 0) return;
    const style = getComputedStyle(document.documentElement);
    const variable = (name: string) => style.getPropertyValue(name).trim();
    const dark = variable("--dark") === "1";
    const ratio = devicePixelRatio;
    const width = Math.round(this.canvas.clientWidth * ratio);
    const size = width / grid.width;
    const height = Math.round(size * grid.height);
    this.canvas.style.aspectRatio = `${grid.width} / ${grid.height}`;
    this.canvas.style.maxWidth = `${(kMaxHeight * grid.width) / grid.height}px`;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const g = this.canvas.getContext("2d")!;
    g.fillStyle = variable("--field");
    g.fillRect(0, 0, width, height);
    const gap = size > 6 * ratio ? ratio : 0;
    const byWorker = this.by.value === "worker";
    const ordered = [...this.tiles.values()].sort((a, b) => a.id - b.id);
    const counts = { pending: 0, leased: 0, committed: 0 };
    let again = 0;
    for (const tile of ordered) {
      counts[tile.state]++;
      if (tile.attempt > 1) again++;
      const c = tile.cells;
      if (!c || (tile.state === "pending" && this.complete > 0 && tile.attempt === 0)) continue;
      if (byWorker && tile.worker && tile.state !== "pending") g.fillStyle = workerColour(tile.worker, tile.state === "leased" ? (dark ? 62 : 48) : dark ? 30 : 78);
      else if (tile.state === "leased") g.fillStyle = this.age(tile) > kSlowSeconds ? variable("--bad") : variable("--accent");
      else if (tile.state === "committed") g.fillStyle = variable("--done");
      else g.fillStyle = tile.attempt > 0 ? variable("--warn") : variable("--field");
      const x0 = (c[0] - grid.x0) * size;
      const y0 = (c[1] - grid.y0) * size;
      g.fillRect(x0, y0, (c[2] - c[0]) * size - gap, (c[3] - c[1]) * size - gap);
    }
    const marked = this.hovered?.cells;
    if (marked) {
      g.strokeStyle = variable("--ink");
      g.lineWidth = 2 * ratio;
      g.strokeRect((marked[0] - grid.x0) * size, (marked[1] - grid.y0) * size, (marked[2] - marked[0]) * size, (marked[3] - marked[1]) * size);
    }
    this.drawLegend(ordered, dark);
    setText(this.text, this.hovered ? this.describe(this.hovered) : `${format.count(this.complete)} samples per pixel complete · last rounds: ${counts.committed} done, ${counts.leased} in work, ${counts.pending} waiting${again ? `, ${again} tried again` : ""}`);
    this.drawList(ordered);
  }
  private describe(tile: Tile): string {
    if (tile.pilot) return `pilot · ${tile.state}${tile.worker ? ` · ${tile.worker}` : ""}`;
    const host = tile.worker ? store.workers.get(tile.worker)?.host : undefined;
    const parts = [`tile ${tile.id}`, `samples ${tile.samples?.[0]}–${tile.samples?.[1]}`, tile.state];
    if (tile.worker) parts.push(`${tile.worker}${host ? ` (${host})` : ""}`);
    if (tile.attempt > 1) parts.push(`attempt ${tile.attempt}`);
    if (tile.state === "leased") parts.push(`for ${format.duration(this.age(tile))}`);
    return parts.join(" · ");
  }
  private drawLegend(tiles: Tile[], dark: boolean): void {
    const byWorker = this.by.value === "worker";
    const workers = byWorker ? [...new Set(tiles.flatMap((tile) => (tile.worker && tile.state !== "pending" ? [tile.worker] : [])))].sort((a, b) => idNumber(a) - idNumber(b)) : [];
    const key = `${byWorker} ${dark} ${workers.join()}`;
    if (key === this.legendOf) return;
    this.legendOf = key;
    const chip = (text: string, paint: (swatch: HTMLElement) => void) => {
      const swatch = h("i", { "aria-hidden": "true" });
      paint(swatch);
      return h("li", {}, swatch, text);
    };
    const named = (text: string, variable: string) => chip(text, (swatch) => swatch.classList.add(`is-${variable}`));
    this.legend.replaceChildren(
      ...(byWorker
        ? [...workers.slice(0, kMostNamed).map((id) => chip(`${id} ${store.workers.get(id)?.host ?? ""}`, (swatch) => (swatch.style.background = workerColour(id, dark ? 62 : 48)))), h("li", {}, `${workers.length > kMostNamed ? `and ${workers.length - kMostNamed} more; ` : ""}faint: done`)]
        : [named("waiting", "field"), named("in work", "accent"), named(`in work for over ${kSlowSeconds} s`, "bad"), named("to be tried again", "warn"), named("done", "done")]),
    );
  }
  /** What is in work longest, and what had to be tried again. */
  private drawList(tiles: Tile[]): void {
    const shown = tiles
      .filter((tile) => tile.state === "leased" || (tile.state === "pending" && tile.attempt > 0))
      .sort((a, b) => b.attempt - a.attempt || this.age(b) - this.age(a))
      .slice(0, 8);
    while (this.list.children.length > shown.length) this.list.lastElementChild!.remove();
    shown.forEach((tile, i) => {
      const item = this.list.children[i] ?? this.list.appendChild(h("li", {}, h("button", { type: "button", class: "link", title: "its log", onclick: (event: Event) => this.log.show(Number((event.currentTarget as HTMLElement).dataset["tile"])) })));
      const button = item.firstElementChild as HTMLElement;
      button.dataset["tile"] = String(tile.id);
      setText(button, this.describe(tile));
      item.className = this.age(tile) > kSlowSeconds || tile.attempt > 1 ? "slow" : "";
    });
  }
}
