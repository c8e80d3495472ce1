// Log mode: plays one log, or two side by side with a shared timeline.

import type { Hello, Progress, SceneMessage } from "../protocol/messages";
import { decodeFrame } from "../protocol/frame";
import type { PageMode } from "./page_mode";
import { FrameCache } from "../playback/frame_cache";
import { fetchFrames, fetchSeries } from "../playback/log_requests";
import { larger, largestOfLog, LogProgress, type Largest } from "../playback/log_scales";
import { Player } from "../playback/player";
import { Timeline } from "../playback/timeline";
import { element } from "../ui/elements";
import type { PageLayout } from "../ui/page_layout";
import { OpenFiles } from "../ui/open_files";
import { runsInWorker } from "../protocol/worker_connection";
import { JobList } from "../ui/job_list";
import { ScaleLock } from "../ui/scale_lock";
import type { DisplayPanel } from "../ui/display_panel";
import { AccuracyPanel } from "../ui/accuracy_panel";
import { ComparisonPanels } from "../ui/comparison_panels";
import { PlotPanels } from "../ui/plot_panels";
import type { Notifications } from "../ui/notifications";
import { downOf } from "../rendering/gravity_direction";
import { hasFloor, loadScene } from "../rendering/scene_loader";
import type { SceneView } from "../rendering/scene_view";
import { PointerEvents } from "../interaction/pointer_events";

const SERIES_RETRY_MS = 1500;

interface Log {
  scene: SceneMessage;
  cache: FrameCache;
  /** Plots of the only log. */
  plots: PlotPanels | null;
  caption: HTMLElement;
  shownFrame: number;
  seriesLoaded: boolean;
}

/** Page mode of recorded logs. */
export class LogMode implements PageMode {
  private readonly logs: Log[] = [];
  private readonly player = new Player(0, 1 / 60);
  private readonly timeline: Timeline;
  private readonly jobs = new JobList(null);
  private readonly accuracy = new AccuracyPanel();
  private readonly captions = element("div", { class: "captions" });
  private names: string[] = [];
  /** Plots of several logs. */
  private comparison: ComparisonPanels | null = null;
  private last = 0;
  private started = false;
  private loading: Promise<void> = Promise.resolve();
  /** Largest values of each log. */
  private readonly scaled: Promise<Largest | null>[] = [];
  /** Progress of the computation of each log, by the name of its job. */
  private readonly progresses = new Map<string, LogProgress>();

  constructor(
    private readonly sceneView: SceneView,
    private readonly layout: PageLayout,
    private readonly notifications: Notifications,
    display: DisplayPanel,
  ) {
    new PointerEvents(sceneView, null);
    this.timeline = new Timeline(this.player, () => sceneView.resetView());
    layout.toolbar.append(...this.timeline.parts);
    layout.overlayTop.append(this.jobs.box);
    layout.viewArea.append(this.captions, new ScaleLock(sceneView).button);
    sceneView.showsLogs = true;
    layout.controls.append(display.section);
    if (runsInWorker()) layout.controls.append(new OpenFiles(notifications, null).section);
    layout.measurements.append(this.accuracy.section);
    sceneView.canvas.setAttribute("aria-label", "The scene of the log. Drag to rotate the view.");
  }

  hello(hello: Hello): void {
    this.names = hello.logs.map((log) => log.name);
    this.layout.title.textContent = this.names.join("  |  ");
    this.layout.about.textContent = this.names.length > 1 ? "Two logs, one timeline" : "Log playback";
    document.title = `${this.names.join(", ")} · palpate`;
    this.sceneView.clear();
    this.scaled.length = 0;
    this.progresses.clear();
    for (const log of this.logs.splice(0)) {
      log.caption.remove();
      for (const part of log.plots?.sections ?? []) part.remove();
    }
    for (const part of this.comparison?.sections ?? []) part.remove();
    this.comparison = this.names.length > 1 ? new ComparisonPanels((time) => this.player.seek(time)) : null;
    if (this.comparison !== null) for (const part of this.comparison.sections) this.layout.measurements.insertBefore(part, this.accuracy.section);
  }

