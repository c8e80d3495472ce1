// Comparison of logs: a quantity of each over time since its start, and the difference of two.

import type { Series } from "../protocol/messages";
import { ENERGY_SERIES, relativeToMinimum } from "../ui/time_series";

/** Quantity that logs have in common. */
export interface Quantity {
  name: string;
  title: string;
  unit: "N" | "J";
  /** Values at the times of a series. */
  of: (series: Series) => number[];
}

/** Values over time since the start of a log [s]. */
export interface Curve {
  times: readonly number[];
  values: readonly number[];
}

/** Forces on the hands, by the name of the device, that all logs have [N]. */
export function commonForces(all: readonly Series[]): Quantity[] {
  const [first, ...others] = all;
  const common = first?.devices.filter(({ name }) => others.every((series) => series.devices.some((device) => device.name === name))) ?? [];
  return common.map(({ name }) => ({
    name,
    title: `Force on ${name}`,
    unit: "N",
    of: (series) => series.devices.find((device) => device.name === name)?.force.map((vector) => Math.hypot(...vector)) ?? [],
  }));
}

/** Energies [J]. */
export const ENERGIES: readonly Quantity[] = ENERGY_SERIES.map(({ name, title, of }) => ({
  name,
  title,
  unit: "J",
  of: (series) => {
    const sum = series.t.map((_, i) => of.reduce((all, part) => all + (series.energy[part]?.[i] ?? 0), 0));
    return name === "Potential" ? relativeToMinimum(sum) : sum;
  },
}));

/** Curve of a quantity. */
export function curveOf(series: Series, quantity: Quantity): Curve {
  const start = series.t[0] ?? 0;
  return { times: series.t.map((t) => t - start), values: quantity.of(series) };
}

/** Values of a curve at sorted times, by linear interpolation; null outside of it. */
export function sampled({ times, values }: Curve, at: readonly number[]): (number | null)[] {
  let next = 0;
  return at.map((time) => {
    while (next < times.length && times[next] < time) next++;
    if (next === times.length) return null;
    if (times[next] === time) return values[next];
    if (next === 0) return null;
    const share = (time - times[next - 1]) / (times[next] - times[next - 1]);
    return values[next - 1] + share * (values[next] - values[next - 1]);
  });
}

/** Curves on common times; of two, with the difference second − first. */
export interface Aligned {
  times: number[];
  values: (number | null)[][];
  difference: (number | null)[] | null;
}

export function align(curves: readonly Curve[]): Aligned {
  const times = [...new Set(curves.flatMap((curve) => [...curve.times]))].sort((a, b) => a - b);
  const values = curves.map((curve) => sampled(curve, times));
  const difference = curves.length === 2 ? times.map((_, i) => minus(values[1][i], values[0][i])) : null;
  return { times, values, difference };
}

function minus(a: number | null, b: number | null): number | null {
  return a === null || b === null ? null : a - b;
}

/** Index of the value of largest size; −1 if there is none. */
export function largestAt(values: readonly (number | null)[]): number {
  let best = -1;
  values.forEach((value, i) => {
    if (value !== null && (best < 0 || Math.abs(value) > Math.abs(values[best] ?? 0))) best = i;
  });
  return best;
}
