// First-use hint, dismissed by the first touch.

import { count } from "../format";
import { element, iconButton } from "./elements";

const STORAGE_KEY = "palpate.touched";

export class Hint {
  readonly box = element("div", { class: "hint", role: "note" });
  private dismissed = false;

  constructor() {
    this.box.hidden = true;
  }

  /** Shows the hint; `name` is the object to touch, `rate` the number of steps per second. */
  show(name: string, rate: number, pointers: boolean): void {
    if (this.dismissed || !pointers) return;
    const touchScreen = window.matchMedia("(pointer: coarse)").matches;
    const verb = touchScreen ? "Touch" : "Press";
    const details = touchScreen
      ? "Two fingers squeeze it. Drag beside it to rotate the view."
      : "Turn the wheel meanwhile to press deeper. Drag beside it to rotate the view.";
    this.box.replaceChildren(
      element("div", {}, element("strong", { text: `${verb} the ${name} and drag.` }), element("span", { text: ` ${details}` }), element("p", { text: why(rate) })),
      iconButton("close", "Hide this hint", () => this.dismiss()),
    );
    this.box.hidden = false;
  }

  dismiss(): void {
    this.dismissed = true;
    this.box.hidden = true;
    try {
      sessionStorage.setItem(STORAGE_KEY, "yes");
    } catch {
      // Without storage the hint appears again next time.
    }
  }
}

function why(rate: number): string {
  return `Finite-element contact forces, ${count(rate)} times per second, with a stated error (Measurements, Accuracy).`;
}
