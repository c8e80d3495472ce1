// Haptic device of a page without a server: a Haply Inverse3 on this computer, by its service.

import { Quaternion, Vector3 } from "three";
import type { HapticDeviceStatus } from "../protocol/messages";
import type { WorkerConnection } from "../protocol/worker_connection";
import type { SceneView } from "../rendering/scene_view";
import type { HaplyPlace } from "../worker/messages";
import { turnToCamera } from "../xr/vr_stage";
import { element, section } from "./elements";

const ADDRESS = "ws://localhost:10001";
/** Radius of the device's workspace that covers the scene's [m]. */
const REACH = 0.1;
/** Height of the first reading above the scene's centre, in radii of the scene. */
const START = 1.2;

/** Place of a device: its first reading above the scene, its directions those of the page's camera. */
export function placeAbove(center: Vector3, radius: number, up: Vector3, toCamera: Vector3): HaplyPlace {
  const start = center.clone().addScaledVector(up, START * radius);
  const { w, x, y, z } = new Quaternion().setFromRotationMatrix(turnToCamera(up, toCamera));
  return { start: start.toArray(), orientation: [w, x, y, z], scale: radius / REACH };
}

/** Force of a device in words. */
export function forceText({ force, max_force_n }: HapticDeviceStatus): string {
  switch (force) {
    case "off":
      return `press a button of its grip to switch the force on (${max_force_n} N at most)`;
    case "on":
      return `the force is on (${max_force_n} N at most)`;
    case "late_updates":
      return "the force is held back, since this computer answers the device too late; close other programs and tabs";
    case "implausible_motion":
      return "the force is held back, since the hand is too fast or too far from its start";
  }
}

export class HaplyPanel {
  readonly section: HTMLElement;
  private readonly address = element("input", { type: "url", attributes: { value: ADDRESS, "aria-label": "Address of the Inverse Service" } });
  private readonly button = element("button", { class: "button wide", type: "button", text: "Connect", on: { click: () => this.toggle() } });
  private readonly state = element("p", { class: "secondary", role: "status" });
  private isOn = false;
  /** Name of the connected device. */
  private device: string | null = null;

  constructor(
    private readonly worker: WorkerConnection,
    private readonly sceneView: SceneView,
  ) {
    worker.onHaply = (state, text) => {
      if (!this.isOn) return;
      this.device = state === "connected" ? text : null;
      this.state.textContent = state === "connected" ? `${text} is connected.` : `Waiting: ${text}.`;
      if (state === "connected") this.place();
    };
    this.section = section(
      "Haptic device",
      false,
      element("p", { class: "secondary", text: "A Haply Inverse3 on this computer touches the scene, and feels it. Its place is above the scene as it is seen now." }),
      element("label", { class: "field" }, element("span", { class: "name", text: "Service" }), this.address),
      this.button,
      this.state,
    );
  }

  /** Puts the device into the scene that is shown. */
  place(): void {
    const view = this.sceneView.graphs[0]?.info.view;
    if (!this.isOn || view === undefined) return;
    const { up, viewDirection } = this.sceneView.orbit;
    this.worker.placeHaply(placeAbove(new Vector3(...view.center), view.radius, up, viewDirection.negate()));
  }

  /** Shows what the force of the device does. */
  status(status: HapticDeviceStatus): void {
    if (this.device === null) return;
    const text = `${this.device}: ${forceText(status)}.`;
    // A screen reader tells a text again that is written again.
    if (this.state.textContent !== text) this.state.textContent = text;
  }

  private toggle(): void {
    this.isOn = !this.isOn;
    this.device = null;
    this.address.disabled = this.isOn;
    this.button.textContent = this.isOn ? "Disconnect" : "Connect";
    this.state.textContent = this.isOn ? "Connecting …" : "";
    this.worker.setHaply(this.isOn ? this.address.value : null);
  }
}
