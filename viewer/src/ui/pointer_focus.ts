// Focus after the pointer: a control that was pressed with a pointer does not keep it, so that Space pauses always. The keyboard leaves it
// where it is, as screen readers and Tab need it.

const KEEPS_FOCUS = 'input:not([type="checkbox"], [type="radio"], [type="range"]), select, canvas, [contenteditable]';

/** Lets go of the focus of controls within `page` after each press of a pointer, and of lists after a choice. */
export function releaseFocusAfterPointer(page: HTMLElement): void {
  let byPointer = false;
  const release = (wanted: (focused: HTMLElement) => boolean) => {
    const focused = document.activeElement;
    if (focused instanceof HTMLElement && page.contains(focused) && wanted(focused)) focused.blur();
  };
  page.addEventListener("pointerdown", () => (byPointer = true), { capture: true });
  page.addEventListener("keydown", () => (byPointer = false), { capture: true });
  // After the click, which gives a label's control the focus. A dialog that it opened keeps the focus: keys act in it.
  document.addEventListener("click", () => {
    if (byPointer) setTimeout(() => release((focused) => !focused.matches(KEEPS_FOCUS) && focused.closest("dialog[open]") === null), 0);
  });
  page.addEventListener("change", (event) => {
    if (event.target instanceof HTMLSelectElement && byPointer) release((focused) => focused === event.target);
  });
}
