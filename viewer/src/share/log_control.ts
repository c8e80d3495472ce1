// Log of the live scene, recorded by the page: what starts it, a box with its length and a button that ends it, and the download.

import type { Notifications } from "../ui/notifications";
import { element } from "../ui/elements";
import { saveFile } from "../ui/save_file";
import { clock, filmName } from "./film_control";

/** Longest log, in simulated time [s]; the module has the same limit. */
export const LONGEST_LOG_S = 60;

/** Log that was written. */
export interface WrittenLog {
  bytes: ArrayBuffer;
  steps: number;
}

/** Recorder of logs. */
export interface LogSource {
  /** Begins a record, at a start of the scene. */
  beginLog(): void;
  /** Ends the record, and writes its log. */
  endLog(): Promise<WrittenLog>;
}

export class LogControl {
  private readonly time = element("span", { class: "time", role: "timer", attributes: { "aria-label": "Length of the log" } });
  private readonly button = element("button", { class: "button", type: "button", text: "Stop", title: "End the log and save it", on: { click: () => void this.stop() } });
  readonly box = element("div", { class: "scene-log", role: "group", attributes: { "aria-label": "Log" } }, element("i", { attributes: { "aria-hidden": "true" } }), element("span", { text: "Log" }), this.time, this.button);
  /** Scenes that have begun since the start: the first is that of the log. */
  private scenes = 0;
  private recording = false;

  /** `source` is null with a server; `scene` names the scene for the file. */
  constructor(
    readonly source: LogSource | null,
    private readonly notifications: Notifications,
    private readonly scene: () => string,
  ) {
    this.box.hidden = true;
  }

  get isRecording(): boolean {
    return this.recording;
  }

  start(): void {
    if (this.source === null || this.recording) return;
    this.recording = true;
    this.scenes = 0;
    this.time.textContent = clock(0);
    this.box.hidden = false;
    this.source.beginLog();
    this.button.focus();
  }

  /** A scene begins: whatever restarts it ends the log. */
  sceneBegins(): void {
    if (!this.recording) return;
    this.scenes += 1;
    if (this.scenes > 1) void this.stop();
  }

  /** Shows the length [s, simulated time]. */
  frame(time: number): void {
    if (!this.recording || this.scenes === 0) return;
    const text = clock(time);
    if (this.time.textContent !== text) this.time.textContent = text;
    if (time >= LONGEST_LOG_S) void this.stop();
  }

  async stop(): Promise<void> {
    const { source } = this;
    if (source === null || !this.recording) return;
    this.abort();
    const name = filmName(this.scene(), "mcap", new Date());
    try {
      const { bytes, steps } = await source.endLog();
      saveFile(new Blob([bytes], { type: "application/octet-stream" }), name);
      this.notifications.notify(`${name} (${steps} steps, ${Math.max(0.1, bytes.byteLength / 1e6).toFixed(1)} MB) goes to your downloads. palpate replay and palpate render open it, and this page does.`);
    } catch (error) {
      this.notifications.notify(`There is no log: ${error instanceof Error ? error.message : String(error)}.`, "error");
    }
  }

  /** Ends it without a log, as when the worker has ended. */
  abort(): void {
    this.recording = false;
    this.box.hidden = true;
  }
}
