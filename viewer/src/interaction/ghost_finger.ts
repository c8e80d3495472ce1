// Ghost finger: shows what a press does until somebody presses. It is a pointer like any other, gentle, and drawn as a ghost.

import type { Rectangle } from "../rendering/overlay";
import { FONT } from "../rendering/overlay";
import type { SceneView } from "../rendering/scene_view";
import { PRESS_DEPTH, Touches } from "./touches";
import type { ClientMessage } from "../protocol/messages";

const KEY = "ghost";

/** Pointer number of the ghost: the last one of a page. */
export const GHOST_POINTER = { first: 15, count: 1 };

/** Depth of its press as a fraction of the object's radius. */
const DEPTH = 0.75 * PRESS_DEPTH;

// Times of a cycle [s].
const GLIDE = 0.9;
const PRESS = 1.1;
const REST = 1.2;
const PATIENCE = 0.6;

/** Places of the presses: right and up of the object's centre, in object radii. */
const PLACES: readonly (readonly [number, number])[] = [
  [0, 0.38],
  [-0.28, -0.05],
  [0.26, 0.1],
];

/** Where it may press. */
export interface GhostConditions {
  /** Whether the scene is one of the built-in ones, moves, and no one else touches it. */
  free: boolean;
}

/** Ghost finger of a page, until it is stopped for good. */
export class GhostFinger {
  private readonly touches: Touches;
  private stopped = false;
  private phase: "rest" | "glide" | "press" = "rest";
  /** Start of the phase [s]; null until the first picture. */
  private since: number | null = null;
  private place = 0;
  /** Position, start and end of the glide, in normalised device coordinates. */
  private at: [number, number] = [0.5, -0.4];
  private from: [number, number] = [0.5, -0.4];
  private to: [number, number] = [0, 0];

  constructor(
    private readonly sceneView: SceneView,
    send: (message: ClientMessage) => void,
  ) {
    this.touches = new Touches(sceneView, send, GHOST_POINTER, DEPTH);
  }

  /** Ends it for good. */
  stop(): void {
    if (this.stopped) return;
    this.stopped = true;
    this.touches.endAll();
    this.sceneView.requestRender();
  }

  get isStopped(): boolean {
    return this.stopped;
  }

  /** Ends a press: the scene is loaded, or the page is hidden. */
  interrupt(): void {
    this.touches.endAll();
    this.touches.suspend();
    this.phase = "rest";
    this.since = null;
  }

  /** The scene shows a frame. */
  resume(): void {
    this.touches.resume();
  }

  assign(pointer: number, device: number | null): void {
    this.touches.assign(pointer, device);
  }

  /** Its device slot, while it presses. */
  get device(): number | null {
    return this.touches.deviceOf(KEY);
  }

  /** Advances the cycle; `now` [ms]. */
  animate(now: number, { free }: GhostConditions): void {
    if (this.stopped) return;
    const seconds = now / 1000;
    this.since ??= seconds;
    const elapsed = seconds - this.since;
    // Until the server has named the slot, its own press looks like one of somebody else.
    const mayBeOwn = this.phase === "press" && this.device === null;
    if (!free && !mayBeOwn) {
      this.touches.endAll();
      this.enter("rest", seconds);
    } else if (this.phase === "rest") {
      if (elapsed > REST) this.aim(seconds);
    } else if (this.phase === "glide") {
      this.glide(elapsed, seconds);
    } else if (elapsed > PRESS || (this.device === null && elapsed > PATIENCE)) {
      this.touches.endAll();
      this.place++;
      this.enter("rest", seconds);
    }
    this.touches.animate(now);
    if (this.phase !== "rest" || elapsed < 2 * REST) this.sceneView.requestRender();
  }

  private enter(phase: "rest" | "glide" | "press", seconds: number): void {
    this.phase = phase;
    this.since = seconds;
  }

