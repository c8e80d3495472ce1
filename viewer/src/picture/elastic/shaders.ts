// What runs on the GPU for an elastic surface (GLSL ES 3.00).

export const WHOLE_TARGET = /* glsl */ `
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

// Pass 1, one fragment per node: rest + Σ q·shape + dent·unit, and how far that is from rest.
export const PLACES = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp isampler2D;
uniform sampler2D rest;
uniform sampler2DArray shapes;
uniform sampler2D weights;   // of each mode in use: q, layer, row
uniform isampler2D dents;
uniform float unit;
uniform int count;
out vec4 place;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 moved = vec3(0.0);
  for (int k = 0; k < count; k++) {
    vec4 mode = texelFetch(weights, ivec2(k, 0), 0);
    moved += mode.x * texelFetch(shapes, ivec3(at.x, at.y + int(mode.z), int(mode.y)), 0).xyz;
  }
  moved += unit * vec3(texelFetch(dents, at, 0).xyz);
  place = vec4(texelFetch(rest, at, 0).xyz + moved, length(moved));
}`;

// Pass 2, one fragment per vertex: the normal and the strain of its ring (reconstruct.ts has the formulas).
export const NORMALS = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform sampler2D places;
uniform sampler2D rest;
uniform usampler2D vertices;  // node, begin of the ring, triangles in the ring
uniform usampler2D ring;      // the two other nodes of each triangle
uniform int placeWidth;
uniform int ringWidth;
out vec4 normal;
ivec2 texel(int i, int width) { return ivec2(i % width, i / width); }
float stretch(float lambda) { return abs(sqrt(max(0.0, 1.0 + 2.0 * lambda)) - 1.0); }
void main() {
  uvec4 vertex = texelFetch(vertices, ivec2(gl_FragCoord.xy), 0);
  ivec2 own = texel(int(vertex.x), placeWidth);
  vec3 p = texelFetch(places, own, 0).xyz;
  vec3 p0 = texelFetch(rest, own, 0).xyz;
  vec3 sum = vec3(0.0);
  float strain = 0.0;
  float whole = 0.0;
  for (uint t = 0u; t < vertex.z; t++) {
    uvec2 pair = texelFetch(ring, texel(int(vertex.y + t), ringWidth), 0).xy;
    ivec2 a = texel(int(pair.x), placeWidth);
    ivec2 b = texel(int(pair.y), placeWidth);
    vec3 u = texelFetch(places, a, 0).xyz - p;
    vec3 v = texelFetch(places, b, 0).xyz - p;
    sum += cross(u, v);
    vec3 u0 = texelFetch(rest, a, 0).xyz - p0;
    vec3 v0 = texelFetch(rest, b, 0).xyz - p0;
    float E = dot(u0, u0), F = dot(u0, v0), G = dot(v0, v0);
    float area = E * G - F * F;
    if (area > 1e-12 * E * G) {
      float e = 0.5 * (dot(u, u) - E), f = 0.5 * (dot(u, v) - F), g = 0.5 * (dot(v, v) - G);
      float mean = 0.5 * (e * G - 2.0 * f * F + g * E) / area;
      float root = sqrt(max(0.0, mean * mean - (e * g - f * f) / area));
      strain += sqrt(area) * max(stretch(mean + root), stretch(mean - root));
    }
    whole += sqrt(max(0.0, area));
  }
  float size = length(sum);
  normal = vec4(size > 0.0 ? sum / size : vec3(0.0, 0.0, 1.0), whole > 0.0 ? strain / whole : 0.0);
}`;

// The vertex shader of everything that is drawn of the surface.
export const SURFACE_VERTEX = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform sampler2D places;
uniform sampler2D normals;
uniform int placeWidth;
uniform int normalWidth;
uniform int measure;          // 0 none, 1 displacement, 2 strain
uniform float range;
uniform vec4 plane;           // of a shadow: normal, offset
uniform vec3 shear;           // how far a shadow falls aside per height; 0 for what is seen
uniform float lift;           // towards the eye, as a share of the distance: lines lie on the surface
in vec2 element;              // node, vertex
in vec3 restNormal;
out vec3 seenAt;
out vec3 facing;
out float value;
void main() {
  int node = int(element.x), vertex = int(element.y);
  vec4 place = texelFetch(places, ivec2(node % placeWidth, node / placeWidth), 0);
  vec4 normal = texelFetch(normals, ivec2(vertex % normalWidth, vertex / normalWidth), 0);
  vec4 world = modelMatrix * vec4(place.xyz, 1.0);
  seenAt = world.xyz;
  // Small slopes are shaded as if they were larger, so that a dent of 1 % of the object is seen; large ones as they are.
  vec3 slope = normal.xyz - restNormal;
  facing = mat3(modelMatrix) * (normal.xyz + 2.4 * exp(-14.0 * dot(slope, slope)) * slope);
  value = measure == 1 ? place.w / range : measure == 2 ? normal.w / range : 0.0;
  world.xyz += shear * max(0.0, dot(plane.xyz, world.xyz) - plane.w);
  vec4 eye = viewMatrix * world;
  gl_Position = projectionMatrix * vec4(eye.xyz * (1.0 - lift), 1.0);
}`;

