// A gamepad as a finger: the left stick moves it, the right one pushes it deeper, a trigger presses, and it shakes
// the harder the larger the force is.

import type { TouchMode } from "../protocol/messages";
import type { Rectangle } from "../picture/overlay";
import type { Stage } from "../picture/stage";
import type { Touches } from "./touches";

const DEAD = 0.14;
const SPEED = 0.9;
const PUSH_PER_SECOND = 0.3;
const PRESSED = 0.25;
const RUMBLE_EVERY_MS = 60;

function stick(value: number | undefined): number {
  const size = Math.abs(value ?? 0);
  return size < DEAD ? 0 : (Math.sign(value ?? 0) * (size - DEAD)) / (1 - DEAD);
}

export class GamepadFingers {
  private readonly places = new Map<number, { x: number; y: number; seen: number }>();
  private last = 0;
  private rumbledAt = 0;

  constructor(
    private readonly stage: Stage,
    private readonly touches: Touches,
    private readonly mode: () => TouchMode,
    /** Of a device, as a share of the largest one that is shown. */
    private readonly force: (device: number) => number,
  ) {}

  frame(now: number): void {
    const seconds = Math.min(0.05, (now - this.last) / 1000);
    this.last = now;
    if (typeof navigator.getGamepads !== "function") return;
    for (const pad of navigator.getGamepads()) {
      if (pad !== null) this.read(pad, now, seconds);
    }
  }

  private read(pad: Gamepad, now: number, seconds: number): void {
    const key = `gamepad ${pad.index}`;
    const place = this.places.get(pad.index) ?? { x: 0, y: 0, seen: -Infinity };
    this.places.set(pad.index, place);
    const [right, down, deeper] = [stick(pad.axes[0]), stick(pad.axes[1]), -stick(pad.axes[3])];
    const presses = Math.max(pad.buttons[7]?.value ?? 0, pad.buttons[6]?.value ?? 0, pad.buttons[0]?.value ?? 0) > PRESSED;
    const view = this.stage.viewOf(0);
    if (right !== 0 || down !== 0 || presses) place.seen = now;
    place.x = Math.max(-0.95, Math.min(0.95, place.x + (right * SPEED * seconds * view.height) / view.width));
    place.y = Math.max(-0.95, Math.min(0.95, place.y - down * SPEED * seconds));
    if (now - place.seen < 3000) this.stage.redraw();
    if (presses && !this.touches.has(key)) this.touches.begin(key, place.x, place.y, this.mode());
    if (!presses) this.touches.end(key);
    this.touches.move(key, place.x, place.y);
    this.touches.push(key, deeper * PUSH_PER_SECOND * seconds);
    const device = this.touches.deviceOf(key);
    if (device !== null) this.rumble(pad, this.force(device), now);
  }

  private rumble(pad: Gamepad, strength: number, now: number): void {
    if (now - this.rumbledAt < RUMBLE_EVERY_MS || strength < 0.02) return;
    this.rumbledAt = now;
    const strongMagnitude = Math.min(1, strength);
    // A pad that cannot shake refuses; that is all right.
    pad.vibrationActuator
      ?.playEffect("dual-rumble", { duration: 2 * RUMBLE_EVERY_MS, strongMagnitude, weakMagnitude: strongMagnitude / 2 })
      .catch(() => undefined);
  }

  draw(pen: CanvasRenderingContext2D, view: Rectangle, now: number): void {
    for (const { x, y, seen } of this.places.values()) {
      if (now - seen > 3000) continue;
      pen.lineWidth = 3;
      pen.strokeStyle = this.stage.palette.hand;
      pen.beginPath();
      pen.arc(view.x + (0.5 + 0.5 * x) * view.width, view.y + (0.5 - 0.5 * y) * view.height, 11, 0, 2 * Math.PI);
      pen.stroke();
    }
  }
}
