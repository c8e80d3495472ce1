// Files that a page without a server opens: logs, which it plays, recordings, each as a scene of its own, and meshes, which it records.

import { keptLogs } from "../worker/kept_logs";
import { MAX_LOGS, scenesAddress, showLogs, showsLogs } from "../protocol/local_logs";
import { element, section } from "./elements";
import { listenForDrops } from "./file_drop";
import type { Notifications } from "./notifications";

/** Kind of a file by its name. */
export type FileKind = "log" | "recording" | "other";

export function kindOfFile(name: string): FileKind {
  const lower = name.toLowerCase();
  if (lower.endsWith(".mcap") || lower.endsWith(".mcap.part")) return "log";
  return lower.endsWith(".palp") ? "recording" : "other";
}

/** Logs to show when some are added to those that are shown: beside them where there is room, or in place of them. */
export function logsToShow<T>(shown: readonly T[], added: readonly T[]): readonly T[] {
  return shown.length + added.length <= MAX_LOGS ? [...shown, ...added] : added;
}

function reasonOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** Section and drop target for files. */
export class OpenFiles {
  readonly section: HTMLElement;
  /** Recordings that were opened, by file name. */
  private readonly opened = new Map<string, () => void>();
  private checking = false;

  /** `live` opens recordings and meshes; it is null where the page shows no live scene. */
  constructor(
    private readonly notifications: Notifications,
    private readonly live: { openRecording(file: File): Promise<void>; openMesh(file: File): void } | null,
  ) {
    const accept = live === null ? ".mcap,.part" : ".mcap,.part,.palp";
    const input = element("input", { type: "file", attributes: { accept, multiple: "", hidden: true, "aria-label": "Files to open" } });
    input.addEventListener("change", () => {
      void this.open([...(input.files ?? [])]);
      input.value = "";
    });
    const choose = element("button", { class: "button wide", type: "button", text: "Choose files…", on: { click: () => input.click() } });
    const about = live === null ? "Drop a second log (.mcap) to compare it with this one." : "Drop a log (.mcap) to play it, two to compare them, or a recording (.palp) to touch it.";
    const back = element("button", { class: "button wide", type: "button", text: "Back to the scenes", on: { click: () => window.location.assign(scenesAddress()) } });
    this.section = section("Open files", live === null, element("p", { class: "secondary", text: `${about} They stay on this device.` }), choose, input, ...(live === null ? [back] : []));
    listenForDrops(live === null ? "Drop a log here (.mcap)" : "Drop a mesh (.stl, .obj, .glb, .vtu, .msh …), a recording (.palp) or a log (.mcap) here", (files) => void this.open(files));
  }

  /** Opens files: logs if there are any, or the first of the others. */
  async open(files: readonly File[]): Promise<void> {
    const logs = files.filter(({ name }) => kindOfFile(name) === "log");
    const [first] = files;
    if (logs.length > 0) await this.openLogs(logs);
    else if (first === undefined) return;
    else if (kindOfFile(first.name) === "recording" && this.live !== null) await this.read(first);
    else if (this.live !== null) this.live.openMesh(first);
    else this.notifications.notify(`${first.name} cannot be opened here: this page plays logs (.mcap)`, "error");
  }

  /** Function that opens a recording of this name again. */
  again(name: string): (() => void) | undefined {
    return this.opened.get(name);
  }

  private async read(file: File): Promise<void> {
    try {
      await this.live?.openRecording(file);
      this.opened.set(file.name, () => void this.read(file));
    } catch (error) {
      this.notifications.notify(`${file.name}: ${reasonOf(error)}`, "error");
    }
  }

  private async openLogs(logs: readonly File[]): Promise<void> {
    if (this.checking) return;
    this.checking = true;
    this.notifications.notify(`Reading ${logs.map(({ name }) => name).join(" and ")} …`);
    try {
      await showLogs(logsToShow(showsLogs() ? await keptLogs() : [], logs));
    } catch (error) {
      this.notifications.notify(reasonOf(error), "error");
    } finally {
      this.checking = false;
    }
  }
}
