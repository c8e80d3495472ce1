// One elastic object of the picture: its surface as it is now, drawn shaded, as wires, and as what throws a shadow.

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
import type { ObjectPicture } from "../../protocol/picture";
import type { SceneObject } from "../../protocol/messages";
import type { Shapes, Surface } from "../../protocol/surface";
import { rampNumbers, rgb, type ColourMode } from "../colours";
import { smoothParts, type Smooth } from "./creases";
import { planeFor, type Limits, type Plane } from "./layout";
import { dataTexture, GpuReconstruction, restTexture } from "./passes";
import { normalsOf, placesOf } from "./reconstruct";
import { Sample } from "./sample";
import { SHADOW_FRAGMENT, SURFACE_FRAGMENT, SURFACE_VERTEX, WIRE_FRAGMENT } from "./shaders";

export class PictureDoesNotFit extends Error {}

const MEASURES: Record<ColourMode, number> = { plain: 0, displacement: 1, strain: 2 };

export class ElasticObject {
  readonly group = new Group();
  readonly surface: Surface;
  private readonly smooth: Smooth;
  private readonly rest: DataTexture;
  private readonly plane: Plane;
  private readonly geometry = new BufferGeometry();
  private readonly edges = new BufferGeometry();
  private readonly uniforms: Record<string, { value: unknown }>;
  private readonly gpu: GpuReconstruction | null;
  private readonly shapes: Shapes | null;
  private readonly sample: Sample | null;
  private readonly wires: LineSegments;
  private readonly solid: Mesh;
  /** The same surface for the picture of its shadow. */
  readonly shadow: Mesh;
  private readonly wireMaterial: RawShaderMaterial;
  private readonly surfaceMaterial: RawShaderMaterial;
  readonly shadowMaterial: RawShaderMaterial;

  // The plain stream: places and normals made here.
  private cpuPlaces: DataTexture | null = null;
  private cpuNormals: DataTexture | null = null;
  private readonly normalPlane: Plane;

  private latest: ObjectPicture | null = null;
  private fromGpu = false;
  private stale = true;
  private known: Float32Array | null = null;

