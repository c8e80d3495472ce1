// Instanced arrows, lines and dots; occluded parts are drawn faintly.

import {
  Color,
  ConeGeometry,
  CylinderGeometry,
  DynamicDrawUsage,
  GreaterDepth,
  Group,
  InstancedMesh,
  Matrix4,
  MeshBasicMaterial,
  Quaternion,
  SphereGeometry,
  Vector3,
  type BufferGeometry,
} from "three";

export interface Arrow {
  from: Vector3;
  to: Vector3;
  colour: Color;
  /** Shaft radius [m]. */
  radius: number;
}

const UP = new Vector3(0, 1, 0);
const HEAD_LENGTH = 6.5;
const HEAD_RADIUS = 2.6;

/** Instanced mesh of up to `capacity` copies, drawn twice: visible parts and occluded parts. */
class InstancedCopies {
  readonly group = new Group();
  private readonly meshes: InstancedMesh[];
  private used = 0;

  constructor(
    private readonly geometry: BufferGeometry,
    private readonly capacity: number,
    occludedOpacity: number,
  ) {
    const front = new MeshBasicMaterial({ color: 0xffffff });
    const behind = new MeshBasicMaterial({
      color: 0xffffff,
      transparent: true,
      opacity: occludedOpacity,
      depthFunc: GreaterDepth,
      depthWrite: false,
    });
    this.meshes = [front, behind].map((material, i) => {
      const mesh = new InstancedMesh(geometry, material, capacity);
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      mesh.frustumCulled = false;
      mesh.renderOrder = 4 + i;
      this.group.add(mesh);
      return mesh;
    });
    // Occluded parts first: visible ones are drawn over them.
    this.meshes[1].renderOrder = 2;
  }

  begin(): void {
    this.used = 0;
  }

  add(matrix: Matrix4, colour: Color): void {
    if (this.used === this.capacity) return;
    for (const mesh of this.meshes) {
      mesh.setMatrixAt(this.used, matrix);
      mesh.setColorAt(this.used, colour);
    }
    this.used++;
  }

  end(): void {
    for (const mesh of this.meshes) {
      mesh.count = this.used;
      mesh.visible = this.used > 0;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor !== null) mesh.instanceColor.needsUpdate = true;
    }
  }

  dispose(): void {
    this.geometry.dispose();
    for (const mesh of this.meshes) {
      mesh.dispose();
      (mesh.material as MeshBasicMaterial).dispose();
    }
  }
}

export class Arrows {
  readonly group = new Group();
  private readonly shafts: InstancedCopies;
  private readonly heads: InstancedCopies;
  private readonly dots: InstancedCopies;
  private readonly matrix = new Matrix4();
  private readonly turn = new Quaternion();
  private readonly along = new Vector3();
  private readonly size = new Vector3();

  constructor(capacity: number) {
    const shaft = new CylinderGeometry(1, 1, 1, 14, 1).translate(0, 0.5, 0);
    const head = new ConeGeometry(1, 1, 20, 1).translate(0, 0.5, 0);
    this.shafts = new InstancedCopies(shaft, capacity, 0.38);
    this.heads = new InstancedCopies(head, capacity, 0.38);
    this.dots = new InstancedCopies(new SphereGeometry(1, 12, 8), capacity, 0.25);
    for (const copies of [this.shafts, this.heads, this.dots]) this.group.add(copies.group);
  }

  show(arrows: readonly Arrow[], dots: readonly { at: Vector3; colour: Color; radius: number }[]): void {
    for (const copies of [this.shafts, this.heads, this.dots]) copies.begin();
    for (const { from, to, colour, radius } of arrows) {
      const length = this.along.subVectors(to, from).length();
      if (!(length > 0)) continue;
      this.turn.setFromUnitVectors(UP, this.along.divideScalar(length));
      const head = Math.min(HEAD_LENGTH * radius, 0.6 * length);
      this.add(this.shafts, from, radius, length - 0.8 * head, colour);
      const neck = from.clone().addScaledVector(this.along, length - head);
      this.add(this.heads, neck, (HEAD_RADIUS * head) / HEAD_LENGTH, head, colour);
    }
    this.turn.identity();
    for (const { at, colour, radius } of dots) this.add(this.dots, at, radius, radius, colour);
    for (const copies of [this.shafts, this.heads, this.dots]) copies.end();
  }

  /** Adds a line without head. */
  line(from: Vector3, to: Vector3, radius: number, colour: Color): void {
    const length = this.along.subVectors(to, from).length();
    if (!(length > 0)) return;
    this.turn.setFromUnitVectors(UP, this.along.divideScalar(length));
    this.add(this.shafts, from, radius, length, colour);
    this.shafts.end();
  }

  private add(copies: InstancedCopies, at: Vector3, radius: number, length: number, colour: Color): void {
    copies.add(this.matrix.compose(at, this.turn, this.size.set(radius, length, radius)), colour);
  }

  dispose(): void {
    for (const copies of [this.shafts, this.heads, this.dots]) copies.dispose();
  }
}
