// A camera that looks at a point, is turned about it, moved along the picture, and brought nearer.

import { PerspectiveCamera, Ray, Vector3 } from "three";
import type { Vector } from "../protocol/picture";

const FIELD_OF_VIEW = 32;
const FIRST_AZIMUTH = 0.52;
const FIRST_ELEVATION = 0.36;
// How much more than the scene the picture holds: things move.
const AROUND = 1.65;
const STEEPEST = 1.5;
const LOWEST_ABOVE_FLOOR = 0.03;

export class OrbitCamera {
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  readonly up = new Vector3(0, 1, 0);
  private readonly ahead = new Vector3(0, 0, 1);
  private readonly aside = new Vector3(1, 0, 0);
  private readonly target = new Vector3();
  private azimuth = FIRST_AZIMUTH;
  private elevation = FIRST_ELEVATION;
  private distance = 1;
  private center = new Vector3();
  private radius = 0.1;
  /** How steeply it may look up [rad]: less where there is a floor. */
  private lowest = -STEEPEST;
  changed = true;

  /** The usual view of a scene; up is against gravity. Above a floor it does not go below it. */
  look(center: Vector, radius: number, gravity: Vector, floor: boolean): void {
    this.center.set(...center);
    this.radius = radius;
    this.lowest = floor ? LOWEST_ABOVE_FLOOR : -STEEPEST;
    const up = new Vector3(...gravity).negate();
    if (up.lengthSq() < 1e-12) up.set(0, 1, 0);
    this.up.copy(up.normalize());
    const other = Math.abs(this.up.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(0, 1, 0);
    this.aside.crossVectors(this.up, other).normalize();
    this.ahead.crossVectors(this.aside, this.up).normalize();
    this.home();
  }

  /** The usual view, of another place if that is where things are now. */
  home(center = this.center): void {
    this.target.copy(center);
    this.azimuth = FIRST_AZIMUTH;
    this.elevation = FIRST_ELEVATION;
    this.distance = this.fitting();
    this.update();
  }

  /** Looks from a place at a place, as `palpate render --from --to` asks. */
  stand(from: Vector, to: Vector): void {
    this.target.set(...to);
    const out = new Vector3(...from).sub(this.target);
    this.distance = Math.max(out.length(), 1e-6);
    out.divideScalar(this.distance);
    this.elevation = Math.asin(Math.min(1, Math.max(-1, out.dot(this.up))));
    this.azimuth = Math.atan2(out.dot(this.aside), out.dot(this.ahead));
    this.update();
  }

  private fitting(): number {
    const half = (FIELD_OF_VIEW * Math.PI) / 360;
    const across = Math.atan(Math.tan(half) * Math.min(1, this.camera.aspect));
    return (this.radius / Math.sin(across)) * AROUND;
  }

  resize(aspect: number): void {
    if (!(aspect > 0) || aspect === this.camera.aspect) return;
    const before = this.fitting();
    this.camera.aspect = aspect;
    this.distance *= this.fitting() / before;
    this.update();
  }

  /** Radians. */
  turn(right: number, down: number): void {
    this.azimuth -= right;
    this.elevation = Math.min(STEEPEST, Math.max(this.lowest, this.elevation + down));
    this.update();
  }

  /** In heights of the picture. */
  pan(right: number, down: number): void {
    const height = this.heightAt(this.distance);
    const m = this.camera.matrixWorld.elements;
    this.target.addScaledVector(new Vector3(m[0], m[1], m[2]), -right * height);
    this.target.addScaledVector(new Vector3(m[4], m[5], m[6]), down * height);
    this.update();
  }

  zoom(factor: number): void {
    this.distance = Math.min(60 * this.radius, Math.max(0.15 * this.radius, this.distance * factor));
    this.update();
  }

  /** How much of the world fits into the height of the picture at this distance [m]. */
  heightAt(distance: number): number {
    return 2 * distance * Math.tan((this.camera.fov * Math.PI) / 360);
  }

  get looksAlong(): Vector3 {
    return this.camera.getWorldDirection(new Vector3());
  }

  /** The ray of a point of the picture, −1…1 to the right and up. */
  ray(x: number, y: number): Ray {
    const origin = this.camera.position.clone();
    const direction = new Vector3(x, y, 0.5).unproject(this.camera).sub(origin).normalize();
    return new Ray(origin, direction);
  }

  private update(): void {
    const level = Math.cos(this.elevation);
    this.camera.position
      .copy(this.target)
      .addScaledVector(this.ahead, this.distance * level * Math.cos(this.azimuth))
      .addScaledVector(this.aside, this.distance * level * Math.sin(this.azimuth))
      .addScaledVector(this.up, this.distance * Math.sin(this.elevation));
    this.camera.up.copy(this.up);
    this.camera.near = Math.max(this.distance * 0.02, this.radius * 1e-3);
    this.camera.far = this.distance + 80 * this.radius;
    this.camera.lookAt(this.target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.changed = true;
  }
}
