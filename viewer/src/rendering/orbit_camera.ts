// Orbit camera: rotates about a target, pans and zooms.

import { PerspectiveCamera, Ray, Vector3 } from "three";
import type { Vector } from "../protocol/frame";

const FIELD_OF_VIEW = 32;
const DEFAULT_AZIMUTH = 0.52;
const DEFAULT_ELEVATION = 0.36;
// Margin around the scene's bounding sphere.
const FIT_MARGIN = 1.65;
const MAX_ELEVATION = 1.5;
const MIN_ELEVATION_ABOVE_FLOOR = 0.03;

/** Camera position and target [m, world]. */
export interface Viewpoint {
  from: Vector;
  to: Vector;
}

export class OrbitCamera {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  readonly up = new Vector3(0, 1, 0);
  private readonly forward = new Vector3(0, 0, 1);
  private readonly sideways = new Vector3(1, 0, 0);
  private readonly target = new Vector3();
  private azimuth = DEFAULT_AZIMUTH;
  private elevation = DEFAULT_ELEVATION;
  private distance = 1;
  private center = new Vector3();
  private radius = 0.1;
  /** Radius of the sphere that the default distance shows. */
  private framed = 0.1;
  /** Minimum elevation [rad]; above the floor if there is one. */
  private minElevation = -MAX_ELEVATION;
  changed = true;

  /** Sets the default view of a scene: bounding sphere, direction of gravity, whether a floor limits the elevation. */
  setHome(center: Vector, radius: number, down: Vector, floor: boolean): void {
    this.center.set(...center);
    this.radius = radius;
    this.minElevation = floor ? MIN_ELEVATION_ABOVE_FLOOR : -MAX_ELEVATION;
    this.up.set(...down).negate().normalize();
    const other = Math.abs(this.up.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(0, 1, 0);
    this.sideways.crossVectors(this.up, other).normalize();
    this.forward.crossVectors(this.sideways, this.up).normalize();
    this.reset();
  }

  /** Returns to the default view, optionally of another sphere. */
  reset(center = this.center, radius = this.radius): void {
    this.target.copy(center);
    this.framed = radius;
    this.azimuth = DEFAULT_AZIMUTH;
    this.elevation = DEFAULT_ELEVATION;
    this.distance = this.fitDistance();
    this.update();
  }

  /** Sets camera position and target [m, world]. */
  lookFrom(from: Vector, to: Vector): void {
    this.target.set(...to);
    const out = new Vector3(...from).sub(this.target);
    this.distance = Math.max(out.length(), 1e-6);
    out.divideScalar(this.distance);
    this.elevation = Math.asin(Math.min(1, Math.max(-1, out.dot(this.up))));
    this.azimuth = Math.atan2(out.dot(this.sideways), out.dot(this.forward));
    this.update();
  }

  /** Turns about a sphere from the present direction, and shows all of it. */
  follow(center: Vector3, radius: number): void {
    if (this.target.equals(center) && radius <= this.framed) return;
    this.target.copy(center);
    if (radius > this.framed) {
      this.framed = radius;
      this.distance = Math.max(this.distance, this.fitDistance());
    }
    this.update();
  }

  private fitDistance(aspect = this.camera.aspect): number {
    const half = (FIELD_OF_VIEW * Math.PI) / 360;
    const across = Math.atan(Math.tan(half) * Math.min(1, aspect));
    return (this.framed / Math.sin(across)) * FIT_MARGIN;
  }

  /** Whether the view is that of `reset`. */
  get isHome(): boolean {
    const fit = this.fitDistance();
    return this.target.equals(this.center) && this.azimuth === DEFAULT_AZIMUTH && this.elevation === DEFAULT_ELEVATION && Math.abs(this.distance - fit) < 1e-6 * fit;
  }

  /** Viewpoint from which a window at least as wide as high shows what this one shows. */
  get viewpoint(): Viewpoint {
    const share = this.fitDistance(1) / this.fitDistance();
    const from = this.camera.position.clone().sub(this.target).multiplyScalar(share).add(this.target);
    return { from: from.toArray(), to: this.target.toArray() };
  }

  /** Shows what a window at least as wide as high shows from a viewpoint, within the limits of zoom and elevation. */
  look({ from, to }: Viewpoint): void {
    this.lookFrom(from, to);
    this.zoom(this.fitDistance() / this.fitDistance(1));
    this.rotate(0, 0);
  }

  resize(aspect: number): void {
    if (!(aspect > 0) || aspect === this.camera.aspect) return;
    const before = this.fitDistance();
    this.camera.aspect = aspect;
    this.distance *= this.fitDistance() / before;
    this.update();
  }

  /** Rotates by angles [rad]. */
  rotate(right: number, down: number): void {
    this.azimuth -= right;
    this.elevation = Math.min(MAX_ELEVATION, Math.max(this.minElevation, this.elevation + down));
    this.update();
  }

  /** Pans by fractions of the view height. */
  pan(right: number, down: number): void {
    const height = this.viewHeightAt(this.distance);
    const m = this.camera.matrixWorld.elements;
    this.target.addScaledVector(new Vector3(m[0], m[1], m[2]), -right * height);
    this.target.addScaledVector(new Vector3(m[4], m[5], m[6]), down * height);
    this.update();
  }

  zoom(factor: number): void {
    this.distance = Math.min(Math.max(60 * this.radius, 4 * this.framed), Math.max(0.15 * this.radius, this.distance * factor));
    this.update();
  }

  /** Height of the visible region at a distance [m]. */
  viewHeightAt(distance: number): number {
    return 2 * distance * Math.tan((this.camera.fov * Math.PI) / 360);
  }

  get viewDirection(): Vector3 {
    return this.camera.getWorldDirection(new Vector3());
  }

  /** World ray through normalised device coordinates. */
  ray(x: number, y: number): Ray {
    const origin = this.camera.position.clone();
    const direction = new Vector3(x, y, 0.5).unproject(this.camera).sub(origin).normalize();
    return new Ray(origin, direction);
  }

  private update(): void {
    const level = Math.cos(this.elevation);
    this.camera.position
      .copy(this.target)
      .addScaledVector(this.forward, this.distance * level * Math.cos(this.azimuth))
      .addScaledVector(this.sideways, this.distance * level * Math.sin(this.azimuth))
      .addScaledVector(this.up, this.distance * Math.sin(this.elevation));
    this.camera.up.copy(this.up);
    this.camera.near = Math.max(this.distance * 0.02, this.radius * 1e-3);
    this.camera.far = this.distance + Math.max(80 * this.radius, 2 * this.framed);
    this.camera.lookAt(this.target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.changed = true;
  }
}
