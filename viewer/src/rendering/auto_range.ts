// Display ranges of 1, 2 or 5 times a power of ten: growing ones, which can be locked, and ones with hysteresis.

const STEPS = [1, 2, 5, 10];

/** Smallest of …, 0.1, 0.2, 0.5, 1, 2, 5, … that is not below `value`. */
export function niceCeil(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 0;
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  const step = STEPS.find((s) => s * power >= value * (1 - 1e-9)) ?? 10;
  // Rounding through text gives exactly 0.002 for 2·10⁻³.
  return Number((step * power).toPrecision(1));
}

/** Display range that follows values. */
export interface DisplayRange {
  readonly value: number;
  /** Adds a value at time `now` [s]; returns true if the range has changed. */
  update(value: number, now: number): boolean;
}

/** Range that only grows, and not at all while it is locked: a colour or an arrow means the same from then on. */
export class GrowingRange implements DisplayRange {
  private range: number;
  private isLocked = false;

  constructor(private readonly least: number) {
    this.range = niceCeil(least);
  }

  get value(): number {
    return this.range;
  }

  get locked(): boolean {
    return this.isLocked;
  }

  /** Locks the range; unlocked it is fitted anew, from its least value. */
  set locked(locked: boolean) {
    if (this.isLocked && !locked) this.range = niceCeil(this.least);
    this.isLocked = locked;
  }

  /** Sets the end of the range for a largest value, and locks it. */
  fix(largest: number): void {
    this.range = Math.max(niceCeil(this.least), niceCeil(largest));
    this.isLocked = true;
  }

  update(value: number): boolean {
    const wanted = niceCeil(value);
    if (this.isLocked || !(wanted > this.range)) return false;
    this.range = wanted;
    return true;
  }
}

const SHRINK_DELAY_S = 2.5;

/** Range with hysteresis: grows at once, shrinks after being too large for `SHRINK_DELAY_S`. */
export class AutoRange implements DisplayRange {
  private range: number;
  private largest = 0;
  private since = 0;

  constructor(private readonly least: number) {
    this.range = niceCeil(least);
  }

  get value(): number {
    return this.range;
  }

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
