// The two passes that reconstruct a surface on the GPU: places of the nodes, then normals and strains of the vertices.

import {
  ByteType,
  Camera,
  DataArrayTexture,
  DataTexture,
  FloatType,
  GLSL3,
  HalfFloatType,
  Mesh,
  BufferGeometry,
  NearestFilter,
  RGBAFormat,
  RGBAIntegerFormat,
  RGBFormat,
  RGIntegerFormat,
  RawShaderMaterial,
  Scene,
  UnsignedIntType,
  WebGLRenderTarget,
  type PixelFormat,
  type Texture,
  type TextureDataType,
  type WebGLRenderer,
} from "three";
import type { ModalShape } from "../../protocol/picture";
import type { Shapes, Surface } from "../../protocol/surface";
import type { Smooth } from "./creases";
import { layShapes, modeAt, planeFor, shapeLayout, spread, type Limits, type Plane, type ShapeLayout } from "./layout";
import { NORMALS, PLACES, WHOLE_TARGET } from "./shaders";

// The smallest modes are left out of the sum, as long as they move nothing by more than this share of the object's size
// together: often most of them, and each costs a look-up per node.
const INVISIBLE = 1e-5;

export function limitsOf(renderer: WebGLRenderer): Limits {
  const gl = renderer.getContext() as WebGL2RenderingContext;
  return {
    size: renderer.capabilities.maxTextureSize,
    layers: gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number,
  };
}

export function dataTexture(
  data: Float32Array<ArrayBuffer> | Int8Array<ArrayBuffer> | Uint32Array<ArrayBuffer>,
  plane: Plane,
  format: PixelFormat,
  type: TextureDataType,
  internal: string | null = null,
): DataTexture {
  const texture = new DataTexture(data, plane.width, plane.rows, format, type);
  texture.minFilter = NearestFilter;
  texture.magFilter = NearestFilter;
  texture.generateMipmaps = false;
  texture.unpackAlignment = 1;
  texture.internalFormat = internal as DataTexture["internalFormat"];
  texture.needsUpdate = true;
  return texture;
}

function target(plane: Plane): WebGLRenderTarget {
  return new WebGLRenderTarget(plane.width, plane.rows, {
    format: RGBAFormat,
    type: FloatType,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    depthBuffer: false,
    generateMipmaps: false,
  });
}

/** Draws one triangle that covers the whole target. */
class WholeTarget {
  private readonly scene = new Scene();
  private readonly camera = new Camera();
  private readonly geometry = new BufferGeometry();
  readonly material: RawShaderMaterial;

  constructor(fragmentShader: string, uniforms: Record<string, { value: unknown }>) {
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: WHOLE_TARGET,
      fragmentShader,
      uniforms,
      depthTest: false,
      depthWrite: false,
    });
    this.geometry.setDrawRange(0, 3);
    // Nothing is read from it, but it says how many vertices there are.
    this.geometry.setIndex([0, 1, 2]);
    const mesh = new Mesh(this.geometry, this.material);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  draw(renderer: WebGLRenderer, into: WebGLRenderTarget): void {
    const before = renderer.getRenderTarget();
    renderer.setRenderTarget(into);
    renderer.render(this.scene, this.camera);
    renderer.setRenderTarget(before);
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }
}

export class GpuReconstruction {
  readonly placePlane: Plane;
  private readonly layout: ShapeLayout;
  private readonly placeTarget: WebGLRenderTarget;
  private readonly placePass: WholeTarget;
  private readonly normalPass: NormalPass;
  private readonly textures: Texture[] = [];
  private readonly weights: DataTexture;
  private readonly dents: DataTexture;
  private dented = new Uint32Array(0);
  private readonly modes: number;
  private readonly invisible: number;

  /** Null where the shapes do not fit into this machine's textures. */
  static make(surface: Surface, shapes: Shapes, smooth: Smooth, rest: DataTexture, radius: number, limits: Limits): GpuReconstruction | null {
    const layout = shapeLayout(surface.nodes, Math.max(1, shapes.modes), limits);
    if (layout === null || shapes.modes > limits.size) return null;
    return new GpuReconstruction(surface, shapes, smooth, rest, radius, limits, layout);
  }

  private constructor(
    surface: Surface,
    shapes: Shapes,
    smooth: Smooth,
    rest: DataTexture,
    radius: number,
    limits: Limits,
    layout: ShapeLayout,
  ) {
    this.layout = layout;
    this.modes = shapes.modes;
    this.invisible = INVISIBLE * radius;
    this.placePlane = { width: layout.width, rows: layout.rows };

    const texels = layShapes(shapes.halves, surface.nodes, shapes.modes, layout);
    const array = new DataArrayTexture(texels, layout.width, layout.rows * layout.planes, layout.layers);
    array.format = RGBFormat;
    array.type = HalfFloatType;
    array.internalFormat = "RGB16F";
    array.minFilter = NearestFilter;
    array.magFilter = NearestFilter;
    array.generateMipmaps = false;
    array.unpackAlignment = 2;
    array.needsUpdate = true;
    // 120 MB for 100,000 nodes and 200 modes: once is enough.
    array.onUpdate = () => {
      (array.image as { data: unknown }).data = null;
    };

    const weightPlane = { width: Math.max(1, shapes.modes), rows: 1 };
    this.weights = dataTexture(new Float32Array(4 * weightPlane.width), weightPlane, RGBAFormat, FloatType);
    this.dents = dataTexture(new Int8Array(4 * layout.width * layout.rows), this.placePlane, RGBAIntegerFormat, ByteType, "RGBA8I");
    this.textures.push(array, this.weights, this.dents);
    this.placeTarget = target(this.placePlane);
    this.placePass = new WholeTarget(PLACES, {
      rest: { value: rest },
      shapes: { value: array },
      weights: { value: this.weights },
      dents: { value: this.dents },
      unit: { value: 0 },
      count: { value: 0 },
    });
    this.normalPass = new NormalPass(smooth, rest, this.placePlane, limits);
  }

