import { expect, test } from "vitest";
import { align, commonForces, curveOf, ENERGIES, largestAt, sampled } from "../../src/playback/comparison";
import type { Series } from "../../src/protocol/messages";

const series = (t: number[], names: string[], force: (time: number) => number): Series => ({
  t,
  devices: names.map((name) => ({ name, force: t.map((time) => [0, -force(time), 0]) })),
  energy: { kinetic: t.map((time) => time * time), potential: t.map((time) => 5 - time), friction: t, impact: t },
});

test("a curve is sampled by linear interpolation, and nothing outside of it", () => {
  expect(sampled({ times: [1, 2, 4], values: [10, 20, 0] }, [0.5, 1, 1.5, 2, 3, 4, 4.1])).toEqual([null, 10, 15, 20, 10, 0, null]);
});

test("logs of other start times and rates are compared from their starts, by second minus first", () => {
  const one = series([3, 3.5, 4, 4.5], ["finger"], (t) => 2 * (t - 3));
  const two = series([0, 0.25, 0.5, 0.75, 1], ["finger"], (t) => 3 * t);
  const [force] = commonForces([one, two]);
  const { times, values, difference } = align([one, two].map((log) => curveOf(log, force)));
  expect(times).toEqual([0, 0.25, 0.5, 0.75, 1, 1.5]);
  expect(values[0]).toEqual([0, 0.5, 1, 1.5, 2, 3]);
  expect(values[1]).toEqual([0, 0.75, 1.5, 2.25, 3, null]);
  expect(difference).toEqual([0, 0.25, 0.5, 0.75, 1, null]);
  expect(largestAt(difference ?? [])).toBe(4);
});

test("only devices of all logs are compared; a difference is of two", () => {
  const [a, b, c] = [["left", "right"], ["right", "pen"], ["right"]].map((names) => series([0, 1], names, (t) => t));
  expect(commonForces([a, b, c]).map(({ name }) => name)).toEqual(["right"]);
  expect(align([a, b, c].map((log) => curveOf(log, commonForces([a, b, c])[0]))).difference).toBeNull();
  expect(largestAt([null, null])).toBe(-1);
});

test("energies are those of the plots of one log: potential energy from its minimum, losses summed", () => {
  const log = series([0, 1, 2], [], () => 0);
  const of = (wanted: string) => curveOf(log, ENERGIES.find(({ name }) => name === wanted)!).values;
  expect(of("Kinetic")).toEqual([0, 1, 4]);
  expect(of("Potential")).toEqual([2, 1, 0]);
  expect(of("Dissipated")).toEqual([0, 2, 4]);
});
