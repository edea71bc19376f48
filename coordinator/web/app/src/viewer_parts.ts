// What the viewer draws beside the picture: the scale of errors, the divider, and what is known of pixels and of a
// denoised picture.
import type { Picture } from "./api";
import { h, setText } from "./dom";
import * as format from "./format";
import { type ErrorScale, falseColour, halfValue } from "./tone";

export function drawLegend(legend: HTMLElement, scale: ErrorScale | undefined): void {
  legend.hidden = !scale;
  if (!scale) return;
  const key = `${scale.low} ${scale.high}`;
  if (legend.dataset["key"] === key) return;
  legend.dataset["key"] = key;
  const ramp = h("div", { class: "ramp" });
  const stops = Array.from({ length: 9 }, (_, i) => `rgb(${falseColour(i / 8).map(Math.round).join()})`);
  ramp.style.background = `linear-gradient(to right, ${stops.join()})`;
  legend.replaceChildren(h("span", {}, `1e${scale.low}`), ramp, h("span", {}, `1e${scale.high}`), h("span", { class: "muted" }, "relMSE"));
}

/** A line at `divider`, in screen pixels, with the names of both sides. */
export function drawDivider(g: CanvasRenderingContext2D, divider: number, height: number, names: [a: string, b: string]): void {
  const ratio = devicePixelRatio;
  g.fillStyle = "#ffb74d";
  g.fillRect(divider - ratio / 2, 0, Math.max(1, ratio), height);
  g.font = `${11 * ratio}px system-ui`;
  g.textBaseline = "top";
  for (const [text, x, align] of [[`A ${names[0]}`, divider - 6 * ratio, "right"], [`B ${names[1]}`, divider + 6 * ratio, "left"]] as const) {
    g.textAlign = align;
    g.fillStyle = "#000a";
    const w = g.measureText(text).width + 8 * ratio;
    g.fillRect(align === "right" ? x - w + 4 * ratio : x - 4 * ratio, 6 * ratio, w, 17 * ratio);
    g.fillStyle = "#fff";
    g.fillText(text, x, 9 * ratio);
  }
}

/** The values of a pixel of the job's image, which may have another size than the picture. */
export function valueText(picture: Picture | undefined, x: number, y: number, size: { width: number; height: number }): string {
  if (!picture || !(x >= 0 && y >= 0 && x < size.width && y < size.height)) return "";
  const sx = Math.min(picture.width - 1, Math.floor((x * picture.width) / size.width));
  const sy = Math.min(picture.height - 1, Math.floor((y * picture.height) / size.height));
  const at = (sy * picture.width + sx) * picture.channels;
  if (picture.float) return `relMSE ${picture.float[at]!.toExponential(2)}`;
  return [0, 1, 2].map((c) => halfValue(picture.half![at + c]!).toPrecision(4)).join("  ");
}

function denoisedText(picture: Picture): string {
  const { relmse, relmseRaw, layers, block } = picture.denoised!;
  const difference = layers.includes("difference");
  return [
    `Estimated relMSE ${format.error(relmse)}, before ${format.error(relmseRaw)}${block > 1 ? `, of means over ${block} × ${block} pixels: the image is too large to be denoised whole here` : ""}.`,
    layers.length ? `By ${layers.join(", ")}.` : "By the colour alone.",
    difference ? "" : "The noise is guessed: --aov denoise at submission makes it better.",
    picture.stale ? "A newer one is being made." : "",
  ].filter(Boolean).join(" ");
}

function mixNote(block: number): string {
  return `Light mix of the image as it was rendered, with its noise${block > 1 ? `, in means over ${block} × ${block} pixels` : ""}.`;
}

/** Hidden unless one of the pictures is denoised or mixed. */
export function drawNote(note: HTMLElement, a: Picture | undefined, b: Picture | undefined): void {
  const one = a?.denoised ? denoisedText(a) : a?.mixBlock ? mixNote(a.mixBlock) : "";
  const other = b?.denoised ? `B: ${denoisedText(b)}` : "";
  setText(note, [one, other].filter(Boolean).join(" "));
  note.hidden = note.textContent === "";
}
