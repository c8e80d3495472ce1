// Film from the page: what starts it, a box with its time and a button that ends it, and the download.

import type { SceneView } from "../rendering/scene_view";
import { element } from "../ui/elements";
import type { Notifications } from "../ui/notifications";
import { saveFile } from "../ui/save_file";
import { fileEnding, Film, filmType, type FilmFile, type FilmSound } from "./film";

/** Length as minutes and seconds. */
export function clock(seconds: number): string {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

/** File name of a film or log of a scene. */
export function filmName(scene: string, ending: string, date: Date): string {
  const plain = scene.normalize("NFKD").toLowerCase().replaceAll(/[^a-z0-9]+/g, "-").replaceAll(/^-|-$/g, "").slice(0, 40);
  const day = [date.getFullYear(), date.getMonth() + 1, date.getDate()].map((part) => String(part).padStart(2, "0")).join("-");
  return ["palpate", plain, day].filter((part) => part !== "").join("-") + `.${ending}`;
}

export class FilmControl {
  private readonly time = element("span", { class: "time", role: "timer", attributes: { "aria-label": "Length of the film" } });
  private readonly button = element("button", { class: "button", type: "button", text: "Stop", title: "End the film and save it", on: { click: () => this.film?.stop() } });
  readonly box = element("div", { class: "film", role: "group", attributes: { "aria-label": "Film" } }, element("i", { attributes: { "aria-hidden": "true" } }), element("span", { text: "Recording" }), this.time, this.button);
  /** Type of the films; null if this browser records none. */
  readonly type = filmType();
  private film: Film | null = null;

  /** `scene` names the scene for the file, `sound` gives its sound; null while it is off. */
  constructor(
    private readonly sceneView: SceneView,
    private readonly notifications: Notifications,
    private readonly scene: () => string,
    private readonly sound: () => FilmSound | null,
  ) {
    this.box.hidden = true;
  }

  get isRecording(): boolean {
    return this.film !== null;
  }

  start(): void {
    if (this.type === null || this.film !== null) return;
    try {
      this.film = new Film(this.sceneView, this.type, this.sound(), (film) => this.ended(film));
    } catch (error) {
      this.ended(error instanceof Error ? error.message : String(error));
      return;
    }
    this.box.hidden = false;
    this.animate();
    this.button.focus();
  }

  stop(): void {
    this.film?.stop();
  }

  /** Once per animation frame. */
  animate(): void {
    if (this.film === null) return;
    this.film.animate();
    const text = clock(this.film.seconds);
    if (this.time.textContent !== text) this.time.textContent = text;
  }

  visibilityChanged(): void {
    this.film?.hidden(document.hidden);
  }

  private ended(film: FilmFile | string): void {
    const { type } = this;
    this.film = null;
    this.box.hidden = true;
    if (typeof film === "string" || type === null) {
      this.notifications.notify(`There is no film: ${typeof film === "string" ? film : "this browser records none"}.`, "error");
      return;
    }
    const name = filmName(this.scene(), fileEnding(type), new Date());
    saveFile(film.data, name);
    const size = Math.max(0.1, film.data.size / 1e6).toFixed(1);
    this.notifications.notify(`${film.full ? "The film has its largest length: " : ""}${name} (${clock(film.seconds)}, ${size} MB) goes to your downloads.`);
  }
}
