// Mesh of one elastic object: reconstructed surface, wireframe and shadow caster.

import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  FloatType,
  GLSL3,
  Group,
  LineSegments,
  Mesh,
  RGBAFormat,
  RawShaderMaterial,
  type Texture,
  Vector3,
  Vector4,
  type WebGLRenderer,
} from "three";
import type { ObjectFrame } from "../../protocol/frame";
import type { SceneObject } from "../../protocol/messages";
import type { ModeShapes, Surface } from "../../protocol/surface";
import { rampNumbers, rgb, type ColourMode } from "../colours";
import { lookOf, type Look } from "../looks";
import { splitAtCreases, type SplitMesh } from "./split_mesh";
import { gridFor, type TextureLimits, type TextureGrid } from "./texture_layout";
import { dataTexture, GpuReconstruction, restTexture } from "./gpu_reconstruction";
import { vertexNormals, nodalPositions } from "./cpu_reconstruction";
import { DisplacementSample } from "./displacement_sample";
import { SHADOW_FRAGMENT, SURFACE_FRAGMENT, SURFACE_VERTEX, WIRE_FRAGMENT } from "./shaders";

export class FrameMismatch extends Error {}

const COLOUR_MODE_INDEX: Record<ColourMode, number> = { plain: 0, displacement: 1, strain: 2 };

export class ElasticMesh {
  readonly group = new Group();
  readonly surface: Surface;
  private readonly splitMesh: SplitMesh;
  private readonly rest: DataTexture;
  private readonly nodeGrid: TextureGrid;
  private readonly geometry = new BufferGeometry();
  private readonly edges = new BufferGeometry();
  private readonly uniforms: Record<string, { value: unknown }>;
  private readonly gpu: GpuReconstruction | null;
  private readonly shapes: ModeShapes | null;
  private readonly sample: DisplacementSample | null;
  private readonly wires: LineSegments;
  private readonly solid: Mesh;
  /** Shadow caster. */
  readonly shadow: Mesh;
  private readonly wireMaterial: RawShaderMaterial;
  private readonly surfaceMaterial: RawShaderMaterial;
  readonly shadowMaterial: RawShaderMaterial;

  // CPU reconstruction: positions and normals.
  private cpuPositions: DataTexture | null = null;
  private cpuNormals: DataTexture | null = null;
  private readonly vertexGrid: TextureGrid;

  private latest: ObjectFrame | null = null;
  private readonly look: Look;
  private useGpu = false;
  private dirty = true;
  private cachedPositions: Float32Array | null = null;

