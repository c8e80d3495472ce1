// Mouse, pen and touch events of the canvas. A press on an object begins a touch; a press elsewhere moves the camera.

import type { TouchMode } from "../protocol/messages";
import type { SceneView } from "../rendering/scene_view";
import type { Touches } from "./touches";

const ROTATION_PER_HEIGHT = 3.4;
const WHEEL_ZOOM = 0.0012;
const WHEEL_PUSH = 0.00022;
const HOVER_INTERVAL_MS = 90;
const HOVER_TRIANGLES = 60_000;

interface CameraPointer {
  x: number;
  y: number;
  pans: boolean;
}

/** Pointer event handlers of the canvas. `touches` is null in log mode. */
export class PointerEvents {
  private readonly cameraPointers = new Map<number, CameraPointer>();
  private hoveredAt = 0;
  mode: TouchMode = "touch";

  constructor(
    private readonly sceneView: SceneView,
    private readonly touches: Touches | null,
  ) {
    const { canvas } = sceneView;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.up(event));
    canvas.addEventListener("lostpointercapture", (event) => this.up(event));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", (event) => {
      const at = sceneView.toNdc(event.clientX, event.clientY);
      if (this.touches === null || this.touches.hitTest(at.x, at.y) === null) sceneView.resetView();
    });
  }

  private key(event: PointerEvent): string {
    return `pointer ${event.pointerId}`;
  }

  private down(event: PointerEvent): void {
    const { canvas } = this.sceneView;
    canvas.focus({ preventScroll: true });
    // Prevents text selection and scrolling.
    event.preventDefault();
    canvas.setPointerCapture(event.pointerId);
    const middle = event.button === 1;
    const right = event.button === 2;
    if (this.touches !== null && !middle && !event.ctrlKey && !event.metaKey) {
      const other = right || event.shiftKey;
      const mode: TouchMode = other ? (this.mode === "touch" ? "hold" : "touch") : this.mode;
      const { x, y } = this.sceneView.toNdc(event.clientX, event.clientY);
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
      const { x, y } = this.sceneView.toNdc(event.clientX, event.clientY);
      this.touches.move(this.key(event), x, y);
      if (event.pointerType === "pen" && event.pressure > 0) this.touches.pressWith(this.key(event), event.pressure);
      return;
    }
    const pointer = this.cameraPointers.get(event.pointerId);
    if (pointer === undefined) this.hover(event);
    else this.moveCamera(event, pointer);
  }

  private moveCamera(event: PointerEvent, pointer: CameraPointer): void {
    const { orbit, canvas } = this.sceneView;
    const height = Math.max(1, canvas.clientHeight);
    const right = (event.clientX - pointer.x) / height;
    const down = (event.clientY - pointer.y) / height;
    const others = [...this.cameraPointers.values()].filter((other) => other !== pointer);
    if (others.length === 0) {
      if (pointer.pans) this.pan(right, down);
      else orbit.rotate(ROTATION_PER_HEIGHT * right, ROTATION_PER_HEIGHT * down);
    } else {
      // Two-finger gesture: pinch zooms, parallel motion pans.
      const [other] = others;
      const before = Math.hypot(pointer.x - other.x, pointer.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 8 && after > 8) orbit.zoom(before / after);
      this.pan(right / 2, down / 2);
    }
    pointer.x = event.clientX;
    pointer.y = event.clientY;
  }

  private pan(right: number, down: number): void {
    this.sceneView.stopFollowing();
    this.sceneView.orbit.pan(right, down);
  }

  private hover(event: PointerEvent): void {
    if (this.touches === null || event.pointerType !== "mouse" || event.buttons !== 0) return;
    if (performance.now() - this.hoveredAt < HOVER_INTERVAL_MS) return;
    this.hoveredAt = performance.now();
    const graph = this.sceneView.graphs[0];
    if (graph === undefined || graph.info.objects.some((object) => object.triangles > HOVER_TRIANGLES)) return;
    const { x, y } = this.sceneView.toNdc(event.clientX, event.clientY);
    this.sceneView.canvas.style.cursor = this.touches.hitTest(x, y) === null ? "" : this.mode === "hold" ? "grab" : "pointer";
  }

  private up(event: PointerEvent): void {
    this.cameraPointers.delete(event.pointerId);
    if (this.touches?.has(this.key(event)) !== true) return;
    this.touches.end(this.key(event));
    this.sceneView.canvas.style.cursor = "";
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 * event.deltaY : event.deltaY;
    if (this.touches !== null && this.touches.count > 0) this.touches.pushAll(-WHEEL_PUSH * pixels);
    else this.sceneView.orbit.zoom(Math.exp(WHEEL_ZOOM * Math.max(-300, Math.min(300, pixels))));
  }

  clear(): void {
    this.cameraPointers.clear();
    this.sceneView.canvas.style.cursor = "";
  }
}
