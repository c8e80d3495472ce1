// Active touches. In touch mode a finger begins outside of the object and moves in against the normal; then it follows the surface under
// its pointer at that depth. In hold mode it begins on the surface and moves in a plane parallel to the view.

import { type Ray, Vector3 } from "three";
import type { ClientMessage, TouchMode } from "../protocol/messages";
import type { Rectangle } from "../rendering/overlay";
import type { SceneView } from "../rendering/scene_view";
import { alongInPlane, alongSurface } from "./surface_follow";
import { type SurfaceHit, SurfaceProbe } from "./surface_probe";

/** Initial depth of a press as a fraction of the object's radius. */
export const PRESS_DEPTH = 0.09;
const PRESS_SECONDS = 0.28;
const START_OUTSIDE = 1.35;
const SEND_INTERVAL_MS = 7;
/** Time constant of the direction in which a finger presses, on faceted surfaces [ms]. */
const DIRECTION_MS = 60;
const RING_PX = 12;

/** Numbers of the pointers that a set of touches may use. */
export interface PointerNumbers {
  first: number;
  count: number;
}

/** Pointer that presses, from before its scene shows a frame on. */
interface Waiting {
  mode: TouchMode;
  x: number;
  y: number;
}

interface Touch extends Waiting {
  pointer: number;
  object: number;
  /** Ray of the pointer when it was last followed. */
  ray: Ray;
  /** Distance of the base point on the ray [m]: on the surface when the press began. */
  along: number;
  /** Direction of the press, world: against the normal, smoothed. */
  inward: Vector3;
  /** Direction that `inward` tends to. */
  newInward: Vector3;
  followedAt: number;
  /** Start distance outside of the base point [m]. */
  outside: number;
  /** Target depth behind the base point [m]. */
  depth: number;
  /** Maximum depth [m]. */
  maxDepth: number;
  startedAt: number;
  device: number | null;
  refused: boolean;
  sent: Vector3;
}

export class Touches {
  private readonly touches = new Map<string, Touch>();
  /** Presses that wait for the first frame of a scene. */
  private readonly waiting = new Map<string, Waiting>();
  private ready = false;
  private nextPointer = 0;
  private sentAt = 0;
  private readonly probe: SurfaceProbe;
  onBegin: () => void = () => undefined;
  onRefused: () => void = () => undefined;

  constructor(
    private readonly sceneView: SceneView,
    private readonly send: (message: ClientMessage) => void,
    private readonly numbers: PointerNumbers,
    private readonly pressDepth = PRESS_DEPTH,
  ) {
    this.probe = new SurfaceProbe(sceneView);
  }

  get count(): number {
    return this.touches.size + this.waiting.size;
  }

  has(key: string): boolean {
    return this.touches.has(key) || this.waiting.has(key);
  }

  /** Nearest elastic surface under normalised device coordinates, or null. */
  hitTest(x: number, y: number): SurfaceHit | null {
    return this.ready ? this.probe.hit(x, y) : null;
  }

  /** Begins a touch at normalised device coordinates, once the scene shows a frame; false if no surface is there. */
  begin(key: string, x: number, y: number, mode: TouchMode): boolean {
    if (this.has(key) || this.count >= this.numbers.count) return false;
    if (!this.ready) {
      this.waiting.set(key, { mode, x, y });
      return true;
    }
    return this.press(key, { mode, x, y });
  }

  private press(key: string, { mode, x, y }: Waiting): boolean {
    const graph = this.sceneView.graphs[0];
    const hit = this.probe.hit(x, y);
    if (graph === undefined || hit === null) return false;
    const pointers = graph.info.devices.filter((device) => device.pointer);
    if (pointers.length === 0) return false;
    const tip = Math.max(...pointers.map((device) => device.tip_radius));
    const radius = graph.info.objects[hit.object].radius;
    const ray = this.sceneView.orbit.ray(x, y);
    const inward = mode === "touch" ? hit.normal.clone().negate() : ray.direction.clone();
    const now = performance.now();
    const touch: Touch = {
      pointer: this.freePointer(),
      mode,
      x,
      y,
      object: hit.object,
      ray,
      along: hit.point.distanceTo(ray.origin),
      inward,
      newInward: inward.clone(),
      followedAt: now,
      outside: mode === "touch" ? START_OUTSIDE * tip + 1e-4 : 0,
      depth: mode === "touch" ? this.pressDepth * radius : 0,
      maxDepth: 2.5 * radius,
      startedAt: now,
      device: null,
      refused: false,
      sent: new Vector3(),
    };
    this.touches.set(key, touch);
    const position = this.targetPosition(touch, touch.startedAt);
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
    const { first, count } = this.numbers;
    const taken = new Set([...this.touches.values()].map((touch) => touch.pointer));
    do this.nextPointer = (this.nextPointer + 1) % count;
    while (taken.has(first + this.nextPointer));
    return first + this.nextPointer;
  }

