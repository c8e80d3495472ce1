// Lock of the colour scale, beside the colour bar.

import type { Rectangle } from "../rendering/overlay";
import type { SceneView } from "../rendering/scene_view";
import { element, icon } from "./elements";

const LOCKED = "Colour scale locked: click to fit it anew";
const UNLOCKED = "Lock the colour scale; until then it grows with the largest value";
const GAP_PX = 18;

export class ScaleLock {
  readonly button = element("button", { class: "button scale-lock", type: "button", attributes: { "aria-label": "Lock the colour scale" } });

  constructor(private readonly sceneView: SceneView) {
    this.button.hidden = true;
    this.button.addEventListener("click", () => {
      sceneView.lockColourScale(sceneView.colourScale?.locked !== true);
      this.show();
    });
    sceneView.colourBarMoved = (box) => this.place(box);
    this.show();
  }

  private place(box: Rectangle | null): void {
    this.button.hidden = box === null;
    if (box === null) return;
    this.button.style.left = `${box.x + box.width + GAP_PX}px`;
    this.button.style.top = `${box.y + box.height / 2}px`;
    this.show();
  }

  private show(): void {
    const locked = this.sceneView.colourScale?.locked === true;
    const pressed = String(locked);
    if (this.button.getAttribute("aria-pressed") === pressed) return;
    this.button.setAttribute("aria-pressed", pressed);
    this.button.title = locked ? LOCKED : UNLOCKED;
    this.button.replaceChildren(icon(locked ? "locked" : "unlocked"));
  }
}
