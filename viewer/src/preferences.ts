// What the page remembers of how somebody likes it.

import { isColourMode } from "./picture/colours";
import type { Look } from "./picture/world";

const KEY = "palpate.look";

export function prefersDark(): boolean {
  return window.matchMedia("(prefers-color-scheme: dark)").matches;
}

export function rememberedLook(): Look & { themeChosen: boolean } {
  const look = { colour: "displacement" as const, arrows: true, wires: true, dark: prefersDark(), themeChosen: false };
  try {
    const kept = JSON.parse(localStorage.getItem(KEY) ?? "{}") as Partial<Record<string, unknown>>;
    return {
      colour: typeof kept.colour === "string" && isColourMode(kept.colour) ? kept.colour : look.colour,
      arrows: typeof kept.arrows === "boolean" ? kept.arrows : look.arrows,
      wires: typeof kept.wires === "boolean" ? kept.wires : look.wires,
      dark: typeof kept.dark === "boolean" ? kept.dark : look.dark,
      themeChosen: typeof kept.dark === "boolean",
    };
  } catch {
    return look;
  }
}

export function rememberLook(look: Look, themeChosen: boolean): void {
  const { colour, arrows, wires, dark } = look;
  try {
    localStorage.setItem(KEY, JSON.stringify(themeChosen ? { colour, arrows, wires, dark } : { colour, arrows, wires }));
  } catch {
    // Without storage it is as at first next time.
  }
}
