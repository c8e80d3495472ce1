// Physics settings of a scene, their fields, and those that it came with, to which Reset goes back.

import type { ClientMessage, Coupling, SceneMessage } from "../protocol/messages";
import type { Vector } from "../protocol/frame";
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
export function physicsOf(scene: SceneMessage): PhysicsSettings {
  const pointer = scene.devices.find((device) => device.pointer) ?? scene.devices[0];
  const friction = pointer?.friction ?? scene.obstacles[0]?.friction ?? null;
  return { gravity: scene.gravity, step: scene.step_s, friction, coupling: pointer?.coupling ?? null };
}

/** Direction of gravity; downwards in a scene without. */
export function directionOf(gravity: Vector): Vector {
  const magnitude = Math.hypot(...gravity);
  return magnitude > 0 ? [gravity[0] / magnitude, gravity[1] / magnitude, gravity[2] / magnitude] : [0, -1, 0];
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
export function changeTo(values: SettingValues, now: PhysicsSettings): SetPhysics | null {
  const { gravity, friction, step } = values;
  const [x, y, z] = directionOf(now.gravity);
  const wanted: PhysicsSettings = {
    gravity: gravity === undefined ? now.gravity : [gravity * x, gravity * y, gravity * z],
    step: step === undefined ? now.step : step / 1000,
    friction: friction ?? now.friction,
    coupling: now.coupling && { stiffness: values.stiffness ?? now.coupling.stiffness, damping: values.damping ?? now.coupling.damping },
  };
  return change(wanted, now);
}

/** Settings that scenes had when they were opened. */
export class OwnSettings {
  private readonly known = new Map<string, PhysicsSettings>();
  private current: string | null = null;

  /** Notes a scene: one that follows another was opened, one that follows itself was changed. */
  note(scene: SceneMessage): void {
    const key = `${scene.id ?? ""} ${scene.title}`;
    if (key !== this.current || !this.known.has(key)) this.known.set(key, physicsOf(scene));
    this.current = key;
  }

  private get own(): PhysicsSettings | undefined {
    return this.current === null ? undefined : this.known.get(this.current);
  }

  /** Values of the noted scene's own settings. */
  get values(): SettingValues {
    const { own } = this;
    return own === undefined ? {} : valuesOf(own);
  }

  /** Message that brings the noted scene back to its own settings; null if it has them. */
  restoration(scene: SceneMessage): SetPhysics | null {
    const { own } = this;
    return own === undefined ? null : change(own, physicsOf(scene));
  }
}

function numbersOf({ stiffness, damping }: Coupling): number[] {
  return [stiffness, damping];
}

function close(a: readonly number[], b: readonly number[]): boolean {
  return a.every((x, k) => Math.abs(x - b[k]) <= 1e-9 * Math.max(Math.abs(x), Math.abs(b[k])));
}
