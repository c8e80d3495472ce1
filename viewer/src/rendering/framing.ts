// Framing of objects: the sphere about them, and which of them are out of sight.

import { Vector3, type PerspectiveCamera } from "three";

export interface Sphere {
  center: Vector3;
  radius: number;
}

/** Sphere that contains all spheres; grown from the first one, so not quite the smallest. */
export function sphereAround(spheres: readonly Sphere[]): Sphere {
  const [first, ...others] = spheres;
  const around = { center: first.center.clone(), radius: first.radius };
  for (const { center, radius } of others) {
    const apart = center.distanceTo(around.center);
    if (apart + radius <= around.radius) continue;
    if (apart + around.radius <= radius) {
      around.center.copy(center);
      around.radius = radius;
      continue;
    }
    const grown = (apart + radius + around.radius) / 2;
    around.center.lerp(center, (grown - around.radius) / apart);
    around.radius = grown;
  }
  return around;
}

/** Share of the view beyond which a centre is out of it. */
const OUT_OF_VIEW = 1.1;

/** Distance from the scene's sphere, in its radii, beyond which an object is far away. */
const FAR_AWAY = 8;

/** Whether a point is out of the view of a camera. */
export function isOutOfView(point: Vector3, camera: PerspectiveCamera): boolean {
  const at = point.clone().project(camera);
  return Math.abs(at.x) > OUT_OF_VIEW || Math.abs(at.y) > OUT_OF_VIEW || Math.abs(at.z) > 1;
}

/** Whether a point is far away from a scene. */
export function isFarAway(point: Vector3, scene: Sphere): boolean {
  return point.distanceTo(scene.center) > FAR_AWAY * scene.radius;
}
