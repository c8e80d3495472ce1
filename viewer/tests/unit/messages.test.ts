import { expect, test } from "vitest";
import { retryDelay } from "../../src/protocol/connection";
import { parseMessage } from "../../src/protocol/messages";
import { relativeToMinimum, TimeSeries } from "../../src/ui/time_series";
import type { Frame } from "../../src/protocol/frame";

test("malformed messages are dropped", () => {
  for (const text of ["", "{", "[]", "null", "3", '{"type":"what"}', '{"type":"constructor"}', '{"type":"scene"}', '{"type":"info"}']) {
    expect(parseMessage(text), text).toBeNull();
  }
  expect(parseMessage('{"type":"info","text":"hello"}')).toEqual({ type: "info", text: "hello" });
});

test("retry delays grow up to a bound", () => {
  expect([0, 1, 2, 3, 4, 5, 100].map(retryDelay)).toEqual([400, 800, 1600, 3200, 6400, 8000, 8000]);
});

test("a time series keeps its window, and restarts when time goes back", () => {
  const series = new TimeSeries(10);
  const frame = (time: number) => ({ time, devices: [{ force: [3, 4, 0] }], energies: new Float32Array(10) }) as unknown as Frame;
  for (let i = 0; i < 2000; i++) series.update(frame(i / 60));
  expect(series.times.length).toBeLessThan(900);
  expect(series.times.at(-1)! - series.times[0]).toBeGreaterThanOrEqual(10);
  expect(series.forces[0].at(-1)).toBe(5);
  series.update(frame(0));
  expect(series.times).toEqual([0]);
  expect(relativeToMinimum([3, 2, 5])).toEqual([1, 0, 3]);
});