  /** Moves the base point with the pointer: over the surface that is touched, or in a plane parallel to the view. */
  private follow(touch: Touch, now: number): void {
    const { orbit } = this.sceneView;
    const ray = orbit.ray(touch.x, touch.y);
    const share = 1 - Math.exp(-Math.max(0, now - touch.followedAt) / DIRECTION_MS);
    touch.followedAt = Math.max(now, touch.followedAt);
    if (!ray.equals(touch.ray)) {
      const { viewDirection } = orbit;
      if (touch.mode === "touch") {
        const [before, after] = [touch.ray, ray].map((one) => this.probe.relief(touch.object, one));
        touch.along = alongSurface(touch.ray, ray, touch.along, before, after, viewDirection);
        if (after !== null) touch.newInward.copy(after.normal).negate();
      } else {
        touch.along = alongInPlane(touch.ray, ray, touch.along, viewDirection);
        touch.newInward.copy(ray.direction);
      }
      touch.ray = ray;
    }
    touch.inward.lerp(touch.newInward, touch.mode === "touch" ? share : 1);
    if (touch.inward.lengthSq() < 0.01) touch.inward.copy(touch.newInward);
    touch.inward.normalize();
  }

  /** Target position of a touch at time `now` [m, world]. */
  private targetPosition(touch: Touch, now: number): Vector3 {
    this.follow(touch, now);
    // An animation frame may carry a timestamp from before the press.
    const fraction = Math.min(1, Math.max(0, (now - touch.startedAt) / (1000 * PRESS_SECONDS)));
    const eased = fraction * fraction * (3 - 2 * fraction);
    const depth = -touch.outside + eased * (touch.outside + touch.depth);
    return touch.ray.at(touch.along, new Vector3()).addScaledVector(touch.inward, depth);
  }

  move(key: string, x: number, y: number): void {
    const touch = this.touches.get(key) ?? this.waiting.get(key);
    if (touch === undefined) return;
    touch.x = x;
    touch.y = y;
  }

  /** Changes the depth by a fraction of the maximum depth. */
  push(key: string, fraction: number): void {
    const touch = this.touches.get(key);
    if (touch !== undefined) this.setDepth(touch, touch.depth + fraction * touch.maxDepth);
  }

  pushAll(fraction: number): void {
    for (const key of this.touches.keys()) this.push(key, fraction);
  }

  /** Sets the depth from pen pressure (0…1). */
  pressWith(key: string, pressure: number): void {
    const touch = this.touches.get(key);
    if (touch?.mode === "touch") this.setDepth(touch, (0.02 + 0.3 * pressure) * touch.maxDepth);
  }

  private setDepth(touch: Touch, depth: number): void {
    touch.depth = Math.min(touch.maxDepth, Math.max(-touch.maxDepth, depth));
  }

  end(key: string): void {
    this.waiting.delete(key);
    const touch = this.touches.get(key);
    if (touch === undefined) return;
    this.touches.delete(key);
    if (!touch.refused) this.send({ type: "release", pointer: touch.pointer });
  }

  endAll(): void {
    for (const key of [...this.touches.keys(), ...this.waiting.keys()]) this.end(key);
  }

  /** Lets all touches wait until `resume`: the connection is lost, or a scene is loaded. The server may have dropped its pointers. */
  suspend(): void {
    this.ready = false;
    for (const [key, { mode, x, y }] of [...this.touches]) {
      this.end(key);
      this.waiting.set(key, { mode, x, y });
    }
  }

  /** Begins the touches that wait: the scene shows a frame. */
  resume(): void {
    if (this.ready) return;
    this.ready = true;
    const waiting = [...this.waiting];
    this.waiting.clear();
    for (const [key, wanted] of waiting) this.press(key, wanted);
  }

  /** Sets the device slot of a pointer; null: refused, all slots are taken. */
  assign(pointer: number, device: number | null): void {
    for (const touch of this.touches.values()) {
      if (touch.pointer !== pointer) continue;
      touch.device = device;
      if (device === null) {
        touch.refused = true;
        this.onRefused();
      }
    }
  }

  /** Device slots of the active touches. */
  get devices(): number[] {
    return [...this.touches.values()].flatMap((touch) => (touch.device === null ? [] : [touch.device]));
  }

  deviceOf(key: string): number | null {
    return this.touches.get(key)?.device ?? null;
  }

  /** Sends changed positions, once per animation frame. */
  animate(now: number): void {
    if (this.touches.size === 0 || now - this.sentAt < SEND_INTERVAL_MS) return;
    const moved: { pointer: number; position: [number, number, number] }[] = [];
    for (const touch of this.touches.values()) {
      const position = this.targetPosition(touch, now);
      if (touch.refused || position.equals(touch.sent)) continue;
      touch.sent.copy(position);
      moved.push({ pointer: touch.pointer, position: position.toArray() });
    }
    if (moved.length === 0) return;
    this.sentAt = now;
    this.send({ type: "move", pointers: moved });
  }

  /** Draws a ring at every press that the scene does not show yet: it loads, is paused, or the press is under way. */
  draw(context: CanvasRenderingContext2D, view: Rectangle): void {
    const devices = this.sceneView.graphs[0]?.frame?.devices ?? [];
    const unseen = [...this.touches.values()].filter(({ device }) => device === null || (devices[device]?.mode ?? "inactive") === "inactive");
    for (const { x, y } of [...this.waiting.values(), ...unseen]) {
      context.lineWidth = 2.5;
      context.strokeStyle = this.sceneView.palette.interfacePoint;
      context.beginPath();
      context.arc(view.x + (0.5 + 0.5 * x) * view.width, view.y + (0.5 - 0.5 * y) * view.height, RING_PX, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}
