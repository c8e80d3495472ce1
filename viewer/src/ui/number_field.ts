// Number input with unit. A value out of its range is taken back, with a message at the field in its own unit.

import { element } from "./elements";

export interface NumberField {
  row: HTMLElement;
  /** Value of the scene; setting it also clears the message. */
  value: number;
  readonly input: HTMLInputElement;
  /** Takes back the last change, which was refused. */
  refuse(text: string): void;
}

export interface Bounds {
  min: number;
  max: number;
  step: number | "any";
}

/** Complaint about the text of a field; null if it is a number within its bounds. */
export function complaint(label: string, unit: string, { min, max }: Bounds, text: string): string | null {
  const value = text.trim() === "" ? NaN : Number(text);
  const range = `${label}: from ${min} to ${max}${unit === "" ? "" : `\u00a0${unit}`}`;
  if (!Number.isFinite(value)) return `${range}.`;
  return value >= min && value <= max ? null : `${range}, not ${text.trim()}.`;
}

/** Number input with unit; `onChange` is called only with values within the bounds. */
export function numberField(label: string, unit: string, tooltip: string, bounds: Bounds, onChange: (value: number) => void): NumberField {
  const input = element("input", {
    type: "number",
    attributes: { min: String(bounds.min), max: String(bounds.max), step: String(bounds.step), inputmode: "decimal", "aria-label": unit === "" ? label : `${label} in ${unit}` },
  });
  const message = element("span", { class: "field-message", role: "alert" });
  message.hidden = true;
  let accepted = "";
  const refuse = (text: string) => {
    input.value = accepted;
    message.textContent = text;
    message.hidden = false;
  };
  const accept = () => {
    accepted = input.value;
    message.hidden = true;
  };
  input.addEventListener("change", () => {
    const found = input.validity.badInput ? complaint(label, unit, bounds, "") : complaint(label, unit, bounds, input.value);
    if (found !== null) {
      refuse(found);
      return;
    }
    accept();
    onChange(input.valueAsNumber);
  });
  // Enter commits and leaves the field, so that keys act on the scene again.
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && input.form === null) input.blur();
    if (event.key === "Escape" && input.form === null) {
      input.value = accepted;
      input.blur();
      event.preventDefault();
    }
  });
  const row = element(
    "label",
    { class: "field", title: tooltip },
    element("span", { class: "name", text: label }),
    element("span", { class: "number-input" }, input, element("span", { class: "unit", text: unit })),
    message,
  );
  return {
    row,
    input,
    refuse,
    get value() {
      return input.valueAsNumber;
    },
    set value(value: number) {
      const text = String(Number(value.toPrecision(6)));
      // A field that is being edited keeps its text.
      if (document.activeElement === input) {
        accepted = text;
        return;
      }
      input.value = text;
      accept();
    },
  };
}
