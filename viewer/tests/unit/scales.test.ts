import { expect, test } from "vitest";
import { larger, sampleFrames } from "../../src/playback/log_scales";
import { AutoRange, GrowingRange } from "../../src/rendering/auto_range";
import { ColourScales } from "../../src/rendering/colour_scales";
import type { SceneObject } from "../../src/protocol/messages";

test("a growing range grows in steps of 1, 2 and 5 and never shrinks", () => {
  const range = new GrowingRange(0.01);
  const seen = [0.004, 0.013, 0.019, 0.3, 0.02, 0].map((value) => [range.update(value), range.value]);
  expect(seen).toEqual([[false, 0.01], [true, 0.02], [false, 0.02], [true, 0.5], [false, 0.5], [false, 0.5]]);
});

test("a locked range stays, and is fitted anew when it is unlocked", () => {
  const range = new GrowingRange(0.01);
  range.update(0.4);
  range.locked = true;
  expect([range.update(7), range.value]).toEqual([false, 0.5]);
  range.locked = false;
  expect(range.value).toBe(0.01);
  range.update(0.03);
  expect(range.value).toBe(0.05);
});

test("a range with hysteresis shrinks after a while", () => {
  const range = new AutoRange(0.01);
  range.update(0.4, 0);
  expect([range.update(0.01, 1), range.value]).toEqual([false, 0.5]);
  expect([range.update(0.01, 9), range.value]).toEqual([true, 0.01]);
});

const object = (young: number) => ({ name: "cube", radius: 0.1, material: { young, poisson: 0.4, density: 100 } }) as SceneObject;

test("a scene finds its scales again, another material has its own", () => {
  const scales = new ColourScales();
  const scene = (young: number) => ({ id: "bounce", title: "Cube", objects: [object(young)] });
  const soft = scales.of(scene(2000));
  expect([soft.displacement.value, soft.strain.value]).toEqual([2e-4, 5e-3]);
  soft.displacement.update(0.003);
  expect(scales.of(scene(2000)).displacement.value).toBe(5e-3);
  expect(scales.of(scene(9000)).displacement.value).toBe(2e-4);
  expect(scales.of({ ...scene(2000), title: "Other", id: "other" }).displacement.value).toBe(2e-4);
});

test("a fixed range is locked, and not below its least end", () => {
  const range = new GrowingRange(0.01);
  range.fix(0.3);
  expect([range.value, range.locked, range.update(7)]).toEqual([0.5, true, false]);
  range.fix(0);
  expect(range.value).toBe(0.01);
});

test("samples of a log are spread evenly, with its ends", () => {
  expect(sampleFrames(4)).toEqual([0, 1, 2, 3]);
  expect(sampleFrames(0)).toEqual([]);
  const some = sampleFrames(1000, 5);
  expect(some).toEqual([0, 250, 500, 749, 999]);
  expect(larger({ displacement: 1, strain: 5, force: 0 }, { displacement: 2, strain: 4, force: 3 })).toEqual({ displacement: 2, strain: 5, force: 3 });
});
