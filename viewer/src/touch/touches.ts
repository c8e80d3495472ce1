// Fingers that press: each goes where the ray of its pointer says, in a plane along the view, and deeper by how far it
// is pushed. A finger that touches begins outside and goes in along the ray; one that holds begins on the surface.

import { Raycaster, Vector3, type Ray } from "three";
import type { ToServer, TouchMode } from "../protocol/messages";
import type { Stage } from "../picture/stage";
import { pick } from "./pick";

/** How far a press goes in by itself, as a share of the object's radius. */
const PRESS_DEPTH = 0.09;
const PRESS_SECONDS = 0.28;
const START_OUTSIDE = 1.35;
const LEAST_COSINE = 0.35;
const MOST_POINTERS = 16;
const SEND_EVERY_MS = 7;

export interface SurfacePoint {
  object: number;
  triangle: number;
  weights: [number, number, number];
  /** [m, world] */
  point: Vector3;
  /** Cosine between the ray and the normal of the triangle. */
  cosine: number;
}

interface Touch {
  pointer: number;
  mode: TouchMode;
  x: number;
  y: number;
  /** Of the plane in which it moves, along the view [m]. */
  planeDistance: number;
  /** Where a tip begins, before the plane [m]. */
  outside: number;
  /** How far behind the plane it is meant to be [m]. */
  depth: number;
  /** Largest sensible depth [m]. */
  deepest: number;
  begun: number;
  device: number | null;
  refused: boolean;
  sent: Vector3;
}

export class Touches {
  private readonly touches = new Map<string, Touch>();
  private nextPointer = 0;
  private sentAt = 0;
  private readonly raycaster = new Raycaster();
  onBegin: () => void = () => undefined;
  onRefused: () => void = () => undefined;

  constructor(
    private readonly stage: Stage,
    private readonly send: (message: ToServer) => void,
  ) {}

  get count(): number {
    return this.touches.size;
  }

  has(key: string): boolean {
    return this.touches.has(key);
  }

  /** What of the surfaces is at a place of the picture (−1…1). */
  at(x: number, y: number): SurfacePoint | null {
    const world = this.stage.worlds[0];
    if (world === undefined || world.picture === null) return null;
    const ray = this.stage.orbit.ray(x, y);
    let nearest = this.obstacleBefore(ray);
    let found: SurfacePoint | null = null;
    world.objects.forEach((object, number) => {
      const toBody = object.group.matrixWorld.clone().invert();
      const own = ray.clone().applyMatrix4(toBody);
      const places = object.currentPlaces(this.stage.renderer);
      const hit = pick(places, object.surface.corners, own.origin.toArray(), own.direction.toArray());
      if (hit === null || hit.distance >= nearest) return;
      nearest = hit.distance;
      const [a, b, c] = [0, 1, 2].map((k) =>
        new Vector3().fromArray(places as unknown as number[], 3 * object.surface.corners[3 * hit.triangle + k]),
      );
      const normal = b.sub(a).cross(c.sub(a)).normalize();
      const cosine = -normal.dot(own.direction);
      const point = ray.at(hit.distance, new Vector3());
      found = { object: number, triangle: hit.triangle, weights: hit.weights, point, cosine };
    });
    return found;
  }

  private obstacleBefore(ray: Ray): number {
    this.raycaster.ray.copy(ray);
    const meshes = this.stage.worlds[0].rigidMeshes;
    return this.raycaster.intersectObjects(meshes, false)[0]?.distance ?? Infinity;
  }

