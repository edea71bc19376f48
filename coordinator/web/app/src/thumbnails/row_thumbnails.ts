// Thumbnails in the rows of a list: of those in sight only, and once scrolling has come to rest.
import { Cleanup } from "../dom";
import { hasPicture, PictureCache, type Pictured, thumbnails } from "./picture_cache";

const kMostKept = 200;
const kSettleMs = 120;

export class RowThumbnails {
  private readonly cache: PictureCache;
  private drawn: Pictured[] = []; // in the pass that is under way
  private timer = 0;

  /** `changed`: the rows are to be drawn again. */
  constructor(changed: () => void, cleanup: Cleanup) {
    this.cache = new PictureCache(thumbnails(kMostKept), changed);
    cleanup.add(() => {
      clearTimeout(this.timer);
      this.cache.close();
    });
  }

  /** Puts the picture into a cell that is used again for other rows. */
  draw(cell: HTMLElement, row: Pictured): void {
    if (this.drawn.length === 0) queueMicrotask(() => this.wantDrawn());
    this.drawn.push(row);
    const canvas = hasPicture(row) ? this.cache.get(row.id) : undefined;
    if (cell.firstElementChild === (canvas ?? null)) return;
    cell.replaceChildren(...(canvas ? [canvas] : []));
  }

  private wantDrawn(): void {
    const rows = this.drawn;
    this.drawn = [];
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.cache.want(rows), kSettleMs);
  }
}
