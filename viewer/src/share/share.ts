// Share: button, dialog, film and log of the live page.

import type { SceneMessage } from "../protocol/messages";
import { token } from "../protocol/token";
import { runsInWorker } from "../protocol/worker_connection";
import type { SceneView } from "../rendering/scene_view";
import { iconButton } from "../ui/elements";
import type { Notifications } from "../ui/notifications";
import { addressWith, frameHtml, limitsOf } from "./addresses";
import type { FilmSound } from "./film";
import { FilmControl } from "./film_control";
import { LogControl, type LogSource } from "./log_control";
import { linkTo, queryOf } from "./link";
import { ShareDialog, type Offer } from "./share_dialog";

export class Share {
  readonly button = iconButton("share", "Share: link, QR code, film, log (S)", () => this.open(), "Share");
  readonly film: FilmControl;
  readonly log: LogControl;
  private readonly dialog: ShareDialog;

  constructor(
    private readonly sceneView: SceneView,
    notifications: Notifications,
    logs: LogSource | null,
    /** Scene that is shown. */
    private readonly shown: () => SceneMessage | null,
    sound: () => FilmSound | null,
  ) {
    const name = () => {
      const scene = shown();
      return scene?.id ?? scene?.title ?? "";
    };
    this.film = new FilmControl(sceneView, notifications, name, sound);
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
    const scene = this.shown();
    // `id` is null for a scene that the server does not list.
    if (scene === null || typeof scene.id !== "string") return { link: null, frame: null, film, log };
    const { orbit } = this.sceneView;
    const link = linkTo(scene, orbit.isHome ? null : orbit.viewpoint);
    const page = window.location.href;
    const address = addressWith(page, queryOf(link));
    return { link: { address, limits: limitsOf(page, token() !== null) }, frame: runsInWorker() ? frameHtml(address, `palpate: ${scene.title}`) : null, film, log };
  }
}
