// Materials of rigid meshes (obstacles, proxies), lit like the elastic surfaces.

import { GLSL3, RawShaderMaterial, Vector3, Vector4 } from "three";
import { rgb } from "./colours";
import { LIGHTING } from "./elastic/shaders";

/** Vertex shader of a rigid mesh, with `worldPosition` for the fragment; `statements` may use and move `world`. */
export const rigidVertex = (declarations: string, statements: string) => /* glsl */ `
precision highp float;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
in vec3 position;
out vec3 worldPosition;
${declarations}
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  worldPosition = world.xyz;
  ${statements}
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

const VERTEX = rigidVertex("in vec3 normal; out vec3 shadingNormal;", "shadingNormal = mat3(modelMatrix) * normal;");

const FRAGMENT = /* glsl */ `
precision highp float;
uniform mat4 viewMatrix;
uniform vec3 cameraPosition;
uniform vec3 up;
uniform vec3 colour;
uniform float opacity;
uniform float gloss;
in vec3 worldPosition;
in vec3 shadingNormal;
out vec4 pixel;
${LIGHTING}
void main() {
  vec3 right = vec3(viewMatrix[0][0], viewMatrix[1][0], viewMatrix[2][0]);
  vec3 level = normalize(right - up * dot(right, up));
  vec3 n = gl_FrontFacing ? shadingNormal : -shadingNormal;
  pixel = vec4(screen(lit(linear(colour), n, cameraPosition - worldPosition, level, up, gloss)), opacity);
}`;

export function rigidMaterial(colour: string, up: Vector3, opacity = 1, gloss = 0.6): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { colour: { value: rgb(colour) }, up: { value: up }, opacity: { value: opacity }, gloss: { value: gloss } },
    transparent: opacity < 1,
    depthWrite: opacity === 1,
  });
}

const SHADOW_VERTEX = rigidVertex(
  "uniform vec4 plane; uniform vec3 shear;",
  "world.xyz += shear * max(0.0, dot(plane.xyz, world.xyz) - plane.w);",
);

/** Material of shadow casters; `fragmentShader` gives the density. */
export function shadowCasterMaterial(fragmentShader: string): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: SHADOW_VERTEX,
    fragmentShader,
    uniforms: { plane: { value: new Vector4() }, shear: { value: new Vector3() }, reach: { value: 1 } },
  });
}
