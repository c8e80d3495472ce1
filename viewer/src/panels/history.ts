// The last seconds of forces and energies, for plots that scroll.

import { ENERGY_NAMES, type EnergyName, type Picture } from "../protocol/picture";

export const ENERGY_LINES: readonly { name: string; title: string; of: readonly EnergyName[]; sign?: 1 | -1 }[] = [
  { name: "Motion", title: "Kinetic energy of the objects", of: ["kinetic"] },
  { name: "Elastic", title: "Energy in what is bent, stretched and dented", of: ["elastic", "residual"] },
  { name: "Height", title: "Potential energy in gravity, against the lowest seen here", of: ["potential"] },
  { name: "Lost", title: "What damping, friction and impacts have taken", of: ["dissipated", "friction", "impact"] },
  { name: "By hands", title: "Work that the hands have done", of: ["input"] },
];

export function energyOf(energies: ArrayLike<number>, names: readonly EnergyName[]): number {
  return names.reduce((sum, name) => sum + energies[ENERGY_NAMES.indexOf(name)], 0);
}

export class History {
  times: number[] = [];
  forces: number[][] = [];
  energies: number[][] = ENERGY_LINES.map(() => []);

  constructor(private readonly seconds: number) {}

  begin(devices: number): void {
    this.times = [];
    this.forces = Array.from({ length: devices }, () => []);
    this.energies = ENERGY_LINES.map(() => []);
  }

  take(picture: Picture): void {
    const last = this.times.at(-1) ?? -Infinity;
    if (picture.time === last) return;
    if (picture.time < last || picture.devices.length !== this.forces.length) this.begin(picture.devices.length);
    this.times.push(picture.time);
    picture.devices.forEach((device, i) => this.forces[i].push(Math.hypot(...device.force)));
    ENERGY_LINES.forEach((line, i) => this.energies[i].push(energyOf(picture.energies, line.of)));
    let old = 0;
    while (this.times[old] < picture.time - this.seconds) old++;
    // In large steps, so that it costs little.
    if (old > 256) for (const list of [this.times, ...this.forces, ...this.energies]) list.splice(0, old);
  }
}

/** The height's energy counted from its lowest, so that it is seen beside the others. */
export function fromLowest(values: readonly number[]): number[] {
  let lowest = Infinity;
  for (const value of values) lowest = Math.min(lowest, value);
  return values.map((value) => value - lowest);
}
