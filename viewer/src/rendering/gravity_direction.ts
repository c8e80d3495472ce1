// Direction of gravity of a scene, also of one that is without it at the moment.

import type { Vector } from "../protocol/frame";
import type { SceneMessage } from "../protocol/messages";

/** Unit vector downwards [world]: along gravity, or the gravity that the scene came with; without any into its first plane, or along −y. */
export function downOf({ gravity, own, obstacles }: Pick<SceneMessage, "gravity" | "own" | "obstacles">): Vector {
  for (const [x, y, z] of own === undefined ? [gravity] : [gravity, own.gravity]) {
    const magnitude = Math.hypot(x, y, z);
    if (magnitude > 0) return [x / magnitude, y / magnitude, z / magnitude];
  }
  const plane = obstacles.find(({ shape }) => "plane" in shape);
  if (plane === undefined) return [0, -1, 0];
  // The outward normal is the y axis of the pose.
  const [, , , x, y, z, w] = plane.pose;
  return [2 * (w * z - x * y), 2 * (x * x + z * z) - 1, -2 * (y * z + w * x)];
}
