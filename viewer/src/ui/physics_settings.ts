// Physics settings of a scene, their fields, and the way back to those that it came with.

import type { ClientMessage, Coupling, OwnSettings, SceneMessage } from "../protocol/messages";
import type { Vector } from "../protocol/frame";
import { downOf } from "../rendering/gravity_direction";
import type { Bounds } from "./number_field";

type SetPhysics = Extract<ClientMessage, { type: "set_physics" }>;

/** Name, unit and range of a setting, as a field shows it. */
export interface SettingField {
  label: string;
  unit: string;
  bounds: Bounds;
}

/** Fields of the settings: magnitude of gravity, friction coefficient, virtual coupling, time step. */
export const SETTING_FIELDS = {
  gravity: { label: "Gravity", unit: "m/s²", bounds: { min: 0, max: 100, step: "any" } },
  friction: { label: "Friction", unit: "", bounds: { min: 0, max: 5, step: "any" } },
  stiffness: { label: "Coupling stiffness", unit: "N/m", bounds: { min: 0.1, max: 1e5, step: "any" } },
  damping: { label: "Coupling damping", unit: "N·s/m", bounds: { min: 0, max: 1e4, step: "any" } },
  // The server's range.
  step: { label: "Time step", unit: "ms", bounds: { min: 0.2, max: 10, step: "any" } },
} as const satisfies Record<string, SettingField>;

export type SettingName = keyof typeof SETTING_FIELDS;

/** Values of the fields, in their units. */
export type SettingValues = Partial<Record<SettingName, number>>;

/** Settings that the page shows and changes. */
export interface PhysicsSettings {
  gravity: Vector;
  step: number;
  friction: number | null;
  coupling: Coupling | null;
}

/** Settings as the server describes them: friction and coupling of the first pointer. */
export function physicsOf(scene: Omit<OwnSettings, "materials">): PhysicsSettings {
  const pointer = scene.devices.find((device) => device.pointer) ?? scene.devices[0];
  const friction = pointer?.friction ?? scene.obstacles[0]?.friction ?? null;
  return { gravity: scene.gravity, step: scene.step_s, friction, coupling: pointer?.coupling ?? null };
}

/** Settings of a scene as it was opened. */
export function ownOf(scene: SceneMessage): OwnSettings {
  return scene.own ?? { ...scene, materials: scene.objects.map(({ material }) => material) };
}

/** Values of the fields that a scene has. */
export function valuesOf({ gravity, step, friction, coupling }: PhysicsSettings): SettingValues {
  return { gravity: Math.hypot(...gravity), step: 1000 * step, ...(friction === null ? {} : { friction }), ...coupling };
}

/** Names of the values that differ. */
export function differences(from: SettingValues, to: SettingValues): SettingName[] {
  return (Object.keys(SETTING_FIELDS) as SettingName[]).filter((name) => {
    const [a, b] = [from[name], to[name]];
    return a !== undefined && b !== undefined && !close([a], [b]);
  });
}

/** Message that gives a scene the settings that differ from its present ones, but for those that it does not have; null if none does. */
function change(wanted: PhysicsSettings, now: PhysicsSettings): SetPhysics | null {
  const message: SetPhysics = { type: "set_physics" };
  if (!close(wanted.gravity, now.gravity)) message.gravity = wanted.gravity;
  if (!close([wanted.step], [now.step])) message.step = wanted.step;
  if (wanted.friction !== null && now.friction !== null && !close([wanted.friction], [now.friction])) message.friction = wanted.friction;
  if (wanted.coupling !== null && now.coupling !== null && !close(numbersOf(wanted.coupling), numbersOf(now.coupling))) message.coupling = wanted.coupling;
  return Object.keys(message).length > 1 ? message : null;
}

/** Message that gives a scene the values that differ from its present ones; null if none does. */
export function changeTo(values: SettingValues, scene: SceneMessage): SetPhysics | null {
  const { gravity, friction, step } = values;
  const now = physicsOf(scene);
  const [x, y, z] = downOf(scene);
  const wanted: PhysicsSettings = {
    gravity: gravity === undefined ? now.gravity : [gravity * x, gravity * y, gravity * z],
    step: step === undefined ? now.step : step / 1000,
    friction: friction ?? now.friction,
    coupling: now.coupling && { stiffness: values.stiffness ?? now.coupling.stiffness, damping: values.damping ?? now.coupling.damping },
  };
  return change(wanted, now);
}

/** Message that brings a scene back to its own settings; null if it has them. */
export function restoration(scene: SceneMessage): SetPhysics | null {
  return change(physicsOf(ownOf(scene)), physicsOf(scene));
}

function numbersOf({ stiffness, damping }: Coupling): number[] {
  return [stiffness, damping];
}

/** Whether numbers agree but for their rounding. */
export function close(a: readonly number[], b: readonly number[]): boolean {
  return a.every((x, k) => Math.abs(x - b[k]) <= 1e-9 * Math.max(Math.abs(x), Math.abs(b[k])));
}
