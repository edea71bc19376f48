// Brings a scene to the coordinator: the scene file first, then what it is found to refer to, until nothing is missing.
import type { SceneCheck } from "./api";
import { folderOf, type LocalFile, pathFrom } from "./local_files";
import { insist, sendFile, type Sent } from "./upload";
import type { Job } from "./types";

const kAtOnce = 4;
const kMostBodyBytes = 1 << 20;
const kMostRounds = 50; // of includes in includes

/** "N files, M of K bytes", as it goes. */
export type Told = (text: string, done: number, total: number) => void;

export class SceneSender {
  private readonly sent = new Map<string, Sent>();
  private readonly byPath: Map<string, LocalFile>;
  private readonly folder: string;
  constructor(
    files: LocalFile[],
    private readonly main: LocalFile,
    private readonly told: Told,
    private readonly signal: AbortSignal,
  ) {
    this.byPath = new Map(files.map((file) => [file.path, file]));
    this.folder = folderOf(main.path);
  }

  /** Sends what is needed and returns what the coordinator makes of it; `options` as the form has them. */
  async check(options: object, environment?: LocalFile): Promise<SceneCheck> {
    const mainName = this.main.path.slice(this.folder.length);
    await this.send([[mainName, this.main]]);
    if (environment) await this.send([[this.environmentName(environment), environment]]);
    for (let round = 0; ; round++) {
      this.told("The coordinator reads the scene…", 0, 0);
      const found = (await (await this.post("check", options, environment)).json()) as SceneCheck;
      const wanted: [string, LocalFile][] = [];
      for (const { reference, name } of found.missing) {
        const path = pathFrom(this.folder, reference);
        const file = path === undefined ? undefined : this.byPath.get(path);
        if (file && !this.sent.has(name)) wanted.push([name, file]);
      }
      if (wanted.length === 0 || round === kMostRounds) return found;
      await this.send(wanted);
    }
  }
  async submit(options: object, environment?: LocalFile): Promise<Job> {
    return ((await (await this.post("submit", options, environment)).json()) as { job: Job }).job;
  }

  private environmentName(file: LocalFile): string {
    return file.path.startsWith(this.folder) ? file.path.slice(this.folder.length) : `environment/${file.file.name}`;
  }
  private post(what: "check" | "submit", options: object, environment?: LocalFile): Promise<Response> {
    const body = JSON.stringify({
      ...options,
      main: this.main.path.slice(this.folder.length),
      files: [...this.sent.values()],
      ...(environment && { environment: this.environmentName(environment) }),
    });
    if (body.length > kMostBodyBytes) throw new Error(`the scene has ${this.sent.size} files, too many for a browser to name; submit it by lightmill submit`);
    return insist(
      () => fetch(`/api/v1/scene/${what}`, { method: "POST", headers: { "X-Lightmill": "1", "Content-Type": "application/json" }, body, signal: this.signal }),
      this.signal,
      what === "submit",
    );
  }
  private async send(files: [string, LocalFile][]): Promise<void> {
    const waiting = files.filter(([name]) => !this.sent.has(name));
    const total = waiting.reduce((bytes, [, file]) => bytes + file.file.size, 0);
    let bytes = 0;
    let count = 0;
    const tell = () => this.told(`Sending: ${count} of ${waiting.length} files`, bytes, total);
    tell();
    const left = [...waiting];
    const one = async () => {
      for (let next = left.shift(); next; next = left.shift()) {
        const [name, file] = next;
        try {
          const sent = await sendFile(file.file, (more) => { bytes += more; tell(); }, this.signal);
          this.sent.set(name, { name, ...sent });
        } catch (error) {
          if (this.signal.aborted) throw error;
          throw new Error(`${file.path}: ${error instanceof Error ? error.message : String(error)}`);
        }
        count++;
        tell();
      }
    };
    await Promise.all(Array.from({ length: Math.min(kAtOnce, waiting.length) }, one));
  }
}
