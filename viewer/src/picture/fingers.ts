// Devices: where the hand is (interface point), its double that stays outside (proxy), and a thin line between.

import { Group, Mesh, SphereGeometry, type RawShaderMaterial, Vector3 } from "three";
import type { SceneDevice } from "../protocol/messages";
import type { DevicePicture } from "../protocol/picture";
import { rgb, type Palette } from "./colours";
import { SHADOW_FRAGMENT } from "./elastic/shaders";
import { matter, shadowMatter } from "./matter";

export class Finger {
  readonly group = new Group();
  readonly shadow: Mesh;
  readonly shadowMaterial: RawShaderMaterial;
  readonly radius: number;
  private readonly ball: SphereGeometry;
  private readonly proxy: Mesh;
  private readonly hand: Mesh;
  private readonly proxyMaterial: RawShaderMaterial;
  private readonly handMaterial: RawShaderMaterial;
  shown = false;

  constructor(
    readonly info: SceneDevice,
    viewRadius: number,
    up: Vector3,
  ) {
    // A tip without a size is drawn as a small ball.
    this.radius = Math.max(info.tip_radius, 0.008 * viewRadius);
    this.ball = new SphereGeometry(1, 32, 20);
    this.proxyMaterial = matter("#2f6fd0", up, 1, 0.8);
    this.handMaterial = matter("#2f6fd0", up, 0.45, 0);
    this.handMaterial.depthTest = false;
    this.shadowMaterial = shadowMatter(SHADOW_FRAGMENT);
    this.proxy = new Mesh(this.ball, this.proxyMaterial);
    this.hand = new Mesh(this.ball, this.handMaterial);
    this.hand.renderOrder = 5;
    this.shadow = new Mesh(this.ball, this.shadowMaterial);
    this.group.add(this.proxy, this.hand);
    this.hide();
  }

  private hide(): void {
    this.group.visible = this.shadow.visible = this.shown = false;
  }

  show(picture: DevicePicture): void {
    // A pointer's finger that is away is nowhere; another device hovers.
    if (picture.doing === "away" && this.info.pointer) {
      this.hide();
      return;
    }
    this.group.visible = this.shadow.visible = this.shown = true;
    const size = picture.doing === "holds" ? 0.6 * this.radius : this.radius;
    this.proxy.position.set(...picture.proxy);
    this.proxy.scale.setScalar(size);
    this.hand.position.set(...picture.position);
    this.hand.scale.setScalar(0.32 * this.radius);
    this.hand.visible = this.hand.position.distanceTo(this.proxy.position) > 0.15 * this.radius;
    this.shadow.position.copy(this.proxy.position);
    this.shadow.scale.setScalar(size);
  }

  dress(palette: Palette): void {
    this.proxyMaterial.uniforms.colour.value = rgb(palette.proxy);
    this.handMaterial.uniforms.colour.value = rgb(palette.hand);
  }

  dispose(): void {
    this.ball.dispose();
    for (const material of [this.proxyMaterial, this.handMaterial, this.shadowMaterial]) material.dispose();
  }
}
