// What an object is made of. A change is recorded anew in the background; everything goes on meanwhile.

import type { Material, SceneMessage, ToServer } from "../protocol/messages";
import { element, numberField, section } from "./element";

export const PRESETS: readonly (Material & { name: string })[] = [
  { name: "Jelly", young: 2e3, poisson: 0.45, density: 110 },
  { name: "Liver", young: 5e3, poisson: 0.45, density: 1060 },
  { name: "Sponge", young: 2e4, poisson: 0.2, density: 60 },
  { name: "Soft silicone", young: 1e5, poisson: 0.48, density: 1080 },
  { name: "Rubber", young: 2e6, poisson: 0.49, density: 1100 },
];

/** Fields for a material, with names for common ones. */
export class MaterialFields {
  readonly rows: HTMLElement[];
  private readonly preset = element("select");
  private readonly young;
  private readonly poisson;
  private readonly density;

  constructor() {
    const own = () => {
      this.preset.value = "";
    };
    this.young = numberField("Stiffness (Young)", "kPa", "Young's modulus: jelly 2, liver 5, rubber 2000", { min: 1e-3, max: 1e9, step: "any" }, own);
    this.poisson = numberField("Poisson's ratio", "", "How much it bulges sideways when it is pressed: cork 0, rubber 0.49", { min: 0, max: 0.499, step: "any" }, own);
    this.density = numberField("Density", "kg/m³", "Water: 1000", { min: 0.1, max: 1e5, step: "any" }, own);
    this.preset.append(
      element("option", { text: "its own", attributes: { value: "" } }),
      ...PRESETS.map(({ name }) => element("option", { text: name, attributes: { value: name } })),
    );
    this.preset.addEventListener("change", () => {
      const preset = PRESETS.find(({ name }) => name === this.preset.value);
      if (preset !== undefined) this.show(preset);
    });
    const presets = element("label", { class: "field" }, element("span", { class: "name", text: "Like" }), this.preset);
    this.rows = [presets, this.young.row, this.poisson.row, this.density.row];
  }

  set value(material: Material) {
    this.show(material);
    const near = (a: number, b: number) => Math.abs(a - b) <= 1e-6 * Math.abs(b);
    const same = PRESETS.find(
      (p) => near(p.young, material.young) && near(p.poisson, material.poisson) && near(p.density, material.density),
    );
    this.preset.value = same?.name ?? "";
  }

  private show({ young, poisson, density }: Material): void {
    this.young.value = young / 1000;
    this.poisson.value = poisson;
    this.density.value = density;
  }

  /** Null where a field holds nothing that makes sense. */
  get value(): Material | null {
    const valid = [this.young, this.poisson, this.density].every(({ input }) => input.value !== "" && input.checkValidity());
    return valid ? { young: 1000 * this.young.value, poisson: this.poisson.value, density: this.density.value } : null;
  }
}

export class MaterialPanel {
  readonly section: HTMLElement;
  private readonly which = element("select");
  private readonly fields = new MaterialFields();
  private readonly record: HTMLButtonElement;
  private scene: SceneMessage | null = null;

  constructor(send: (message: ToServer) => void) {
    this.record = element("button", {
      class: "button wide",
      type: "button",
      text: "Record anew",
      title: "Computes how the object responds with this material; takes seconds to minutes, and you can go on touching meanwhile",
      on: {
        click: () => {
          const material = this.fields.value;
          if (material !== null) send({ type: "material", object: Number(this.which.value), ...material });
        },
      },
    });
    this.which.addEventListener("change", () => this.choose());
    this.section = section(
      "Material",
      false,
      element("label", { class: "field" }, element("span", { class: "name", text: "Object" }), this.which),
      ...this.fields.rows,
      element("p", { class: "quiet", text: "A new material needs a new recording. It is made in the background." }),
      this.record,
    );
  }

  take(scene: SceneMessage): void {
    this.scene = scene;
    const able = scene.objects.map((object, i) => ({ object, i })).filter(({ object }) => object.recordable);
    this.section.hidden = able.length === 0;
    this.which.replaceChildren(
      ...able.map(({ object, i }) => element("option", { text: object.name, attributes: { value: String(i) } })),
    );
    if (this.which.parentElement !== null) this.which.parentElement.hidden = able.length < 2;
    this.choose();
  }

  private choose(): void {
    const object = this.scene?.objects[Number(this.which.value)];
    this.fields.value = object?.material ?? PRESETS[0];
  }
}
