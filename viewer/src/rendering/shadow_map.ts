// Shadow map of a plane: orthographic view of the casters from below, blurred.

import {
  BufferAttribute,
  BufferGeometry,
  Camera,
  GLSL3,
  LinearFilter,
  Matrix4,
  Mesh,
  OrthographicCamera,
  RawShaderMaterial,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderTarget,
  type WebGLRenderer,
} from "three";
import { FULL_SCREEN_VERTEX } from "./elastic/shaders";

const SHADOW_SIZE = 384;

const BLUR = /* glsl */ `
precision highp float;
precision highp sampler2D;
uniform sampler2D from;
uniform vec2 along;
out vec4 pixel;
void main() {
  vec2 at = gl_FragCoord.xy / ${SHADOW_SIZE}.0;
  float sum = 0.0, weights = 0.0;
  for (int i = -7; i <= 7; i++) {
    float w = exp(-0.045 * float(i * i));
    sum += w * texture(from, at + float(i) * along).r;
    weights += w;
  }
  pixel = vec4(sum / weights);
}`;

/** Orthographic shadow map of the casters above a plane, blurred. */
export class ShadowMap {
  readonly result = ShadowMap.target();
  private readonly intermediate = ShadowMap.target();
  private readonly camera = new OrthographicCamera();
  /** Shadow clip coordinates from world. */
  readonly fromWorld = new Matrix4();
  private readonly blur: RawShaderMaterial;
  private readonly blurScene = new Scene();
  private readonly noCamera = new Camera();

  private static target(): WebGLRenderTarget {
    return new WebGLRenderTarget(SHADOW_SIZE, SHADOW_SIZE, { minFilter: LinearFilter, magFilter: LinearFilter, generateMipmaps: false });
  }

  constructor() {
    this.blur = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: FULL_SCREEN_VERTEX,
      fragmentShader: BLUR,
      uniforms: { from: { value: null }, along: { value: new Vector2() } },
      depthTest: false,
      depthWrite: false,
    });
    const geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(new Uint16Array([0, 1, 2]), 1));
    const mesh = new Mesh(geometry, this.blur);
    mesh.frustumCulled = false;
    this.blurScene.add(mesh);
  }

  /** Draws and blurs the map: `size` is its half width [m], `height` the depth range [m]. */
  draw(renderer: WebGLRenderer, casters: Scene, center: Vector3, normal: Vector3, up: Vector3, size: number, height: number): void {
    const camera = this.camera;
    camera.left = camera.bottom = -size;
    camera.right = camera.top = size;
    camera.near = 0;
    camera.far = 1.1 * height;
    camera.position.copy(center).addScaledVector(normal, -0.1 * height);
    camera.up.copy(up);
    camera.lookAt(center.clone().add(normal));
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.fromWorld.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const previousTarget = renderer.getRenderTarget();
    const clearAlpha = renderer.getClearAlpha();
    renderer.setClearAlpha(0);
    const background = casters.background;
    casters.background = null;
    renderer.setRenderTarget(this.result);
    renderer.clear();
    renderer.render(casters, camera);
    for (const [from, to, x, y] of [
      [this.result, this.intermediate, 1, 0],
      [this.intermediate, this.result, 0, 1],
    ] as const) {
      this.blur.uniforms.from.value = from.texture;
      (this.blur.uniforms.along.value as Vector2).set(x / SHADOW_SIZE, y / SHADOW_SIZE);
      renderer.setRenderTarget(to);
      renderer.render(this.blurScene, this.noCamera);
    }
    casters.background = background;
    renderer.setClearAlpha(clearAlpha);
    renderer.setRenderTarget(previousTarget);
  }

  dispose(): void {
    this.result.dispose();
    this.intermediate.dispose();
    this.blur.dispose();
  }
}
