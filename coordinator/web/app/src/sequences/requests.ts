// Requests about sequences. Errors are the coordinator's own sentences.
import { failure } from "../api";
import type { FramePage, Sequence } from "./types";

async function json<T>(path: string, init: RequestInit): Promise<T> {
  const answer = await fetch(`/api/v1/${path}`, init);
  if (!answer.ok) throw await failure(answer);
  return (await answer.json()) as T;
}

export async function fetchSequences(signal: AbortSignal): Promise<Sequence[]> {
  const all: Sequence[] = [];
  for (;;) {
    const page = await json<{ total: number; sequences: Sequence[] }>(`sequences?begin=${all.length}`, { signal });
    all.push(...page.sequences);
    if (page.sequences.length === 0 || all.length >= page.total) return all;
  }
}

/** Frames behind number `after` that changed since a version, at most 1000. */
export function fetchFrames(sequence: string, since: number, after: number | undefined, signal: AbortSignal): Promise<FramePage> {
  const from = after === undefined ? "" : `&after=${after}`;
  return json<FramePage>(`sequences/${encodeURIComponent(sequence)}/frames?since=${since}${from}`, { signal });
}

export async function actOnSequence(sequence: string, action: string, body: object): Promise<Sequence> {
  const answer = await json<{ sequence: Sequence }>(`sequences/${encodeURIComponent(sequence)}/${action}`, {
    method: "POST",
    headers: { "X-Lightmill": "1", "Content-Type": "application/json" },
    body: JSON.stringify(body),
  });
  return answer.sequence;
}
