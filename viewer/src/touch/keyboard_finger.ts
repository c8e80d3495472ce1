// A finger for the keyboard: arrow keys move it over the picture, Enter presses and lets go, Page Up and Page Down
// push it deeper and draw it back. A ring shows where it is.

import type { TouchMode } from "../protocol/messages";
import type { Rectangle } from "../picture/overlay";
import type { Stage } from "../picture/stage";
import type { Touches } from "./touches";

const KEY = "keyboard";
const SPEED = 0.55;
const PUSH_PER_SECOND = 0.22;
const MOVES: Record<string, readonly [number, number, number]> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1],
  PageDown: [0, 0, -1],
};

export class KeyboardFinger {
  private x = 0;
  private y = 0;
  private readonly pressed = new Set<string>();
  private shown = false;
  private byPointer = false;
  private last = 0;

  constructor(
    private readonly stage: Stage,
    private readonly touches: Touches,
    private readonly mode: () => TouchMode,
  ) {
    const { canvas } = stage;
    canvas.addEventListener("keydown", (event) => this.down(event));
    canvas.addEventListener("keyup", (event) => this.pressed.delete(event.key));
    canvas.addEventListener("blur", () => {
      this.pressed.clear();
      this.touches.end(KEY);
      this.hide();
    });
    // Script may focus the picture too; only who came by keyboard wants the ring.
    canvas.addEventListener("focus", () => {
      if (this.byPointer) return;
      this.shown = true;
      this.stage.redraw();
    });
    const came = (byPointer: boolean) => {
      this.byPointer = byPointer;
      canvas.classList.toggle("keyed", !byPointer);
    };
    document.addEventListener("pointerdown", () => came(true), { capture: true });
    document.addEventListener(
      "keydown",
      (event) => {
        if (event.key === "Tab" || event.key === "Enter" || event.key in MOVES) came(false);
      },
      { capture: true },
    );
    canvas.addEventListener("pointerdown", () => this.hide());
  }

  private hide(): void {
    this.shown = false;
    this.stage.redraw();
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
    this.stage.redraw();
  }

  frame(now: number): void {
    const seconds = Math.min(0.05, (now - this.last) / 1000);
    this.last = now;
    if (this.pressed.size === 0) return;
    const view = this.stage.viewOf(0);
    for (const key of this.pressed) {
      const [right, up, deeper] = MOVES[key];
      this.x = Math.max(-0.95, Math.min(0.95, this.x + (right * SPEED * seconds * view.height) / view.width));
      this.y = Math.max(-0.95, Math.min(0.95, this.y + up * SPEED * seconds));
      this.touches.push(KEY, deeper * PUSH_PER_SECOND * seconds);
    }
    this.touches.move(KEY, this.x, this.y);
    this.stage.redraw();
  }

  draw(pen: CanvasRenderingContext2D, view: Rectangle): void {
    if (!this.shown) return;
    const { palette } = this.stage;
    const x = view.x + (0.5 + 0.5 * this.x) * view.width;
    const y = view.y + (0.5 - 0.5 * this.y) * view.height;
    for (const [width, colour] of [
      [5, palette.halo],
      [2.5, palette.hand],
    ] as const) {
      pen.lineWidth = width;
      pen.strokeStyle = colour;
      pen.beginPath();
      pen.arc(x, y, this.touches.has(KEY) ? 8 : 13, 0, 2 * Math.PI);
      pen.moveTo(x - 2, y);
      pen.lineTo(x + 2, y);
      pen.moveTo(x, y - 2);
      pen.lineTo(x, y + 2);
      pen.stroke();
    }
  }
}
