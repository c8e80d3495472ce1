// Ring buffer between blocks from the network and the sound device: holds a small latency, corrects the drift of the two clocks, and
// leaves no click where samples are missing.

/** Fill that is held [samples of the source]: 10 ms, twice the interval of the blocks and some jitter. */
export const TARGET = 480;
/** Fill that is held on a machine that is late again and again [samples]: 40 ms; growth per gap, and decay per call, with 20 s. */
const MOST = 1920;
const GROWTH = 1.5;
const DECAY = Math.exp(-1 / 7500);
/** Fill above which samples are left out [samples]: 60 ms. */
export const LIMIT = 2880;
const CAPACITY = 9600;
/** Largest change of the speed by the drift correction: 3 cents, and more than clocks differ. */
const MAX_DRIFT = 0.002;
/** Change of the speed per relative error of the fill. */
const DRIFT_GAIN = 0.01;
/** Share of a measured fill in its mean, per call. */
const SMOOTHING = 0.02;
/** Samples that the next one is made of. */
const NEEDED = 3;
/** Decay per sample of what bridges a gap: 2 ms at 48 kHz. */
const BRIDGE = Math.exp(-1 / 96);

export class SoundRing {
  private readonly samples = new Float32Array(CAPACITY);
  private written = 0;
  /** Position of the next sample, with its fraction. */
  private read = 0;
  private playing = false;
  private target = TARGET;
  private meanFill = TARGET;
  /** Difference from the last output that decays after a gap. */
  private offset = 0;
  private last = 0;
  underruns = 0;

  /** `ratio`: samples of the source per sample of the device. */
  constructor(private readonly ratio = 1) {}

  /** Samples that wait. */
  get fill(): number {
    return this.written - this.read;
  }

  push(block: Float32Array): void {
    for (const sample of block) this.samples[this.written++ % CAPACITY] = sample;
    // What is late is not heard any more.
    if (this.fill > LIMIT) {
      this.read = this.written - this.target;
      this.meanFill = this.target;
      this.bridge();
    }
  }

  /** Fills the output; silence where nothing is there. */
  pull(output: Float32Array): void {
    this.target = TARGET + DECAY * (this.target - TARGET);
    if (!this.playing && this.fill >= this.target) {
      this.playing = true;
      this.meanFill = this.fill;
      this.bridge();
    }
    this.meanFill += SMOOTHING * (this.fill - this.meanFill);
    const drift = Math.max(-MAX_DRIFT, Math.min(MAX_DRIFT, (DRIFT_GAIN * (this.meanFill - this.target)) / this.target));
    const step = this.ratio * (1 + drift);
    for (let at = 0; at < output.length; at++) {
      if (this.playing && this.fill < NEEDED) {
        this.playing = false;
        this.underruns++;
        this.target = Math.min(MOST, GROWTH * this.target);
        // What comes next does not follow from what is left: not even the slope at its first sample.
        this.read = this.written + 1;
        this.offset = this.last;
      }
      let sample = 0;
      if (this.playing) {
        sample = this.interpolated();
        this.read += step;
      }
      this.last = sample + this.offset;
      this.offset = Math.abs(this.offset) < 1e-9 ? 0 : this.offset * BRIDGE;
      output[at] = this.last;
    }
  }

  /** Makes the next sample follow the last one. */
  private bridge(): void {
    this.offset = this.last - (this.playing && this.fill >= NEEDED ? this.interpolated() : 0);
  }

  /** Cubic interpolation with the slopes of the neighbours (Catmull–Rom). */
  private interpolated(): number {
    const whole = Math.floor(this.read);
    const t = this.read - whole;
    const at = (n: number) => this.samples[(whole + n + CAPACITY) % CAPACITY];
    const [before, a, b, after] = [at(-1), at(0), at(1), at(2)];
    const [slopeA, slopeB] = [(b - before) / 2, (after - a) / 2];
    return a + t * (slopeA + t * (3 * (b - a) - 2 * slopeA - slopeB + t * (2 * (a - b) + slopeA + slopeB)));
  }
}
