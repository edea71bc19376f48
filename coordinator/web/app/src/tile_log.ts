// What happened to one tile: to whom it was leased, how each attempt ended and why.
import { failure } from "./api";
import { Cleanup, h } from "./dom";
import { logTime } from "./format";

interface Line {
  time: number;
  attempt: number;
  worker: string;
  text: string;
}

const kLeastSpacingMs = 1000;

export class TileLog {
  readonly element: HTMLElement;
  /** Whose log is shown, if any. */
  tile: number | undefined;
  private readonly title = h("h3");
  private readonly lines = h("ol", { class: "log" });
  private timer = 0;
  private next = 0;

  constructor(
    private readonly job: string,
    cleanup: Cleanup,
  ) {
    const close = h("button", { type: "button", "aria-label": "Close the tile's log", onclick: () => this.hide() }, "×");
    this.element = h("section", { class: "tile-log", "aria-label": "Log of a tile", hidden: true }, h("header", {}, this.title, h("span", { class: "grow" }), close), this.lines);
    cleanup.add(() => this.hide());
  }
  show(tile: number): void {
    this.tile = tile;
    this.title.textContent = `Tile ${tile}`;
    this.lines.replaceChildren();
    this.element.hidden = false;
    this.next = 0;
    this.refresh();
  }
  /** Soon, as more may have happened. */
  refresh(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.load(), Math.max(0, this.next - performance.now()));
  }

  private hide(): void {
    clearTimeout(this.timer);
    this.tile = undefined;
    this.element.hidden = true;
  }
  private async load(): Promise<void> {
    const tile = this.tile;
    this.next = performance.now() + kLeastSpacingMs;
    try {
      const answer = await fetch(`/api/v1/jobs/${encodeURIComponent(this.job)}/log?tile=${tile}`);
      if (!answer.ok) throw await failure(answer);
      const lines = (await answer.json()) as Line[];
      if (tile !== this.tile) return;
      const items = lines.map((line) => h("li", {}, h("time", {}, logTime(line.time)), h("span", { class: "log-text" }, `${line.text}${line.worker ? ` · ${line.worker}` : ""}${line.attempt > 1 ? ` · attempt ${line.attempt}` : ""}`)));
      this.lines.replaceChildren(...(items.length > 0 ? items : [h("li", { class: "muted" }, "Nothing is kept of it: the coordinator has the newest 20,000 lines of all tiles, since its start.")]));
    } catch (error) {
      if (tile !== this.tile) return;
      this.lines.replaceChildren(h("li", { class: "bad" }, error instanceof Error ? error.message : String(error)));
    }
  }
}
