// Switch of the vibration, where the device can vibrate; the choice is kept by the browser.

import { canVibrate, Vibration, vibratesAtFirst } from "../interaction/vibration";
import { loadVibration, saveVibration } from "../preferences";
import { checkbox } from "./elements";

/** Vibration with its switch; `row` is empty on a device that cannot vibrate. */
export function vibrationSwitch(): { vibration: Vibration; row: HTMLElement[] } {
  const media = (query: string) => window.matchMedia(query).matches;
  const vibration = new Vibration(canVibrate() && (loadVibration() ?? vibratesAtFirst(media("(pointer: coarse)"), media("(prefers-reduced-motion: reduce)"))));
  const { row, input } = checkbox("Vibration", "The phone vibrates where the force changes fast: longer at a stronger impact", (on) => {
    vibration.on = on;
    saveVibration(on);
    // To be felt at once, and to ask a browser that wants a click first.
    if (on) navigator.vibrate(20);
  });
  input.checked = vibration.on;
  return { vibration, row: canVibrate() ? [row] : [] };
}
