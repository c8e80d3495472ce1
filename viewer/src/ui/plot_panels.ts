// Plots of forces and energies.

import { withUnit } from "../format";
import type { SceneMessage, Series } from "../protocol/messages";
import { ENERGY_NAMES, type Frame } from "../protocol/frame";
import { element, section } from "./elements";
import { ENERGY_SERIES, relativeToMinimum, sumEnergies, TimeSeries } from "./time_series";
import { Plot } from "./plot";

const WINDOW_S = 10;
const DRAW_INTERVAL_MS = 60;

function forceSeries(scene: SceneMessage): { name: string; title: string }[] {
  return scene.devices.map(({ name }) => ({ name, title: `Force on ${name}` }));
}

/** Force plot and energy plot of a scene. */
export class PlotPanels {
  private readonly timeSeries = new TimeSeries(WINDOW_S);
  readonly force = new Plot("N", 150, []);
  readonly energy = new Plot("J", 170, ENERGY_SERIES);
  private readonly balance = element("p", { class: "secondary" });
  readonly sections: HTMLElement[];
  private drawnAt = 0;
  private latest: Frame | null = null;

  constructor() {
    this.sections = [section("Force on the hands", true, this.force.box), section("Energy", true, this.energy.box, this.balance)];
    for (const part of this.sections) part.addEventListener("toggle", () => this.draw());
  }

  reset(scene: SceneMessage): void {
    this.timeSeries.reset(scene.devices.length);
    this.force.setSeries(forceSeries(scene));
    this.energy.setSeries();
  }

  /** Rebuilds the plots with the current theme. */
  applyTheme(): void {
    this.force.setSeries();
    this.energy.setSeries();
  }

  update(frame: Frame): void {
    this.timeSeries.update(frame);
    this.latest = frame;
  }

  animate(now: number): void {
    if (now - this.drawnAt < DRAW_INTERVAL_MS || this.latest === null) return;
    this.drawnAt = now;
    this.draw();
  }

  private draw(): void {
    const frame = this.latest;
    if (frame === null) return;
    const { times, forces, energies } = this.timeSeries;
    const shown: [number, number] = [Math.max(0, frame.time - WINDOW_S), Math.max(WINDOW_S, frame.time)];
    this.force.setData([times, ...forces], shown);
    this.energy.setData([times, ...energies.map((line, i) => (ENERGY_SERIES[i].name === "Potential" ? relativeToMinimum(line) : line))], shown);
    this.showBalance(frame.energies);
  }

  private showBalance(energies: Float32Array): void {
    const defect = sumEnergies(energies, ["defect"]);
    this.balance.textContent = `Energy error: ${withUnit(Math.abs(defect), "J", 0, 2)}.`;
    this.balance.title = "Input work minus stored and dissipated energy";
  }

  /** Shows the whole series of a log. */
  showSeries(series: Series): void {
    this.force.setSeries(series.devices.map(({ name }) => ({ name, title: `Force on ${name}` })));
    this.force.setData([series.t, ...series.devices.map(({ force }) => force.map((vector) => Math.hypot(...vector)))], null);
    this.energy.setSeries();
    const zero = series.t.map(() => 0);
    const lines = ENERGY_SERIES.map((line) => {
      const parts = line.of.map((name) => series.energy[name] ?? zero);
      const sum = zero.map((_, i) => parts.reduce((all, part) => all + part[i], 0));
      return line.name === "Potential" ? relativeToMinimum(sum) : sum;
    });
    this.energy.setData([series.t, ...lines], null);
    const defect = series.energy.defect?.at(-1);
    if (defect !== undefined) this.showBalance(Float32Array.from(ENERGY_NAMES, (name) => (name === "defect" ? defect : 0)));
  }
}
