// Planes: a soft grid that fades out, and the shadow of what is above, so that a fall can be read.

import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  Camera,
  FrontSide,
  GLSL3,
  Group,
  LinearFilter,
  Matrix4,
  Mesh,
  OrthographicCamera,
  PlaneGeometry,
  RawShaderMaterial,
  Scene,
  Vector2,
  Vector3,
  Vector4,
  WebGLRenderTarget,
  type WebGLRenderer,
} from "three";
import { rgb, type Palette } from "./colours";
import { WHOLE_TARGET } from "./elastic/shaders";
import { niceAbove } from "./scale";

const SHADOW_SIZE = 384;
// The light comes from the front left: shadows fall to the back right, by so much per height.
const SHEAR_ASIDE = 0.38;
const SHEAR_BACK = 0.3;

const VERTEX = /* glsl */ `
precision highp float;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
in vec3 position;
out vec3 seenAt;
out vec2 onPlane;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  seenAt = world.xyz;
  onPlane = position.xz;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

const FRAGMENT = /* glsl */ `
precision highp float;
precision highp sampler2D;
uniform vec3 ground;
uniform vec3 grid;
uniform float cell;
uniform vec2 middle;
uniform float reach;
uniform sampler2D shadow;
uniform mat4 shadowFromWorld;
uniform float darkness;
uniform float behind;         // 1: seen from its back
in vec3 seenAt;
in vec2 onPlane;
out vec4 pixel;
float lines(float size, float width) {
  vec2 at = onPlane / size;
  vec2 blur = fwidth(at);
  vec2 near = abs(fract(at - 0.5) - 0.5) / max(blur, vec2(1e-6));
  float dense = clamp(1.0 - 2.5 * max(blur.x, blur.y), 0.0, 1.0);
  return (1.0 - smoothstep(width - 0.5, width + 0.5, min(near.x, near.y))) * dense;
}
void main() {
  float away = length(onPlane - middle) / reach;
  float fade = 1.0 - smoothstep(0.35, 1.0, away);
  if (fade < 0.004) discard;
  float line = max(0.40 * lines(cell, 0.5), 0.85 * lines(5.0 * cell, 0.7));
  vec3 colour = mix(ground, grid, line);
  vec4 s = shadowFromWorld * vec4(seenAt, 1.0);
  vec2 inside = step(abs(s.xy), vec2(0.995));
  float dark = darkness * inside.x * inside.y * texture(shadow, 0.5 + 0.5 * s.xy).r;
  colour *= 1.0 - dark;
  pixel = behind > 0.5 ? vec4(grid, fade * (0.05 + 0.25 * line)) : vec4(colour, fade);
}`;

const BLUR = /* glsl */ `
precision highp float;
precision highp sampler2D;
uniform sampler2D from;
uniform vec2 along;
out vec4 pixel;
void main() {
  vec2 at = gl_FragCoord.xy / ${SHADOW_SIZE}.0;
  float sum = 0.0, whole = 0.0;
  for (int i = -7; i <= 7; i++) {
    float w = exp(-0.045 * float(i * i));
    sum += w * texture(from, at + float(i) * along).r;
    whole += w;
  }
  pixel = vec4(sum / whole);
}`;

/** A picture of what is above a plane, seen from below, blurred. */
class Shadow {
  readonly sharp = Shadow.target();
  private readonly between = Shadow.target();
  private readonly camera = new OrthographicCamera();
  readonly fromWorld = new Matrix4();
  private readonly blur: RawShaderMaterial;
  private readonly whole = new Scene();
  private readonly noCamera = new Camera();

  private static target(): WebGLRenderTarget {
    return new WebGLRenderTarget(SHADOW_SIZE, SHADOW_SIZE, { minFilter: LinearFilter, magFilter: LinearFilter, generateMipmaps: false });
  }

  constructor() {
    this.blur = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: WHOLE_TARGET,
      fragmentShader: BLUR,
      uniforms: { from: { value: null }, along: { value: new Vector2() } },
      depthTest: false,
      depthWrite: false,
    });
    const geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(new Uint16Array([0, 1, 2]), 1));
    const mesh = new Mesh(geometry, this.blur);
    mesh.frustumCulled = false;
    this.whole.add(mesh);
  }

  draw(renderer: WebGLRenderer, casters: Scene, middle: Vector3, normal: Vector3, across: Vector3, size: number, height: number): void {
    const camera = this.camera;
    camera.left = camera.bottom = -size;
    camera.right = camera.top = size;
    camera.near = 0;
    camera.far = 1.1 * height;
    camera.position.copy(middle).addScaledVector(normal, -0.1 * height);
    camera.up.copy(across);
    camera.lookAt(middle.clone().add(normal));
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.fromWorld.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const before = renderer.getRenderTarget();
    const clearAlpha = renderer.getClearAlpha();
    renderer.setClearAlpha(0);
    const background = casters.background;
    casters.background = null;
    renderer.setRenderTarget(this.sharp);
    renderer.clear();
    renderer.render(casters, camera);
    for (const [from, to, x, y] of [
      [this.sharp, this.between, 1, 0],
      [this.between, this.sharp, 0, 1],
    ] as const) {
      this.blur.uniforms.from.value = from.texture;
      (this.blur.uniforms.along.value as Vector2).set(x / SHADOW_SIZE, y / SHADOW_SIZE);
      renderer.setRenderTarget(to);
      renderer.render(this.whole, this.noCamera);
    }
    casters.background = background;
    renderer.setClearAlpha(clearAlpha);
    renderer.setRenderTarget(before);
  }

  dispose(): void {
    this.sharp.dispose();
    this.between.dispose();
    this.blur.dispose();
  }
}

export class Ground {
  readonly group = new Group();
  private readonly shadow: Shadow | null;
  private readonly uniforms: Record<string, { value: unknown }>;
  private readonly geometry: PlaneGeometry;
  private readonly normal = new Vector3();
  private readonly across = new Vector3();

  constructor(
    private readonly center: Vector3,
    private readonly radius: number,
    shaded: boolean,
  ) {
    this.shadow = shaded ? new Shadow() : null;
    const reach = 9 * radius;
    this.geometry = new PlaneGeometry(2 * reach, 2 * reach);
    this.geometry.rotateX(-Math.PI / 2);
    this.uniforms = {
      ground: { value: [1, 1, 1] },
      grid: { value: [0, 0, 0] },
      cell: { value: niceAbove(radius / 12) },
      middle: { value: new Vector2() },
      reach: { value: reach },
      shadow: { value: this.shadow?.sharp.texture ?? null },
      shadowFromWorld: { value: this.shadow?.fromWorld ?? new Matrix4().makeScale(0, 0, 0) },
      darkness: { value: 0 },
    };
    for (const [side, behind] of [
      [FrontSide, 0],
      [BackSide, 1],
    ] as const) {
      const material = new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        uniforms: { ...this.uniforms, behind: { value: behind } },
        side,
        transparent: true,
        depthWrite: behind === 0,
        polygonOffset: true,
        polygonOffsetFactor: 1,
        polygonOffsetUnits: 4,
      });
      const mesh = new Mesh(this.geometry, material);
      mesh.frustumCulled = false;
      mesh.renderOrder = behind === 0 ? -2 : 3;
      this.group.add(mesh);
    }
  }

  /** Moves the plane: its y axis is the normal. The grid stays where the plane is, its fading follows the view. */
  pose(pose: ArrayLike<number>): void {
    this.group.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
    this.group.position.set(pose[0], pose[1], pose[2]);
    this.normal.set(0, 1, 0).applyQuaternion(this.group.quaternion);
    this.across.set(0, 0, 1).applyQuaternion(this.group.quaternion);
    const off = this.center.clone().sub(this.group.position).applyQuaternion(this.group.quaternion.clone().invert());
    // Whole cells, so that the lines stay.
    const cell = 5 * (this.uniforms.cell.value as number);
    const shift = new Vector3(Math.round(off.x / cell) * cell, 0, Math.round(off.z / cell) * cell);
    this.group.position.add(shift.applyQuaternion(this.group.quaternion));
    this.group.updateMatrixWorld();
  }

  dress(palette: Palette): void {
    this.uniforms.ground.value = rgb(palette.ground);
    this.uniforms.grid.value = rgb(palette.grid);
    this.uniforms.darkness.value = this.shadow === null ? 0 : palette.shadow;
  }

  /** `around`: where the things are that throw shadows. */
  draw(renderer: WebGLRenderer, casters: Scene, around: Vector3, setPlane: (plane: Vector4, shear: Vector3, reach: number) => void): void {
    if (this.shadow === null) return;
    const offset = this.normal.dot(this.group.position);
    const middle = around.clone().addScaledVector(this.normal, offset - this.normal.dot(around));
    const reach = 2.2 * this.radius;
    const shear = this.across.clone().cross(this.normal).multiplyScalar(-SHEAR_ASIDE).addScaledVector(this.across, -SHEAR_BACK);
    setPlane(new Vector4(this.normal.x, this.normal.y, this.normal.z, offset), shear, reach);
    this.shadow.draw(renderer, casters, middle, this.normal, this.across, 3.2 * this.radius, 12 * this.radius);
  }

  dispose(): void {
    this.shadow?.dispose();
    this.geometry.dispose();
    for (const mesh of this.group.children) ((mesh as Mesh).material as RawShaderMaterial).dispose();
  }
}
