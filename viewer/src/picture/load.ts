// Gets what belongs to a scene once: surfaces, mode shapes, meshes of obstacles.

import { fetchBytes } from "../protocol/address";
import type { SceneMessage } from "../protocol/messages";
import { readShapes, readSurface, type Shapes, type Surface } from "../protocol/surface";
import type { Loaded } from "./world";

export function hasFloor(scene: SceneMessage): boolean {
  return scene.obstacles.some(({ shape }) => "plane" in shape);
}

/** How many bytes a scene will be, about. */
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
  heard: (share: number, bytes: number) => void,
): Promise<Loaded> {
  const whole = bytesOf(scene, withShapes);
  let got = 0;
  const progress = (bytes: number) => {
    got += bytes;
    heard(Math.min(1, got / whole), whole);
  };
  const at = `scene/${scene.generation}`;
  const surfaces: Surface[] = [];
  const shapes: (Shapes | null)[] = [];
  // One after the other: shapes are large.
  for (let i = 0; i < scene.objects.length; i++) {
    surfaces.push(readSurface(await fetchBytes(`${at}/object/${i}/surface`, signal, progress)));
    const modal = withShapes && scene.objects[i].modes > 0;
    shapes.push(modal ? readShapes(await fetchBytes(`${at}/object/${i}/shapes`, signal, progress)) : null);
  }
  const obstacleSurfaces: (Surface | null)[] = [];
  for (let i = 0; i < scene.obstacles.length; i++) {
    const mesh = "mesh" in scene.obstacles[i].shape;
    obstacleSurfaces.push(mesh ? readSurface(await fetchBytes(`${at}/obstacle/${i}/surface`, signal, progress)) : null);
  }
  return { scene, surfaces, shapes, obstacleSurfaces };
}
