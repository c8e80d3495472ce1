import { Vector3 } from "three";
import { expect, test } from "vitest";
import { nearestNode, normalAtNode } from "../../src/rendering/held_patch";

// Four triangles about the apex of a square pyramid of height 1.
const pyramid = {
  nodes: 5,
  positions: Float32Array.from([1, 0, 1, -1, 0, 1, -1, 0, -1, 1, 0, -1, 0, 1, 0]),
  indices: Uint32Array.from([0, 3, 4, 3, 2, 4, 2, 1, 4, 1, 0, 4]),
};

test("a held patch lies on the surface: its normal is the mean of the triangles about the nearest node", () => {
  expect(nearestNode(pyramid, new Vector3(0, 1.2, 0))).toEqual({ node: 4, distance: expect.closeTo(0.2, 6) });
  const [x, y, z] = normalAtNode(pyramid, 4).toArray();
  expect([x, z]).toEqual([0, 0]);
  expect(y).toBe(1);
  // A corner of the base belongs to two faces.
  const corner = normalAtNode(pyramid, 0);
  expect(corner.x).toBeCloseTo(corner.z, 12);
  expect(corner.x).toBeGreaterThan(0);
});
