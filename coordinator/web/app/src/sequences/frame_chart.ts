// One figure of every frame: where the noise is, or where the time goes. A click chooses the frame.
import uPlot from "uplot";

import { colour, decades, labelled } from "../chart";
import { Cleanup, h } from "../dom";
import type { Frame } from "./types";

const kLabelHeight = 16;
const kMostDots = 120; // more frames are a line

export interface FrameFigure {
  title: string;
  value: (frame: Frame) => number | undefined;
  text: (value: number) => string;
  /** Errors span decades. */
  logarithmic: boolean;
  /** What is said while no frame has a value. */
  none: string;
}

export class FrameChart {
  readonly element: HTMLElement;
  private readonly holder = h("div", { class: "frame-chart" });
  private readonly text = h("p", { class: "chart-text" });
  private readonly line = h("div", { class: "frame-mark" });
  private plot: uPlot | undefined;
  private frames: Frame[] = [];
  private place = 0;

  constructor(
    private readonly figure: FrameFigure,
    private readonly choose: (place: number) => void,
    cleanup: Cleanup,
  ) {
    this.element = h("section", { class: "panel", "aria-label": figure.title }, h("header", {}, h("h2", {}, figure.title)), this.holder, this.text);
    const observer = new ResizeObserver(() => {
      if (this.plot && this.holder.clientWidth > 0) this.plot.setSize({ width: this.holder.clientWidth, height: this.holder.clientHeight });
      else if (!this.plot) this.rebuild();
    });
    observer.observe(this.holder);
    const restyle = () => this.rebuild();
    document.addEventListener("themechange", restyle);
    this.holder.addEventListener("click", () => {
      const at = this.plot?.cursor.idx;
      if (at !== null && at !== undefined) this.choose(at);
    });
    cleanup.add(() => {
      observer.disconnect();
      document.removeEventListener("themechange", restyle);
      this.plot?.destroy();
    });
  }

  /** The frames are others, or have other figures. */
  show(frames: Frame[]): void {
    const dotted = (list: Frame[]) => list.length <= kMostDots;
    const same = dotted(frames) === dotted(this.frames);
    this.frames = frames;
    this.holder.hidden = this.values().every((value) => value === null);
    if (this.plot && same) this.plot.setData(this.data());
    else this.rebuild();
    this.describe();
  }
  /** Another frame is the chosen one. */
  mark(place: number): void {
    if (place === this.place) return;
    this.place = place;
    this.moveLine();
    this.describe();
  }

  private values(): (number | null)[] {
    return this.frames.map((frame) => {
      const value = this.figure.value(frame);
      return value === undefined || (this.figure.logarithmic && !(value > 0)) ? null : value;
    });
  }
  private data(): uPlot.AlignedData {
    return [this.frames.map((frame) => frame.number), this.values()];
  }
  private describe(): void {
    const frame = this.frames[this.place];
    const value = frame && this.figure.value(frame);
    this.text.textContent = this.holder.hidden ? this.figure.none : !frame ? "" : `frame ${frame.number}: ${value === undefined ? "not known yet" : this.figure.text(value)}`;
  }
  private rebuild(): void {
    this.plot?.destroy();
    this.plot = undefined;
    if (this.holder.clientWidth < 50 || this.holder.clientHeight < 50) return;
    const { logarithmic, text } = this.figure;
    const ink = colour("--ink-2");
    const main = colour("--accent");
    const grid = { stroke: colour("--line"), width: 1 };
    const ticks = { ...grid, size: 4 };
    const digits = (plot: uPlot, values: number[]) => {
      const scale = plot.scales["y"]!;
      const shown = labelled(Math.log10((scale.max ?? 10) / (scale.min ?? 1)), plot.bbox.height / devicePixelRatio, kLabelHeight);
      return values.map((v) => {
        const power = Math.floor(Math.log10(v) + 1e-9);
        const lead = Math.round(v / 10 ** power);
        return shown.includes(lead) ? `${lead}e${power}` : "";
      });
    };
    this.plot = new uPlot(
      {
        width: this.holder.clientWidth,
        height: this.holder.clientHeight,
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, points: { size: 7 }, y: false },
        scales: {
          x: { time: false },
          y: logarithmic ? { distr: 3, range: (_, low, high) => decades(low, high, 1.4) } : { range: (_, __, high) => [0, high > 0 ? 1.1 * high : 1] },
        },
        axes: [
          { stroke: ink, grid, ticks, size: 28, font: "11px system-ui", incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000] },
          logarithmic
            ? { stroke: ink, grid, ticks, size: 48, font: "11px system-ui", filter: (_, splits) => splits, values: digits }
            : { stroke: ink, grid, ticks, size: 48, font: "11px system-ui", values: (_, values) => values.map(text) },
        ],
        series: [{}, { stroke: main, width: 1.5, points: { show: this.frames.length <= kMostDots, size: 5, fill: main } }],
        hooks: { draw: [() => this.moveLine()] },
      },
      this.data(),
      this.holder,
    );
    this.plot.over.append(this.line);
    this.moveLine();
  }
  /** An element of its own: playing moves it without drawing all frames again. */
  private moveLine(): void {
    const frame = this.frames[this.place];
    this.line.hidden = !frame || !this.plot;
    if (frame && this.plot) this.line.style.transform = `translateX(${Math.round(this.plot.valToPos(frame.number, "x"))}px)`;
  }
}
