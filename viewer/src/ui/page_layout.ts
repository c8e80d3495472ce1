// Page layout: header, scene view, two sidebars, toolbar.

import type { SceneView } from "../rendering/scene_view";
import { element, icon, iconButton } from "./elements";
import { releaseFocusAfterPointer } from "./pointer_focus";

export type Sidebar = "controls" | "measurements";

export class PageLayout {
  readonly page = element("div", { class: "page" });
  readonly title = element("h1", { class: "title" });
  readonly about = element("p", { class: "about" });
  readonly chips = element("div", { class: "chips" });
  readonly controls = element("aside", { class: "sidebar", id: "controls", attributes: { "aria-label": "Controls" } });
  readonly measurements = element("aside", { class: "sidebar", id: "measurements", attributes: { "aria-label": "Measurements" } });
  readonly toolbar = element("footer", { class: "toolbar", role: "toolbar", attributes: { "aria-label": "Press mode and time" } });
  readonly viewArea = element("main", { class: "scene-view" });
  /** Overlays of the scene view. Top: banner, force readout, hint, jobs, notifications; bottom: the offer for lost objects. */
  readonly overlayTop = element("div", { class: "overlay-top" });
  readonly overlayBottom = element("div", { class: "overlay-bottom" });
  private readonly tabs = new Map<Sidebar, HTMLButtonElement>();

  constructor(sceneView: SceneView, actions: { help: () => void; theme: () => void }) {
    sceneView.canvas.tabIndex = 0;
    sceneView.canvas.setAttribute("role", "application");
    sceneView.canvas.setAttribute(
      "aria-label",
      "The scene. Arrow keys move a pointer, Enter presses and releases, Page Up and Page Down change its depth.",
    );
    sceneView.overlay.setAttribute("aria-hidden", "true");
    sceneView.overlay.className = "overlay";
    const tab = (sidebar: Sidebar, name: "sliders" | "chart", text: string) => {
      const button = element(
        "button",
        {
          class: "button tab",
          type: "button",
          title: text,
          attributes: { "aria-controls": sidebar, "aria-expanded": "false" },
          on: { click: () => this.toggle(sidebar) },
        },
        icon(name),
        element("span", { class: "caption", text }),
      );
      this.tabs.set(sidebar, button);
      return button;
    };
    const theme = iconButton("theme", "Light or dark theme (T)", actions.theme);
    theme.classList.add("hide-on-phone");
    const header = element(
      "header",
      { class: "header" },
      element("div", { class: "brand", text: "palpate" }),
      element("div", { class: "scene-names" }, this.title, this.about),
      this.chips,
      element(
        "nav",
        { class: "tabs", attributes: { "aria-label": "Panels" } },
        tab("controls", "sliders", "Controls"),
        tab("measurements", "chart", "Measurements"),
      ),
      theme,
      iconButton("help", "Help and shortcuts (?)", actions.help),
    );
    this.viewArea.append(sceneView.canvas, sceneView.overlay, this.overlayTop, this.overlayBottom);
    // The scene first, so that the keyboard reaches it in a few Tabs.
    this.page.append(header, this.viewArea, this.toolbar, this.controls, this.measurements);
    releaseFocusAfterPointer(this.page);
    this.sidebar = window.matchMedia("(max-width: 899px)").matches ? null : "controls";
  }

  get sidebar(): Sidebar | null {
    return (this.page.dataset.sidebar as Sidebar | undefined) ?? null;
  }

  /** Sidebar that is shown where there is no room for both. */
  set sidebar(sidebar: Sidebar | null) {
    if (sidebar === null) delete this.page.dataset.sidebar;
    else this.page.dataset.sidebar = sidebar;
    for (const [name, button] of this.tabs) button.setAttribute("aria-expanded", String(name === sidebar));
  }

  private toggle(sidebar: Sidebar): void {
    this.sidebar = this.sidebar === sidebar ? null : sidebar;
  }
}
