// Rigid things that objects meet: balls, boxes, capsules, meshes.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Group,
  Mesh,
  SphereGeometry,
  type RawShaderMaterial,
  type Vector3,
} from "three";
import type { SceneObstacle } from "../protocol/messages";
import type { Surface } from "../protocol/surface";
import { rgb } from "./colours";
import { smoothParts } from "./elastic/creases";
import { normalsOf } from "./elastic/reconstruct";
import { SHADOW_FRAGMENT } from "./elastic/shaders";
import { matter, shadowMatter } from "./matter";

/** The geometry of a mesh, with edges where it has edges. */
export function meshGeometry(surface: Surface): BufferGeometry {
  const smooth = smoothParts(surface);
  const numbers = new Float32Array(4 * smooth.vertices);
  normalsOf(surface, smooth, surface.positions, numbers);
  const [positions, normals] = [new Float32Array(3 * smooth.vertices), new Float32Array(3 * smooth.vertices)];
  for (let v = 0; v < smooth.vertices; v++) {
    for (let k = 0; k < 3; k++) {
      positions[3 * v + k] = surface.positions[3 * smooth.node[v] + k];
      normals[3 * v + k] = numbers[4 * v + k];
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.setIndex(new BufferAttribute(smooth.corners, 1));
  return geometry;
}

function geometryOf(obstacle: SceneObstacle, surface: Surface | null): BufferGeometry | null {
  const { shape } = obstacle;
  if ("sphere" in shape) return new SphereGeometry(shape.sphere.radius, 64, 40);
  if ("box" in shape) {
    const [x, y, z] = shape.box.half_extents;
    return new BoxGeometry(2 * x, 2 * y, 2 * z);
  }
  if ("capsule" in shape) return new CapsuleGeometry(shape.capsule.radius, 2 * shape.capsule.half_length, 20, 48);
  if ("mesh" in shape) return surface === null ? null : meshGeometry(surface);
  return null;
}

export class Obstacle {
  readonly group = new Group();
  readonly solid: Mesh;
  readonly shadow: Mesh;
  readonly shadowMaterial: RawShaderMaterial;
  private readonly material: RawShaderMaterial;

  /** Null for shapes that are none of these (planes are drawn by `Ground`). */
  static make(obstacle: SceneObstacle, surface: Surface | null, colour: string, up: Vector3): Obstacle | null {
    const geometry = geometryOf(obstacle, surface);
    return geometry === null ? null : new Obstacle(geometry, colour, up);
  }

  private constructor(
    readonly geometry: BufferGeometry,
    colour: string,
    up: Vector3,
  ) {
    this.material = matter(colour, up, 1, 0.35);
    this.shadowMaterial = shadowMatter(SHADOW_FRAGMENT);
    this.solid = new Mesh(geometry, this.material);
    this.group.add(this.solid);
    this.shadow = new Mesh(geometry, this.shadowMaterial);
    this.shadow.matrixAutoUpdate = false;
  }

  pose(pose: ArrayLike<number>): void {
    this.group.position.set(pose[0], pose[1], pose[2]);
    this.group.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
    this.group.updateMatrixWorld();
    this.shadow.matrix.copy(this.group.matrixWorld);
    this.shadow.matrixWorldNeedsUpdate = true;
  }

  set colour(colour: string) {
    this.material.uniforms.colour.value = rgb(colour);
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
    this.shadowMaterial.dispose();
  }
}
