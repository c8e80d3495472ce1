// Processor of the sound thread of the browser: plays a ring buffer that the page fills.

import { SoundRing } from "./sound_ring";

declare const sampleRate: number;
declare class AudioWorkletProcessor {
  readonly port: MessagePort;
}
declare function registerProcessor(name: string, processor: unknown): void;

/** Calls between two reports of the fill: half a second at 48 kHz. */
const REPORT_EVERY = 190;

class Player extends AudioWorkletProcessor {
  private ring: SoundRing | null = null;
  private calls = 0;

  constructor() {
    super();
    this.port.onmessage = (event: MessageEvent<{ rate: number; samples: Float32Array }>) => {
      this.ring ??= new SoundRing(event.data.rate / sampleRate);
      this.ring.push(event.data.samples);
    };
  }

  process(_: Float32Array[][], outputs: Float32Array[][]): boolean {
    const [channel] = outputs[0];
    if (channel !== undefined && this.ring !== null) {
      this.ring.pull(channel);
      if (++this.calls % REPORT_EVERY === 0) {
        this.port.postMessage({ fill: this.ring.fill, underruns: this.ring.underruns });
      }
    }
    return true;
  }
}

registerProcessor("palpate-sound", Player);