  /** Presses what is at a place of the picture; false if nothing is there. */
  begin(key: string, x: number, y: number, mode: TouchMode): boolean {
    if (this.touches.has(key) || this.touches.size >= MOST_POINTERS) return false;
    const world = this.stage.worlds[0];
    const hit = this.at(x, y);
    if (world === undefined || hit === null) return false;
    const pointers = world.info.devices.filter((device) => device.pointer);
    if (pointers.length === 0) return false;
    const tip = Math.max(...pointers.map((device) => device.tip_radius));
    const radius = world.info.objects[hit.object].radius;
    const { camera, looksAlong } = this.stage.orbit;
    const touch: Touch = {
      pointer: this.freePointer(),
      mode,
      x,
      y,
      planeDistance: hit.point.clone().sub(camera.position).dot(looksAlong),
      outside: mode === "touch" ? (START_OUTSIDE * tip + 1e-4) / Math.max(LEAST_COSINE, hit.cosine) : 0,
      depth: mode === "touch" ? PRESS_DEPTH * radius : 0,
      deepest: 2.5 * radius,
      begun: performance.now(),
      device: null,
      refused: false,
      sent: new Vector3(),
    };
    this.touches.set(key, touch);
    const position = this.place(touch, touch.begun);
    touch.sent.copy(position);
    const { pointer } = touch;
    if (mode === "touch") {
      this.send({ type: "press", pointer, mode, position: position.toArray() });
    } else {
      const { object, triangle, weights } = hit;
      this.send({ type: "press", pointer, mode, position: hit.point.toArray(), object, triangle, weights });
    }
    this.onBegin();
    return true;
  }

  private freePointer(): number {
    const taken = new Set([...this.touches.values()].map((touch) => touch.pointer));
    do this.nextPointer = (this.nextPointer + 1) % MOST_POINTERS;
    while (taken.has(this.nextPointer));
    return this.nextPointer;
  }

  /** Where a finger is meant to be now. */
  private place(touch: Touch, now: number): Vector3 {
    const { orbit } = this.stage;
    const ray = orbit.ray(touch.x, touch.y);
    const along = touch.planeDistance / Math.max(0.2, ray.direction.dot(orbit.looksAlong));
    // A frame may carry a time before the press that it comes after.
    const share = Math.min(1, Math.max(0, (now - touch.begun) / (1000 * PRESS_SECONDS)));
    const eased = share * share * (3 - 2 * share);
    return ray.at(along - touch.outside + eased * (touch.outside + touch.depth), new Vector3());
  }

  move(key: string, x: number, y: number): void {
    const touch = this.touches.get(key);
    if (touch === undefined) return;
    touch.x = x;
    touch.y = y;
  }

  /** Pushes deeper, in shares of the deepest that is sensible. */
  push(key: string, share: number): void {
    const touch = this.touches.get(key);
    if (touch !== undefined) this.setDepth(touch, touch.depth + share * touch.deepest);
  }

  pushAll(share: number): void {
    for (const key of this.touches.keys()) this.push(key, share);
  }

  /** How hard a pen presses (0…1), as depth. */
  press(key: string, pressure: number): void {
    const touch = this.touches.get(key);
    if (touch?.mode === "touch") this.setDepth(touch, (0.02 + 0.3 * pressure) * touch.deepest);
  }

  private setDepth(touch: Touch, depth: number): void {
    touch.depth = Math.min(touch.deepest, Math.max(-touch.deepest, depth));
  }

  end(key: string): void {
    const touch = this.touches.get(key);
    if (touch === undefined) return;
    this.touches.delete(key);
    if (!touch.refused) this.send({ type: "release", pointer: touch.pointer });
  }

  endAll(): void {
    for (const key of [...this.touches.keys()]) this.end(key);
  }

  /** Forgets all without a word: the server is not there any more, or has begun a scene anew. */
  forget(): void {
    this.touches.clear();
  }

  granted(pointer: number, device: number | null): void {
    for (const touch of this.touches.values()) {
      if (touch.pointer !== pointer) continue;
      touch.device = device;
      if (device === null) {
        touch.refused = true;
        this.onRefused();
      }
    }
  }

  /** The devices of the fingers that press here. */
  get devices(): number[] {
    return [...this.touches.values()].flatMap((touch) => (touch.device === null ? [] : [touch.device]));
  }

  deviceOf(key: string): number | null {
    return this.touches.get(key)?.device ?? null;
  }

  /** Once per frame: says where the fingers are, if they have moved. */
  frame(now: number): void {
    if (this.touches.size === 0 || now - this.sentAt < SEND_EVERY_MS) return;
    const moved: { pointer: number; position: [number, number, number] }[] = [];
    for (const touch of this.touches.values()) {
      const position = this.place(touch, now);
      if (touch.refused || position.equals(touch.sent)) continue;
      touch.sent.copy(position);
      moved.push({ pointer: touch.pointer, position: position.toArray() });
    }
    if (moved.length === 0) return;
    this.sentAt = now;
    this.send({ type: "move", pointers: moved });
  }
}
