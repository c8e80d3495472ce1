// A mesh file dropped on the page: asks what its numbers mean and what it is made of, and has it recorded.

import { address } from "../protocol/address";
import { element, section } from "./element";
import { MaterialFields, PRESETS } from "./material";
import type { Notes } from "./notes";

const ENDINGS = [".msh", ".vtk", ".obj", ".stl"];
const SCALES: readonly [string, number][] = [
  ["millimetres", 0.001],
  ["centimetres", 0.01],
  ["metres", 1],
  ["inches", 0.0254],
];

export class MeshDrop {
  readonly section: HTMLElement;
  readonly dialog = element("dialog", { class: "drop", attributes: { "aria-labelledby": "drop-title" } });
  private readonly veil = element("div", { class: "veil", text: "Drop a mesh of tetrahedra here to touch it (.msh, .vtk)" });
  private readonly scale = element("select");
  private readonly modes = element("input", { type: "number", attributes: { min: "1", max: "2000", value: "200" } });
  private readonly fields = new MaterialFields();
  private readonly fileName = element("strong");
  private file: File | null = null;

  constructor(private readonly notes: Notes) {
    const input = element("input", { type: "file", attributes: { accept: ENDINGS.join(","), hidden: true } });
    input.addEventListener("change", () => {
      if (input.files?.[0] !== undefined) this.ask(input.files[0]);
      input.value = "";
    });
    const button = element("button", { class: "button wide", type: "button", text: "Choose a mesh file…", on: { click: () => input.click() } });
    this.section = section(
      "Your own object",
      false,
      element("p", { class: "quiet", text: "Drop a mesh of tetrahedra onto the page, or choose one: .msh of Gmsh, or .vtk. Surfaces alone (.obj, .stl) have no inside yet; Gmsh or fTetWild fill them." }),
      button,
      input,
    );
    this.scale.append(...SCALES.map(([name, factor]) => element("option", { text: name, attributes: { value: String(factor) } })));
    this.fields.value = PRESETS[1];
    const form = element("form", { attributes: { method: "dialog" } });
    form.append(
      element("h2", { id: "drop-title" }, "Record ", this.fileName),
      element("label", { class: "field" }, element("span", { class: "name", text: "Its numbers are" }), this.scale),
      ...this.fields.rows,
      element(
        "label",
        { class: "field", title: "How many ways of deforming are kept; more are finer and slower to record" },
        element("span", { class: "name", text: "Modes" }),
        this.modes,
      ),
      element("p", { class: "quiet", text: "Recording takes seconds to minutes. The scene goes on; the new object opens by itself." }),
      element(
        "div",
        { class: "acts" },
        element("button", { class: "button", type: "button", text: "Cancel", on: { click: () => this.dialog.close() } }),
        element("button", { class: "button primary", type: "submit", text: "Record" }),
      ),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.dialog.close();
      void this.post();
    });
    this.dialog.append(form);
    this.listen();
  }

  private listen(): void {
    const holdsFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") === true;
    document.body.append(this.veil);
    window.addEventListener("dragover", (event) => {
      if (!holdsFiles(event)) return;
      event.preventDefault();
      this.veil.classList.add("shown");
    });
    window.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) this.veil.classList.remove("shown");
    });
    window.addEventListener("drop", (event) => {
      if (!holdsFiles(event)) return;
      event.preventDefault();
      this.veil.classList.remove("shown");
      const file = event.dataTransfer?.files[0];
      if (file !== undefined) this.ask(file);
    });
  }

  private ask(file: File): void {
    if (!ENDINGS.some((ending) => file.name.toLowerCase().endsWith(ending))) {
      this.notes.say(`${file.name} is no mesh that can be read here; these are: ${ENDINGS.join(", ")}`, "error");
      return;
    }
    this.file = file;
    this.fileName.textContent = file.name;
    this.dialog.showModal();
  }

  private async post(): Promise<void> {
    const material = this.fields.value;
    if (this.file === null || material === null) return;
    const query = new URLSearchParams({
      name: this.file.name,
      young: String(material.young),
      poisson: String(material.poisson),
      density: String(material.density),
      scale: this.scale.value,
      modes: this.modes.value,
    });
    try {
      const response = await fetch(address(`record?${query}`), { method: "POST", body: this.file });
      if (!response.ok) throw new Error((await response.text()) || `${response.status} ${response.statusText}`);
      this.notes.say(`${this.file.name} is being recorded`);
    } catch (error) {
      this.notes.say(`${this.file.name} was not recorded: ${error instanceof Error ? error.message : String(error)}`, "error");
    }
  }
}
