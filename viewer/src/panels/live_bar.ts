// The bar under the stage of a live scene: poke or grab, pause, step, speed, begin anew.

import { slownessName } from "../format";
import type { Status, TouchMode, ToServer } from "../protocol/messages";
import { choice, element, icon, iconButton } from "./element";

export const SLOWNESSES = [1, 2, 5, 10, 20, 50, 100] as const;

export class LiveBar {
  readonly parts: HTMLElement[];
  private readonly modes;
  private readonly pause: HTMLButtonElement;
  private readonly step: HTMLButtonElement;
  private readonly speed = element("select", { title: "Speed of time: slow motion with [, faster with ]", attributes: { "aria-label": "Speed of time" } });
  paused = false;
  private slowness = 1;
  mode: TouchMode;

  constructor(
    private readonly send: (message: ToServer) => void,
    mode: TouchMode,
    private readonly modeChanged: (mode: TouchMode) => void,
    home: () => void,
  ) {
    this.mode = mode;
    this.modes = choice<TouchMode>(
      "What a press does",
      [
        { value: "touch", text: "Poke", icon: "poke", title: "A press pokes the object; it slips or sticks as friction allows (G)" },
        { value: "hold", text: "Grab", icon: "grab", title: "A press takes hold of the object: pull, squeeze, throw (G)" },
      ],
      (chosen) => this.setMode(chosen),
    );
    this.modes.set(mode);
    this.pause = iconButton("pause", "Pause (Space)", () => this.togglePause(), "Pause");
    this.step = iconButton("step", "One step (.)", () => this.oneStep());
    this.step.classList.add("spare");
    this.speed.append(
      ...SLOWNESSES.map((s) => element("option", { text: slownessName(s), attributes: { value: String(s) } })),
    );
    this.speed.addEventListener("change", () => this.slow(Number(this.speed.value)));
    this.parts = [
      this.modes.group,
      element("span", { class: "gap" }),
      this.pause,
      this.step,
      this.speed,
      iconButton("reset", "Begin anew (R)", () => this.reset(), "Reset"),
      iconButton("home", "The view as at first (V)", home),
    ];
  }

  setMode(mode: TouchMode): void {
    this.mode = mode;
    this.modes.set(mode);
    this.modeChanged(mode);
  }

  otherMode(): void {
    this.setMode(this.mode === "touch" ? "hold" : "touch");
  }

  togglePause(): void {
    this.send({ type: "pause", paused: !this.paused });
    this.showPaused(!this.paused);
  }

  oneStep(): void {
    if (!this.paused) this.togglePause();
    this.send({ type: "step" });
  }

  reset(): void {
    this.send({ type: "reset" });
  }

  slow(slowness: number): void {
    this.slowness = slowness;
    this.speed.value = String(slowness);
    this.send({ type: "slow", slowness });
  }

  /** To the next speed: 1 is faster, −1 slower. */
  faster(way: 1 | -1): void {
    const at = SLOWNESSES.findIndex((s) => s >= this.slowness);
    this.slow(SLOWNESSES[Math.min(SLOWNESSES.length - 1, Math.max(0, at - way))]);
  }

  take(status: Status): void {
    this.showPaused(status.paused);
    this.slowness = status.slowness;
    if (document.activeElement === this.speed) return;
    const known = SLOWNESSES.find((s) => s === status.slowness);
    this.speed.value = known === undefined ? "" : String(known);
  }

  private showPaused(paused: boolean): void {
    if (paused === this.paused) return;
    this.paused = paused;
    this.pause.replaceChildren(icon(paused ? "play" : "pause"), element("span", { class: "caption", text: paused ? "Go on" : "Pause" }));
    const label = paused ? "Go on (Space)" : "Pause (Space)";
    this.pause.title = label;
    this.pause.setAttribute("aria-label", label);
  }
}
