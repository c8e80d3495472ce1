// First-use hint: what to do, one line on why it is special, the rest on demand. Gone with the first press, and it stays closed.

import { count } from "../format";
import type { SceneMessage } from "../protocol/messages";
import { element, iconButton } from "./elements";

const STORAGE_KEY = "palpate.touched";

export class Hint {
  readonly box = element("div", { class: "hint", role: "note", attributes: { "aria-label": "Hint" } });
  private dismissed = wasDismissed();

  /** `showAccuracy` opens the certificate. */
  constructor(private readonly showAccuracy: () => void) {
    this.box.hidden = true;
  }

  get isDismissed(): boolean {
    return this.dismissed;
  }

  show(scene: SceneMessage): void {
    if (this.dismissed || !scene.devices.some((device) => device.pointer)) return;
    const touchScreen = window.matchMedia("(pointer: coarse)").matches;
    const verb = touchScreen ? "Touch" : "Press";
    const name = scene.objects[0]?.name ?? "object";
    const details = element("details", {}, element("summary", { text: "How" }), element("ul", {}, ...gestures(touchScreen).map((text) => element("li", { text }))));
    const accuracy = element("button", { class: "link", type: "button", text: "certificate", on: { click: this.showAccuracy } });
    this.box.replaceChildren(
      element("div", {}, element("strong", { text: `${verb} the ${name} and drag.` }), element("p", {}, `${why(scene)} `, element("span", { class: "together" }, "(", accuracy, ").")), details),
      iconButton("close", "Hide this hint", () => this.dismiss()),
    );
    this.box.hidden = false;
  }

  dismiss(): void {
    this.dismissed = true;
    this.box.hidden = true;
    try {
      sessionStorage.setItem(STORAGE_KEY, "yes");
    } catch {
      // Without storage the hint appears again after a reload.
    }
  }
}

function wasDismissed(): boolean {
  try {
    return sessionStorage.getItem(STORAGE_KEY) !== null;
  } catch {
    return false;
  }
}

function gestures(touchScreen: boolean): string[] {
  return touchScreen
    ? ["Hold lifts and throws; two fingers squeeze.", "Drag beside the object to rotate the view."]
    : ["Turn the wheel while pressing to press deeper.", "Hold (G) lifts and throws.", "Drag beside the object to rotate the view."];
}

/** Largest force error that the certificates state, as they state it; null if one has none. */
export function statedError(certificates: readonly (readonly string[])[]): string | null {
  const errors = certificates.map((lines) => {
    for (const line of lines) {
      const stated = /^\s*force error\s+(below )?([\d.]+)\s*% at most/.exec(line);
      if (stated !== null) return Number(stated[2]);
    }
    return null;
  });
  if (errors.length === 0 || errors.some((error) => error === null)) return null;
  return `${Math.max(...(errors as number[]))}\u202f%`;
}

/** Rate of steps as a frequency. */
function frequency(step_s: number): string {
  const hertz = 1 / step_s;
  return hertz >= 999.5 ? `${Number((hertz / 1000).toPrecision(3))}\u202fkHz` : `${count(hertz)}\u202fHz`;
}

/** One line on what is special about a scene. */
export function why(scene: Pick<SceneMessage, "step_s" | "objects">): string {
  const error = statedError(scene.objects.map((object) => object.certificate));
  const rate = frequency(scene.step_s);
  return error === null ? `Finite-element forces at ${rate}, with a stated error` : `Finite-element forces at ${rate}, a press within ${error} of the full model`;
}
