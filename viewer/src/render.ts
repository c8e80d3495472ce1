// Pictures for `palpate render`: frames of log 0, drawn one after the other, posted as PNGs. No clock, no animation:
// the same frames give the same bytes.

import type { Kind } from "./kind";
import { fetchFrames } from "./log/fetch";
import { isColourMode } from "./picture/colours";
import { hasFloor, loadScene } from "./picture/load";
import { niceAbove } from "./picture/scale";
import type { Stage } from "./picture/stage";
import type { World } from "./picture/world";
import { address } from "./protocol/address";
import type { Hello, RenderOrder, SceneMessage } from "./protocol/messages";
import { readPicture, type Picture } from "./protocol/picture";

const WAIT_MS = 250;
const PATIENCE_MS = 300_000;
const AT_ONCE = 30;

export class Render implements Kind {
  private order: RenderOrder | null = null;
  private begun = false;

  constructor(private readonly stage: Stage) {}

  hello(hello: Hello): void {
    this.order = hello.render ?? null;
    if (this.order === null) this.say("failed", "the server did not say what to draw");
  }

  scene(scene: SceneMessage): void {
    if (this.begun || this.order === null || (scene.log ?? 0) !== 0) return;
    this.begun = true;
    this.draw(this.order, scene)
      .then(() => this.say("done", `${this.order?.frames.length ?? 0} pictures are drawn.`))
      .catch((error: unknown) => this.say("failed", error instanceof Error ? error.message : String(error)));
  }

  private say(state: "done" | "failed", text: string): void {
    document.documentElement.dataset.render = state;
    document.title = state === "done" ? "palpate: pictures done" : `palpate: ${text}`;
    if (state === "failed") console.error(text);
    const line = document.createElement("p");
    line.className = "rendered";
    line.textContent = text;
    document.body.append(line);
  }

  private async draw(order: RenderOrder, scene: SceneMessage): Promise<void> {
    const { stage } = this;
    const { width, height, camera } = order;
    stage.look = { colour: isColourMode(order.colour) ? order.colour : "displacement", arrows: true, wires: stage.look.wires, dark: order.dark };
    stage.writesTime = true;
    document.body.append(stage.canvas, stage.overlay);
    const loaded = await loadScene(scene, stage.sumsModes, new AbortController().signal, () => undefined);
    stage.orbit.look(scene.view.center, scene.view.radius, scene.gravity, hasFloor(scene));
    const world = stage.put(0, loaded);
    stage.resize(width, height, 1);
    stage.orbit.home();
    if (camera !== null && camera !== undefined) stage.orbit.stand(camera.from, camera.to);

    // Once to see how far colours and arrows have to reach in all pictures, once to draw.
    let largest = 0;
    for await (const picture of pictures(order.frames)) {
      world.show(picture, 0);
      largest = Math.max(largest, stage.largest());
    }
    stage.fixRange(niceAbove(largest));
    let number = 0;
    for await (const picture of pictures(order.frames)) await this.post(world, picture, number++);
  }

  private async post(world: World, picture: Picture, number: number): Promise<void> {
    world.show(picture, 0);
    this.stage.redraw();
    this.stage.draw(0);
    const body = await this.stage.png();
    const response = await fetch(address(`picture/${number}`), { method: "POST", body, headers: { "content-type": "image/png" } });
    if (!response.ok) throw new Error(`picture ${number}: ${response.status} ${response.statusText}`);
  }

  pictureCame(): void {}

  status(): void {}

  granted(): void {}

  progress(): void {}

  lost(): void {}

  visibility(): void {}

  reload(): void {
    this.say("failed", "the graphics card was reset");
  }

  frame(): void {}

  dress(): void {}

  key(): boolean {
    return false;
  }
}

/** These frames of log 0 in turn; waits for those that are not computed yet. */
async function* pictures(frames: readonly number[]): AsyncGenerator<Picture> {
  for (let at = 0; at < frames.length; ) {
    let count = 1;
    while (count < AT_ONCE && frames[at + count] === frames[at] + count) count++;
    const began = performance.now();
    let got = await fetchFrames(0, frames[at], count);
    while (got.length === 0) {
      if (performance.now() - began > PATIENCE_MS) throw new Error(`frame ${frames[at]} did not come`);
      await new Promise((wake) => setTimeout(wake, WAIT_MS));
      got = await fetchFrames(0, frames[at], count);
    }
    for (const bytes of got) yield readPicture(bytes);
    at += got.length;
  }
}
