// Live mode: shows the frames of a running scene and sends pointer input and settings.

import type { Connection } from "../protocol/connection";
import type { ClientMessage, DeviceAssigned, Hello, Progress, SceneMessage, Status } from "../protocol/messages";
import type { Frame } from "../protocol/frame";
import { HaplyPanel } from "../ui/haply_panel";
import { PageRecorder, ServerRecorder, type MeshRecorder } from "../ui/mesh_recorder";
import { MeshUpload } from "../ui/mesh_upload";
import { OpenFiles } from "../ui/open_files";
import { ForceReadout } from "../ui/force_readout";
import type { PageLayout } from "../ui/page_layout";
import { Hint } from "../ui/hint";
import { JobList } from "../ui/job_list";
import { LiveToolbar } from "../ui/live_toolbar";
import { LostObjects } from "../ui/lost_objects";
import { restoration } from "../ui/physics_settings";
import { ScaleLock } from "../ui/scale_lock";
import type { SoundBlock } from "../sound/sound_block";
import { SoundControl } from "../sound/sound_control";
import { withoutLink } from "../share/link";
import { LinkedStart } from "../share/linked_start";
import { Share } from "../share/share";
import type { DisplayPanel } from "../ui/display_panel";
import type { Notifications } from "../ui/notifications";
import type { SceneView } from "../rendering/scene_view";
import { runsInWorker, type WorkerConnection } from "../protocol/worker_connection";
import { VrSession } from "../xr/vr_session";
import { LivePanels } from "./live_panels";
import { LivePointers } from "./live_pointers";
import { LiveScene } from "./live_scene";
import type { PageMode } from "./page_mode";

const LOST_INTERVAL_MS = 700;
/** Message at a press while the scene is paused. */
const PAUSED = "Paused: the press acts when time goes on (Space), or step by step (.)";

/** Takes the link out of the address of a server's page: reloaded, it shows what the server shows then. A worker begins anew with the link. */
function forgetLink(): void {
  if (runsInWorker()) return;
  const url = new URL(window.location.href);
  url.search = withoutLink(url.search);
  if (url.href !== window.location.href) history.replaceState(history.state, "", url);
}

/** Page mode of a running scene. */
export class LiveMode implements PageMode {
  private readonly shown: LiveScene;
  private readonly pointers: LivePointers;
  private readonly panels: LivePanels;
  private readonly toolbar: LiveToolbar;
  private readonly sound: SoundControl;
  private readonly hint: Hint;
  private readonly forceReadout = new ForceReadout();
  private readonly jobs = new JobList((job) => this.cancelJob(job));
  private readonly recorder: MeshRecorder;
  private readonly meshUpload: MeshUpload;
  /** Haptic device and files, on a page without a server. */
  private readonly haply: HaplyPanel | null = null;
  private readonly openFiles: OpenFiles | null = null;
  private readonly lostObjects: LostObjects;
  private lostCheckedAt = 0;
  private readonly linked: LinkedStart;
  private readonly share: Share;
  private readonly send: (message: ClientMessage) => void;

  constructor(
    private readonly sceneView: SceneView,
    layout: PageLayout,
    private readonly notifications: Notifications,
    display: DisplayPanel,
    connection: Pick<Connection, "send">,
    worker: WorkerConnection | null,
  ) {
    const send = connection.send.bind(connection);
    this.send = send;
    this.shown = new LiveScene(sceneView, notifications);
    this.panels = new LivePanels(layout, send, (id) => {
      this.linked.end();
      send({ type: "open_scene", scene: id });
    });
    notifications.onError = (text) => {
      this.panels.physics.refused(text);
      this.linked.refused();
    };
    this.hint = new Hint(() => this.panels.showAccuracy());
    this.pointers = new LivePointers(sceneView, this.shown, send, !this.hint.isDismissed);
    this.pointers.touches.onBegin = () => {
      this.pointers.stopGhost();
      this.hint.dismiss();
      if (this.toolbar.isPaused) this.notifications.notify(PAUSED);
    };
    this.pointers.touches.onRefused = () => this.notifications.notify("All device slots of this scene are in use. Try again when another pointer is released.");
    this.toolbar = new LiveToolbar(
      send,
      this.pointers.mode,
      (chosen) => {
        this.pointers.mode = chosen;
      },
      () => this.reset(),
      () => sceneView.resetView(),
    );
    this.lostObjects = new LostObjects(
      () => sceneView.followObjects(),
      () => this.restart(),
    );
    this.sound = new SoundControl(send, notifications);
    this.linked = new LinkedStart(window.location.search, send, (text) => notifications.notify(text, "error"), forgetLink);
    this.share = new Share(sceneView, notifications, worker, () => this.shown.requested, () => this.sound.forFilm());
    const vr = new VrSession(sceneView, this.pointers.hands, notifications, (now) => this.animate(now), () => {
      this.pointers.stopGhost();
      this.hint.dismiss();
    });
    if (worker === null) {
      this.recorder = new ServerRecorder(notifications, this.jobs);
      this.meshUpload = new MeshUpload(notifications, this.recorder);
      this.meshUpload.listenForDrops();
    } else {
      const open = (name: string, recording: ArrayBuffer, about: string) => {
        this.linked.end();
        worker.openRecording(name, recording, about);
      };
      this.haply = new HaplyPanel(worker, sceneView);
      this.recorder = new PageRecorder(notifications, this.jobs, open);
      const meshUpload = new MeshUpload(notifications, this.recorder);
      this.meshUpload = meshUpload;
      this.openFiles = new OpenFiles(notifications, {
        openRecording: async (file) => open(file.name, await file.arrayBuffer(), "Your own recording. Press and drag it."),
        openMesh: (file) => meshUpload.open(file),
      });
    }
    const { meshUpload } = this;

    layout.toolbar.append(...this.toolbar.parts, this.share.button, ...this.sound.parts, vr.button);
    layout.overlayTop.append(this.share.film.box, this.share.log.box, this.forceReadout.box, this.hint.box, this.jobs.box);
    layout.overlayBottom.append(this.lostObjects.box);
    layout.viewArea.append(this.shown.box, new ScaleLock(sceneView).button);
    display.section.append(...this.pointers.vibrationRow);
    const { scenes, physics, material } = this.panels;
    layout.controls.append(scenes.section, display.section, physics.section, material.section, meshUpload.section, ...[this.openFiles, this.haply].flatMap((panel) => (panel === null ? [] : [panel.section])));
    layout.page.append(meshUpload.dialog, this.share.element);
  }

