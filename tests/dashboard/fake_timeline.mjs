// Timelines of made-up workers, as coordinator/web/web_api.cc tells them: busy farms have more spans than any test farm.

const kCells = 360;

export class MadeUpTimeline {
  asked = []; // the queries
  cell = 100000;

  /** Every worker goes to another job every `cells` cells; every tenth is idle half of the time. */
  constructor(workers, cells) {
    this.workers = workers;
    this.cells = cells;
  }
  spans(worker, since) {
    const spans = [];
    for (let cell = this.cell + 1 - kCells; cell <= this.cell; cell += this.cells) {
      if (cell + this.cells <= since || (worker % 10 === 0 && (cell / this.cells) % 2 >= 1)) continue;
      spans.push([`j${1 + ((worker * 7 + Math.floor(cell / this.cells)) % 40)}`, cell, this.cells, 9.5 * this.cells, 12]);
    }
    return spans;
  }
  answer(request, response) {
    const url = new URL(request.url, "http://x");
    if (url.pathname !== "/api/v1/workers/timeline") return false;
    this.asked.push(url.search);
    const since = Number(url.searchParams.get("since") ?? -1);
    const begin = Number(url.searchParams.get("after").slice(1) || 0);
    const ids = Array.from({ length: Math.min(1000, this.workers - begin) }, (_, i) => begin + i + 1);
    const workers = ids.map((id) => ({ id: `w${id}`, present_seconds: 3600, busy_seconds: id % 10 === 0 ? 1700 : 3420, spans: this.spans(id, since) }));
    response.writeHead(200, { "Content-Type": "application/json" });
    response.end(JSON.stringify({ cell: this.cell, cell_seconds: 10, cells: kCells, origin: Date.now() / 1000 - 10 * this.cell, workers }));
    return true;
  }
}
