// A table of any length: only the rows in sight are in the document. Sorted by its headers, moved through by keys.
import { Cleanup, h, perFrame, setClass, setText } from "./dom";

export interface Column<Row> {
  key: string;
  title: string;
  hint?: string;
  /** Not sorted by; its title is for screen readers. */
  plain?: boolean;
  width: string; // of a CSS grid track
  number?: boolean;
  text: (row: Row) => string;
  /** What is compared; the text if absent. Undefined comes last in either direction. */
  sort?: (row: Row) => number | string | undefined;
  /** Draws more than text into a cell that is used again for other rows. */
  draw?: (cell: HTMLElement, row: Row) => void;
  style?: (row: Row) => string;
  /** What the pointer reads over the cell; the text if absent. */
  tooltip?: (row: Row) => string;
  /** Stands in the header, over the title's cell. */
  head?: Node;
}

export interface TableOptions<Row> {
  label: string;
  columns: Column<Row>[];
  id: (row: Row) => string;
  open?: (row: Row) => void;
  /** A row was chosen. */
  chosen?: (row: Row) => void;
  sort: { key: string; down: boolean };
  /** In pixels, 26 unless given. */
  rowHeight?: number;
  rowStyle?: (row: Row) => string;
  /** What is said in place of rows. */
  empty: () => string;
}

const kHeadHeight = 26;
const kOverscan = 6;

export class VirtualTable<Row> {
  readonly element: HTMLElement;
  private readonly scroller: HTMLElement;
  private readonly body: HTMLElement;
  private readonly nothing: HTMLElement;
  private readonly slots: { row: HTMLElement; cells: HTMLElement[] }[] = [];
  private readonly heads = new Map<string, HTMLElement>();
  private rows: Row[] = [];
  private selectedId = "";
  private sort: { key: string; down: boolean };
  private readonly draw: () => void;
  private readonly rowHeight: number;

  constructor(
    private readonly options: TableOptions<Row>,
    cleanup: Cleanup,
  ) {
    this.sort = { ...options.sort };
    this.rowHeight = options.rowHeight ?? kHeadHeight;
    this.draw = perFrame(() => this.drawNow());
    const tracks = options.columns.map((column) => column.width).join(" ");
    const head = h("div", { class: "vt-head", role: "row" });
    head.style.gridTemplateColumns = tracks;
    for (const column of options.columns) {
      const button = column.plain
        ? h("span", { class: "spoken" }, column.title)
        : h("button", { type: "button", title: column.hint ?? "", onclick: () => this.sortBy(column.key) }, column.title);
      const cell = h("div", { class: column.number ? "vt-h num" : "vt-h", role: "columnheader" }, button, column.head);
      this.heads.set(column.key, cell);
      head.append(cell);
    }
    this.body = h("div", { class: "vt-body", role: "rowgroup" });
    this.nothing = h("div", { class: "vt-empty" });
    this.scroller = h(
      "div",
      {
        class: "vt-scroll",
        tabIndex: 0,
        role: "grid",
        "aria-label": options.label,
        onscroll: this.draw,
        onkeydown: (event: KeyboardEvent) => this.key(event),
        onclick: (event: MouseEvent) => this.click(event),
        ondblclick: () => this.openSelected(),
      },
      head,
      this.body,
      this.nothing,
    );
    this.body.style.setProperty("--tracks", tracks);
    this.body.style.setProperty("--row", `${this.rowHeight}px`);
    this.element = h("div", { class: "vt" }, this.scroller);
    const observer = new ResizeObserver(this.draw);
    observer.observe(this.scroller);
    cleanup.add(() => observer.disconnect());
    this.showSort();
  }

  setRows(rows: Row[]): void {
    this.rows = this.sorted(rows);
    this.draw();
  }
  get selected(): Row | undefined {
    return this.rows.find((row) => this.options.id(row) === this.selectedId);
  }
  select(id: string): void {
    this.selectedId = id;
    this.draw();
  }
  focus(): void {
    this.scroller.focus();
  }
  /** To be called when what the rows show has changed. */
  redraw(): void {
    this.draw();
  }
  /** The next column sorts, for the keyboard; the other way round when `turn`. */
  cycleSort(turn: boolean): void {
    const keys = this.options.columns.filter((column) => !column.plain).map((column) => column.key);
    if (turn) this.sortBy(this.sort.key);
    else this.sortBy(keys[(keys.indexOf(this.sort.key) + 1) % keys.length]!);
  }

