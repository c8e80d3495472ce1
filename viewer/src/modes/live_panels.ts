// Panels and chips of the live page that show a scene: its list, settings and material, plots, timing, accuracy, viewers and pace.

import type { Frame } from "../protocol/frame";
import type { ClientMessage, SceneMessage, Status } from "../protocol/messages";
import { AccuracyPanel } from "../ui/accuracy_panel";
import { element } from "../ui/elements";
import { MaterialPanel } from "../ui/material_panel";
import { Pace, paceText } from "../ui/pace";
import type { PageLayout } from "../ui/page_layout";
import { PhysicsPanel } from "../ui/physics_panel";
import { PlotPanels } from "../ui/plot_panels";
import { ScenesPanel } from "../ui/scenes_panel";
import { TimingPanel } from "../ui/timing_panel";

export class LivePanels {
  readonly scenes: ScenesPanel;
  readonly physics: PhysicsPanel;
  readonly material: MaterialPanel;
  private readonly plots = new PlotPanels();
  private readonly timing = new TimingPanel();
  private readonly accuracy = new AccuracyPanel();
  private readonly viewers = element("span", { class: "chip", title: "Everybody who has this page open sees and touches the same scene" });
  private readonly paceChip = element("span", { class: "chip slow", role: "status", title: "This machine computes the scene more slowly than it should run" });
  private readonly pace = new Pace();

  constructor(
    private readonly layout: PageLayout,
    send: (message: ClientMessage) => void,
    openScene: (id: string) => void,
  ) {
    this.scenes = new ScenesPanel(openScene);
    this.physics = new PhysicsPanel(send);
    this.material = new MaterialPanel(send);
    this.viewers.hidden = this.paceChip.hidden = true;
    layout.chips.append(this.paceChip, this.viewers);
    layout.measurements.append(...this.plots.sections, this.timing.section, this.accuracy.section);
  }

  /** Opens the certificates. */
  showAccuracy(): void {
    this.layout.sidebar = "measurements";
    this.accuracy.section.open = true;
    this.accuracy.section.scrollIntoView();
  }

  /** Shows a scene that was announced; `again` opens it again if it is an object of the user's own. */
  scene(scene: SceneMessage, again: (() => void) | undefined): void {
    const { title, about } = this.layout;
    title.textContent = scene.title;
    about.textContent = about.title = scene.about;
    document.title = `${scene.title} · palpate`;
    if (again !== undefined) this.scenes.addUpload(scene.title, again);
    this.scenes.setCurrent(scene.id, scene.title);
    this.physics.update(scene);
    this.material.update(scene);
    this.accuracy.update([scene]);
  }

  /** Begins the plots of a scene that is shown. */
  shown(scene: SceneMessage): void {
    this.plots.reset(scene);
  }

  frame(frame: Frame): void {
    this.plots.update(frame);
  }

  status(status: Status, scene: SceneMessage | null): void {
    this.timing.update(status);
    this.viewers.hidden = !(status.viewers > 1);
    this.viewers.textContent = `${status.viewers} viewers`;
    const pace = scene === null ? null : this.pace.update(status, scene.step_s, performance.now() / 1000);
    const text = paceText(pace, status.slowdown);
    this.paceChip.hidden = text === null;
    this.paceChip.textContent = text;
  }

  connectionLost(): void {
    this.paceChip.hidden = true;
    this.timing.clear();
  }

  animate(now: number): void {
    this.plots.animate(now);
  }

  applyTheme(): void {
    this.plots.applyTheme();
  }
}
