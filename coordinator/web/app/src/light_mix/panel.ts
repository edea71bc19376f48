// The panel beside a job's picture that makes each group of lights brighter, darker or of another colour.
import { h, setText } from "../dom";
import { type GroupMix, factorOf, kLargestFactor, kMostStops, mixCommand, mixText, stopsOf, stopsText } from "./mix";

/** One group: a slider, its factor, its colour, and back to how it was rendered. */
class Row {
  readonly element: HTMLElement;
  readonly group: GroupMix;
  private readonly slider: HTMLInputElement;
  private readonly stops = h("output", { class: "mono" });
  private readonly factor: HTMLInputElement;
  private readonly colour: HTMLInputElement;

  /** `changed(moving)`: while a slider or a colour moves, and once it rests. */
  constructor(name: string, changed: (moving: boolean) => void) {
    this.group = { name, factor: 1, colour: "#ffffff" };
    const on = (take: () => void) => ({
      oninput: () => { take(); changed(true); },
      onchange: () => { take(); changed(false); },
    });
    this.slider = h("input", { type: "range", min: String(-kMostStops), max: String(kMostStops), step: "0.1", "aria-label": `${name}: exposure in stops`, ...on(() => this.set(factorOf(Number(this.slider.value)))) });
    this.factor = h("input", { type: "number", min: "0", max: String(kLargestFactor), step: "any", class: "mono", "aria-label": `${name}: factor`, title: "what its light is multiplied by; 0 switches it off", ...on(() => {
      if (this.factor.value !== "" && this.factor.validity.valid) this.set(Number(this.factor.value), false);
    }), onblur: () => this.show() });
    this.colour = h("input", { type: "color", "aria-label": `${name}: colour`, title: "a filter before its lamps; white changes nothing", ...on(() => { this.group.colour = this.colour.value; }) });
    this.element = h("div", { class: "mix-row", role: "group", "aria-label": `Light group ${name}` },
      h("span", { class: "cut", title: name }, name), this.slider, this.stops, this.factor, this.colour,
      h("button", { type: "button", "aria-label": `${name}: as it was rendered`, title: "as it was rendered", onclick: () => { this.reset(); changed(false); } }, "↺"));
    this.show();
  }
  reset(): void {
    this.group.colour = "#ffffff";
    this.set(1);
  }
  /** `number`: not while somebody writes it. */
  private set(factor: number, number = true): void {
    this.group.factor = factor;
    this.show(number);
  }
  private show(number = true): void {
    const { factor, colour } = this.group;
    const text = stopsText(factor);
    this.slider.value = String(stopsOf(factor));
    this.slider.setAttribute("aria-valuetext", text);
    setText(this.stops, text.replace(" stops", ""));
    if (number) this.factor.value = String(factor);
    this.colour.value = colour;
  }
}

export class LightMixPanel {
  readonly element: HTMLElement;
  private readonly list = h("div", { class: "mix-rows" });
  private readonly command = h("code", { class: "mono mix-command" });
  private readonly said = h("span", { class: "muted", role: "status" });
  private rows: Row[] = [];
  private names = "";

  /** `show(text, moving)`: the picture is to show this mix; `offer()`: there is something to mix. */
  constructor(
    private readonly job: string,
    private readonly show: (text: string, moving: boolean) => void,
    private readonly offer: () => void,
  ) {
    this.element = h("section", { class: "panel light-mix", "aria-label": "Light mix", hidden: true },
      h("header", {}, h("h2", {}, "Light mix"), h("span", { class: "grow" }), h("button", { type: "button", title: "all groups as they were rendered", onclick: () => this.reset() }, "Reset")),
      this.list,
      h("p", { class: "chart-text" }, "The same of the EXR, at its full size: ", this.said),
      h("div", { class: "mix-copy" }, this.command, h("button", { type: "button", "aria-label": "Copy the command", onclick: () => void this.copy() }, "Copy")));
  }
  /** Of a job's settings, "key,fill,rest"; the panel is there only if there are any. */
  setGroups(names: string): void {
    if (names === this.names || names === "") return;
    this.names = names;
    this.rows = names.split(",").map((name) => new Row(name, (moving) => this.changed(moving)));
    this.list.replaceChildren(...this.rows.map((row) => row.element));
    this.element.hidden = false;
    this.drawCommand();
    this.offer();
  }
  private reset(): void {
    for (const row of this.rows) row.reset();
    this.changed(false);
  }
  private groups(): GroupMix[] {
    return this.rows.map((row) => row.group);
  }
  private changed(moving: boolean): void {
    this.drawCommand();
    this.show(mixText(this.groups()), moving);
  }
  private drawCommand(): void {
    setText(this.command, mixCommand(this.job, this.groups()));
    setText(this.said, "");
  }
  private async copy(): Promise<void> {
    try {
      await navigator.clipboard.writeText(this.command.textContent ?? "");
      setText(this.said, "copied.");
    } catch {
      // Browsers refuse that in some windows: then it is chosen, for the keys that copy.
      getSelection()?.selectAllChildren(this.command);
      setText(this.said, "chosen: copy it with Ctrl+C.");
    }
  }
}
