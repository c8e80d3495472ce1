// The material of rigid things: obstacles, proxies. Lit like the elastic surfaces.

import { GLSL3, RawShaderMaterial, Vector3, Vector4 } from "three";
import { rgb } from "./colours";
import { LIGHTING } from "./elastic/shaders";

const VERTEX = /* glsl */ `
precision highp float;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
in vec3 position;
in vec3 normal;
out vec3 seenAt;
out vec3 facing;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  seenAt = world.xyz;
  facing = mat3(modelMatrix) * normal;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

const FRAGMENT = /* glsl */ `
precision highp float;
uniform mat4 viewMatrix;
uniform vec3 cameraPosition;
uniform vec3 up;
uniform vec3 colour;
uniform float opacity;
uniform float gloss;
in vec3 seenAt;
in vec3 facing;
out vec4 pixel;
${LIGHTING}
void main() {
  vec3 right = vec3(viewMatrix[0][0], viewMatrix[1][0], viewMatrix[2][0]);
  vec3 level = normalize(right - up * dot(right, up));
  vec3 n = gl_FrontFacing ? facing : -facing;
  pixel = vec4(screen(lit(linear(colour), n, cameraPosition - seenAt, level, up, gloss)), opacity);
}`;

export function matter(colour: string, up: Vector3, opacity = 1, gloss = 0.6): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { colour: { value: rgb(colour) }, up: { value: up }, opacity: { value: opacity }, gloss: { value: gloss } },
    transparent: opacity < 1,
    depthWrite: opacity === 1,
  });
}

const SHADOW_VERTEX = /* glsl */ `
precision highp float;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform vec4 plane;
uniform vec3 shear;
in vec3 position;
out vec3 seenAt;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  seenAt = world.xyz;
  world.xyz += shear * max(0.0, dot(plane.xyz, world.xyz) - plane.w);
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

/** What throws a shadow: `fragmentShader` says how dark. */
export function shadowMatter(fragmentShader: string): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: SHADOW_VERTEX,
    fragmentShader,
    uniforms: { plane: { value: new Vector4() }, shear: { value: new Vector3() }, reach: { value: 1 } },
  });
}
