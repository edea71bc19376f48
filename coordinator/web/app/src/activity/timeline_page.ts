// The workers' last hour: who was at which job when, and who had nothing to do.
import { Cleanup, h, setText } from "../dom";
import * as format from "../format";
import { idNumber, store } from "../store";
import type { Worker } from "../types";
import { VirtualTable } from "../virtual_table";
import { workerViews } from "../workers_page";
import { jobColour, LaneCanvases, spanAt, type LaneLook } from "./lane";
import { Timelines, type Lane, type Span } from "./timelines";

const kSpacingMs = 5000;
const kMostNamed = 10; // jobs in the legend

interface Row {
  lane: Lane;
  worker: Worker | undefined;
}

const utilisation = (lane: Lane) => (lane.present > 0 ? Math.min(1, lane.busy / lane.present) : 0);
const percent = (share: number) => `${Math.round(100 * share)} %`;

export function timelinePage(cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  const times = new Timelines();
  let problem = "";
  let version = 0; // of what the lanes show
  const look: LaneLook = { dark: false, line: "", ink: "", width: 0 };
  const readColours = () => {
    const style = getComputedStyle(document.documentElement);
    const variable = (name: string) => style.getPropertyValue(name).trim();
    Object.assign(look, { dark: variable("--dark") === "1", line: variable("--line"), ink: variable("--ink") });
  };
  readColours();

  const summary = h("div", { class: "summary" });
  const figures: Record<string, HTMLElement> = {};
  for (const [key, label] of [["busy", "of the workers' time in the last hour"], ["idle", "worker time idle"], ["workers", "workers"]] as const) {
    figures[key] = h("b", {}, "–");
    summary.append(h("span", { class: "figure" }, figures[key]!, label));
  }
  const legend = h("ul", { class: "tile-legend", "aria-label": "Jobs and their colours" });
  const told = h("span");
  const link = h("a", { hidden: true });
  const readout = h("p", { class: "chart-text lane-readout", role: "status" }, told, " ", link);
  const filter = h("input", { type: "search", class: "filter", placeholder: "Filter: host, id, pool, job  ( / )", "aria-label": "Filter workers", oninput: () => update() });

  // What is read: of the chosen worker by keys, of any by the pointer.
  let cursor: { worker: string; cell: number } | undefined;
  const marked = (lane: Lane): Span | undefined =>
    cursor?.worker === lane.id ? lane.spans.find((span) => cursor!.cell >= span.cell && cursor!.cell < span.cell + span.cells) : undefined;
  const read = (row: Row, span: Span | undefined) => {
    const who = `${row.lane.id}${row.worker ? ` ${row.worker.host}` : ""}`;
    link.hidden = !span;
    if (!span) {
      setText(told, `${who} · busy for ${format.duration(row.lane.busy)} of ${format.duration(row.lane.present)} (${percent(utilisation(row.lane))})`);
      return;
    }
    const name = store.jobs.get(span.job)?.name;
    const clock = (cell: number) => format.logTime(times.timeOf(cell).getTime() / 1000);
    const end = span.cell + span.cells > times.cell ? "now" : clock(span.cell + span.cells);
    const share = Math.min(1, span.busy / (span.cells * times.cellSeconds));
    setText(told, `${who} · ${clock(span.cell)} – ${end} · ${span.tiles} ${span.tiles === 1 ? "tile" : "tiles"} · busy ${percent(share)} · mostly`);
    link.href = `#/jobs/${span.job}`;
    setText(link, `${span.job}${name ? ` ${name}` : ""}`);
  };

  const canvases = new LaneCanvases();
  const laneCell = (cell: HTMLElement, row: Row) => {
    if (look.width === 0) return; // it is not laid out yet
    const { id } = row.lane;
    const canvas = canvases.show(row.lane, version, times, look, marked(row.lane), (made) => {
      made.className = "lane";
      made.setAttribute("role", "img");
      made.setAttribute("aria-label", `The last hour of ${id}`);
      const at = (event: MouseEvent): [Lane | undefined, Span | undefined] => {
        const lane = times.lanes.get(id);
        return [lane, lane && spanAt(lane, times, event.offsetX / look.width)];
      };
      made.addEventListener("pointermove", (event) => {
        const [lane, span] = at(event);
        if (lane) read({ lane, worker: store.workers.get(id) }, span);
      });
      made.addEventListener("click", (event) => {
        const [, span] = at(event);
        cursor = span && { worker: id, cell: span.cell };
      });
    });
    if (cell.firstElementChild !== canvas) cell.replaceChildren(canvas);
  };
  const axis = h("div", { class: "lane-axis", "aria-hidden": "true" });
  for (let minutes = 50; minutes >= 0; minutes -= 10) {
    const mark = h("span", {}, minutes > 0 ? `−${minutes} min` : "now");
    mark.style.left = `${(100 * (60 - minutes)) / 60}%`;
    axis.append(mark);
  }

  const table = new VirtualTable<Row>(
    {
      label: "What the workers did",
      id: (row) => row.lane.id,
      open: (row) => {
        const span = marked(row.lane) ?? row.lane.spans.at(-1);
        if (span) location.hash = `#/jobs/${span.job}`;
      },
      chosen: (row) => {
        if (cursor?.worker !== row.lane.id) cursor = undefined;
        read(row, marked(row.lane));
      },
      sort: { key: "id", down: false },
      rowStyle: (row) => (row.worker?.state === "lost" ? "faint" : ""),
      empty: () => problem || (!times.told ? "Waiting for the coordinator…" : times.lanes.size > 0 ? "No worker fits the filter." : "No workers yet: lightmill-worker --coordinator HOST:PORT starts one."),
      columns: [
        { key: "id", title: "Worker", width: "66px", text: (r) => r.lane.id, sort: (r) => idNumber(r.lane.id) },
        { key: "host", title: "Host", width: "minmax(80px, 150px)", text: (r) => r.worker?.host ?? "" },
        { key: "state", title: "State", width: "80px", text: (r) => r.worker?.state ?? "", style: (r) => `state ${r.worker?.state ?? ""}` },
        {
          key: "busy", title: "Busy", hint: "share of the last hour, or since it came, in which it held a tile", width: "74px", number: true, text: (r) => percent(utilisation(r.lane)), sort: (r) => utilisation(r.lane),
          draw: (cell, r) => {
            const bar = (cell.firstElementChild as HTMLElement | null) ?? cell.appendChild(h("div", { class: "bar" }, h("i"), h("span")));
            (bar.children[0] as HTMLElement).style.width = `${100 * utilisation(r.lane)}%`;
            setText(bar.children[1]!, percent(utilisation(r.lane)));
          },
        },
        { key: "idle", title: "Idle", width: "66px", number: true, text: (r) => format.duration(Math.max(0, r.lane.present - r.lane.busy)), sort: (r) => r.lane.present - r.lane.busy },
        { key: "lane", title: "Last hour", hint: "sorts by the job that it is at", width: "minmax(340px, 1fr)", text: () => "", sort: (r) => r.lane.spans.at(-1)?.job, draw: laneCell, head: axis },
      ],
    },
    cleanup,
  );

  const drawLegend = () => {
    const busy = new Map<string, number>();
    for (const lane of times.lanes.values()) for (const span of lane.spans) busy.set(span.job, (busy.get(span.job) ?? 0) + span.busy);
    const jobs = [...busy].sort((a, b) => b[1] - a[1]);
    const items = jobs.slice(0, kMostNamed).map(([job]) => {
      const swatch = h("i", { "aria-hidden": "true" });
      swatch.style.background = jobColour(job, look.dark);
      return h("li", {}, swatch, h("a", { href: `#/jobs/${job}` }, `${job} ${store.jobs.get(job)?.name ?? ""}`));
    });
    if (jobs.length > kMostNamed) items.push(h("li", {}, `and ${jobs.length - kMostNamed} more`));
    if (!legend.contains(document.activeElement)) legend.replaceChildren(...items); // a link in use stays
  };
  const update = () => {
    const words = filter.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const rows: Row[] = [...times.lanes.values()].map((lane) => ({ lane, worker: store.workers.get(lane.id) }));
    const fits = (r: Row) => {
      const hay = `${r.lane.id} ${r.worker?.host ?? ""} ${r.worker?.state ?? ""} ${r.worker?.pool ?? ""} ${r.lane.spans.map((span) => span.job).join(" ")}`.toLowerCase();
      return words.every((word) => hay.includes(word));
    };
    table.setRows(words.length > 0 ? rows.filter(fits) : rows);
    let present = 0;
    let busy = 0;
    for (const lane of times.lanes.values()) {
      present += lane.present;
      busy += lane.busy;
    }
    setText(figures["busy"]!, present > 0 ? percent(Math.min(1, busy / present)) : "–");
    setText(figures["idle"]!, present > 0 ? format.duration(Math.max(0, present - busy)) : "–");
    setText(figures["workers"]!, format.count(times.lanes.size));
    drawLegend();
  };

  const observer = new ResizeObserver(() => {
    look.width = axis.clientWidth;
    table.redraw();
  });
  observer.observe(axis);
  cleanup.add(() => observer.disconnect());

  const abort = new AbortController();
  let timer = 0;
  let asking = false;
  const poll = () => {
    clearTimeout(timer);
    if (asking || document.hidden) return;
    asking = true;
    times
      .poll(abort.signal)
      .then(() => (problem = ""))
      .catch((error: unknown) => (problem = error instanceof Error ? error.message : String(error)))
      .finally(() => {
        asking = false;
        if (abort.signal.aborted) return;
        version++;
        update();
        timer = window.setTimeout(poll, kSpacingMs);
      });
  };
  const recolour = () => {
    readColours();
    update();
  };
  let workersVersion = store.workersVersion;
  cleanup.add(
    store.watch(() => {
      if (store.workersVersion === workersVersion) return;
      workersVersion = store.workersVersion;
      update();
    }),
  );
  document.addEventListener("visibilitychange", poll);
  document.addEventListener("themechange", recolour);
  cleanup.add(() => {
    document.removeEventListener("visibilitychange", poll);
    document.removeEventListener("themechange", recolour);
    clearTimeout(timer);
    abort.abort();
  });
  update();
  poll();
  queueMicrotask(() => table.focus());

  /** From span to span of the chosen worker; without one the newest first. */
  const step = (by: number): boolean => {
    const row = table.selected;
    if (!row || row.lane.spans.length === 0) return false;
    const { spans } = row.lane;
    const now = marked(row.lane);
    const at = now ? Math.min(spans.length - 1, Math.max(0, spans.indexOf(now) + by)) : spans.length - 1;
    cursor = { worker: row.lane.id, cell: spans[at]!.cell };
    read(row, spans[at]);
    table.redraw();
    return true;
  };
  return {
    element: h("main", { class: "page timeline-page" }, h("h1", { class: "spoken" }, "Timeline of the workers"), summary, h("div", { class: "toolbar" }, workerViews("timeline"), filter, legend), table.element, readout),
    key: (key) => {
      if (key === "/") filter.focus();
      else if (key === "v") location.hash = "#/workers";
      else if (key === "o" || key === "O") table.cycleSort(key === "O");
      else if (key === "ArrowLeft" || key === "ArrowRight") return step(key === "ArrowLeft" ? -1 : 1);
      else return false;
      return true;
    },
  };
}
