// A coordinator that serves the built dashboard and a stream of made-up rows: as many as no test renders.
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";

const kStates = ["running", "queued", "paused", "done", "failed", "cancelled"];

export function madeUpJob(i) {
  const state = i % 50 === 0 ? "running" : kStates[1 + (i % 5)];
  return {
    id: `j${i}`, version: 1, name: `shot_${String(i % 97).padStart(3, "0")}_v${i % 13}`, state, priority: i % 7, packets_done: i % 100,
    packets_total: 100, spp: i % 512, spp_total: 512, wall_seconds: i, cpu_seconds: 8 * i, rate: state === "running" ? 1e6 : 0,
    eta_seconds: state === "running" ? i : -1, workers: state === "running" ? 20 : 0, tiles_leased: state === "running" ? 20 : 0,
    leases_reassigned: 0, relmse: 1 / (i + 1), width: 1920, height: 1080, sampling: "pt", nonfinite: 0,
  };
}

export function madeUpWorker(i) {
  return {
    id: `w${i}`, host: `node${String(i).padStart(4, "0")}`, threads: 64, pool: i % 3 ? "cpu" : "night", class: "0123456789ab",
    build: "x", state: i % 40 === 0 ? "lost" : "rendering", tiles: i, rate: 1e6 + i, refused: 0,
    silent_seconds: i % 40 === 0 ? 90 : 0, held: [[`j${50 * (i % 20)}`, i, 1]],
  };
}

/** Serves until close(); `send(event, data)` goes to every stream. `other` may answer what is not here: it returns whether it did. */
export async function serveMadeUpFarm(dist, jobs, workers, other = () => false) {
  const streams = new Set();
  const write = (response, event, data) => response.write(`event: ${event}\ndata: ${JSON.stringify(data)}\n\n`);
  const server = createServer((request, response) => {
    const path = new URL(request.url, "http://x").pathname;
    if (path === "/api/v1/events") {
      response.writeHead(200, { "Content-Type": "text/event-stream" });
      write(response, "hello", { instance: "made-up", user: "", may_act: true, roles: false });
      for (let begin = 0; begin < jobs; begin += 1000) {
        write(response, "jobs", { full: begin === 0, rows: Array.from({ length: Math.min(1000, jobs - begin) }, (_, i) => madeUpJob(begin + i + 1)) });
      }
      write(response, "workers", { full: true, rows: Array.from({ length: workers }, (_, i) => madeUpWorker(i + 1)) });
      streams.add(response);
      request.on("close", () => streams.delete(response));
      return;
    }
    if (other(request, response)) return;
    const file = path === "/" ? "index.html" : path.slice(1);
    try {
      const types = { html: "text/html", js: "text/javascript", css: "text/css", svg: "image/svg+xml" };
      const bytes = readFileSync(join(dist, file));
      response.writeHead(200, { "Content-Type": types[file.split(".").pop()] ?? "text/plain" });
      response.end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const beat = setInterval(() => streams.forEach((stream) => write(stream, "beat", {})), 1000);
  return {
    url: `http://127.0.0.1:${server.address().port}/`,
    send: (event, data) => streams.forEach((stream) => write(stream, event, data)),
    close: () => {
      clearInterval(beat);
      streams.forEach((stream) => stream.destroy());
      server.close();
    },
  };
}
