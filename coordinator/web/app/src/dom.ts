// Elements without a framework. Text is always set as text, never as markup.

type Child = Node | string | null | undefined | false;
type Props = { [name: string]: unknown };

/** An element: `on...` are listeners, `data-`/`aria-`/unknown names attributes, the others properties. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) {
      element.addEventListener(name.slice(2), value as EventListener);
    } else if (name === "class") {
      element.className = String(value);
    } else if (name in element && !name.includes("-") && name !== "list" && name !== "role") {
      (element as unknown as Props)[name] = value;
    } else {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
  for (const child of children) if (child) element.append(child);
  return element;
}

/** Sets text only where it differs, so that selections and screen readers are left alone. */
export function setText(node: Node, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

export function setClass(element: Element, name: string): void {
  if (element.className !== name) element.className = name;
}

/** Removes a page's listeners and observers when it goes. */
export class Cleanup {
  private readonly actions: (() => void)[] = [];
  add(action: () => void): void {
    this.actions.push(action);
  }
  run(): void {
    for (const action of this.actions.splice(0)) action();
  }
}

/** At most one call per frame. */
export function perFrame(action: () => void): () => void {
  let waiting = false;
  return () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      action();
    });
  };
}
