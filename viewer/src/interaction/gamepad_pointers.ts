// Gamepad input: the left stick moves a pointer, the right stick changes its depth, a trigger presses. The rumble
// strength follows the contact force.

import type { TouchMode } from "../protocol/messages";
import type { Rectangle } from "../rendering/overlay";
import type { SceneView } from "../rendering/scene_view";
import type { Touches } from "./touches";

const DEAD_ZONE = 0.14;
const SPEED = 0.9;
const DEPTH_PER_SECOND = 0.3;
const PRESS_THRESHOLD = 0.25;
const CURSOR_DISPLAY_MS = 3000;
const RUMBLE_INTERVAL_MS = 60;

function stick(value: number | undefined): number {
  const size = Math.abs(value ?? 0);
  return size < DEAD_ZONE ? 0 : (Math.sign(value ?? 0) * (size - DEAD_ZONE)) / (1 - DEAD_ZONE);
}

export class GamepadPointers {
  private readonly cursors = new Map<number, { x: number; y: number; seen: number }>();
  private last = 0;
  private rumbleStartedAt = 0;

  constructor(
    private readonly sceneView: SceneView,
    private readonly touches: Touches,
    private readonly mode: () => TouchMode,
    /** Force on a device as a fraction of the displayed force range. */
    private readonly force: (device: number) => number,
  ) {}

  animate(now: number): void {
    const seconds = Math.min(0.05, (now - this.last) / 1000);
    this.last = now;
    if (typeof navigator.getGamepads !== "function") return;
    for (const pad of navigator.getGamepads()) {
      if (pad !== null) this.read(pad, now, seconds);
    }
  }

  private read(pad: Gamepad, now: number, seconds: number): void {
    const key = `gamepad ${pad.index}`;
    const cursor = this.cursors.get(pad.index) ?? { x: 0, y: 0, seen: -Infinity };
    this.cursors.set(pad.index, cursor);
    const [right, down, deeper] = [stick(pad.axes[0]), stick(pad.axes[1]), -stick(pad.axes[3])];
    const presses = Math.max(pad.buttons[7]?.value ?? 0, pad.buttons[6]?.value ?? 0, pad.buttons[0]?.value ?? 0) > PRESS_THRESHOLD;
    const view = this.sceneView.viewportOf(0);
    if (right !== 0 || down !== 0 || presses) cursor.seen = now;
    cursor.x = Math.max(-0.95, Math.min(0.95, cursor.x + (right * SPEED * seconds * view.height) / view.width));
    cursor.y = Math.max(-0.95, Math.min(0.95, cursor.y - down * SPEED * seconds));
    if (now - cursor.seen < CURSOR_DISPLAY_MS) this.sceneView.requestRender();
    if (presses && !this.touches.has(key)) this.touches.begin(key, cursor.x, cursor.y, this.mode());
    if (!presses) this.touches.end(key);
    this.touches.move(key, cursor.x, cursor.y);
    this.touches.push(key, deeper * DEPTH_PER_SECOND * seconds);
    const device = this.touches.deviceOf(key);
    if (device !== null) this.rumble(pad, this.force(device), now);
  }

  private rumble(pad: Gamepad, strength: number, now: number): void {
    if (now - this.rumbleStartedAt < RUMBLE_INTERVAL_MS || strength < 0.02) return;
    this.rumbleStartedAt = now;
    const strongMagnitude = Math.min(1, strength);
    // A gamepad without rumble rejects the call.
    pad.vibrationActuator
      ?.playEffect("dual-rumble", { duration: 2 * RUMBLE_INTERVAL_MS, strongMagnitude, weakMagnitude: strongMagnitude / 2 })
      .catch(() => undefined);
  }

  draw(context: CanvasRenderingContext2D, view: Rectangle, now: number): void {
    for (const { x, y, seen } of this.cursors.values()) {
      if (now - seen > CURSOR_DISPLAY_MS) continue;
      context.lineWidth = 3;
      context.strokeStyle = this.sceneView.palette.interfacePoint;
      context.beginPath();
      context.arc(view.x + (0.5 + 0.5 * x) * view.width, view.y + (0.5 - 0.5 * y) * view.height, 11, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}
