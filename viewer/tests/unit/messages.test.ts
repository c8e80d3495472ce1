import { expect, test } from "vitest";
import { waitBefore } from "../../src/protocol/connection";
import { readMessage } from "../../src/protocol/messages";
import { fromLowest, History } from "../../src/panels/history";
import type { Picture } from "../../src/protocol/picture";

test("messages that are none are dropped", () => {
  for (const text of ["", "{", "[]", "null", "3", '{"type":"what"}', '{"type":"constructor"}', '{"type":"scene"}', '{"type":"note"}']) {
    expect(readMessage(text), text).toBeNull();
  }
  expect(readMessage('{"type":"note","text":"hello"}')).toEqual({ type: "note", text: "hello" });
});

test("waits grow, up to a bound", () => {
  expect([0, 1, 2, 3, 4, 5, 100].map(waitBefore)).toEqual([400, 800, 1600, 3200, 6400, 8000, 8000]);
});

test("a history keeps its seconds, and begins anew when time goes back", () => {
  const history = new History(10);
  const picture = (time: number) => ({ time, devices: [{ force: [3, 4, 0] }], energies: new Float32Array(10) }) as unknown as Picture;
  for (let i = 0; i < 2000; i++) history.take(picture(i / 60));
  expect(history.times.length).toBeLessThan(900);
  expect(history.times.at(-1)! - history.times[0]).toBeGreaterThanOrEqual(10);
  expect(history.forces[0].at(-1)).toBe(5);
  history.take(picture(0));
  expect(history.times).toEqual([0]);
  expect(fromLowest([3, 2, 5])).toEqual([1, 0, 3]);
});
