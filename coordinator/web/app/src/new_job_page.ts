// A scene from this machine becomes a job: files are dropped or chosen, what it lacks is said, a form sets the rest.
import { mayAct, toast } from "./actions";
import type { SceneCheck } from "./api";
import { Cleanup, h, setText } from "./dom";
import * as format from "./format";
import { chosenFiles, droppedFiles, type LocalFile, pictures, sceneFiles } from "./local_files";
import { SceneSender } from "./scene_sender";
import { store } from "./store";

/** What was dropped on another page, to begin with. */
let brought: LocalFile[] = [];

/** Files can be dropped anywhere; they lead to this page. */
export function installDrop(): void {
  const hasFiles = (event: DragEvent) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  document.addEventListener("dragover", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  document.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) document.body.classList.remove("dropping");
  });
  document.addEventListener("drop", (event) => {
    if (!hasFiles(event) || !event.dataTransfer) return;
    event.preventDefault();
    document.body.classList.remove("dropping");
    droppedFiles(event.dataTransfer)
      .then((files) => {
        brought = files;
        if (location.hash === "#/new") window.dispatchEvent(new Event("hashchange"));
        else location.hash = "#/new";
      })
      .catch((error: unknown) => toast(error instanceof Error ? error.message : String(error), true));
  });
}

interface Setting {
  name: string;
  label: string;
  kind: "int" | "number" | "text";
  hint?: string;
}

const kSettings: Setting[] = [
  { name: "name", label: "Name", kind: "text" },
  { name: "spp", label: "Samples per pixel", kind: "int" },
  { name: "time_seconds", label: "Render time, s", kind: "number", hint: "stops then; in place of samples" },
  { name: "target_error", label: "Target relMSE", kind: "number", hint: "stops below; in place of samples" },
  { name: "width", label: "Width", kind: "int" },
  { name: "height", label: "Height", kind: "int" },
  { name: "max_depth", label: "Depth", kind: "int", hint: "scattering events; 0: unlimited" },
  { name: "seed", label: "Seed", kind: "int" },
  { name: "priority", label: "Priority", kind: "int" },
  { name: "max_workers", label: "Most workers", kind: "int" },
  { name: "pool", label: "Pool", kind: "text" },
  { name: "aovs", label: "AOVs", kind: "text", hint: "albedo,normal,depth…, or all" },
  { name: "camera", label: "Camera", kind: "text", hint: "of a glTF scene, by name" },
];

const kIntegrators: [string, string][] = [["auto", "auto: a pilot chooses"], ["bdpt", "bdpt"], ["pt", "pt"], ["lt", "lt"], ["scene", "as the scene says"]];

