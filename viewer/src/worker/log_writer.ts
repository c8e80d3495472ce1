// Log of a run of a live scene: its steps are computed again from their inputs, in the module of logs, which writes them.

import { Sent, type Instance } from "../../../bindings/web/palpate/memory";
import { withParts } from "../../../bindings/web/palpate/parts";
import type { DownloadProgress } from "./download";
import { loadLogModule, logExports } from "./log_module";
import type { SceneFiles } from "./scene_files";

/** Record of a run by its inputs, as the module of live scenes sends it. */
export interface RecordedRun {
  /** Scene, with added pointers. */
  text: string;
  steps: number;
  /** Changes of materials, in their order: each makes a recording of another. */
  rescaled: { name: string; of: string; young: number; density: number }[];
  /** Initial states and inputs. */
  inputs: Uint8Array;
  /** Files that the scene was opened with. */
  files: SceneFiles;
  /** Time of its start [s since 1970]. */
  startS: number;
}

/** Log, and the number of its steps: fewer than those of the run where it is full. */
export interface WrittenRun {
  bytes: ArrayBuffer;
  steps: number;
}

/** Makes a log; the worker goes on meanwhile. `onProgress` gets the share of the steps that are written. */
export async function makeLog(base: string, run: RecordedRun, onLoad: DownloadProgress, onProgress: (fraction: number) => void): Promise<WrittenRun> {
  return logOf(await loadLogModule(base, onLoad), run, onProgress);
}

/** Makes a log in an instance of the module. */
export async function logOf(instance: Instance, run: RecordedRun, onProgress: (fraction: number) => void): Promise<WrittenRun> {
  const maker = begin(instance, run);
  const written = () => logExports(instance).log_maker_steps(maker);
  while (instance.call(() => logExports(instance).log_maker_advance(maker)) !== 0) {
    onProgress(written() / Math.max(1, run.steps));
    await new Promise((next) => setTimeout(next, 0));
  }
  const steps = written();
  let log: ArrayBuffer | null = null;
  instance.receiver = (kind, bytes) => {
    if (kind === Sent.Data) log = bytes.slice().buffer as ArrayBuffer;
  };
  instance.call(() => logExports(instance).log_maker_finish(maker));
  if (log === null) throw new Error("the log was not written");
  return { bytes: log, steps };
}

function begin(instance: Instance, { text, rescaled, inputs, files, startS }: RecordedRun): number {
  const recordings = new Map<string, number>();
  for (const [name, bytes] of files.recordings) {
    recordings.set(name, instance.withBytes(bytes, (at, length) => instance.call((exports) => exports.recording_read(at, length))));
  }
  for (const { name, of, young, density } of rescaled) {
    const from = recordings.get(of);
    if (from === undefined) throw new Error(`the recording ${of} is missing`);
    recordings.set(name, instance.call((exports) => exports.recording_rescaled(from, young, density)));
  }
  return withParts(instance, recordings, files.paths, (parts) =>
    instance.withBytes(text, (at, length) =>
      instance.withBytes(inputs, (address, bytes) => instance.call(() => logExports(instance).log_maker_new(at, length, parts, address, bytes, startS))),
    ),
  );
}
