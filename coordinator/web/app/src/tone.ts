// From linear radiance to the colours of a screen, by tables over all half floats; the curves are those of
// common/image/view_transform.h.
import type { Picture } from "./api";

export type Curve = "srgb" | "filmic" | "aces" | "none";

/** The value of a half float's bits. */
export function halfValue(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15));
}

function encoded(x: number): number {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}

function hable(x: number): number {
  return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
}

function view(linear: number, exposure: number, curve: Curve): number {
  if (!(linear > 0)) return 0;
  const x = Math.min(linear * 2 ** exposure, 1e9);
  if (curve === "filmic") return encoded(Math.min(1, hable(2 * x) / hable(11.2)));
  if (curve === "aces") {
    const y = 0.6 * x;
    return encoded(Math.min(1, (y * (2.51 * y + 0.03)) / (y * (2.43 * y + 0.59) + 0.14)));
  }
  return curve === "none" ? Math.min(1, x) : encoded(Math.min(1, x));
}

let tableFor = "";
const table = new Uint8ClampedArray(65536);

function toneTable(exposure: number, curve: Curve): Uint8ClampedArray {
  const key = `${exposure} ${curve}`;
  if (key !== tableFor) {
    for (let bits = 0; bits < 0x8000; bits++) table[bits] = 255 * view(halfValue(bits), exposure, curve);
    tableFor = key;
  }
  return table;
}

/** The picture as it shows, at its own size. */
export function toned(picture: Picture, exposure: number, curve: Curve): ImageData {
  const tones = toneTable(exposure, curve);
  const data = new ImageData(picture.width, picture.height);
  const out = data.data;
  const half = picture.half!;
  for (let from = 0, to = 0; to < out.length; from += 3, to += 4) {
    out[to] = tones[half[from]!]!;
    out[to + 1] = tones[half[from + 1]!]!;
    out[to + 2] = tones[half[from + 2]!]!;
    out[to + 3] = 255;
  }
  return data;
}

// Dark blue over teal and yellow to red: rises in lightness up to the yellow, and is told apart by those who do not
// see red from green.
const kStops: [number, number, number][] = [
  [18, 14, 54],
  [38, 62, 126],
  [24, 118, 142],
  [62, 170, 120],
  [196, 206, 66],
  [250, 190, 60],
  [240, 96, 40],
  [170, 16, 40],
];

export function falseColour(share: number): [number, number, number] {
  const at = Math.min(1, Math.max(0, share)) * (kStops.length - 1);
  const i = Math.min(kStops.length - 2, Math.floor(at));
  const a = kStops[i]!;
  const b = kStops[i + 1]!;
  const t = at - i;
  return [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t];
}

export interface ErrorScale {
  low: number; // log10
  high: number;
}

/** Whole decades that hold nearly all values. */
export function errorScale(picture: Picture): ErrorScale {
  const logs = Array.from(picture.float!)
    .filter((v) => v > 0)
    .map(Math.log10)
    .sort((a, b) => a - b);
  if (logs.length === 0) return { low: -4, high: 0 };
  const high = Math.ceil(logs[Math.floor(0.995 * (logs.length - 1))]!);
  const low = Math.floor(logs[Math.floor(0.02 * (logs.length - 1))]!);
  return { low: Math.min(low, high - 1), high };
}

export function errorColours(picture: Picture, scale: ErrorScale): ImageData {
  const data = new ImageData(picture.width, picture.height);
  picture.float!.forEach((value, i) => {
    if (Number.isNaN(value)) return; // stays transparent
    const share = value > 0 ? (Math.log10(value) - scale.low) / (scale.high - scale.low) : 0;
    data.data.set([...falseColour(share), 255], 4 * i);
  });
  return data;
}
