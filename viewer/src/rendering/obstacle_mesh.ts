// Meshes of rigid obstacles: spheres, boxes, capsules, triangle meshes.

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
import { splitAtCreases } from "./elastic/split_mesh";
import { vertexNormals } from "./elastic/cpu_reconstruction";
import { SHADOW_FRAGMENT } from "./elastic/shaders";
import { rigidMaterial, shadowCasterMaterial } from "./rigid_material";

/** Geometry of a triangle mesh with vertices split at creases. */
export function meshGeometry(surface: Surface): BufferGeometry {
  const splitMesh = splitAtCreases(surface);
  const numbers = new Float32Array(4 * splitMesh.vertices);
  vertexNormals(surface, splitMesh, surface.positions, numbers);
  const [positions, normals] = [new Float32Array(3 * splitMesh.vertices), new Float32Array(3 * splitMesh.vertices)];
  for (let v = 0; v < splitMesh.vertices; v++) {
    for (let k = 0; k < 3; k++) {
      positions[3 * v + k] = surface.positions[3 * splitMesh.node[v] + k];
      normals[3 * v + k] = numbers[4 * v + k];
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.setIndex(new BufferAttribute(splitMesh.indices, 1));
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

export class ObstacleMesh {
  readonly group = new Group();
  readonly solid: Mesh;
  readonly shadow: Mesh;
  readonly shadowMaterial: RawShaderMaterial;
  private readonly material: RawShaderMaterial;

  /** Null for planes (drawn by `GroundPlane`) and unknown shapes. */
  static make(obstacle: SceneObstacle, surface: Surface | null, colour: string, up: Vector3): ObstacleMesh | null {
    const geometry = geometryOf(obstacle, surface);
    return geometry === null ? null : new ObstacleMesh(geometry, colour, up);
  }

  private constructor(
    readonly geometry: BufferGeometry,
    colour: string,
    up: Vector3,
  ) {
    this.material = rigidMaterial(colour, up, 1, 0.35);
    this.shadowMaterial = shadowCasterMaterial(SHADOW_FRAGMENT);
    this.solid = new Mesh(geometry, this.material);
    this.group.add(this.solid);
    this.shadow = new Mesh(geometry, this.shadowMaterial);
    this.shadow.matrixAutoUpdate = false;
  }

  setPose(pose: ArrayLike<number>): void {
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
