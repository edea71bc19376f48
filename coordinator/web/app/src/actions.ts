// What a user may do to a job: buttons, dialogs, and what came of it.
import { act } from "./api";
import { h } from "./dom";
import { store } from "./store";
import type { Job } from "./types";

let toasts: HTMLElement;

export function installToasts(): HTMLElement {
  toasts = h("div", { class: "toasts", role: "status", "aria-live": "polite" });
  return toasts;
}

export function toast(text: string, bad = false): void {
  const element = h("div", { class: bad ? "toast bad" : "toast" }, text);
  toasts.append(element);
  setTimeout(() => element.remove(), bad ? 12000 : 4000);
}

async function run(job: string, action: string, body: object, done: string): Promise<Job | undefined> {
  try {
    const changed = await act(job, action, body);
    store.putJobs([changed], false); // the stream will say the same in a moment
    toast(done);
    return changed;
  } catch (error) {
    toast(error instanceof Error ? error.message : String(error), true);
    return undefined;
  }
}

export interface ActionSpec {
  name: string;
  label: (job: Job) => string;
  key: string;
  may: (job: Job) => boolean;
  run: (job: Job) => void;
}

const kEnded = new Set(["done", "failed", "cancelled"]);

export const actions: ActionSpec[] = [
  {
    name: "pause",
    label: (job) => (job.state === "paused" ? "Resume" : "Pause"),
    key: "p",
    may: (job) => !kEnded.has(job.state),
    run: (job) =>
      job.state === "paused"
        ? void run(job.id, "resume", {}, `${job.id} goes on`)
        : void run(job.id, "pause", {}, `${job.id} pauses; tiles in work are finished`),
  },
  {
    name: "extend",
    label: () => "Extend…",
    key: "x",
    may: (job) => job.state !== "failed" && job.state !== "cancelled",
    run: (job) => void extend(job),
  },
  {
    name: "priority",
    label: () => "Priority…",
    key: "i",
    may: (job) => !kEnded.has(job.state),
    run: (job) => void priority(job),
  },
  {
    name: "resubmit",
    label: () => "Submit again…",
    key: "s",
    may: () => true,
    run: (job) => void resubmit(job),
  },
  {
    name: "retry",
    label: () => "Retry",
    key: "r",
    may: (job) => job.state === "failed" || job.state === "cancelled",
    run: (job) => void run(job.id, "retry", {}, `${job.id} is tried again`),
  },
  {
    name: "cancel",
    label: () => "Cancel…",
    key: "c",
    may: (job) => !kEnded.has(job.state),
    run: (job) => void cancel(job),
  },
];

export function mayAct(): boolean {
  return store.session?.may_act ?? false;
}

/** Runs the action of a key; true if there was one. */
export function actByKey(key: string, job: Job | undefined): boolean {
  const action = actions.find((a) => a.key === key);
  if (!action || !job) return false;
  if (!mayAct()) toast("your token only allows to look", true);
  else if (!action.may(job)) toast(`${job.id} is ${job.state}: no "${action.name}" now`, true);
  else action.run(job);
  return true;
}

export interface Field {
  name: string;
  label: string;
  kind: "number" | "text";
  value: string;
  hint?: string;
  step?: string;
}

/** Asks for values; undefined if the user thought better of it. Empty fields are left out. */
export function ask(title: string, text: string, ok: string, fields: Field[]): Promise<Record<string, string> | undefined> {
  return new Promise((resolve) => {
    const inputs = fields.map((field) =>
      h("input", {
        name: field.name,
        type: field.kind,
        value: field.value,
        step: field.step ?? "any",
        autocomplete: "off",
        "aria-label": field.label,
      }),
    );
    let answer: Record<string, string> | undefined;
    const dialog = h("dialog", { class: "dialog", "aria-label": title });
    const form = h(
      "form",
      {
        onsubmit: (event: Event) => {
          event.preventDefault();
          answer = {};
          for (const input of inputs) if (input.value.trim() !== "") answer[input.name] = input.value.trim();
          dialog.close();
        },
      },
      h("h2", {}, title),
      h("p", {}, text),
      ...fields.map((field, i) =>
        h("label", { class: "field" }, h("span", {}, field.label), inputs[i]!, field.hint ? h("small", {}, field.hint) : null),
      ),
      h(
        "div",
        { class: "dialog-buttons" },
        h("button", { type: "button", onclick: () => dialog.close() }, "Never mind"),
        h("button", { type: "submit", class: "primary" }, ok),
      ),
    );
    dialog.append(form);
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(answer);
    });
    document.body.append(dialog);
    dialog.showModal();
    inputs[0]?.select();
  });
}

const stopRules = (job: Job): Field[] => [
  { name: "spp", label: "Samples per pixel", kind: "number", step: "1", value: job.spp_total ? String(job.spp_total) : "", hint: "in total, not more" },
  { name: "time_seconds", label: "Render time, s", kind: "number", value: job.time_limit ? String(job.time_limit) : "", hint: "in total" },
  { name: "target_error", label: "Target relMSE", kind: "number", value: job.target_error ? String(job.target_error) : "", hint: "stop below" },
];

export function numbers(values: Record<string, string>, texts: string[] = []): object {
  return Object.fromEntries(Object.entries(values).map(([k, v]) => [k, texts.includes(k) ? v : Number(v)]));
}

async function extend(job: Job): Promise<void> {
  const values = await ask(
    `Extend ${job.id}`,
    "What is rendered stays. These are new totals in place of the old ones; whatever is met first stops the job.",
    "Extend",
    stopRules(job),
  );
  if (values) await run(job.id, "extend", numbers(values), `${job.id} is extended`);
}

async function priority(job: Job): Promise<void> {
  const values = await ask(`Priority of ${job.id}`, "Higher goes first; equals go by age.", "Set", [
    { name: "priority", label: "Priority", kind: "number", step: "1", value: String(job.priority) },
  ]);
  if (values) await run(job.id, "priority", numbers(values), `${job.id} has priority ${values["priority"] ?? ""}`);
}

async function resubmit(job: Job): Promise<void> {
  const values = await ask(
    `Submit the scene of ${job.id} again`,
    "A new job with the same scene and settings, but for these.",
    "Submit",
    [
      { name: "name", label: "Name", kind: "text", value: job.name },
      ...stopRules(job),
      { name: "seed", label: "Seed", kind: "number", step: "1", value: "", hint: "as before if empty" },
      { name: "priority", label: "Priority", kind: "number", step: "1", value: String(job.priority) },
      { name: "pool", label: "Pool", kind: "text", value: job.pool ?? "" },
    ],
  );
  if (!values) return;
  const made = await run(job.id, "resubmit", numbers(values, ["name", "pool"]), `submitted ${job.id}'s scene again`);
  if (made) location.hash = `#/jobs/${made.id}`;
}

async function cancel(job: Job): Promise<void> {
  const sure = await ask(`Cancel ${job.id}?`, `${job.name || job.id} stops. What is rendered stays, and "retry" takes it up again.`, "Cancel the job", []);
  if (sure) await run(job.id, "cancel", {}, `${job.id} is cancelled`);
}