  private sortBy(key: string): void {
    const column = this.options.columns.find((c) => c.key === key);
    // Numbers are first looked at from the large end, names from A.
    this.sort = { key, down: this.sort.key === key ? !this.sort.down : !!column?.number };
    this.showSort();
    this.setRows(this.rows);
  }
  private showSort(): void {
    for (const [key, cell] of this.heads) {
      cell.setAttribute("aria-sort", key !== this.sort.key ? "none" : this.sort.down ? "descending" : "ascending");
    }
  }
  private sorted(rows: Row[]): Row[] {
    const column = this.options.columns.find((c) => c.key === this.sort.key);
    if (!column) return rows;
    const value = column.sort ?? column.text;
    const sign = this.sort.down ? -1 : 1;
    const keyed = rows.map((row) => ({ row, key: value(row), id: Number(this.options.id(row).slice(1)) }));
    keyed.sort((a, b) => {
      if (a.key !== b.key) {
        if (a.key === undefined) return 1;
        if (b.key === undefined) return -1;
        return (a.key < b.key ? -1 : 1) * sign;
      }
      return b.id - a.id; // newest first
    });
    return keyed.map((entry) => entry.row);
  }
  private index(): number {
    return this.rows.findIndex((row) => this.options.id(row) === this.selectedId);
  }
  private openSelected(): void {
    const row = this.selected;
    if (row && this.options.open) this.options.open(row);
  }
  private tellChosen(): void {
    const row = this.selected;
    if (row) this.options.chosen?.(row);
  }
  private click(event: MouseEvent): void {
    const element = (event.target as Element).closest<HTMLElement>(".vt-row");
    if (!element?.dataset.id) return;
    this.selectedId = element.dataset.id;
    this.drawNow();
    this.tellChosen();
    // A link in the row is followed by the browser.
  }
  private key(event: KeyboardEvent): void {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const page = Math.max(1, Math.floor(this.scroller.clientHeight / this.rowHeight) - 2);
    const at = this.index();
    const to: { [key: string]: number } = {
      ArrowDown: at + 1,
      ArrowUp: at < 0 ? 0 : at - 1,
      PageDown: at + page,
      PageUp: at - page,
      Home: 0,
      End: this.rows.length - 1,
    };
    if (event.key === "Enter") {
      this.openSelected();
    } else if (event.key in to && this.rows.length > 0) {
      const next = Math.min(this.rows.length - 1, Math.max(0, to[event.key]!));
      this.selectedId = this.options.id(this.rows[next]!);
      this.reveal(next);
      this.drawNow();
      this.tellChosen();
    } else {
      return;
    }
    event.preventDefault();
  }
  private reveal(index: number): void {
    const head = kHeadHeight; // it stays in sight, above the rows
    const top = index * this.rowHeight;
    const view = this.scroller;
    if (top < view.scrollTop) view.scrollTop = top;
    else if (top + this.rowHeight + head > view.scrollTop + view.clientHeight) {
      view.scrollTop = top + this.rowHeight + head - view.clientHeight;
    }
  }
  private drawNow(): void {
    const { columns } = this.options;
    const view = this.scroller;
    const first = Math.max(0, Math.floor(view.scrollTop / this.rowHeight) - kOverscan);
    const last = Math.min(this.rows.length, Math.ceil((view.scrollTop + view.clientHeight) / this.rowHeight) + kOverscan);
    this.body.style.height = `${this.rows.length * this.rowHeight}px`;
    this.nothing.hidden = this.rows.length > 0;
    if (!this.nothing.hidden) setText(this.nothing, this.options.empty());
    view.setAttribute("aria-rowcount", String(this.rows.length + 1));
    while (this.slots.length < last - first) {
      const cells = columns.map((column) => h("div", { class: column.number ? "num" : "", role: "gridcell" }));
      const row = h("div", { class: "vt-row", role: "row", id: `row-${Math.random().toString(36).slice(2)}` }, ...cells);
      this.slots.push({ row, cells });
      this.body.append(row);
    }
    let active = "";
    this.slots.forEach((slot, i) => {
      const data = this.rows[first + i];
      slot.row.hidden = data === undefined || first + i >= last;
      if (data === undefined || slot.row.hidden) return;
      const id = this.options.id(data);
      const chosen = id === this.selectedId;
      if (chosen) active = slot.row.id;
      slot.row.dataset.id = id;
      slot.row.style.transform = `translateY(${(first + i) * this.rowHeight}px)`;
      slot.row.setAttribute("aria-rowindex", String(first + i + 2));
      slot.row.setAttribute("aria-selected", String(chosen));
      setClass(slot.row, `vt-row ${this.options.rowStyle?.(data) ?? ""}`);
      columns.forEach((column, c) => {
        const cell = slot.cells[c]!;
        if (column.style) setClass(cell, `${column.number ? "num " : ""}${column.style(data)}`);
        if (column.draw) column.draw(cell, data);
        else {
          const text = column.text(data);
          setText(cell, text);
          const title = column.tooltip?.(data) || text;
          if (cell.title !== title) cell.title = title;
        }
      });
    });
    if (active) view.setAttribute("aria-activedescendant", active);
    else view.removeAttribute("aria-activedescendant");
  }
}
