// The error against run time, both logarithmic: a path tracer's line falls by one decade a decade.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { Cleanup, h } from "./dom";
import * as format from "./format";
import type { CurvePoint, Job } from "./types";

type Axis = "wall_seconds" | "cpu_seconds" | "spp";
const kAxes: [Axis, string][] = [["wall_seconds", "render time, s"], ["cpu_seconds", "CPU time, s"], ["spp", "samples per pixel"]];

const kMostAway = 1000;
const kLabelWidth = 34; // pixels
const kLabelHeight = 16;

export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Where the line of the raw image meets `target` if the error goes on falling as 1/x; empty if it is there or can't be told. */
export function reachesAt(points: CurvePoint[], target: number | undefined, axis: Axis): number | undefined {
  const last = points.at(-1);
  if (!target || last?.relmse === undefined || last.relmse <= target) return undefined;
  return (last[axis] * last.relmse) / target;
}

export class ErrorChart {
  readonly element: HTMLElement;
  private readonly holder = h("div", { class: "chart" });
  private plot: uPlot | undefined;
  private axis: Axis = "wall_seconds";
  private points: CurvePoint[] = [];
  private target: number | undefined;
  private ofDenoised = false; // the target
  private readonly text = h("p", { class: "chart-text" });

  constructor(cleanup: Cleanup) {
    const axes = h("select", { "aria-label": "Horizontal axis", onchange: () => { this.axis = axes.value as Axis; this.rebuild(); } }, ...kAxes.map(([key, label]) => h("option", { value: key }, label)));
    this.element = h("section", { class: "panel", "aria-label": "Error against run time" }, h("header", {}, h("h2", {}, "Error"), h("span", { class: "grow" }), axes), this.holder, this.text);
    const observer = new ResizeObserver(() => this.plot ? this.plot.setSize({ width: this.holder.clientWidth, height: this.holder.clientHeight }) : this.rebuild());
    observer.observe(this.holder);
    const restyle = () => this.rebuild();
    document.addEventListener("themechange", restyle);
    cleanup.add(() => {
      observer.disconnect();
      document.removeEventListener("themechange", restyle);
      this.plot?.destroy();
    });
  }

  show(points: CurvePoint[], job: Job | undefined): void {
    const had = this.points.some((p) => p.true_relmse !== undefined);
    this.points = points;
    this.holder.hidden = !points.some((p) => p.relmse !== undefined);
    const target = job?.target_error;
    const ofDenoised = job?.target_denoised ?? false;
    const has = points.some((p) => p.true_relmse !== undefined);
    if (!this.plot || had !== has || target !== this.target || ofDenoised !== this.ofDenoised) {
      this.target = target;
      this.ofDenoised = ofDenoised;
      this.rebuild();
    } else {
      this.plot.setData(this.data());
    }
    const last = points.at(-1);
    const parts: string[] = [];
    if (last?.relmse === undefined) parts.push("No estimate yet: it takes two batches of 16 samples per pixel.");
    else {
      parts.push(`relMSE ${format.error(last.relmse)}`);
      if (last.relmse_low !== undefined) parts.push(`95 % in ${format.error(last.relmse_low)} … ${format.error(last.relmse_high)}`);
      const clean = points.filter((p) => p.denoised_relmse !== undefined).at(-1);
      if (clean) {
        const between = clean.denoised_relmse_low === undefined ? "" : ` (95 % in ${format.error(clean.denoised_relmse_low)} … ${format.error(clean.denoised_relmse_high)})`;
        parts.push(`denoised ${format.error(clean.denoised_relmse)}${between}`);
      }
      if (last.true_relmse !== undefined) parts.push(`true ${format.error(last.true_relmse)}`);
      if (job?.state === "running" && last.wall_seconds > 0) {
        const minute = last.relmse * (last.wall_seconds / (last.wall_seconds + 60));
        parts.push(`another minute: ${format.error(minute)}`);
      }
      const reach = ofDenoised ? undefined : reachesAt(points, target, "wall_seconds");
      const high = ofDenoised ? clean?.denoised_relmse_high : last.relmse_high;
      if (reach !== undefined) parts.push(`target in about ${format.duration(reach - last.wall_seconds)} of rendering`);
      else if (target && (high ?? Infinity) <= target) parts.push(ofDenoised ? "target of the denoised image met" : "target met");
    }
    this.text.textContent = parts.join(" · ");
  }

