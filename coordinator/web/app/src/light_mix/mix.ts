// A light mix: what the light of each group is multiplied by, for the coordinator and for the command line.

export interface GroupMix {
  readonly name: string;
  /** What the light is multiplied by; 0: the group is off. */
  factor: number;
  /** A filter before its lamps, as a screen shows it: "#rrggbb"; white changes nothing. */
  colour: string;
}

export const kLargestFactor = 1e9;
/** Ends of the sliders, in stops; the lower one switches the group off. */
export const kMostStops = 8;

/** Four digits, so that both forms say the same numbers and stay short. */
function rounded(value: number): number {
  return Number(value.toPrecision(4));
}

function linear(encoded: number): number {
  return encoded <= 0.04045 ? encoded / 12.92 : ((encoded + 0.055) / 1.055) ** 2.4;
}

/** For red, green and blue. */
export function factors(group: GroupMix): number[] {
  return [1, 3, 5].map((at) => rounded(group.factor * linear(parseInt(group.colour.slice(at, at + 2), 16) / 255)));
}

function text(group: GroupMix, separator: string): string {
  const [r, g, b] = factors(group);
  return r === g && g === b ? String(r) : [r, g, b].join(separator);
}

function changed(groups: readonly GroupMix[]): GroupMix[] {
  return groups.filter((group) => factors(group).some((factor) => factor !== 1));
}

/** "key:1.5,fill:0.2/0.3/0.4", the groups that change; "" if none does. */
export function mixText(groups: readonly GroupMix[]): string {
  return changed(groups).map((group) => `${group.name}:${text(group, "/")}`).join();
}

/** The command that makes the same of the job's EXR. */
export function mixCommand(job: string, groups: readonly GroupMix[]): string {
  const given = changed(groups).map((group) => `${group.name}=${text(group, ",")}`);
  return ["lightmill mix", `${job}.exr`, ...given, `-o ${job}-mix.exr`].join(" ");
}

/** The slider's place. */
export function stopsOf(factor: number): number {
  return factor > 0 ? Math.min(kMostStops, Math.max(0.1 - kMostStops, Math.log2(factor))) : -kMostStops;
}

export function factorOf(stops: number): number {
  return stops <= -kMostStops ? 0 : rounded(2 ** stops);
}

export function stopsText(factor: number): string {
  if (factor === 0) return "off";
  const stops = Math.log2(factor);
  return `${stops > 0 ? "+" : ""}${stops.toFixed(1).replace(/\.0$/, "")} stops`.replace("-0 ", "0 ");
}