export function newJobPage(cleanup: Cleanup): { element: HTMLElement; key: (key: string) => boolean } {
  let files: LocalFile[] = [];
  let busy: AbortController | undefined;

  const folderInput = h("input", { type: "file", multiple: true, hidden: true, webkitdirectory: true, onchange: () => void take(chosenFiles(folderInput.files!)) });
  const filesInput = h("input", { type: "file", multiple: true, hidden: true, onchange: () => void take(chosenFiles(filesInput.files!)) });
  const folderButton = h("button", { type: "button", class: "primary", onclick: () => folderInput.click() }, "Choose a folder…");
  const count = h("p", { class: "muted" });
  const drop = h("section", { class: "panel drop", "aria-label": "Files" },
    h("p", {}, "Drop a scene's folder, or its files, anywhere here: .pbrt, .gltf or .glb with what it refers to. Only what it needs is sent."),
    h("div", { class: "actions" }, folderButton, h("button", { type: "button", onclick: () => filesInput.click() }, "Choose files…"), folderInput, filesInput), count);

  const main = h("select", { id: "new-main", onchange: () => void look() });
  const environment = h("select", { id: "new-environment", onchange: () => void look() });
  const integrator = h("select", { id: "new-integrator" }, ...kIntegrators.map(([value, label]) => h("option", { value }, label)));
  const strict = h("input", { type: "checkbox", id: "new-strict", onchange: () => void look() });
  const inputs: Record<string, HTMLInputElement> = {};
  const field = (id: string, label: string, control: HTMLElement, hint?: string) =>
    h("div", { class: "field" }, h("label", { htmlFor: id }, label), control, hint ? h("small", { id: `${id}-hint` }, hint) : null);
  const settings = kSettings.map((setting) => {
    const id = `new-${setting.name}`;
    const input = h("input", { id, name: setting.name, type: setting.kind === "text" ? "text" : "number", step: setting.kind === "int" ? "1" : "any", min: setting.kind === "text" || setting.name === "priority" ? undefined : "0", autocomplete: "off", "aria-describedby": setting.hint ? `${id}-hint` : undefined });
    inputs[setting.name] = input;
    return field(id, setting.label, input, setting.hint);
  });
  const submit = h("button", { type: "submit", class: "primary" }, "Submit");
  const stop = h("button", { type: "button", hidden: true, onclick: () => busy?.abort() }, "Stop");
  const bar = h("progress", { "aria-label": "Sent", hidden: true });
  const status = h("p", { class: "new-status", role: "status" });
  const problems = h("ul", { class: "problems", role: "alert" });
  const form = h("form", { class: "panel", hidden: true, onsubmit: (event: Event) => { event.preventDefault(); void send(); } },
    h("div", { class: "field-grid" }, field("new-main", "Scene file", main), field("new-integrator", "Integrator", integrator), field("new-environment", "Environment", environment, "lights a glTF scene"),
      h("div", { class: "field" }, h("label", { htmlFor: "new-strict" }, "Strict"), h("span", {}, strict), h("small", {}, "what is not supported is an error")), ...settings),
    h("div", { class: "dialog-buttons" }, stop, submit));
  const outcome = h("section", { class: "panel outcome", "aria-label": "Scene", hidden: true }, status, bar, problems);
  const denied = h("p", { class: "job-note", hidden: true }, "Your token only allows to look.");

  const options = (): Record<string, unknown> => {
    const values: Record<string, unknown> = { integrator: integrator.value };
    if (strict.checked) values["strict"] = true;
    for (const setting of kSettings) {
      const text = inputs[setting.name]!.value.trim();
      if (text !== "") values[setting.name] = setting.kind === "text" ? text : Number(text);
    }
    return values;
  };
  const showProblems = (errors: string[], warnings: string[]) => {
    problems.replaceChildren(...errors.map((text) => h("li", { class: "bad" }, text)), ...warnings.map((text) => h("li", {}, text)));
  };
  const show = (found: SceneCheck) => {
    showProblems(found.errors, found.warnings);
    if (found.errors.length > 0) {
      setText(status, `${found.errors.length === 1 ? "An error" : `${found.errors.length} errors`} in the scene; mend the files and choose them again.`);
      return;
    }
    const size = `${found.width} × ${found.height}`;
    setText(status, `Ready: ${format.count(found.files!)} ${found.files === 1 ? "file" : "files"}, ${format.bytes(found.bytes!)} · ${size}${found.spp ? ` · ${format.samples(found.spp)} samples` : ""} · depth ${found.max_depth || "unlimited"}`);
    const hints: Record<string, number | undefined> = { width: found.width, height: found.height, spp: found.spp, max_depth: found.max_depth };
    for (const [name, value] of Object.entries(hints)) if (inputs[name]!.value === "") inputs[name]!.placeholder = value === undefined ? "" : String(value);
  };
  /** Runs one thing at a time, with progress; what it throws is shown. */
  const run = async (task: (sender: SceneSender, chosenEnvironment?: LocalFile) => Promise<void>) => {
    busy?.abort();
    const mine = (busy = new AbortController());
    const file = files.find((f) => f.path === main.value);
    if (!file) return;
    const sender = new SceneSender(files, file, (text, done, total) => {
      if (busy !== mine) return;
      bar.hidden = total === 0;
      bar.max = Math.max(1, total);
      bar.value = done;
      setText(status, total > 0 ? `${text}, ${format.bytes(done)} of ${format.bytes(total)}` : text);
    }, mine.signal);
    outcome.hidden = false;
    stop.hidden = false;
    submit.disabled = true;
    showProblems([], []);
    try {
      await task(sender, files.find((f) => f.path === environment.value));
    } catch (error) {
      if (busy !== mine) return;
      setText(status, mine.signal.aborted ? "Stopped." : "It was not submitted.");
      if (!mine.signal.aborted) showProblems([error instanceof Error ? error.message : String(error)], []);
    } finally {
      if (busy === mine) {
        stop.hidden = true;
        submit.disabled = false;
        bar.hidden = true;
      }
    }
  };
  // Settings of the form that are wrong are told when it is submitted.
  const look = () => run(async (sender, chosen) => show(await sender.check({ strict: strict.checked, ...(inputs["camera"]!.value.trim() && { camera: inputs["camera"]!.value.trim() }) }, chosen)));
  const send = () =>
    run(async (sender, chosen) => {
      const found = await sender.check(options(), chosen);
      show(found);
      if (found.errors.length > 0) return;
      setText(status, "Submitting…");
      const job = await sender.submit(options(), chosen);
      store.putJobs([job], false);
      toast(`${job.id} is submitted`);
      location.hash = `#/jobs/${job.id}`;
    });
  const take = async (given: LocalFile[]) => {
    if (given.length === 0) return;
    files = given;
    const scenes = await sceneFiles(files);
    if (files !== given) return; // others were chosen meanwhile
    const total = files.reduce((bytes, f) => bytes + f.file.size, 0);
    setText(count, `${format.count(files.length)} ${files.length === 1 ? "file" : "files"}, ${format.bytes(total)}${scenes.length === 0 ? "; none of them is a scene file (.pbrt, .gltf, .glb)" : ""}`);
    form.hidden = scenes.length === 0;
    outcome.hidden = scenes.length === 0;
    main.replaceChildren(...scenes.map((f) => h("option", { value: f.path }, f.path)));
    environment.replaceChildren(h("option", { value: "" }, "none"), ...pictures(files).map((f) => h("option", { value: f.path }, f.path)));
    if (scenes.length === 0) return;
    main.focus();
    void look();
  };
  const update = () => {
    const may = mayAct();
    denied.hidden = may || !store.session;
    folderButton.disabled = !may;
  };
  cleanup.add(store.watch(update));
  cleanup.add(() => busy?.abort());
  update();
  queueMicrotask(() => {
    folderButton.focus();
    void take(brought);
    brought = [];
  });
  return {
    element: h("main", { class: "page new-page" }, h("div", { class: "job-head" }, h("a", { href: "#/jobs", class: "back", title: "all jobs (Esc)" }, "‹ Jobs"), h("h1", {}, "New job")), denied, drop, outcome, form),
    key: (key) => {
      if (key !== "Escape") return false;
      location.hash = "#/jobs";
      return true;
    },
  };
}
