// Ranges that people can read: 1, 2 or 5 times a power of ten, and that do not flicker.

const STEPS = [1, 2, 5, 10];

/** The least of …, 0.1, 0.2, 0.5, 1, 2, 5, … that is not below `value`. */
export function niceAbove(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 0;
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  const step = STEPS.find((s) => s * power >= value * (1 - 1e-9)) ?? 10;
  // Through text, so that 2·10⁻³ is 0.002 and not its neighbour.
  return Number((step * power).toPrecision(1));
}

const SHRINKS_AFTER_S = 2.5;

/** A range that grows at once, and shrinks when it has been far too large for a while. */
export class CalmRange {
  private range: number;
  private largest = 0;
  private since = 0;

  constructor(private readonly least: number) {
    this.range = niceAbove(least);
  }

  get value(): number {
    return this.range;
  }

  /** `now` in seconds, of any clock. True if the range has changed. */
  take(value: number, now: number): boolean {
    const wanted = niceAbove(Math.max(value, this.least));
    if (wanted > this.range) {
      this.range = wanted;
      this.largest = 0;
      this.since = now;
      return true;
    }
    this.largest = Math.max(this.largest, value);
    if (now < this.since) this.since = now;
    if (now - this.since < SHRINKS_AFTER_S) return false;
    const calm = niceAbove(Math.max(this.largest, this.least));
    this.largest = value;
    this.since = now;
    if (calm > 0.45 * this.range) return false;
    this.range = calm;
    return true;
  }
}
