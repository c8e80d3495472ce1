// Pointers of a live scene: mouse and touch screen, keyboard, gamepads, hands in VR, the ghost finger; what they feel shakes a phone.

import { GamepadPointers } from "../interaction/gamepad_pointers";
import { GhostFinger, wantsGhost } from "../interaction/ghost_finger";
import { KeyboardPointer } from "../interaction/keyboard_pointer";
import { PointerEvents } from "../interaction/pointer_events";
import { Touches } from "../interaction/touches";
import type { Vibration } from "../interaction/vibration";
import type { ClientMessage, DeviceAssigned, TouchMode } from "../protocol/messages";
import type { Rectangle } from "../rendering/overlay";
import type { SceneView } from "../rendering/scene_view";
import { vibrationSwitch } from "../ui/vibration_switch";
import { HAND_POINTERS, VrHands } from "../xr/vr_hands";
import type { LiveScene } from "./live_scene";

export class LivePointers {
  readonly touches: Touches;
  /** Hands in VR. */
  readonly hands: VrHands;
  /** Switch of the vibration, where the browser vibrates. */
  readonly vibrationRow: HTMLElement[];
  private readonly pointers: PointerEvents;
  private readonly keyboard: KeyboardPointer;
  private readonly gamepads: GamepadPointers;
  private readonly ghost: GhostFinger;
  private readonly vibration: Vibration;

  constructor(
    private readonly sceneView: SceneView,
    private readonly shown: LiveScene,
    send: (message: ClientMessage) => void,
    ghostMayCome: boolean,
  ) {
    this.touches = new Touches(sceneView, send, { first: 0, count: HAND_POINTERS.first });
    this.hands = new VrHands(send);
    this.ghost = new GhostFinger(sceneView, send);
    if (!ghostMayCome || !wantsGhost(window.location.href, window.matchMedia("(prefers-reduced-motion: reduce)").matches)) this.ghost.stop();
    // Before the canvas gets the press, so that the device slot is free.
    document.addEventListener("pointerdown", (event) => event.target === sceneView.canvas && this.ghost.stop(), { capture: true });
    this.pointers = new PointerEvents(sceneView, this.touches);
    this.pointers.mode = window.matchMedia("(pointer: coarse)").matches ? "hold" : "touch";
    const mode = () => this.pointers.mode;
    this.keyboard = new KeyboardPointer(sceneView, this.touches, mode);
    this.gamepads = new GamepadPointers(sceneView, this.touches, mode, (device) => this.forceShare(device));
    const { vibration, row } = vibrationSwitch();
    this.vibration = vibration;
    this.vibrationRow = row;
    sceneView.drawOverlay = (context, view) => this.draw(context, view);
  }

  get mode(): TouchMode {
    return this.pointers.mode;
  }

  set mode(mode: TouchMode) {
    this.pointers.mode = mode;
  }

  /** Force on a device, as a share of the displayed force range. */
  private forceShare(device: number): number {
    const force = this.shown.frame?.devices[device]?.force ?? [0, 0, 0];
    return Math.hypot(...force) / (this.sceneView.graphs[0]?.forceRange.value ?? 1);
  }

  /** Device slots that this page's pointers and hands have. */
  get devices(): number[] {
    return [...this.touches.devices, ...this.hands.devices];
  }

  stopGhost(): void {
    this.ghost.stop();
  }

  assign(message: DeviceAssigned): void {
    this.touches.assign(message.pointer, message.device);
    this.hands.assign(message.pointer, message.device);
    this.ghost.assign(message.pointer, message.device);
  }

  /** Lets presses wait for the next frame of a scene that is loaded. */
  suspend(): void {
    this.touches.suspend();
    this.hands.suspend();
    this.ghost.interrupt();
  }

  /** Lets presses that wait begin. */
  resume(): void {
    this.touches.resume();
    this.hands.resume();
    this.ghost.resume();
  }

  /** Ends the presses of a page that nobody sees. */
  hidden(): void {
    this.touches.endAll();
    this.ghost.interrupt();
    this.ghost.resume();
  }

  clear(): void {
    this.pointers.clear();
  }

  /** Moves the pointers, before the newest frame is shown; the ghost finger comes where `ghostIsFree` and nobody touches. */
  animate(now: number, ghostIsFree: boolean): void {
    this.keyboard.animate(now);
    this.gamepads.animate(now);
    this.touches.animate(now);
    this.ghost.animate(now, { free: ghostIsFree && !this.isTouched() });
  }

  vibrate(now: number): void {
    this.vibration.animate(new Map(this.devices.map((device) => [device, this.forceShare(device)])), now);
  }

  /** Whether a pointer other than the ghost touches the scene. */
  private isTouched(): boolean {
    const info = this.sceneView.graphs[0]?.info;
    return this.shown.frame?.devices.some(({ mode }, i) => mode !== "inactive" && info?.devices[i]?.pointer === true && i !== this.ghost.device) ?? false;
  }

  private draw(context: CanvasRenderingContext2D, view: Rectangle): void {
    this.keyboard.draw(context, view);
    this.gamepads.draw(context, view, performance.now());
    this.touches.draw(context, view);
    this.ghost.draw(context, view);
  }
}
