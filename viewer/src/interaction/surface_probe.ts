// Surfaces under rays: the nearest object as it is deformed now, and the relief of an object without its deformation.

import { Raycaster, Vector3, type Ray } from "three";
import type { ElasticMesh } from "../rendering/elastic/elastic_mesh";
import type { SceneView } from "../rendering/scene_view";
import { pick, type Hit } from "./picking";
import type { SurfacePoint } from "./surface_follow";

/** Size of a surface up to which its relief is followed at each motion of a pointer [triangles]. */
const MAX_RELIEF_TRIANGLES = 100_000;

export interface SurfaceHit {
  object: number;
  triangle: number;
  weights: [number, number, number];
  /** Hit point [m, world]. */
  point: Vector3;
  /** Outward normal of the triangle, world. */
  normal: Vector3;
}

export class SurfaceProbe {
  private readonly raycaster = new Raycaster();

  constructor(private readonly sceneView: SceneView) {}

  /** Nearest elastic surface under normalised device coordinates, or null. Waits for the GPU. */
  hit(x: number, y: number): SurfaceHit | null {
    const graph = this.sceneView.graphs[0];
    if (graph === undefined || graph.frame === null) return null;
    const ray = this.sceneView.orbit.ray(x, y);
    let nearest = this.obstacleDistance(ray);
    let found: SurfaceHit | null = null;
    graph.objects.forEach((object, number) => {
      const positions = object.currentPositions(this.sceneView.renderer);
      const hit = pickInWorld(object, positions, ray);
      if (hit === null || hit.distance >= nearest) return;
      nearest = hit.distance;
      const { triangle, weights } = hit;
      found = { object: number, triangle, weights, point: ray.at(hit.distance, new Vector3()), normal: normalOf(object, positions, triangle) };
    });
    return found;
  }

  /** Point of an object at rest, in its present pose, on a ray; null beside it, and on surfaces that are too fine for it. */
  relief(number: number, ray: Ray): SurfacePoint | null {
    const object = this.sceneView.graphs[0]?.objects[number];
    if (object === undefined || object.info.triangles > MAX_RELIEF_TRIANGLES) return null;
    const { positions } = object.surface;
    const hit = pickInWorld(object, positions, ray);
    return hit === null ? null : { distance: hit.distance, normal: normalOf(object, positions, hit.triangle) };
  }

  private obstacleDistance(ray: Ray): number {
    this.raycaster.ray.copy(ray);
    const meshes = this.sceneView.graphs[0].obstacleMeshes;
    return this.raycaster.intersectObjects(meshes, false)[0]?.distance ?? Infinity;
  }
}

function pickInWorld(object: ElasticMesh, positions: Float32Array, ray: Ray): Hit | null {
  const bodyRay = ray.clone().applyMatrix4(object.group.matrixWorld.clone().invert());
  return pick(positions, object.surface.indices, bodyRay.origin.toArray(), bodyRay.direction.toArray());
}

/** Outward normal of a triangle, world. */
function normalOf(object: ElasticMesh, positions: Float32Array, triangle: number): Vector3 {
  const [a, b, c] = [0, 1, 2].map((k) => new Vector3().fromArray(positions, 3 * object.surface.indices[3 * triangle + k]));
  return b.sub(a).cross(c.sub(a)).normalize().applyQuaternion(object.group.quaternion);
}
