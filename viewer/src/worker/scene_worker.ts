// Web Worker that runs a live scene: the force process in WebAssembly, speaking the protocol of the server.

import { type Instance, Sent, textOf, unsigned } from "../../../bindings/web/palpate/memory";
import { withParts } from "../../../bindings/web/palpate/parts";
import type { ClientMessage, SceneSummary } from "../protocol/messages";
import type { Reading, Vector } from "./haply_device";
import type { FromHaply, ToHaply } from "./haply_messages";
import { liveExports, loadLiveModule } from "./live_module";
import { makeLog, type RecordedRun } from "./log_writer";
import type { HaplyPlace, ToWorker } from "./messages";
import { post, reasonOf, tell } from "./posting";
import { fetchScene, fetchScenes, type SceneFiles } from "./scene_files";
import { Ticker } from "./ticker";

/** Frames that are under way to the page at once; newer ones take the place of older ones. */
const MAX_FRAMES_UNDER_WAY = 3;

/** Name that the scene of a dropped recording gives it. */
const DROPPED = "dropped.palp";

/** Frames to the page, no more than it can show. */
class FrameStream {
  private underWay = 0;
  private waiting: ArrayBuffer | null = null;

  send(frame: ArrayBuffer): void {
    if (this.underWay >= MAX_FRAMES_UNDER_WAY) {
      this.waiting = frame;
      return;
    }
    this.underWay += 1;
    post({ kind: "frame", frame }, [frame]);
  }

  shown(): void {
    this.underWay -= 1;
    const frame = this.waiting;
    this.waiting = null;
    if (frame !== null) this.send(frame);
  }
}

/** Live scene in the module. */
class SceneRunner {
  private live = 0;
  private opening = 0;
  private greeted = false;
  /** Files of the scene, and those of the scene that is recorded for a log, with the time of its start [s since 1970]. */
  private files: SceneFiles | null = null;
  private recorded: { files: SceneFiles; startS: number } | null = null;
  /** Worker of the Haply device. */
  private haply: Worker | null = null;
  private readonly frames = new FrameStream();
  private readonly ticker = new Ticker(() => this.advance());

  constructor(
    private readonly instance: Instance,
    private readonly base: string,
    private readonly scenes: SceneSummary[],
  ) {
    instance.receiver = (kind, bytes) => {
      if (kind === Sent.Text) post({ kind: "message", text: textOf(bytes) });
      else if (kind === Sent.Frame) this.frames.send(bytes.slice().buffer);
      else if (kind === Sent.Sound) {
        const block = bytes.slice().buffer;
        post({ kind: "sound", block }, [block]);
      }
    };
  }

  /** Opens a scene; a later request takes the place of one that is under way. */
  async open(id: string | null): Promise<void> {
    const number = ++this.opening;
    const summary = id === null ? this.scenes[0] : this.scenes.find((scene) => scene.id === id);
    if (summary === undefined) throw new Error(`there is no scene ${JSON.stringify(id)}; there are ${this.scenes.map((scene) => scene.id).join(", ")}`);
    const progress = (fraction: number | null, done = false) => tell({ type: "progress", job: "scene", phase: "loading", fraction, done });
    const onProgress = (bytes: number, of: number | null) => {
      // Before the page is greeted it has no list of jobs.
      if (this.greeted) progress(of === null ? null : bytes / of);
      else post({ kind: "loading", what: "the first recording", bytes, of });
    };
    try {
      const files = await fetchScene(this.instance, this.base, summary, onProgress);
      if (number === this.opening) this.start(files);
    } catch (error) {
      // Nobody waits any more for one that another has replaced.
      if (number === this.opening) throw error;
    } finally {
      if (number === this.opening) progress(1, true);
    }
  }

  /** Opens a scene in which the object of a recording falls on a floor. */
  openRecording(name: string, bytes: Uint8Array, about: string): void {
    const { instance } = this;
    this.opening += 1;
    try {
      if (bytes.byteLength === 0) throw new Error("the file is empty");
      const recording = instance.withBytes(bytes, (address, length) => instance.call((exports) => exports.recording_read(address, length)));
      const text = (() => {
        try {
          return instance.withBytes(DROPPED, (at, length) => instance.described<string>(() => liveExports(instance).recording_falling_scene(recording, at, length)));
        } finally {
          instance.exports.recording_free(recording);
        }
      })();
      const summary = { id: "", title: name, about };
      this.start({ summary, text, recordings: new Map([[DROPPED, bytes]]), paths: new Map() });
    } catch (error) {
      if (instance.stopped === null) tell({ type: "error", text: `${name}: ${reasonOf(error)}` });
      else this.fail(instance.stopped);
    }
  }

