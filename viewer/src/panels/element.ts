// Elements of the page, made in one line each.

type Child = Node | string | null;

interface Properties {
  class?: string;
  id?: string;
  title?: string;
  text?: string;
  type?: string;
  role?: string;
  /** Any other attribute; `true` is an empty one. */
  attributes?: Record<string, string | true>;
  on?: Partial<{ [K in keyof HTMLElementEventMap]: (event: HTMLElementEventMap[K]) => void }>;
}

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  if (properties.class !== undefined) made.className = properties.class;
  if (properties.id !== undefined) made.id = properties.id;
  if (properties.title !== undefined) made.title = properties.title;
  if (properties.text !== undefined) made.textContent = properties.text;
  if (properties.type !== undefined) made.setAttribute("type", properties.type);
  if (properties.role !== undefined) made.setAttribute("role", properties.role);
  for (const [name, value] of Object.entries(properties.attributes ?? {})) {
    made.setAttribute(name, value === true ? "" : value);
  }
  for (const [name, listener] of Object.entries(properties.on ?? {})) {
    made.addEventListener(name, listener as EventListener);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

const ICONS = {
  reset: "M4 4v5h5M4.6 9A8 8 0 1 1 4 13",
  pause: "M8 5v14M16 5v14",
  play: "M7 4.5v15l12-7.5z",
  step: "M6 5v14l9-7zM18 5v14",
  home: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
  poke: "M12 3v10M8 10l4 4 4-4M4 19c3 0 4-2 8-2s5 2 8 2",
  grab: "M8 12V6a1.5 1.5 0 0 1 3 0v5V4.5a1.5 1.5 0 0 1 3 0V11V6a1.5 1.5 0 0 1 3 0v8a6 6 0 0 1-6 6c-3 0-4-1-6-4l-2-4a1.5 1.5 0 0 1 2.500-1.500z",
  help: "M9 9a3 3 0 1 1 4.500 2.600c-1 .6-1.500 1.200-1.500 2.400M12 17.500v.5",
  theme: "M12 4a8 8 0 1 0 8 8 6 6 0 0 1-8-8z",
  close: "M6 6l12 12M18 6L6 18",
  sliders: "M4 7h10M18 7h2M4 17h2M10 17h10M16 5v4M8 15v4",
  chart: "M4 19h16M5 15l4-5 4 3 6-8",
  back: "M18 5v14l-9-7zM6 5v14",
} as const;
export type IconName = keyof typeof ICONS;

export function icon(name: IconName): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  return svg;
}

/** A button with a picture; `label` is what it says to those who do not see it, and its tooltip. */
export function iconButton(name: IconName, label: string, act: () => void, caption?: string): HTMLButtonElement {
  return element(
    "button",
    { class: "button", type: "button", title: label, attributes: { "aria-label": label }, on: { click: act } },
    icon(name),
    caption === undefined ? null : element("span", { class: "caption", text: caption }),
  );
}

/** A part of a side panel that folds. */
export function section(title: string, open: boolean, ...children: Child[]): HTMLDetailsElement {
  const made = element("details", { class: "section" }, element("summary", {}, element("h2", { text: title })), ...children);
  made.open = open;
  return made;
}

export interface NumberField {
  row: HTMLElement;
  value: number;
  readonly input: HTMLInputElement;
}

/** A number with its unit; `changed` is only called with numbers within its bounds. */
export function numberField(
  label: string,
  unit: string,
  explained: string,
  bounds: { min: number; max: number; step: number | "any" },
  changed: (value: number) => void,
): NumberField {
  const input = element("input", {
    type: "number",
    attributes: { min: String(bounds.min), max: String(bounds.max), step: String(bounds.step), inputmode: "decimal" },
  });
  input.addEventListener("change", () => {
    const value = input.valueAsNumber;
    const fits = Number.isFinite(value) && value >= bounds.min && value <= bounds.max;
    input.setCustomValidity(fits ? "" : `between ${bounds.min} and ${bounds.max}`);
    if (fits) changed(value);
    else input.reportValidity();
  });
  const row = element(
    "label",
    { class: "field", title: explained },
    element("span", { class: "name", text: label }),
    element("span", { class: "amount" }, input, element("span", { class: "unit", text: unit })),
  );
  return {
    row,
    input,
    get value() {
      return input.valueAsNumber;
    },
    set value(value: number) {
      if (document.activeElement !== input) input.value = String(Number(value.toPrecision(6)));
    },
  };
}

/** A few choices of which one is taken. */
export function choice<T extends string>(
  label: string,
  options: readonly { value: T; text: string; title: string; icon?: IconName }[],
  chosen: (value: T) => void,
): { group: HTMLElement; set(value: T): void } {
  const name = `choice-${label.toLowerCase().replaceAll(/[^a-z]+/g, "-")}`;
  const inputs = new Map<T, HTMLInputElement>();
  const group = element("div", { class: "choice", role: "radiogroup", attributes: { "aria-label": label } });
  for (const option of options) {
    const input = element("input", { type: "radio", attributes: { name, value: option.value } });
    input.addEventListener("change", () => chosen(option.value));
    inputs.set(option.value, input);
    group.append(
      element(
        "label",
        { title: option.title },
        input,
        element("span", {}, option.icon === undefined ? null : icon(option.icon), option.text),
      ),
    );
  }
  return {
    group,
    set(value) {
      const input = inputs.get(value);
      if (input !== undefined) input.checked = true;
    },
  };
}

export function checkbox(label: string, title: string, changed: (on: boolean) => void): { row: HTMLElement; input: HTMLInputElement } {
  const input = element("input", { type: "checkbox" });
  input.addEventListener("change", () => changed(input.checked));
  return { row: element("label", { class: "check", title }, input, element("span", { text: label })), input };
}
