// Live mode: shows the frames of a running scene and sends pointer input and settings.

import type { Connection } from "../protocol/connection";
import type { DeviceAssigned, Hello, Progress, SceneMessage, Status, TouchMode } from "../protocol/messages";
import type { Frame } from "../protocol/frame";
import { hasFloor, loadScene } from "../rendering/scene_loader";
import { FrameMismatch } from "../rendering/elastic/elastic_mesh";
import { MeshUpload } from "../ui/mesh_upload";
import { OpenFiles } from "../ui/open_files";
import { element } from "../ui/elements";
import { ForceReadout } from "../ui/force_readout";
import type { PageLayout } from "../ui/page_layout";
import { Hint } from "../ui/hint";
import { JobList } from "../ui/job_list";
import { PhysicsPanel } from "../ui/physics_panel";
import { LiveToolbar } from "../ui/live_toolbar";
import { MaterialPanel } from "../ui/material_panel";
import { AccuracyPanel } from "../ui/accuracy_panel";
import { PlotPanels } from "../ui/plot_panels";
import { TimingPanel } from "../ui/timing_panel";
import { LostObjects } from "../ui/lost_objects";
import { OwnSettings } from "../ui/physics_settings";
import { Pace, paceText } from "../ui/pace";
import { vibrationSwitch } from "../ui/vibration_switch";
import { ScaleLock } from "../ui/scale_lock";
import type { SoundBlock } from "../sound/sound_block";
import { SoundControl } from "../sound/sound_control";
import { withoutLink } from "../share/link";
import { LinkedStart } from "../share/linked_start";
import { Share } from "../share/share";
import type { DisplayPanel } from "../ui/display_panel";
import type { Notifications } from "../ui/notifications";
import { ScenesPanel } from "../ui/scenes_panel";
import type { SceneView } from "../rendering/scene_view";
import { runsInWorker, type WorkerConnection } from "../protocol/worker_connection";
import { GamepadPointers } from "../interaction/gamepad_pointers";
import { GHOST_POINTER, GhostFinger, wantsGhost } from "../interaction/ghost_finger";
import { KeyboardPointer } from "../interaction/keyboard_pointer";
import { PointerEvents } from "../interaction/pointer_events";
import type { Vibration } from "../interaction/vibration";
import { Touches } from "../interaction/touches";
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
  private readonly touches: Touches;
  private readonly pointers: PointerEvents;
  private readonly keyboard: KeyboardPointer;
  private readonly gamepads: GamepadPointers;
  private readonly vibration: Vibration;
  private readonly toolbar: LiveToolbar;
  private readonly ghost: GhostFinger;
  private readonly sound: SoundControl;
  private readonly hint: Hint;
  private readonly forceReadout = new ForceReadout();
  private readonly jobs = new JobList(() => this.cancelJob());
  private readonly meshUpload: MeshUpload;
  /** Files, on a page without a server. */
  private readonly openFiles: OpenFiles | null = null;
  private readonly scenes: ScenesPanel;
  private readonly physics: PhysicsPanel;
  private readonly material: MaterialPanel;
  private readonly plots = new PlotPanels();
  private readonly timing = new TimingPanel();
  private readonly accuracy = new AccuracyPanel();
  private readonly viewers = element("span", { class: "chip" });
  private readonly paceChip = element("span", { class: "chip slow", role: "status", title: "This machine computes the scene more slowly than it should run" });
  private readonly pace = new Pace();
  private readonly lostObjects: LostObjects;
  private lostCheckedAt = 0;
  private readonly ownSettings = new OwnSettings();
  private readonly linked: LinkedStart;
  private readonly share: Share;
  private readonly loading = element("div", { class: "loading", role: "status" });
  private loadAbort: AbortController | null = null;
  private requestedScene: SceneMessage | null = null;
  private frame: Frame | null = null;
  private frameIsNew = false;

  constructor(
    private readonly sceneView: SceneView,
    private readonly layout: PageLayout,
    private readonly notifications: Notifications,
    display: DisplayPanel,
    private readonly connection: Pick<Connection, "send">,
    worker: WorkerConnection | null,
  ) {
    const send = connection.send.bind(connection);
    const first: TouchMode = window.matchMedia("(pointer: coarse)").matches ? "hold" : "touch";
    this.touches = new Touches(sceneView, send, { first: 0, count: GHOST_POINTER.first });
    this.ghost = new GhostFinger(sceneView, send);
    this.hint = new Hint(() => this.showAccuracy());
    if (this.hint.isDismissed || !wantsGhost(window.location.href, window.matchMedia("(prefers-reduced-motion: reduce)").matches)) this.ghost.stop();
    // Before the canvas gets the press, so that the device slot is free.
    document.addEventListener("pointerdown", (event) => event.target === sceneView.canvas && this.ghost.stop(), { capture: true });
    this.pointers = new PointerEvents(sceneView, this.touches);
    this.pointers.mode = first;
    const mode = () => this.pointers.mode;
    this.keyboard = new KeyboardPointer(sceneView, this.touches, mode);
    this.gamepads = new GamepadPointers(sceneView, this.touches, mode, (device) => this.forceShare(device));
    const { vibration, row } = vibrationSwitch();
    this.vibration = vibration;
    this.touches.onBegin = () => {
      this.ghost.stop();
      this.hint.dismiss();
      if (this.toolbar.isPaused) this.notifications.notify(PAUSED);
    };
    this.touches.onRefused = () => this.notifications.notify("All device slots of this scene are in use. Try again when another pointer is released.");
    this.toolbar = new LiveToolbar(
      send,
      first,
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
    this.share = new Share(sceneView, notifications, worker, () => {
      const scene = this.requestedScene;
      return scene === null ? null : { scene, own: this.ownSettings.values };
    });
    this.scenes = new ScenesPanel((id) => {
      this.linked.end();
      send({ type: "open_scene", scene: id });
    });
    this.physics = new PhysicsPanel(send);
    notifications.onError = (text) => this.physics.refused(text);
    this.material = new MaterialPanel(send);
    const meshUpload = new MeshUpload(notifications, this.jobs);
    this.meshUpload = meshUpload;

    if (worker === null) {
      meshUpload.listenForDrops();
    } else {
      this.openFiles = new OpenFiles(notifications, async (file) => {
        this.linked.end();
        worker.openRecording(file.name, await file.arrayBuffer());
      });
    }

    this.viewers.hidden = true;
    this.paceChip.hidden = true;
    this.loading.hidden = true;
    layout.chips.append(this.paceChip, this.viewers);
    layout.toolbar.append(...this.toolbar.parts, this.share.button, ...this.sound.parts);
    layout.overlayTop.append(this.share.film.box, this.share.log.box, this.forceReadout.box, this.hint.box, this.jobs.box);
    layout.overlayBottom.append(this.lostObjects.box);
    layout.viewArea.append(this.loading, new ScaleLock(sceneView).button);
    display.section.append(...row);
    layout.controls.append(this.scenes.section, display.section, this.physics.section, this.material.section, meshUpload.section, ...(this.openFiles === null ? [] : [this.openFiles.section]));
    layout.measurements.append(...this.plots.sections, this.timing.section, this.accuracy.section);
    layout.page.append(meshUpload.dialog, this.share.element);
    sceneView.drawOverlay = (context, view) => {
      this.keyboard.draw(context, view);
      this.gamepads.draw(context, view, performance.now());
      this.touches.draw(context, view);
      this.ghost.draw(context, view);
    };
  }

  /** Force on a device, as a share of the displayed force range. */
  private forceShare(device: number): number {
    const force = this.frame?.devices[device]?.force ?? [0, 0, 0];
    return Math.hypot(...force) / (this.sceneView.graphs[0]?.forceRange.value ?? 1);
  }

  /** Opens the certificates. */
  private showAccuracy(): void {
    this.layout.sidebar = "measurements";
    this.accuracy.section.open = true;
    this.accuracy.section.scrollIntoView();
  }

  /** Begins the scene again with the settings that it came with, and shows it as at first. */
  private reset(): void {
    const scene = this.requestedScene;
    const restoration = scene === null ? null : this.ownSettings.restoration(scene);
    if (restoration !== null) this.connection.send(restoration);
    this.restart();
  }

  /** Begins the scene again with its present settings. */
  private restart(): void {
    this.connection.send({ type: "reset" });
    this.sceneView.resetToStart();
  }

  hello(hello: Hello): void {
    this.suspend();
    this.scenes.setScenes(hello.scenes);
    this.linked.hello(hello.scenes);
    this.meshUpload.viewer = hello.viewer;
    this.meshUpload.section.hidden = !hello.records;
    this.material.records = hello.records;
    this.sound.connected();
    this.stream();
  }

  /** Requests the frame stream; none while the page is hidden. */
  private stream(): void {
    this.connection.send({ type: "stream", format: this.sceneView.reconstructsOnGpu ? "modal" : "vertices", stride: document.hidden ? 0 : 1 });
  }

  private cancelJob(): void {
    this.meshUpload.cancel();
    this.connection.send({ type: "cancel_job" });
  }

  visibilityChanged(): void {
    if (document.hidden) {
      this.touches.endAll();
      this.ghost.interrupt();
      this.ghost.resume();
    }
    this.share.film.visibilityChanged();
    this.stream();
  }

  /** Lets presses wait for the next frame of a scene that is loaded. */
  private suspend(): void {
    this.touches.suspend();
    this.ghost.interrupt();
    this.frameIsNew = false;
  }

  scene(scene: SceneMessage): void {
    this.loadAbort?.abort();
    this.suspend();
    this.pointers.clear();
    const loadAbort = new AbortController();
    this.loadAbort = loadAbort;
    this.requestedScene = scene;
    this.layout.title.textContent = scene.title;
    this.layout.about.textContent = scene.about;
    this.layout.about.title = scene.about;
    document.title = `${scene.title} · palpate`;
    this.ownSettings.note(scene);
    this.share.log.sceneBegins();
    const again = scene.id === null ? (this.meshUpload.again(scene.title) ?? this.openFiles?.again(scene.title)) : undefined;
    if (again !== undefined) this.scenes.addUpload(scene.title, again);
    this.scenes.setCurrent(scene.id, scene.title);
    this.physics.update(scene);
    this.material.update(scene);
    this.accuracy.update([scene]);
    this.notifications.showWarnings(scene.warnings);
    this.showLoading("Loading the scene …");
    const onProgress = (fraction: number, bytes: number) => {
      if (bytes > 2e6) this.showLoading(`Loading the scene: ${Math.round(100 * fraction)} % of ${Math.round(bytes / 1e6)} MB`);
    };
    loadScene(scene, this.sceneView.reconstructsOnGpu, loadAbort.signal, onProgress)
      .then((loaded) => {
        if (loadAbort.signal.aborted) return;
        const previous = this.sceneView.graphs[0]?.info ?? null;
        const sameScene = previous !== null && previous.id === scene.id && previous.objects.length === scene.objects.length;
        if (!sameScene) {
          this.sceneView.orbit.setHome(scene.view.center, scene.view.radius, scene.gravity, hasFloor(scene));
        }
        this.sceneView.setScene(0, loaded);
        // The newest frame, also of a scene that is paused.
        this.stream();
        this.sceneView.fitCamera();
        // Not before: what it changes replaces the data that was being loaded.
        this.linked.scene(scene);
        const viewpoint = this.linked.takeViewpoint();
        if (viewpoint !== null) this.sceneView.orbit.look(viewpoint);
        this.plots.reset(scene);
        this.frame = null;
        this.showLoading(null);
        this.hint.show(scene);
      })
      .catch((error: unknown) => {
        if (loadAbort.signal.aborted) return;
        this.showLoading(null);
        this.notifications.notify(`The scene could not be loaded: ${error instanceof Error ? error.message : String(error)}`, "error");
      });
  }

  private showLoading(text: string | null): void {
    this.loading.hidden = text === null;
    this.loading.textContent = text;
  }

  /** Reloads the scene after a lost WebGL context. */
  contextRestored(): void {
    const scene = this.requestedScene;
    this.sceneView.clear();
    if (scene !== null) this.scene(scene);
  }

  soundReceived(block: SoundBlock): void {
    this.sound.play(block);
  }

  frameReceived(frame: Frame): void {
    const graph = this.sceneView.graphs[0];
    // A restarted server counts generations from the start again, so the generation alone is not enough.
    if (graph === undefined || graph.info !== this.requestedScene || frame.generation !== graph.info.generation) return;
    this.plots.update(frame);
    this.share.log.frame(frame.time);
    this.frame = frame;
    this.frameIsNew = true;
  }

  status(status: Status): void {
    this.toolbar.update(status);
    this.timing.update(status);
    this.showPace(status);
    this.viewers.hidden = !(status.viewers > 1);
    this.viewers.textContent = `${status.viewers} viewers`;
    this.viewers.title = "Everybody who has this page open sees and touches the same scene";
  }

  private showPace(status: Status): void {
    const scene = this.requestedScene;
    const pace = scene === null ? null : this.pace.update(status, scene.step_s, performance.now() / 1000);
    const text = paceText(pace, status.slowdown);
    this.paceChip.hidden = text === null;
    this.paceChip.textContent = text;
  }

  assigned(message: DeviceAssigned): void {
    this.touches.assign(message.pointer, message.device);
    this.ghost.assign(message.pointer, message.device);
  }

  progress(progress: Progress): void {
    this.jobs.update(progress);
  }

  connectionLost(): void {
    this.suspend();
    this.paceChip.hidden = true;
    this.jobs.clear();
    this.share.log.abort();
    this.timing.clear();
    this.forceReadout.show(null, null, []);
  }

  animate(now: number): void {
    this.keyboard.animate(now);
    this.gamepads.animate(now);
    this.touches.animate(now);
    this.share.film.animate();
    this.ghost.animate(now, { free: this.isBuiltIn() && !this.toolbar.isPaused && !this.isTouched() });
    const graph = this.sceneView.graphs[0];
    if (this.frameIsNew && this.frame !== null && graph !== undefined) {
      this.frameIsNew = false;
      try {
        graph.setFrame(this.frame, now / 1000);
        this.sceneView.requestRender();
        this.touches.resume();
        this.ghost.resume();
      } catch (error) {
        if (!(error instanceof FrameMismatch)) throw error;
        this.notifications.notifyOnce("frame mismatch", `The server sent a frame that does not fit the scene; it was dropped: ${error.message}`);
      }
    }
    this.forceReadout.show(this.frame, graph?.info ?? null, this.touches.devices);
    this.vibration.animate(new Map(this.touches.devices.map((device) => [device, this.forceShare(device)])), now);
    this.plots.animate(now);
    if (now - this.lostCheckedAt > LOST_INTERVAL_MS) {
      this.lostCheckedAt = now;
      this.lostObjects.show(this.sceneView.lostObjects());
    }
  }

  /** Whether the server lists the scene: in scenes of the user's own nothing moves by itself. */
  private isBuiltIn(): boolean {
    return typeof this.requestedScene?.id === "string";
  }

  /** Whether a pointer other than the ghost touches the scene. */
  private isTouched(): boolean {
    const info = this.sceneView.graphs[0]?.info;
    return this.frame?.devices.some(({ mode }, i) => mode !== "inactive" && info?.devices[i]?.pointer === true && i !== this.ghost.device) ?? false;
  }

  applyTheme(): void {
    this.plots.applyTheme();
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
