// The plan of a job: which strategies run, what the pilot predicted of others, what the scene needs.
import { h } from "./dom";
import * as format from "./format";
import type { Job, JobDetail, Plan } from "./types";

/** "hit,next-event,light-tracing × 0.5", as plan_text of common/job/plan_text.h. */
function planText(plan: Plan): string {
  const names = plan.strategies.split(",");
  const short = (count: number) => String(Number(count.toPrecision(3)));
  let text = names.join(", ");
  if (names.includes("light-tracing") || names.includes("vertex-connection")) text += ` × ${short(plan.light_paths)}${plan.guided_emission === undefined ? "" : plan.guided_emission ? " guided" : " not guided"}`;
  if (names.includes("vertex-connection")) text += ` × ${short(plan.connections)} connections`;
  if (names.includes("light-tracing") && plan.light_tracing_weight !== undefined) text += `, light tracing weight ${short(plan.light_tracing_weight)}`;
  return plan.sample_allocation ? `${text}, adaptive` : text;
}

/** The plan that runs and what the pilot predicted of the others. */
export function drawPlan(body: HTMLElement, detail: JobDetail, job: Job | undefined): void {
  const settings = detail.settings as { integrator?: string; max_depth?: number; seed?: number; plan?: Plan; overrides?: string; aovs?: string };
  const facts: [string, string][] = [
    ["Sampling", job?.sampling ?? ""],
    ["Depth", settings.max_depth !== undefined && settings.max_depth >= 1 << 20 ? "unlimited" : String(settings.max_depth ?? "")],
    ["Seed", String(settings.seed ?? "")],
    ["Size", `${job?.width} × ${job?.height}`],
    ["Scene", detail.scene],
  ];
  if (settings.overrides) facts.push(["Kept", settings.overrides]);
  if (settings.aovs) facts.push(["AOVs", settings.aovs]);
  const list = h("dl", { class: "facts" });
  for (const [name, value] of facts) list.append(h("dt", {}, name), h("dd", { class: name === "Scene" ? "mono cut" : "", title: value }, value));
  const parts: HTMLElement[] = [list];
  for (const line of detail.missing_light ?? []) parts.push(h("p", { class: "job-note bad" }, `Missing light: ${line}.`));
  if (detail.pilot) {
    const pilot = detail.pilot;
    const same = (a: Plan, b: Plan) => a.strategies === b.strategies && a.light_paths === b.light_paths && a.connections === b.connections && a.light_tracing_weight === b.light_tracing_weight && a.guided_emission === b.guided_emission;
    const chosen = pilot.estimates.find((e) => same(e.plan, pilot.chosen));
    const base = chosen ? chosen.relative_variance * chosen.cost : 0;
    const ranked = [...pilot.estimates].sort((a, b) => a.relative_variance * a.cost - b.relative_variance * b.cost).slice(0, 8);
    const cost = (e: (typeof ranked)[number]) => (base > 0 ? `× ${((e.relative_variance * e.cost) / base).toPrecision(3)}` : "");
    parts.push(
      h("p", { class: "chart-text" }, `The pilot traced ${format.count(pilot.samples)} paths and chose: ${planText(pilot.chosen)}${pilot.adaptive_gain > 1.01 ? `; more samples where the noise is gain × ${pilot.adaptive_gain.toFixed(2)}` : ""}. What it predicts:`),
      h("table", { class: "plain-table" },
        h("thead", {}, h("tr", {}, ...["Plan", "Variance", "µs a sample", "Cost"].map((title, i) => h("th", { scope: "col", class: i > 0 ? "num" : "", title: i === 3 ? "time for the same noise" : "" }, title)))),
        h("tbody", {}, ...ranked.map((e) => h("tr", { class: same(e.plan, pilot.chosen) ? "chosen" : "" },
          h("td", {}, planText(e.plan), same(e.plan, pilot.chosen) ? " (chosen)" : ""), h("td", { class: "num" }, e.relative_variance.toPrecision(3)), h("td", { class: "num" }, e.cost.toPrecision(3)), h("td", { class: "num" }, cost(e)))))),
    );
  }
  body.replaceChildren(...parts);
}

/** What the scene needs and what is left out, and why, as the pilot's worker found; `lightmill explain` prints the same. */
export function drawFeatures(body: HTMLElement, detail: JobDetail): void {
  const features = detail.pilot?.features ?? [];
  if (features.length === 0) {
    const plan = (detail.settings as { integrator?: string }).integrator;
    const why = plan === "auto" && !detail.pilot ? "The pilot has not told yet." : "No pilot told what this scene needs: lightmill explain SCENE does.";
    body.replaceChildren(h("p", { class: "chart-text" }, why));
    return;
  }
  const rows = [...features].sort((a, b) => Number(a.needed) - Number(b.needed));
  body.replaceChildren(
    h("table", { class: "plain-table features" },
      h("thead", {}, h("tr", {}, ...["Feature", "", "Why"].map((title) => h("th", { scope: "col" }, title)))),
      h("tbody", {}, ...rows.map((f) => h("tr", {}, h("th", { scope: "row" }, f.feature), h("td", { class: f.needed ? "" : "good" }, f.needed ? "needed" : "left out"), h("td", {}, f.reason, f.saving ? `; saves ${f.saving}` : ""))))),
  );
}
