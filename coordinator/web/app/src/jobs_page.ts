// All jobs: what runs, what is stuck and why, what ends when, how noisy it still is.
import { actByKey } from "./actions";
import { Cleanup, h, setText } from "./dom";
import * as format from "./format";
import { idNumber, isActive, isWaiting, store } from "./store";
import { RowThumbnails } from "./thumbnails/row_thumbnails";
import type { Job } from "./types";
import { VirtualTable } from "./virtual_table";

const kStates: { key: string; label: string; has: (job: Job) => boolean }[] = [
  { key: "all", label: "All", has: () => true },
  { key: "active", label: "Active", has: isActive },
  { key: "waiting", label: "Waiting", has: isWaiting },
  { key: "failed", label: "Failed", has: (job) => job.state === "failed" },
  { key: "done", label: "Done", has: (job) => job.state === "done" },
];

const kRowHeight = 34;
const kRank: Record<string, number> = { running: 0, failed: 1, paused: 2, queued: 3, done: 4, cancelled: 5 };

/** How far the job is to what ends it first: its packets, its time, or its target, to which the error falls as
 * 1/time. */
export function progress(job: Job): number {
  if (job.state === "done") return 1;
  let share = job.packets_total > 0 ? job.packets_done / job.packets_total : 0;
  if (job.time_limit) share = Math.max(share, job.wall_seconds / job.time_limit);
  if (job.target_error && job.relmse_high) share = Math.max(share, job.target_error / job.relmse_high);
  return Math.min(1, share);
}

/** Seconds until samples, time or target end the job, whichever is first; the error falls as 1/time. */
export function secondsLeft(job: Job): number | undefined {
  if (job.state !== "running") return undefined;
  let left = job.eta_seconds >= 0 ? job.eta_seconds : Infinity;
  if (job.target_error && job.relmse_high !== undefined && job.wall_seconds > 0) {
    left = Math.min(left, Math.max(0, job.wall_seconds * (job.relmse_high / job.target_error - 1)));
  }
  return Number.isFinite(left) ? left : undefined;
}

/** When its turn comes, and when it is done then; "" if that is not known, or it does not wait. */
export function turn(job: Job): string {
  if (job.turn_seconds === undefined) return "";
  const end = job.eta_seconds >= 0 ? `, done in ${format.about(job.eta_seconds)}` : "";
  return `its turn comes in ${format.about(job.turn_seconds)}${end}`;
}

export function eta(job: Job): string {
  const left = secondsLeft(job);
  if (left === undefined) return "";
  return `${format.duration(left)} · ${format.clockTime(new Date(Date.now() + 1000 * left))}`;
}

export function drawProgress(cell: HTMLElement, job: Job): void {
  let bar = cell.firstElementChild as HTMLElement | null;
  if (!bar) {
    bar = h("div", { class: "bar" }, h("i"), h("span"));
    cell.append(bar);
  }
  const share = progress(job);
  (bar.children[0] as HTMLElement).style.width = `${100 * share}%`;
  setText(bar.children[1]!, `${Math.floor(100 * share)}%`);
}

