// The scenes that can be opened.

import type { SceneEntry } from "../protocol/messages";
import { element, section } from "./element";

export class ScenesPanel {
  readonly list = element("ul", { class: "scenes" });
  readonly section = section("Scenes", true, this.list);
  private readonly buttons = new Map<string, HTMLButtonElement>();

  constructor(private readonly open: (id: string) => void) {
    this.section.hidden = true;
  }

  offer(scenes: readonly SceneEntry[]): void {
    this.section.hidden = scenes.length === 0;
    this.buttons.clear();
    this.list.replaceChildren(
      ...scenes.map(({ id, title, about }) => {
        const button = element(
          "button",
          { class: "scene", type: "button", on: { click: () => this.open(id) } },
          element("strong", { text: title }),
          element("span", { text: about }),
        );
        this.buttons.set(id, button);
        return element("li", {}, button);
      }),
    );
  }

  current(id: string): void {
    for (const [name, button] of this.buttons) {
      if (name === id) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    }
  }
}
