// Motion of a pressing finger over a surface: where the pointer moves on the screen, the finger follows the relief under it.
//
//   along' = along + clamp(s(ray') − s(ray), ±MAX_SLOPE·|p' − p|)
//
// along [m]: distance of the finger's base point from the camera; s [m]: distance of the surface on a ray. Only differences of s
// enter, on the surface without its deformation: a pointer that rests does not run after an object that gives way.

import type { Ray, Vector3 } from "three";

/** Limit of the relief that is followed, as rise per way across the view: steeper ones are edges. */
const MAX_SLOPE = 3;

/** Point of a surface on a ray. */
export interface SurfacePoint {
  /** Distance from the ray's origin [m]. */
  distance: number;
  /** Outward normal, world. */
  normal: Vector3;
}

/** Distance along `to` of a point at `along` on `from` [m], moved in a plane parallel to the view. */
export function alongInPlane(from: Ray, to: Ray, along: number, viewDirection: Vector3): number {
  return (along * from.direction.dot(viewDirection)) / Math.max(0.2, to.direction.dot(viewDirection));
}

/** Distance along `to` of a point at `along` on `from` [m], moved over the surface points of both rays; off the surface in a plane parallel to the view. */
export function alongSurface(from: Ray, to: Ray, along: number, before: SurfacePoint | null, after: SurfacePoint | null, viewDirection: Vector3): number {
  const inPlane = alongInPlane(from, to, along, viewDirection);
  if (before === null || after === null) return inPlane;
  const across = to.at(inPlane, to.origin.clone()).distanceTo(from.at(along, from.origin.clone()));
  const limit = MAX_SLOPE * across;
  const rise = after.distance - alongInPlane(from, to, before.distance, viewDirection);
  return inPlane + Math.min(limit, Math.max(-limit, rise));
}
