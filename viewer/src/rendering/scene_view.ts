// Scene view: a WebGL canvas, a 2D overlay canvas, one camera, and one scene graph per viewport.

import { type Camera, Vector2, Vector3, WebGLRenderer } from "three";
import { prefersVertexStream } from "../protocol/urls";
import { OrbitCamera } from "./orbit_camera";
import { DARK, LIGHT, type Palette } from "./colours";
import { textureLimits } from "./elastic/gpu_reconstruction";
import type { TextureLimits } from "./elastic/texture_layout";
import { colourBarBox, drawArrowScale, drawColourBar, drawLabels, drawTime, type Rectangle } from "./overlay";
import { AutoRange, GrowingRange, type DisplayRange } from "./auto_range";
import { ColourScales, newScales } from "./colour_scales";
import { isFarAway, isOutOfView } from "./framing";
import { SceneGraph, type LoadedScene, type DisplaySettings } from "./scene_graph";

const RANGE_INTERVAL_S = 0.15;
// Full range of the force vectors before any force [N], and its length in radii of the scene.
const LEAST_FORCE = 0.02;
const ARROW_LENGTH = 0.7;
// Viewports up to this width [px] place the legend below the scene, if their aspect (height per width) allows it.
const NARROW_WIDTH = 480;
const MIN_ASPECT_FOR_LEGEND_BELOW = 1.3;
// Height of a legend at the top: caption and force scale, and with the colour bar [px].
const LEGEND_HEIGHT = 62;
const LEGEND_HEIGHT_WITH_BAR = 116;

// Distance of an object from the scene's centre, in its radii, from which on it has moved away.
const MOVED_AWAY = 1.5;

export interface ViewSize {
  width: number;
  height: number;
  ratio: number;
}

/** Canvases, renderer, camera and scene graphs. */
export class SceneView {
  readonly canvas = document.createElement("canvas");
  readonly overlay = document.createElement("canvas");
  readonly orbit = new OrbitCamera();
  readonly renderer: WebGLRenderer;
  readonly limits: TextureLimits;
  /** Whether surfaces are reconstructed on the GPU. */
  readonly reconstructsOnGpu: boolean;
  graphs: SceneGraph[] = [];
  settings: DisplaySettings;
  /** Whether title and time are drawn into the overlay. */
  showsTime = false;
  /** Hook that draws pointer cursors into the overlay. */
  drawOverlay: ((context: CanvasRenderingContext2D, viewport: Rectangle) => void) | null = null;
  /** Hook that is called when both canvases hold a new picture; the canvas keeps its own only until the hook returns. */
  drawn: (() => void) | null = null;
  private readonly context: CanvasRenderingContext2D;
  private size: ViewSize = { width: 1, height: 1, ratio: 1 };
  private readonly colourScales = new ColourScales();
  private scales = newScales({ objects: [] });
  private forceRange: DisplayRange = new AutoRange(LEAST_FORCE);
  /** Whether logs are shown: the scale of their force vectors only grows, until it is fixed. */
  showsLogs = false;
  /** Hook that is told where the colour bar is [px]; null without one. */
  colourBarMoved: ((box: Rectangle | null) => void) | null = null;
  private rangePending = false;
  private rangeUpdatedAt = -1;
  private dirty = true;
  lost = false;
  private following = false;

  constructor(settings: DisplaySettings) {
    this.settings = settings;
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.autoClear = true;
    this.limits = textureLimits(this.renderer);
    this.reconstructsOnGpu = this.renderer.extensions.has("EXT_color_buffer_float") && !prefersVertexStream();
    const context = this.overlay.getContext("2d");
    if (context === null) throw new Error("this browser offers no 2D canvas");
    this.context = context;
  }

  /** Palette of the current theme. */
  get palette(): Palette {
    return this.settings.dark ? DARK : LIGHT;
  }

  /** Replaces the scene graph of a viewport. */
  setScene(index: number, loaded: LoadedScene): SceneGraph {
    this.graphs[index]?.dispose();
    if (index === 0) {
      this.scales = this.colourScales.of(loaded.scene);
      this.forceRange = this.showsLogs ? new GrowingRange(LEAST_FORCE) : new AutoRange(LEAST_FORCE);
    }
    const longest = ARROW_LENGTH * (index === 0 ? loaded.scene : this.graphs[0].info).view.radius;
    const graph = new SceneGraph(loaded, this.limits, this.reconstructsOnGpu, this.orbit.up, this.forceRange, longest);
    this.graphs[index] = graph;
    this.rangeUpdatedAt = -1;
    this.requestRender();
    return graph;
  }

  resize(width: number, height: number, ratio: number): void {
    if (width < 1 || height < 1) return;
    this.size = { width, height, ratio };
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.overlay.width = Math.round(width * ratio);
    this.overlay.height = Math.round(height * ratio);
    this.fitCamera();
    this.requestRender();
  }