export function jobsPage(cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  let shown = sessionStorage.getItem("jobs.state") ?? "all";
  const summary = h("div", { class: "summary" });
  const figures: Record<string, HTMLElement> = {};
  const figure = (key: string, label: string) => {
    figures[key] = h("b", {}, "–");
    summary.append(h("span", { class: `figure ${key}` }, figures[key]!, label));
  };
  figure("running", "running");
  figure("waiting", "waiting");
  figure("failed", "failed");
  figure("rate", "samples/s");
  figure("rendering", "workers rendering");
  figure("idle", "idle");
  figure("lost", "lost or benched");

  const filter = h("input", {
    type: "search",
    class: "filter",
    placeholder: "Filter: name, id, who, pool, note  ( / )",
    "aria-label": "Filter jobs",
    value: sessionStorage.getItem("jobs.filter") ?? "",
    oninput: () => {
      sessionStorage.setItem("jobs.filter", filter.value);
      update();
    },
  });
  const chips = kStates.map((state) =>
    h("button", { type: "button", class: "chip", onclick: () => { shown = state.key; sessionStorage.setItem("jobs.state", shown); update(); } }, state.label, h("small")),
  );

  const pictures = new RowThumbnails(() => table.redraw(), cleanup);
  const table = new VirtualTable<Job>(
    {
      label: "Jobs",
      rowHeight: kRowHeight,
      id: (job) => job.id,
      open: (job) => (location.hash = `#/jobs/${job.id}`),
      sort: { key: "state", down: false },
      rowStyle: (job) => (job.state === "cancelled" ? "faint" : ""),
      empty: () =>
        store.jobsVersion === 0 ? "Waiting for the coordinator…" : store.jobs.size > 0 ? "No job fits the filter." : "No jobs yet: drop a scene's folder here, or lightmill submit SCENE makes one.",
      columns: [
        {
          key: "id", title: "Job", width: "52px", text: (job) => job.id, sort: (job) => idNumber(job.id),
          draw: (cell, job) => {
            const link = (cell.firstElementChild as HTMLAnchorElement | null) ?? cell.appendChild(h("a", { tabIndex: -1 }));
            link.href = `#/jobs/${job.id}`;
            setText(link, job.id);
          },
        },
        { key: "picture", title: "Picture", plain: true, width: "46px", text: () => "", draw: (cell, job) => pictures.draw(cell, job), style: () => "thumb" },
        { key: "name", title: "Name", width: "minmax(130px, 2fr)", text: (job) => job.name, sort: (job) => job.name.toLowerCase() },
        { key: "state", title: "State", width: "74px", text: (job) => job.state, sort: (job) => kRank[job.state] ?? 9, style: (job) => `state ${isWaiting(job) ? "waiting " : ""}${job.state}`, tooltip: note },
        { key: "progress", title: "Progress", width: "84px", number: true, text: (job) => String(progress(job)), sort: progress, draw: drawProgress },
        { key: "spp", title: "Samples", hint: "per pixel, so far and in all", width: "100px", number: true, sort: (job) => job.spp, text: (job) => `${format.samples(job.spp)}${job.spp_total ? " / " + format.samples(job.spp_total) : ""}` },
        { key: "relmse", title: "relMSE", hint: "estimated relative error", width: "70px", number: true, sort: (job) => job.relmse, text: (job) => format.error(job.relmse), style: (job) => (job.target_error && (job.relmse_high ?? Infinity) <= job.target_error ? "good" : "") },
        { key: "target", title: "Target", width: "66px", number: true, sort: (job) => job.target_error, text: (job) => format.error(job.target_error) },
        { key: "eta", title: "Ends in · at", width: "118px", number: true, sort: secondsLeft, text: eta },
        { key: "rate", title: "Samples/s", width: "74px", number: true, sort: (job) => job.rate, text: (job) => (job.rate > 0 ? format.short(job.rate) : "") },
        { key: "workers", title: "Workers", width: "60px", number: true, sort: (job) => job.workers, text: (job) => (job.workers > 0 || job.max_workers ? `${job.workers}${job.max_workers ? ` / ${job.max_workers}` : ""}` : "") },
        { key: "wall", title: "Time", hint: "render time so far", width: "66px", number: true, sort: (job) => job.wall_seconds, text: (job) => format.duration(job.wall_seconds) },
        { key: "priority", title: "Prio", width: "40px", number: true, sort: (job) => job.priority, text: (job) => String(job.priority) },
        { key: "submitter", title: "By", hint: "who submitted it", width: "72px", text: (job) => job.submitter ?? "" },
        { key: "pool", title: "Pool", width: "64px", text: (job) => job.pool ?? "" },
        { key: "note", title: "Note", width: "minmax(210px, 4fr)", text: (job) => note(job), style: () => "note" },
      ],
    },
    cleanup,
  );

  let jobsVersion = -1;
  let lastText = "";
  const update = () => {
    const text = filter.value.trim().toLowerCase();
    const all = [...store.jobs.values()];
    chips.forEach((chip, i) => {
      const state = kStates[i]!;
      chip.setAttribute("aria-pressed", String(state.key === shown));
      setText(chip.lastElementChild!, ` ${format.count(all.reduce((n, job) => n + (state.has(job) ? 1 : 0), 0))}`);
    });
    const words = text.split(/\s+/).filter(Boolean);
    const has = kStates.find((state) => state.key === shown)?.has ?? (() => true);
    const fits = (job: Job) => {
      if (!has(job)) return false;
      if (words.length === 0) return true;
      const hay = `${job.id} ${job.name} ${job.state} ${job.pool ?? ""} ${job.submitter ?? ""} ${job.message ?? ""} ${job.sampling}`.toLowerCase();
      return words.every((word) => hay.includes(word));
    };
    table.setRows(all.filter(fits));
    let running = 0;
    for (const job of all) if (job.state === "running" && job.tiles_leased > 0) running++;
    let rate = 0; // also of frames of sequences, which are no rows here
    const workers = { rendering: 0, idle: 0, lost: 0 };
    for (const worker of store.workers.values()) {
      if (worker.state === "rendering") rate += worker.rate;
      if (worker.state === "rendering") workers.rendering++;
      else if (worker.state === "idle") workers.idle++;
      else if (worker.state === "lost" || worker.state === "benched" || worker.state === "refused") workers.lost++;
    }
    const put = (key: string, value: string, on = true) => {
      setText(figures[key]!, value);
      figures[key]!.parentElement!.classList.toggle("zero", !on);
    };
    put("running", format.count(running), running > 0);
    const waiting = all.filter(isWaiting).length;
    put("waiting", format.count(waiting), waiting > 0);
    const failed = all.filter((job) => job.state === "failed").length;
    put("failed", format.count(failed), failed > 0);
    put("rate", format.short(rate), rate > 0);
    for (const key of ["rendering", "idle", "lost"] as const) put(key, format.count(workers[key]), workers[key] > 0);
    jobsVersion = store.jobsVersion;
    lastText = text;
  };
  let workersVersion = -1;
  cleanup.add(
    store.watch(() => {
      if (store.jobsVersion === jobsVersion && store.workersVersion === workersVersion && filter.value === lastText) return;
      workersVersion = store.workersVersion;
      update();
    }),
  );
  update();
  queueMicrotask(() => table.focus());
  const element = h("main", { class: "page jobs-page" }, h("h1", { class: "spoken" }, "Jobs"), summary, h("div", { class: "toolbar" }, filter, h("div", { class: "chips", role: "group", "aria-label": "State" }, ...chips)), table.element);
  return {
    element,
    key: (key) => {
      if (key === "/") {
        filter.focus();
        filter.select();
      } else if (key === "o" || key === "O") {
        table.cycleSort(key === "O");
      } else if (/^[1-5]$/.test(key)) {
        chips[Number(key) - 1]!.click();
      } else {
        return actByKey(key, table.selected);
      }
      return true;
    },
  };
}

/** Why it does not get on, or what went wrong. */
export function note(job: Job): string {
  const parts = [];
  if (job.message) parts.push(job.message);
  if (turn(job)) parts.push(turn(job));
  for (const line of job.dropped_lines ?? []) if (line.warning) parts.push(`Dropped light: ${line.text}`);
  if (!job.message && job.state === "queued") parts.push("queued behind other jobs");
  if (!job.message && job.state === "running" && job.tiles_leased === 0) parts.push("runs, but no worker has a tile of it");
  return parts.join(" · ");
}
