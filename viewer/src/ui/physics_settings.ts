// Physics settings of a scene, and those that it came with, to which Reset goes back.

import type { ClientMessage, Coupling, SceneMessage } from "../protocol/messages";
import type { Vector } from "../protocol/frame";

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

  /** Message that brings the noted scene back to its own settings; null if it has them. */
  restoration(scene: SceneMessage): Extract<ClientMessage, { type: "set_physics" }> | null {
    const own = this.current === null ? undefined : this.known.get(this.current);
    if (own === undefined) return null;
    const now = physicsOf(scene);
    const change: Partial<PhysicsSettings> = {};
    if (!close(own.gravity, now.gravity)) change.gravity = own.gravity;
    if (!close([own.step], [now.step])) change.step = own.step;
    if (own.friction !== null && now.friction !== null && !close([own.friction], [now.friction])) change.friction = own.friction;
    if (own.coupling !== null && now.coupling !== null && !close(Object.values(own.coupling), Object.values(now.coupling))) change.coupling = own.coupling;
    if (Object.keys(change).length === 0) return null;
    return { type: "set_physics", ...(change as { gravity?: Vector; step?: number; friction?: number; coupling?: Coupling }) };
  }
}

function close(a: readonly number[], b: readonly number[]): boolean {
  return a.every((x, k) => Math.abs(x - b[k]) <= 1e-9 * Math.max(Math.abs(x), Math.abs(b[k])));
}
