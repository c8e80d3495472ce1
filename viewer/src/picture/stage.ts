// The place where scenes are drawn: one canvas for WebGL, one above it for what is written, one camera for all.

import { Vector2, Vector3, WebGLRenderer } from "three";
import { wantsVertices } from "../protocol/address";
import { OrbitCamera } from "./camera";
import { DARK, LIGHT, type Palette } from "./colours";
import { limitsOf } from "./elastic/passes";
import type { Limits } from "./elastic/layout";
import { drawArrowScale, drawColourBar, drawLabels, drawTime, type Rectangle } from "./overlay";
import { CalmRange } from "./scale";
import { World, type Loaded, type Look } from "./world";

const MEASURE_EVERY_S = 0.15;
// Views up to this width have no room beside what they show, and below it only from this height per width on [pixels].
const NARROW = 480;
const ROOM_BELOW = 1.3;
// A caption, the arrows' scale, and the colour bar [pixels].
const HEAD = 62;
const HEAD_WITH_BAR = 116;

export interface StageSize {
  width: number;
  height: number;
  ratio: number;
}

export class Stage {
  readonly canvas = document.createElement("canvas");
  readonly overlay = document.createElement("canvas");
  readonly orbit = new OrbitCamera();
  readonly renderer: WebGLRenderer;
  readonly limits: Limits;
  /** Whether this machine can sum modes on its GPU. */
  readonly sumsModes: boolean;
  worlds: World[] = [];
  look: Look;
  /** Says time and title in the picture itself. */
  writesTime = false;
  /** Drawn over everything, by those who show where a keyboard's finger is. */
  drawOver: ((pen: CanvasRenderingContext2D, view: Rectangle) => void) | null = null;
  private readonly pen: CanvasRenderingContext2D;
  private size: StageSize = { width: 1, height: 1, ratio: 1 };
  private readonly ranges = { displacement: new CalmRange(1e-4), strain: new CalmRange(2e-3) };
  private fixedRange: number | null = null;
  private measuring = false;
  private measuredAt = -1;
  private stale = true;
  lost = false;

  constructor(look: Look) {
    this.look = look;
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.autoClear = true;
    this.limits = limitsOf(this.renderer);
    this.sumsModes = this.renderer.extensions.has("EXT_color_buffer_float") && !wantsVertices();
    const pen = this.overlay.getContext("2d");
    if (pen === null) throw new Error("this browser gives no canvas to draw on");
    this.pen = pen;
  }

  get palette(): Palette {
    return this.look.dark ? DARK : LIGHT;
  }

  /** Everything that is drawn of a scene, in place of what was there. */
  put(index: number, loaded: Loaded): World {
    this.worlds[index]?.dispose();
    const world = new World(loaded, this.limits, this.sumsModes, this.orbit.up);
    this.worlds[index] = world;
    if (index === 0) {
      this.ranges.displacement = new CalmRange(2e-3 * Math.max(...world.objects.map((o) => o.info.radius), 1e-3));
      this.ranges.strain = new CalmRange(5e-3);
    }
    this.measuredAt = -1;
    this.redraw();
    return world;
  }

  resize(width: number, height: number, ratio: number): void {
    if (width < 1 || height < 1) return;
    this.size = { width, height, ratio };
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.overlay.width = Math.round(width * ratio);
    this.overlay.height = Math.round(height * ratio);
    this.fitCamera();
    this.redraw();
  }

  /** The usual view: of the place of the scene, or of where its objects have gone. */
  home(): void {
    const [world] = this.worlds;
    const strayed = world !== undefined && world.middleOfObjects().distanceTo(world.center) > 1.5 * world.radius;
    this.orbit.home(strayed ? world.middleOfObjects() : undefined);
  }

  /** Whether the objects have left the picture. */
  get empty(): boolean {
    const [world] = this.worlds;
    if (world === undefined || world.objects.length === 0) return false;
    const at = world.middleOfObjects().project(this.orbit.camera);
    return Math.abs(at.x) > 1.15 || Math.abs(at.y) > 1.15 || Math.abs(at.z) > 1;
  }

  fitCamera(): void {
    const view = this.viewOf(0);
    this.orbit.resize(view.width / view.height);
  }

  /** The part of the stage that a world has: one fills it, two stand side by side, or above one another if it is narrow. */
  viewOf(index: number): Rectangle {
    const { width, height } = this.size;
    const count = Math.max(1, this.worlds.length);
    if (count === 1) return { x: 0, y: 0, width, height };
    return width >= height
      ? { x: Math.round((index * width) / count), y: 0, width: Math.round(width / count), height }
      : { x: 0, y: Math.round((index * height) / count), width, height: Math.round(height / count) };
  }

  /** The part of a view that scales are written at the foot of: all of it; its head where two narrow ones leave no room below. */
  legendOf(index: number): Rectangle {
    const view = this.viewOf(index);
    if (this.worlds.length < 2 || view.width > NARROW || view.height > ROOM_BELOW * view.width) return view;
    return { ...view, height: index === 0 ? HEAD_WITH_BAR : HEAD };
  }

  redraw(): void {
    this.stale = true;
  }

