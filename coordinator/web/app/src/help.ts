// The keys, under "?".
import { h } from "./dom";

const kKeys: [string, [string, string][]][] = [
  ["Everywhere", [["g j", "jobs"], ["g s", "sequences"], ["g w", "workers"], ["g l", "log"], ["g n", "a new job; or drop a scene's files anywhere"], ["t", "dark, light, or as the system"], ["?", "this list"]]],
  ["Lists", [["↑ ↓ Page Home End", "choose a row"], ["Enter", "open it"], ["/", "filter; Esc goes back to the list"], ["o, O", "sort by the next column; turn round"], ["1 … 5", "all, active, waiting, failed, done"]]],
  ["Workers", [["v", "the list, or the timeline of the last hour"], ["↑ ↓", "choose a worker"], ["← →", "what it was at before, and after"], ["Enter", "that job"]]],
  ["A job (chosen or open)", [["p", "pause, resume"], ["x", "extend"], ["i", "priority"], ["s", "submit again"], ["r", "retry"], ["c", "cancel"], ["Esc", "back to the jobs"]]],
  ["A sequence", [["Space", "play, pause"], ["l", "begin anew at the end, or stop there"], ["← →", "the frame before, the next"], ["Home End", "the first, the last"], ["Enter", "the frame's own page (in the filmstrip)"], ["p x i r c", "as of a job, for all frames"], ["Esc", "back to the sequences"]]],
  ["Picture", [["+ − 0 1", "larger, smaller, fit, pixel for pixel"], ["arrows", "move it (when it has the focus)"], ["e, d", "brighter, darker by half a stop"], ["n", "where the noise is"], ["o", "denoised"], ["m", "the light mix, where there are light groups"], ["b", "another job beside it"]]],
];

export function showHelp(): void {
  if (document.querySelector("dialog[open]")) return;
  const dialog = h("dialog", { class: "dialog help", "aria-label": "Keys" },
    h("h2", {}, "Keys"),
    h("div", { class: "help-grid" }, ...kKeys.map(([title, keys]) => h("section", {}, h("h3", {}, title), h("dl", {}, ...keys.flatMap(([key, text]) => [h("dt", {}, h("kbd", {}, key)), h("dd", {}, text)]))))),
    h("div", { class: "dialog-buttons" }, h("button", { type: "button", onclick: () => dialog.close() }, "Close")));
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}