  /** Begins a record for a log, at a start of the scene. */
  beginLog(): void {
    const { instance, live, files } = this;
    if (live === 0 || files === null) return;
    this.recorded = { files, startS: Date.now() / 1000 };
    try {
      instance.call(() => liveExports(instance).live_begin_record(live));
    } catch (error) {
      this.recorded = null;
      tell({ type: "error", text: reasonOf(error) });
    }
  }

  /** Ends the record, and sends its log. */
  async endLog(): Promise<void> {
    const { instance, live, recorded } = this;
    const progress = (phase: string, fraction: number | null, done = false) => tell({ type: "progress", job: "log", phase, fraction, done });
    try {
      this.recorded = null;
      if (recorded === null) throw new Error("none was begun");
      const inputs: Uint8Array[] = [];
      const record = this.collecting(
        (bytes) => inputs.push(bytes),
        () => instance.described<Pick<RecordedRun, "text" | "steps" | "rescaled"> | null>(() => liveExports(instance).live_end_record(live)),
      );
      if (record === null || inputs[0] === undefined) throw new Error("none was begun");
      const run = { ...record, inputs: inputs[0], ...recorded };
      const { bytes, steps } = await makeLog(this.base, run, (loaded, of) => progress("loading the writer", of === null ? null : loaded / of), (fraction) => progress("writing", fraction));
      post({ kind: "log", steps, bytes }, [bytes]);
    } catch (error) {
      post({ kind: "no_log", reason: reasonOf(error) });
    } finally {
      progress("", 1, true);
    }
  }

  receive(text: string): void {
    if (this.live === 0) return;
    const { instance, live } = this;
    const message = JSON.parse(text) as ClientMessage;
    if (message.type === "cancel_job") {
      this.opening += 1;
      tell({ type: "progress", job: "scene", phase: "", fraction: 1, done: true });
      return;
    }
    // A page that nobody sees needs no steps: time is left out until it is shown again.
    if (message.type === "stream" && message.stride === 0) this.ticker.stop();
    else if (message.type === "stream") this.ticker.start();
    try {
      instance.withBytes(text, (address, length) => instance.call(() => liveExports(instance).live_receive(live, address, length)));
    } catch (error) {
      if (instance.stopped === null) tell({ type: "error", text: reasonOf(error) });
      else this.fail(instance.stopped);
      return;
    }
    const id = instance.takeJson();
    if (typeof id === "string") this.open(id).catch((error: unknown) => tell({ type: "error", text: reasonOf(error) }));
  }

  shown(): void {
    this.frames.shown();
  }

  /** Connects a Haply device, or none. */
  setHaply(address: string | null): void {
    const ask = (worker: Worker | null, message: ToHaply) => worker?.postMessage(message);
    ask(this.haply, { kind: "close" });
    this.haply = null;
    if (this.live !== 0) liveExports(this.instance).live_detach_device(this.live);
    if (address === null) return;
    const tellState = (state: "connected" | "lost", text: string) => post({ kind: "haply", state, text });
    const worker = new Worker(new URL("./haply_worker.ts", import.meta.url), { type: "module" });
    this.haply = worker;
    worker.onmessage = ({ data }: MessageEvent<FromHaply>) => {
      if (worker !== this.haply) return;
      switch (data.kind) {
        case "connected":
          tellState("connected", `Inverse3 ${data.device}`);
          break;
        case "reading":
          ask(worker, { kind: "force", number: data.number, force: this.exchange(data.reading) });
          break;
        case "lost":
          this.exchange(null);
          tellState("lost", data.reason);
      }
    };
    ask(worker, { kind: "connect", address });
  }

  /** Attaches the Haply device to the scene, at a place. */
  placeHaply({ start, orientation, scale }: HaplyPlace): void {
    if (this.haply === null || this.live === 0) return;
    const numbers = new Uint8Array(new Float64Array([...start, ...orientation, scale]).buffer);
    const { instance, live } = this;
    const isAttached = instance.withBytes(numbers, (place) => instance.call(() => liveExports(instance).live_attach_device(live, place)));
    if (isAttached === 0) tell({ type: "error", text: "the scene has no free device for the Inverse3" });
  }

