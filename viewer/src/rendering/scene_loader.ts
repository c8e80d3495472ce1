// Loads the static data of a scene: surfaces, mode shapes, obstacle meshes.

import { fetchBytes } from "../protocol/urls";
import type { SceneMessage } from "../protocol/messages";
import { decodeModeShapes, decodeSurface, type ModeShapes, type Surface } from "../protocol/surface";
import type { LoadedScene } from "./scene_graph";

export function hasFloor(scene: SceneMessage): boolean {
  return scene.obstacles.some(({ shape }) => "plane" in shape);
}

/** Estimated download size [bytes]. */
function bytesOf(scene: SceneMessage, withShapes: boolean): number {
  return scene.objects.reduce(
    (sum, { nodes, triangles, modes }) => sum + 12 * (nodes + triangles) + (withShapes ? 6 * nodes * modes : 0),
    1,
  );
}

export async function loadScene(
  scene: SceneMessage,
  withShapes: boolean,
  signal: AbortSignal,
  onProgress: (share: number, bytes: number) => void,
): Promise<LoadedScene> {
  const total = bytesOf(scene, withShapes);
  let received = 0;
  const progress = (bytes: number) => {
    received += bytes;
    onProgress(Math.min(1, received / total), total);
  };
  const at = `scene/${scene.generation}`;
  const surfaces: Surface[] = [];
  const shapes: (ModeShapes | null)[] = [];
  // Sequential: mode shapes are large.
  for (let i = 0; i < scene.objects.length; i++) {
    surfaces.push(decodeSurface(await fetchBytes(`${at}/object/${i}/surface`, signal, progress)));
    const modal = withShapes && scene.objects[i].modes > 0;
    shapes.push(modal ? decodeModeShapes(await fetchBytes(`${at}/object/${i}/mode_shapes`, signal, progress)) : null);
  }
  const obstacleSurfaces: (Surface | null)[] = [];
  for (let i = 0; i < scene.obstacles.length; i++) {
    const mesh = "mesh" in scene.obstacles[i].shape;
    obstacleSurfaces.push(mesh ? decodeSurface(await fetchBytes(`${at}/obstacle/${i}/surface`, signal, progress)) : null);
  }
  return { scene, surfaces, shapes, obstacleSurfaces };
}
