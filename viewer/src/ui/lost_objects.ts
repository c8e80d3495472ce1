// Offer for objects that are out of view or far away: follow them with the camera, or bring them back.

import { element } from "./elements";

/** Names of objects that are not where one sees them well. */
export interface Lost {
  outOfView: readonly string[];
  farAway: readonly string[];
}

export class LostObjects {
  readonly box = element("div", { class: "lost-objects", role: "status" });
  private readonly text = element("span");
  private readonly follow: HTMLElement;
  private shown = "";

  constructor(follow: () => void, bringBack: () => void) {
    this.follow = element("button", { class: "button", type: "button", text: "Show", title: "Turn the camera to the objects and follow them", on: { click: follow } });
    this.box.append(
      this.text,
      this.follow,
      element("button", { class: "button primary", type: "button", text: "Bring back", title: "Begin the scene again; its settings stay", on: { click: bringBack } }),
    );
    this.box.hidden = true;
  }

  /** Shows the offer for objects; hides it if there are none. */
  show(lost: Lost): void {
    const shown = lostText(lost);
    if (shown === this.shown) return;
    this.shown = shown;
    this.text.textContent = shown;
    this.follow.hidden = lost.outOfView.length === 0;
    this.box.hidden = shown === "";
  }
}

/** Sentence about objects that are out of view, else about those far away. */
export function lostText({ outOfView, farAway }: Lost): string {
  const [names, where] = outOfView.length > 0 ? [outOfView, "Out of view"] : [farAway, "Far away"];
  if (names.length === 0) return "";
  return `${where}: ${names.length <= 2 ? names.join(", ") : `${names.length} objects`}`;
}
