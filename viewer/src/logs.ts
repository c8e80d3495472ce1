// Logs: one fills the stage, two stand side by side and share the time line.

import type { Hello, Progress, SceneMessage } from "./protocol/messages";
import { readPicture } from "./protocol/picture";
import type { Kind } from "./kind";
import { FrameCache } from "./log/cache";
import { fetchFrames, fetchSeries } from "./log/fetch";
import { Player } from "./log/player";
import { TimeLine } from "./log/time_line";
import { element } from "./panels/element";
import type { Frame } from "./panels/frame";
import { Jobs } from "./panels/jobs";
import type { LookPanel } from "./panels/look";
import { AccuracyPanel, PlotPanels } from "./panels/measured";
import type { Notes } from "./panels/notes";
import { hasFloor, loadScene } from "./picture/load";
import type { Stage } from "./picture/stage";
import { Pointers } from "./touch/pointers";

const SERIES_RETRY_MS = 1500;

interface Log {
  scene: SceneMessage;
  cache: FrameCache;
  plots: PlotPanels;
  caption: HTMLElement;
  shown: number;
  seriesKnown: boolean;
}

export class Logs implements Kind {
  private readonly logs: Log[] = [];
  private readonly player = new Player(0, 1 / 60);
  private readonly timeLine: TimeLine;
  private readonly jobs = new Jobs();
  private readonly accuracy = new AccuracyPanel();
  private readonly captions = element("div", { class: "captions" });
  private names: string[] = [];
  private last = 0;
  private started = false;
  private loading: Promise<void> = Promise.resolve();

  constructor(
    private readonly stage: Stage,
    private readonly page: Frame,
    private readonly notes: Notes,
    look: LookPanel,
  ) {
    new Pointers(stage, null);
    this.timeLine = new TimeLine(this.player, () => stage.home());
    page.bar.append(...this.timeLine.parts);
    page.upper.append(this.jobs.box);
    page.stageArea.append(this.captions);
    page.controls.append(look.section);
    page.measured.append(this.accuracy.section);
    stage.canvas.setAttribute("aria-label", "The scene of the log. Drag turns the view.");
  }

  hello(hello: Hello): void {
    this.names = hello.logs.map((log) => log.name);
    this.page.title.textContent = this.names.join("  |  ");
    this.page.about.textContent = this.names.length > 1 ? "Two logs, one time line" : "A log, played again";
    document.title = `${this.names.join(", ")} · palpate`;
    this.stage.clear();
    for (const log of this.logs.splice(0)) {
      log.caption.remove();
      for (const part of log.plots.sections) part.remove();
    }
  }

  scene(scene: SceneMessage): void {
    // In turns, so that worlds stand in the order of the logs.
    this.loading = this.loading.then(() => this.load(scene)).catch((error: unknown) => {
      this.notes.say(`A log could not be loaded: ${error instanceof Error ? error.message : String(error)}`, "error");
    });
  }

  private async load(scene: SceneMessage): Promise<void> {
    const index = scene.log ?? 0;
    const loaded = await loadScene(scene, this.stage.sumsModes, new AbortController().signal, () => undefined);
    const name = this.names[index] ?? scene.title;
    const old = this.logs[index];
    const cache = old?.cache ?? new FrameCache((from, count) => fetchFrames(index, from, count), scene.frames ?? 0);
    cache.frames = scene.frames ?? 0;
    const log: Log = {
      scene,
      cache,
      plots: old?.plots ?? new PlotPanels(this.names.length > 1 ? name : ""),
      caption: old?.caption ?? element("span", { text: name }),
      shown: -1,
      seriesKnown: false,
    };
    cache.onFailure = (error) => this.notes.sayOnce(`frames ${index}`, `Frames did not come: ${error instanceof Error ? error.message : String(error)}`);
    if (old === undefined) {
      log.plots.force.onSeek = log.plots.energy.onSeek = (time) => this.player.seek(time - this.firstTime());
      this.page.measured.insertBefore(element("div", {}, ...log.plots.sections), this.accuracy.section);
      if (this.names.length > 1) this.captions.append(log.caption);
    }
    this.logs[index] = log;
    if (index === 0) this.stage.orbit.look(scene.view.center, scene.view.radius, scene.gravity, hasFloor(scene));
    this.stage.put(index, loaded);
    this.stage.fitCamera();
    if (index === 0) this.stage.orbit.home();
    const durations = this.logs.map(({ scene: { frames, frame_s } }) => Math.max(0, (frames ?? 1) - 1) * (frame_s ?? 1 / 60));
    this.player.duration = Math.max(...durations);
    this.player.frameSeconds = this.logs[0]?.scene.frame_s ?? 1 / 60;
    this.accuracy.take(this.logs.filter((known) => known !== undefined).map((known) => known.scene));
    if (!this.started) {
      this.started = true;
      this.player.playing = true;
    }
    void this.takeSeries(index, log);
  }