  scene(scene: SceneMessage): void {
    // Sequential, so that scene graphs keep the order of the logs.
    this.loading = this.loading.then(() => this.load(scene)).catch((error: unknown) => {
      this.notifications.notify(`A log could not be loaded: ${error instanceof Error ? error.message : String(error)}`, "error");
    });
  }

  private async load(scene: SceneMessage): Promise<void> {
    const index = scene.log ?? 0;
    const loaded = await loadScene(scene, this.sceneView.reconstructsOnGpu, new AbortController().signal, () => undefined);
    const name = this.names[index] ?? scene.title;
    const old = this.logs[index];
    const cache = old?.cache ?? new FrameCache((from, count) => fetchFrames(index, from, count), scene.frames ?? 0);
    cache.frames = scene.frames ?? 0;
    const log: Log = {
      scene,
      cache,
      plots: this.comparison === null ? (old?.plots ?? new PlotPanels()) : null,
      caption: old?.caption ?? element("span", { text: name }),
      shownFrame: -1,
      seriesLoaded: false,
    };
    cache.onFailure = (error) => this.notifications.notifyOnce(`frames ${index}`, `Frames did not come: ${error instanceof Error ? error.message : String(error)}`);
    if (old === undefined) {
      if (log.plots !== null) {
        log.plots.force.onSeek = log.plots.energy.onSeek = (time) => this.player.seek(time - this.firstFrameTime);
        for (const part of log.plots.sections) this.layout.measurements.insertBefore(part, this.accuracy.section);
      }
      if (this.names.length > 1) this.captions.append(log.caption);
    }
    this.logs[index] = log;
    if (index === 0) this.sceneView.orbit.setHome(scene.view.center, scene.view.radius, downOf(scene), hasFloor(scene));
    this.sceneView.setScene(index, loaded);
    this.sceneView.fitCamera();
    if (index === 0) this.sceneView.orbit.reset();
    const durations = this.logs.map(({ scene: { frames, frame_interval_s } }) => Math.max(0, (frames ?? 1) - 1) * (frame_interval_s ?? 1 / 60));
    this.player.duration = Math.max(...durations);
    this.player.frameSeconds = this.logs[0]?.scene.frame_interval_s ?? 1 / 60;
    this.accuracy.update(this.logs.filter((known) => known !== undefined).map((known) => known.scene));
    const all = this.logs.filter((known) => known !== undefined).length === this.names.length;
    // A short log would end the playback before a longer one is there.
    if (!this.started && all) {
      this.started = true;
      this.player.playing = true;
    }
    void this.loadSeries(index, log);
    const measured = this.measure(index, log);
    measured.catch(() => undefined); // Told where it is used.
    this.scaled[index] = measured;
    if (all) void this.fixScales([...this.scaled]);
  }

  /** Largest values of a log, once all of it is computed; null if another scene has taken its place. */
  private async measure(index: number, log: Log): Promise<Largest | null> {
    const graph = this.sceneView.graphs[index];
    const isShown = () => this.logs[index] === log && this.sceneView.graphs[index] === graph;
    const largest = await largestOfLog(index, graph, this.sceneView, this.progressOf(`log ${index}`));
    return isShown() ? largest : null;
  }

  private progressOf(job: string): LogProgress {
    const progress = this.progresses.get(job) ?? new LogProgress();
    this.progresses.set(job, progress);
    return progress;
  }

  /** Gives all logs the same scales, those of the largest values in any of them. */
  private async fixScales(scaled: Promise<Largest | null>[]): Promise<void> {
    try {
      const all = await Promise.all(scaled);
      if (all.every((largest) => largest !== null) && all.length > 0) this.sceneView.fixScales(all.reduce(larger));
    } catch (error) {
      // The scales go on growing with what is shown.
      this.notifications.notifyOnce("scales", `The scales of the logs are not known: ${error instanceof Error ? error.message : String(error)}`);
    }
  }

