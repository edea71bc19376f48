// What the coordinator tells of sequences; docs/dashboard.md describes the keys.
import type { JobState } from "../types";

export interface Sequence {
  id: string;
  /** Grows with every change of a frame, in one process of the coordinator. */
  version: number;
  name: string;
  state: JobState;
  message?: string;
  priority: number;
  pool?: string;
  submitter?: string;
  max_workers?: number;
  after?: string[];
  order: string;
  fps: number;
  frame_count: number;
  /** How many frames are in each state. */
  frames: Record<JobState, number>;
  first_frame: number;
  last_frame: number;
  /** These are sums over the frames. */
  packets_done: number;
  packets_total: number;
  wall_seconds: number;
  cpu_seconds: number;
  rate: number;
  eta_seconds: number;
  workers: number;
  relmse_mean?: number;
  relmse_max?: number;
  budget_seconds?: number;
  deadline?: number;
}

export interface Frame {
  number: number;
  /** Of its job: "s3.17". */
  id: string;
  version: number;
  state: JobState;
  message?: string;
  spp: number;
  packets_done: number;
  packets_total: number;
  wall_seconds: number;
  cpu_seconds: number;
  relmse?: number;
  relmse_low?: number;
  relmse_high?: number;
}

export interface FramePage {
  /** On the first page only, as it was before its frames were read. */
  sequence?: Sequence;
  total: number;
  frames: Frame[];
  /** The number after which the next page begins; absent: there is none. */
  next?: number;
}
