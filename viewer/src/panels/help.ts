// The sheet with everything that can be done, and by which keys.

import { element, iconButton } from "./element";

const POINTING: readonly [string, string][] = [
  ["Press on an object", "Pokes it, or grabs it: choose Poke or Grab. Shift or the right button does the other one."],
  ["Drag", "Moves the finger across the picture; on an object it strokes, pulls and throws."],
  ["Wheel while pressing", "Pushes the finger deeper, or draws it back. A pen does so by how hard it presses."],
  ["Several fingers", "On a touch screen each finger is one: pinch an object between two."],
  ["Drag beside the object", "Turns the view; with the right button or Shift it moves it. The wheel brings it nearer."],
  ["Gamepad", "Left stick moves a finger, right stick pushes it deeper, a trigger presses."],
];

const LIVE_KEYS: readonly [string, string][] = [
  ["Arrow keys, Enter", "In the picture: move a finger, press and let go"],
  ["Page Up, Page Down", "Push that finger deeper, draw it back"],
  ["G", "Poke or grab"],
  ["Space", "Pause and go on"],
  [".", "One step, when paused"],
  ["[ and ]", "Slower and faster"],
  ["R", "Begin the scene anew"],
];

const LOG_KEYS: readonly [string, string][] = [
  ["Space", "Play and pause"],
  ["← and →", "One picture back or on; with Shift ten"],
  ["Home and End", "To the beginning, to the end"],
  ["[ and ]", "Slower and faster"],
];

const VIEW_KEYS: readonly [string, string][] = [
  ["V", "The view as it was at first"],
  ["C", "Next colouring"],
  ["A", "Arrows of forces"],
  ["W", "Lines of the mesh"],
  ["T", "Light or dark"],
  ["?", "This sheet"],
];

function table(rows: readonly [string, string][], name = ""): HTMLElement {
  const list = element("dl", { class: name });
  for (const [what, does] of rows) list.append(element("dt", { text: what }), element("dd", { text: does }));
  return list;
}

export function helpSheet(kind: "live" | "logs"): HTMLDialogElement {
  const sheet = element("dialog", { class: "help", attributes: { "aria-labelledby": "help-title" } });
  const close = () => sheet.close();
  sheet.append(
    element(
      "header",
      {},
      element("h2", { id: "help-title", text: "How to touch" }),
      iconButton("close", "Close (Escape)", close),
    ),
    ...(kind === "live"
      ? [table(POINTING), element("h3", { text: "Keys" }), table([...LIVE_KEYS, ...VIEW_KEYS], "keys")]
      : [table(POINTING.slice(4, 5)), element("h3", { text: "Keys" }), table([...LOG_KEYS, ...VIEW_KEYS], "keys")]),
    element("h3", { text: "What you see" }),
    element("p", {
      text:
        "Blue: your finger and the force on it. The finger (ball) stays outside of the object; the small dot is where your hand is, and the farther the two are apart, the harder it presses. " +
        "Red: forces on the object. Every number is computed a thousand times a second from a finite element model, whose error stands under Accuracy.",
    }),
  );
  // Otherwise keys would go on meaning its button.
  sheet.addEventListener("close", () => (document.activeElement as HTMLElement | null)?.blur());
  sheet.addEventListener("click", (event) => {
    if (event.target === sheet) close();
  });
  return sheet;
}
