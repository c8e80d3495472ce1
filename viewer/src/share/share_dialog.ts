// Share dialog: link with QR code, HTML of a frame, film, log.

import { element, iconButton } from "../ui/elements";
import { LARGEST_BYTES, LONGEST_S } from "./film";
import { LONGEST_LOG_S } from "./log_control";
import { qrCode } from "./qr_code";

/** Offer of the dialog for a scene. */
export interface Offer {
  /** Address, and sentences on its limits; null for a scene without link. */
  link: { address: string; limits: readonly string[] } | null;
  /** HTML of a frame; null where a server refuses to be shown in one. */
  frame: string | null;
  /** Whether this browser records films, and whether it records one. */
  film: "possible" | "running" | "impossible";
  /** Whether this page records logs, and whether it records one. */
  log: "possible" | "running" | "impossible";
}

/** Time for which a button says that it has copied [ms]. */
const COPIED_MS = 2500;

export class ShareDialog {
  readonly dialog = element("dialog", { class: "share-dialog", attributes: { "aria-labelledby": "share-title" } });
  private readonly body = element("div", { class: "share-parts" });
  private readonly status = element("p", { class: "for-screen-readers", role: "status" });

  /** `film` starts or ends a film, `log` a log. */
  constructor(
    private readonly offer: () => Offer,
    private readonly film: () => void,
    private readonly log: () => void,
  ) {
    const close = () => this.dialog.close();
    this.dialog.append(element("header", {}, element("h2", { id: "share-title", text: "Share" }), iconButton("close", "Close (Escape)", close)), this.body, this.status);
    // Otherwise keys would act on the button that opened it.
    this.dialog.addEventListener("close", () => (document.activeElement as HTMLElement | null)?.blur());
    this.dialog.addEventListener("click", (event) => {
      if (event.target === this.dialog) close();
    });
  }

  open(): void {
    if (this.dialog.open) return;
    const { link, frame, film, log } = this.offer();
    this.status.textContent = "";
    this.body.replaceChildren(...this.linkParts(link), ...(link === null ? [] : this.frameParts(frame)), ...this.filmParts(film), ...this.logParts(log));
    this.dialog.showModal();
    this.dialog.querySelector<HTMLElement>(".first")?.focus();
  }

  private linkParts(link: Offer["link"]): HTMLElement[] {
    const title = element("h3", { text: "Link" });
    if (link === null) return [section(title, element("p", { text: "This scene is your own: no link opens it. Others need its file, or watch a film." }))];
    const field = element("input", { class: "copied-text", type: "text", attributes: { readonly: true, value: link.address, "aria-label": "Link to this scene" } });
    const code = qrCode(link.address, "QR code of the link");
    const text = element(
      "div",
      {},
      title,
      element("div", { class: "copy-row" }, field, this.copyButton("Copy link", field, true)),
      element("p", { text: "Opens this scene with the changed Physics settings and materials, and this view." }),
      ...link.limits.map((limit) => element("p", { class: "limit", text: limit })),
    );
    if (code === null) text.append(element("p", { text: "The link is too long for a QR code." }));
    const part = section(text);
    part.classList.add("link-part");
    if (code !== null) part.append(element("figure", {}, code, link.limits.length > 0 ? null : element("figcaption", { text: "For a phone's camera" })));
    return [part];
  }

  private frameParts(frame: string | null): HTMLElement[] {
    const title = element("h3", { text: "On your own page" });
    if (frame === null) {
      return [section(title, element("p", { text: "This server lets no other page show it in a frame. The page without a server can be shown in one: cargo xtask web builds it." }))];
    }
    const field = element("textarea", { class: "copied-text", text: frame, attributes: { readonly: true, rows: "4", spellcheck: "false", "aria-label": "HTML of a frame with this scene" } });
    return [section(title, element("div", { class: "copy-row" }, field, this.copyButton("Copy HTML", field)))];
  }

  private filmParts(film: Offer["film"]): HTMLElement[] {
    const title = element("h3", { text: "Film" });
    if (film === "impossible") return [section(title, element("p", { text: "This browser records no film (it has no MediaRecorder for canvases)." }))];
    const button = this.closingButton(film === "running" ? "Stop and save" : "Record", this.film);
    const limit = `${LONGEST_S / 60}\u00a0minutes or ${LARGEST_BYTES / 1e6}\u00a0MB`;
    return [section(title, element("div", { class: "copy-row" }, element("p", { text: `The scene as you see it, with its forces and without the panels, and as you hear it if Sound is on at its start, up to ${limit}.` }), button))];
  }

  private logParts(log: Offer["log"]): HTMLElement[] {
    const title = element("h3", { text: "Log" });
    if (log === "impossible") return [section(title, element("p", { text: "palpate serve --log run.mcap records every step, from the start of the scene." }))];
    const button = this.closingButton(log === "running" ? "Stop and save log" : "Record log", this.log);
    const about = `Every step with your presses, from now on, up to ${LONGEST_LOG_S}\u00a0seconds or 200\u00a0MB: palpate replay repeats it, and this page plays it. The scene begins again; what restarts it ends the log.`;
    return [section(title, element("div", { class: "copy-row" }, element("p", { text: about }), button))];
  }

  /** Button that closes the dialog, and then acts. */
  private closingButton(text: string, act: () => void): HTMLElement {
    const click = () => {
      // After the closing, which moves the focus.
      this.dialog.addEventListener("close", () => act(), { once: true });
      this.dialog.close();
    };
    return element("button", { class: "button", type: "button", text, on: { click } });
  }

  private copyButton(label: string, field: HTMLInputElement | HTMLTextAreaElement, isFirst = false): HTMLButtonElement {
    const button = element("button", { class: `button${isFirst ? " primary first" : ""}`, type: "button", text: label });
    button.addEventListener("click", () => {
      void copy(field).then((copied) => {
        const text = copied ? "Copied" : "Press Ctrl+C";
        button.textContent = this.status.textContent = text;
        window.setTimeout(() => (button.textContent = label), COPIED_MS);
      });
    });
    field.addEventListener("focus", () => field.select());
    return button;
  }
}

function section(...children: Node[]): HTMLElement {
  return element("section", {}, ...children);
}

/** Copies the text of a field; where the browser refuses, the field is selected. */
async function copy(field: HTMLInputElement | HTMLTextAreaElement): Promise<boolean> {
  try {
    // Missing on pages that are not secure, refused in frames.
    await navigator.clipboard.writeText(field.value);
    return true;
  } catch {
    field.focus();
    field.select();
    return document.execCommand("copy");
  }
}
