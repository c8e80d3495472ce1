// Notifications: toasts that disappear, one banner for a lasting problem, and the warnings of a scene until they are closed.

import { element, iconButton } from "./elements";

const DISPLAY_MS = 7000;
const MAX_NOTIFICATIONS = 3;

export class Notifications {
  readonly list = element("div", { class: "notifications", role: "status", attributes: { "aria-live": "polite" } });
  readonly banner = element("div", { class: "banner", role: "alert" });
  readonly warnings = element("div", { class: "warnings", role: "status" });
  private readonly notifiedOnce = new Set<string>();
  /** Listener of errors. */
  onError: (text: string) => void = () => undefined;

  constructor() {
    this.banner.hidden = true;
    this.warnings.hidden = true;
  }

  notify(text: string, kind: "info" | "error" = "info"): void {
    if (kind === "error") this.onError(text);
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

  /** Shows the warnings of a scene in place of those before. */
  showWarnings(lines: readonly string[]): void {
    const title = lines.length === 1 ? "A warning about this scene" : `${lines.length} warnings about this scene`;
    this.warnings.replaceChildren(
      element("div", {}, element("strong", { text: title }), element("ul", {}, ...lines.map((text) => element("li", { text: String(text) })))),
      iconButton("close", "Close the warnings", () => (this.warnings.hidden = true)),
    );
    this.warnings.hidden = lines.length === 0;
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