  /** Resets the camera to the scene, or to all its objects if one has moved away. */
  resetView(): void {
    this.following = false;
    const [graph] = this.graphs;
    const moved = graph?.objects.some((object) => object.group.position.distanceTo(graph.center) > MOVED_AWAY * graph.radius) ?? false;
    if (graph === undefined || !moved) {
      this.orbit.reset();
      return;
    }
    const around = graph.sphereAroundObjects();
    this.orbit.reset(around.center, around.radius);
  }

  /** Resets the camera to the scene as it begins. */
  resetToStart(): void {
    this.following = false;
    this.orbit.reset();
  }

  /** Keeps all objects in view until the view is reset or panned. */
  followObjects(): void {
    this.resetView();
    this.following = true;
    this.requestRender();
  }

  stopFollowing(): void {
    this.following = false;
  }

  /** Names of the objects that are out of view, and of those that are far away. */
  lostObjects(): { outOfView: string[]; farAway: string[] } {
    const [graph] = this.graphs;
    if (graph === undefined || graph.frame === null) return { outOfView: [], farAway: [] };
    const names = (lost: (position: Vector3) => boolean) => graph.objects.filter(({ group }) => lost(group.position)).map(({ info }) => info.name);
    return { outOfView: names((position) => isOutOfView(position, this.orbit.camera)), farAway: names((position) => isFarAway(position, graph)) };
  }

  fitCamera(): void {
    const viewport = this.viewportOf(0);
    this.orbit.resize(viewport.width / viewport.height);
  }

  /** Viewport of a scene graph [px]: one fills the view, two are side by side, or stacked in a narrow window. */
  viewportOf(index: number): Rectangle {
    const { width, height } = this.size;
    const count = Math.max(1, this.graphs.length);
    if (count === 1) return { x: 0, y: 0, width, height };
    return width >= height
      ? { x: Math.round((index * width) / count), y: 0, width: Math.round(width / count), height }
      : { x: 0, y: Math.round((index * height) / count), width, height: Math.round(height / count) };
  }

  /** Area whose lower edge carries the legend [px]: the viewport, or its top where two narrow ones leave no room below. */
  legendAreaOf(index: number): Rectangle {
    const viewport = this.viewportOf(index);
    if (this.graphs.length < 2 || viewport.width > NARROW_WIDTH || viewport.height > MIN_ASPECT_FOR_LEGEND_BELOW * viewport.width) return viewport;
    return { ...viewport, height: index === 0 ? LEGEND_HEIGHT_WITH_BAR : LEGEND_HEIGHT };
  }

  requestRender(): void {
    this.dirty = true;
  }

  /** Scale of the colours that are shown; null without colours. */
  get colourScale(): GrowingRange | null {
    return this.settings.colour === "plain" ? null : this.scales[this.settings.colour];
  }

  /** Fixes the scales of logs by their largest displacement [m], strain and force [N]. */
  fixScales(largest: { displacement: number; strain: number; force: number }): void {
    this.scales.displacement.fix(largest.displacement);
    this.scales.strain.fix(largest.strain);
    if (this.forceRange instanceof GrowingRange) this.forceRange.fix(largest.force);
    this.requestRender();
  }

  /** Locks the scale of the colours, or fits it anew. */
  lockColourScale(locked: boolean): void {
    const scale = this.colourScale;
    if (scale === null) return;
    scale.locked = locked;
    this.rangeUpdatedAt = -1;
    this.requestRender();
  }

  get colourRange(): number {
    if (this.settings.colour === "plain") return 0;
    return this.scales[this.settings.colour].value;
  }

  /** Draws if anything changed; `now` [s]. */
  draw(now: number): void {
    if (this.following && this.graphs[0]?.frame != null) {
      const { center, radius } = this.graphs[0].sphereAroundObjects();
      this.orbit.follow(center, radius);
    }
    if (this.lost || !(this.dirty || this.orbit.changed)) return;
    this.dirty = this.orbit.changed = false;
    const { context, renderer, palette, size } = this;
    renderer.setClearColor(palette.background, 1);
    context.setTransform(size.ratio, 0, 0, size.ratio, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, size.width, size.height);
    if (this.graphs.length === 0) renderer.clear();
    if (this.settings.colour === "displacement" && !this.scales.displacement.locked) {
      const estimates = this.graphs.flatMap((graph) => graph.objects.map((object) => object.approximateDisplacement));
      this.scales.displacement.update(Math.max(0, ...estimates));
    }
    this.graphs.forEach((graph, i) => this.drawScene(graph, i));
    this.drawn?.();
    this.updateRange(now);
  }

  /** Draws the scene for a headset through a camera that the renderer places, without legends and labels; `now` [s]. */
  drawImmersive(camera: Camera, now: number): void {
    const [graph] = this.graphs;
    if (graph === undefined || this.lost) return;
    const { renderer } = this;
    const target = renderer.getRenderTarget();
    // Textures are drawn without the headset's cameras.
    renderer.xr.enabled = false;
    graph.applyTheme(this.settings, this.colourRange);
    graph.updateTargets(renderer);
    renderer.xr.enabled = true;
    renderer.setRenderTarget(target);
    renderer.setClearColor(this.palette.background, 1);
    renderer.render(graph.scene, camera);
    this.updateRange(now);
  }

