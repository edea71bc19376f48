// One job: its picture, how noisy it still is, who is at it, under which plan.
import { actByKey, actions, mayAct } from "./actions";
import { ErrorChart } from "./chart";
import { Cleanup, h, setText } from "./dom";
import * as format from "./format";
import { drawProgress, eta, note, progress as progressOf } from "./jobs_page";
import { drawLines } from "./log_page";
import { LightMixPanel } from "./light_mix/panel";
import { drawFeatures, drawPlan } from "./plan_panel";
import { sequenceOf, store } from "./store";
import { followJob } from "./stream";
import { TileMap } from "./tile_map";
import type { CurvePoint, Job, JobDetail, LogLine } from "./types";
import { Viewer } from "./viewer";

const kLogLines = 100;
const kScales = "Over 4, 16, 32 px";
const kScalesHint =
  "Estimated relMSE of means over boxes of pixels, times the pixels of a box. Noise of independent pixels has the same at every scale. " +
  "More is structure that eyes see from afar and denoisers keep; less says that errors of neighbours cancel.";

export function jobPage(id: string, other: string, cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  const title = h("h1");
  const state = h("span", { class: "state" });
  const progress = h("div", { class: "job-progress" });
  const whyText = h("span");
  const before = h("a", { hidden: true });
  const why = h("p", { class: "job-note", hidden: true }, whyText, " ", before);
  const figures = h("dl", { class: "job-figures" });
  const dropped = h("p", { class: "chart-text", hidden: true });
  const values: { [name: string]: HTMLElement } = {};
  for (const name of ["Samples", "relMSE", kScales, "Target", "Ends in · at", "Samples/s", "Workers", "Render time", "CPU time", "Priority", "By", "Pool", "After", "Leased again"]) {
    values[name] = h("dd");
    figures.append(h("div", { title: name === kScales ? kScalesHint : undefined }, h("dt", {}, name), values[name]!));
  }
  const sequence = sequenceOf(id);
  const home = sequence ? `#/sequences/${sequence}?frame=${id.slice(sequence.length + 1)}` : "#/jobs";
  const buttons = actions.map((action) =>
    h("button", { type: "button", title: `key: ${action.key}`, onclick: () => { const job = store.job(id); if (job) action.run(job); } }),
  );
  const actionBar = h("div", { class: "actions", role: "group", "aria-label": "Actions" }, ...buttons);

  const viewer = new Viewer(id, cleanup, (chosen) => {
    const hash = `#/jobs/${id}${chosen ? `?b=${chosen}` : ""}`;
    if (location.hash !== hash) history.replaceState(null, "", hash);
  });
  const mix = new LightMixPanel(id, (text, moving) => viewer.showMix(text, moving), () => viewer.offerMix());
  const chart = new ErrorChart(cleanup);
  const tiles = new TileMap(id, cleanup);
  const plan = h("div");
  const features = h("div");
  let planOf: JobDetail | undefined; // of what is drawn
  const log = h("ol", { class: "log" });
  const logPanel = h("section", { class: "panel", "aria-label": "Log of this job" }, h("header", {}, h("h2", {}, "Log")), log);

  let detail: JobDetail | undefined;
  let points: CurvePoint[] = [];
  let missing = false;
  let seen: LogLine[] | undefined;
  const drawLog = () => {
    if (seen === store.lines) return;
    seen = store.lines;
    const mine = new RegExp(`\\b${id}\\b`);
    const lines = store.lines.filter((line) => mine.test(line.text)).slice(-kLogLines).reverse();
    logPanel.hidden = lines.length === 0;
    drawLines(log, lines);
  };
  let drawn: Job | undefined;
  let acting: boolean | undefined;
  const update = () => {
    drawLog();
    const job = store.job(id);
    if (!job) {
      setText(title, id);
      why.hidden = !missing;
      if (missing) setText(whyText, `This coordinator has no job ${id}.`);
      return;
    }
    if (job === drawn && acting === mayAct()) return;
    drawn = job;
    acting = mayAct();
    document.title = `${job.id} ${Math.floor(100 * progressOf(job))}% · Lightmill`;
    setText(title, `${job.id}  ${job.name}`);
    setText(state, job.state);
    state.className = `state ${job.state}`;
    drawProgress(progress, job);
    const text = note(job);
    why.hidden = text === "";
    why.className = `job-note ${job.state === "failed" ? "bad" : ""}`;
    setText(whyText, text);
    before.hidden = !job.waits_behind;
    before.href = `#/jobs/${job.waits_behind ?? ""}`;
    setText(before, `Show ${job.waits_behind ?? ""}`);
    const put = (name: string, value: string) => {
      setText(values[name]!, value || "–");
      values[name]!.parentElement!.hidden = value === "" && (name === kScales || name === "Pool" || name === "By" || name === "After" || name === "Target" || name === "Leased again");
    };
    put("Samples", `${format.samples(job.spp)}${job.spp_total ? ` / ${format.samples(job.spp_total)}` : ""}`);
    put("relMSE", job.relmse === undefined ? "" : `${format.error(job.relmse)}${job.relmse_low !== undefined ? `  (${format.error(job.relmse_low)} … ${format.error(job.relmse_high)})` : ""}`);
    const scales = [job.relmse_4, job.relmse_16, job.relmse_32];
    put(kScales, scales.every((error) => error === undefined) ? "" : scales.map((error) => format.error(error) || "–").join(" · "));
    put("Target", format.error(job.target_error));
    put("Ends in · at", eta(job));
    put("Samples/s", job.rate > 0 ? format.short(job.rate) : "");
    put("Workers", `${job.workers}${job.max_workers ? ` / ${job.max_workers}` : ""}`);
    put("By", job.submitter ?? "");
    put("After", (job.after ?? []).join(", "));
    put("Render time", `${format.duration(job.wall_seconds)}${job.time_limit ? ` / ${format.duration(job.time_limit)}` : ""}`);
    put("CPU time", format.duration(job.cpu_seconds));
    put("Priority", String(job.priority));
    put("Pool", job.pool ?? "");
    put("Leased again", job.leases_reassigned > 0 ? format.count(job.leases_reassigned) : "");
    const quiet = (job.dropped_lines ?? []).filter((line) => !line.warning).map((line) => line.text);
    dropped.hidden = quiet.length === 0;
    setText(dropped, `Dropped: ${quiet.join("; ")}.`);
    actions.forEach((action, i) => {
      const button = buttons[i]!;
      setText(button, action.label(job));
      // Focus must not be lost on a button that goes; it stays, and says why not.
      button.setAttribute("aria-disabled", String(!acting || !action.may(job)));
      button.hidden = action.name === "retry" && !action.may(job) && document.activeElement !== button;
    });
    chart.show(points, job);
    if (detail && detail !== planOf) {
      planOf = detail;
      drawPlan(plan, detail, job);
      drawFeatures(features, detail);
    }
  };
  cleanup.add(store.watch(update));
  cleanup.add(
    store.watchJob((news) => {
      if (news.id !== id) return;
      missing = news.missing ?? false;
      if (news.detail) {
        detail = news.detail;
        mix.setGroups(String(detail.settings["light_groups"] ?? ""));
      }
      if (news.points) points = [...points.slice(0, news.points_from ?? 0), ...news.points];
      tiles.take(news);
      drawn = undefined;
      update();
    }),
  );
  for (const button of buttons) {
    button.addEventListener("click", (event) => {
      if (button.getAttribute("aria-disabled") !== "true") return;
      event.stopImmediatePropagation();
    }, { capture: true });
  }
  followJob(id);
  cleanup.add(() => followJob(""));
  if (other) viewer.compare(other);
  update();

  const element = h("main", { class: "page job-page" },
    h("div", { class: "job-head" }, h("a", { href: home, class: "back", title: `${sequence ? "its sequence" : "all jobs"} (Esc)` }, sequence ? `‹ Sequence ${sequence}` : "‹ Jobs"), title, state, progress, h("span", { class: "grow" }), actionBar),
    why,
    figures,
    dropped,
    h("div", { class: "job-body" }, viewer.element,
      h("div", { class: "side" }, mix.element, chart.element, tiles.element,
        h("section", { class: "panel", "aria-label": "Plan" }, h("header", {}, h("h2", {}, "Plan")), plan),
        h("section", { class: "panel", "aria-label": "Scene" }, h("header", {}, h("h2", {}, "Scene needs")), features), logPanel)));
  return {
    element,
    key: (key) => {
      if (key === "Escape") location.hash = home;
      else return viewer.key(key) || actByKey(key, store.job(id));
      return true;
    },
  };
}
