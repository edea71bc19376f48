// The frames that failed, and why.
import { act } from "../api";
import { mayAct, toast } from "../actions";
import { Cleanup, h, setText } from "../dom";
import * as format from "../format";
import { VirtualTable } from "../virtual_table";
import type { Frame } from "./types";

export class FailedFrames {
  readonly element: HTMLElement;
  private readonly count = h("span", { class: "muted" });
  private readonly button: HTMLButtonElement;
  private readonly table: VirtualTable<Frame>;
  private frames: Frame[] = [];

  constructor(
    choose: (frame: Frame) => void,
    private readonly changed: () => void,
    cleanup: Cleanup,
  ) {
    this.table = new VirtualTable<Frame>(
      {
        label: "Failed frames",
        id: (frame) => frame.id,
        open: choose,
        sort: { key: "number", down: false },
        empty: () => "",
        columns: [
          {
            key: "number", title: "Frame", width: "60px", number: true, text: (frame) => String(frame.number), sort: (frame) => frame.number,
            draw: (cell, frame) => {
              const link = (cell.firstElementChild as HTMLAnchorElement | null) ?? cell.appendChild(h("a", { tabIndex: -1 }));
              link.href = `#/jobs/${frame.id}`;
              setText(link, String(frame.number));
            },
          },
          { key: "spp", title: "Samples", width: "64px", number: true, text: (frame) => format.samples(frame.spp), sort: (frame) => frame.spp },
          { key: "message", title: "Message", width: "minmax(120px, 1fr)", text: (frame) => frame.message ?? "", style: () => "note" },
        ],
      },
      cleanup,
    );
    this.button = h("button", { type: "button", title: "the chosen one, or the first", onclick: () => void this.retry() }, "Retry frame");
    this.element = h("section", { class: "panel failed-frames", "aria-label": "Failed frames", hidden: true },
      h("header", {}, h("h2", {}, "Failed frames"), this.count, h("span", { class: "grow" }), this.button), this.table.element);
  }

  show(frames: Frame[]): void {
    this.frames = frames.filter((frame) => frame.state === "failed");
    this.element.hidden = this.frames.length === 0;
    setText(this.count, format.count(this.frames.length));
    this.table.setRows(this.frames);
    this.update();
  }
  /** Who may act may be told later than the frames. */
  update(): void {
    this.button.setAttribute("aria-disabled", String(!mayAct()));
  }

  private async retry(): Promise<void> {
    const frame = this.table.selected ?? this.frames[0];
    if (!frame || !mayAct()) return;
    try {
      await act(frame.id, "retry");
      toast(`frame ${frame.number} is tried again`);
      this.changed();
    } catch (error) {
      toast(error instanceof Error ? error.message : String(error), true);
    }
  }
}