  private drawScene(graph: SceneGraph, index: number): void {
    const { context, renderer, palette, size, settings } = this;
    const viewport = this.viewportOf(index);
    const camera = this.orbit.camera;
    renderer.setScissorTest(false);
    graph.applyTheme(settings, this.colourRange);
    graph.updateTargets(renderer);
    const y = size.height - viewport.y - viewport.height;
    renderer.setViewport(viewport.x, y, viewport.width, viewport.height);
    renderer.setScissor(viewport.x, y, viewport.width, viewport.height);
    renderer.setScissorTest(true);
    renderer.render(graph.scene, camera);

    // One colour bar and scale for all scenes.
    const legend = this.legendAreaOf(index);
    const bar = index > 0 ? 0 : drawColourBar(context, settings.colour, this.colourRange, legend, palette);
    if (index === 0) this.colourBarMoved?.(bar > 0 ? colourBarBox(legend) : null);
    if (settings.arrows && graph.labels.length > 0) {
      const pixels = (graph.maxArrowLength / this.orbit.viewHeightAt(camera.position.distanceTo(graph.center))) * viewport.height;
      drawArrowScale(context, graph.forceRange.value, pixels, legend, bar, palette);
    }
    const keepOut = [{ x: viewport.x, y: legend.y + legend.height - bar - 26, width: 260, height: bar + 26 }];
    drawLabels(context, graph.labels, camera, viewport, palette, keepOut);
    if (this.showsTime) drawTime(context, graph.frame?.time ?? 0, graph.info.title, viewport, palette);
    this.drawOverlay?.(context, viewport);
  }

  /** Updates the colour range at intervals. */
  private updateRange(now: number): void {
    const mode = this.settings.colour;
    if (mode === "plain" || this.scales[mode].locked || this.rangePending) return;
    if (this.graphs.length === 0 || (now >= this.rangeUpdatedAt && now < this.rangeUpdatedAt + RANGE_INTERVAL_S && this.rangeUpdatedAt >= 0)) return;
    if (this.rangeUpdatedAt < 0 && this.graphs.every((graph) => graph.frame !== null)) {
      // First frame: updated synchronously.
      this.rangeUpdatedAt = now;
      if (this.scales[mode].update(this.maxValue())) this.requestRender();
      return;
    }
    this.rangeUpdatedAt = now;
    this.rangePending = true;
    const scale = this.scales[mode];
    const objects = this.graphs.flatMap((graph) => graph.objects);
    Promise.all(objects.map((object) => object.maxValueAsync(this.renderer, mode)))
      .then((largest) => {
        if (scale.update(Math.max(0, ...largest))) this.requestRender();
      })
      .catch(() => undefined) // The scene was replaced meanwhile.
      .finally(() => {
        this.rangePending = false;
      });
  }

  /** Largest displacement [m] or strain of all scenes. Waits for the GPU. */
  maxValue(): number {
    const { colour } = this.settings;
    if (colour === "plain") return 0;
    return Math.max(0, ...this.graphs.flatMap((graph) => graph.objects.map((object) => object.maxValue(this.renderer, colour))));
  }

  /** Normalised device coordinates of a page position [px] in the first viewport. */
  toNdc(clientX: number, clientY: number): Vector2 {
    const box = this.canvas.getBoundingClientRect();
    const viewport = this.viewportOf(0);
    return new Vector2(((clientX - box.left - viewport.x) / viewport.width) * 2 - 1, 1 - ((clientY - box.top - viewport.y) / viewport.height) * 2);
  }

  /** View position [px] of a world point [m] in the first viewport. */
  toPixels(point: Vector3): Vector2 {
    const at = point.clone().project(this.orbit.camera);
    const viewport = this.viewportOf(0);
    return new Vector2(viewport.x + (0.5 + 0.5 * at.x) * viewport.width, viewport.y + (0.5 - 0.5 * at.y) * viewport.height);
  }

  /** PNG of canvas and overlay. */
  async png(): Promise<Blob> {
    const combined = document.createElement("canvas");
    combined.width = this.canvas.width;
    combined.height = this.canvas.height;
    const context = combined.getContext("2d");
    if (context === null) throw new Error("this browser offers no 2D canvas");
    context.drawImage(this.canvas, 0, 0);
    context.drawImage(this.overlay, 0, 0);
    return new Promise((done, failed) =>
      combined.toBlob((blob) => (blob === null ? failed(new Error("the PNG could not be encoded")) : done(blob)), "image/png"),
    );
  }

  clear(): void {
    for (const graph of this.graphs) graph.dispose();
    this.graphs = [];
    this.requestRender();
  }
}
