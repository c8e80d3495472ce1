// Toolbar of live mode: press mode, pause, single step, slow motion, reset.

import { slowdownLabel } from "../format";
import type { Status, TouchMode, ClientMessage } from "../protocol/messages";
import { segmentedControl, element, icon, iconButton } from "./elements";

export const SLOWDOWNS = [1, 2, 5, 10, 20, 50, 100] as const;

/** Shows the server's state: a click sends a request, and the status that answers it changes what is shown. Otherwise a status sent before the request came in would undo the click for a moment. */
export class LiveToolbar {
  readonly parts: HTMLElement[];
  private readonly modes;
  private readonly pause: HTMLButtonElement;
  private readonly step: HTMLButtonElement;
  private readonly speed = element("select", { title: "Speed of simulated time: slower with [, faster with ]", attributes: { "aria-label": "Speed of simulated time" } });
  private paused = false;
  slowdown = 1;
  mode: TouchMode;

  constructor(
    private readonly send: (message: ClientMessage) => void,
    mode: TouchMode,
    private readonly onModeChange: (mode: TouchMode) => void,
    readonly reset: () => void,
    resetView: () => void,
  ) {
    this.mode = mode;
    this.modes = segmentedControl<TouchMode>(
      "Press mode",
      [
        { value: "touch", text: "Touch", icon: "touch", title: "A press touches the object: unilateral contact with friction (G)" },
        { value: "hold", text: "Hold", icon: "hold", title: "A press takes hold of a surface point: pull, squeeze, throw (G)" },
      ],
      (chosen) => this.setMode(chosen),
    );
    this.modes.set(mode);
    this.pause = iconButton("pause", "Pause (Space)", () => this.togglePause(), "Pause");
    this.step = iconButton("step", "Single step (.)", () => this.singleStep());
    this.step.classList.add("hide-on-phone");
    // Reset shows the whole scene as well.
    const view = iconButton("resetView", "Reset view (V)", resetView);
    view.classList.add("hide-on-phone");
    this.speed.append(
      ...SLOWDOWNS.map((s) => element("option", { text: slowdownLabel(s), attributes: { value: String(s) } })),
    );
    this.speed.addEventListener("change", () => this.setSlowdown(Number(this.speed.value)));
    this.parts = [
      this.modes.group,
      element("span", { class: "spacer" }),
      this.pause,
      this.step,
      this.speed,
      iconButton("reset", "Reset (R)", reset, "Reset"),
      view,
    ];
  }

  get isPaused(): boolean {
    return this.paused;
  }

  setMode(mode: TouchMode): void {
    this.mode = mode;
    this.modes.set(mode);
    this.onModeChange(mode);
  }

  toggleMode(): void {
    this.setMode(this.mode === "touch" ? "hold" : "touch");
  }

  togglePause(): void {
    this.send({ type: "pause", paused: !this.paused });
  }

  singleStep(): void {
    if (!this.paused) this.togglePause();
    this.send({ type: "single_step" });
  }

  setSlowdown(slowdown: number): void {
    this.send({ type: "slow_motion", slowdown });
  }

  /** Next speed: 1 is faster, −1 is slower. */
  changeSpeed(direction: 1 | -1): void {
    const at = SLOWDOWNS.findIndex((s) => s >= this.slowdown);
    this.setSlowdown(SLOWDOWNS[Math.min(SLOWDOWNS.length - 1, Math.max(0, at - direction))]);
  }

  update(status: Status): void {
    this.showPaused(status.paused);
    this.slowdown = status.slowdown;
    const known = SLOWDOWNS.find((s) => s === status.slowdown);
    const value = known === undefined ? "" : String(known);
    // An assignment may close the list while somebody chooses.
    if (this.speed.value !== value) this.speed.value = value;
  }

  private showPaused(paused: boolean): void {
    if (paused === this.paused) return;
    this.paused = paused;
    this.pause.replaceChildren(icon(paused ? "play" : "pause"), element("span", { class: "caption", text: paused ? "Resume" : "Pause" }));
    const label = paused ? "Resume (Space)" : "Pause (Space)";
    this.pause.title = label;
    this.pause.setAttribute("aria-label", label);
  }
}
