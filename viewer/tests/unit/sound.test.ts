import { describe, expect, it } from "vitest";
import { decodeSound, isSound, SOUND_MAGIC } from "../../src/sound/sound_block";
import { LIMIT, SoundRing, TARGET } from "../../src/sound/sound_ring";

const RATE = 48000;
const QUANTUM = 128;

function tone(from: number, count: number, frequency = 440): Float32Array {
  return Float32Array.from({ length: count }, (_, at) => 0.5 * Math.sin((2 * Math.PI * frequency * (from + at)) / RATE));
}

function largestStep(samples: number[]): number {
  return samples.slice(1).reduce((largest, sample, at) => Math.max(largest, Math.abs(sample - samples[at])), 0);
}

/** Largest step of the tone itself. */
const SMOOTH = (0.5 * 2 * Math.PI * 440) / RATE;

function pull(ring: SoundRing, quanta = 1): number[] {
  const all: number[] = [];
  for (let n = 0; n < quanta; n++) {
    const output = new Float32Array(QUANTUM);
    ring.pull(output);
    all.push(...output);
  }
  return all;
}

describe("ring buffer of the sound", () => {
  it("waits for ten milliseconds, then plays without a click", () => {
    const ring = new SoundRing();
    ring.push(tone(0, TARGET - 1));
    expect(pull(ring).every((sample) => sample === 0)).toBe(true);
    ring.push(tone(TARGET - 1, 2000));
    const heard = pull(ring, 15);
    expect(Math.max(...heard)).toBeGreaterThan(0.45);
    expect(largestStep([0, ...heard])).toBeLessThan(1.6 * SMOOTH);
  });

  it("fades where samples are missing, and goes on where they come again", () => {
    const ring = new SoundRing();
    ring.push(tone(0, 700));
    const heard = pull(ring, 10);
    expect(ring.underruns).toBe(1);
    expect(Math.abs(heard[heard.length - 1])).toBeLessThan(0.01);
    ring.push(tone(5000, 1200));
    heard.push(...pull(ring, 8));
    expect(Math.max(...heard.slice(-600))).toBeGreaterThan(0.45);
    expect(largestStep(heard)).toBeLessThan(2 * SMOOTH);
  });

  it.each([0.999, 1, 1.001])("holds its latency where the device runs at %f of the server's clock", (speed) => {
    const ring = new SoundRing();
    let sent = 0;
    const fills: number[] = [];
    const heard: number[] = [];
    for (let quantum = 0; quantum < 6000; quantum++) {
      // Blocks of 4 ms by the server's clock, read in quanta by the device's.
      while (sent * 192 < quantum * QUANTUM * speed) ring.push(tone(192 * sent++, 192));
      heard.push(...pull(ring));
      if (heard.length > 4000) heard.splice(0, 2000);
      if (quantum > 3000) fills.push(ring.fill);
    }
    expect(ring.underruns).toBe(0);
    // 30 ms are 1440 samples; half of them leaves room for the device.
    expect(Math.max(...fills)).toBeLessThan(800);
    expect(largestStep(heard)).toBeLessThan(1.1 * SMOOTH);
  });

  it("holds more where blocks come late again and again, and less later", () => {
    const ring = new SoundRing();
    let sent = 0;
    const gaps: number[] = [];
    // Blocks of 30 ms, all at once.
    for (let quantum = 0; quantum < 3000; quantum++) {
      if ((quantum * QUANTUM) % 1440 < QUANTUM) ring.push(tone(1440 * sent++, 1440));
      pull(ring);
      gaps.push(ring.underruns);
    }
    expect(ring.underruns).toBeGreaterThan(0);
    expect(gaps[2999] - gaps[1500]).toBe(0);
    // Regular blocks of 4 ms: after a minute it holds ten milliseconds again.
    const fills: number[] = [];
    for (let quantum = 0; quantum < 25000; quantum++) {
      if ((quantum * QUANTUM) % 192 < QUANTUM) ring.push(tone(192 * sent++, 192));
      pull(ring);
      if (quantum > 24000) fills.push(ring.fill);
    }
    expect(Math.max(...fills)).toBeLessThan(900);
  });

  it("leaves out what is late", () => {
    const ring = new SoundRing();
    for (let n = 0; n < 40; n++) ring.push(tone(192 * n, 192));
    expect(ring.fill).toBeLessThan(LIMIT + 192);
    const late = new SoundRing();
    late.push(tone(0, 600));
    const heard = pull(late);
    late.push(tone(600, 6000));
    heard.push(...pull(late, 4));
    expect(late.fill).toBeLessThan(TARGET + QUANTUM);
    expect(largestStep(heard)).toBeLessThan(2 * SMOOTH);
  });

  it("plays a device of another rate at the right pitch", () => {
    const ring = new SoundRing(48000 / 44100);
    const heard: number[] = [];
    let sent = 0;
    for (let quantum = 0; quantum < 800; quantum++) {
      while (ring.fill < TARGET + QUANTUM) ring.push(tone(192 * sent++, 192, 441));
      heard.push(...pull(ring));
    }
    const late = heard.slice(-44100);
    const crossings = late.filter((sample, at) => at > 0 && late[at - 1] < 0 && sample >= 0).length;
    expect(Math.abs(crossings - 441)).toBeLessThanOrEqual(3);
  });
});

describe("blocks of sound", () => {
  function block(length: number, count: number): ArrayBuffer {
    const bytes = new ArrayBuffer(length);
    const view = new DataView(bytes);
    [SOUND_MAGIC, 7, RATE, count].forEach((number, at) => view.setUint32(4 * at, number, true));
    if (length >= 24) view.setFloat32(20, -0.25, true);
    return bytes;
  }

  it("are told from frames, and decoded", () => {
    expect(isSound(block(24, 2))).toBe(true);
    expect(isSound(new ArrayBuffer(88))).toBe(false);
    expect(isSound(new ArrayBuffer(4))).toBe(false);
    expect(decodeSound(block(24, 2))).toEqual({ generation: 7, rate: RATE, samples: new Float32Array([0, -0.25]) });
  });

  it("are refused with another length", () => {
    expect(() => decodeSound(block(24, 3))).toThrow("a block of sound has the wrong length");
  });
});
