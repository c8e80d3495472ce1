// Switch of the vibration, where the device can vibrate; the choice is kept by the browser.

import { canVibrate, Vibration, vibratesAtFirst } from "../interaction/vibration";
import { checkbox } from "./elements";

const STORAGE_KEY = "palpate.vibration";

function stored(): boolean | null {
  try {
    const text = localStorage.getItem(STORAGE_KEY);
    return text === null ? null : text === "on";
  } catch {
    return null;
  }
}

function store(on: boolean): void {
  try {
    localStorage.setItem(STORAGE_KEY, on ? "on" : "off");
  } catch {
    // Without storage the default applies next time.
  }
}

/** Vibration with its switch; `row` is empty on a device that cannot vibrate. */
export function vibrationSwitch(): { vibration: Vibration; row: HTMLElement[] } {
  const media = (query: string) => window.matchMedia(query).matches;
  const vibration = new Vibration(canVibrate() && (stored() ?? vibratesAtFirst(media("(pointer: coarse)"), media("(prefers-reduced-motion: reduce)"))));
  const { row, input } = checkbox("Vibration", "The phone vibrates where the force changes fast: longer at a stronger impact", (on) => {
    vibration.on = on;
    store(on);
    // To be felt at once, and to ask a browser that wants a click first.
    if (on) navigator.vibrate(20);
  });
  input.checked = vibration.on;
  return { vibration, row: canVibrate() ? [row] : [] };
}