  /** Begins the scene again with the settings that it came with, and shows it as at first. */
  private reset(): void {
    const scene = this.shown.requested;
    const change = scene === null ? null : restoration(scene);
    this.linked.end();
    if (change !== null) this.send(change);
    this.restart();
  }

  /** Begins the scene again with its present settings. */
  private restart(): void {
    this.send({ type: "reset" });
    this.sceneView.resetToStart();
  }

  hello(hello: Hello): void {
    this.suspend();
    this.panels.scenes.setScenes(hello.scenes);
    this.linked.hello(hello);
    this.meshUpload.section.hidden = !this.recorder.hello(hello);
    this.panels.material.records = hello.records;
    this.sound.connected();
    this.stream();
  }

  /** Requests the frame stream; none while the page is hidden. */
  private stream(): void {
    this.send({ type: "stream", format: this.sceneView.reconstructsOnGpu ? "modal" : "vertices", stride: document.hidden ? 0 : 1 });
  }

  private cancelJob(job: string): void {
    if (!this.recorder.cancel(job)) this.send({ type: "cancel_job" });
  }

  visibilityChanged(): void {
    if (document.hidden) this.pointers.hidden();
    this.share.film.visibilityChanged();
    this.stream();
  }

  /** Lets presses wait for the next frame of a scene that is loaded. */
  private suspend(): void {
    this.pointers.suspend();
    this.shown.suspend();
  }

  scene(scene: SceneMessage): void {
    this.suspend();
    this.pointers.clear();
    this.share.log.sceneBegins();
    const again = scene.id === null ? (this.recorder.again(scene.title) ?? this.openFiles?.again(scene.title)) : undefined;
    this.panels.scene(scene, again);
    this.notifications.showWarnings(scene.warnings);
    this.shown.load(scene, () => {
      // The newest frame, also of a scene that is paused.
      this.stream();
      this.sceneView.fitCamera();
      // Not before: what it changes replaces the data that was being loaded.
      this.linked.scene(scene);
      const viewpoint = this.linked.takeViewpoint();
      if (viewpoint !== null) this.sceneView.orbit.look(viewpoint);
      this.panels.shown(scene);
      this.haply?.place();
      this.hint.show(scene);
    });
  }

  /** Reloads the scene after a lost WebGL context. */
  contextRestored(): void {
    const scene = this.shown.requested;
    this.sceneView.clear();
    if (scene !== null) this.scene(scene);
  }

  soundReceived(block: SoundBlock): void {
    this.sound.play(block);
  }

  frameReceived(frame: Frame): void {
    if (!this.shown.receive(frame)) return;
    this.panels.frame(frame);
    this.share.log.frame(frame.time);
  }

  status(status: Status): void {
    this.toolbar.update(status);
    this.panels.status(status, this.shown.requested);
    if (status.haptic_device !== undefined) this.haply?.status(status.haptic_device);
  }

  assigned(message: DeviceAssigned): void {
    this.pointers.assign(message);
  }

  progress(progress: Progress): void {
    this.jobs.update(progress);
  }

  connectionLost(): void {
    this.suspend();
    this.panels.connectionLost();
    this.jobs.clear();
    this.share.log.abort();
    this.forceReadout.show(null, null, []);
  }

  animate(now: number): void {
    this.share.film.animate();
    this.pointers.animate(now, this.shown.isBuiltIn && !this.toolbar.isPaused);
    if (this.shown.showFrame(now)) this.pointers.resume();
    this.forceReadout.show(this.shown.frame, this.sceneView.graphs[0]?.info ?? null, this.pointers.devices);
    this.pointers.vibrate(now);
    this.panels.animate(now);
    if (now - this.lostCheckedAt > LOST_INTERVAL_MS) {
      this.lostCheckedAt = now;
      this.lostObjects.show(this.sceneView.lostObjects());
    }
  }

  applyTheme(): void {
    this.panels.applyTheme();
  }

  handleKey(event: KeyboardEvent): boolean {
    switch (event.key) {
      case " ":
        this.toolbar.togglePause();
        return true;
      case ".":
        this.toolbar.singleStep();
        return true;
      case "g":
        this.toolbar.toggleMode();
        return true;
      case "r":
        this.toolbar.reset();
        return true;
      case "s":
        this.share.open();
        return true;
      case "[":
        this.toolbar.changeSpeed(-1);
        return true;
      case "]":
        this.toolbar.changeSpeed(1);
        return true;
      default:
        return false;
    }
  }
}
