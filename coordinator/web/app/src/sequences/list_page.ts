// All sequences: how far, how noisy, and when they end.
import { Cleanup, h, setText } from "../dom";
import * as format from "../format";
import { RowThumbnails } from "../thumbnails/row_thumbnails";
import { idNumber } from "../store";
import { VirtualTable } from "../virtual_table";
import { actByKey } from "./actions";
import { drawProgress, eta, framesDone, progress } from "./progress";
import { fetchSequences } from "./requests";
import type { Sequence } from "./types";

const kSpacingMs = 2000;
const kRowHeight = 34;
const kRank: Record<string, number> = { running: 0, failed: 1, paused: 2, queued: 3, done: 4, cancelled: 5 };

export function sequencesPage(cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  let rows: Sequence[] = [];
  let told = false;
  let problem = "";
  const filter = h("input", { type: "search", class: "filter", placeholder: "Filter: name, id, who, pool, note  ( / )", "aria-label": "Filter sequences", oninput: () => update() });
  const pictures = new RowThumbnails(() => table.redraw(), cleanup);
  /** Its first frame stands for it. */
  const pictured = (s: Sequence) => ({ id: `${s.id}.${s.first_frame}`, state: s.state, spp: s.packets_done });
  const table = new VirtualTable<Sequence>(
    {
      label: "Sequences",
      rowHeight: kRowHeight,
      id: (s) => s.id,
      open: (s) => (location.hash = `#/sequences/${s.id}`),
      sort: { key: "state", down: false },
      rowStyle: (s) => (s.state === "cancelled" ? "faint" : ""),
      empty: () => problem || (!told ? "Waiting for the coordinator…" : rows.length > 0 ? "No sequence fits the filter." : "No sequences yet: lightmill submit SCENE --frames 1-100 makes one."),
      columns: [
        {
          key: "id", title: "Sequence", width: "70px", text: (s) => s.id, sort: (s) => idNumber(s.id),
          draw: (cell, s) => {
            const link = (cell.firstElementChild as HTMLAnchorElement | null) ?? cell.appendChild(h("a", { tabIndex: -1 }));
            link.href = `#/sequences/${s.id}`;
            setText(link, s.id);
          },
        },
        { key: "picture", title: "Picture", plain: true, width: "46px", text: () => "", draw: (cell, s) => pictures.draw(cell, pictured(s)), style: () => "thumb" },
        { key: "name", title: "Name", width: "minmax(130px, 2fr)", text: (s) => s.name, sort: (s) => s.name.toLowerCase() },
        { key: "state", title: "State", width: "74px", text: (s) => s.state, sort: (s) => kRank[s.state] ?? 9, style: (s) => `state ${s.state}` },
        { key: "progress", title: "Progress", width: "84px", number: true, text: (s) => String(progress(s)), sort: progress, draw: drawProgress },
        { key: "frames", title: "Frames done", width: "130px", number: true, sort: (s) => s.frames.done, text: framesDone, style: (s) => (s.frames.failed > 0 ? "bad-text" : "") },
        { key: "mean", title: "Mean relMSE", hint: "of the frames that have an estimate", width: "88px", number: true, sort: (s) => s.relmse_mean, text: (s) => format.error(s.relmse_mean) },
        { key: "max", title: "Max relMSE", hint: "of the noisiest frame", width: "84px", number: true, sort: (s) => s.relmse_max, text: (s) => format.error(s.relmse_max) },
        { key: "time", title: "Time", hint: "render time of all frames so far", width: "76px", number: true, sort: (s) => s.wall_seconds, text: (s) => format.duration(s.wall_seconds) },
        { key: "eta", title: "Ends in · at", width: "118px", number: true, sort: (s) => (s.state === "running" && s.eta_seconds >= 0 ? s.eta_seconds : undefined), text: eta },
        { key: "workers", title: "Workers", width: "60px", number: true, sort: (s) => s.workers, text: (s) => (s.workers > 0 ? String(s.workers) : "") },
        { key: "priority", title: "Prio", width: "40px", number: true, sort: (s) => s.priority, text: (s) => String(s.priority) },
        { key: "submitter", title: "By", hint: "who submitted it", width: "72px", text: (s) => s.submitter ?? "" },
        { key: "note", title: "Note", width: "minmax(180px, 3fr)", text: (s) => s.message ?? "", style: () => "note" },
      ],
    },
    cleanup,
  );
  const update = () => {
    const words = filter.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    table.setRows(rows.filter((s) => {
      const hay = `${s.id} ${s.name} ${s.state} ${s.pool ?? ""} ${s.submitter ?? ""} ${s.message ?? ""}`.toLowerCase();
      return words.every((word) => hay.includes(word));
    }));
  };

  const abort = new AbortController();
  let timer = 0;
  let busy = false;
  const poll = () => {
    clearTimeout(timer);
    if (busy || document.hidden) return;
    busy = true;
    fetchSequences(abort.signal)
      .then((all) => {
        rows = all;
        told = true;
        problem = "";
      })
      .catch((error: unknown) => (problem = error instanceof Error ? error.message : String(error)))
      .finally(() => {
        busy = false;
        if (abort.signal.aborted) return;
        update();
        timer = window.setTimeout(poll, kSpacingMs);
      });
  };
  document.addEventListener("visibilitychange", poll);
  cleanup.add(() => {
    document.removeEventListener("visibilitychange", poll);
    clearTimeout(timer);
    abort.abort();
  });
  update();
  poll();
  queueMicrotask(() => table.focus());
  return {
    element: h("main", { class: "page sequences-page" }, h("h1", { class: "spoken" }, "Sequences"), h("div", { class: "toolbar" }, filter), table.element),
    key: (key) => {
      if (key === "/") {
        filter.focus();
        filter.select();
      } else if (key === "o" || key === "O") {
        table.cycleSort(key === "O");
      } else {
        return actByKey(key, table.selected, poll);
      }
      return true;
    },
  };
}