// A studio: soft light from above, a key from one side, a strip whose reflection bends where the surface is dented,
// and a rim against the background. \`albedo\` is linear.
export const LIGHTING = /* glsl */ `
vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }
vec3 screen(vec3 c) { return pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2)); }
vec3 lit(vec3 albedo, vec3 normal, vec3 toEye, vec3 right, vec3 up, float gloss) {
  vec3 n = normalize(normal);
  vec3 e = normalize(toEye);
  vec3 back = normalize(cross(right, up));
  vec3 key = normalize(-0.55 * right + 0.75 * up + 0.55 * back);
  vec3 fill = normalize(0.9 * right + 0.15 * up + 0.35 * back);
  float sky = 0.5 + 0.5 * dot(n, up);
  float shade = mix(0.26, 0.50, sky) + 0.62 * max(0.0, dot(n, key)) + 0.13 * max(0.0, dot(n, fill));
  vec3 r = reflect(-e, n);
  float high = dot(r, normalize(up + 0.35 * back - 0.2 * right));
  float strip = smoothstep(0.50, 0.72, high) * (1.0 - 0.55 * smoothstep(0.86, 0.97, high));
  float spot = pow(max(0.0, dot(r, key)), 42.0);
  float rim = pow(1.0 - max(0.0, dot(n, e)), 4.0);
  return albedo * shade + gloss * (0.085 * strip + 0.30 * spot) + 0.16 * rim * sky * vec3(0.9, 0.95, 1.0);
}`;

export const SURFACE_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
uniform mat4 viewMatrix;
uniform vec3 cameraPosition;
uniform vec3 up;
uniform vec3 colour;
uniform vec3 ramp[7];
uniform int measure;
uniform float glow;
in vec3 seenAt;
in vec3 facing;
in float value;
out vec4 pixel;
${LIGHTING}
void main() {
  vec3 base = linear(colour);
  if (measure != 0) {
    float x = clamp(value, 0.0, 1.0) * 6.0;
    int i = min(5, int(x));
    base = mix(linear(ramp[i]), linear(ramp[i + 1]), x - float(i));
  }
  vec3 toEye = cameraPosition - seenAt;
  vec3 right = vec3(viewMatrix[0][0], viewMatrix[1][0], viewMatrix[2][0]);
  vec3 level = normalize(right - up * dot(right, up));
  pixel = vec4(screen(lit(base, facing, toEye, level, up, 1.0) + glow * base), 1.0);
}`;

export const WIRE_FRAGMENT = /* glsl */ `
precision highp float;
uniform vec3 colour;
uniform float opacity;
out vec4 pixel;
void main() { pixel = vec4(colour, opacity); }`;

// Seen from below the plane: how dark the shadow is, by the height above the plane.
export const SHADOW_FRAGMENT = /* glsl */ `
precision highp float;
uniform vec4 plane;           // normal, offset
uniform float reach;
in vec3 seenAt;
out vec4 pixel;
void main() {
  float height = max(0.0, dot(plane.xyz, seenAt) - plane.w) / reach;
  pixel = vec4(clamp(1.0 - height, 0.0, 1.0) * exp(-2.2 * height));
}`;
