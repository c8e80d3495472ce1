// Active touches. Each follows the ray of its pointer in a plane parallel to the view, offset by its depth. In touch
// mode it begins outside of the object and moves in along the ray; in hold mode it begins on the surface.

import { Raycaster, Vector3, type Ray } from "three";
import type { ClientMessage, TouchMode } from "../protocol/messages";
import type { SceneView } from "../rendering/scene_view";
import { pick } from "./picking";

/** Initial depth of a press as a fraction of the object's radius. */
const PRESS_DEPTH = 0.09;
const PRESS_SECONDS = 0.28;
const START_OUTSIDE = 1.35;
const MIN_COSINE = 0.35;
const MAX_POINTERS = 16;
const SEND_INTERVAL_MS = 7;

export interface SurfaceHit {
  object: number;
  triangle: number;
  weights: [number, number, number];
  /** Hit point [m, world]. */
  point: Vector3;
  /** Cosine between the ray and the triangle normal. */
  cosine: number;
}

interface Touch {
  pointer: number;
  mode: TouchMode;
  x: number;
  y: number;
  /** Distance of the motion plane from the camera [m]. */
  planeDistance: number;
  /** Start distance in front of the plane [m]. */
  outside: number;
  /** Target depth behind the plane [m]. */
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
  private nextPointer = 0;
  private sentAt = 0;
  private readonly raycaster = new Raycaster();
  onBegin: () => void = () => undefined;
  onRefused: () => void = () => undefined;

  constructor(
    private readonly sceneView: SceneView,
    private readonly send: (message: ClientMessage) => void,
  ) {}

  get count(): number {
    return this.touches.size;
  }

  has(key: string): boolean {
    return this.touches.has(key);
  }

  /** Nearest elastic surface under normalised device coordinates, or null. */
  hitTest(x: number, y: number): SurfaceHit | null {
    const graph = this.sceneView.graphs[0];
    if (graph === undefined || graph.frame === null) return null;
    const ray = this.sceneView.orbit.ray(x, y);
    let nearest = this.obstacleDistance(ray);
    let found: SurfaceHit | null = null;
    graph.objects.forEach((object, number) => {
      const toBody = object.group.matrixWorld.clone().invert();
      const bodyRay = ray.clone().applyMatrix4(toBody);
      const positions = object.currentPositions(this.sceneView.renderer);
      const hit = pick(positions, object.surface.indices, bodyRay.origin.toArray(), bodyRay.direction.toArray());
      if (hit === null || hit.distance >= nearest) return;
      nearest = hit.distance;
      const [a, b, c] = [0, 1, 2].map((k) =>
        new Vector3().fromArray(positions as unknown as number[], 3 * object.surface.indices[3 * hit.triangle + k]),
      );
      const normal = b.sub(a).cross(c.sub(a)).normalize();
      const cosine = -normal.dot(bodyRay.direction);
      const point = ray.at(hit.distance, new Vector3());
      found = { object: number, triangle: hit.triangle, weights: hit.weights, point, cosine };
    });
    return found;
  }

  private obstacleDistance(ray: Ray): number {
    this.raycaster.ray.copy(ray);
    const meshes = this.sceneView.graphs[0].obstacleMeshes;
    return this.raycaster.intersectObjects(meshes, false)[0]?.distance ?? Infinity;
  }

  /** Begins a touch at normalised device coordinates; false if no surface is there. */
  begin(key: string, x: number, y: number, mode: TouchMode): boolean {
    if (this.touches.has(key) || this.touches.size >= MAX_POINTERS) return false;
    const graph = this.sceneView.graphs[0];
    const hit = this.hitTest(x, y);
    if (graph === undefined || hit === null) return false;
    const pointers = graph.info.devices.filter((device) => device.pointer);
    if (pointers.length === 0) return false;
    const tip = Math.max(...pointers.map((device) => device.tip_radius));
    const radius = graph.info.objects[hit.object].radius;
    const { camera, viewDirection } = this.sceneView.orbit;
    const touch: Touch = {
      pointer: this.freePointer(),
      mode,
      x,
      y,
      planeDistance: hit.point.clone().sub(camera.position).dot(viewDirection),
      outside: mode === "touch" ? (START_OUTSIDE * tip + 1e-4) / Math.max(MIN_COSINE, hit.cosine) : 0,
      depth: mode === "touch" ? PRESS_DEPTH * radius : 0,
      maxDepth: 2.5 * radius,
      startedAt: performance.now(),
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
    const taken = new Set([...this.touches.values()].map((touch) => touch.pointer));
    do this.nextPointer = (this.nextPointer + 1) % MAX_POINTERS;
    while (taken.has(this.nextPointer));
    return this.nextPointer;
  }

  /** Target position of a touch at time `now` [m, world]. */
  private targetPosition(touch: Touch, now: number): Vector3 {
    const { orbit } = this.sceneView;
    const ray = orbit.ray(touch.x, touch.y);
    const along = touch.planeDistance / Math.max(0.2, ray.direction.dot(orbit.viewDirection));
    // An animation frame may carry a timestamp from before the press.
    const fraction = Math.min(1, Math.max(0, (now - touch.startedAt) / (1000 * PRESS_SECONDS)));
    const eased = fraction * fraction * (3 - 2 * fraction);
    return ray.at(along - touch.outside + eased * (touch.outside + touch.depth), new Vector3());
  }

  move(key: string, x: number, y: number): void {
    const touch = this.touches.get(key);
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
  press(key: string, pressure: number): void {
    const touch = this.touches.get(key);
    if (touch?.mode === "touch") this.setDepth(touch, (0.02 + 0.3 * pressure) * touch.maxDepth);
  }

  private setDepth(touch: Touch, depth: number): void {
    touch.depth = Math.min(touch.maxDepth, Math.max(-touch.maxDepth, depth));
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

  /** Drops all touches without a message: the connection is lost, or the scene was restarted. */
  clear(): void {
    this.touches.clear();
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
}
