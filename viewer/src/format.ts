// Number formatting: significant digits, SI prefix and unit.

const PREFIXES: readonly [number, string][] = [
  [1e9, "G"],
  [1e6, "M"],
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
  [1e-9, "n"],
];

const MINUS = "\u2212";
const NARROW_SPACE = "\u202f";

/** Decimal text with `count` significant digits and a typographic minus; an exponent below 1e−4 and from 1e6 on. */
export function digits(value: number, count = 3): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  // Size of the rounded number: 0.9999 gives 1.00.
  const size = Math.abs(Number(value.toPrecision(count)));
  if (size >= 1e6 || size < 1e-4) return value.toExponential(count - 1).replace("e+", "e").replaceAll("-", MINUS);
  const behind = Math.max(0, count - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(Math.min(behind, 8)).replace("-", MINUS);
}

/** Value with SI prefix and unit: 0.0123, "N" → "12.3 mN". Values up to `floor` give 0. */
export function withUnit(value: number, unit: string, floor = 0, count = 3): string {
  if (!Number.isFinite(value)) return `– ${unit}`;
  const size = Math.abs(value);
  if (size <= floor || size < 1e-12) return `0${NARROW_SPACE}${unit}`;
  // Prefix of the rounded number: 999.9 mN gives 1.00 N.
  const rounded = Number(size.toPrecision(count));
  const [factor, prefix] = PREFIXES.find(([least]) => rounded >= least) ?? PREFIXES[PREFIXES.length - 1];
  return `${digits(value / factor, count)}${NARROW_SPACE}${prefix}${unit}`;
}

export function newtons(value: number): string {
  return withUnit(value, "N", 5e-5);
}

/** Force label of nearly constant width: two decimals from 0.1 N on. */
export function formatForce(value: number): string {
  const size = Math.abs(value);
  if (size < 5e-4) return `0.00${NARROW_SPACE}N`;
  if (size < 0.0995) return `${digits(value * 1000, size < 0.00995 ? 2 : 3)}${NARROW_SPACE}mN`;
  return size < 99.95 ? `${value.toFixed(2).replace("-", MINUS)}${NARROW_SPACE}N` : newtons(value);
}

export function percent(share: number): string {
  return `${digits(100 * share, 2)}${NARROW_SPACE}%`;
}

export function micros(value: number): string {
  return value >= 1000 ? `${digits(value / 1000, 3)}${NARROW_SPACE}ms` : `${digits(value, value < 100 ? 2 : 3)}${NARROW_SPACE}µs`;
}

export function seconds(value: number): string {
  return `${value.toFixed(value < 100 ? 2 : 1)}${NARROW_SPACE}s`;
}

export function count(value: number): string {
  return Math.round(value).toString().replace(/\B(?=(\d{3})+$)/g, NARROW_SPACE);
}

export function slowdownLabel(slowdown: number): string {
  return slowdown === 1 ? "1×" : `1/${slowdown}×`;
}

/** Pressure or modulus with SI prefix: 2 kPa, 0.1 MPa. */
export function pascals(value: number): string {
  return withUnit(value, "Pa");
}
