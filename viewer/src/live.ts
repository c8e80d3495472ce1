// A live scene: pictures come, fingers go, panels follow.

import type { Connection } from "./protocol/connection";
import type { Granted, Hello, Progress, SceneMessage, Status, TouchMode } from "./protocol/messages";
import type { Picture } from "./protocol/picture";
import { hasFloor, loadScene } from "./picture/load";
import { PictureDoesNotFit } from "./picture/elastic/object";
import { MeshDrop } from "./panels/drop";
import { element } from "./panels/element";
import { ForceReading } from "./panels/reading";
import type { Frame } from "./panels/frame";
import { Hint } from "./panels/hint";
import { Jobs } from "./panels/jobs";
import { LawsPanel } from "./panels/laws";
import { LiveBar } from "./panels/live_bar";
import { MaterialPanel } from "./panels/material";
import { AccuracyPanel, PlotPanels, TimingPanel } from "./panels/measured";
import type { LookPanel } from "./panels/look";
import type { Notes } from "./panels/notes";
import { ScenesPanel } from "./panels/scenes";
import type { Stage } from "./picture/stage";
import { GamepadFingers } from "./touch/gamepad";
import { KeyboardFinger } from "./touch/keyboard_finger";
import { Pointers } from "./touch/pointers";
import { Touches } from "./touch/touches";
import type { Kind } from "./kind";

const STRAYED_EVERY_MS = 700;

export class Live implements Kind {
  private readonly touches: Touches;
  private readonly pointers: Pointers;
  private readonly keyboard: KeyboardFinger;
  private readonly gamepads: GamepadFingers;
  private readonly bar: LiveBar;
  private readonly hint = new Hint();
  private readonly reading = new ForceReading();
  private readonly jobs = new Jobs();
  private readonly scenes: ScenesPanel;
  private readonly laws: LawsPanel;
  private readonly material: MaterialPanel;
  private readonly plots = new PlotPanels();
  private readonly timing = new TimingPanel();
  private readonly accuracy = new AccuracyPanel();
  private readonly viewers = element("span", { class: "chip" });
  private readonly strayed = element("button", { class: "button strayed", type: "button", text: "It has left the view: show it" });
  private strayedCheck = 0;
  private readonly loading = element("div", { class: "loading", role: "status" });
  private loader: AbortController | null = null;
  private wanted: SceneMessage | null = null;
  private picture: Picture | null = null;
  private fresh = false;
  /** Something that could be heard: the forces, once per picture. Nothing listens yet. */
  onForces: ((picture: Picture) => void) | null = null;

  constructor(
    private readonly stage: Stage,
    private readonly frame_: Frame,
    private readonly notes: Notes,
    look: LookPanel,
    private readonly connection: Connection,
  ) {
    const send = connection.send.bind(connection);
    const first: TouchMode = window.matchMedia("(pointer: coarse)").matches ? "hold" : "touch";
    this.touches = new Touches(stage, send);
    this.pointers = new Pointers(stage, this.touches);
    this.pointers.mode = first;
    const mode = () => this.pointers.mode;
    this.keyboard = new KeyboardFinger(stage, this.touches, mode);
    this.gamepads = new GamepadFingers(stage, this.touches, mode, (device) => {
      const force = this.picture?.devices[device]?.force ?? [0, 0, 0];
      return Math.hypot(...force) / (stage.worlds[0]?.forceRange.value ?? 1);
    });
    this.touches.onBegin = () => this.hint.away();
    this.touches.onRefused = () => this.notes.say("All fingers of this scene are in use; yours gets one when another lets go.");
    this.bar = new LiveBar(
      send,
      first,
      (chosen) => {
        this.pointers.mode = chosen;
      },
      () => stage.home(),
    );
    this.scenes = new ScenesPanel((id) => send({ type: "open", scene: id }));
    this.laws = new LawsPanel(send);
    this.material = new MaterialPanel(send);
    const drop = new MeshDrop(notes);

    this.viewers.hidden = true;
    this.strayed.hidden = true;
    this.strayed.addEventListener("click", () => stage.home());
    this.loading.hidden = true;
    frame_.chips.append(this.viewers);
    frame_.bar.append(...this.bar.parts);
    frame_.upper.append(this.reading.box, this.hint.box, this.jobs.box);
    frame_.lower.append(this.strayed);
    frame_.stageArea.append(this.loading);
    frame_.controls.append(this.scenes.section, look.section, this.laws.section, this.material.section, drop.section);
    frame_.measured.append(...this.plots.sections, this.timing.section, this.accuracy.section);
    frame_.page.append(drop.dialog);
    stage.drawOver = (pen, view) => {
      this.keyboard.draw(pen, view);
      this.gamepads.draw(pen, view, performance.now());
    };
  }

