// Messages of Haply's Inverse Service, and the place of the device in a scene.

import { Vector3 } from "three";
import { afterEach, expect, test, vi } from "vitest";
import { placeAbove } from "../../src/ui/haply_panel";
import { commandOf, deviceOf, HaplyConnection, readingOf, type ServiceState } from "../../src/worker/haply_device";

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

/** Service that answers every command at once, in the place of a WebSocket. */
class FakeSocket {
  static readonly OPEN = 1;
  static last: FakeSocket;
  readyState = FakeSocket.OPEN;
  onmessage: (event: { data: unknown }) => void = () => undefined;
  onclose: () => void = () => undefined;
  commands: string[] = [];

  constructor() {
    FakeSocket.last = this;
  }

  send(command: string): void {
    this.commands.push(command);
    setTimeout(() => this.say(state()), 0);
  }

  say(content: unknown): void {
    this.onmessage({ data: JSON.stringify(content) });
  }

  close(): void {
    this.readyState = 3;
  }
}

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("a scene that hangs leaves no force behind, and is asked anew when it answers again", () => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
  let readings = 0;
  const connection = new HaplyConnection("ws://localhost:10001", {
    connected: () => undefined,
    read: (_, number) => (readings = number),
    lost: (reason) => expect.fail(reason),
  });
  const socket = FakeSocket.last;
  const upward = () => (JSON.parse(socket.commands.at(-1) ?? "") as { inverse3: { commands: { set_cursor_force: { vector: { z: number } } } }[] }).inverse3[0]?.commands.set_cursor_force.vector.z;
  socket.say(state());
  connection.answer(1, [0, 1, 0]);
  expect(upward()).toBe(1);
  vi.advanceTimersByTime(45);
  expect([readings, upward()]).toEqual([2, 1]);
  // Longer than a silent service may take.
  vi.advanceTimersByTime(3000);
  expect([readings, upward()]).toEqual([2, 0]);
  expect(socket.commands.length).toBeGreaterThan(50);
  // The answer comes too late for its reading.
  connection.answer(2, [0, 2, 0]);
  expect(upward()).toBe(0);
  vi.advanceTimersByTime(45);
  expect([readings, upward()]).toEqual([3, 0]);
  // Nor does one for a reading that nobody waits for count.
  connection.answer(2, [0, 2, 0]);
  expect(upward()).toBe(0);
  connection.answer(3, [0, 3, 0]);
  expect(upward()).toBe(3);
  connection.close();
  expect(upward()).toBe(0);
});

test("commands are paced, a silent service is lost and tried again, and the last command has no force", () => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", FakeSocket);
  const told: string[] = [];
  const readings: unknown[] = [];
  const connection = new HaplyConnection("ws://localhost:10001", {
    connected: (device) => told.push(device),
    read: (reading, number) => {
      readings.push(reading);
      connection.answer(number, [0, 1, 0]);
    },
    lost: (reason) => told.push(reason),
  });
  const first = FakeSocket.last;
  first.say(state());
  vi.advanceTimersByTime(100);
  // Each command waits a millisecond for the one before.
  expect(first.commands.length).toBeGreaterThan(50);
  expect(first.commands.length).toBeLessThan(110);
  expect(readings).not.toContain(null);
  first.send = () => undefined;
  first.onmessage({ data: "{" });
  vi.advanceTimersByTime(5);
  expect(readings).toContain(null);
  vi.advanceTimersByTime(2500);
  const second = FakeSocket.last;
  expect(second).not.toBe(first);
  second.say({ inverse3: [] });
  expect(told).toEqual(["049D", "the Inverse Service does not answer", "the Inverse Service has no Inverse3: connect one, and look at Haply Hub"]);
  vi.advanceTimersByTime(1000);
  const third = FakeSocket.last;
  third.say(state());
  connection.close();
  expect(third.commands.at(-1)).toContain('"vector":{"x":0,"y":0,"z":0}');
  expect(third.readyState).toBe(3);
  vi.advanceTimersByTime(5000);
  expect(FakeSocket.last).toBe(third);
});
