// three.js scene graph of one palpate scene: elastic objects, planes, obstacles, device markers, force arrows.

import { Color, type Object3D, Quaternion, Scene, Vector3, type Vector4, type WebGLRenderer } from "three";
import type { SceneMessage } from "../protocol/messages";
import type { DeviceFrame, Frame } from "../protocol/frame";
import type { ModeShapes, Surface } from "../protocol/surface";
import { Arrows } from "./arrows";
import { DARK, LIGHT, type ColourMode, type Palette } from "./colours";
import { ElasticMesh, FrameMismatch } from "./elastic/elastic_mesh";
import type { TextureLimits } from "./elastic/texture_layout";
import { DeviceMarker } from "./device_marker";
import { drawForces, largestForce, type Label } from "./force_arrows";
import { sphereAround, type Sphere } from "./framing";
import { GroundPlane } from "./ground_plane";
import { nearestNode, normalAtNode } from "./held_patch";
import { ObstacleMesh } from "./obstacle_mesh";
import type { DisplayRange } from "./auto_range";

const MAX_SHADOWS = 2;
const ARROW_CAPACITY = 256;
/** Depth of the grid of a scene without ground below its centre, in its radii. */
const GRID_BELOW = 1.15;

/** Static data of a scene, fetched once. */
export interface LoadedScene {
  scene: SceneMessage;
  surfaces: Surface[];
  shapes: (ModeShapes | null)[];
  obstacleSurfaces: (Surface | null)[];
}

/** Display settings of the page. */
export interface DisplaySettings {
  colour: ColourMode;
  arrows: boolean;
  contactPoints: boolean;
  wireframe: boolean;
  dark: boolean;
}

/** three.js objects of one scene. */
export class SceneGraph {
  readonly scene = new Scene();
  private readonly casters = new Scene();
  readonly info: SceneMessage;
  readonly objects: ElasticMesh[];
  readonly center: Vector3;
  readonly radius: number;
  private readonly groundPlanes = new Map<number, GroundPlane>();
  private readonly obstacles = new Map<number, ObstacleMesh>();
  /** Grid below a scene without ground; not part of it. */
  private readonly grid: GroundPlane | null;
  private readonly markers: DeviceMarker[];
  private readonly arrows = new Arrows(ARROW_CAPACITY);
  frame: Frame | null = null;
  labels: Label[] = [];
  private shadowsDirty = true;
  /** Object that each device holds, with the normal of the patch, body. */
  private readonly heldPatches: ({ object: ElasticMesh; normal: Vector3 } | null)[] = [];

  /** `forceRange` [N] and `maxArrowLength` [m]: scale of the force vectors, one for all scenes that are shown. */
  constructor(
    loaded: LoadedScene,
    limits: TextureLimits,
    onGpu: boolean,
    up: Vector3,
    readonly forceRange: DisplayRange,
    readonly maxArrowLength: number,
  ) {
    const { scene } = loaded;
    this.info = scene;
    this.center = new Vector3(...scene.view.center);
    this.radius = scene.view.radius;
    this.objects = scene.objects.map(
      (info, i) => new ElasticMesh(info, loaded.surfaces[i], loaded.shapes[i], limits, onGpu, LIGHT.objects[0], up),
    );
    let shadows = 0;
    scene.obstacles.forEach((info, i) => {
      if ("plane" in info.shape) {
        const ground = new GroundPlane(this.center, this.radius, up, shadows++ < MAX_SHADOWS);
        ground.setPose(info.pose);
        this.groundPlanes.set(i, ground);
        this.scene.add(ground.group);
        return;
      }
      const obstacle = ObstacleMesh.make(info, loaded.obstacleSurfaces[i], LIGHT.obstacle, up);
      if (obstacle === null) return;
      obstacle.setPose(info.pose);
      this.obstacles.set(i, obstacle);
      this.scene.add(obstacle.group);
      this.casters.add(obstacle.shadow);
    });
    this.grid = this.groundPlanes.size > 0 ? null : this.referenceGrid(up);
    this.markers = scene.devices.map((info) => new DeviceMarker(info, this.radius, up));
    for (const object of this.objects) {
      this.scene.add(object.group);
      this.casters.add(object.shadow);
    }
    for (const marker of this.markers) {
      this.scene.add(marker.group);
      this.casters.add(marker.shadow);
    }
    this.scene.add(this.arrows.group);
  }