  private data(): uPlot.AlignedData {
    const points = this.points.filter((p) => (p.relmse ?? 0) > 0 && p[this.axis] > 0);
    const xs = points.map((p) => p[this.axis]);
    const column = (key: "relmse" | "relmse_low" | "relmse_high" | "true_relmse" | "denoised_relmse" | "denoised_relmse_low" | "denoised_relmse_high") =>
      points.map((p) => { const v = p[key]; return v !== undefined && v > 0 ? v : null; });
    const columns = [column("relmse"), column("relmse_low"), column("relmse_high"), column("true_relmse"), column("denoised_relmse"), column("denoised_relmse_low"), column("denoised_relmse_high")];
    const ahead = points.map((): number | null => null);
    // A target that is decades away would leave nothing of the curve.
    const error = this.ofDenoised ? points.filter((p) => p.denoised_relmse !== undefined).at(-1)?.denoised_relmse : points.at(-1)?.relmse;
    const target = this.target && error !== undefined && this.target > error / kMostAway ? this.target : undefined;
    const line = points.map((): number | null => target ?? null);
    const reach = this.ofDenoised ? undefined : reachesAt(this.points, target, this.axis);
    const last = points.at(-1);
    // What is to come, as long as it fits the picture.
    if (reach !== undefined && last?.relmse !== undefined && reach < 30 * last[this.axis]) {
      ahead[ahead.length - 1] = last.relmse;
      xs.push(reach);
      for (const c of columns) c.push(null);
      ahead.push(target!);
      line.push(target!);
    }
    return [xs, ...columns, ahead, line] as uPlot.AlignedData;
  }

  private rebuild(): void {
    this.plot?.destroy();
    this.plot = undefined;
    if (this.holder.clientWidth < 50 || this.holder.clientHeight < 50) return;
    const ink = colour("--ink-2");
    const grid = { stroke: colour("--line"), width: 1 };
    const ticks = { stroke: colour("--line"), width: 1, size: 4 };
    const main = colour("--accent");
    // As many digits of a decade as there is room for between their labels.
    const labels = (room: number) => (plot: uPlot, values: (number | null)[], axis: number) => {
      const scale = plot.scales[axis === 0 ? "x" : "y"]!;
      const pixels = (axis === 0 ? plot.bbox.width : plot.bbox.height) / devicePixelRatio;
      const shown = labelled(Math.log10((scale.max ?? 10) / (scale.min ?? 1)), pixels, room);
      return values.map((v) => {
        if (v === null) return "";
        const digits = Math.floor(Math.log10(v) + 1e-9);
        const lead = Math.round(v / 10 ** digits);
        if (!shown.includes(lead)) return "";
        return v >= (axis === 0 ? 0.01 : 0.1) && v < 1e5 ? String(Number(v.toPrecision(2))) : `${lead}e${digits}`;
      });
    };
    const invisible = { stroke: "transparent", width: 0, points: { show: false } };
    const options: uPlot.Options = {
      width: this.holder.clientWidth,
      height: this.holder.clientHeight,
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, points: { size: 7 } },
      scales: {
        x: { distr: 3, time: false, range: (_, low, high) => decades(low, high, 1.15) },
        y: { distr: 3, range: (_, low, high) => decades(low, high, 1.4) },
      },
      axes: [
        { stroke: ink, grid, ticks, size: 34, font: "11px system-ui", filter: (_, splits) => splits, values: labels(kLabelWidth) },
        { stroke: ink, grid, ticks, size: 48, font: "11px system-ui", filter: (_, splits) => splits, values: labels(kLabelHeight) },
      ],
      series: [
        {},
        { label: "relMSE", stroke: main, width: 2, points: { show: true, size: 5, fill: main } },
        { label: "low", ...invisible },
        { label: "high", ...invisible },
        { label: "true", stroke: colour("--good"), width: 1.5, points: { show: true, size: 4 } },
        { label: "denoised", stroke: colour("--ink-2"), width: 2, points: { show: true, size: 5 }, spanGaps: true },
        { label: "denoised low", ...invisible, spanGaps: true },
        { label: "denoised high", ...invisible, spanGaps: true },
        { label: "ahead", stroke: main, width: 1, dash: [2, 4], points: { show: false }, spanGaps: true },
        { label: "target", stroke: colour("--warn"), width: 1.5, dash: [6, 4], points: { show: false }, spanGaps: true },
      ],
      bands: [{ series: [3, 2], fill: colour("--band") }, { series: [7, 6], fill: colour("--band") }],
    };
    this.plot = new uPlot(options, this.data(), this.holder);
  }
}

/** The leading digits that get a label where a decade has so many pixels and a label needs `room` of them. */
export function labelled(decades: number, pixels: number, room: number): number[] {
  const sets = [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 3, 5, 7], [1, 2, 5], [1, 3]];
  for (const set of sets) {
    const gaps = set.map((digit, i) => Math.log10((set[i + 1] ?? 10) / digit));
    if ((Math.min(...gaps) * pixels) / Math.max(decades, 1e-3) >= room) return set;
  }
  return [1];
}

/** A range that shows at least a decade or so, with air around. uPlot walks along a logarithmic axis by steps that it
 * rounds: between ends that are not of one digit, 0, or infinite (as of a series without values) it may never arrive. */
export function decades(low: number | null, high: number | null, air: number): [number, number] {
  if (!low || !high || !(low > 0) || !(high >= low) || !Number.isFinite(high)) return [0.1, 10];
  const middle = Math.sqrt(low * high);
  const half = Math.max(Math.sqrt(high / low) * air, 3);
  return [oneDigit(middle / half, Math.floor), oneDigit(middle * half, Math.ceil)];
}

/** 0.0347 -> 0.03 or 0.04 */
function oneDigit(value: number, round: (x: number) => number): number {
  const power = Math.floor(Math.log10(value));
  return Number(`${Math.max(1, round(value / 10 ** power))}e${power}`);
}
