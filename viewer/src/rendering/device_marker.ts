// Marker of a device: a sphere at the proxy and a dot at the interface point.

import { Group, Mesh, SphereGeometry, type RawShaderMaterial, Vector3 } from "three";
import type { SceneDevice } from "../protocol/messages";
import type { DeviceFrame } from "../protocol/frame";
import { rgb, type Palette } from "./colours";
import { SHADOW_FRAGMENT } from "./elastic/shaders";
import { rigidMaterial, shadowCasterMaterial } from "./rigid_material";

export class DeviceMarker {
  readonly group = new Group();
  readonly shadow: Mesh;
  readonly shadowMaterial: RawShaderMaterial;
  readonly radius: number;
  private readonly sphere: SphereGeometry;
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
    this.proxyMaterial = rigidMaterial("#2f6fd0", up, 1, 0.8);
    this.interfacePointMaterial = rigidMaterial("#2f6fd0", up, 0.45, 0);
    this.interfacePointMaterial.depthTest = false;
    this.shadowMaterial = shadowCasterMaterial(SHADOW_FRAGMENT);
    this.proxy = new Mesh(this.sphere, this.proxyMaterial);
    this.interfacePoint = new Mesh(this.sphere, this.interfacePointMaterial);
    this.interfacePoint.renderOrder = 5;
    this.shadow = new Mesh(this.sphere, this.shadowMaterial);
    this.group.add(this.proxy, this.interfacePoint);
    this.hide();
  }

  private hide(): void {
    this.group.visible = this.shadow.visible = this.visible = false;
  }

  setFrame(frame: DeviceFrame): void {
    // An inactive pointer has no position; other inactive devices hover.
    if (frame.mode === "inactive" && this.info.pointer) {
      this.hide();
      return;
    }
    this.group.visible = this.shadow.visible = this.visible = true;
    const size = frame.mode === "held" ? 0.6 * this.radius : this.radius;
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
    for (const material of [this.proxyMaterial, this.interfacePointMaterial, this.shadowMaterial]) material.dispose();
  }
}
