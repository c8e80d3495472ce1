// The frame of the page: a head line, the stage, two sides with panels, a bar with buttons.

import type { Stage } from "../picture/stage";
import { element, icon, iconButton } from "./element";

export type Side = "controls" | "measured";

export class Frame {
  readonly page = element("div", { class: "page" });
  readonly title = element("h1", { class: "title" });
  readonly about = element("p", { class: "about" });
  readonly chips = element("div", { class: "chips" });
  readonly controls = element("aside", { class: "side", id: "controls", attributes: { "aria-label": "Controls" } });
  readonly measured = element("aside", { class: "side", id: "measured", attributes: { "aria-label": "Measurements" } });
  readonly bar = element("footer", { class: "bar", role: "toolbar", attributes: { "aria-label": "Touch and time" } });
  readonly stageArea = element("main", { class: "stage" });
  /** Over the stage, at its upper edge: banner, force, notes; at its lower edge: the hint. */
  readonly upper = element("div", { class: "upper" });
  readonly lower = element("div", { class: "lower" });
  private readonly tabs = new Map<Side, HTMLButtonElement>();

  constructor(stage: Stage, acts: { help: () => void; theme: () => void }) {
    stage.canvas.tabIndex = 0;
    stage.canvas.setAttribute("role", "application");
    stage.canvas.setAttribute(
      "aria-label",
      "The scene. Arrow keys move a finger, Enter presses and lets go, Page Up and Page Down push deeper and back.",
    );
    stage.overlay.setAttribute("aria-hidden", "true");
    stage.overlay.className = "overlay";
    const tab = (side: Side, name: "sliders" | "chart", text: string) => {
      const button = element(
        "button",
        {
          class: "button tab",
          type: "button",
          title: text,
          attributes: { "aria-controls": side, "aria-expanded": "false" },
          on: { click: () => this.toggle(side) },
        },
        icon(name),
        element("span", { class: "caption", text }),
      );
      this.tabs.set(side, button);
      return button;
    };
    const theme = iconButton("theme", "Light or dark (T)", acts.theme);
    theme.classList.add("spare");
    const head = element(
      "header",
      { class: "head" },
      element("div", { class: "brand", text: "palpate" }),
      element("div", { class: "names" }, this.title, this.about),
      this.chips,
      element(
        "nav",
        { class: "tabs", attributes: { "aria-label": "Panels" } },
        tab("controls", "sliders", "Controls"),
        tab("measured", "chart", "Measured"),
      ),
      theme,
      iconButton("help", "Help and keys (?)", acts.help),
    );
    this.stageArea.append(stage.canvas, stage.overlay, this.upper, this.lower);
    this.page.append(head, this.controls, this.stageArea, this.measured, this.bar);
    this.side = window.matchMedia("(max-width: 899px)").matches ? null : "controls";
  }

  get side(): Side | null {
    return (this.page.dataset.side as Side | undefined) ?? null;
  }

  /** Which side is shown where there is not room for both. */
  set side(side: Side | null) {
    if (side === null) delete this.page.dataset.side;
    else this.page.dataset.side = side;
    for (const [name, button] of this.tabs) button.setAttribute("aria-expanded", String(name === side));
  }

  private toggle(side: Side): void {
    this.side = this.side === side ? null : side;
  }
}