  constructor(
    readonly info: SceneObject,
    surface: Surface,
    shapes: Shapes | null,
    limits: Limits,
    onGpu: boolean,
    colour: string,
    up: Vector3,
  ) {
    if (shapes !== null && shapes.nodes !== surface.nodes) {
      throw new Error(`${info.name}: shapes of ${shapes.nodes} nodes for a surface of ${surface.nodes}`);
    }
    this.surface = surface;
    this.smooth = smoothParts(surface);
    this.plane = planeFor(surface.nodes, limits);
    this.normalPlane = planeFor(this.smooth.vertices, limits);
    this.rest = restTexture(surface, this.plane);
    this.gpu = shapes !== null && onGpu ? GpuReconstruction.make(surface, shapes, this.smooth, this.rest, info.radius, limits) : null;
    // The GPU has them, and they may be large.
    this.shapes = this.gpu === null ? shapes : null;
    this.sample = shapes === null ? null : new Sample(shapes);

    const element = new Float32Array(2 * this.smooth.vertices);
    for (let v = 0; v < this.smooth.vertices; v++) {
      element[2 * v] = this.smooth.node[v];
      element[2 * v + 1] = v;
    }
    const attribute = new BufferAttribute(element, 2);
    this.geometry.setAttribute("element", attribute);
    this.geometry.setIndex(new BufferAttribute(this.smooth.corners, 1));
    this.edges.setAttribute("element", attribute);
    const atRest = new Float32Array(4 * this.smooth.vertices);
    normalsOf(surface, this.smooth, surface.positions, atRest);
    const restNormals = Float32Array.from({ length: 3 * this.smooth.vertices }, (_, i) => atRest[4 * Math.floor(i / 3) + (i % 3)]);
    for (const geometry of [this.geometry, this.edges]) geometry.setAttribute("restNormal", new BufferAttribute(restNormals, 3));
    this.edges.setIndex(new BufferAttribute(this.smooth.edges, 1));

    this.uniforms = {
      places: { value: this.rest },
      normals: { value: null },
      placeWidth: { value: this.plane.width },
      normalWidth: { value: this.normalPlane.width },
      measure: { value: 0 },
      range: { value: 1 },
      ramp: { value: rampNumbers() },
      up: { value: up },
    };
    const material = (fragmentShader: string, own: Record<string, { value: unknown }>, transparent = false) =>
      new RawShaderMaterial({
        glslVersion: GLSL3,
        vertexShader: SURFACE_VERTEX,
        fragmentShader,
        uniforms: { plane: { value: new Vector4() }, shear: { value: new Vector3() }, ...this.uniforms, ...own },
        transparent,
        depthWrite: !transparent,
      });
    this.surfaceMaterial = material(SURFACE_FRAGMENT, { colour: { value: rgb(colour) }, lift: { value: 0 }, glow: { value: 0 } });
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

  /** Takes a picture; throws `PictureDoesNotFit` if it is of another object. */
  check(picture: ObjectPicture): void {
    const { shape } = picture;
    if (shape.form === "vertices") {
      if (shape.places.length !== 3 * this.surface.nodes) {
        throw new PictureDoesNotFit(`${shape.places.length / 3} places for the ${this.surface.nodes} nodes of ${this.info.name}`);
      }
      return;
    }
    const modes = this.info.modes;
    if (shape.q.length > modes) throw new PictureDoesNotFit(`${shape.q.length} modes for the ${modes} of ${this.info.name}`);
    const last = shape.nodes.length > 0 ? shape.nodes[shape.nodes.length - 1] : 0;
    if (last >= this.surface.nodes) throw new PictureDoesNotFit(`a dent of node ${last} of ${this.surface.nodes}`);
  }

  show(picture: ObjectPicture): void {
    this.latest = picture;
    this.stale = true;
    this.known = null;
    const [x, y, z, a, b, c, d] = picture.pose;
    this.group.position.set(x, y, z);
    this.group.quaternion.set(a, b, c, d);
    this.group.updateMatrixWorld();
    this.shadow.matrix.copy(this.group.matrixWorld);
    this.shadow.matrixWorldNeedsUpdate = true;
  }

  /** Brings places and normals up to the newest picture. */
  reconstruct(renderer: WebGLRenderer): void {
    if (!this.stale || this.latest === null) return;
    this.stale = false;
    const { shape } = this.latest;
    this.fromGpu = shape.form === "modal" && this.gpu !== null;
    if (shape.form === "modal" && this.gpu !== null) {
      this.gpu.draw(renderer, shape);
      this.use(this.gpu.places, this.gpu.normals);
    } else {
      this.reconstructHere(renderer);
    }
  }

  private reconstructHere(renderer: WebGLRenderer): void {
    const places = this.currentPlaces(renderer);
    this.cpuPlaces ??= dataTexture(new Float32Array(4 * this.plane.width * this.plane.rows), this.plane, RGBAFormat, FloatType);
    this.cpuNormals ??= dataTexture(
      new Float32Array(4 * this.normalPlane.width * this.normalPlane.rows),
      this.normalPlane,
      RGBAFormat,
      FloatType,
    );
    const texels = this.cpuPlaces.image.data as Float32Array;
    const rest = this.surface.positions;
    for (let i = 0; i < this.surface.nodes; i++) {
      const [x, y, z] = [places[3 * i], places[3 * i + 1], places[3 * i + 2]];
      texels[4 * i] = x;
      texels[4 * i + 1] = y;
      texels[4 * i + 2] = z;
      texels[4 * i + 3] = Math.hypot(x - rest[3 * i], y - rest[3 * i + 1], z - rest[3 * i + 2]);
    }
    normalsOf(this.surface, this.smooth, places, this.cpuNormals.image.data as Float32Array);
    this.cpuPlaces.needsUpdate = true;
    this.cpuNormals.needsUpdate = true;
    this.use(this.cpuPlaces, this.cpuNormals);
  }

  private use(places: Texture, normals: Texture): void {
    // The materials share these uniforms.
    this.uniforms.places.value = places;
    this.uniforms.normals.value = normals;
  }

  /** Where the nodes are now [m, body], three numbers each. */
  currentPlaces(renderer: WebGLRenderer): Float32Array {
    if (this.known !== null) return this.known;
    const shape = this.latest?.shape;
    if (shape === undefined) return this.surface.positions;
    if (shape.form === "vertices") {
      this.known = shape.places;
    } else if (this.gpu !== null) {
      this.reconstruct(renderer);
      const texels = this.gpu.readPlaces(renderer);
      this.known = new Float32Array(3 * this.surface.nodes);
      for (let i = 0; i < this.surface.nodes; i++) {
        for (let k = 0; k < 3; k++) this.known[3 * i + k] = texels[4 * i + k];
      }
    } else if (this.shapes !== null) {
      this.known = placesOf(this.surface, this.shapes, shape);
    } else {
      this.known = this.surface.positions;
    }
    return this.known;
  }

  /** About the largest displacement [m] now, without waiting. */
  get displacementAbout(): number {
    const shape = this.latest?.shape;
    return shape?.form === "modal" ? (this.sample?.largest(shape) ?? 0) : 0;
  }

  /** The largest displacement [m] or strain now. Waits for the GPU. */
  largest(renderer: WebGLRenderer, mode: ColourMode): number {
    this.reconstruct(renderer);
    if (this.fromGpu && this.gpu !== null) {
      const numbers = mode === "strain" ? this.gpu.readNormals(renderer) : this.gpu.readPlaces(renderer);
      return this.largestOf(numbers, mode);
    }
    const texture = mode === "strain" ? this.cpuNormals : this.cpuPlaces;
    return texture === null ? 0 : this.largestOf(texture.image.data as Float32Array, mode);
  }

  /** The same, a little later, without waiting. */
  async largestSoon(renderer: WebGLRenderer, mode: ColourMode): Promise<number> {
    if (!this.fromGpu || this.gpu === null) return this.largest(renderer, mode);
    return this.largestOf(await this.gpu.readSoon(renderer, mode === "strain" ? "normals" : "places"), mode);
  }

  private largestOf(numbers: Float32Array, mode: ColourMode): number {
    const count = mode === "strain" ? this.smooth.vertices : this.surface.nodes;
    let largest = 0;
    for (let i = 3; i < 4 * count; i += 4) largest = Math.max(largest, numbers[i]);
    return largest;
  }

  colour(mode: ColourMode, range: number, plain: string, wire: string): void {
    const u = this.surfaceMaterial.uniforms;
    u.measure.value = range > 0 ? MEASURES[mode] : 0;
    u.range.value = range;
    u.colour.value = rgb(plain);
    this.wireMaterial.uniforms.colour.value = rgb(wire);
  }

  set wired(on: boolean) {
    this.wires.visible = on;
  }

  dispose(): void {
    this.gpu?.dispose();
    for (const made of [this.rest, this.cpuPlaces, this.cpuNormals, this.geometry, this.edges]) made?.dispose();
    for (const material of [this.surfaceMaterial, this.wireMaterial, this.shadowMaterial]) material.dispose();
  }
}