  /** Chooses the next place that lies on a surface. */
  private aim(seconds: number): void {
    for (let tries = 0; tries < PLACES.length; tries++, this.place++) {
      const target = this.placeInView(PLACES[this.place % PLACES.length]);
      if (target === null || this.touches.hitTest(...target) === null) continue;
      [this.from, this.to] = [this.at, target];
      this.enter("glide", seconds);
      return;
    }
    this.enter("rest", seconds);
  }

  private placeInView([right, up]: readonly [number, number]): [number, number] | null {
    const object = this.sceneView.graphs[0]?.objects[0];
    if (object === undefined) return null;
    const { camera } = this.sceneView.orbit;
    const m = camera.matrixWorld.elements;
    const at = object.group.position.clone();
    const { radius } = object.info;
    for (const [k, axis] of (["x", "y", "z"] as const).entries()) at[axis] += radius * (right * m[k] + up * m[4 + k]);
    at.project(camera);
    return Math.max(Math.abs(at.x), Math.abs(at.y)) < 0.95 && Math.abs(at.z) < 1 ? [at.x, at.y] : null;
  }

  private glide(elapsed: number, seconds: number): void {
    const share = Math.min(1, elapsed / GLIDE);
    const eased = share * share * (3 - 2 * share);
    this.at = [0, 1].map((k) => this.from[k] + eased * (this.to[k] - this.from[k])) as [number, number];
    if (share < 1) return;
    this.enter(this.touches.begin(KEY, ...this.at, "touch") ? "press" : "rest", seconds);
  }

  /** Draws a dashed ring with a hand and its name. */
  draw(context: CanvasRenderingContext2D, view: Rectangle): void {
    if (this.stopped || this.since === null) return;
    const pressing = this.phase === "press";
    if (this.phase === "rest" && this.place === 0) return;
    const { palette } = this.sceneView;
    const x = view.x + (0.5 + 0.5 * this.at[0]) * view.width;
    const y = view.y + (0.5 - 0.5 * this.at[1]) * view.height;
    context.save();
    context.globalAlpha = this.phase === "rest" ? 0.45 : 0.85;
    context.setLineDash([5, 4]);
    context.lineWidth = 2;
    context.strokeStyle = palette.interfacePoint;
    context.beginPath();
    context.arc(x, y, pressing ? 13 : 19, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    drawHand(context, x, y, pressing ? 0.92 : 1);
    context.font = `500 12px ${FONT}`;
    context.textBaseline = "middle";
    context.lineJoin = "round";
    context.lineWidth = 3.5;
    context.strokeStyle = palette.halo;
    // To the left: labels of forces stand to the right of their arrows.
    context.textAlign = "right";
    context.strokeText("ghost finger", x - 22, y + 24);
    context.fillStyle = palette.text;
    context.fillText("ghost finger", x - 22, y + 24);
    context.restore();
  }
}

/** Outline of a pointing hand, whose finger tip is at the origin [px]. */
const HAND = "M-5 6V2a5 5 0 0 1 10 0V17l3 -1a5 5 0 0 1 5 3l3 -.5a5 5 0 0 1 5 5V31a11 11 0 0 1 -11 11H3a11 11 0 0 1 -9 -5l-8 -12a4.500 4.500 0 0 1 7 -6l2 3z";

/** Colours of the hand, in both themes. */
const HAND_FILL = "#ffffffc0";
const HAND_LINE = "#1d2730";

function drawHand(context: CanvasRenderingContext2D, x: number, y: number, size: number): void {
  context.save();
  context.translate(x, y);
  context.scale(size, size);
  const hand = new Path2D(HAND);
  context.fillStyle = HAND_FILL;
  context.fill(hand);
  context.lineWidth = 1.6;
  context.lineJoin = "round";
  context.strokeStyle = HAND_LINE;
  context.stroke(hand);
  context.restore();
}

/** Whether the page may show a ghost finger: not with `?ghost=off`, nor where the user wants less motion. */
export function wantsGhost(address: string, reducedMotion: boolean): boolean {
  return new URL(address).searchParams.get("ghost") !== "off" && !reducedMotion;
}
