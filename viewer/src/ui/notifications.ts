// Notifications: toasts that disappear, and one banner for a lasting problem.

import { element, iconButton } from "./elements";

const DISPLAY_MS = 7000;
const MAX_NOTIFICATIONS = 3;

export class Notifications {
  readonly list = element("div", { class: "notifications", role: "status", attributes: { "aria-live": "polite" } });
  readonly banner = element("div", { class: "banner", role: "alert" });
  private readonly notifiedOnce = new Set<string>();

  constructor() {
    this.banner.hidden = true;
  }

  notify(text: string, kind: "info" | "error" = "info"): void {
    for (const old of this.list.children) if (old.firstChild?.textContent === text) old.remove();
    const notification = element("div", { class: `notification ${kind}` }, element("span", { text }));
    const close = () => notification.remove();
    notification.append(iconButton("close", "Close this message", close));
    this.list.append(notification);
    while (this.list.children.length > MAX_NOTIFICATIONS) this.list.firstElementChild?.remove();
    window.setTimeout(close, kind === "error" ? 2 * DISPLAY_MS : DISPLAY_MS);
  }

  /** Shows an error once per key. */
  notifyOnce(key: string, text: string): void {
    if (this.notifiedOnce.has(key)) return;
    this.notifiedOnce.add(key);
    this.notify(text, "error");
  }

  showBanner(text: string, action: { text: string; run: () => void } | null): void {
    if (!this.banner.hidden && this.banner.firstChild?.textContent === text) return;
    const button =
      action === null ? null : element("button", { class: "button", type: "button", text: action.text, on: { click: action.run } });
    this.banner.replaceChildren(element("span", { text }), ...(button === null ? [] : [button]));
    this.banner.hidden = false;
  }

  hideBanner(): void {
    this.banner.hidden = true;
  }
}
