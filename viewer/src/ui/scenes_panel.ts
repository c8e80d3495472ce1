// List of the scenes that can be opened, with the objects that were dropped onto this page.

import type { SceneSummary } from "../protocol/messages";
import { element, section } from "./elements";

export class ScenesPanel {
  readonly list = element("ul", { class: "scenes" });
  readonly section = section("Scenes", true, this.list);
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private scenes: readonly SceneSummary[] = [];
  /** Uploads by title, and what opens them again. */
  private readonly uploads = new Map<string, () => void>();

  constructor(private readonly open: (id: string) => void) {
    this.section.hidden = true;
  }

  setScenes(scenes: readonly SceneSummary[]): void {
    this.scenes = scenes;
    this.show();
  }

  /** Keeps a dropped object in the list; a newer one of its title takes its place. */
  addUpload(title: string, open: () => void): void {
    this.uploads.set(title, open);
    this.show();
  }

  private show(): void {
    this.section.hidden = this.scenes.length === 0 && this.uploads.size === 0;
    this.buttons.clear();
    const entry = (key: string, title: string, about: string, open: () => void) => {
      const button = element("button", { class: "scene", type: "button", on: { click: open } }, element("strong", { text: title }), element("span", { text: about }));
      this.buttons.set(key, button);
      return element("li", {}, button);
    };
    this.list.replaceChildren(
      ...[...this.uploads].map(([title, open]) => entry(uploadKey(title), title, "Your own object, kept while this page is open.", open)),
      ...this.scenes.map(({ id, title, about }) => entry(id, title, about, () => this.open(id))),
    );
  }

  /** Marks a scene; `id` is null for a scene that the server does not list. */
  setCurrent(id: string | null, title: string): void {
    const current = id ?? uploadKey(title);
    for (const [name, button] of this.buttons) {
      if (name === current) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    }
  }
}

function uploadKey(title: string): string {
  return `upload ${title}`;
}
