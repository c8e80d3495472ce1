import { expect, test } from "vitest";
import { pick } from "../../src/interaction/picking";
// @ts-expect-error: the stand-in is plain JavaScript.
import { boxSurface } from "../standin/box.mjs";

const { positions, indices } = boxSurface(0.1, 6) as { positions: Float32Array; indices: Uint32Array };

test("a ray hits the front face at the expected point", () => {
  const hit = pick(positions, indices, [0.013, 1, -0.021], [0, -1, 0])!;
  expect(hit.distance).toBeCloseTo(0.95, 6);
  const [a, b, c] = hit.weights;
  expect(a + b + c).toBeCloseTo(1, 12);
  const at = [0, 1, 2].map((k) => hit.weights.reduce((sum, w, i) => sum + w * positions[3 * indices[3 * hit.triangle + i] + k], 0));
  expect(at[0]).toBeCloseTo(0.013, 7);
  expect(at[1]).toBeCloseTo(0.05, 7);
  expect(at[2]).toBeCloseTo(-0.021, 7);
});

test("rays beside the box, away from it and from inside hit nothing", () => {
  expect(pick(positions, indices, [0.06, 1, 0], [0, -1, 0])).toBeNull();
  expect(pick(positions, indices, [0, 1, 0], [0, 1, 0])).toBeNull();
  expect(pick(positions, indices, [0, 0, 0], [0, 1, 0])).toBeNull();
});

test("random rays agree with the slab method", () => {
  let seed = 7;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647 - 0.5;
  for (let round = 0; round < 200; round++) {
    const origin = [0.4 * random(), 0.4 * random(), 0.3];
    const aim = [0.16 * random(), 0.16 * random(), 0.1 * random()];
    const raw = aim.map((x, k) => x - origin[k]);
    const size = Math.hypot(...raw);
    const direction = raw.map((x) => x / size);
    const near = Math.max(...direction.map((d, k) => Math.min((-0.05 - origin[k]) / d, (0.05 - origin[k]) / d)));
    const far = Math.min(...direction.map((d, k) => Math.max((-0.05 - origin[k]) / d, (0.05 - origin[k]) / d)));
    const hit = pick(positions, indices, origin, direction);
    if (far < near - 1e-6) expect(hit).toBeNull();
    if (far > near + 1e-6) expect(hit?.distance).toBeCloseTo(near, 5);
  }
});
