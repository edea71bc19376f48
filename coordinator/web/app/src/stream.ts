// The stream of changes: opened once for the tab, and again whenever it ends or falls silent.
import { store } from "./store";
import type { Job, LogLine, Session, Worker } from "./types";

const kSilenceMs = 7000; // the coordinator says something every two seconds
const kHiddenMs = 15000; // a tab that nobody sees gives its connection back
const kFirstDelayMs = 400;
const kMaxDelayMs = 5000;

let source: EventSource | undefined;
let follow = "";
let cursor = "";
let heard = 0;
let delay = kFirstDelayMs;
let retry = 0;
let hidden = 0;

/** Follows a job in depth, or none (""); the rows of all jobs come in any case. */
export function followJob(job: string): void {
  if (job === follow && source) return;
  follow = job;
  open();
}

export function startStream(): void {
  setInterval(() => {
    if (source && performance.now() - heard > kSilenceMs) lose("the coordinator does not answer");
  }, 1000);
  document.addEventListener("visibilitychange", () => {
    clearTimeout(hidden);
    if (document.hidden) hidden = window.setTimeout(close, kHiddenMs);
    else if (!source) open();
  });
  window.addEventListener("online", open);
  open();
}

function close(): void {
  clearTimeout(retry);
  source?.close();
  source = undefined;
}

function open(): void {
  close();
  const query = new URLSearchParams();
  if (cursor) query.set("since", cursor);
  if (follow) query.set("job", follow);
  heard = performance.now();
  const opened = new EventSource(`/api/v1/events?${query}`);
  source = opened;
  const on = <T>(name: string, take: (data: T) => void) =>
    opened.addEventListener(name, (event) => {
      if (opened !== source) return;
      const message = event as MessageEvent<string>;
      heard = performance.now();
      if (message.lastEventId) cursor = message.lastEventId;
      if (store.connection.state !== "live") store.connect({ state: "live" });
      delay = kFirstDelayMs;
      take(JSON.parse(message.data) as T);
    });
  on<Session>("hello", (session) => store.begin(session));
  on<{ full: boolean; rows: Job[] }>("jobs", (news) => store.putJobs(news.rows, news.full));
  on<{ full: boolean; rows: Worker[] }>("workers", (news) => store.putWorkers(news.rows, news.full));
  on<LogLine[]>("log", (lines) => store.putLines(lines));
  on<Parameters<typeof store.putJobNews>[0]>("job", (news) => store.putJobNews(news));
  on("beat", () => undefined);
  opened.onerror = () => {
    if (opened === source) lose("the connection was lost");
  };
}

function lose(why: string): void {
  close();
  const since = store.connection.state === "lost" ? store.connection.since : Date.now();
  store.connect({ state: "lost", since, why });
  retry = window.setTimeout(open, delay * (0.75 + Math.random() / 2));
  delay = Math.min(kMaxDelayMs, delay * 1.7);
  void explain(since);
}

/** A stream that is refused does not say why; a plain request does. */
async function explain(since: number): Promise<void> {
  try {
    const answer = await fetch("/api/v1/session", { signal: AbortSignal.timeout(3000) });
    if (store.connection.state !== "lost") return;
    if (answer.status === 401 || answer.status === 403) {
      store.connect({ state: "lost", since, why: `${(await answer.text()).trim()}. Reload the page to sign in again` });
    } else if (answer.ok) {
      store.connect({ state: "lost", since, why: "the coordinator takes no more streams, or has just come back" });
    }
  } catch {
    // It can't be reached, as was said.
  }
}
