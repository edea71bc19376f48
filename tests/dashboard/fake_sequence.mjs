// A sequence of made-up frames and pictures, as many as no test renders: what serveMadeUpFarm() does not have.
import { deflateSync } from "node:zlib";

const kWidth = 32;
const kHeight = 18;

/** "LMH1": grey, from dark to bright along the sequence. */
export function picture(share) {
  const bytes = Buffer.alloc(16 + 2 * 3 * kWidth * kHeight);
  bytes.write("LMH1");
  [kWidth, kHeight, 3].forEach((value, i) => bytes.writeUInt32LE(value, 4 + 4 * i));
  const half = 0x2c00 + Math.round(share * 0x1000); // from 1/16 to 1
  for (let at = 16; at < bytes.length; at += 2) bytes.writeUInt16LE(half, at);
  return bytes;
}

function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let i = 0; i < 8; i++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return (crc ^ 0xffffffff) >>> 0;
}

/** A PNG file of the same grey. */
export function thumbnail(share) {
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const ends = Buffer.alloc(8);
    ends.writeUInt32BE(data.length, 0);
    ends.writeUInt32BE(crc32(body), 4);
    return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(kWidth, 0);
  head.writeUInt32BE(kHeight, 4);
  head[8] = 8; // bits, of one grey channel
  const rows = Buffer.alloc((kWidth + 1) * kHeight, Math.round(64 + 191 * share));
  for (let y = 0; y < kHeight; y++) rows[y * (kWidth + 1)] = 0; // no filter
  return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), chunk("IHDR", head), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);
}

export class MadeUpSequence {
  version = 1;
  pictures = []; // the frames whose pictures were asked for
  looks = []; // how many frames each look was told

  constructor(count) {
    this.frames = Array.from({ length: count }, (_, i) => ({
      number: i + 1, id: `s1.${i + 1}`, version: 1, state: "done", spp: 64, packets_done: 4, packets_total: 4, wall_seconds: 5 + Math.sin(i / 90),
      cpu_seconds: 40, relmse: 0.01 * (1.5 + Math.sin(i / 40)), relmse_low: 0.005, relmse_high: 0.02,
    }));
  }
  change(number, what) {
    Object.assign(this.frames[number - 1], what, { version: ++this.version });
  }
  row() {
    const frames = { queued: 0, running: 0, paused: 0, done: 0, failed: 0, cancelled: 0 };
    for (const frame of this.frames) frames[frame.state]++;
    return {
      id: "s1", version: this.version, name: "made up", state: "running", priority: 0, order: "sequential", fps: 24, frame_count: this.frames.length, frames,
      first_frame: 1, last_frame: this.frames.length, packets_done: 4, packets_total: 4, wall_seconds: 1, cpu_seconds: 1, rate: 0, eta_seconds: -1, workers: 0,
      relmse_mean: 0.015, relmse_max: 0.025,
    };
  }
  /** Answers as coordinator/web/sequence_routes.cc does; false for other paths. */
  answer(request, response) {
    const url = new URL(request.url, "http://x");
    const json = (value) => response.writeHead(200, { "Content-Type": "application/json" }).end(JSON.stringify(value));
    const image = /^\/api\/v1\/jobs\/s1\.(\d+)\/(image|thumbnail)$/.exec(url.pathname);
    if (image) {
      const number = Number(image[1]);
      const share = number / this.frames.length;
      const small = image[2] === "thumbnail";
      this.pictures.push(number);
      response.writeHead(200, { "Content-Type": small ? "image/png" : "application/octet-stream" }).end(small ? thumbnail(share) : picture(share));
    } else if (url.pathname === "/api/v1/sequences") {
      json({ total: 1, sequences: [this.row()] });
    } else if (url.pathname === "/api/v1/sequences/s1/frames") {
      const since = Number(url.searchParams.get("since") ?? 0);
      const after = url.searchParams.get("after");
      const left = this.frames.filter((frame) => frame.version > since && (after === null || frame.number > Number(after)));
      const frames = left.slice(0, 1000);
      this.looks.push(frames.length);
      json({ ...(after === null && { sequence: this.row() }), total: this.frames.length, frames, ...(left.length > 1000 && { next: frames.at(-1).number }) });
    } else {
      return false;
    }
    return true;
  }
}
