// Upload of a mesh file: asks for length unit, material and modes, and has the server record it. It can be cancelled.

import { serverUrl } from "../protocol/urls";
import { element, section } from "./elements";
import { kindOfFile } from "./open_files";
import { listenForDrops } from "./file_drop";
import { MaterialFields, PRESETS } from "./material_panel";
import type { JobList } from "./job_list";
import type { Notifications } from "./notifications";

const EXTENSIONS = [".msh", ".vtk", ".vtu", ".mesh", ".veg", ".inp", ".obj", ".stl", ".ply", ".off"];
const DROP = "Drop a mesh here to record it: solid elements (.msh, .vtk, .vtu, .mesh, .veg, .inp) or a closed surface (.stl, .obj, .ply, .off)";
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
  private file: File | null = null;
  private upload: AbortController | null = null;
  /** Uploads that the server has taken, by file name. */
  private readonly accepted = new Map<string, () => void>();
  /** Number of this viewer: the recording is cancelled when the page leaves. */
  viewer = 0;

  constructor(
    private readonly notifications: Notifications,
    private readonly jobs: JobList,
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
      element("p", { class: "secondary", text: "Drop a mesh onto the page, or choose a file: solid elements (Gmsh, VTK, VTU, MEDIT, Vega, Abaqus), or a closed surface (STL, OBJ, PLY, OFF, glTF), which is filled with about 2,000 nodes." }),
      button,
      input,
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
      void this.post();
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

  private async post(): Promise<void> {
    const material = this.fields.value;
    if (this.file === null || material === null) return;
    const query = {
      name: this.file.name,
      young: String(material.young),
      poisson: String(material.poisson),
      density: String(material.density),
      scale: this.scale.value,
      modes: this.modes.value,
    };
    await this.send(this.file, query);
  }

  private async send(file: File, query: Record<string, string>): Promise<void> {
    const job = { type: "progress", job: "upload", phase: file.name, fraction: null } as const;
    const upload = new AbortController();
    this.upload = upload;
    this.jobs.update(job);
    try {
      const address = `record?${new URLSearchParams({ ...query, viewer: String(this.viewer) })}`;
      const response = await fetch(serverUrl(address), { method: "POST", body: file, signal: upload.signal });
      if (!response.ok) throw new Error((await response.text()) || `${response.status} ${response.statusText}`);
      this.notifications.notify(`${file.name} is being recorded`);
      this.accepted.set(file.name, () => void this.send(file, query));
    } catch (error) {
      if (upload.signal.aborted) this.notifications.notify(`The upload of ${file.name} was cancelled`);
      else this.notifications.notify(`${file.name} was not recorded: ${error instanceof Error ? error.message : String(error)}`, "error");
    } finally {
      this.jobs.update({ ...job, done: true });
      if (this.upload === upload) this.upload = null;
    }
  }

  /** Function that uploads a file of this name again, if the server has taken one. */
  again(name: string): (() => void) | undefined {
    return this.accepted.get(name);
  }

  /** Cancels an upload that is under way. */
  cancel(): void {
    this.upload?.abort();
  }
}
