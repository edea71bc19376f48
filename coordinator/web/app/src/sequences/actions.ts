// What a user may do to a sequence: all frames whose state allows it change.
import { ask, mayAct, numbers, toast } from "../actions";
import { h, setText } from "../dom";
import { actOnSequence } from "./requests";
import type { Sequence } from "./types";

type Changed = (sequence: Sequence) => void;

interface SequenceAction {
  name: string;
  label: (sequence: Sequence) => string;
  key: string;
  may: (sequence: Sequence) => boolean;
  run: (sequence: Sequence, changed: Changed) => Promise<void>;
}

const open = (s: Sequence) => s.frames.queued + s.frames.running + s.frames.paused > 0;
/** Nothing but paused frames is left to render. */
const held = (s: Sequence) => s.frames.paused > 0 && s.frames.queued + s.frames.running === 0;

async function run(sequence: Sequence, action: string, body: object, done: string, changed: Changed): Promise<void> {
  try {
    changed(await actOnSequence(sequence.id, action, body));
    toast(done);
  } catch (error) {
    toast(error instanceof Error ? error.message : String(error), true);
  }
}

const kActions: SequenceAction[] = [
  {
    name: "pause",
    label: (s) => (held(s) ? "Resume" : "Pause"),
    key: "p",
    may: open,
    run: (s, changed) =>
      held(s) ? run(s, "resume", {}, `${s.id} goes on`, changed) : run(s, "pause", {}, `${s.id} pauses; tiles in work are finished`, changed),
  },
  { name: "extend", label: () => "Extend…", key: "x", may: (s) => open(s) || s.frames.done > 0, run: extend },
  { name: "priority", label: () => "Priority…", key: "i", may: open, run: priority },
  {
    name: "retry",
    label: () => "Retry",
    key: "r",
    may: (s) => s.frames.failed + s.frames.cancelled > 0,
    run: (s, changed) => run(s, "retry", {}, `the failed and cancelled frames of ${s.id} are tried again`, changed),
  },
  { name: "cancel", label: () => "Cancel…", key: "c", may: open, run: cancel },
];

async function extend(s: Sequence, changed: Changed): Promise<void> {
  const values = await ask(`Extend ${s.id}`, "What is rendered stays. These are new totals of every frame in place of the old ones; whatever is met first stops it.", "Extend", [
    { name: "spp", label: "Samples per pixel", kind: "number", step: "1", value: "", hint: "in total, not more" },
    { name: "time_seconds", label: "Render time, s", kind: "number", value: "", hint: "of a frame, in total" },
    { name: "target_error", label: "Target relMSE", kind: "number", value: "", hint: "stop below" },
  ]);
  if (values) await run(s, "extend", numbers(values), `${s.id} is extended`, changed);
}

async function priority(s: Sequence, changed: Changed): Promise<void> {
  const values = await ask(`Priority of ${s.id}`, "Higher goes first; equals go by age.", "Set", [
    { name: "priority", label: "Priority", kind: "number", step: "1", value: String(s.priority) },
  ]);
  if (values) await run(s, "priority", numbers(values), `${s.id} has priority ${values["priority"] ?? ""}`, changed);
}

async function cancel(s: Sequence, changed: Changed): Promise<void> {
  const sure = await ask(`Cancel ${s.id}?`, `${s.name || s.id} stops. What is rendered stays, and "retry" takes it up again.`, "Cancel the sequence", []);
  if (sure) await run(s, "cancel", {}, `${s.id} is cancelled`, changed);
}

/** Runs the action of a key; true if there was one. */
export function actByKey(key: string, sequence: Sequence | undefined, changed: Changed): boolean {
  const action = kActions.find((a) => a.key === key);
  if (!action || !sequence) return false;
  if (!mayAct()) toast("your token only allows to look", true);
  else if (!action.may(sequence)) toast(`${sequence.id} is ${sequence.state}: no "${action.name}" now`, true);
  else void action.run(sequence, changed);
  return true;
}

/** The same as buttons. */
export function actionBar(current: () => Sequence | undefined, changed: Changed): { element: HTMLElement; update: () => void } {
  const buttons = kActions.map((action) =>
    h("button", { type: "button", title: `key: ${action.key}`, onclick: (event: Event) => {
      const sequence = current();
      if (sequence && (event.currentTarget as Element).getAttribute("aria-disabled") !== "true") void action.run(sequence, changed);
    } }));
  const update = () => {
    const sequence = current();
    if (!sequence) return;
    kActions.forEach((action, i) => {
      setText(buttons[i]!, action.label(sequence));
      // Focus must not be lost on a button that goes; it stays, and says that it does nothing.
      buttons[i]!.setAttribute("aria-disabled", String(!mayAct() || !action.may(sequence)));
    });
  };
  return { element: h("div", { class: "actions", role: "group", "aria-label": "Actions" }, ...buttons), update };
}
