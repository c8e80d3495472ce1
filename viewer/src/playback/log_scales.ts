// Scales of a log: the largest displacement, strain and force of frames that are spread evenly over it. They depend on the frames of the log alone,
// so that the page and `palpate render` draw the same colours and arrows, whatever part of it they show.

import { decodeFrame, type Frame } from "../protocol/frame";
import type { Progress } from "../protocol/messages";
import { largestForce } from "../rendering/force_arrows";
import type { SceneGraph } from "../rendering/scene_graph";
import type { SceneView } from "../rendering/scene_view";
import { fetchFrames } from "./log_requests";

const SAMPLES = 64;

/** Interval at which frames are asked for that are not computed yet [ms]. */
const RETRY_INTERVAL_MS = 400;
/** Silence after which the rest of a log is not waited for [ms]: it ends early. */
const SILENCE_MS = 10_000;

/** Progress of the computation of a log. */
export class LogProgress {
  private heardAt = performance.now();
  private complete = false;

  update({ done }: Pick<Progress, "done">): void {
    this.heardAt = performance.now();
    this.complete ||= done === true;
  }

  /** Waits a moment; returns false if no more frames will come. */
  async wait(): Promise<boolean> {
    await new Promise((wake) => setTimeout(wake, RETRY_INTERVAL_MS));
    return !this.complete && performance.now() - this.heardAt < SILENCE_MS;
  }
}

export interface Largest {
  displacement: number;
  strain: number;
  force: number;
}

/** At most `count` frame numbers, spread evenly, with the first and the last. */
export function sampleFrames(frames: number, count = SAMPLES): number[] {
  if (frames <= count) return Array.from({ length: Math.max(0, frames) }, (_, i) => i);
  return Array.from({ length: count }, (_, i) => Math.round((i * (frames - 1)) / (count - 1)));
}

/** Larger of two, each. */
export function larger(a: Largest, b: Largest): Largest {
  return { displacement: Math.max(a.displacement, b.displacement), strain: Math.max(a.strain, b.strain), force: Math.max(a.force, b.force) };
}

/** Largest values of a log. Its scene graph shows each sample for a moment, and its frame of before again ahead of the next picture. */
export async function largestOfLog(log: number, graph: SceneGraph, sceneView: SceneView, progress: LogProgress): Promise<Largest> {
  let largest: Largest = { displacement: 0, strain: 0, force: 0 };
  for (const number of sampleFrames(graph.info.frames ?? 0)) {
    let [bytes] = await fetchFrames(log, number, 1);
    while (bytes === undefined) {
      const more = await progress.wait();
      [bytes] = await fetchFrames(log, number, 1);
      if (!more && bytes === undefined) return largest;
    }
    const before = graph.frame;
    largest = larger(largest, measure(decodeFrame(bytes), graph, sceneView));
    if (before === null) graph.frame = null;
    else graph.setFrame(before, 0);
  }
  return largest;
}

function measure(frame: Frame, graph: SceneGraph, sceneView: SceneView): Largest {
  graph.setFrame(frame, 0);
  const [displacement, strain] = (["displacement", "strain"] as const).map((quantity) => Math.max(0, ...graph.objects.map((object) => object.maxValue(sceneView.renderer, quantity))));
  return { displacement, strain, force: largestForce(frame) };
}
