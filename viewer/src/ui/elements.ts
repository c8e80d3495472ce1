// DOM element factories: elements, icons, buttons, sections, input fields.

type Child = Node | string | null;

interface Properties {
  class?: string;
  id?: string;
  title?: string;
  text?: string;
  type?: string;
  role?: string;
  /** Other attributes; `true` gives an empty value. */
  attributes?: Record<string, string | true>;
  on?: Partial<{ [K in keyof HTMLElementEventMap]: (event: HTMLElementEventMap[K]) => void }>;
}

/** HTML element with properties and children. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const created = document.createElement(tag);
  if (properties.class !== undefined) created.className = properties.class;
  if (properties.id !== undefined) created.id = properties.id;
  if (properties.title !== undefined) created.title = properties.title;
  if (properties.text !== undefined) created.textContent = properties.text;
  if (properties.type !== undefined) created.setAttribute("type", properties.type);
  if (properties.role !== undefined) created.setAttribute("role", properties.role);
  for (const [name, value] of Object.entries(properties.attributes ?? {})) {
    created.setAttribute(name, value === true ? "" : value);
  }
  for (const [name, listener] of Object.entries(properties.on ?? {})) {
    created.addEventListener(name, listener as EventListener);
  }
  created.append(...children.filter((child) => child !== null));
  return created;
}

const ICONS = {
  reset: "M4 4v5h5M4.6 9A8 8 0 1 1 4 13",
  pause: "M8 5v14M16 5v14",
  play: "M7 4.5v15l12-7.5z",
  step: "M6 5v14l9-7zM18 5v14",
  resetView: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
  touch: "M12 3v10M8 10l4 4 4-4M4 19c3 0 4-2 8-2s5 2 8 2",
  hold: "M8 12V6a1.5 1.5 0 0 1 3 0v5V4.5a1.5 1.5 0 0 1 3 0V11V6a1.5 1.5 0 0 1 3 0v8a6 6 0 0 1-6 6c-3 0-4-1-6-4l-2-4a1.5 1.5 0 0 1 2.500-1.500z",
  help: "M9 9a3 3 0 1 1 4.500 2.600c-1 .6-1.500 1.200-1.500 2.400M12 17.500v.5",
  theme: "M12 4a8 8 0 1 0 8 8 6 6 0 0 1-8-8z",
  close: "M6 6l12 12M18 6L6 18",
  sliders: "M4 7h10M18 7h2M4 17h2M10 17h10M16 5v4M8 15v4",
  sound: "M4 10v4h3l4 4V6L7 10zM15 9a4 4 0 0 1 0 6M17.5 6.500a8 8 0 0 1 0 11",
  chart: "M4 19h16M5 15l4-5 4 3 6-8",
  locked: "M6 11h12v9H6zM8 11V8a4 4 0 0 1 8 0v3M12 15v2",
  unlocked: "M6 11h12v9H6zM8 11V8a4 4 0 0 1 7.700-1.500M12 15v2",
  share: "M15.500 5.500a2.500 2.500 0 1 0 5 0 2.500 2.500 0 1 0-5 0M3.500 12a2.500 2.500 0 1 0 5 0 2.500 2.500 0 1 0-5 0M15.500 18.500a2.500 2.500 0 1 0 5 0 2.500 2.500 0 1 0-5 0M8.200 10.800l7.600-4.100M8.200 13.200l7.600 4.100",
  headset: "M4 8h16v8h-5l-2-2h-2l-2 2H4zM8 11.500v.5M16 11.500v.5",
  stepBack: "M18 5v14l-9-7zM6 5v14",
} as const;
export type IconName = keyof typeof ICONS;

/** Stroked SVG icon. */
export function icon(name: IconName): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  return svg;
}

/** Icon button; `label` is its accessible name and tooltip. */
export function iconButton(name: IconName, label: string, onClick: () => void, caption?: string): HTMLButtonElement {
  return element(
    "button",
    { class: "button", type: "button", title: label, attributes: { "aria-label": label }, on: { click: onClick } },
    icon(name),
    caption === undefined ? null : element("span", { class: "caption", text: caption }),
  );
}

/** Collapsible section of a sidebar. */
export function section(title: string, open: boolean, ...children: Child[]): HTMLDetailsElement {
  const created = element("details", { class: "section" }, element("summary", {}, element("h2", { text: title })), ...children);
  created.open = open;
  return created;
}

/** Segmented control: a radio group of a few options. */
export function segmentedControl<T extends string>(
  label: string,
  options: readonly { value: T; text: string; title: string; icon?: IconName }[],
  onChange: (value: T) => void,
): { group: HTMLElement; set(value: T): void } {
  const name = `segmented-${label.toLowerCase().replaceAll(/[^a-z]+/g, "-")}`;
  const inputs = new Map<T, HTMLInputElement>();
  const group = element("div", { class: "segmented", role: "radiogroup", attributes: { "aria-label": label } });
  for (const option of options) {
    const input = element("input", { type: "radio", attributes: { name, value: option.value } });
    input.addEventListener("change", () => onChange(option.value));
    inputs.set(option.value, input);
    group.append(
      element(
        "label",
        { title: option.title },
        input,
        element("span", {}, ...(option.icon === undefined ? [option.text] : [icon(option.icon), element("span", { class: "choice", text: option.text })])),
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

/** Checkbox with label. */
export function checkbox(label: string, title: string, onChange: (on: boolean) => void): { row: HTMLElement; input: HTMLInputElement } {
  const input = element("input", { type: "checkbox" });
  input.addEventListener("change", () => onChange(input.checked));
  return { row: element("label", { class: "checkbox", title }, input, element("span", { text: label })), input };
}
