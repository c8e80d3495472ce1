// JSON messages in both directions (docs/viewer-protocol.md).

import type { EnergyName, Vector } from "./frame";

export interface SceneSummary {
  id: string;
  title: string;
  about: string;
}

export interface RenderRequest {
  frames: number[];
  width: number;
  height: number;
  camera: { from: Vector; to: Vector } | null;
  colour: string;
  dark: boolean;
}

export interface Hello {
  type: "hello";
  protocol: number;
  version: string;
  kind: "live" | "logs" | "render";
  viewer: number;
  /** Whether meshes can be recorded. */
  records: boolean;
  scenes: SceneSummary[];
  logs: { name: string }[];
  render?: RenderRequest;
}

export interface Material {
  young: number;
  poisson: number;
  density: number;
}

export interface Coupling {
  stiffness: number;
  damping: number;
}

export interface SceneObject {
  name: string;
  nodes: number;
  triangles: number;
  modes: number;
  radius: number;
  mass: number;
  fixed: boolean;
  material: Material | null;
  /** Materials of all regions. */
  materials?: Material[];
  recordable: boolean;
  certificate: string[];
}

export type ObstacleShape =
  | { plane: object }
  | { sphere: { radius: number } }
  | { box: { half_extents: Vector } }
  | { capsule: { radius: number; half_length: number } }
  | { mesh: object };

export interface SceneObstacle {
  name: string;
  shape: ObstacleShape;
  pose: number[];
  friction: number;
}

export interface SceneDevice {
  name: string;
  pointer: boolean;
  tip_radius: number;
  patch_radius: number;
  friction: number;
  coupling: Coupling | null;
}

export interface SceneMessage {
  type: "scene";
  generation: number;
  id: string;
  title: string;
  about: string;
  step_s: number;
  gravity: Vector;
  log?: number;
  frames?: number;
  frame_interval_s?: number;
  objects: SceneObject[];
  obstacles: SceneObstacle[];
  devices: SceneDevice[];
  warnings: string[];
  view: { center: Vector; radius: number };
  /** Settings of the scene as it was opened, of a live scene. */
  own?: OwnSettings;
}

/** Settings of a scene that pages change. */
export interface OwnSettings extends Pick<SceneMessage, "step_s" | "gravity" | "obstacles" | "devices"> {
  /** Material of each object; null for several. */
  materials: (Material | null)[];
}

export interface Percentiles {
  p50: number;
  p99: number;
  p999: number;
  max: number;
}

export interface Status {
  type: "status";
  generation: number;
  paused: boolean;
  slowdown: number;
  steps: number;
  viewers: number;
  force_process: {
    compute_us: Percentiles;
    lateness_us: Percentiles;
    overruns: number;
    compute_overruns: number;
    realtime_priority: boolean;
  } | null;
  /** Of a page without a server. */
  haptic_device?: HapticDeviceStatus;
}

/** Status of a haptic device: its force since the last status, off until a button of the grip is pressed. */
export interface HapticDeviceStatus {
  force: "off" | "on" | "late_updates" | "implausible_motion";
  max_force_n: number;
}

export interface DeviceAssigned {
  type: "assigned";
  pointer: number;
  device: number | null;
}

export interface Progress {
  type: "progress";
  job: string;
  phase: string;
  fraction: number | null;
  done?: boolean;
}

export interface InfoMessage {
  type: "info";
  text: string;
}

export interface ErrorMessage {
  type: "error";
  text: string;
}

export type ServerMessage = Hello | SceneMessage | Status | DeviceAssigned | Progress | InfoMessage | ErrorMessage;

export type TouchMode = "touch" | "hold";

export type ClientMessage =
  | { type: "press"; pointer: number; mode: "touch"; position: Vector }
  | {
      type: "press";
      pointer: number;
      mode: "hold";
      position: Vector;
      object: number;
      triangle: number;
      weights: Vector;
    }
  | { type: "move"; pointers: { pointer: number; position: Vector }[] }
  | { type: "release"; pointer: number }
  | { type: "pause"; paused: boolean }
  | { type: "single_step" }
  | { type: "slow_motion"; slowdown: number }
  | { type: "reset" }
  | { type: "cancel_job" }
  | { type: "open_scene"; scene: string }
  | { type: "set_physics"; gravity?: Vector; step?: number; friction?: number; coupling?: Coupling }
  | ({ type: "set_material"; object: number } & Material)
  | { type: "sound"; on: boolean }
  | { type: "stream"; format: "modal" | "vertices"; stride: number };

/** Response of `/log/K/series`: times [s], forces on the hands [N, world], energies [J]. */
export interface Series {
  t: number[];
  devices: { name: string; force: Vector[] }[];
  energy: Partial<Record<EnergyName, number[]>>;
}

type Check = (message: Record<string, unknown>) => boolean;

function isList(value: unknown): value is unknown[] {
  return Array.isArray(value);
}

function isNumbers(value: unknown, count: number): boolean {
  return isList(value) && value.length === count && value.every((x) => typeof x === "number");
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !isList(value);
}

function isOwn(value: unknown): boolean {
  return isObject(value) && typeof value.step_s === "number" && isNumbers(value.gravity, 3) && isList(value.obstacles) && isList(value.devices) && isList(value.materials);
}

function isView(value: unknown): boolean {
  return isObject(value) && isNumbers(value.center, 3) && typeof value.radius === "number" && value.radius > 0;
}

// Structural checks of the fields that the page relies on.
const CHECKS: Record<ServerMessage["type"], Check> = {
  hello: (m) =>
    typeof m.protocol === "number" &&
    typeof m.viewer === "number" &&
    (m.kind === "live" || m.kind === "logs" || m.kind === "render") &&
    isList(m.scenes) &&
    isList(m.logs),
  scene: (m) =>
    typeof m.generation === "number" &&
    isNumbers(m.gravity, 3) &&
    isList(m.objects) &&
    m.objects.every((o) => isObject(o) && typeof o.radius === "number" && isList(o.certificate)) &&
    isList(m.obstacles) &&
    m.obstacles.every((o) => isObject(o) && isObject(o.shape) && isNumbers(o.pose, 7)) &&
    isList(m.warnings) &&
    isList(m.devices) &&
    m.devices.every((d) => isObject(d) && typeof d.tip_radius === "number") &&
    isView(m.view) &&
    (m.own === undefined || isOwn(m.own)),
  status: (m) => typeof m.paused === "boolean" && typeof m.slowdown === "number",
  assigned: (m) => typeof m.pointer === "number",
  progress: (m) => typeof m.job === "string",
  info: (m) => typeof m.text === "string",
  error: (m) => typeof m.text === "string",
};

/** Parsed server message; null if it is malformed or of unknown type. */
export function parseMessage(text: string): ServerMessage | null {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch {
    return null;
  }
  if (!isObject(value) || typeof value.type !== "string") return null;
  const check = Object.hasOwn(CHECKS, value.type) ? CHECKS[value.type as ServerMessage["type"]] : undefined;
  return check !== undefined && check(value) ? (value as unknown as ServerMessage) : null;
}
