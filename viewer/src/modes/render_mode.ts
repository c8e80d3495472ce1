// Render mode for `palpate render`: draws the requested frames of log 0 and posts them as PNG images. No clock and no
// animation: the same frames give the same bytes.

import type { PageMode } from "./page_mode";
import { fetchFrames } from "../playback/log_requests";
import { largestOfLog, LogProgress } from "../playback/log_scales";
import { isColourMode } from "../rendering/colours";
import { downOf } from "../rendering/gravity_direction";
import { hasFloor, loadScene } from "../rendering/scene_loader";
import type { SceneView } from "../rendering/scene_view";
import type { SceneGraph } from "../rendering/scene_graph";
import { serverUrl } from "../protocol/urls";
import type { Hello, Progress, RenderRequest, SceneMessage } from "../protocol/messages";
import { decodeFrame, type Frame } from "../protocol/frame";

const RETRY_INTERVAL_MS = 250;
const FRAME_TIMEOUT_MS = 300_000;
const BATCH_SIZE = 30;

/** Page mode of `palpate render`, without controls. */
export class RenderMode implements PageMode {
  private request: RenderRequest | null = null;
  private started = false;
  private readonly logProgress = new LogProgress();

  constructor(private readonly sceneView: SceneView) {}

  hello(hello: Hello): void {
    this.request = hello.render ?? null;
    if (this.request === null) this.finish("failed", "the server did not say what to draw");
  }

  scene(scene: SceneMessage): void {
    if (this.started || this.request === null || (scene.log ?? 0) !== 0) return;
    this.started = true;
    this.draw(this.request, scene)
      .then(() => this.finish("done", `${this.request?.frames.length ?? 0} images are drawn.`))
      .catch((error: unknown) => this.finish("failed", error instanceof Error ? error.message : String(error)));
  }

  private finish(state: "done" | "failed", text: string): void {
    document.documentElement.dataset.render = state;
    document.title = state === "done" ? "palpate: images done" : `palpate: ${text}`;
    if (state === "failed") console.error(text);
    const line = document.createElement("p");
    line.className = "render-status";
    line.textContent = text;
    document.body.append(line);
  }

  private async draw(request: RenderRequest, scene: SceneMessage): Promise<void> {
    const { sceneView } = this;
    const { width, height, camera } = request;
    sceneView.settings = { colour: isColourMode(request.colour) ? request.colour : "displacement", arrows: true, contactPoints: false, wireframe: false, dark: request.dark };
    sceneView.showsTime = true;
    sceneView.showsLogs = true;
    document.body.append(sceneView.canvas, sceneView.overlay);
    const loaded = await loadScene(scene, sceneView.reconstructsOnGpu, new AbortController().signal, () => undefined);
    sceneView.orbit.setHome(scene.view.center, scene.view.radius, downOf(scene), hasFloor(scene));
    const graph = sceneView.setScene(0, loaded);
    sceneView.resize(width, height, 1);
    sceneView.orbit.reset();
    if (camera !== null && camera !== undefined) sceneView.orbit.lookFrom(camera.from, camera.to);

    // First pass: scales of the whole log. Second pass: draw.
    sceneView.fixScales(await largestOfLog(0, graph, sceneView, this.logProgress));
    let number = 0;
    for await (const frame of decodedFrames(request.frames)) await this.post(graph, frame, number++);
  }

  private async post(graph: SceneGraph, frame: Frame, number: number): Promise<void> {
    graph.setFrame(frame, 0);
    this.sceneView.requestRender();
    this.sceneView.draw(0);
    const body = await this.sceneView.png();
    const response = await fetch(serverUrl(`image/${number}`), { method: "POST", body, headers: { "content-type": "image/png" } });
    if (!response.ok) throw new Error(`image ${number}: ${response.status} ${response.statusText}`);
  }

  frameReceived(): void {}

  status(): void {}

  assigned(): void {}

  progress(progress: Progress): void {
    this.logProgress.update(progress);
  }

  connectionLost(): void {}

  visibilityChanged(): void {}

  contextRestored(): void {
    this.finish("failed", "the graphics card was reset");
  }

  animate(): void {}

  applyTheme(): void {}

  handleKey(): boolean {
    return false;
  }
}

/** Requested frames of log 0 in order; waits for frames that are not computed yet. */
async function* decodedFrames(frames: readonly number[]): AsyncGenerator<Frame> {
  for (let at = 0; at < frames.length; ) {
    let count = 1;
    while (count < BATCH_SIZE && frames[at + count] === frames[at] + count) count++;
    const began = performance.now();
    let got = await fetchFrames(0, frames[at], count);
    while (got.length === 0) {
      if (performance.now() - began > FRAME_TIMEOUT_MS) throw new Error(`frame ${frames[at]} did not come`);
      await new Promise((wake) => setTimeout(wake, RETRY_INTERVAL_MS));
      got = await fetchFrames(0, frames[at], count);
    }
    for (const bytes of got) yield decodeFrame(bytes);
    at += got.length;
  }
}
