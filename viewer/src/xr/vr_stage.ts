// Stage of a headset: where the scene stands before the viewer, and how large.
//
//   scene_from_room:  x ↦ c + k·R·(x − s)        k = radius of the scene / SHOWN_RADIUS
//
// c is the scene's centre [m], s the place in the room where it is shown [m], and R turns the room's y upwards in the scene and its z to the side
// from which the page looked.

import { Matrix4, Vector3 } from "three";

/** Radius with which the scene appears [m]: within reach of both hands. */
export const SHOWN_RADIUS = 0.22;
/** Place of the scene's centre in the room, its floor at y = 0 [m]: at the height of the chest, at arm's length of somebody who stands at the origin. */
const PLACE = new Vector3(0, 1.2, -0.5);

/** Turn of a frame with x to the right, y up and z towards the viewer: y upwards in the scene, z to the side of the page's camera. */
export function turnToCamera(up: Vector3, toCamera: Vector3): Matrix4 {
  const back = toCamera.clone().addScaledVector(up, -toCamera.dot(up));
  // From above every side is as good.
  if (back.lengthSq() < 1e-12) back.set(up.y, up.z, up.x).addScaledVector(up, -(up.y * up.x + up.z * up.y + up.x * up.z));
  back.normalize();
  return new Matrix4().makeBasis(new Vector3().crossVectors(up, back), up, back);
}

/** Map from room to scene, of a scene with this centre and radius [m], upward direction, and direction to the page's camera. */
export function sceneFromRoom(center: Vector3, radius: number, up: Vector3, toCamera: Vector3): Matrix4 {
  const scale = radius / SHOWN_RADIUS;
  const map = turnToCamera(up, toCamera).scale(new Vector3(scale, scale, scale));
  return map.setPosition(center.clone().sub(PLACE.clone().applyMatrix4(map)));
}
