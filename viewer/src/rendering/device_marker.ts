// Marker of a device: a sphere at the proxy, or a disc on the patch that it holds, and a dot at the interface point.

import { CylinderGeometry, Group, Mesh, SphereGeometry, type RawShaderMaterial, Vector3 } from "three";
import type { SceneDevice } from "../protocol/messages";
import type { DeviceFrame } from "../protocol/frame";
import { rgb, type Palette } from "./colours";
import { SHADOW_FRAGMENT } from "./elastic/shaders";
import { rigidMaterial, shadowCasterMaterial } from "./rigid_material";

/** Thickness of the disc on a held patch, in radii of the tip. */
const DISC_THICKNESS = 0.3;
const UP = new Vector3(0, 1, 0);

export class DeviceMarker {
  readonly group = new Group();
  readonly shadow: Mesh;
  readonly shadowMaterial: RawShaderMaterial;
  readonly radius: number;
  private readonly sphere: SphereGeometry;
  private readonly cylinder: CylinderGeometry;
  /** Disc on the patch that the device holds. */
  readonly disc: Mesh;
  private readonly proxy: Mesh;
  private readonly interfacePoint: Mesh;
  private readonly proxyMaterial: RawShaderMaterial;
  private readonly interfacePointMaterial: RawShaderMaterial;
  visible = false;

  constructor(
    readonly info: SceneDevice,
    viewRadius: number,
    up: Vector3,
  ) {
    // A tip without a size is drawn as a small sphere.
    this.radius = Math.max(info.tip_radius, 0.008 * viewRadius);
    this.sphere = new SphereGeometry(1, 32, 20);
    const patch = Math.max(info.patch_radius, 1.2 * this.radius);
    this.cylinder = new CylinderGeometry(patch, patch, DISC_THICKNESS * this.radius, 40, 1);
    this.proxyMaterial = rigidMaterial("#2f6fd0", up, 1, 0.8);
    this.interfacePointMaterial = rigidMaterial("#2f6fd0", up, 0.45, 0);
    this.interfacePointMaterial.depthTest = false;
    this.shadowMaterial = shadowCasterMaterial(SHADOW_FRAGMENT);
    this.proxy = new Mesh(this.sphere, this.proxyMaterial);
    this.disc = new Mesh(this.cylinder, this.proxyMaterial);
    this.interfacePoint = new Mesh(this.sphere, this.interfacePointMaterial);
    this.interfacePoint.renderOrder = 5;
    this.shadow = new Mesh(this.sphere, this.shadowMaterial);
    this.group.add(this.proxy, this.disc, this.interfacePoint);
    this.hide();
  }

  private hide(): void {
    this.group.visible = this.shadow.visible = this.visible = false;
  }

  /** Shows a device; `normal`: outward normal of the surface that it holds, world. */
  setFrame(frame: DeviceFrame, normal: Vector3 | null): void {
    // An inactive pointer has no position; other inactive devices hover.
    if (frame.mode === "inactive" && this.info.pointer) {
      this.hide();
      return;
    }
    this.group.visible = this.shadow.visible = this.visible = true;
    const size = normal === null ? this.radius : 0.6 * this.radius;
    this.disc.visible = normal !== null;
    this.proxy.visible = normal === null;
    if (normal !== null) {
      this.disc.quaternion.setFromUnitVectors(UP, normal);
      this.disc.position.set(...frame.proxy).addScaledVector(normal, 0.4 * DISC_THICKNESS * this.radius);
    }
    this.proxy.position.set(...frame.proxy);
    this.proxy.scale.setScalar(size);
    this.interfacePoint.position.set(...frame.position);
    this.interfacePoint.scale.setScalar(0.32 * this.radius);
    this.interfacePoint.visible = this.interfacePoint.position.distanceTo(this.proxy.position) > 0.15 * this.radius;
    this.shadow.position.copy(this.proxy.position);
    this.shadow.scale.setScalar(size);
  }

  applyTheme(palette: Palette): void {
    this.proxyMaterial.uniforms.colour.value = rgb(palette.proxy);
    this.interfacePointMaterial.uniforms.colour.value = rgb(palette.interfacePoint);
  }

  dispose(): void {
    this.sphere.dispose();
    this.cylinder.dispose();
    for (const material of [this.proxyMaterial, this.interfacePointMaterial, this.shadowMaterial]) material.dispose();
  }
}
