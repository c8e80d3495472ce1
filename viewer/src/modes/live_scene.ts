// Scene of the live page: the one that was announced, the loading of its data, and its newest frame.

import type { Frame } from "../protocol/frame";
import type { SceneMessage } from "../protocol/messages";
import { FrameMismatch } from "../rendering/elastic/elastic_mesh";
import { downOf } from "../rendering/gravity_direction";
import { hasFloor, loadScene } from "../rendering/scene_loader";
import type { SceneView } from "../rendering/scene_view";
import { element } from "../ui/elements";
import type { Notifications } from "../ui/notifications";

export class LiveScene {
  /** Text over the view while a scene loads. */
  readonly box = element("div", { class: "loading", role: "status" });
  /** Scene that was announced last. */
  requested: SceneMessage | null = null;
  /** Newest frame of the scene that is shown. */
  frame: Frame | null = null;
  private frameIsNew = false;
  private loadAbort: AbortController | null = null;

  constructor(
    private readonly sceneView: SceneView,
    private readonly notifications: Notifications,
  ) {
    this.box.hidden = true;
  }

  /** Whether the server lists the scene: in scenes of the user's own nothing moves by itself. */
  get isBuiltIn(): boolean {
    return typeof this.requested?.id === "string";
  }

  /** Forgets the frame that waits to be shown. */
  suspend(): void {
    this.frameIsNew = false;
  }

  /** Loads the data of a scene, and shows it; a later scene takes its place. `onShown` is called with the scene in the view, at its home if it is another one. */
  load(scene: SceneMessage, onShown: () => void): void {
    this.loadAbort?.abort();
    const loadAbort = new AbortController();
    this.loadAbort = loadAbort;
    this.requested = scene;
    this.show("Loading the scene …");
    const onProgress = (fraction: number, bytes: number) => {
      if (bytes > 2e6) this.show(`Loading the scene: ${Math.round(100 * fraction)} % of ${Math.round(bytes / 1e6)} MB`);
    };
    loadScene(scene, this.sceneView.reconstructsOnGpu, loadAbort.signal, onProgress)
      .then((loaded) => {
        if (loadAbort.signal.aborted) return;
        const previous = this.sceneView.graphs[0]?.info ?? null;
        const sameScene = previous !== null && previous.id === scene.id && previous.objects.length === scene.objects.length;
        if (!sameScene) this.sceneView.orbit.setHome(scene.view.center, scene.view.radius, downOf(scene), hasFloor(scene));
        this.sceneView.setScene(0, loaded);
        onShown();
        this.frame = null;
        this.show(null);
      })
      .catch((error: unknown) => {
        if (loadAbort.signal.aborted) return;
        this.show(null);
        this.notifications.notify(`The scene could not be loaded: ${error instanceof Error ? error.message : String(error)}`, "error");
      });
  }

  /** Takes a frame, if it belongs to the scene that is shown. */
  receive(frame: Frame): boolean {
    const graph = this.sceneView.graphs[0];
    // A restarted server counts generations from the start again, so the generation alone is not enough.
    if (graph === undefined || graph.info !== this.requested || frame.generation !== graph.info.generation) return false;
    this.frame = frame;
    this.frameIsNew = true;
    return true;
  }

  /** Shows the newest frame; returns whether there was one to show. */
  showFrame(now: number): boolean {
    const graph = this.sceneView.graphs[0];
    if (!this.frameIsNew || this.frame === null || graph === undefined) return false;
    this.frameIsNew = false;
    try {
      graph.setFrame(this.frame, now / 1000);
      this.sceneView.requestRender();
      return true;
    } catch (error) {
      if (!(error instanceof FrameMismatch)) throw error;
      this.notifications.notifyOnce("frame mismatch", `The server sent a frame that does not fit the scene; it was dropped: ${error.message}`);
      return false;
    }
  }

  private show(text: string | null): void {
    this.box.hidden = text === null;
    this.box.textContent = text;
  }
}
