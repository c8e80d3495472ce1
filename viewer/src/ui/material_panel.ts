// Material of an object; a change is recorded again in the background, or, in a page without a server, rescaled at once.

import type { Material, SceneMessage, ClientMessage } from "../protocol/messages";
import { element, section } from "./elements";
import { numberField, type Bounds } from "./number_field";

export const PRESETS: readonly (Material & { name: string })[] = [
  { name: "Jelly", young: 2e3, poisson: 0.45, density: 110 },
  { name: "Liver", young: 5e3, poisson: 0.45, density: 1060 },
  { name: "Sponge", young: 2e4, poisson: 0.2, density: 60 },
  { name: "Soft silicone", young: 1e5, poisson: 0.48, density: 1080 },
  { name: "Rubber", young: 2e6, poisson: 0.49, density: 1100 },
];

/** Ranges of a material in the units of its fields. */
export const MATERIAL_BOUNDS = {
  young: { min: 1e-3, max: 1e9, step: "any" },
  poisson: { min: 0, max: 0.499, step: "any" },
  density: { min: 0.1, max: 1e5, step: "any" },
} as const satisfies Record<keyof Material, Bounds>;

/** Input fields of a material, with presets. */
export class MaterialFields {
  readonly rows: HTMLElement[];
  private readonly preset = element("select");
  private readonly young;
  private readonly poisson;
  private readonly density;

  private allRatios = true;

  constructor() {
    const clearPreset = () => {
      this.preset.value = "";
    };
    this.young = numberField("Young's modulus", "kPa", "Elastic stiffness: jelly 2, liver 5, rubber 2000 kPa", MATERIAL_BOUNDS.young, clearPreset);
    this.poisson = numberField("Poisson's ratio", "", "Lateral expansion under compression: cork 0, rubber 0.49", MATERIAL_BOUNDS.poisson, clearPreset);
    this.density = numberField("Density", "kg/m³", "Mass per volume; water: 1000", MATERIAL_BOUNDS.density, clearPreset);
    this.preset.append(
      element("option", { text: "custom", attributes: { value: "" } }),
      ...PRESETS.map(({ name }) => element("option", { text: name, attributes: { value: name } })),
    );
    this.preset.addEventListener("change", () => {
      const preset = PRESETS.find(({ name }) => name === this.preset.value);
      if (preset !== undefined) this.fill(preset);
    });
    const presets = element("label", { class: "field" }, element("span", { class: "name", text: "Preset" }), this.preset);
    this.rows = [presets, this.young.row, this.poisson.row, this.density.row];
  }

  /** Whether Poisson's ratio can be changed. */
  set changesRatio(changes: boolean) {
    this.allRatios = changes;
    this.poisson.input.disabled = !changes;
  }

  set value(material: Material) {
    this.fill(material, true);
    const close = (a: number, b: number) => Math.abs(a - b) <= 1e-6 * Math.abs(b);
    const same = PRESETS.find(
      (p) => close(p.young, material.young) && close(p.poisson, material.poisson) && close(p.density, material.density),
    );
    this.preset.value = same?.name ?? "";
  }

  /** Fills in a material, whose Poisson's ratio is left out where it stays as it is. */
  private fill({ young, poisson, density }: Material, ofObject = false): void {
    this.young.value = young / 1000;
    if (this.allRatios || ofObject) this.poisson.value = poisson;
    this.density.value = density;
  }

  /** Material of the fields; null if one is invalid. */
  get value(): Material | null {
    const valid = [this.young, this.poisson, this.density].every(({ input }) => input.value !== "" && input.checkValidity());
    return valid ? { young: 1000 * this.young.value, poisson: this.poisson.value, density: this.density.value } : null;
  }
}

export class MaterialPanel {
  readonly section: HTMLElement;
  private readonly objectSelect = element("select");
  private readonly fields = new MaterialFields();
  private readonly apply: HTMLButtonElement;
  private readonly explanation = element("p", { class: "secondary" });
  private scene: SceneMessage | null = null;

  constructor(send: (message: ClientMessage) => void) {
    this.apply = element("button", {
      class: "button wide",
      type: "button",
      on: {
        click: () => {
          const material = this.fields.value;
          if (material !== null) send({ type: "set_material", object: Number(this.objectSelect.value), ...material });
        },
      },
    });
    this.objectSelect.addEventListener("change", () => this.selectObject());
    this.section = section(
      "Material",
      false,
      element("label", { class: "field" }, element("span", { class: "name", text: "Object" }), this.objectSelect),
      ...this.fields.rows,
      this.explanation,
      this.apply,
    );
    this.records = true;
  }

  /** Whether there is a server that records; otherwise recordings are rescaled. */
  set records(records: boolean) {
    this.fields.changesRatio = records;
    this.apply.textContent = records ? "Record again" : "Apply";
    this.apply.title = records
      ? "Computes how the object responds with this material; takes seconds to minutes while the scene keeps running"
      : "Begins the scene again with this material";
    this.explanation.textContent = records
      ? "A new material needs a new recording, which is made in the background."
      : "The response to another Young's modulus and density follows from this one, exactly. Another Poisson's ratio needs a recording: palpate record.";
  }

  update(scene: SceneMessage): void {
    this.scene = scene;
    const recordable = scene.objects.map((object, i) => ({ object, i })).filter(({ object }) => object.recordable);
    this.section.hidden = recordable.length === 0;
    this.objectSelect.replaceChildren(
      ...recordable.map(({ object, i }) => element("option", { text: object.name, attributes: { value: String(i) } })),
    );
    if (this.objectSelect.parentElement !== null) this.objectSelect.parentElement.hidden = recordable.length < 2;
    this.selectObject();
  }

  private selectObject(): void {
    const object = this.scene?.objects[Number(this.objectSelect.value)];
    this.fields.value = object?.material ?? PRESETS[0];
  }
}
