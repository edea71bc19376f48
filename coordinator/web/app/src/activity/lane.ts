// One worker's hour as a strip: a bar for each span in its job's colour, as high as the worker was busy. A strip is
// drawn once, and goes with its row while the list is scrolled.
import { idNumber, sequenceOf } from "../store";
import type { Lane, Span, Timelines } from "./timelines";

const kMarkCells = 60; // a line every ten minutes
const kPadding = 3; // above and below a bar

/** A colour of its own for every job; the frames of a sequence have one together. */
export function jobColour(job: string, dark: boolean): string {
  const sequence = sequenceOf(job);
  const hue = (idNumber(sequence || job) * 137.508 + (sequence ? 70 : 210)) % 360;
  return `hsl(${hue} ${dark ? 45 : 50}% ${dark ? 58 : 56}%)`;
}

export interface LaneLook {
  dark: boolean;
  line: string;
  ink: string;
  /** Of a lane, in CSS pixels: to ask each canvas would lay the page out each time. */
  width: number;
}

const kHeight = 25; // as in activity.css
const kMostKept = 120; // lanes that are drawn

export class LaneCanvases {
  private readonly drawn = new Map<string, { canvas: HTMLCanvasElement; key: string }>(); // least recently shown first

  /** The lane's canvas, drawn as `version` of its data; `made` is called with a new one. */
  show(lane: Lane, version: number, times: Timelines, look: LaneLook, marked: Span | undefined, made: (canvas: HTMLCanvasElement) => void): HTMLCanvasElement {
    let entry = this.drawn.get(lane.id);
    if (entry) {
      this.drawn.delete(lane.id);
    } else {
      entry = { canvas: document.createElement("canvas"), key: "" };
      made(entry.canvas);
    }
    this.drawn.set(lane.id, entry);
    if (this.drawn.size > kMostKept) this.drawn.delete(this.drawn.keys().next().value!);
    const key = `${version} ${look.width} ${devicePixelRatio} ${look.dark} ${marked?.cell ?? ""}`;
    if (entry.key !== key) drawLane(entry.canvas, lane, times, look, marked);
    entry.key = key;
    return entry.canvas;
  }
}

const fills = new Map<string, string>(); // of jobs, in the present theme
let fillsAreDark = false;

function fillOf(job: string, dark: boolean): string {
  if (dark !== fillsAreDark || fills.size > 10000) fills.clear();
  fillsAreDark = dark;
  let fill = fills.get(job);
  if (!fill) fills.set(job, (fill = jobColour(job, dark)));
  return fill;
}

function drawLane(canvas: HTMLCanvasElement, lane: Lane, times: Timelines, look: LaneLook, marked: Span | undefined): void {
  const ratio = devicePixelRatio;
  const width = Math.round(look.width * ratio);
  const height = Math.round(kHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const g = canvas.getContext("2d")!;
  g.clearRect(0, 0, width, height);
  const first = times.cell + 1 - times.cells;
  const scale = width / times.cells;
  g.fillStyle = look.line;
  for (let cell = kMarkCells; cell < times.cells; cell += kMarkCells) g.fillRect(Math.round(cell * scale), 0, 1, height);
  const full = height - 2 * kPadding * ratio;
  for (const span of lane.spans) {
    const left = Math.max(0, (span.cell - first) * scale);
    const right = Math.max(left + ratio, (span.cell + span.cells - first) * scale);
    const share = Math.min(1, span.busy / (span.cells * times.cellSeconds));
    const high = Math.max(2 * ratio, share * full);
    g.fillStyle = fillOf(span.job, look.dark);
    g.fillRect(left, height - kPadding * ratio - high, right - left, high);
    if (span !== marked) continue;
    g.strokeStyle = look.ink;
    g.lineWidth = 2 * ratio;
    g.strokeRect(left + ratio, ratio, Math.max(ratio, right - left - 2 * ratio), height - 2 * ratio);
  }
}

/** The span at this part of the lane's width, 0 to 1. */
export function spanAt(lane: Lane, times: Timelines, share: number): Span | undefined {
  const cell = times.cell + 1 - times.cells + share * times.cells;
  return lane.spans.find((span) => cell >= span.cell && cell < span.cell + span.cells);
}
