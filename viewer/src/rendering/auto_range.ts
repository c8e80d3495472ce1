// Display ranges of 1, 2 or 5 times a power of ten, with hysteresis.

const STEPS = [1, 2, 5, 10];

/** Smallest of …, 0.1, 0.2, 0.5, 1, 2, 5, … that is not below `value`. */
export function niceCeil(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 0;
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  const step = STEPS.find((s) => s * power >= value * (1 - 1e-9)) ?? 10;
  // Rounding through text gives exactly 0.002 for 2·10⁻³.
  return Number((step * power).toPrecision(1));
}

const SHRINK_DELAY_S = 2.5;

/** Range with hysteresis: grows at once, shrinks after being too large for `SHRINK_DELAY_S`. */
export class AutoRange {
  private range: number;
  private largest = 0;
  private since = 0;

  constructor(private readonly least: number) {
    this.range = niceCeil(least);
  }

  get value(): number {
    return this.range;
  }

  /** Adds a value at time `now` [s]; returns true if the range has changed. */
  update(value: number, now: number): boolean {
    const wanted = niceCeil(Math.max(value, this.least));
    if (wanted > this.range) {
      this.range = wanted;
      this.largest = 0;
      this.since = now;
      return true;
    }
    this.largest = Math.max(this.largest, value);
    if (now < this.since) this.since = now;
    if (now - this.since < SHRINK_DELAY_S) return false;
    const calm = niceCeil(Math.max(this.largest, this.least));
    this.largest = value;
    this.since = now;
    if (calm > 0.45 * this.range) return false;
    this.range = calm;
    return true;
  }
}
