// Surface reconstruction on the GPU in two passes: nodal positions, then vertex normals and strains.

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
import type { ModalShape } from "../../protocol/frame";
import type { ModeShapes, Surface } from "../../protocol/surface";
import type { SplitMesh } from "./split_mesh";
import { packModeShapes, modeOffset, gridFor, shapeLayout, padTexels, type TextureLimits, type TextureGrid, type ShapeLayout } from "./texture_layout";
import { NORMALS_FRAGMENT, POSITIONS_FRAGMENT, FULL_SCREEN_VERTEX } from "./shaders";

// Modes are truncated while the sum of their amplitudes stays below this fraction of the object's radius: each mode
// costs a texture fetch per node.
const TRUNCATION = 1e-5;

export function textureLimits(renderer: WebGLRenderer): TextureLimits {
  const gl = renderer.getContext() as WebGL2RenderingContext;
  return {
    size: renderer.capabilities.maxTextureSize,
    layers: gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number,
  };
}

export function dataTexture(
  data: Float32Array<ArrayBuffer> | Int8Array<ArrayBuffer> | Uint32Array<ArrayBuffer>,
  plane: TextureGrid,
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

function target(plane: TextureGrid): WebGLRenderTarget {
  return new WebGLRenderTarget(plane.width, plane.rows, {
    format: RGBAFormat,
    type: FloatType,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    depthBuffer: false,
    generateMipmaps: false,
  });
}

/** Full-screen triangle that runs a fragment shader over a render target. */
class FullScreenPass {
  private readonly scene = new Scene();
  private readonly camera = new Camera();
  private readonly geometry = new BufferGeometry();
  readonly material: RawShaderMaterial;

  constructor(fragmentShader: string, uniforms: Record<string, { value: unknown }>) {
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: FULL_SCREEN_VERTEX,
      fragmentShader,
      uniforms,
      depthTest: false,
      depthWrite: false,
    });
    this.geometry.setDrawRange(0, 3);
    // No vertex attributes; the index sets the vertex count.
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
  readonly nodeGrid: TextureGrid;
  private readonly layout: ShapeLayout;
  private readonly positionTarget: WebGLRenderTarget;
  private readonly positionPass: FullScreenPass;
  private readonly normalPass: NormalPass;
  private readonly textures: Texture[] = [];
  private readonly weights: DataTexture;
  private readonly residuals: DataTexture;
  private residualNodes = new Uint32Array(0);
  private readonly modes: number;
  private readonly truncation: number;

  /** Null if the mode shapes exceed the texture limits. */
  static make(surface: Surface, shapes: ModeShapes, splitMesh: SplitMesh, rest: DataTexture, radius: number, limits: TextureLimits): GpuReconstruction | null {
    const layout = shapeLayout(surface.nodes, Math.max(1, shapes.modes), limits);
    if (layout === null || shapes.modes > limits.size) return null;
    return new GpuReconstruction(surface, shapes, splitMesh, rest, radius, limits, layout);
  }

  private constructor(
    surface: Surface,
    shapes: ModeShapes,
    splitMesh: SplitMesh,
    rest: DataTexture,
    radius: number,
    limits: TextureLimits,
    layout: ShapeLayout,
  ) {
    this.layout = layout;
    this.modes = shapes.modes;
    this.truncation = TRUNCATION * radius;
    this.nodeGrid = { width: layout.width, rows: layout.rows };

    const texels = packModeShapes(shapes.halves, surface.nodes, shapes.modes, layout);
    const array = new DataArrayTexture(texels, layout.width, layout.rows * layout.planes, layout.layers);
    array.format = RGBFormat;
    array.type = HalfFloatType;
    array.internalFormat = "RGB16F";
    array.minFilter = NearestFilter;
    array.magFilter = NearestFilter;
    array.generateMipmaps = false;
    array.unpackAlignment = 2;
    array.needsUpdate = true;
    // Frees the CPU copy after upload: 120 MB for 100,000 nodes and 200 modes.
    array.onUpdate = () => {
      (array.image as { data: unknown }).data = null;
    };

    const weightPlane = { width: Math.max(1, shapes.modes), rows: 1 };
    this.weights = dataTexture(new Float32Array(4 * weightPlane.width), weightPlane, RGBAFormat, FloatType);
    this.residuals = dataTexture(new Int8Array(4 * layout.width * layout.rows), this.nodeGrid, RGBAIntegerFormat, ByteType, "RGBA8I");
    this.textures.push(array, this.weights, this.residuals);
    this.positionTarget = target(this.nodeGrid);
    this.positionPass = new FullScreenPass(POSITIONS_FRAGMENT, {
      rest: { value: rest },
      shapes: { value: array },
      weights: { value: this.weights },
      residuals: { value: this.residuals },
      residualUnit: { value: 0 },
      count: { value: 0 },
    });
    this.normalPass = new NormalPass(splitMesh, rest, this.nodeGrid, limits);
  }

  get positions(): Texture {
    return this.positionTarget.texture;
  }

  get normals(): Texture {
    return this.normalPass.target.texture;
  }

  get normalWidth(): number {
    return this.normalPass.grid.width;
  }

  draw(renderer: WebGLRenderer, shape: ModalShape): void {
    const weights = this.weights.image.data as Float32Array;
    let count = 0;
    const least = truncationThreshold(shape.q, this.truncation);
    for (let mode = 0; mode < Math.min(this.modes, shape.q.length); mode++) {
      if (Math.abs(shape.q[mode]) < least) continue;
      const { layer, row } = modeOffset(mode, this.layout);
      weights.set([shape.q[mode], layer, row, 0], 4 * count++);
    }
    this.weights.needsUpdate = true;
    this.setResiduals(shape);
    this.positionPass.material.uniforms.residualUnit.value = shape.residualUnit;
    this.positionPass.material.uniforms.count.value = count;
    this.positionPass.draw(renderer, this.positionTarget);
    this.normalPass.draw(renderer, this.positions);
  }

  private setResiduals(shape: ModalShape): void {
    if (shape.residualNodes.length === 0 && this.residualNodes.length === 0) return;
    const texels = this.residuals.image.data as Int8Array;
    for (const node of this.residualNodes) texels.fill(0, 4 * node, 4 * node + 3);
    for (let i = 0; i < shape.residualNodes.length; i++) {
      for (let k = 0; k < 3; k++) texels[4 * shape.residualNodes[i] + k] += shape.residuals[3 * i + k];
    }
    this.residualNodes = shape.residualNodes.slice();
    this.residuals.needsUpdate = true;
  }

  /** Position and displacement magnitude of each node [m], four numbers. Waits for the GPU. */
  readPositions(renderer: WebGLRenderer): Float32Array {
    return readTarget(renderer, this.positionTarget);
  }

  readNormals(renderer: WebGLRenderer): Float32Array {
    return readTarget(renderer, this.normalPass.target);
  }

  /** Positions or normals, read back asynchronously. */
  async readAsync(renderer: WebGLRenderer, what: "positions" | "normals"): Promise<Float32Array> {
    const from = what === "positions" ? this.positionTarget : this.normalPass.target;
    const numbers = new Float32Array(4 * from.width * from.height);
    await renderer.readRenderTargetPixelsAsync(from, 0, 0, from.width, from.height, numbers);
    return numbers;
  }

  dispose(): void {
    for (const texture of this.textures) texture.dispose();
    this.positionTarget.dispose();
    this.positionPass.dispose();
    this.normalPass.dispose();
  }
}

