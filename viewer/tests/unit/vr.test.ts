import { Vector3 } from "three";
import { expect, test } from "vitest";
import type { ClientMessage } from "../../src/protocol/messages";
import { SHOWN_RADIUS, sceneFromRoom } from "../../src/xr/vr_stage";
import { VrHands } from "../../src/xr/vr_hands";

test("the scene stands upright before the viewer, turned as the page looked, in one size", () => {
  const center = new Vector3(0.1, -0.2, 0.3);
  for (const up of [new Vector3(0, 1, 0), new Vector3(0, 0, 1), new Vector3(0.6, 0, -0.8)]) {
    for (const toCamera of [new Vector3(1, 2, -3).normalize(), up.clone()]) {
      const map = sceneFromRoom(center, 0.05, up, toCamera);
      const place = new Vector3(0, 1.2, -0.5);
      expect(place.clone().applyMatrix4(map).distanceTo(center)).toBeLessThan(1e-12);
      const moved = (step: Vector3) => place.clone().add(step).applyMatrix4(map).sub(center).multiplyScalar(SHOWN_RADIUS / 0.05);
      // A rotation with y upwards, whose z goes to where the camera was.
      expect(moved(new Vector3(0, 1, 0)).distanceTo(up)).toBeLessThan(1e-12);
      const [right, back] = [moved(new Vector3(1, 0, 0)), moved(new Vector3(0, 0, 1))];
      expect(back.dot(toCamera)).toBeGreaterThanOrEqual(-1e-12);
      expect(Math.abs(right.dot(toCamera))).toBeLessThan(1e-12);
      expect(right.cross(up).distanceTo(back)).toBeLessThan(1e-12);
      expect(map.determinant()).toBeCloseTo((0.05 / SHOWN_RADIUS) ** 3, 12);
    }
  }
});

test("a hand presses when it is tracked, moves, and lets go when it is lost; a new scene is pressed anew", () => {
  const sent: ClientMessage[] = [];
  const hands = new VrHands((message) => sent.push(message));
  const [a, b] = [new Vector3(1, 2, 3), new Vector3(4, 5, 6)];
  hands.move([a, null]);
  expect(sent).toEqual([]);
  hands.resume();
  hands.move([a, null]);
  hands.assign(13, 2);
  hands.assign(14, 7);
  expect(hands.devices).toEqual([2]);
  hands.move([b, a]);
  hands.assign(14, 0);
  expect(hands.devices).toEqual([2, 0]);
  hands.move([null, b]);
  expect(hands.devices).toEqual([0]);
  hands.suspend();
  expect(hands.devices).toEqual([]);
  hands.move([a, b]);
  hands.resume();
  hands.move([null, b]);
  hands.end();
  hands.end();
  expect(sent).toEqual([
    { type: "press", pointer: 13, mode: "touch", position: [1, 2, 3] },
    { type: "press", pointer: 14, mode: "touch", position: [1, 2, 3] },
    { type: "move", pointers: [{ pointer: 13, position: [4, 5, 6] }] },
    { type: "release", pointer: 13 },
    { type: "move", pointers: [{ pointer: 14, position: [4, 5, 6] }] },
    { type: "press", pointer: 14, mode: "touch", position: [4, 5, 6] },
    { type: "release", pointer: 14 },
  ]);
});
