// How far a sequence is, in words and bars.
import { h, setText } from "../dom";
import * as format from "../format";
import type { Sequence } from "./types";

/** By samples, or by frames where they end before all their samples. */
export function progress(s: Sequence): number {
  if (s.state === "done") return 1;
  const samples = s.packets_total > 0 ? s.packets_done / s.packets_total : 0;
  const frames = s.frame_count > 0 ? s.frames.done / s.frame_count : 0;
  return Math.min(1, Math.max(samples, frames));
}

export function drawProgress(cell: HTMLElement, s: Sequence): void {
  let bar = cell.firstElementChild as HTMLElement | null;
  if (!bar) {
    bar = h("div", { class: "bar" }, h("i"), h("span"));
    cell.append(bar);
  }
  const share = progress(s);
  (bar.children[0] as HTMLElement).style.width = `${100 * share}%`;
  setText(bar.children[1]!, `${Math.floor(100 * share)}%`);
}

export function eta(s: Sequence): string {
  if (s.state !== "running" || s.eta_seconds < 0) return "";
  return `${format.duration(s.eta_seconds)} · ${format.clockTime(new Date(Date.now() + 1000 * s.eta_seconds))}`;
}

export function framesDone(s: Sequence): string {
  return `${format.count(s.frames.done)} / ${format.count(s.frame_count)}${s.frames.failed > 0 ? ` · ${format.count(s.frames.failed)} failed` : ""}`;
}