  get places(): Texture {
    return this.placeTarget.texture;
  }

  get normals(): Texture {
    return this.normalPass.target.texture;
  }

  get normalWidth(): number {
    return this.normalPass.plane.width;
  }

  draw(renderer: WebGLRenderer, shape: ModalShape): void {
    const weights = this.weights.image.data as Float32Array;
    let count = 0;
    const least = leastUsed(shape.q, this.invisible);
    for (let mode = 0; mode < Math.min(this.modes, shape.q.length); mode++) {
      if (Math.abs(shape.q[mode]) < least) continue;
      const { layer, row } = modeAt(mode, this.layout);
      weights.set([shape.q[mode], layer, row, 0], 4 * count++);
    }
    this.weights.needsUpdate = true;
    this.takeDents(shape);
    this.placePass.material.uniforms.unit.value = shape.unit;
    this.placePass.material.uniforms.count.value = count;
    this.placePass.draw(renderer, this.placeTarget);
    this.normalPass.draw(renderer, this.places);
  }

  private takeDents(shape: ModalShape): void {
    if (shape.nodes.length === 0 && this.dented.length === 0) return;
    const texels = this.dents.image.data as Int8Array;
    for (const node of this.dented) texels.fill(0, 4 * node, 4 * node + 3);
    for (let i = 0; i < shape.nodes.length; i++) {
      for (let k = 0; k < 3; k++) texels[4 * shape.nodes[i] + k] += shape.dents[3 * i + k];
    }
    this.dented = shape.nodes.slice();
    this.dents.needsUpdate = true;
  }

  /** Four numbers per node: the place, and how far it is from rest. Waits for the GPU. */
  readPlaces(renderer: WebGLRenderer): Float32Array {
    return readTarget(renderer, this.placeTarget);
  }

  readNormals(renderer: WebGLRenderer): Float32Array {
    return readTarget(renderer, this.normalPass.target);
  }

  /** The same without waiting. */
  async readSoon(renderer: WebGLRenderer, what: "places" | "normals"): Promise<Float32Array> {
    const from = what === "places" ? this.placeTarget : this.normalPass.target;
    const numbers = new Float32Array(4 * from.width * from.height);
    await renderer.readRenderTargetPixelsAsync(from, 0, 0, from.width, from.height, numbers);
    return numbers;
  }

  dispose(): void {
    for (const texture of this.textures) texture.dispose();
    this.placeTarget.dispose();
    this.placePass.dispose();
    this.normalPass.dispose();
  }
}

/** All modes smaller than this add up to no more than `most`. */
export function leastUsed(q: Float32Array, most: number): number {
  let sum = 0;
  for (const size of q.map(Math.abs).sort()) {
    sum += size;
    if (sum > most) return size;
  }
  return Infinity;
}

function readTarget(renderer: WebGLRenderer, from: WebGLRenderTarget): Float32Array {
  const numbers = new Float32Array(4 * from.width * from.height);
  renderer.readRenderTargetPixels(from, 0, 0, from.width, from.height, numbers);
  return numbers;
}

class NormalPass {
  readonly target: WebGLRenderTarget;
  readonly plane: Plane;
  private readonly pass: WholeTarget;
  private readonly textures: DataTexture[];

  constructor(smooth: Smooth, rest: DataTexture, placePlane: Plane, limits: Limits) {
    this.plane = planeFor(smooth.vertices, limits);
    const vertices = new Uint32Array(4 * this.plane.width * this.plane.rows);
    for (let v = 0; v < smooth.vertices; v++) {
      vertices.set([smooth.node[v], smooth.ringStart[v], smooth.ringStart[v + 1] - smooth.ringStart[v]], 4 * v);
    }
    const ringPlane = planeFor(smooth.ring.length / 2, limits);
    const ring = new Uint32Array(2 * ringPlane.width * ringPlane.rows);
    ring.set(smooth.ring);
    this.textures = [
      dataTexture(vertices, this.plane, RGBAIntegerFormat, UnsignedIntType, "RGBA32UI"),
      dataTexture(ring, ringPlane, RGIntegerFormat, UnsignedIntType, "RG32UI"),
    ];
    this.target = target(this.plane);
    this.pass = new WholeTarget(NORMALS, {
      places: { value: null },
      rest: { value: rest },
      vertices: { value: this.textures[0] },
      ring: { value: this.textures[1] },
      placeWidth: { value: placePlane.width },
      ringWidth: { value: ringPlane.width },
    });
  }

  draw(renderer: WebGLRenderer, places: Texture): void {
    this.pass.material.uniforms.places.value = places;
    this.pass.draw(renderer, this.target);
  }

  dispose(): void {
    for (const texture of this.textures) texture.dispose();
    this.target.dispose();
    this.pass.dispose();
  }
}

/** Rest positions as a texture, four numbers per node. */
export function restTexture(surface: Surface, plane: Plane): DataTexture {
  return dataTexture(spread(surface.positions, 3, 4, plane), plane, RGBAFormat, FloatType);
}