  private async loadSeries(index: number, log: Log): Promise<void> {
    if (log.seriesLoaded || this.logs[index] !== log) return;
    try {
      const series = await fetchSeries(index);
      log.plots?.showSeries(series);
      this.comparison?.setSeries(index, this.names[index] ?? log.scene.title, series);
      log.seriesLoaded = true;
    } catch {
      // Not computed yet: retried after a delay and on progress.
      window.setTimeout(() => void this.loadSeries(index, log), SERIES_RETRY_MS);
    }
  }

  /** Simulation time of the first frame [s]; the timeline begins at 0. */
  private firstFrameTime = 0;

  frameReceived(): void {}

  status(): void {}

  assigned(): void {}

  progress(progress: Progress): void {
    this.jobs.update(progress);
    this.progressOf(progress.job).update(progress);
    if (progress.done !== true) return;
    this.logs.forEach((log, index) => {
      log.seriesLoaded = false;
      void this.loadSeries(index, log);
    });
  }

  connectionLost(): void {
    this.player.playing = false;
  }

  visibilityChanged(): void {
    if (document.hidden) this.player.playing = false;
  }

  contextRestored(): void {
    const scenes = this.logs.map((log) => log.scene);
    this.sceneView.clear();
    for (const scene of scenes) this.scene(scene);
  }

  animate(now: number): void {
    const seconds = Math.min(0.25, (now - this.last) / 1000);
    this.last = now;
    // The clock waits for frames that are being fetched.
    const all = this.logs.map((log, i) => this.showLog(log, i, now));
    if (all.every(Boolean)) this.player.advance(seconds);
    this.timeline.show();
    if (this.player.time !== this.markedTime) {
      this.markedTime = this.player.time;
      this.comparison?.setMarker(this.player.time);
    }
  }

  private markedTime = -1;

  private showLog(log: Log | undefined, index: number, now: number): boolean {
    const graph = this.sceneView.graphs[index];
    if (log === undefined || graph === undefined) return true;
    const frameSeconds = log.scene.frame_interval_s ?? 1 / 60;
    const frameNumber = this.player.frameOf(log.scene.frames ?? 1, frameSeconds);
    const bytes = log.cache.get(frameNumber);
    if (this.player.playing) log.cache.prefetch(frameNumber, 1);
    if (bytes === null) return false;
    if (log.shownFrame === frameNumber) return true;
    log.shownFrame = frameNumber;
    try {
      const frame = decodeFrame(bytes);
      if (frameNumber === 0) this.firstFrameTime = frame.time;
      graph.setFrame(frame, now / 1000);
      log.plots?.force.setMarker(frame.time);
      log.plots?.energy.setMarker(frame.time);
      this.sceneView.requestRender();
    } catch (error) {
      this.notifications.notifyOnce(`frame of ${index}`, `A frame of the log cannot be drawn: ${error instanceof Error ? error.message : String(error)}`);
    }
    return true;
  }

  applyTheme(): void {
    for (const log of this.logs) log?.plots?.applyTheme();
    this.comparison?.applyTheme();
  }

  handleKey(event: KeyboardEvent): boolean {
    const count = event.shiftKey ? 10 : 1;
    switch (event.key) {
      case " ":
        this.player.toggle();
        return true;
      case "ArrowLeft":
        this.player.stepFrames(-count);
        return true;
      case "ArrowRight":
        this.player.stepFrames(count);
        return true;
      case "Home":
        this.player.seek(0);
        return true;
      case "End":
        this.player.seek(this.player.duration);
        return true;
      case "[":
        this.player.changeSpeed(-1);
        return true;
      case "]":
        this.player.changeSpeed(1);
        return true;
      default:
        return false;
    }
  }
}
