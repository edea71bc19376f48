// One sequence: its frames side by side and as they move, where the noise and the time are, and what failed.
import { Cleanup, h, perFrame, setText } from "../dom";
import * as format from "../format";
import { store } from "../store";
import { actByKey, actionBar } from "./actions";
import { FailedFrames } from "./failed_frames";
import { Filmstrip } from "./filmstrip";
import { FrameChart } from "./frame_chart";
import { FrameList } from "./frame_list";
import { Player } from "./player";
import { drawProgress, eta, framesDone, progress as progressOf } from "./progress";
import type { Sequence } from "./types";

const kFigures = ["Frames done", "Mean relMSE", "Max relMSE", "Ends in · at", "Samples/s", "Workers", "Render time", "CPU time", "Budget", "Deadline", "Order", "Priority", "By", "Pool", "After"];
const kOptional = new Set(["Budget", "Deadline", "By", "Pool", "After"]);

function figures(s: Sequence): Record<string, string> {
  return {
    "Frames done": framesDone(s),
    "Mean relMSE": format.error(s.relmse_mean),
    "Max relMSE": format.error(s.relmse_max),
    "Ends in · at": eta(s),
    "Samples/s": s.rate > 0 ? format.short(s.rate) : "",
    "Workers": `${s.workers}${s.max_workers ? ` / ${s.max_workers}` : ""}`,
    "Render time": format.duration(s.wall_seconds),
    "CPU time": format.duration(s.cpu_seconds),
    "Budget": s.budget_seconds ? format.duration(s.budget_seconds) : "",
    "Deadline": s.deadline ? format.clockTime(new Date(1000 * s.deadline)) : "",
    "Order": s.order,
    "Priority": String(s.priority),
    "By": s.submitter ?? "",
    "Pool": s.pool ?? "",
    "After": (s.after ?? []).join(", "),
  };
}

export function sequencePage(id: string, frame: string, cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  const title = h("h1", {}, id);
  const state = h("span", { class: "state" });
  const progress = h("div", { class: "job-progress" });
  const why = h("p", { class: "job-note", hidden: true });
  const list = h("dl", { class: "job-figures" });
  const values: Record<string, HTMLElement> = {};
  for (const name of kFigures) {
    values[name] = h("dd", {}, "–");
    list.append(h("div", { hidden: kOptional.has(name) }, h("dt", {}, name), values[name]!));
  }

  let place = 0;
  let wanted = frame === "" ? undefined : Number(frame); // of the address, until it has come
  let chosen = ""; // its job
  const choose = (to: number) => {
    const frame = frames.frames[to];
    if (!frame) return;
    wanted = undefined;
    place = to;
    chosen = frame.id;
    show();
  };
  const open = (job: string) => (location.hash = `#/jobs/${job}`);
  const strip = new Filmstrip(choose, (frame) => open(frame.id), cleanup);
  const player = new Player(choose, (job) => strip.thumbnail(job), cleanup);
  const errors = new FrameChart({ title: "Error by frame", value: (f) => f.relmse, text: (v) => `relMSE ${format.error(v)}`, logarithmic: true, none: "No estimate yet: it takes two batches of 16 samples per pixel." }, choose, cleanup);
  const times = new FrameChart({ title: "Time by frame", value: (f) => (f.spp > 0 ? f.wall_seconds : undefined), text: format.duration, logarithmic: false, none: "No frame has samples yet." }, choose, cleanup);
  const failed = new FailedFrames((frame) => choose(frames.place(frame.id) ?? 0), () => frames.poll(), cleanup);
  const bar = actionBar(() => frames.sequence, (s) => frames.put(s));

  /** Where the chosen frame is now; what is large is drawn by itself. */
  const show = () => {
    strip.show(frames.frames, place);
    player.show(frames.frames, place, frames.sequence?.fps ?? 24);
    errors.mark(place);
    times.mark(place);
    const address = `#/sequences/${id}${chosen ? `?frame=${frames.frames[place]?.number ?? ""}` : ""}`;
    if (!player.moves && location.hash !== address) history.replaceState(null, "", address);
  };
  const showHead = () => {
    const s = frames.sequence;
    if (!s) {
      why.hidden = frames.problem === "";
      why.className = "job-note bad";
      setText(why, frames.problem);
      return;
    }
    document.title = `${s.id} ${Math.floor(100 * progressOf(s))}% · Lightmill`;
    setText(title, `${s.id}  ${s.name}`);
    setText(state, s.state);
    state.className = `state ${s.state}`;
    drawProgress(progress, s);
    const text = [s.message, frames.problem].filter(Boolean).join(" · ");
    why.hidden = text === "";
    why.className = `job-note ${s.frames.failed > 0 || frames.problem ? "bad" : ""}`;
    setText(why, text);
    for (const [name, value] of Object.entries(figures(s))) {
      setText(values[name]!, value || "–");
      values[name]!.parentElement!.hidden = value === "" && kOptional.has(name);
    }
    bar.update();
  };
  let fresh = false; // frames have other figures than those that are drawn
  const draw = perFrame(() => {
    showHead();
    if (!fresh) return;
    show();
    if (!frames.complete) return; // what shows all frames is drawn once, and not with every page
    fresh = false;
    errors.show(frames.frames);
    times.show(frames.frames);
    failed.show(frames.frames);
  });
  const frames = new FrameList(id, (changed, moved) => {
    if (changed.length > 0) fresh = true;
    if (wanted !== undefined) {
      const at = frames.frames.findIndex((f) => f.number === wanted);
      if (at >= 0) choose(at);
    }
    if (moved && chosen) place = frames.place(chosen) ?? place;
    draw();
  }, cleanup);
  cleanup.add(store.watch(() => {
    bar.update();
    failed.update();
  }));
  frames.poll();
  queueMicrotask(() => strip.focus());

  const element = h("main", { class: "page job-page sequence-page" },
    h("div", { class: "job-head" }, h("a", { href: "#/sequences", class: "back", title: "all sequences (Esc)" }, "‹ Sequences"), title, state, progress, h("span", { class: "grow" }), bar.element),
    why,
    list,
    h("div", { class: "job-body" }, player.element, h("div", { class: "side" }, errors.element, times.element, failed.element)),
    strip.element);
  return {
    element,
    key: (key) => {
      if (key === "Escape") location.hash = "#/sequences";
      else return player.key(key) || actByKey(key, frames.sequence, (s) => frames.put(s));
      return true;
    },
  };
}
