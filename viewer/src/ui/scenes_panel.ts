// List of the scenes that can be opened.

import type { SceneSummary } from "../protocol/messages";
import { element, section } from "./elements";

export class ScenesPanel {
  readonly list = element("ul", { class: "scenes" });
  readonly section = section("Scenes", true, this.list);
  private readonly buttons = new Map<string, HTMLButtonElement>();

  constructor(private readonly open: (id: string) => void) {
    this.section.hidden = true;
  }

  setScenes(scenes: readonly SceneSummary[]): void {
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

  setCurrent(id: string): void {
    for (const [name, button] of this.buttons) {
      if (name === id) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    }
  }
}
