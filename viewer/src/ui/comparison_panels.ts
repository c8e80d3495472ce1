// Plots of logs that are compared: force on a hand, and an energy, each of all logs in one plot.

import type { Series } from "../protocol/messages";
import { commonForces, ENERGIES } from "../playback/comparison";
import { ComparisonPlot } from "./comparison_plot";

export class ComparisonPanels {
  private readonly force = new ComparisonPlot("Force on the hands", "N", 180);
  private readonly energy = new ComparisonPlot("Energy", "J", 180);
  readonly sections = [this.force.section, this.energy.section];
  private readonly series = new Map<number, { name: string; series: Series }>();

  /** `seek` goes to a time since the start [s]. */
  constructor(seek: (time: number) => void) {
    this.force.plot.onSeek = this.energy.plot.onSeek = seek;
  }

  setSeries(log: number, name: string, series: Series): void {
    this.series.set(log, { name, series });
    const logs = [...this.series].sort(([a], [b]) => a - b).map(([, known]) => known);
    this.force.show(logs, commonForces(logs.map((known) => known.series)));
    this.energy.show(logs, ENERGIES);
  }

  /** Marks the time since the start [s] that is shown. */
  setMarker(time: number): void {
    this.force.plot.setMarker(time);
    this.energy.plot.setMarker(time);
  }

  applyTheme(): void {
    this.force.draw();
    this.energy.draw();
  }
}
