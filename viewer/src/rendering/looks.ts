// Look of an elastic object by its material: jelly lets light through, aluminium mirrors it.

import type { Material } from "../protocol/messages";

/** Optical properties of a surface. */
export interface Look {
  /** Colour (sRGB); null: one of the palette, so that objects differ. */
  colour: string | null;
  /** Share of light that passes through, 0 to 1. */
  translucency: number;
  /** Strength of reflections, 0 to 1. */
  gloss: number;
  /** 0: coloured diffuse light and white reflections; 1: coloured reflections. */
  metal: number;
  /** Contrast of wood grain, 0 to 1. */
  grain: number;
}

const JELLY: Look = { colour: null, translucency: 1, gloss: 1, metal: 0, grain: 0 };
/** Household sponges and foam rubber are yellow. */
const FOAM: Look = { colour: "#f3b91f", translucency: 0.25, gloss: 0.1, metal: 0, grain: 0 };
const SOFT_TISSUE: Look = { colour: "#a3483f", translucency: 0.35, gloss: 1, metal: 0, grain: 0 };
const SILICONE: Look = { colour: null, translucency: 0.55, gloss: 0.55, metal: 0, grain: 0 };
const RUBBER: Look = { colour: "#4b4f55", translucency: 0, gloss: 0.25, metal: 0, grain: 0 };
const PLASTIC: Look = { colour: null, translucency: 0, gloss: 0.8, metal: 0, grain: 0 };
const WOOD: Look = { colour: "#c08a52", translucency: 0, gloss: 0.3, metal: 0, grain: 1 };
const METAL: Look = { colour: "#c9ced4", translucency: 0, gloss: 1, metal: 1, grain: 0 };

/** Look of a material, by Young's modulus [Pa] and density [kg/m³]; jelly where it is not known. */
export function lookOf(material: Material | null): Look {
  if (material === null) return JELLY;
  const { young, poisson, density } = material;
  if (young >= 3e10) return METAL;
  if (young >= 3e9) return density < 1000 ? WOOD : PLASTIC;
  if (young >= 1e8) return PLASTIC;
  if (young >= 5e5) return RUBBER;
  if (young >= 4e4) return SILICONE;
  // Pores make a soft solid light and compressible.
  if (density < 300 && poisson < 0.35) return FOAM;
  // Gelatine is water, almost; fat is lighter, other tissue heavier.
  const isGelatine = density > 990 && density < 1030;
  return young >= 3e3 && density > 900 && !isGelatine ? SOFT_TISSUE : JELLY;
}