/** Largest threshold for which the amplitudes below it sum to at most `most`. */
export function truncationThreshold(q: Float32Array, most: number): number {
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
  readonly grid: TextureGrid;
  private readonly pass: FullScreenPass;
  private readonly textures: DataTexture[];

  constructor(splitMesh: SplitMesh, rest: DataTexture, nodeGrid: TextureGrid, limits: TextureLimits) {
    this.grid = gridFor(splitMesh.vertices, limits);
    const vertices = new Uint32Array(4 * this.grid.width * this.grid.rows);
    for (let v = 0; v < splitMesh.vertices; v++) {
      vertices.set([splitMesh.node[v], splitMesh.ringStart[v], splitMesh.ringStart[v + 1] - splitMesh.ringStart[v]], 4 * v);
    }
    const ringPlane = gridFor(splitMesh.ring.length / 2, limits);
    const ring = new Uint32Array(2 * ringPlane.width * ringPlane.rows);
    ring.set(splitMesh.ring);
    this.textures = [
      dataTexture(vertices, this.grid, RGBAIntegerFormat, UnsignedIntType, "RGBA32UI"),
      dataTexture(ring, ringPlane, RGIntegerFormat, UnsignedIntType, "RG32UI"),
    ];
    this.target = target(this.grid);
    this.pass = new FullScreenPass(NORMALS_FRAGMENT, {
      positions: { value: null },
      rest: { value: rest },
      vertices: { value: this.textures[0] },
      ring: { value: this.textures[1] },
      positionWidth: { value: nodeGrid.width },
      ringWidth: { value: ringPlane.width },
    });
  }

  draw(renderer: WebGLRenderer, positions: Texture): void {
    this.pass.material.uniforms.positions.value = positions;
    this.pass.draw(renderer, this.target);
  }

  dispose(): void {
    for (const texture of this.textures) texture.dispose();
    this.target.dispose();
    this.pass.dispose();
  }
}

/** Rest positions as a texture, four numbers per node. */
export function restTexture(surface: Surface, plane: TextureGrid): DataTexture {
  return dataTexture(padTexels(surface.positions, 3, 4, plane), plane, RGBAFormat, FloatType);
}
