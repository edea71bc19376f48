// Small pictures of jobs, drawn into canvases.
import { failure, readPicture } from "../api";
import { toned } from "../tone";

export interface SmallPicture {
  canvas: HTMLCanvasElement;
  /** The job had got on when it was sent. */
  stale: boolean;
}

function canvasOf(width: number, height: number): [HTMLCanvasElement, CanvasRenderingContext2D] {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  return [canvas, canvas.getContext("2d")!];
}

async function ask(path: string, signal: AbortSignal): Promise<Response> {
  const answer = await fetch(path, { signal });
  if (!answer.ok) throw await failure(answer);
  return answer;
}

const isStale = (answer: Response) => answer.headers.has("X-Lightmill-Stale");

/** The picture of a job as it is, at most so many pixels wide and high. */
export async function fetchReduced(job: string, side: number, signal: AbortSignal): Promise<SmallPicture> {
  const answer = await ask(`/api/v1/jobs/${encodeURIComponent(job)}/image?side=${side}`, signal);
  const picture = readPicture(await answer.arrayBuffer());
  const [canvas, g] = canvasOf(picture.width, picture.height);
  g.putImageData(toned(picture, 0, "srgb"), 0, 0);
  return { canvas, stale: isStale(answer) };
}

/** The coordinator's thumbnail of a job; undefined: there is none yet. */
export async function fetchThumbnail(job: string, signal: AbortSignal): Promise<SmallPicture | undefined> {
  const answer = await ask(`/api/v1/jobs/${encodeURIComponent(job)}/thumbnail`, signal);
  if (answer.status === 204) return undefined;
  const bitmap = await createImageBitmap(await answer.blob());
  const [canvas, g] = canvasOf(bitmap.width, bitmap.height);
  g.drawImage(bitmap, 0, 0);
  bitmap.close();
  return { canvas, stale: isStale(answer) };
}
