// Shaders of elastic surfaces (GLSL ES 3.00).

export const FULL_SCREEN_VERTEX = /* glsl */ `
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

// Pass 1, one fragment per node: position and displacement magnitude (cpu_reconstruction.ts has the formulas).
export const POSITIONS_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp isampler2D;
uniform sampler2D rest;
uniform sampler2DArray shapes;
uniform sampler2D weights;   // per retained mode: q, layer, row
uniform isampler2D residuals;
uniform float residualUnit;
uniform int count;
out vec4 position;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 displacement = vec3(0.0);
  for (int k = 0; k < count; k++) {
    vec4 mode = texelFetch(weights, ivec2(k, 0), 0);
    displacement += mode.x * texelFetch(shapes, ivec3(at.x, at.y + int(mode.z), int(mode.y)), 0).xyz;
  }
  displacement += residualUnit * vec3(texelFetch(residuals, at, 0).xyz);
  position = vec4(texelFetch(rest, at, 0).xyz + displacement, length(displacement));
}`;

// Pass 2, one fragment per vertex: normal and strain of its one-ring (cpu_reconstruction.ts has the formulas).
export const NORMALS_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform sampler2D positions;
uniform sampler2D rest;
uniform usampler2D vertices;  // node, ring offset, ring size
uniform usampler2D ring;      // two other nodes of each triangle
uniform int positionWidth;
uniform int ringWidth;
out vec4 normal;
ivec2 texel(int i, int width) { return ivec2(i % width, i / width); }
float elongation(float lambda) { return abs(sqrt(max(0.0, 1.0 + 2.0 * lambda)) - 1.0); }
void main() {
  uvec4 vertex = texelFetch(vertices, ivec2(gl_FragCoord.xy), 0);
  ivec2 own = texel(int(vertex.x), positionWidth);
  vec3 p = texelFetch(positions, own, 0).xyz;
  vec3 p0 = texelFetch(rest, own, 0).xyz;
  vec3 sum = vec3(0.0);
  float strain = 0.0;
  float areaSum = 0.0;
  for (uint t = 0u; t < vertex.z; t++) {
    uvec2 pair = texelFetch(ring, texel(int(vertex.y + t), ringWidth), 0).xy;
    ivec2 a = texel(int(pair.x), positionWidth);
    ivec2 b = texel(int(pair.y), positionWidth);
    vec3 u = texelFetch(positions, a, 0).xyz - p;
    vec3 v = texelFetch(positions, b, 0).xyz - p;
    sum += cross(u, v);
    vec3 u0 = texelFetch(rest, a, 0).xyz - p0;
    vec3 v0 = texelFetch(rest, b, 0).xyz - p0;
    float E = dot(u0, u0), F = dot(u0, v0), G = dot(v0, v0);
    float area = E * G - F * F;
    if (area > 1e-12 * E * G) {
      float e = 0.5 * (dot(u, u) - E), f = 0.5 * (dot(u, v) - F), g = 0.5 * (dot(v, v) - G);
      float mean = 0.5 * (e * G - 2.0 * f * F + g * E) / area;
      float root = sqrt(max(0.0, mean * mean - (e * g - f * f) / area));
      strain += sqrt(area) * max(elongation(mean + root), elongation(mean - root));
    }
    areaSum += sqrt(max(0.0, area));
  }
  float size = length(sum);
  normal = vec4(size > 0.0 ? sum / size : vec3(0.0, 0.0, 1.0), areaSum > 0.0 ? strain / areaSum : 0.0);
}`;

// Vertex shader of surface, wireframe and shadow.
export const SURFACE_VERTEX = /* glsl */ `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform sampler2D positions;
uniform sampler2D normals;
uniform int positionWidth;
uniform int normalWidth;
uniform int colourMode;          // 0 none, 1 displacement, 2 strain
uniform float range;
uniform vec4 plane;           // shadow plane: normal, offset
uniform vec3 shear;           // shadow offset per height; 0 for the visible mesh
uniform float lift;           // offset towards the camera, as a fraction of the distance
in vec2 element;              // node, vertex
in vec3 restNormal;
out vec3 worldPosition;
out vec3 bodyPosition;
out vec3 shadingNormal;
out float value;
uniform sampler2D restPositions;
void main() {
  int node = int(element.x), vertex = int(element.y);
  vec4 position = texelFetch(positions, ivec2(node % positionWidth, node / positionWidth), 0);
  vec4 normal = texelFetch(normals, ivec2(vertex % normalWidth, vertex / normalWidth), 0);
  vec4 world = modelMatrix * vec4(position.xyz, 1.0);
  worldPosition = world.xyz;
  bodyPosition = texelFetch(restPositions, ivec2(node % positionWidth, node / positionWidth), 0).xyz;
  // Exaggerates small changes of slope in the shading, so that an indentation of 1 % of the object is visible.
  vec3 slope = normal.xyz - restNormal;
  shadingNormal = mat3(modelMatrix) * (normal.xyz + 2.4 * exp(-14.0 * dot(slope, slope)) * slope);
  value = colourMode == 1 ? position.w / range : colourMode == 2 ? normal.w / range : 0.0;
  world.xyz += shear * max(0.0, dot(plane.xyz, world.xyz) - plane.w);
  vec4 eye = viewMatrix * world;
  gl_Position = projectionMatrix * vec4(eye.xyz * (1.0 - lift), 1.0);
}`;

// Studio lighting: hemisphere light, key and fill light, a strip reflection that bends at indentations, and a rim light.
// `albedo` is linear RGB.
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

// Elastic surface. Translucent materials: light wraps around edges and shines through from behind, deep parts are more saturated than
// those at grazing view, and what lies behind shows faintly.
export const SURFACE_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
uniform mat4 viewMatrix;
uniform vec3 cameraPosition;
uniform vec3 up;
uniform vec3 colour;
uniform vec3 ramp[7];
uniform int colourMode;
uniform float glow;
uniform float size;           // object radius
uniform float translucency;
uniform float gloss;
uniform float metal;
uniform float grain;
in vec3 worldPosition;
in vec3 bodyPosition;
in vec3 shadingNormal;
in float value;
out vec4 pixel;
${LIGHTING}
// Growth rings around an axis beside the object, and fibres along it.
vec3 wood(vec3 base) {
  vec3 p = bodyPosition / size;
  vec2 across = p.zy + vec2(0.9, 1.7) + 0.03 * vec2(sin(5.0 * p.x), cos(4.0 * p.x + 2.0 * p.y));
  float ring = fract(7.0 * length(across));
  float fibre = 0.5 + 0.5 * sin(90.0 * p.y + 70.0 * p.z + 3.0 * sin(6.0 * p.x));
  float dark = smoothstep(0.55, 0.95, ring) * (1.0 - smoothstep(0.95, 1.0, ring));
  return base * (1.0 - grain * (0.42 * dark + 0.07 * fibre));
}
void main() {
  vec3 base = linear(colour);
  if (colourMode != 0) {
    float x = clamp(value, 0.0, 1.0) * 6.0;
    int i = min(5, int(x));
    base = mix(linear(ramp[i]), linear(ramp[i + 1]), x - float(i));
  }
  vec3 toEye = cameraPosition - worldPosition;
  vec3 right = vec3(viewMatrix[0][0], viewMatrix[1][0], viewMatrix[2][0]);
  vec3 level = normalize(right - up * dot(right, up));
  if (colourMode != 0) {
    pixel = vec4(screen(lit(base, shadingNormal, toEye, level, up, 1.0) + glow * base), 1.0);
    return;
  }
  vec3 n = normalize(shadingNormal);
  vec3 e = normalize(toEye);
  vec3 back = normalize(cross(level, up));
  vec3 key = normalize(-0.55 * level + 0.75 * up + 0.55 * back);
  float facing = max(0.0, dot(n, e));
  if (grain > 0.0) base = wood(base);
  // Corners are thin: light passes.
  float thin = smoothstep(0.5, 1.0, length(bodyPosition) / size);
  vec3 deep = pow(base, vec3(1.0 + translucency * facing * mix(0.9, 0.1, thin)));
  vec3 shaded = lit(deep, n, toEye, level, up, gloss);
  // Scattered light: reaches beyond the terminator, and comes up from the ground.
  float wrapped = max(0.0, (dot(n, key) + 0.7) / 1.7);
  float through = pow(max(0.0, dot(-e, normalize(key + 0.5 * n))), 2.0);
  float fromBelow = 0.5 - 0.5 * dot(n, up);
  vec3 scattered = mix(deep, base, 0.5) * (0.34 + 0.55 * wrapped + 0.5 * through + 0.16 * fromBelow);
  float grazing = pow(1.0 - facing, 3.0);
  vec3 surface = mix(shaded, 0.42 * shaded + 0.62 * scattered + (0.22 * grazing + 0.07 * thin) * sqrt(base), translucency);
  // Metal: its colour is that of what it mirrors, ground below and sky above.
  vec3 r = reflect(-e, n);
  float sky = smoothstep(-0.25, 0.35, dot(r, up));
  float band = smoothstep(0.5, 0.62, dot(r, normalize(up + 0.3 * back))) * (1.0 - smoothstep(0.8, 0.92, dot(r, normalize(up + 0.3 * back))));
  vec3 mirrored = base * (mix(0.22, 0.72, sky) + 0.5 * band + 0.9 * pow(max(0.0, dot(r, key)), 60.0));
  surface = mix(surface, mirrored, metal);
  float opacity = 1.0 - mix(0.1, 0.2, thin) * translucency * (1.0 - grazing);
  pixel = vec4(screen(surface + glow * base), opacity);
}`;

export const WIRE_FRAGMENT = /* glsl */ `
precision highp float;
uniform vec3 colour;
uniform float opacity;
out vec4 pixel;
void main() { pixel = vec4(colour, opacity); }`;

// Shadow density, decreasing with the height above the plane.
export const SHADOW_FRAGMENT = /* glsl */ `
precision highp float;
uniform vec4 plane;           // normal, offset
uniform float reach;
in vec3 worldPosition;
out vec4 pixel;
void main() {
  float height = max(0.0, dot(plane.xyz, worldPosition) - plane.w) / reach;
  pixel = vec4(clamp(1.0 - height, 0.0, 1.0) * exp(-2.2 * height));
}`;
