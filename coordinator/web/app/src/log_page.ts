// The coordinator's lines about what an operator should know.
import { Cleanup, h } from "./dom";
import { logTime } from "./format";
import { store } from "./store";
import type { LogLine } from "./types";

const kMost = 500; // in the document; the filter reaches the others

/** Lines with links to the jobs and sequences they name. */
export function drawLines(list: HTMLElement, lines: LogLine[]): void {
  list.replaceChildren(
    ...lines.map((line) => {
      const text = h("span", { class: "log-text" });
      let at = 0;
      for (const match of line.text.matchAll(/\b(?:j\d+|s\d+(?:\.-?\d+)?)\b/g)) {
        const page = /^s\d+$/.test(match[0]) ? "sequences" : "jobs";
        text.append(line.text.slice(at, match.index), h("a", { href: `#/${page}/${match[0]}` }, match[0]));
        at = match.index + match[0].length;
      }
      text.append(line.text.slice(at));
      return h("li", {}, h("time", {}, logTime(line.time)), text);
    }),
  );
}

export function logPage(cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  const filter = h("input", { type: "search", class: "filter", placeholder: "Filter  ( / )", "aria-label": "Filter the log", oninput: () => update() });
  const list = h("ol", { class: "log", tabIndex: 0, "aria-label": "Log, newest first" });
  const nothing = h("p", { class: "vt-empty" }, "Nothing to report: no lost leases, refused partials or actions since the coordinator started.");
  let drawn: LogLine[] | undefined;
  const update = () => {
    drawn = store.lines;
    const text = filter.value.trim().toLowerCase();
    const lines = store.lines.filter((line) => line.text.toLowerCase().includes(text));
    nothing.hidden = lines.length > 0;
    drawLines(list, lines.slice(-kMost).reverse());
  };
  cleanup.add(store.watch(() => drawn !== store.lines && update()));
  update();
  return {
    element: h("main", { class: "page" }, h("h1", { class: "spoken" }, "Log"), h("div", { class: "toolbar" }, filter), nothing, list),
    key: (key) => {
      if (key !== "/") return false;
      filter.focus();
      return true;
    },
  };
}