  hello(hello: Hello): void {
    this.touches.forget();
    this.scenes.offer(hello.scenes);
    if (!this.stage.sumsModes) this.connection.send({ type: "stream", form: "vertices", every: 1 });
    this.stream();
  }

  /** No pictures while nobody looks. */
  private stream(): void {
    this.connection.send({ type: "stream", form: this.stage.sumsModes ? "modal" : "vertices", every: document.hidden ? 0 : 1 });
  }

  visibility(): void {
    if (document.hidden) this.touches.endAll();
    this.stream();
  }

  scene(scene: SceneMessage): void {
    this.loader?.abort();
    this.touches.forget();
    this.pointers.forget();
    const loader = new AbortController();
    this.loader = loader;
    this.wanted = scene;
    this.frame_.title.textContent = scene.title;
    this.frame_.about.textContent = scene.about;
    this.frame_.about.title = scene.about;
    document.title = `${scene.title} · palpate`;
    this.scenes.current(scene.id);
    this.laws.take(scene);
    this.material.take(scene);
    this.accuracy.take([scene]);
    this.say("Loading the scene …");
    const heard = (share: number, bytes: number) => {
      if (bytes > 2e6) this.say(`Loading the scene: ${Math.round(100 * share)} % of ${Math.round(bytes / 1e6)} MB`);
    };
    loadScene(scene, this.stage.sumsModes, loader.signal, heard)
      .then((loaded) => {
        if (loader.signal.aborted) return;
        const before = this.stage.worlds[0]?.info ?? null;
        const again = before !== null && before.id === scene.id && before.objects.length === scene.objects.length;
        if (!again) {
          this.stage.orbit.look(scene.view.center, scene.view.radius, scene.gravity, hasFloor(scene));
        }
        this.stage.put(0, loaded);
        this.stage.fitCamera();
        this.plots.begin(scene);
        this.picture = null;
        this.say(null);
        this.hint.show(scene.objects[0]?.name ?? "object", scene.devices.some((device) => device.pointer));
      })
      .catch((error: unknown) => {
        if (loader.signal.aborted) return;
        this.say(null);
        this.notes.say(`The scene could not be loaded: ${error instanceof Error ? error.message : String(error)}`, "error");
      });
  }

  private say(text: string | null): void {
    this.loading.hidden = text === null;
    this.loading.textContent = text;
  }

  /** Loads all again, after the graphics card has forgotten it. */
  reload(): void {
    const scene = this.wanted;
    this.stage.clear();
    if (scene !== null) this.scene(scene);
  }

  pictureCame(picture: Picture): void {
    const world = this.stage.worlds[0];
    // A server that began anew counts its generations from the beginning: the number alone does not tell.
    if (world === undefined || world.info !== this.wanted || picture.generation !== world.info.generation) return;
    this.plots.take(picture);
    this.picture = picture;
    this.fresh = true;
  }

  status(status: Status): void {
    this.bar.take(status);
    this.timing.take(status);
    this.viewers.hidden = !(status.viewers > 1);
    this.viewers.textContent = `${status.viewers} viewers`;
    this.viewers.title = "Everybody who has this page open sees and touches the same scene";
  }

  granted(granted: Granted): void {
    this.touches.granted(granted.pointer, granted.device);
  }

  progress(progress: Progress): void {
    this.jobs.take(progress);
  }

  lost(): void {
    this.touches.forget();
    this.pointers.forget();
    this.jobs.forget();
    this.timing.clear();
    this.reading.show(null, null, []);
  }

  frame(now: number): void {
    this.keyboard.frame(now);
    this.gamepads.frame(now);
    this.touches.frame(now);
    const world = this.stage.worlds[0];
    if (this.fresh && this.picture !== null && world !== undefined) {
      this.fresh = false;
      try {
        world.show(this.picture, now / 1000);
        this.stage.redraw();
        this.onForces?.(this.picture);
      } catch (error) {
        if (!(error instanceof PictureDoesNotFit)) throw error;
        this.notes.sayOnce("misfit", `The server sent a picture that does not fit the scene; it was dropped: ${error.message}`);
      }
    }
    this.reading.show(this.picture, world?.info ?? null, this.touches.devices);
    this.plots.frame(now);
    if (now - this.strayedCheck > STRAYED_EVERY_MS) {
      this.strayedCheck = now;
      this.strayed.hidden = !this.stage.empty;
    }
  }

  dress(): void {
    this.plots.dress();
  }

  key(event: KeyboardEvent): boolean {
    switch (event.key) {
      case " ":
        this.bar.togglePause();
        return true;
      case ".":
        this.bar.oneStep();
        return true;
      case "g":
        this.bar.otherMode();
        return true;
      case "r":
        this.bar.reset();
        return true;
      case "[":
        this.bar.faster(-1);
        return true;
      case "]":
        this.bar.faster(1);
        return true;
      default:
        return false;
    }
  }
}
