// Mouse, pen and fingers on the picture. What begins on an object is a touch; what begins elsewhere turns the camera.

import type { TouchMode } from "../protocol/messages";
import type { Stage } from "../picture/stage";
import type { Touches } from "./touches";

const TURN_PER_HEIGHT = 3.4;
const WHEEL_ZOOM = 0.0012;
const WHEEL_PUSH = 0.00022;
const LOOK_EVERY_MS = 90;
const HOVER_TRIANGLES = 60_000;

interface CameraPointer {
  x: number;
  y: number;
  pans: boolean;
}

export class Pointers {
  private readonly cameraPointers = new Map<number, CameraPointer>();
  private hoveredAt = 0;
  mode: TouchMode = "touch";

  constructor(
    private readonly stage: Stage,
    private readonly touches: Touches | null,
  ) {
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.up(event));
    canvas.addEventListener("lostpointercapture", (event) => this.up(event));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", (event) => {
      const at = stage.toPicture(event.clientX, event.clientY);
      if (this.touches === null || this.touches.at(at.x, at.y) === null) stage.home();
    });
  }

  private key(event: PointerEvent): string {
    return `pointer ${event.pointerId}`;
  }

  private down(event: PointerEvent): void {
    const { canvas } = this.stage;
    canvas.focus({ preventScroll: true });
    // Otherwise a press would select text or scroll.
    event.preventDefault();
    canvas.setPointerCapture(event.pointerId);
    const middle = event.button === 1;
    const right = event.button === 2;
    if (this.touches !== null && !middle && !event.ctrlKey && !event.metaKey) {
      const other = right || event.shiftKey;
      const mode: TouchMode = other ? (this.mode === "touch" ? "hold" : "touch") : this.mode;
      const { x, y } = this.stage.toPicture(event.clientX, event.clientY);
      if (this.touches.begin(this.key(event), x, y, mode)) {
        canvas.style.cursor = "grabbing";
        return;
      }
    }
    const pans = middle || right || event.ctrlKey || event.metaKey || event.shiftKey;
    this.cameraPointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans });
  }

  private move(event: PointerEvent): void {
    if (this.touches?.has(this.key(event)) === true) {
      const { x, y } = this.stage.toPicture(event.clientX, event.clientY);
      this.touches.move(this.key(event), x, y);
      if (event.pointerType === "pen" && event.pressure > 0) this.touches.press(this.key(event), event.pressure);
      return;
    }
    const pointer = this.cameraPointers.get(event.pointerId);
    if (pointer === undefined) this.hover(event);
    else this.moveCamera(event, pointer);
  }

  private moveCamera(event: PointerEvent, pointer: CameraPointer): void {
    const { orbit, canvas } = this.stage;
    const height = Math.max(1, canvas.clientHeight);
    const right = (event.clientX - pointer.x) / height;
    const down = (event.clientY - pointer.y) / height;
    const others = [...this.cameraPointers.values()].filter((other) => other !== pointer);
    if (others.length === 0) {
      if (pointer.pans) orbit.pan(right, down);
      else orbit.turn(TURN_PER_HEIGHT * right, TURN_PER_HEIGHT * down);
    } else {
      // Two fingers: apart brings nearer, together moves.
      const [other] = others;
      const before = Math.hypot(pointer.x - other.x, pointer.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 8 && after > 8) orbit.zoom(before / after);
      orbit.pan(right / 2, down / 2);
    }
    pointer.x = event.clientX;
    pointer.y = event.clientY;
  }

  private hover(event: PointerEvent): void {
    if (this.touches === null || event.pointerType !== "mouse" || event.buttons !== 0) return;
    if (performance.now() - this.hoveredAt < LOOK_EVERY_MS) return;
    this.hoveredAt = performance.now();
    const world = this.stage.worlds[0];
    if (world === undefined || world.info.objects.some((object) => object.triangles > HOVER_TRIANGLES)) return;
    const { x, y } = this.stage.toPicture(event.clientX, event.clientY);
    this.stage.canvas.style.cursor = this.touches.at(x, y) === null ? "" : this.mode === "hold" ? "grab" : "pointer";
  }

  private up(event: PointerEvent): void {
    this.cameraPointers.delete(event.pointerId);
    if (this.touches?.has(this.key(event)) !== true) return;
    this.touches.end(this.key(event));
    this.stage.canvas.style.cursor = "";
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 * event.deltaY : event.deltaY;
    if (this.touches !== null && this.touches.count > 0) this.touches.pushAll(-WHEEL_PUSH * pixels);
    else this.stage.orbit.zoom(Math.exp(WHEEL_ZOOM * Math.max(-300, Math.min(300, pixels))));
  }

  forget(): void {
    this.cameraPointers.clear();
    this.stage.canvas.style.cursor = "";
  }
}