  constructor(
    readonly info: SceneObject,
    surface: Surface,
    shapes: ModeShapes | null,
    limits: TextureLimits,
    useGpu: boolean,
    colour: string,
    up: Vector3,
  ) {
    if (shapes !== null && shapes.nodes !== surface.nodes) {
      throw new Error(`${info.name}: shapes of ${shapes.nodes} nodes for a surface of ${surface.nodes}`);
    }
    this.surface = surface;
    this.look = lookOf(info.material ?? info.materials?.[0] ?? null);
    this.splitMesh = splitAtCreases(surface);
    this.nodeGrid = gridFor(surface.nodes, limits);
    this.vertexGrid = gridFor(this.splitMesh.vertices, limits);
    this.rest = restTexture(surface, this.nodeGrid);
    this.gpu = shapes !== null && useGpu ? GpuReconstruction.make(surface, shapes, this.splitMesh, this.rest, info.radius, limits) : null;
    // Not kept on the CPU when the GPU holds them: they may be large.
    this.shapes = this.gpu === null ? shapes : null;
    this.sample = shapes === null ? null : new DisplacementSample(shapes);

    const element = new Float32Array(2 * this.splitMesh.vertices);
    for (let v = 0; v < this.splitMesh.vertices; v++) {
      element[2 * v] = this.splitMesh.node[v];
      element[2 * v + 1] = v;
    }
    const attribute = new BufferAttribute(element, 2);
    this.geometry.setAttribute("element", attribute);
    this.geometry.setIndex(new BufferAttribute(this.splitMesh.indices, 1));
    this.edges.setAttribute("element", attribute);
    const atRest = new Float32Array(4 * this.splitMesh.vertices);
    vertexNormals(surface, this.splitMesh, surface.positions, atRest);
    const restNormals = Float32Array.from({ length: 3 * this.splitMesh.vertices }, (_, i) => atRest[4 * Math.floor(i / 3) + (i % 3)]);
    for (const geometry of [this.geometry, this.edges]) geometry.setAttribute("restNormal", new BufferAttribute(restNormals, 3));
    this.edges.setIndex(new BufferAttribute(this.splitMesh.edges, 1));

    this.uniforms = {
      positions: { value: this.rest },
      restPositions: { value: this.rest },
      normals: { value: null },
      positionWidth: { value: this.nodeGrid.width },
      normalWidth: { value: this.vertexGrid.width },
      colourMode: { value: 0 },
      range: { value: 1 },
      ramp: { value: rampNumbers() },
      up: { value: up },
    };
    const material = (fragmentShader: string, own: Record<string, { value: unknown }>, transparent = false, depthWrite = !transparent) =>
      new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: SURFACE_VERTEX,
        fragmentShader,
        uniforms: { plane: { value: new Vector4() }, shear: { value: new Vector3() }, ...this.uniforms, ...own },
        transparent,
        depthWrite,
      });
    const { translucency, gloss, metal, grain } = this.look;
    const look = { translucency: { value: translucency }, gloss: { value: gloss }, metal: { value: metal }, grain: { value: grain } };
    const own = { colour: { value: rgb(colour) }, size: { value: info.radius }, lift: { value: 0 }, glow: { value: 0 }, ...look };
    this.surfaceMaterial = material(SURFACE_FRAGMENT, own, translucency > 0, true);
    this.wireMaterial = material(WIRE_FRAGMENT, { colour: { value: [0, 0, 0] }, opacity: { value: 0.11 }, lift: { value: 8e-4 } }, true);
    this.shadowMaterial = material(SHADOW_FRAGMENT, { plane: { value: new Vector4() }, shear: { value: new Vector3() }, reach: { value: 1 }, lift: { value: 0 } });
    this.solid = new Mesh(this.geometry, this.surfaceMaterial);
    this.wires = new LineSegments(this.edges, this.wireMaterial);
    this.wires.renderOrder = 1;
    this.shadow = new Mesh(this.geometry, this.shadowMaterial);
    this.shadow.frustumCulled = false;
    this.shadow.matrixAutoUpdate = false;
    for (const drawn of [this.solid, this.wires]) {
      drawn.frustumCulled = false;
      this.group.add(drawn);
    }
  }

  /** Throws `FrameMismatch` if the frame belongs to another object. */
  checkFrame(frame: ObjectFrame): void {
    const { shape } = frame;
    if (shape.format === "vertices") {
      if (shape.positions.length !== 3 * this.surface.nodes) {
        throw new FrameMismatch(`${shape.positions.length / 3} positions for the ${this.surface.nodes} nodes of ${this.info.name}`);
      }
      return;
    }
    const modes = this.info.modes;
    if (shape.q.length > modes) throw new FrameMismatch(`${shape.q.length} modes for the ${modes} of ${this.info.name}`);
    const last = shape.residualNodes.length > 0 ? shape.residualNodes[shape.residualNodes.length - 1] : 0;
    if (last >= this.surface.nodes) throw new FrameMismatch(`a residual displacement of node ${last} of ${this.surface.nodes}`);
  }

  setFrame(frame: ObjectFrame): void {
    this.latest = frame;
    this.dirty = true;
    this.cachedPositions = null;
    const [x, y, z, a, b, c, d] = frame.pose;
    this.group.position.set(x, y, z);
    this.group.quaternion.set(a, b, c, d);
    this.group.updateMatrixWorld();
    this.shadow.matrix.copy(this.group.matrixWorld);
    this.shadow.matrixWorldNeedsUpdate = true;
  }

  /** Updates positions and normals to the newest frame. */
  reconstruct(renderer: WebGLRenderer): void {
    if (!this.dirty || this.latest === null) return;
    this.dirty = false;
    const { shape } = this.latest;
    this.useGpu = shape.format === "modal" && this.gpu !== null;
    if (shape.format === "modal" && this.gpu !== null) {
      this.gpu.draw(renderer, shape);
      this.bind(this.gpu.positions, this.gpu.normals);
    } else {
      this.reconstructOnCpu(renderer);
    }
  }

  private reconstructOnCpu(renderer: WebGLRenderer): void {
    const positions = this.currentPositions(renderer);
    this.cpuPositions ??= dataTexture(new Float32Array(4 * this.nodeGrid.width * this.nodeGrid.rows), this.nodeGrid, RGBAFormat, FloatType);
    this.cpuNormals ??= dataTexture(
      new Float32Array(4 * this.vertexGrid.width * this.vertexGrid.rows),
      this.vertexGrid,
      RGBAFormat,
      FloatType,
    );
    const texels = this.cpuPositions.image.data as Float32Array;
    const rest = this.surface.positions;
    for (let i = 0; i < this.surface.nodes; i++) {
      const [x, y, z] = [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]];
      texels[4 * i] = x;
      texels[4 * i + 1] = y;
      texels[4 * i + 2] = z;
      texels[4 * i + 3] = Math.hypot(x - rest[3 * i], y - rest[3 * i + 1], z - rest[3 * i + 2]);
    }
    vertexNormals(this.surface, this.splitMesh, positions, this.cpuNormals.image.data as Float32Array);
    this.cpuPositions.needsUpdate = true;
    this.cpuNormals.needsUpdate = true;
    this.bind(this.cpuPositions, this.cpuNormals);
  }

  private bind(positions: Texture, normals: Texture): void {
    // All materials share these uniforms.
    this.uniforms.positions.value = positions;
    this.uniforms.normals.value = normals;
  }

  /** Current nodal positions [m, body], three numbers per node. Waits for the GPU. */
  currentPositions(renderer: WebGLRenderer): Float32Array {
    if (this.cachedPositions !== null) return this.cachedPositions;
    const shape = this.latest?.shape;
    if (shape === undefined) return this.surface.positions;
    if (shape.format === "vertices") {
      this.cachedPositions = shape.positions;
    } else if (this.gpu !== null) {
      this.reconstruct(renderer);
      const texels = this.gpu.readPositions(renderer);
      this.cachedPositions = new Float32Array(3 * this.surface.nodes);
      for (let i = 0; i < this.surface.nodes; i++) {
        for (let k = 0; k < 3; k++) this.cachedPositions[3 * i + k] = texels[4 * i + k];
      }
    } else if (this.shapes !== null) {
      this.cachedPositions = nodalPositions(this.surface, this.shapes, shape);
    } else {
      this.cachedPositions = this.surface.positions;
    }
    return this.cachedPositions;
  }

  /** Estimate of the largest displacement [m]; does not wait for the GPU. */
  get approximateDisplacement(): number {
    const shape = this.latest?.shape;
    return shape?.format === "modal" ? (this.sample?.largest(shape) ?? 0) : 0;
  }

  /** Largest displacement [m] or strain. Waits for the GPU. */
  maxValue(renderer: WebGLRenderer, mode: ColourMode): number {
    this.reconstruct(renderer);
    if (this.useGpu && this.gpu !== null) {
      const numbers = mode === "strain" ? this.gpu.readNormals(renderer) : this.gpu.readPositions(renderer);
      return this.maxOf(numbers, mode);
    }
    const texture = mode === "strain" ? this.cpuNormals : this.cpuPositions;
    return texture === null ? 0 : this.maxOf(texture.image.data as Float32Array, mode);
  }

  /** Largest displacement [m] or strain, read back asynchronously. */
  async maxValueAsync(renderer: WebGLRenderer, mode: ColourMode): Promise<number> {
    if (!this.useGpu || this.gpu === null) return this.maxValue(renderer, mode);
    return this.maxOf(await this.gpu.readAsync(renderer, mode === "strain" ? "normals" : "positions"), mode);
  }

  private maxOf(numbers: Float32Array, mode: ColourMode): number {
    const count = mode === "strain" ? this.splitMesh.vertices : this.surface.nodes;
    let largest = 0;
    for (let i = 3; i < 4 * count; i += 4) largest = Math.max(largest, numbers[i]);
    return largest;
  }

  /** Sets the colours; `plain` is that of materials without their own. */
  setColours(mode: ColourMode, range: number, plain: string, wire: string): void {
    const u = this.surfaceMaterial.uniforms;
    u.colourMode.value = range > 0 ? COLOUR_MODE_INDEX[mode] : 0;
    u.range.value = range;
    u.colour.value = rgb(this.look.colour ?? plain);
    this.wireMaterial.uniforms.colour.value = rgb(wire);
  }

  set wireframe(on: boolean) {
    this.wires.visible = on;
  }

  dispose(): void {
    this.gpu?.dispose();
    for (const made of [this.rest, this.cpuPositions, this.cpuNormals, this.geometry, this.edges]) made?.dispose();
    for (const material of [this.surfaceMaterial, this.wireMaterial, this.shadowMaterial]) material.dispose();
  }
}