  private exchange(reading: Reading | null): Vector {
    const { instance, live } = this;
    if (live === 0 || instance.stopped !== null) return [0, 0, 0];
    const [x, y, z] = reading?.position ?? [0, 0, 0];
    const force = unsigned(instance.guard(() => liveExports(instance).live_exchange(live, reading === null ? 0 : 1, x, y, z, reading?.buttons ?? 0)));
    const [fx = 0, fy = 0, fz = 0] = new Float64Array(instance.exports.memory.buffer, force, 3);
    return [fx, fy, fz];
  }

  answer(request: number, path: string): void {
    const { instance, live } = this;
    let bytes: ArrayBuffer | null = null;
    if (live !== 0) {
      this.collecting(
        (data) => (bytes = data.buffer),
        () => instance.withBytes(path, (address, length) => instance.call(() => liveExports(instance).live_data(live, address, length))),
      );
    }
    post({ kind: "data", request, bytes }, bytes === null ? [] : [bytes]);
  }

  /** Result of a call of the module whose data are taken. */
  private collecting<T>(take: (data: Uint8Array<ArrayBuffer>) => void, run: () => T): T {
    const { instance } = this;
    const before = instance.receiver;
    try {
      instance.receiver = (_, data) => take(new Uint8Array(data));
      return run();
    } finally {
      instance.receiver = before;
    }
  }

  private start(files: SceneFiles): void {
    const { instance } = this;
    const { exports } = instance;
    const recordings = new Map<string, number>();
    try {
      for (const [name, bytes] of files.recordings) {
        recordings.set(name, instance.withBytes(bytes, (address, length) => instance.call(() => exports.recording_read(address, length))));
      }
      withParts(instance, recordings, files.paths, (parts) =>
        instance.withBytes(files.text, (address, length) =>
          instance.withBytes(JSON.stringify(files.summary), (about, aboutLength) => {
            if (this.live !== 0) {
              instance.call(() => liveExports(instance).live_replace(this.live, address, length, parts, about, aboutLength));
              return;
            }
            this.live = instance.call(() => liveExports(instance).live_open(address, length, parts, about, aboutLength));
          }),
        ),
      );
    } finally {
      recordings.forEach((recording) => exports.recording_free(recording));
    }
    this.files = files;
    if (this.greeted) return;
    this.greeted = true;
    instance.withBytes(JSON.stringify(this.scenes), (address, length) => liveExports(instance).live_greet(this.live, address, length));
    this.ticker.start();
  }

  /** Steps that are due; a trap of the module ends the scene. */
  private advance(): number {
    try {
      return this.instance.guard(() => liveExports(this.instance).live_advance(this.live));
    } catch (error) {
      this.fail(reasonOf(error));
      return Number.POSITIVE_INFINITY;
    }
  }

  private fail(reason: string): void {
    this.ticker.stop();
    post({ kind: "failed", reason });
  }
}

let runner: SceneRunner | null = null;

async function start(base: string, scene: string | null): Promise<void> {
  try {
    const progress = (bytes: number, of: number | null) => post({ kind: "loading", what: "the simulation", bytes, of });
    const [instance, scenes] = await Promise.all([loadLiveModule(base, progress), fetchScenes(base)]);
    runner = new SceneRunner(instance, base, scenes);
    const known = scenes.some(({ id }) => id === scene);
    await runner.open(known ? scene : null);
  } catch (error) {
    post({ kind: "failed", reason: reasonOf(error) });
  }
}

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if (message.kind === "start") void start(message.base, message.scene);
  else if (message.kind === "message") runner?.receive(message.text);
  else if (message.kind === "recording") runner?.openRecording(message.name, new Uint8Array(message.bytes), message.about);
  else if (message.kind === "begin_log") runner?.beginLog();
  else if (message.kind === "end_log") void runner?.endLog();
  else if (message.kind === "shown") runner?.shown();
  else if (message.kind === "haply") runner?.setHaply(message.address);
  else if (message.kind === "haply_place") runner?.placeHaply(message.place);
  else if (message.kind === "data") runner?.answer(message.request, message.path);
};
