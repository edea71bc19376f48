// Numbers for people: short, of stable width, without false precision.

export function count(value: number): string {
  return Math.round(value).toLocaleString("en-US");
}

/** 1234567 -> "1.23M" */
export function short(value: number): string {
  if (!Number.isFinite(value)) return "–";
  const units: [number, string][] = [[1e12, "T"], [1e9, "G"], [1e6, "M"], [1e3, "k"]];
  for (const [size, unit] of units) {
    if (Math.abs(value) >= size) return (value / size).toPrecision(3) + unit;
  }
  return value === 0 ? "0" : value >= 100 ? value.toFixed(0) : value.toPrecision(3);
}

/** 1234567 -> "1.23 MB" */
export function bytes(value: number): string {
  if (value < 1000) return `${value} B`;
  return `${short(value).replace(/([kMGT])$/, " $1")}B`;
}

/** 75 -> "1m 15s", 1e5 -> "1d 3h"; below a minute whole seconds. */
export function duration(seconds: number): string {
  if (!Number.isFinite(seconds) || seconds < 0) return "–";
  if (seconds < 10) return seconds.toFixed(1) + "s";
  const s = Math.round(seconds);
  if (s < 60) return s + "s";
  if (s < 3600) return `${Math.floor(s / 60)}m ${pad(s % 60)}s`;
  if (s < 86400) return `${Math.floor(s / 3600)}h ${pad(Math.floor((s % 3600) / 60))}m`;
  return `${Math.floor(s / 86400)}d ${Math.floor((s % 86400) / 3600)}h`;
}

/** Of what is only estimated: "less than a minute", "about 12 min". */
export function about(seconds: number): string {
  if (seconds < 60) return "less than a minute";
  if (seconds < 7200) return `about ${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `about ${Math.round(seconds / 3600)} h`;
  return `about ${Math.round(seconds / 86400)} days`;
}

function pad(value: number): string {
  return String(value).padStart(2, "0");
}

/** The time of day at which something ends, with the day if it is another one. */
export function clockTime(at: Date, now = new Date()): string {
  const time = `${pad(at.getHours())}:${pad(at.getMinutes())}`;
  if (at.toDateString() === now.toDateString()) return time;
  return `${at.toLocaleDateString("en-GB", { weekday: "short", day: "numeric", month: "short" })} ${time}`;
}

export function logTime(seconds: number): string {
  const at = new Date(seconds * 1000);
  return `${clockTime(at)}:${pad(at.getSeconds())}`;
}

/** 0.00123 -> "1.23e-3"; errors span decades, so always like this. */
export function error(value: number | undefined): string {
  if (value === undefined) return "";
  return value === 0 ? "0" : value.toExponential(2);
}

export function samples(value: number): string {
  if (value >= 1e5) return short(value);
  return value >= 1000 || Number.isInteger(value) ? count(value) : value.toFixed(1);
}
