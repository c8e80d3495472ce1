// Orientation of a held patch: the normal of the surface at rest, at the node nearest to the held point.

import { Vector3 } from "three";
import type { Surface } from "../protocol/surface";

/** Index of the node nearest to a point [m, body], and its distance [m]. */
export function nearestNode({ nodes, positions }: Surface, point: Vector3): { node: number; distance: number } {
  let [node, least] = [-1, Infinity];
  for (let n = 0; n < nodes; n++) {
    const square = (positions[3 * n] - point.x) ** 2 + (positions[3 * n + 1] - point.y) ** 2 + (positions[3 * n + 2] - point.z) ** 2;
    if (square < least) [node, least] = [n, square];
  }
  return { node, distance: Math.sqrt(least) };
}

/** Outward normal at a node: mean of its triangles, weighted by area; body. */
export function normalAtNode({ positions, indices }: Surface, node: number): Vector3 {
  const sum = new Vector3();
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  for (let t = 0; t < indices.length; t += 3) {
    if (indices[t] !== node && indices[t + 1] !== node && indices[t + 2] !== node) continue;
    [a, b, c].forEach((corner, k) => corner.fromArray(positions, 3 * indices[t + k]));
    sum.add(b.sub(a).cross(c.sub(a)));
  }
  return sum.lengthSq() > 0 ? sum.normalize() : sum.set(0, 1, 0);
}
