// Help dialog: gestures and keyboard shortcuts.

import { element, iconButton } from "./elements";

const GESTURES: readonly [string, string][] = [
  ["Press on an object", "Touch: a finger presses against the surface. Hold: takes hold of it, to lift, pull and throw. Shift or the right button uses the other mode. A press while the scene is paused acts when it goes on."],
  ["Drag", "Touch: the finger follows the surface under the pointer at its depth. Hold: the held patch follows the pointer."],
  ["Wheel while pressing", "Changes the depth of the press. A pen does so by its pressure."],
  ["Several fingers", "On a touch screen each finger is a pointer: pinch an object between two."],
  ["Drag beside the object", "Rotates the view; with the right button or Shift it pans. The wheel zooms."],
  ["Gamepad", "Left stick moves a pointer, right stick changes its depth, a trigger presses."],
];
const VIEW_GESTURES = GESTURES.filter(([name]) => name === "Drag beside the object");

const LIVE_KEYS: readonly [string, string][] = [
  ["Arrow keys, Enter", "In the scene: move a pointer, press and release"],
  ["Page Up, Page Down", "Increase, decrease the depth of that pointer"],
  ["G", "Touch or hold"],
  ["Space", "Pause and resume"],
  [".", "Single step while paused"],
  ["[ and ]", "Slower and faster"],
  ["R", "Reset: the scene from its start, with its own settings and view"],
  ["S", "Share: link, QR code, film, log"],
];

const LOG_KEYS: readonly [string, string][] = [
  ["Space", "Play and pause"],
  ["← and →", "Previous and next frame; with Shift ten frames"],
  ["Press in a plot", "To that time; drag to scrub"],
  ["Home and End", "To the start, to the end"],
  ["[ and ]", "Slower and faster"],
];

const VIEW_KEYS: readonly [string, string][] = [
  ["V", "Reset the view"],
  ["C", "Next colour mode"],
  ["A", "Force vectors"],
  ["P", "Contact points"],
  ["W", "Wireframe"],
  ["T", "Light or dark theme"],
  ["?", "This help"],
];

function table(rows: readonly [string, string][], name = ""): HTMLElement {
  const list = element("dl", { class: name });
  for (const [term, description] of rows) list.append(element("dt", { text: term }), element("dd", { text: description }));
  return list;
}

export function helpDialog(kind: "live" | "logs"): HTMLDialogElement {
  const dialog = element("dialog", { class: "help-dialog", attributes: { "aria-labelledby": "help-title" } });
  const close = () => dialog.close();
  dialog.append(
    element(
      "header",
      {},
      element("h2", { id: "help-title", text: "Help" }),
      iconButton("close", "Close (Escape)", close),
    ),
    ...(kind === "live"
      ? [table(GESTURES), element("h3", { text: "Keyboard shortcuts" }), table([...LIVE_KEYS, ...VIEW_KEYS], "keys")]
      : [table(VIEW_GESTURES), element("h3", { text: "Keyboard shortcuts" }), table([...LOG_KEYS, ...VIEW_KEYS], "keys")]),
    element("h3", { text: "What you see" }),
    element("p", {
      text:
        "Blue: the device tip and the force on your hand. The tip (sphere, the proxy) stays outside of the object; the small dot is your hand (interface point). The farther the two are apart, the larger the force. " +
        "Red: forces on the object. Forces are computed a thousand times a second from a finite element model; its error is listed under Accuracy.",
    }),
  );
  // Otherwise keys would act on the button that opened it.
  dialog.addEventListener("close", () => (document.activeElement as HTMLElement | null)?.blur());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) close();
  });
  return dialog;
}
