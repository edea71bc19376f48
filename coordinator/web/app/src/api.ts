// Requests to the coordinator. Errors are its own sentences.
import type { Job } from "./types";

export async function failure(answer: Response): Promise<Error> {
  const text = await answer.text();
  try {
    return new Error((JSON.parse(text) as { error: string }).error);
  } catch {
    return new Error(text.trim().slice(0, 300) || `the coordinator answered ${answer.status}`);
  }
}

/** Changes a job and returns it, or the new one. */
export async function act(job: string, action: string, body: object = {}): Promise<Job> {
  const answer = await fetch(`/api/v1/jobs/${encodeURIComponent(job)}/${action}`, {
    method: "POST",
    headers: { "X-Lightmill": "1", "Content-Type": "application/json" },
    body: JSON.stringify(body),
  });
  if (!answer.ok) throw await failure(answer);
  return ((await answer.json()) as { job: Job }).job;
}

/** What lightmill submit prints of a scene, and which of its files are not there yet. */
export interface SceneCheck {
  errors: string[];
  warnings: string[];
  missing: { reference: string; name: string }[];
  files?: number;
  bytes?: number;
  width?: number;
  height?: number;
  spp?: number;
  /** 0: unlimited. */
  max_depth?: number;
}

export interface Picture {
  width: number;
  height: number;
  channels: number;
  /** Half floats' bits of an image, floats of an error map; rows from the top. */
  half?: Uint16Array;
  float?: Float32Array;
  /** The job had got on when it was sent. */
  stale?: boolean;
  /** Names what it shows, where the coordinator says that. */
  tag?: string;
  denoised?: Denoised;
  /** Of a light mix: a pixel is the mean of so many by so many of the image's. */
  mixBlock?: number;
}

/** What is known of a denoised picture. */
export interface Denoised {
  /** Estimates, of what error is left and of what was there before. */
  relmse: number;
  relmseRaw: number;
  /** Layers of the image that it went by: "difference", "albedo" and so on. */
  layers: string[];
  /** A pixel is the mean of so many by so many of the image's. */
  block: number;
}

export type PictureKind = "image" | "error-map" | "denoised" | "light-mix";

/** "LMH1" or "LMF1", width, height, channels, values: little endian, as browsers' machines are. */
export function readPicture(bytes: ArrayBuffer): Picture {
  const head = new DataView(bytes, 0, 16);
  const magic = String.fromCharCode(...new Uint8Array(bytes, 0, 4));
  const picture: Picture = {
    width: head.getUint32(4, true),
    height: head.getUint32(8, true),
    channels: head.getUint32(12, true),
  };
  const values = picture.width * picture.height * picture.channels;
  if (magic === "LMH1") picture.half = new Uint16Array(bytes, 16, values);
  else if (magic === "LMF1") picture.float = new Float32Array(bytes, 16, values);
  else throw new Error("the coordinator sent something that is no picture");
  return picture;
}

/** Undefined if there is none yet. `last`, the one that is here, is not sent again. `query`: "" or "?mix=…". */
export async function fetchPicture(job: string, kind: PictureKind, query: string, last: Picture | undefined, signal: AbortSignal): Promise<Picture | undefined> {
  const headers: Record<string, string> = last?.tag ? { "If-None-Match": last.tag } : {};
  const answer = await fetch(`/api/v1/jobs/${encodeURIComponent(job)}/${kind}${query}`, { signal, headers });
  const stale = answer.headers.has("X-Lightmill-Stale");
  if (answer.status === 204) return undefined;
  if (answer.status === 304 && last) return { ...last, stale };
  if (!answer.ok) throw await failure(answer);
  const picture = { ...readPicture(await answer.arrayBuffer()), stale, tag: answer.headers.get("ETag") ?? undefined };
  if (kind === "light-mix") return { ...picture, mixBlock: blockOf(answer.headers) };
  return kind === "denoised" ? { ...picture, denoised: readDenoised(answer.headers) } : picture;
}

function blockOf(headers: Headers): number {
  return Number(headers.get("X-Lightmill-Block")) || 1;
}

function readDenoised(headers: Headers): Denoised {
  const number = (name: string) => Number(headers.get(`X-Lightmill-${name}`) ?? NaN);
  return { relmse: number("Relmse"), relmseRaw: number("Relmse-Raw"), layers: (headers.get("X-Lightmill-Layers") ?? "").split(",").filter(Boolean), block: blockOf(headers) };
}
