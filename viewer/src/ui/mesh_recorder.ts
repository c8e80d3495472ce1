// Recording of meshes: by the server, or by a worker of the page.

import type { Hello, Material } from "../protocol/messages";
import { scenesAddress } from "../protocol/local_logs";
import { serverUrl } from "../protocol/urls";
import type { FromRecorder, ToRecorder } from "../worker/record_messages";
import type { JobList } from "./job_list";
import type { Notifications } from "./notifications";

/** Choice for a mesh: metres per unit of the file, its material, and the number of modes. */
export interface MeshChoice extends Material {
  scale: number;
  modes: number;
}

/** Recorder of meshes. */
export interface MeshRecorder {
  /** Sentences on how fine a surface is filled, and where the file goes. */
  readonly about: string;
  /** Takes the greeting of the server or worker; returns whether meshes can be recorded. */
  hello(hello: Hello): boolean;
  /** Records a mesh, which then opens as a scene; returns the recording where it is made in the page. */
  record(file: File, choice: MeshChoice): Promise<ArrayBuffer | null>;
  /** Cancels a job, if it is of this recorder. */
  cancel(job: string): boolean;
  /** Function that opens a mesh of this name again, if it was recorded. */
  again(name: string): (() => void) | undefined;
}

/** Recorder of a page with a server, to which meshes are uploaded. */
export class ServerRecorder implements MeshRecorder {
  readonly about = "A surface is filled with about 2,000 nodes.";
  private upload: AbortController | null = null;
  /** Uploads that the server has taken, by file name. */
  private readonly accepted = new Map<string, () => void>();
  /** Number of this viewer: the recording is cancelled when the page leaves. */
  private viewer = 0;

  constructor(
    private readonly notifications: Notifications,
    private readonly jobs: JobList,
  ) {}

  hello({ viewer, records }: Hello): boolean {
    this.viewer = viewer;
    return records;
  }

  async record(file: File, choice: MeshChoice): Promise<ArrayBuffer | null> {
    const job = { type: "progress", job: "upload", phase: file.name, fraction: null } as const;
    const upload = new AbortController();
    this.upload = upload;
    this.jobs.update(job);
    try {
      const { scale, young, poisson, density, modes } = choice;
      const numbers = Object.entries({ scale, young, poisson, density, modes, viewer: this.viewer }).map(([name, number]) => [name, String(number)]);
      const query = new URLSearchParams([["name", file.name], ...numbers]);
      const response = await fetch(serverUrl(`record?${query}`), { method: "POST", body: file, signal: upload.signal });
      if (!response.ok) throw new Error((await response.text()) || `${response.status} ${response.statusText}`);
      this.notifications.notify(`${file.name} is being recorded`);
      this.accepted.set(file.name, () => void this.record(file, choice));
    } catch (error) {
      if (upload.signal.aborted) this.notifications.notify(`The upload of ${file.name} was cancelled`);
      else this.notifications.notify(`${file.name} was not recorded: ${error instanceof Error ? error.message : String(error)}`, "error");
    } finally {
      this.jobs.update({ ...job, done: true });
      if (this.upload === upload) this.upload = null;
    }
    return null;
  }

  cancel(job: string): boolean {
    if (job !== "upload") return false;
    this.upload?.abort();
    return true;
  }

  again(name: string): (() => void) | undefined {
    return this.accepted.get(name);
  }
}

/** Nodes that a surface is filled with in the page: 4,000 with those of quadratic elements, recorded in half a minute. */
const NODES = 600;
const JOB = "mesh";

/** Recorder of a page without a server: a worker of its own for each mesh, so that its memory is given back. */
export class PageRecorder implements MeshRecorder {
  readonly about = `A surface is filled with about ${NODES} nodes; palpate record makes finer ones. The file stays on this device.`;
  private running: { worker: Worker; end: (reason: string | null) => void } | null = null;
  private readonly recorded = new Map<string, () => void>();

  /** `open` opens a recording as a scene, under the name of its file, with what is said about it. */
  constructor(
    private readonly notifications: Notifications,
    private readonly jobs: JobList,
    private readonly open: (name: string, recording: ArrayBuffer, about: string) => void,
  ) {}

  hello(): boolean {
    return true;
  }

  async record(file: File, choice: MeshChoice): Promise<ArrayBuffer | null> {
    if (this.running !== null) {
      this.notifications.notify(`${file.name} was not recorded: another mesh is being recorded; cancel that or wait`, "error");
      return null;
    }
    const worker = new Worker(new URL("../worker/record_worker.ts", import.meta.url), { type: "module" });
    const message: ToRecorder = { base: scenesAddress(), mesh: { ...choice, name: file.name, nodes: NODES }, file };
    const done = await new Promise<{ recording: ArrayBuffer; repairs: string[] } | { reason: string | null }>((end) => {
      this.running = { worker, end: (reason) => end({ reason }) };
      worker.onmessage = ({ data }: MessageEvent<FromRecorder>) => {
        if (data.kind === "progress") this.jobs.update({ type: "progress", job: JOB, phase: data.phase, fraction: data.fraction });
        else if (data.kind === "recorded") end(data);
        else end({ reason: data.reason });
      };
      worker.onerror = (event) => end({ reason: event.message || "the worker cannot be started" });
      this.jobs.update({ type: "progress", job: JOB, phase: file.name, fraction: null });
      worker.postMessage(message);
    });
    worker.terminate();
    this.running = null;
    this.jobs.update({ type: "progress", job: JOB, phase: "", fraction: 1, done: true });
    if ("recording" in done) {
      const { recording } = done;
      const about = ["Your own mesh. Press and drag it.", ...done.repairs].join(" Note: ");
      const open = () => this.open(file.name, recording.slice(0), about);
      this.recorded.set(file.name, open);
      open();
      return recording;
    }
    if (done.reason === null) this.notifications.notify("the recording was cancelled");
    else this.notifications.notify(`${file.name} was not recorded: ${reasonAbout(file.name, done.reason)}`, "error");
    return null;
  }

  cancel(job: string): boolean {
    if (job !== JOB) return false;
    this.running?.end(null);
    return true;
  }

  again(name: string): (() => void) | undefined {
    return this.recorded.get(name);
  }
}

/** Reason without the name of the file before it, which is told already; where memory is short, the program that has more. */
function reasonAbout(name: string, reason: string): string {
  const text = reason.startsWith(`${name}: `) ? reason.slice(name.length + 2) : reason;
  return /memory/.test(text) ? `${text}. A page has 4 GB at most: palpate record ${name} -o NAME.palp takes what the computer has` : text;
}
