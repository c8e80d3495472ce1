// Looks of materials that users know.

import { expect, test } from "vitest";
import { lookOf } from "../../src/rendering/looks";
import { PRESETS } from "../../src/ui/material_panel";

const look = (young: number, poisson: number, density: number) => lookOf({ young, poisson, density });

test("jelly and silicone let light through, rubber, wood and aluminium do not", () => {
  const [jelly, liver, sponge, silicone, rubber] = PRESETS.map(lookOf);
  const wood = look(1.1e10, 0.35, 600);
  const aluminium = look(7e10, 0.33, 2700);
  expect(jelly.translucency).toBe(1);
  expect(silicone.translucency).toBeGreaterThan(0.4);
  for (const { translucency } of [rubber, wood, aluminium]) expect(translucency).toBe(0);
  expect(aluminium.metal).toBe(1);
  expect(wood.grain).toBe(1);
  expect(sponge.gloss).toBeLessThan(jelly.gloss);
  const looks = [jelly, liver, sponge, silicone, rubber, wood, aluminium].map((own) => JSON.stringify(own));
  expect(new Set(looks).size).toBe(looks.length);
});

test("gelatine as stiff as a liver looks like jelly, liver and fat do not", () => {
  expect(look(4000, 0.45, 1010)).toEqual(lookOf(PRESETS[0]));
  for (const density of [950, 1060]) expect(look(4000, 0.45, density)).toEqual(lookOf(PRESETS[1]));
});

test("an unknown material looks like jelly", () => {
  expect(lookOf(null)).toEqual(lookOf(PRESETS[0]));
});
