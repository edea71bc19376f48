// What is known of the farm. Pages read it when told that it changed, at most once a frame.
import { perFrame } from "./dom";
import type { Job, JobNews, LogLine, Session, Worker } from "./types";

export type Connection =
  | { state: "connecting" }
  | { state: "live" }
  | { state: "lost"; since: number; why: string };

const kMaxLines = 5000;

class Store {
  readonly jobs = new Map<string, Job>();
  readonly workers = new Map<string, Worker>();
  lines: LogLine[] = [];
  session: Session | undefined;
  connection: Connection = { state: "connecting" };
  /** Grows with every change of the jobs' (workers') rows. */
  jobsVersion = 0;
  workersVersion = 0;
  /** The row of the frame of a sequence that the stream follows: frames are no rows among the jobs. */
  private frame: Job | undefined;
  private readonly watchers = new Set<() => void>();
  private readonly jobWatchers = new Set<(news: JobNews) => void>();
  private readonly announce = perFrame(() => {
    for (const watcher of [...this.watchers]) watcher();
  });

  watch(watcher: () => void): () => void {
    this.watchers.add(watcher);
    return () => this.watchers.delete(watcher);
  }
  /** News of the job that the stream follows. */
  watchJob(watcher: (news: JobNews) => void): () => void {
    this.jobWatchers.add(watcher);
    return () => this.jobWatchers.delete(watcher);
  }
  /** A job, or the frame that is followed. */
  job(id: string): Job | undefined {
    return this.jobs.get(id) ?? (this.frame?.id === id ? this.frame : undefined);
  }
  /** What the stream looked up before an action may come after the action's answer, which is newer. */
  putJobs(rows: Job[], full: boolean): void {
    if (full) this.jobs.clear();
    for (const row of rows) {
      const known = this.job(row.id);
      if (known && row.version < known.version) continue;
      if (sequenceOf(row.id)) this.frame = row;
      else this.jobs.set(row.id, row);
    }
    this.jobsVersion++;
    this.announce();
  }
  putWorkers(rows: Worker[], full: boolean): void {
    if (full) this.workers.clear();
    for (const row of rows) this.workers.set(row.id, row);
    this.workersVersion++;
    this.announce();
  }
  putLines(lines: LogLine[]): void {
    this.lines = [...this.lines, ...lines].slice(-kMaxLines);
    this.announce();
  }
  putJobNews(news: JobNews): void {
    if (news.row) {
      this.frame = news.row;
      this.announce();
    }
    for (const watcher of [...this.jobWatchers]) watcher(news);
  }
  begin(session: Session): void {
    // Another process counts its lines anew.
    if (this.session && this.session.instance !== session.instance) this.lines = [];
    this.session = session;
    this.announce();
  }
  connect(connection: Connection): void {
    this.connection = connection;
    this.announce();
  }
}

export const store = new Store();

/** Of a frame's job, "s3.17", the sequence "s3"; "" of any other job. */
export function sequenceOf(job: string): string {
  return job.includes(".") ? job.slice(0, job.indexOf(".")) : "";
}

/** "j12" before "j7"? Ids are a letter and a number. */
export function idNumber(id: string): number {
  return Number(id.slice(1)) || 0;
}

export function isActive(job: Job): boolean {
  return job.state === "queued" || job.state === "running" || job.state === "paused";
}
/** Neither rendering nor ended, or it says why it is not getting on. */
export function isWaiting(job: Job): boolean {
  return job.state === "queued" || job.state === "paused" || (job.state === "running" && job.tiles_leased === 0);
}
