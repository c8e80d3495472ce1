// Share: button, dialog, film and log of the live page.

import type { SceneMessage } from "../protocol/messages";
import { token } from "../protocol/token";
import { runsInWorker } from "../protocol/worker_connection";
import type { SceneView } from "../rendering/scene_view";
import { iconButton } from "../ui/elements";
import type { Notifications } from "../ui/notifications";
import { physicsOf, valuesOf, type SettingValues } from "../ui/physics_settings";
import { addressWith, frameHtml, limitsOf } from "./addresses";
import { FilmControl } from "./film_control";
import { LogControl, type LogSource } from "./log_control";
import { linkTo, queryOf } from "./link";
import { ShareDialog, type Offer } from "./share_dialog";

/** Scene that is shown, with the settings that it came with. */
export interface SharedScene {
  scene: SceneMessage;
  own: SettingValues;
}

export class Share {
  readonly button = iconButton("share", "Share: link, QR code, film, log (S)", () => this.open(), "Share");
  readonly film: FilmControl;
  readonly log: LogControl;
  private readonly dialog: ShareDialog;

  constructor(
    private readonly sceneView: SceneView,
    notifications: Notifications,
    logs: LogSource | null,
    private readonly shown: () => SharedScene | null,
  ) {
    const name = () => {
      const scene = shown()?.scene;
      return scene?.id ?? scene?.title ?? "";
    };
    this.film = new FilmControl(sceneView, notifications, name);
    this.log = new LogControl(logs, notifications, name);
    this.dialog = new ShareDialog(
      () => this.offer(),
      () => (this.film.isRecording ? this.film.stop() : this.film.start()),
      () => (this.log.isRecording ? void this.log.stop() : this.log.start()),
    );
  }

  /** Dialog, for the page. */
  get element(): HTMLDialogElement {
    return this.dialog.dialog;
  }

  open(): void {
    this.dialog.open();
  }

  private offer(): Offer {
    const film = this.film.type === null ? "impossible" : this.film.isRecording ? "running" : "possible";
    const log = this.log.source === null ? "impossible" : this.log.isRecording ? "running" : "possible";
    const shown = this.shown();
    // `id` is null for a scene that the server does not list.
    if (shown === null || typeof shown.scene.id !== "string") return { link: null, frame: null, film, log };
    const { orbit } = this.sceneView;
    const link = linkTo(shown.scene.id, shown.own, valuesOf(physicsOf(shown.scene)), orbit.isHome ? null : orbit.viewpoint);
    const page = window.location.href;
    const address = addressWith(page, queryOf(link));
    return { link: { address, limits: limitsOf(page, token() !== null) }, frame: runsInWorker() ? frameHtml(address, `palpate: ${shown.scene.title}`) : null, film, log };
  }
}
