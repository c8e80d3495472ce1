// Pulses of the vibration from the contact force.

import { expect, test } from "vitest";
import { ImpactPulses, vibratesAtFirst } from "../../src/interaction/vibration";

const FRAME_MS = 1000 / 60;

/** Pulses of a force over time [ms], sampled by frames: their times and lengths. */
function pulsesOf(force: (ms: number) => number, duration: number): [number, number][] {
  const pulses = new ImpactPulses();
  const found: [number, number][] = [];
  for (let frame = 0; frame * FRAME_MS < duration; frame++) {
    const length = pulses.update(force(frame * FRAME_MS), frame * FRAME_MS);
    if (length > 0) found.push([frame * FRAME_MS, length]);
  }
  return found;
}

test("an impact is one pulse, longer for a stronger one", () => {
  const lengths = [0.1, 0.3, 1, 5].map((strength) => pulsesOf((ms) => (ms < 200 ? 0 : strength), 3000));
  expect(lengths.map((pulses) => pulses.length)).toEqual([1, 1, 1, 1]);
  const [weak, middle, strong, beyond] = lengths.map(([[, length]]) => length);
  expect(weak).toBeLessThan(middle);
  expect(middle).toBeLessThan(strong);
  expect([strong, beyond]).toEqual([40, 40]);
});

test("a constant force and a slow press are silent", () => {
  expect(pulsesOf(() => 0.02, 2000)).toEqual([]);
  // 0 to 0.5 in five seconds.
  expect(pulsesOf((ms) => Math.min(0.5, ms / 10000), 6000)).toEqual([]);
});

test("a slip, which lets the force fall, is felt", () => {
  const pulses = pulsesOf((ms) => (ms < 100 ? 0 : ms < 1000 ? 0.6 : 0.2), 2000);
  expect(pulses.length).toBe(2);
  expect(pulses[1][0]).toBeGreaterThanOrEqual(1000);
});

test("a force that chatters gives at most eleven pulses a second, and what is no number none", () => {
  const pulses = pulsesOf((ms) => (Math.floor(ms / FRAME_MS) % 2 === 0 ? 0 : 1), 1000);
  expect(pulses.length).toBeGreaterThan(5);
  expect(pulses.length).toBeLessThanOrEqual(11);
  expect(pulsesOf(() => Number.NaN, 500)).toEqual([]);
});

test("it is on at first on touch screens only, and off where motion is reduced", () => {
  expect(vibratesAtFirst(true, false)).toBe(true);
  expect(vibratesAtFirst(false, false)).toBe(false);
  expect(vibratesAtFirst(true, true)).toBe(false);
});
