import { expect, test } from "vitest";
import type { ContactFrame, Frame, Vector } from "../../src/protocol/frame";
import { LIGHT } from "../../src/rendering/colours";
import { drawForces, resultants } from "../../src/rendering/force_arrows";

const contact = (object: number, collider: ContactFrame["collider"], colliderIndex: number, point: Vector, force: Vector): ContactFrame => ({
  object,
  collider,
  colliderIndex,
  point,
  force,
  slip: 0,
});

const frame = (contacts: ContactFrame[]): Frame => ({
  format: "modal",
  generation: 1,
  step: 1,
  time: 0.001,
  energies: new Float32Array(10),
  objects: [],
  obstacles: [],
  devices: [],
  contacts,
  contactsUnsolved: false,
  contactsDropped: false,
});

// A cube of 0.552 N on a block: its nodes carry 0.22 N on the block's faces, nodes of the block 0.332 N on its own.
const stack = frame([
  contact(1, "object", 0, [0, 1, 0], [0, 0.2, 0.01]),
  contact(1, "object", 0, [1, 1, 0], [0, 0.02, -0.01]),
  contact(0, "object", 1, [0, 1, 1], [0, -0.332, 0]),
  contact(0, "obstacle", 0, [0, 0, 0], [0, 2, 0]),
]);

test("contacts of a pair in both directions have one resultant, on the object with the higher number", () => {
  const sums = resultants(stack);
  expect(sums.map(({ object, collider, index, count }) => [object, collider, index, count])).toEqual([
    [1, "object", 0, 3],
    [0, "obstacle", 0, 1],
  ]);
  const [x, y, z] = sums[0].force.toArray();
  expect([x, z]).toEqual([0, 0]);
  expect(y).toBeCloseTo(0.552, 12);
  // Centre of pressure: means with the sizes of the forces as weights.
  const weights = [Math.hypot(0.2, 0.01), Math.hypot(0.02, 0.01), 0.332];
  const total = weights[0] + weights[1] + weights[2];
  expect(sums[0].point.x).toBeCloseTo(weights[1] / total, 12);
  expect(sums[0].point.z).toBeCloseTo(weights[2] / total, 12);
});

test("a pair has one label, and the strongest contacts have arrows of their own", () => {
  const { labels, arrows, dots } = drawForces(stack, [], true, 1, 0.1, LIGHT);
  expect(labels.map(({ text }) => text.replaceAll("\u202f", " "))).toEqual(["0.55 N", "2.00 N"]);
  expect(arrows.length).toBe(2 + 4);
  expect(dots.length).toBe(4);
  const many = frame(Array.from({ length: 300 }, (_, i) => contact(0, "obstacle", 0, [i, 0, 0], [0, 1 + i, 0])));
  const drawn = drawForces(many, [], true, 300, 0.1, LIGHT);
  expect(drawn.arrows.length).toBe(1 + 64);
  // The resultant has all of them, the arrows of single contacts the last 64.
  expect(resultants(many)[0].force.y).toBe((300 * 301) / 2);
  expect(Math.min(...drawn.arrows.slice(1).map(({ from }) => from.x))).toBe(300 - 64);
});

test("without contact points a pair is one arrow", () => {
  const { arrows, dots, labels } = drawForces(stack, [], false, 1, 0.1, LIGHT);
  expect([arrows.length, dots.length, labels.length]).toEqual([2, 0, 2]);
});
