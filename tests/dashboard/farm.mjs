// A farm of real processes on loopback, for the browser to look at. Free ports, a temporary folder, everything ended
// by its process id.
import { execFile, spawn } from "node:child_process";
import { existsSync, mkdtempSync, openSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";

const run = promisify(execFile);
export const kGenerousMs = 120_000; // for what must happen; only a hang takes so long

export async function until(what, condition) {
  const end = Date.now() + kGenerousMs;
  while (Date.now() < end) {
    const value = await condition();
    if (value) return value;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`still waiting for: ${what}`);
}

export class Farm {
  constructor(bin) {
    this.bin = bin;
    this.folder = mkdtempSync(join(tmpdir(), "lightmill-dashboard-"));
    this.children = [];
    this.workers = 0;
  }
  start(program, args) {
    const log = openSync(join(this.folder, `${program}.log`), "a");
    const child = spawn(join(this.bin, program), args.map(String), { stdio: ["ignore", log, log] });
    child.ended = new Promise((resolve) => child.on("exit", resolve));
    this.children.push(child);
    return child;
  }
  /** The first time on free ports; later on the same ones, with the same data. */
  async startCoordinator() {
    const file = join(this.folder, "ports");
    rmSync(file, { force: true });
    const at = (port) => `127.0.0.1:${port ?? 0}`;
    this.coordinator = this.start("lightmill-coordinator", ["--listen", at(this.rpc), "--http", at(this.http), "--data",
      join(this.folder, "data"), "--port-file", file, "--tile-seconds", "0.2"]);
    const text = await until("the coordinator's ports", () => {
      if (this.coordinator.exitCode !== null) throw new Error(`the coordinator ended: ${this.log("lightmill-coordinator")}`);
      const ports = existsSync(file) ? readFileSync(file, "utf8") : "";
      return /rpc=\d+\s+http=\d+/.test(ports) && ports;
    });
    this.rpc = Number(/rpc=(\d+)/.exec(text)[1]);
    this.http = Number(/http=(\d+)/.exec(text)[1]);
    this.url = `http://127.0.0.1:${this.http}/`;
  }
  startWorker(threads = 1) {
    return this.start("lightmill-worker", ["--coordinator", `127.0.0.1:${this.rpc}`, "--threads", threads, "--cache-dir",
      join(this.folder, `cache${this.workers++}`)]);
  }
  async stop(child, signal = "SIGKILL") {
    if (child.exitCode === null && child.signalCode === null) {
      child.kill(signal);
      await child.ended;
    }
  }
  /** Without a coordinator. */
  async local(...args) {
    const { stdout } = await run(join(this.bin, "lightmill"), args.map(String), { timeout: kGenerousMs });
    return stdout.trim();
  }
  lightmill(...args) {
    return this.local(...args, "--coordinator", `127.0.0.1:${this.rpc}`);
  }
  submit(scene, ...options) {
    return this.lightmill("submit", scene, ...options);
  }
  async job(id) {
    return JSON.parse(await this.lightmill("job", id, "--json"));
  }
  log(program) {
    const file = join(this.folder, `${program}.log`);
    return existsSync(file) ? readFileSync(file, "utf8").slice(-2000) : "";
  }
  async close() {
    for (const child of this.children) {
      child.kill("SIGCONT");
      await this.stop(child);
    }
    rmSync(this.folder, { recursive: true, force: true });
  }
}
