// Colour scales: one for each quantity of a scene and its materials. It stays when the scene is reset, or left and opened again; logs that are
// compared share one, and `palpate render` uses the same.

import type { SceneMessage } from "../protocol/messages";
import { GrowingRange } from "./auto_range";
import type { ColourMode } from "./colours";

export type ColouredQuantity = Exclude<ColourMode, "plain">;

/** Ends of scales before anything moves: a share of the largest object's radius, and a strain. */
const LEAST_DISPLACEMENT = 2e-3;
const LEAST_STRAIN = 5e-3;

/** Scales of a scene. */
export type SceneScales = Record<ColouredQuantity, GrowingRange>;

/** Scales of a scene that was not seen before. */
export function newScales(scene: Pick<SceneMessage, "objects">): SceneScales {
  const radius = Math.max(1e-3, ...scene.objects.map((object) => object.radius));
  return { displacement: new GrowingRange(LEAST_DISPLACEMENT * radius), strain: new GrowingRange(LEAST_STRAIN) };
}

/** Scales of all scenes that the page has shown. */
export class ColourScales {
  private readonly known = new Map<string, SceneScales>();

  of(scene: Pick<SceneMessage, "id" | "title" | "objects">): SceneScales {
    const key = JSON.stringify([scene.id, scene.title, scene.objects.map(({ name, radius, material }) => [name, radius, material])]);
    let scales = this.known.get(key);
    if (scales === undefined) {
      scales = newScales(scene);
      this.known.set(key, scales);
    }
    return scales;
  }
}
