// Toolbar of log mode: play, single frames, scrubber, clock, speed.

import { seconds } from "../format";
import { element, icon, iconButton } from "../ui/elements";
import { SPEEDS, type Player } from "./player";

export class Timeline {
  readonly parts: HTMLElement[];
  private readonly play: HTMLButtonElement;
  private readonly slider = element("input", { type: "range", class: "scrubber", attributes: { min: "0", max: "1", step: "any", value: "0", "aria-label": "Time" } });
  private readonly now = element("span");
  private readonly whole = element("span", { class: "hide-on-phone" });
  private readonly clock = element("output", { class: "clock" }, this.now, this.whole);
  private readonly speed = element("select", { title: "Speed ([ and ])", attributes: { "aria-label": "Speed" } });
  private shownPlaying = false;

  constructor(
    private readonly player: Player,
    resetView: () => void,
  ) {
    this.play = iconButton("play", "Play (Space)", () => player.toggle());
    this.slider.addEventListener("input", () => player.seek(this.slider.valueAsNumber));
    this.speed.append(...SPEEDS.map((s) => element("option", { text: `${s}×`, attributes: { value: String(s) } })));
    this.speed.addEventListener("change", () => {
      player.speed = Number(this.speed.value);
    });
    const resetViewButton = iconButton("resetView", "Reset view (V)", resetView);
    resetViewButton.classList.add("hide-on-phone");
    this.parts = [
      this.play,
      iconButton("stepBack", "Previous frame (←)", () => player.stepFrames(-1)),
      iconButton("step", "Next frame (→)", () => player.stepFrames(1)),
      this.slider,
      this.clock,
      this.speed,
      resetViewButton,
    ];
  }

  show(): void {
    const { player } = this;
    this.slider.max = String(player.duration);
    this.slider.value = String(player.time);
    this.slider.setAttribute("aria-valuetext", seconds(player.time));
    this.slider.style.setProperty("--share", `${(100 * player.time) / Math.max(player.duration, 1e-9)}%`);
    this.now.textContent = seconds(player.time);
    this.whole.textContent = ` of ${seconds(player.duration)}`;
    if (document.activeElement !== this.speed) this.speed.value = String(player.speed);
    if (player.playing === this.shownPlaying) return;
    this.shownPlaying = player.playing;
    const label = player.playing ? "Pause (Space)" : "Play (Space)";
    this.play.replaceChildren(icon(player.playing ? "pause" : "play"));
    this.play.title = label;
    this.play.setAttribute("aria-label", label);
  }
}
