import { PerspectiveCamera, Vector3 } from "three";
import { expect, test } from "vitest";
import { isFarAway, isOutOfView, sphereAround, type Sphere } from "../../src/rendering/framing";
import { lostText } from "../../src/ui/lost_objects";
import { OrbitCamera } from "../../src/rendering/orbit_camera";

const sphere = (x: number, radius: number): Sphere => ({ center: new Vector3(x, 0, 0), radius });

test("the sphere around spheres contains them, and is the smallest for two", () => {
  const two = sphereAround([sphere(0, 1), sphere(10, 2)]);
  expect([two.center.x, two.radius]).toEqual([5.5, 6.5]);
  expect(sphereAround([sphere(0, 1), sphere(1, 5)])).toEqual(sphere(1, 5));
  expect(sphereAround([sphere(1, 5), sphere(0, 1)])).toEqual(sphere(1, 5));
  const many = Array.from({ length: 20 }, (_, i) => ({ center: new Vector3(Math.sin(i), Math.cos(3 * i), Math.sin(7 * i)), radius: 0.1 * i }));
  const around = sphereAround(many);
  for (const { center, radius } of many) expect(center.distanceTo(around.center) + radius).toBeLessThan(around.radius + 1e-9);
});

test("objects that are lost are named, those out of view first", () => {
  const camera = new PerspectiveCamera(40, 1, 0.1, 100);
  camera.position.set(0, 0, 10);
  camera.updateMatrixWorld();
  expect([new Vector3(), new Vector3(9, 0, 0), new Vector3(0, 0, 20)].map((point) => isOutOfView(point, camera))).toEqual([false, true, true]);
  expect([7, 9].map((x) => isFarAway(new Vector3(x, 0, 0), sphere(0, 1)))).toEqual([false, true]);
  expect(lostText({ outOfView: ["cube"], farAway: ["cube", "ball"] })).toBe("Out of view: cube");
  expect(lostText({ outOfView: [], farAway: ["cube", "ball"] })).toBe("Far away: cube, ball");
  expect(lostText({ outOfView: ["a", "b", "c"], farAway: [] })).toBe("Out of view: 3 objects");
  expect(lostText({ outOfView: [], farAway: [] })).toBe("");
});

test("every object of a framed sphere is in view, however large and far it is, in a wide and in a narrow window", () => {
  for (const aspect of [0.4, 1, 2.5]) {
    const orbit = new OrbitCamera();
    orbit.setHome([0, 0, 0], 0.1, [0, -9.81, 0], true);
    orbit.resize(aspect);
    const all = sphereAround([sphere(0, 0.1), sphere(40, 0.1)]);
    orbit.reset(all.center, all.radius);
    for (const x of [0, 40]) expect(isOutOfView(new Vector3(x, 0, 0), orbit.camera)).toBe(false);
    orbit.reset();
    expect(isOutOfView(new Vector3(40, 0, 0), orbit.camera)).toBe(true);
    orbit.follow(new Vector3(40, 0, 0), 0.1);
    expect(isOutOfView(new Vector3(40, 0, 0), orbit.camera)).toBe(false);
  }
});
