// Keyboard input: arrow keys move a pointer over the view, Enter presses and releases, Page Up and Page Down change
// its depth. A ring marks its position.

import type { TouchMode } from "../protocol/messages";
import type { Rectangle } from "../rendering/overlay";
import type { SceneView } from "../rendering/scene_view";
import type { Touches } from "./touches";

const KEY = "keyboard";
const SPEED = 0.55;
const DEPTH_PER_SECOND = 0.22;
const MOVES: Record<string, readonly [number, number, number]> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1],
  PageDown: [0, 0, -1],
};

export class KeyboardPointer {
  private x = 0;
  private y = 0;
  private readonly pressed = new Set<string>();
  private shown = false;
  private pointerUsed = false;
  private last = 0;

  constructor(
    private readonly sceneView: SceneView,
    private readonly touches: Touches,
    private readonly mode: () => TouchMode,
  ) {
    const { canvas } = sceneView;
    canvas.addEventListener("keydown", (event) => this.down(event));
    canvas.addEventListener("keyup", (event) => this.pressed.delete(event.key));
    canvas.addEventListener("blur", () => {
      this.pressed.clear();
      this.touches.end(KEY);
      this.hide();
    });
    // The ring appears only when the canvas was focused by keyboard.
    canvas.addEventListener("focus", () => {
      if (this.pointerUsed) return;
      this.shown = true;
      this.sceneView.requestRender();
    });
    const setPointerUsed = (pointerUsed: boolean) => {
      this.pointerUsed = pointerUsed;
      canvas.classList.toggle("keyboard-focus", !pointerUsed);
    };
    document.addEventListener("pointerdown", () => setPointerUsed(true), { capture: true });
    document.addEventListener(
      "keydown",
      (event) => {
        if (event.key === "Tab" || event.key === "Enter" || event.key in MOVES) setPointerUsed(false);
      },
      { capture: true },
    );
    canvas.addEventListener("pointerdown", () => this.hide());
  }

  private hide(): void {
    this.shown = false;
    this.sceneView.requestRender();
  }

  private down(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in MOVES) {
      this.pressed.add(event.key);
      this.shown = true;
    } else if (event.key === "Enter" && !event.repeat) {
      if (this.touches.has(KEY)) this.touches.end(KEY);
      else this.touches.begin(KEY, this.x, this.y, this.mode());
      this.shown = true;
    } else {
      return;
    }
    event.preventDefault();
    this.sceneView.requestRender();
  }

  animate(now: number): void {
    const seconds = Math.min(0.05, (now - this.last) / 1000);
    this.last = now;
    if (this.pressed.size === 0) return;
    const view = this.sceneView.viewportOf(0);
    for (const key of this.pressed) {
      const [right, up, deeper] = MOVES[key];
      this.x = Math.max(-0.95, Math.min(0.95, this.x + (right * SPEED * seconds * view.height) / view.width));
      this.y = Math.max(-0.95, Math.min(0.95, this.y + up * SPEED * seconds));
      this.touches.push(KEY, deeper * DEPTH_PER_SECOND * seconds);
    }
    this.touches.move(KEY, this.x, this.y);
    this.sceneView.requestRender();
  }

  draw(context: CanvasRenderingContext2D, view: Rectangle): void {
    if (!this.shown) return;
    const { palette } = this.sceneView;
    const x = view.x + (0.5 + 0.5 * this.x) * view.width;
    const y = view.y + (0.5 - 0.5 * this.y) * view.height;
    for (const [width, colour] of [
      [5, palette.halo],
      [2.5, palette.interfacePoint],
    ] as const) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.beginPath();
      context.arc(x, y, this.touches.has(KEY) ? 8 : 13, 0, 2 * Math.PI);
      context.moveTo(x - 2, y);
      context.lineTo(x + 2, y);
      context.moveTo(x, y - 2);
      context.lineTo(x, y + 2);
      context.stroke();
    }
  }
}
