// All workers: speed, health, and what they are at.
import { Cleanup, h, setText } from "./dom";
import * as format from "./format";
import { idNumber, store } from "./store";
import type { Worker } from "./types";
import { VirtualTable } from "./virtual_table";

const kRank: Record<string, number> = { refused: 0, benched: 1, lost: 2, draining: 3, rendering: 4, idle: 5 };

const kHealth: Record<string, string> = {
  idle: "ready",
  rendering: "",
  draining: "takes no more tiles",
  lost: "not heard of; its tiles go to others",
  benched: "failed too often; gets tiles again after a pause",
  refused: "another build: install the coordinator's version",
};

function health(worker: Worker): string {
  const parts = [kHealth[worker.state] ?? ""];
  if (worker.refused > 0) parts.push(`${worker.refused} partials refused`);
  if (worker.silent_seconds > 0 && worker.state !== "refused") parts.push(`silent for ${format.duration(worker.silent_seconds)}`);
  return parts.filter(Boolean).join(" · ");
}

/** Goes from the list to the timeline and back. */
export function workerViews(now: "list" | "timeline"): HTMLElement {
  const view = (key: string, hash: string, label: string) => h("a", { href: hash, title: "the other one: v", "aria-current": key === now ? "true" : undefined }, label);
  return h("div", { class: "views", role: "group", "aria-label": "View" }, view("list", "#/workers", "List"), view("timeline", "#/workers/timeline", "Timeline"));
}

export function workersPage(cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  const filter = h("input", {
    type: "search",
    class: "filter",
    placeholder: "Filter: host, id, pool, state, job  ( / )",
    "aria-label": "Filter workers",
    oninput: () => update(),
  });
  const total = h("span", { class: "muted" });
  let fastest = 1;
  const table = new VirtualTable<Worker>(
    {
      label: "Workers",
      id: (worker) => worker.id,
      open: (worker) => {
        if (worker.held[0]) location.hash = `#/jobs/${worker.held[0][0]}`;
      },
      sort: { key: "state", down: false },
      rowStyle: (worker) => (worker.state === "lost" ? "faint" : ""),
      empty: () =>
        store.workersVersion === 0 ? "Waiting for the coordinator…" : store.workers.size > 0 ? "No worker fits the filter." : "No workers yet: lightmill-worker --coordinator HOST:PORT starts one.",
      columns: [
        { key: "id", title: "Worker", width: "70px", text: (w) => w.id, sort: (w) => idNumber(w.id) },
        { key: "host", title: "Host", width: "minmax(120px, 2fr)", text: (w) => w.host },
        { key: "state", title: "State", width: "90px", text: (w) => w.state, sort: (w) => kRank[w.state] ?? 9, style: (w) => `state ${w.state}` },
        { key: "health", title: "Health", width: "minmax(140px, 3fr)", text: health, style: () => "note" },
        { key: "threads", title: "Threads", width: "68px", number: true, text: (w) => String(w.threads), sort: (w) => w.threads },
        {
          key: "rate", title: "Samples/s", width: "130px", number: true, text: (w) => format.short(w.rate), sort: (w) => w.rate,
          draw: (cell, w) => {
            let bar = cell.firstElementChild as HTMLElement | null;
            if (!bar) {
              bar = h("div", { class: "bar plain" }, h("i"), h("span"));
              cell.append(bar);
            }
            (bar.children[0] as HTMLElement).style.width = `${(100 * w.rate) / fastest}%`;
            setText(bar.children[1]!, w.rate > 0 ? format.short(w.rate) : "");
          },
        },
        { key: "perthread", title: "per thread", width: "84px", number: true, text: (w) => (w.rate > 0 ? format.short(w.rate / w.threads) : ""), sort: (w) => w.rate / w.threads },
        { key: "tiles", title: "Tiles", width: "70px", number: true, text: (w) => format.count(w.tiles), sort: (w) => w.tiles },
        { key: "pool", title: "Pool", width: "80px", text: (w) => w.pool },
        { key: "class", title: "Arithmetic", hint: "a job stays within one class of machines that compute the same bits", width: "110px", text: (w) => w.class, style: () => "mono" },
        { key: "held", title: "Renders", width: "minmax(120px, 2fr)", text: (w) => w.held.map(([job, tile]) => `${job} tile ${tile}`).join(", "), sort: (w) => w.held.length },
      ],
    },
    cleanup,
  );
  const update = () => {
    const words = filter.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const all = [...store.workers.values()];
    fastest = all.reduce((most, worker) => Math.max(most, worker.rate), 1e-9);
    const fits = (w: Worker) => {
      const hay = `${w.id} ${w.host} ${w.state} ${w.pool} ${w.class} ${w.held.map(([job]) => job).join(" ")}`.toLowerCase();
      return words.every((word) => hay.includes(word));
    };
    table.setRows(words.length > 0 ? all.filter(fits) : all);
    const threads = all.reduce((n, w) => n + (w.state === "rendering" || w.state === "idle" ? w.threads : 0), 0);
    setText(total, `${format.count(all.length)} ${all.length === 1 ? "worker" : "workers"} · threads at work or ready: ${format.count(threads)}`);
  };
  let version = -1;
  cleanup.add(
    store.watch(() => {
      if (store.workersVersion === version) return;
      version = store.workersVersion;
      update();
    }),
  );
  update();
  queueMicrotask(() => table.focus());
  return {
    element: h("main", { class: "page" }, h("h1", { class: "spoken" }, "Workers"), h("div", { class: "toolbar" }, workerViews("list"), filter, total), table.element),
    key: (key) => {
      if (key === "/") filter.focus();
      else if (key === "v") location.hash = "#/workers/timeline";
      else if (key === "o" || key === "O") table.cycleSort(key === "O");
      else return false;
      return true;
    },
  };
}
