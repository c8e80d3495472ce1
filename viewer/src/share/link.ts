// Link to a scene: its id, the settings that were changed, and the viewpoint, as query parameters of the page's address.
//
//   ?scene=stack&gravity=3&step_ms=2&camera=0.3,0.2,0.4,0,0.05,0
//
// `camera` is position and target [m], as `palpate render --camera` takes them.

import type { Vector } from "../protocol/frame";
import type { Viewpoint } from "../rendering/orbit_camera";
import { complaint } from "../ui/number_field";
import { differences, SETTING_FIELDS, type SettingName, type SettingValues } from "../ui/physics_settings";

/** Content of a link; null is what the page shows without it. */
export interface SceneLink {
  scene: string | null;
  values: SettingValues;
  viewpoint: Viewpoint | null;
}

/** Parameters of the settings. */
const PARAMETERS: Record<SettingName, string> = { gravity: "gravity", friction: "friction", stiffness: "stiffness", damping: "damping", step: "step_ms" };
const NAMES = Object.keys(SETTING_FIELDS) as SettingName[];

/** Significant digits of a setting, as its field shows. */
const DIGITS = 6;

/** Farthest position or target [m]. */
const FARTHEST = 1e6;

/** Longest text that a message quotes. */
export const LONGEST_QUOTE = 40;

/** Link to a scene that has these values in place of its own. */
export function linkTo(scene: string, own: SettingValues, now: SettingValues, viewpoint: Viewpoint | null): SceneLink {
  const values: SettingValues = {};
  for (const name of differences(own, now)) values[name] = Number(now[name]?.toPrecision(DIGITS));
  return { scene, values, viewpoint };
}

/** Query of a link, with its question mark. */
export function queryOf({ scene, values, viewpoint }: SceneLink): string {
  const parts: string[] = [];
  if (scene !== null) parts.push(`scene=${encodeURIComponent(scene)}`);
  for (const name of NAMES) if (values[name] !== undefined) parts.push(`${PARAMETERS[name]}=${values[name]}`);
  if (viewpoint !== null) parts.push(`camera=${cameraText(viewpoint)}`);
  return parts.length === 0 ? "" : `?${parts.join("&")}`;
}

/** Six numbers, each within 1/1000 of the distance. */
function cameraText({ from, to }: Viewpoint): string {
  const distance = Math.hypot(...from.map((x, k) => x - to[k]));
  const decimals = Math.min(12, Math.max(0, 3 - Math.floor(Math.log10(distance))));
  // Without a minus before zero.
  return [...from, ...to].map((x) => String(Number(x.toFixed(decimals)) + 0)).join();
}

/** Link in a query, and a sentence for each part that is left out. */
export function readLink(query: string): { link: SceneLink; leftOut: string[] } {
  const parameters = new URLSearchParams(query);
  const link: SceneLink = { scene: parameters.get("scene") || null, values: {}, viewpoint: null };
  const leftOut: string[] = [];
  for (const name of NAMES) {
    const text = parameters.get(PARAMETERS[name]);
    if (text === null) continue;
    const { label, unit, bounds } = SETTING_FIELDS[name];
    const found = complaint(label, unit, bounds, text.length > LONGEST_QUOTE ? "" : text);
    if (found === null) link.values[name] = Number(text);
    else leftOut.push(found);
  }
  const camera = parameters.get("camera");
  if (camera !== null) {
    link.viewpoint = readCamera(camera);
    if (link.viewpoint === null) leftOut.push("Camera: position and target as six numbers of metres.");
  }
  return { link, leftOut };
}

function readCamera(text: string): Viewpoint | null {
  const parts = text.split(",");
  const numbers = parts.map((part) => (part.trim() === "" ? Number.NaN : Number(part)));
  if (numbers.length !== 6 || !numbers.every((x) => Math.abs(x) <= FARTHEST)) return null;
  const [from, to] = [numbers.slice(0, 3), numbers.slice(3)] as unknown as [Vector, Vector];
  return from.every((x, k) => x === to[k]) ? null : { from, to };
}

/** Query without the parameters of a link. */
export function withoutLink(query: string): string {
  const parameters = new URLSearchParams(query);
  for (const name of ["scene", "camera", ...Object.values(PARAMETERS)]) parameters.delete(name);
  const rest = parameters.toString();
  return rest === "" ? "" : `?${rest}`;
}
