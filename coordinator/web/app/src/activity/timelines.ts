// What the workers did in the last hour, as the coordinator tells it: cells of some seconds, and spans of neighbouring
// cells in which a worker was mostly at one job. The first look brings all, later ones what is new.
import { failure } from "../api";

export interface Span {
  job: string;
  cell: number;
  cells: number;
  /** Seconds in which the worker held a tile, of this job or others. */
  busy: number;
  tiles: number;
}

export interface Lane {
  id: string;
  /** Of the last hour: seconds that it was there, and that it held a tile. */
  present: number;
  busy: number;
  spans: Span[]; // oldest first
}

interface Answer {
  cell: number;
  cell_seconds: number;
  cells: number;
  origin: number;
  next?: string;
  workers: { id: string; present_seconds: number; busy_seconds: number; spans: [string, number, number, number, number][] }[];
}

export class Timelines {
  readonly lanes = new Map<string, Lane>();
  /** The present cell, how many are remembered, how long each is, and when cell 0 began (seconds since 1970). */
  cell = 0;
  cells = 360;
  cellSeconds = 10;
  origin = 0;
  told = false;

  timeOf(cell: number): Date {
    return new Date(1000 * (this.origin + cell * this.cellSeconds));
  }

  async poll(signal: AbortSignal): Promise<void> {
    const since = this.told ? `&since=${Math.max(0, this.cell - 1)}` : "";
    const seen = new Set<string>();
    for (let after: string | undefined = ""; after !== undefined; ) {
      const reply: Response = await fetch(`/api/v1/workers/timeline?after=${encodeURIComponent(after)}${since}`, { signal });
      if (!reply.ok) throw await failure(reply);
      const answer = (await reply.json()) as Answer;
      if (this.told && Math.abs(answer.origin - this.origin) > 1) {
        this.lanes.clear(); // another process: its cells are others
        this.told = false;
        return this.poll(signal);
      }
      this.take(answer, seen);
      after = answer.next;
    }
    for (const id of this.lanes.keys()) if (!seen.has(id)) this.lanes.delete(id);
    this.told = true;
  }

  private take(answer: Answer, seen: Set<string>): void {
    this.cell = answer.cell;
    this.cells = answer.cells;
    this.cellSeconds = answer.cell_seconds;
    this.origin = answer.origin;
    const oldest = answer.cell - answer.cells;
    for (const row of answer.workers) {
      seen.add(row.id);
      const fresh = row.spans.map(([job, cell, cells, busy, tiles]) => ({ job, cell, cells, busy, tiles }));
      // What is new begins with a span that may be known already, and has grown.
      const from = fresh[0]?.cell ?? Infinity;
      const known = (this.lanes.get(row.id)?.spans ?? []).filter((span) => span.cell + span.cells <= from && span.cell + span.cells > oldest);
      this.lanes.set(row.id, { id: row.id, present: row.present_seconds, busy: row.busy_seconds, spans: [...known, ...fresh] });
    }
  }
}
