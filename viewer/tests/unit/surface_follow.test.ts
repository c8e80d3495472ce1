import { Ray, Vector3 } from "three";
import { expect, test } from "vitest";
import { alongInPlane, alongSurface, type SurfacePoint } from "../../src/interaction/surface_follow";

const VIEW = new Vector3(0, 0, -1);
const EYE = new Vector3(0, 0, 10);

/** Ray from the eye through a point of the plane z = 0. */
const through = (x: number, y = 0) => new Ray(EYE.clone(), new Vector3(x, y, -10).normalize());

/** Point of the plane z = slope·x on a ray. */
function onSlope(ray: Ray, slope: number): SurfacePoint {
  const { direction: d } = ray;
  const distance = EYE.z / (slope * d.x - d.z);
  return { distance, normal: new Vector3(-slope, 0, 1).normalize() };
}

test("beside the surface a point moves in a plane parallel to the view", () => {
  const along = alongInPlane(through(0), through(3), 10, VIEW);
  expect(through(3).at(along, new Vector3()).toArray().map((x) => Number(x.toFixed(12)))).toEqual([3, 0, 0]);
  expect(alongSurface(through(0), through(3), 10, null, onSlope(through(3), 1), VIEW)).toBe(along);
});

test("over a slope a point keeps its distance from the surface, also where it starts above or below it", () => {
  const steps = Array.from({ length: 40 }, (_, i) => through(0.05 * i));
  for (const above of [0, 0.4, -0.4]) {
    let along = onSlope(steps[0], 0.8).distance - above;
    for (let i = 1; i < steps.length; i++) {
      along = alongSurface(steps[i - 1], steps[i], along, onSlope(steps[i - 1], 0.8), onSlope(steps[i], 0.8), VIEW);
    }
    const apart = onSlope(steps[39], 0.8).distance - along;
    // Perspective changes a height on its way; within a tenth over a fifth of the distance of the eye.
    expect(Math.abs(apart - above)).toBeLessThan(0.1 * Math.abs(above) + 1e-9);
  }
});

test("a pointer that rests keeps its place, whatever the surface does", () => {
  const ray = through(1);
  expect(alongSurface(ray, ray, 9, onSlope(ray, 0.5), onSlope(ray, 0.5), VIEW)).toBeCloseTo(9, 12);
});

test("an edge is not followed steeper than 3 to 1", () => {
  const [from, to] = [through(0), through(0.1)];
  const behind = { distance: 14, normal: new Vector3(0, 0, 1) };
  const along = alongSurface(from, to, 10, { distance: 10, normal: behind.normal }, behind, VIEW);
  const moved = to.at(along, new Vector3());
  expect(moved.z).toBeCloseTo(-0.3, 2);
});
