// Messages of Haply's Inverse Service, and the place of the device in a scene.

import { Vector3 } from "three";
import { expect, test } from "vitest";
import { placeAbove } from "../../src/ui/haply_panel";
import { commandOf, deviceOf, readingOf, type ServiceState } from "../../src/worker/haply_device";

const state = (change: Partial<ServiceState> = {}): ServiceState => ({
  inverse3: [{ device_id: "049D", config: { type: "inverse3", basis: { permutation: "XYZ" } }, state: { cursor_position: { x: 0.01, y: -0.12, z: 0.15 } } }],
  wireless_verse_grip: [{ state: { buttons: { a: false, b: true, c: false } } }],
  ...change,
});

test("readings are in the device frame, with the buttons of the grip", () => {
  expect(readingOf(state(), "049D")).toEqual({ position: [0.01, 0.15, 0.12], buttons: 2 });
  expect(readingOf(state({ wireless_verse_grip: [], verse_grip: [{ state: { button: true } }] }), "049D")?.buttons).toBe(1);
  expect(readingOf(state({ wireless_verse_grip: [] }), "049D")?.buttons).toBe(0);
  expect(readingOf(state(), "other")).toBeNull();
  expect(readingOf({}, "049D")).toBeNull();
  expect(readingOf({ inverse3: [{ device_id: "049D", state: { cursor_position: { x: Number.NaN, y: 0, z: 0 } } }] }, "049D")).toBeNull();
});

test("commands are in the vendor's frame, and the first configures the session", () => {
  const parsed = (isFirst: boolean) => JSON.parse(commandOf("049D", [1, 2, 3], isFirst)) as { session?: unknown; inverse3: unknown };
  expect(parsed(false)).toEqual({ inverse3: [{ device_id: "049D", commands: { set_cursor_force: { vector: { x: 1, y: -3, z: 2 } } } }] });
  expect(parsed(true).session).toEqual({ configure: { profile: { name: "palpate:page" } } });
});

test("an inventory without a device, or with turned axes, is refused", () => {
  expect(deviceOf(state())).toBe("049D");
  expect(() => deviceOf({ inverse3: [] })).toThrow("connect one");
  expect(() => deviceOf({ inverse3: [{ device_id: "1", config: { basis: { permutation: "XZY" } } }] })).toThrow("XZY");
});

test("the device begins above the scene, with z towards the camera", () => {
  const { start, orientation, scale } = placeAbove(new Vector3(1, 2, 3), 0.2, new Vector3(0, 1, 0), new Vector3(1, 1, 0));
  expect(start).toEqual([1, 2.24, 3]);
  expect(scale).toBeCloseTo(2);
  // A quarter turn about y takes z to x.
  [Math.SQRT1_2, 0, Math.SQRT1_2, 0].forEach((number, at) => expect(orientation[at]).toBeCloseTo(number));
});
