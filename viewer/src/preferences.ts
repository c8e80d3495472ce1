// Display settings, and the switch of the vibration, stored in the browser.

import { isColourMode } from "./rendering/colours";
import type { DisplaySettings } from "./rendering/scene_graph";

const STORAGE_KEY = "palpate.display";
const VIBRATION_KEY = "palpate.vibration";

export function prefersDark(): boolean {
  return window.matchMedia("(prefers-color-scheme: dark)").matches;
}

/** Stored display settings, completed with defaults; `themeChosen`: whether the user chose the theme. */
export function loadPreferences(): DisplaySettings & { themeChosen: boolean } {
  const defaults = { colour: "plain" as const, arrows: true, contactPoints: false, wireframe: false, dark: prefersDark(), themeChosen: false };
  try {
    const stored = JSON.parse(localStorage.getItem(STORAGE_KEY) ?? "{}") as Partial<Record<string, unknown>>;
    return {
      colour: typeof stored.colour === "string" && isColourMode(stored.colour) ? stored.colour : defaults.colour,
      arrows: typeof stored.arrows === "boolean" ? stored.arrows : defaults.arrows,
      contactPoints: typeof stored.contactPoints === "boolean" ? stored.contactPoints : defaults.contactPoints,
      wireframe: typeof stored.wireframe === "boolean" ? stored.wireframe : defaults.wireframe,
      dark: typeof stored.dark === "boolean" ? stored.dark : defaults.dark,
      themeChosen: typeof stored.dark === "boolean",
    };
  } catch {
    return defaults;
  }
}

export function savePreferences(settings: DisplaySettings, themeChosen: boolean): void {
  const { dark, ...always } = settings;
  try {
    localStorage.setItem(STORAGE_KEY, JSON.stringify(themeChosen ? settings : always));
  } catch {
    // Without storage the defaults apply next time.
  }
}

/** Stored switch of the vibration; null where nobody has chosen. */
export function loadVibration(): boolean | null {
  try {
    const stored = localStorage.getItem(VIBRATION_KEY);
    return stored === null ? null : stored === "on";
  } catch {
    return null;
  }
}

export function saveVibration(on: boolean): void {
  try {
    localStorage.setItem(VIBRATION_KEY, on ? "on" : "off");
  } catch {
    // Without storage the default applies next time.
  }
}
