// Scales of a log: the largest displacement, strain and force of frames that are spread evenly over it. They depend on the log alone, so that the
// page and `palpate render` draw the same colours and arrows, whatever part of it they show.

import { decodeFrame, type Frame } from "../protocol/frame";
import { largestForce } from "../rendering/force_arrows";
import type { SceneGraph } from "../rendering/scene_graph";
import type { SceneView } from "../rendering/scene_view";
import { fetchFrames } from "./log_requests";

const SAMPLES = 64;

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

/**
 * Largest values of a log. Its scene graph shows each sample for a moment, and `shown` again before the next picture.
 * `wait` waits for frames that are not computed yet, and returns false to leave the rest out.
 */
export async function largestOfLog(log: number, graph: SceneGraph, sceneView: SceneView, wait: () => Promise<boolean>, shown: () => Frame | null): Promise<Largest> {
  let largest: Largest = { displacement: 0, strain: 0, force: 0 };
  for (const number of sampleFrames(graph.info.frames ?? 0)) {
    let [bytes] = await fetchFrames(log, number, 1);
    while (bytes === undefined) {
      if (!(await wait())) return largest;
      [bytes] = await fetchFrames(log, number, 1);
    }
    const before = shown();
    largest = larger(largest, measure(decodeFrame(bytes), graph, sceneView));
    if (before !== null) graph.setFrame(before, 0);
  }
  return largest;
}

function measure(frame: Frame, graph: SceneGraph, sceneView: SceneView): Largest {
  graph.setFrame(frame, 0);
  const [displacement, strain] = (["displacement", "strain"] as const).map((quantity) => Math.max(0, ...graph.objects.map((object) => object.maxValue(sceneView.renderer, quantity))));
  return { displacement, strain, force: largestForce(frame) };
}
