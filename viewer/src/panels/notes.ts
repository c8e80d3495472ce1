// What the page has to say: short notes that go away, and one banner that stays while something is wrong.

import { element, iconButton } from "./element";

const STAYS_MS = 7000;
const MOST = 3;

export class Notes {
  readonly list = element("div", { class: "notes", role: "status", attributes: { "aria-live": "polite" } });
  readonly banner = element("div", { class: "banner", role: "alert" });
  private readonly saidOnce = new Set<string>();

  constructor() {
    this.banner.hidden = true;
  }

  say(text: string, kind: "note" | "error" = "note"): void {
    for (const old of this.list.children) if (old.firstChild?.textContent === text) old.remove();
    const note = element("div", { class: `note ${kind}` }, element("span", { text }));
    const away = () => note.remove();
    note.append(iconButton("close", "Close this note", away));
    this.list.append(note);
    while (this.list.children.length > MOST) this.list.firstElementChild?.remove();
    window.setTimeout(away, kind === "error" ? 2 * STAYS_MS : STAYS_MS);
  }

  /** Says something only the first time. */
  sayOnce(key: string, text: string): void {
    if (this.saidOnce.has(key)) return;
    this.saidOnce.add(key);
    this.say(text, "error");
  }

  showBanner(text: string, act: { text: string; act: () => void } | null): void {
    if (!this.banner.hidden && this.banner.firstChild?.textContent === text) return;
    const button =
      act === null ? null : element("button", { class: "button", type: "button", text: act.text, on: { click: act.act } });
    this.banner.replaceChildren(element("span", { text }), ...(button === null ? [] : [button]));
    this.banner.hidden = false;
  }

  hideBanner(): void {
    this.banner.hidden = true;
  }
}