  private async takeSeries(index: number, log: Log): Promise<void> {
    if (log.seriesKnown || this.logs[index] !== log) return;
    try {
      const series = await fetchSeries(index);
      log.plots.showSeries(series);
      log.seriesKnown = true;
    } catch {
      // Not computed yet: progress or time bring another try.
      window.setTimeout(() => void this.takeSeries(index, log), SERIES_RETRY_MS);
    }
  }

  /** Logs need not begin at 0; the time line does. */
  private firstTime(): number {
    return this.logs[0]?.scene === undefined ? 0 : this.offset;
  }

  private offset = 0;

  pictureCame(): void {}

  status(): void {}

  granted(): void {}

  progress(progress: Progress): void {
    this.jobs.take(progress);
    if (progress.done !== true) return;
    this.logs.forEach((log, index) => {
      log.seriesKnown = false;
      void this.takeSeries(index, log);
    });
  }

  lost(): void {
    this.player.playing = false;
  }

  visibility(): void {
    if (document.hidden) this.player.playing = false;
  }

  reload(): void {
    const scenes = this.logs.map((log) => log.scene);
    this.stage.clear();
    for (const scene of scenes) this.scene(scene);
  }

  frame(now: number): void {
    const seconds = Math.min(0.25, (now - this.last) / 1000);
    this.last = now;
    // Time waits for frames that are under way.
    const all = this.logs.map((log, i) => this.showLog(log, i, now));
    if (all.every(Boolean)) this.player.advance(seconds);
    this.timeLine.show();
  }

  private showLog(log: Log | undefined, index: number, now: number): boolean {
    const world = this.stage.worlds[index];
    if (log === undefined || world === undefined) return true;
    const frameSeconds = log.scene.frame_s ?? 1 / 60;
    const frame = this.player.frameOf(log.scene.frames ?? 1, frameSeconds);
    const bytes = log.cache.get(frame);
    if (this.player.playing) log.cache.prefetch(frame, 1);
    if (bytes === null) return false;
    if (log.shown === frame) return true;
    log.shown = frame;
    try {
      const picture = readPicture(bytes);
      if (frame === 0) this.offset = picture.time;
      world.show(picture, now / 1000);
      log.plots.force.mark(picture.time);
      log.plots.energy.mark(picture.time);
      this.stage.redraw();
    } catch (error) {
      this.notes.sayOnce(`frame of ${index}`, `A frame of the log cannot be drawn: ${error instanceof Error ? error.message : String(error)}`);
    }
    return true;
  }

  dress(): void {
    for (const log of this.logs) log?.plots.dress();
  }

  key(event: KeyboardEvent): boolean {
    const hop = event.shiftKey ? 10 : 1;
    switch (event.key) {
      case " ":
        this.player.toggle();
        return true;
      case "ArrowLeft":
        this.player.hop(-hop);
        return true;
      case "ArrowRight":
        this.player.hop(hop);
        return true;
      case "Home":
        this.player.seek(0);
        return true;
      case "End":
        this.player.seek(this.player.duration);
        return true;
      case "[":
        this.player.faster(-1);
        return true;
      case "]":
        this.player.faster(1);
        return true;
      default:
        return false;
    }
  }
}