  fixRange(range: number | null): void {
    this.fixedRange = range;
  }

  get colourRange(): number {
    if (this.look.colour === "plain") return 0;
    return this.fixedRange ?? this.ranges[this.look.colour].value;
  }

  /** Draws if there is something new. `now` in seconds. */
  draw(now: number): void {
    if (this.lost || !(this.stale || this.orbit.changed)) return;
    this.stale = this.orbit.changed = false;
    const { pen, renderer, palette, size } = this;
    renderer.setClearColor(palette.background, 1);
    pen.setTransform(size.ratio, 0, 0, size.ratio, 0, 0);
    pen.clearRect(0, 0, size.width, size.height);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, size.width, size.height);
    if (this.worlds.length === 0) renderer.clear();
    if (this.look.colour === "displacement" && this.fixedRange === null) {
      const about = this.worlds.flatMap((world) => world.objects.map((object) => object.displacementAbout));
      this.ranges.displacement.take(Math.max(0, ...about), now);
    }
    this.worlds.forEach((world, i) => this.drawWorld(world, i));
    this.measure(now);
  }

  private drawWorld(world: World, index: number): void {
    const { pen, renderer, palette, size, look } = this;
    const view = this.viewOf(index);
    const camera = this.orbit.camera;
    renderer.setScissorTest(false);
    world.dress(look, this.colourRange);
    world.prepare(renderer);
    const y = size.height - view.y - view.height;
    renderer.setViewport(view.x, y, view.width, view.height);
    renderer.setScissor(view.x, y, view.width, view.height);
    renderer.setScissorTest(true);
    renderer.render(world.scene, camera);

    // All share one scale.
    const legend = this.legendOf(index);
    const bar = index > 0 ? 0 : drawColourBar(pen, look.colour, this.colourRange, legend, palette);
    if (look.arrows && world.labels.length > 0) {
      const pixels = (world.longestArrow / this.orbit.heightAt(camera.position.distanceTo(world.center))) * view.height;
      drawArrowScale(pen, world.forceRange.value, pixels, legend, bar, palette);
    }
    const keepOut = [{ x: view.x, y: legend.y + legend.height - bar - 26, width: 260, height: bar + 26 }];
    drawLabels(pen, world.labels, camera, view, palette, keepOut);
    if (this.writesTime) drawTime(pen, world.picture?.time ?? 0, world.info.title, view, palette);
    this.drawOver?.(pen, view);
  }

  /** Looks how far the colours have to reach, now and then. */
  private measure(now: number): void {
    const mode = this.look.colour;
    if (mode === "plain" || this.fixedRange !== null || this.measuring) return;
    if (this.worlds.length === 0 || (now >= this.measuredAt && now < this.measuredAt + MEASURE_EVERY_S && this.measuredAt >= 0)) return;
    if (this.measuredAt < 0 && this.worlds.every((world) => world.picture !== null)) {
      // The first picture has its colours at once.
      this.measuredAt = now;
      if (this.ranges[mode].take(this.largest(), now)) this.redraw();
      return;
    }
    this.measuredAt = now;
    this.measuring = true;
    const objects = this.worlds.flatMap((world) => world.objects);
    Promise.all(objects.map((object) => object.largestSoon(this.renderer, mode)))
      .then((largest) => {
        if (this.ranges[mode].take(Math.max(0, ...largest), now)) this.redraw();
      })
      .catch(() => undefined) // The scene has gone meanwhile.
      .finally(() => {
        this.measuring = false;
      });
  }

  /** The largest value of all worlds now, waiting for it. */
  largest(): number {
    const { colour } = this.look;
    if (colour === "plain") return 0;
    return Math.max(0, ...this.worlds.flatMap((world) => world.objects.map((object) => object.largest(this.renderer, colour))));
  }

  /** From a place on the page to −1…1 of the picture of the first world. */
  toPicture(clientX: number, clientY: number): Vector2 {
    const box = this.canvas.getBoundingClientRect();
    const view = this.viewOf(0);
    return new Vector2(((clientX - box.left - view.x) / view.width) * 2 - 1, 1 - ((clientY - box.top - view.y) / view.height) * 2);
  }

  /** From a point of the world to pixels of the stage. */
  toStage(point: Vector3): Vector2 {
    const at = point.clone().project(this.orbit.camera);
    const view = this.viewOf(0);
    return new Vector2(view.x + (0.5 + 0.5 * at.x) * view.width, view.y + (0.5 - 0.5 * at.y) * view.height);
  }

  /** Picture and writing as one. */
  async png(): Promise<Blob> {
    const both = document.createElement("canvas");
    both.width = this.canvas.width;
    both.height = this.canvas.height;
    const pen = both.getContext("2d");
    if (pen === null) throw new Error("this browser gives no canvas to draw on");
    pen.drawImage(this.canvas, 0, 0);
    pen.drawImage(this.overlay, 0, 0);
    return new Promise((done, failed) =>
      both.toBlob((blob) => (blob === null ? failed(new Error("no PNG came of the picture")) : done(blob)), "image/png"),
    );
  }

  clear(): void {
    for (const world of this.worlds) world.dispose();
    this.worlds = [];
    this.redraw();
  }
}
