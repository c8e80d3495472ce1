// What is drawn of one scene: elastic objects, planes, obstacles, fingers, arrows.

import { Color, type Object3D, Scene, Vector3, type Vector4, type WebGLRenderer } from "three";
import type { SceneMessage } from "../protocol/messages";
import type { Picture } from "../protocol/picture";
import type { Shapes, Surface } from "../protocol/surface";
import { Arrows } from "./arrows";
import { DARK, LIGHT, type ColourMode, type Palette } from "./colours";
import { ElasticObject, PictureDoesNotFit } from "./elastic/object";
import type { Limits } from "./elastic/layout";
import { Finger } from "./fingers";
import { drawForces, largestForce, type Label } from "./forces";
import { Ground } from "./ground";
import { Obstacle } from "./obstacles";
import { CalmRange } from "./scale";

const MOST_SHADOWS = 2;
const ARROW_CAPACITY = 256;

export interface Loaded {
  scene: SceneMessage;
  surfaces: Surface[];
  shapes: (Shapes | null)[];
  obstacleSurfaces: (Surface | null)[];
}

export interface Look {
  colour: ColourMode;
  arrows: boolean;
  wires: boolean;
  dark: boolean;
}

export class World {
  readonly scene = new Scene();
  private readonly casters = new Scene();
  readonly info: SceneMessage;
  readonly objects: ElasticObject[];
  readonly center: Vector3;
  readonly radius: number;
  private readonly grounds = new Map<number, Ground>();
  private readonly obstacles = new Map<number, Obstacle>();
  private readonly fingers: Finger[];
  private readonly arrows = new Arrows(ARROW_CAPACITY);
  readonly forceRange = new CalmRange(0.02);
  picture: Picture | null = null;
  labels: Label[] = [];
  private shadowsStale = true;

  constructor(loaded: Loaded, limits: Limits, onGpu: boolean, up: Vector3) {
    const { scene } = loaded;
    this.info = scene;
    this.center = new Vector3(...scene.view.center);
    this.radius = scene.view.radius;
    this.objects = scene.objects.map(
      (info, i) => new ElasticObject(info, loaded.surfaces[i], loaded.shapes[i], limits, onGpu, LIGHT.objects[0], up),
    );
    let shadows = 0;
    scene.obstacles.forEach((info, i) => {
      if ("plane" in info.shape) {
        const ground = new Ground(this.center, this.radius, shadows++ < MOST_SHADOWS);
        ground.pose(info.pose);
        this.grounds.set(i, ground);
        this.scene.add(ground.group);
        return;
      }
      const obstacle = Obstacle.make(info, loaded.obstacleSurfaces[i], LIGHT.obstacle, up);
      if (obstacle === null) return;
      obstacle.pose(info.pose);
      this.obstacles.set(i, obstacle);
      this.scene.add(obstacle.group);
      this.casters.add(obstacle.shadow);
    });
    this.fingers = scene.devices.map((info) => new Finger(info, this.radius, up));
    for (const object of this.objects) {
      this.scene.add(object.group);
      this.casters.add(object.shadow);
    }
    for (const finger of this.fingers) {
      this.scene.add(finger.group);
      this.casters.add(finger.shadow);
    }
    this.scene.add(this.arrows.group);
  }

  /** Takes a picture; throws `PictureDoesNotFit` if it is of another scene, and then changes nothing. */
  show(picture: Picture, now: number): void {
    const { objects, obstacles, devices } = picture;
    if (objects.length !== this.objects.length) {
      throw new PictureDoesNotFit(`${objects.length} objects for the ${this.objects.length} of the scene`);
    }
    if (obstacles.length !== this.info.obstacles.length || devices.length !== this.fingers.length) {
      throw new PictureDoesNotFit(`${obstacles.length} obstacles and ${devices.length} devices are not those of the scene`);
    }
    this.objects.forEach((object, i) => object.check(objects[i]));
    this.picture = picture;
    this.objects.forEach((object, i) => object.show(objects[i]));
    obstacles.forEach((pose, i) => {
      this.grounds.get(i)?.pose(pose);
      this.obstacles.get(i)?.pose(pose);
    });
    this.fingers.forEach((finger, i) => finger.show(devices[i]));
    this.forceRange.take(largestForce(picture), now);
    this.shadowsStale = true;
  }

  /** What a ray cannot pass. */
  get rigidMeshes(): Object3D[] {
    return [...this.obstacles.values()].map((obstacle) => obstacle.solid);
  }

  /** How long an arrow of the whole range is [m]. */
  get longestArrow(): number {
    return 0.7 * this.radius;
  }

  dress(look: Look, colourRange: number): void {
    const palette = look.dark ? DARK : LIGHT;
    this.objects.forEach((object, i) => {
      object.colour(look.colour, colourRange, palette.objects[i % palette.objects.length], palette.wire);
      object.wired = look.wires;
    });
    for (const obstacle of this.obstacles.values()) obstacle.colour = palette.obstacle;
    for (const ground of this.grounds.values()) ground.dress(palette);
    for (const finger of this.fingers) finger.dress(palette);
    this.drawArrows(look, palette);
  }

  private drawArrows(look: Look, palette: Palette): void {
    const { picture } = this;
    this.labels = [];
    this.arrows.show([], []);
    if (picture === null) return;
    const shown = this.fingers.map((finger) => finger.shown);
    if (look.arrows) {
      const drawn = drawForces(picture, shown, this.forceRange.value, this.longestArrow, palette);
      this.arrows.show(drawn.arrows, drawn.dots);
      this.labels = drawn.labels;
    }
    const hand = new Color(palette.hand);
    picture.devices.forEach((device, i) => {
      if (shown[i]) this.arrows.line(new Vector3(...device.proxy), new Vector3(...device.position), 0.004 * this.radius, hand);
    });
  }

  /** What has to be drawn before the scene itself: surfaces, shadows. */
  prepare(renderer: WebGLRenderer): void {
    for (const object of this.objects) object.reconstruct(renderer);
    if (!this.shadowsStale) return;
    this.shadowsStale = false;
    // Obstacles stay where the view is; objects may have gone.
    const objects = this.middleOfObjects();
    const around = objects.distanceTo(this.center) < 1.6 * this.radius ? this.center : objects;
    const setPlane = (plane: Vector4, shear: Vector3, reach: number) => {
      const materials = [...this.objects, ...this.obstacles.values(), ...this.fingers].map((x) => x.shadowMaterial);
      for (const material of materials) {
        material.uniforms.plane.value = plane;
        material.uniforms.shear.value = shear;
        material.uniforms.reach.value = reach;
      }
    };
    for (const ground of this.grounds.values()) ground.draw(renderer, this.casters, around, setPlane);
  }

  middleOfObjects(): Vector3 {
    const middle = new Vector3();
    if (this.objects.length === 0) return middle.copy(this.center);
    for (const object of this.objects) middle.add(object.group.position);
    return middle.divideScalar(this.objects.length);
  }

  dispose(): void {
    for (const made of [...this.objects, ...this.grounds.values(), ...this.obstacles.values(), ...this.fingers]) made.dispose();
    this.arrows.dispose();
  }
}
