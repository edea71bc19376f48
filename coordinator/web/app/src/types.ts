// What the coordinator tells; docs/dashboard.md describes the keys.

export type JobState = "queued" | "running" | "paused" | "done" | "failed" | "cancelled";

export interface Job {
  id: string;
  /** Grows with every change of the job, in one process of the coordinator. */
  version: number;
  name: string;
  state: JobState;
  message?: string;
  /** Why no worker has a tile of it, as the message says too. */
  waiting?: string;
  /** The job that it waits for. */
  waits_behind?: string;
  /** Until its turn comes, about. */
  turn_seconds?: number;
  priority: number;
  pool?: string;
  submitter?: string;
  max_workers?: number;
  after?: string[];
  packets_done: number;
  packets_total: number;
  spp: number;
  spp_total?: number;
  time_limit?: number;
  target_error?: number;
  /** It is that of the denoised image. */
  target_denoised?: boolean;
  wall_seconds: number;
  cpu_seconds: number;
  rate: number;
  eta_seconds: number;
  workers: number;
  tiles_leased: number;
  leases_reassigned: number;
  relmse?: number;
  relmse_low?: number;
  relmse_high?: number;
  /** Of the image denoised, as it was some samples ago. */
  denoised_relmse?: number;
  denoised_relmse_low?: number;
  denoised_relmse_high?: number;
  /** Of means over boxes of 4x4, 16x16 and 32x32 pixels; their intervals are told, too. */
  relmse_4?: number;
  relmse_16?: number;
  relmse_32?: number;
  width: number;
  height: number;
  sampling: string;
  nonfinite: number;
  /** What was dropped, by kind; absent if nothing was. */
  dropped?: Record<string, { count: number; share?: number }>;
  /** What there is to say of it; a warning above a thousandth of the image. */
  dropped_lines?: { text: string; warning: boolean }[];
}

export interface Worker {
  id: string;
  host: string;
  threads: number;
  pool: string;
  class: string;
  build: string;
  state: "idle" | "rendering" | "draining" | "lost" | "refused" | "benched";
  tiles: number;
  rate: number;
  refused: number;
  silent_seconds: number;
  held: [job: string, tile: number, attempt: number][];
}

export interface LogLine {
  number: number;
  time: number;
  text: string;
}

export interface Session {
  instance: string;
  user: string;
  may_act: boolean;
  roles: boolean;
}

export interface CurvePoint {
  wall_seconds: number;
  cpu_seconds: number;
  spp: number;
  batches: number;
  relmse?: number;
  relmse_low?: number;
  relmse_high?: number;
  denoised_relmse?: number;
  denoised_relmse_low?: number;
  denoised_relmse_high?: number;
  true_relmse?: number;
  true_flip?: number;
  relmse_4?: number;
  relmse_16?: number;
  relmse_32?: number;
  true_relmse_4?: number;
  true_relmse_16?: number;
  true_relmse_32?: number;
}

export interface Tile {
  id: number;
  state: "pending" | "leased" | "committed";
  attempt: number;
  worker?: string;
  /** When it was told. */
  leased_seconds?: number;
  pilot?: boolean;
  cells?: [x0: number, y0: number, x1: number, y1: number];
  samples?: [begin: number, end: number];
}

export interface Plan {
  strategies: string;
  light_paths: number;
  connections: number;
  guided_emission?: boolean;
  light_tracing_weight?: number;
  sample_allocation?: string;
}

export interface JobDetail {
  settings: Record<string, unknown>;
  scene: string;
  crop: [x0: number, y0: number, x1: number, y1: number];
  cell_pixels: number;
  /** What light the image will lack, a line each; absent if none is known to be. */
  missing_light?: string[];
  pilot?: {
    chosen: Plan;
    samples: number;
    adaptive_gain: number;
    /** Of guided emission; absent where that was clear. */
    emission_guide_gain?: number;
    /** Absent in reports of older farms. */
    features?: { feature: string; needed: boolean; reason: string; saving: string }[];
    estimates: { plan: Plan; relative_variance: number; cost: number }[];
  };
}

export interface JobNews {
  id: string;
  full: boolean;
  missing?: boolean;
  /** Of a frame of a sequence, which is none of the jobs' rows. */
  row?: Job;
  detail?: JobDetail;
  points?: CurvePoint[];
  points_from?: number;
  tiles?: Tile[];
  first_tile?: number;
  complete_samples?: number;
}
