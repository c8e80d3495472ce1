// Ground plane: a grid that fades out with distance, and a blurred shadow map.

import {
  BackSide,
  FrontSide,
  GLSL3,
  Group,
  Matrix4,
  Mesh,
  PlaneGeometry,
  RawShaderMaterial,
  Scene,
  Vector2,
  Vector3,
  Vector4,
  type WebGLRenderer,
} from "three";
import { rgb, type Palette } from "./colours";
import { niceCeil } from "./auto_range";
import { rigidVertex } from "./rigid_material";
import { ShadowMap } from "./shadow_map";

// Shadow offset per height: the light comes from the front left.
const SHEAR_SIDEWAYS = 0.38;
const SHEAR_BACK = 0.3;

const VERTEX = rigidVertex("out vec2 onPlane;", "onPlane = position.xz;");

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
uniform float backFace;       // 1: back face
uniform float tone;           // brightness: slopes are darker than level ground
in vec3 worldPosition;
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
  float falloff = length(onPlane - middle) / reach;
  float fade = 1.0 - smoothstep(0.35, 1.0, falloff);
  if (fade < 0.004) discard;
  // Fine lines near the scene, to judge sizes by; coarse ones faint, to see the plane.
  float near = 1.0 - smoothstep(0.08, 0.28, falloff);
  float line = max(0.28 * near * lines(cell, 0.5), mix(0.28, 0.6, near) * lines(5.0 * cell, 0.6));
  vec3 colour = tone * mix(ground, grid, line);
  vec4 s = shadowFromWorld * vec4(worldPosition, 1.0);
  vec2 inside = step(abs(s.xy), vec2(0.995));
  float dark = darkness * inside.x * inside.y * texture(shadow, 0.5 + 0.5 * s.xy).r;
  colour *= 1.0 - dark;
  pixel = backFace > 0.5 ? vec4(grid, fade * (0.05 + 0.25 * line)) : vec4(colour, fade);
}`;

/** Ground plane of a scene, with shadow if `shaded`. */
export class GroundPlane {
  readonly group = new Group();
  private readonly shadow: ShadowMap | null;
  private readonly uniforms: Record<string, { value: unknown }>;
  private readonly geometry: PlaneGeometry;
  private readonly normal = new Vector3();
  private readonly across = new Vector3();

  constructor(
    private readonly center: Vector3,
    private readonly radius: number,
    private readonly up: Vector3,
    shaded: boolean,
    /** Whether it is only a faint grid, to judge motions by. */
    faint = false,
  ) {
    this.shadow = shaded ? new ShadowMap() : null;
    const reach = 9 * radius;
    this.geometry = new PlaneGeometry(2 * reach, 2 * reach);
    this.geometry.rotateX(-Math.PI / 2);
    this.uniforms = {
      ground: { value: [1, 1, 1] },
      grid: { value: [0, 0, 0] },
      cell: { value: niceCeil(radius / 12) },
      middle: { value: new Vector2() },
      reach: { value: reach },
      shadow: { value: this.shadow?.result.texture ?? null },
      shadowFromWorld: { value: this.shadow?.fromWorld ?? new Matrix4().makeScale(0, 0, 0) },
      darkness: { value: 0 },
      tone: { value: 1 },
    };
    const faces = [
      [FrontSide, faint ? 1 : 0],
      [BackSide, 1],
    ] as const;
    for (const [side, backFace] of faces) {
      const material = new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        uniforms: { ...this.uniforms, backFace: { value: backFace } },
        side,
        transparent: true,
        depthWrite: backFace === 0,
        polygonOffset: true,
        polygonOffsetFactor: 1,
        polygonOffsetUnits: 4,
      });
      const mesh = new Mesh(this.geometry, material);
      mesh.frustumCulled = false;
      mesh.renderOrder = backFace === 0 || faint ? -2 : 3;
      this.group.add(mesh);
    }
  }

  /** Sets the pose; the y axis is the normal. The grid is fixed to the plane, the fade to the view. */
  setPose(pose: ArrayLike<number>): void {
    this.group.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
    this.group.position.set(pose[0], pose[1], pose[2]);
    this.normal.set(0, 1, 0).applyQuaternion(this.group.quaternion);
    this.uniforms.tone.value = 0.86 + 0.14 * Math.max(0, this.normal.dot(this.up));
    this.across.set(0, 0, 1).applyQuaternion(this.group.quaternion);
    const centerInPlane = this.center.clone().sub(this.group.position).applyQuaternion(this.group.quaternion.clone().invert());
    // Whole cells keep the grid lines fixed.
    const cell = 5 * (this.uniforms.cell.value as number);
    const shift = new Vector3(Math.round(centerInPlane.x / cell) * cell, 0, Math.round(centerInPlane.z / cell) * cell);
    this.group.position.add(shift.applyQuaternion(this.group.quaternion));
    this.group.updateMatrixWorld();
  }

  applyTheme(palette: Palette): void {
    this.uniforms.ground.value = rgb(palette.ground);
    this.uniforms.grid.value = rgb(palette.grid);
    this.uniforms.darkness.value = this.shadow === null ? 0 : palette.shadow;
  }

  /** Draws the shadow map around the point `focus`. */
  draw(renderer: WebGLRenderer, casters: Scene, focus: Vector3, setPlane: (plane: Vector4, shear: Vector3, reach: number) => void): void {
    if (this.shadow === null) return;
    const offset = this.normal.dot(this.group.position);
    const middle = focus.clone().addScaledVector(this.normal, offset - this.normal.dot(focus));
    const reach = 2.2 * this.radius;
    const shear = this.across.clone().cross(this.normal).multiplyScalar(-SHEAR_SIDEWAYS).addScaledVector(this.across, -SHEAR_BACK);
    setPlane(new Vector4(this.normal.x, this.normal.y, this.normal.z, offset), shear, reach);
    this.shadow.draw(renderer, casters, middle, this.normal, this.across, 3.2 * this.radius, 12 * this.radius);
  }

  dispose(): void {
    this.shadow?.dispose();
    this.geometry.dispose();
    for (const mesh of this.group.children) ((mesh as Mesh).material as RawShaderMaterial).dispose();
  }
}