  /** Faint level grid below the scene, against which motions and turns of the view are seen. */
  private referenceGrid(up: Vector3): GroundPlane {
    const grid = new GroundPlane(this.center, this.radius, up, false, true);
    const { x, y, z } = this.center.clone().addScaledVector(up, -GRID_BELOW * this.radius);
    const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), up);
    grid.setPose([x, y, z, turn.x, turn.y, turn.z, turn.w]);
    this.scene.add(grid.group);
    return grid;
  }

  /** Shows a frame; throws `FrameMismatch` without change if it belongs to another scene. */
  setFrame(frame: Frame, now: number): void {
    const { objects, obstacles, devices } = frame;
    if (objects.length !== this.objects.length) {
      throw new FrameMismatch(`${objects.length} objects for the ${this.objects.length} of the scene`);
    }
    if (obstacles.length !== this.info.obstacles.length || devices.length !== this.markers.length) {
      throw new FrameMismatch(`${obstacles.length} obstacles and ${devices.length} devices are not those of the scene`);
    }
    this.objects.forEach((object, i) => object.checkFrame(objects[i]));
    this.frame = frame;
    this.objects.forEach((object, i) => object.setFrame(objects[i]));
    obstacles.forEach((pose, i) => {
      this.groundPlanes.get(i)?.setPose(pose);
      this.obstacles.get(i)?.setPose(pose);
    });
    this.markers.forEach((marker, i) => marker.setFrame(devices[i], this.heldNormal(i, devices[i])));
    this.forceRange.update(largestForce(frame), now);
    this.shadowsDirty = true;
  }

  /** Outward normal of the patch that a device holds, world; null if it holds none. */
  private heldNormal(device: number, { mode, proxy }: DeviceFrame): Vector3 | null {
    if (mode !== "held") {
      this.heldPatches[device] = null;
      return null;
    }
    const point = new Vector3(...proxy);
    let patch = this.heldPatches[device] ?? null;
    if (patch === null) {
      let least = Infinity;
      for (const object of this.objects) {
        const { node, distance } = nearestNode(object.surface, object.group.worldToLocal(point.clone()));
        if (distance >= least) continue;
        least = distance;
        patch = { object, normal: normalAtNode(object.surface, node) };
      }
      this.heldPatches[device] = patch;
    }
    return patch === null ? null : patch.normal.clone().applyQuaternion(patch.object.group.quaternion);
  }

  /** Obstacle meshes that block picking rays. */
  get obstacleMeshes(): Object3D[] {
    return [...this.obstacles.values()].map((obstacle) => obstacle.solid);
  }

  applyTheme(settings: DisplaySettings, colourRange: number): void {
    const palette = settings.dark ? DARK : LIGHT;
    this.objects.forEach((object, i) => {
      object.setColours(settings.colour, colourRange, palette.objects[i % palette.objects.length], palette.wire);
      object.wireframe = settings.wireframe;
    });
    for (const obstacle of this.obstacles.values()) obstacle.colour = palette.obstacle;
    for (const ground of this.groundPlanes.values()) ground.applyTheme(palette);
    this.grid?.applyTheme(palette);
    for (const marker of this.markers) marker.applyTheme(palette);
    this.drawArrows(settings, palette);
  }

  private drawArrows(settings: DisplaySettings, palette: Palette): void {
    const { frame } = this;
    this.labels = [];
    this.arrows.show([], []);
    if (frame === null) return;
    const shown = this.markers.map((marker) => marker.visible);
    if (settings.arrows) {
      const drawn = drawForces(frame, shown, settings.contactPoints, this.forceRange.value, this.maxArrowLength, palette);
      this.arrows.show(drawn.arrows, drawn.dots);
      this.labels = drawn.labels;
    }
    const interfacePoint = new Color(palette.interfacePoint);
    frame.devices.forEach((device, i) => {
      if (shown[i]) this.arrows.line(new Vector3(...device.proxy), new Vector3(...device.position), 0.004 * this.radius, interfacePoint);
    });
  }

  /** Draws the render targets that the scene needs: reconstructed surfaces, shadow maps. */
  updateTargets(renderer: WebGLRenderer): void {
    for (const object of this.objects) object.reconstruct(renderer);
    if (!this.shadowsDirty) return;
    this.shadowsDirty = false;
    // Obstacles stay near the scene's centre; objects may have moved away.
    const objects = this.objectsCentre();
    const focus = objects.distanceTo(this.center) < 1.6 * this.radius ? this.center : objects;
    const setPlane = (plane: Vector4, shear: Vector3, reach: number) => {
      const materials = [...this.objects, ...this.obstacles.values(), ...this.markers].map((x) => x.shadowMaterial);
      for (const material of materials) {
        material.uniforms.plane.value = plane;
        material.uniforms.shear.value = shear;
        material.uniforms.reach.value = reach;
      }
    };
    for (const ground of this.groundPlanes.values()) ground.draw(renderer, this.casters, focus, setPlane);
  }

  /** Mean of the objects' centres of mass [m, world]. */
  objectsCentre(): Vector3 {
    const centre = new Vector3();
    if (this.objects.length === 0) return centre.copy(this.center);
    for (const object of this.objects) centre.add(object.group.position);
    return centre.divideScalar(this.objects.length);
  }

  /** Sphere around all objects as they are now; that of the scene if it has none. */
  sphereAroundObjects(): Sphere {
    if (this.objects.length === 0) return { center: this.center.clone(), radius: this.radius };
    return sphereAround(this.objects.map(({ group, info }) => ({ center: group.position, radius: info.radius })));
  }

  dispose(): void {
    for (const part of [...this.objects, ...this.groundPlanes.values(), ...this.obstacles.values(), ...this.markers]) part.dispose();
    this.grid?.dispose();
    this.arrows.dispose();
  }
}
