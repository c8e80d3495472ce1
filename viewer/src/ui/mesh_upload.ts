// Import of a mesh file: asks for length unit, material and modes, and has it recorded.

import { element, section } from "./elements";
import { kindOfFile } from "./open_files";
import { listenForDrops } from "./file_drop";
import { MaterialFields, PRESETS } from "./material_panel";
import type { MeshRecorder } from "./mesh_recorder";
import type { Notifications } from "./notifications";
import { saveFile } from "./save_file";

const EXTENSIONS = [".msh", ".vtk", ".vtu", ".mesh", ".meshb", ".veg", ".inp", ".obj", ".stl", ".ply", ".off", ".glb", ".gltf"];
const DROP = "Drop a mesh here to record it: solid elements (.msh, .vtk, .vtu, .mesh, .veg, .inp) or a closed surface (.stl, .obj, .ply, .off, .glb)";
const SCALES: readonly [string, number][] = [
  ["millimetres", 0.001],
  ["centimetres", 0.01],
  ["metres", 1],
  ["inches", 0.0254],
];

export class MeshUpload {
  readonly section: HTMLElement;
  readonly dialog = element("dialog", { class: "upload-dialog", attributes: { "aria-labelledby": "upload-title" } });
  private readonly scale = element("select");
  private readonly modes = element("input", { type: "number", attributes: { min: "1", max: "2000", value: "200" } });
  private readonly fields = new MaterialFields();
  private readonly fileName = element("strong");
  private readonly saves = element("div");
  private file: File | null = null;

  constructor(
    private readonly notifications: Notifications,
    private readonly recorder: MeshRecorder,
  ) {
    const input = element("input", { type: "file", attributes: { accept: EXTENSIONS.join(","), hidden: true } });
    input.addEventListener("change", () => {
      if (input.files?.[0] !== undefined) this.open(input.files[0]);
      input.value = "";
    });
    const button = element("button", { class: "button wide", type: "button", text: "Choose a mesh file…", on: { click: () => input.click() } });
    this.section = section(
      "Import a mesh",
      false,
      element("p", { class: "secondary", text: `Drop a mesh onto the page, or choose a file: solid elements (Gmsh, VTK, VTU, MEDIT, Vega, Abaqus), or a closed surface (STL, OBJ, PLY, OFF, glTF). ${recorder.about}` }),
      button,
      input,
      this.saves,
    );
    this.scale.append(...SCALES.map(([name, factor]) => element("option", { text: name, attributes: { value: String(factor) } })));
    this.fields.value = PRESETS[1];
    const form = element("form", { attributes: { method: "dialog" } });
    form.append(
      element("h2", { id: "upload-title" }, "Record ", this.fileName),
      element("label", { class: "field" }, element("span", { class: "name", text: "Length unit" }), this.scale),
      ...this.fields.rows,
      element(
        "label",
        { class: "field", title: "Number of vibration modes; more modes are more accurate and take longer to record" },
        element("span", { class: "name", text: "Modes" }),
        this.modes,
      ),
      element("p", { class: "secondary", text: "Recording takes seconds to minutes. The scene keeps running; the new object opens when it is ready." }),
      element(
        "div",
        { class: "dialog-buttons" },
        element("button", { class: "button", type: "button", text: "Cancel", on: { click: () => this.dialog.close() } }),
        element("button", { class: "button primary", type: "submit", text: "Record" }),
      ),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.dialog.close();
      void this.record();
    });
    this.dialog.append(form);
  }

  /** Takes files that are dropped onto the page. */
  listenForDrops(): void {
    listenForDrops(DROP, ([file]) => this.open(file));
  }

  /** Asks about a mesh file that is to be recorded. */
  open(file: File): void {
    const kind = kindOfFile(file.name);
    if (kind === "log") {
      this.notifications.notify(`${file.name} is a log: palpate serve ${file.name} plays it`, "error");
      return;
    }
    if (kind === "recording") {
      this.notifications.notify(`${file.name} is a recording: name it in a scene file (docs/scene.md), and palpate serve opens that`, "error");
      return;
    }
    if (!EXTENSIONS.some((extension) => file.name.toLowerCase().endsWith(extension))) {
      this.notifications.notify(`${file.name} is not a supported mesh file. Supported: ${EXTENSIONS.join(", ")}`, "error");
      return;
    }
    this.file = file;
    this.fileName.textContent = file.name;
    this.dialog.showModal();
  }

  private async record(): Promise<void> {
    const { file, fields } = this;
    const material = fields.value;
    if (file === null || material === null) return;
    const recording = await this.recorder.record(file, { ...material, scale: Number(this.scale.value), modes: Number(this.modes.value) });
    if (recording === null) return;
    const name = `${file.name.replace(/\.[^.]*$/, "")}.palp`;
    const save = element("button", { class: "button wide", type: "button", text: `Save ${name}`, on: { click: () => saveFile(new Blob([recording]), name) } });
    this.saves.replaceChildren(...[...this.saves.children].filter((other) => other.textContent !== save.textContent), save);
  }
}
