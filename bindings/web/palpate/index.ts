/**
 * Contact forces from elastic objects that move freely, at 1 kHz or more.
 *
 * Lengths are metres, times seconds, forces newtons; vectors are in world axes.
 *
 * @packageDocumentation
 */

export { PalpateError } from "./error.js";
export { load } from "./library.js";
export type { ModuleSource } from "./memory.js";
export { Recording } from "./recording.js";
export { Scene, type MotionPath, type Quaternion, type SceneDevice, type SceneObject, type SceneObstacle, type SceneParts, type ScenePlane, type Vector } from "./scene.js";
export { CONTACT_COLUMNS, Simulation, type Contact } from "./simulation.js";
