// Live mode: shows the frames of a running scene and sends pointer input and settings.

import type { Connection } from "../protocol/connection";
import type { DeviceAssigned, Hello, Progress, SceneMessage, Status, TouchMode } from "../protocol/messages";
import type { Frame } from "../protocol/frame";
import { hasFloor, loadScene } from "../rendering/scene_loader";
import { FrameMismatch } from "../rendering/elastic/elastic_mesh";
import { MeshUpload } from "../ui/mesh_upload";
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
import type { SoundBlock } from "../sound/sound_block";
import { SoundControl } from "../sound/sound_control";
import type { DisplayPanel } from "../ui/display_panel";
import type { Notifications } from "../ui/notifications";
import { ScenesPanel } from "../ui/scenes_panel";
import type { SceneView } from "../rendering/scene_view";
import { GamepadPointers } from "../interaction/gamepad_pointers";
import { KeyboardPointer } from "../interaction/keyboard_pointer";
import { PointerEvents } from "../interaction/pointer_events";
import { Touches } from "../interaction/touches";
import type { PageMode } from "./page_mode";

const OUT_OF_VIEW_INTERVAL_MS = 700;

/** Page mode of a running scene. */
export class LiveMode implements PageMode {
  private readonly touches: Touches;
  private readonly pointers: PointerEvents;
  private readonly keyboard: KeyboardPointer;
  private readonly gamepads: GamepadPointers;
  private readonly toolbar: LiveToolbar;
  private readonly sound: SoundControl;
  private readonly hint = new Hint();
  private readonly forceReadout = new ForceReadout();
  private readonly jobs = new JobList(() => this.cancelJob());
  private readonly meshUpload: MeshUpload;
  private readonly scenes: ScenesPanel;
  private readonly physics: PhysicsPanel;
  private readonly material: MaterialPanel;
  private readonly plots = new PlotPanels();
  private readonly timing = new TimingPanel();
  private readonly accuracy = new AccuracyPanel();
  private readonly viewers = element("span", { class: "chip" });
  private readonly outOfView = element("button", { class: "button out-of-view", type: "button", text: "Object out of view: show it" });
  private outOfViewCheckedAt = 0;
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
    private readonly connection: Connection,
  ) {
    const send = connection.send.bind(connection);
    const first: TouchMode = window.matchMedia("(pointer: coarse)").matches ? "hold" : "touch";
    this.touches = new Touches(sceneView, send);
    this.pointers = new PointerEvents(sceneView, this.touches);
    this.pointers.mode = first;
    const mode = () => this.pointers.mode;
    this.keyboard = new KeyboardPointer(sceneView, this.touches, mode);
    this.gamepads = new GamepadPointers(sceneView, this.touches, mode, (device) => {
      const force = this.frame?.devices[device]?.force ?? [0, 0, 0];
      return Math.hypot(...force) / (sceneView.graphs[0]?.forceRange.value ?? 1);
    });
    this.touches.onBegin = () => this.hint.dismiss();
    this.touches.onRefused = () => this.notifications.notify("All device slots of this scene are in use. Try again when another pointer is released.");
    this.toolbar = new LiveToolbar(
      send,
      first,
      (chosen) => {
        this.pointers.mode = chosen;
      },
      () => sceneView.resetView(),
    );
    this.sound = new SoundControl(send, notifications);
    this.scenes = new ScenesPanel((id) => send({ type: "open_scene", scene: id }));
    this.physics = new PhysicsPanel(send);
    this.material = new MaterialPanel(send);
    const meshUpload = new MeshUpload(notifications, this.jobs);
    this.meshUpload = meshUpload;

    this.viewers.hidden = true;
    this.outOfView.hidden = true;
    this.outOfView.addEventListener("click", () => sceneView.resetView());
    this.loading.hidden = true;
    layout.chips.append(this.viewers);
    layout.toolbar.append(...this.toolbar.parts, ...this.sound.parts);
    layout.overlayTop.append(this.forceReadout.box, this.hint.box, this.jobs.box);
    layout.overlayBottom.append(this.outOfView);
    layout.viewArea.append(this.loading);
    layout.controls.append(this.scenes.section, display.section, this.physics.section, this.material.section, meshUpload.section);
    layout.measurements.append(...this.plots.sections, this.timing.section, this.accuracy.section);
    layout.page.append(meshUpload.dialog);
    sceneView.drawOverlay = (context, view) => {
      this.keyboard.draw(context, view);
      this.gamepads.draw(context, view, performance.now());
    };
  }

  hello(hello: Hello): void {
    this.touches.clear();
    this.scenes.setScenes(hello.scenes);
    this.meshUpload.viewer = hello.viewer;
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
    if (document.hidden) this.touches.endAll();
    this.stream();
  }

  scene(scene: SceneMessage): void {
    this.loadAbort?.abort();
    this.touches.clear();
    this.pointers.clear();
    const loadAbort = new AbortController();
    this.loadAbort = loadAbort;
    this.requestedScene = scene;
    this.layout.title.textContent = scene.title;
    this.layout.about.textContent = scene.about;
    this.layout.about.title = scene.about;
    document.title = `${scene.title} · palpate`;
    this.scenes.setCurrent(scene.id);
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
        this.sceneView.fitCamera();
        this.plots.reset(scene);
        this.frame = null;
        this.showLoading(null);
        this.hint.show(scene.objects[0]?.name ?? "object", Math.round(1 / scene.step_s), scene.devices.some((device) => device.pointer));
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
    this.frame = frame;
    this.frameIsNew = true;
  }

  status(status: Status): void {
    this.toolbar.update(status);
    this.timing.update(status);
    this.viewers.hidden = !(status.viewers > 1);
    this.viewers.textContent = `${status.viewers} viewers`;
    this.viewers.title = "Everybody who has this page open sees and touches the same scene";
  }

  assigned(message: DeviceAssigned): void {
    this.touches.assign(message.pointer, message.device);
  }

  progress(progress: Progress): void {
    this.jobs.update(progress);
  }

  connectionLost(): void {
    this.touches.clear();
    this.pointers.clear();
    this.jobs.clear();
    this.timing.clear();
    this.forceReadout.show(null, null, []);
  }

  animate(now: number): void {
    this.keyboard.animate(now);
    this.gamepads.animate(now);
    this.touches.animate(now);
    const graph = this.sceneView.graphs[0];
    if (this.frameIsNew && this.frame !== null && graph !== undefined) {
      this.frameIsNew = false;
      try {
        graph.setFrame(this.frame, now / 1000);
        this.sceneView.requestRender();
      } catch (error) {
        if (!(error instanceof FrameMismatch)) throw error;
        this.notifications.notifyOnce("frame mismatch", `The server sent a frame that does not fit the scene; it was dropped: ${error.message}`);
      }
    }
    this.forceReadout.show(this.frame, graph?.info ?? null, this.touches.devices);
    this.plots.animate(now);
    if (now - this.outOfViewCheckedAt > OUT_OF_VIEW_INTERVAL_MS) {
      this.outOfViewCheckedAt = now;
      this.outOfView.hidden = !this.sceneView.isOutOfView;
    }
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
