// Sliding window of forces [N] and energies [J] for scrolling plots.

import { ENERGY_NAMES, type EnergyName, type Frame } from "../protocol/frame";

export const ENERGY_SERIES: readonly { name: string; title: string; of: readonly EnergyName[] }[] = [
  { name: "Kinetic", title: "Kinetic energy of the objects", of: ["kinetic"] },
  { name: "Elastic", title: "Elastic energy of modes and residual displacement", of: ["elastic", "residual"] },
  { name: "Potential", title: "Gravitational potential energy, relative to its minimum in this plot", of: ["potential"] },
  { name: "Dissipated", title: "Energy dissipated by damping, friction and impacts", of: ["dissipated", "friction", "impact"] },
  { name: "Input work", title: "Work done by the devices", of: ["input"] },
];

/** Sum of the named energies [J]. */
export function sumEnergies(energies: ArrayLike<number>, names: readonly EnergyName[]): number {
  return names.reduce((sum, name) => sum + energies[ENERGY_NAMES.indexOf(name)], 0);
}

export class TimeSeries {
  /** Simulation times [s]. */
  times: number[] = [];
  /** Force magnitude on each hand [N]. */
  forces: number[][] = [];
  /** Energies [J] in the order of `ENERGY_SERIES`. */
  energies: number[][] = ENERGY_SERIES.map(() => []);

  constructor(private readonly duration: number) {}

  reset(devices: number): void {
    this.times = [];
    this.forces = Array.from({ length: devices }, () => []);
    this.energies = ENERGY_SERIES.map(() => []);
  }

  update(frame: Frame): void {
    const last = this.times.at(-1) ?? -Infinity;
    if (frame.time === last) return;
    if (frame.time < last || frame.devices.length !== this.forces.length) this.reset(frame.devices.length);
    this.times.push(frame.time);
    frame.devices.forEach((device, i) => this.forces[i].push(Math.hypot(...device.force)));
    ENERGY_SERIES.forEach((line, i) => this.energies[i].push(sumEnergies(frame.energies, line.of)));
    let expired = 0;
    while (this.times[expired] < frame.time - this.duration) expired++;
    // Trimmed in large blocks to amortise the cost.
    if (expired > 256) for (const list of [this.times, ...this.forces, ...this.energies]) list.splice(0, expired);
  }
}

/** Values relative to their minimum, so that potential energy fits beside the others. */
export function relativeToMinimum(values: readonly number[]): number[] {
  let minimum = Infinity;
  for (const value of values) minimum = Math.min(minimum, value);
  return values.map((value) => value - minimum);
}
