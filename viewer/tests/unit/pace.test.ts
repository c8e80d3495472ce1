import { expect, test } from "vitest";
import { Pace, paceText } from "../../src/ui/pace";

const status = (steps: number, slowdown = 1, paused = false) => ({ generation: 1, steps, slowdown, paused });

/** Paces from a status every half a second, of `rate` steps per second. */
function measure(pace: Pace, rate: number, from: number, to: number, slowdown = 1): (number | null)[] {
  const found = [];
  for (let t = from; t <= to; t += 0.5) found.push(pace.update(status(Math.round(rate * t), slowdown), 0.001, t));
  return found;
}

test("the pace is known after three seconds", () => {
  const paces = measure(new Pace(), 800, 0, 5);
  expect(paces.slice(0, 6)).toEqual([null, null, null, null, null, null]);
  for (const pace of paces.slice(6)) expect(pace).toBeCloseTo(0.8, 9);
});

test("slow motion counts as asked for", () => {
  expect(measure(new Pace(), 100, 0, 5, 10).at(-1)).toBeCloseTo(1, 9);
});

test("a pause, another speed and a page that stalled begin it again", () => {
  const pace = new Pace();
  measure(pace, 500, 0, 4);
  expect(pace.update(status(2000, 1, true), 0.001, 4.5)).toBeNull();
  expect(measure(pace, 1000, 5, 7).every((value) => value === null)).toBe(true);
  expect(measure(pace, 1000, 7.5, 9).at(-1)).toBeCloseTo(1, 9);
  // Two seconds without a message, then those that waited, at once.
  expect([pace.update(status(9500), 0.001, 11), pace.update(status(11000), 0.001, 11.01)]).toEqual([null, null]);
});

test("only what is slower than it should be is told", () => {
  const shown = [1, 0.96, 0.8, 0.05].map((pace) => paceText(pace, 1));
  expect([...shown, paceText(null, 1), paceText(0.5, 10)]).toEqual([null, null, "0.80× real time", "0.05× real time", null, "0.50× of 1/10×"]);
});
