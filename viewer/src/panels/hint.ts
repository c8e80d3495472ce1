// What a stranger should do first. It goes away with the first touch.

import { element, iconButton } from "./element";

const KEY = "palpate.touched";

export class Hint {
  readonly box = element("div", { class: "hint", role: "note" });
  private gone = false;

  constructor() {
    this.box.hidden = true;
  }

  /** `name`: what lies there to be touched. */
  show(name: string, pointers: boolean): void {
    if (this.gone || !pointers) return;
    const touchScreen = window.matchMedia("(pointer: coarse)").matches;
    const verb = touchScreen ? "Touch" : "Press";
    const more = touchScreen
      ? "Two fingers squeeze it. Drag beside it to turn the view."
      : "Turn the wheel meanwhile to push deeper. Drag beside it to turn the view.";
    this.box.replaceChildren(
      element("div", {}, element("strong", { text: `${verb} the ${name} and drag.` }), element("span", { text: ` ${more}` })),
      iconButton("close", "Hide this hint", () => this.away()),
    );
    this.box.hidden = false;
  }

  away(): void {
    this.gone = true;
    this.box.hidden = true;
    try {
      sessionStorage.setItem(KEY, "yes");
    } catch {
      // Without storage it shows again next time.
    }
  }
}
