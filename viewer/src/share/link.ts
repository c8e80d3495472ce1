// Link to a scene: its id, the settings and materials that were changed, and the viewpoint, as query parameters of the page's address.
//
//   ?scene=stack&gravity=3&step_ms=2&material=cube,5000,0.45,1060&camera=0.3,0.2,0.4,0,0.05,0
//
// `material` is an object with Young's modulus [Pa], Poisson's ratio and density [kg/m³], once for each object.
// `camera` is position and target [m], as `palpate render --camera` takes them.

import type { Vector } from "../protocol/frame";
import type { Material, SceneMessage } from "../protocol/messages";
import type { Viewpoint } from "../rendering/orbit_camera";
import { MATERIAL_BOUNDS } from "../ui/material_panel";
import { complaint } from "../ui/number_field";
import { close, differences, ownOf, physicsOf, SETTING_FIELDS, valuesOf, type SettingName, type SettingValues } from "../ui/physics_settings";

/** Material of an object, by name. */
export interface LinkedMaterial extends Material {
  object: string;
}

/** Content of a link; null is what the page shows without it. */
export interface SceneLink {
  scene: string | null;
  values: SettingValues;
  materials: LinkedMaterial[];
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

/** Link to a scene with what differs from its own settings and materials. */
export function linkTo(scene: SceneMessage, viewpoint: Viewpoint | null): SceneLink {
  const own = ownOf(scene);
  const now = valuesOf(physicsOf(scene));
  const rounded = (value: number) => Number(value.toPrecision(DIGITS));
  const values: SettingValues = {};
  for (const name of differences(valuesOf(physicsOf(own)), now)) values[name] = rounded(now[name] ?? 0);
  const materials = scene.objects.flatMap(({ name, material }, i): LinkedMaterial[] => {
    const before = own.materials[i] ?? null;
    if (material === null || before === null || sameMaterial(material, before)) return [];
    return [{ object: name, young: rounded(material.young), poisson: rounded(material.poisson), density: rounded(material.density) }];
  });
  return { scene: scene.id, values, materials, viewpoint };
}

/** Whether materials agree but for their rounding. */
export function sameMaterial(a: Material, b: Material): boolean {
  return close([a.young, a.poisson, a.density], [b.young, b.poisson, b.density]);
}

/** Query of a link, with its question mark. */
export function queryOf({ scene, values, materials, viewpoint }: SceneLink): string {
  const parts: string[] = [];
  if (scene !== null) parts.push(`scene=${encodeURIComponent(scene)}`);
  for (const name of NAMES) if (values[name] !== undefined) parts.push(`${PARAMETERS[name]}=${values[name]}`);
  for (const { object, young, poisson, density } of materials) parts.push(`material=${encodeURIComponent(object)},${young},${poisson},${density}`);
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
  const link: SceneLink = { scene: parameters.get("scene") || null, values: {}, materials: [], viewpoint: null };
  const leftOut: string[] = [];
  for (const name of NAMES) {
    const text = parameters.get(PARAMETERS[name]);
    if (text === null) continue;
    const { label, unit, bounds } = SETTING_FIELDS[name];
    const found = complaint(label, unit, bounds, text.length > LONGEST_QUOTE ? "" : text);
    if (found === null) link.values[name] = Number(text);
    else leftOut.push(found);
  }
  for (const text of parameters.getAll("material")) {
    const material = readMaterial(text);
    if (material === null) leftOut.push("Material: object, Young's modulus in Pa, Poisson's ratio from 0 to 0.499 and density in kg/m³.");
    else link.materials.push(material);
  }
  const camera = parameters.get("camera");
  if (camera !== null) {
    link.viewpoint = readCamera(camera);
    if (link.viewpoint === null) leftOut.push("Camera: position and target as six numbers of metres.");
  }
  return { link, leftOut };
}

function readMaterial(text: string): LinkedMaterial | null {
  const parts = text.split(",");
  const [young, poisson, density] = parts.slice(-3).map((part) => (part.trim() === "" ? Number.NaN : Number(part)));
  const object = parts.slice(0, -3).join();
  const inRange = (value: number, { min, max }: { min: number; max: number }) => value >= min && value <= max;
  const valid = inRange(young / 1000, MATERIAL_BOUNDS.young) && inRange(poisson, MATERIAL_BOUNDS.poisson) && inRange(density, MATERIAL_BOUNDS.density);
  return object !== "" && valid ? { object, young, poisson, density } : null;
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
  for (const name of ["scene", "material", "camera", ...Object.values(PARAMETERS)]) parameters.delete(name);
  const rest = parameters.toString();
  return rest === "" ? "" : `?${rest}`;
}
