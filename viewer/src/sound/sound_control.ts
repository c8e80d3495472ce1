// Button and volume of the sound, off by default. The samples are limited by the server; the volume only lowers them.

import workletUrl from "./sound_worklet?worker&url";
import type { ClientMessage } from "../protocol/messages";
import type { Notifications } from "../ui/notifications";
import { element, iconButton } from "../ui/elements";
import type { SoundBlock } from "./sound_block";

/** Sample rate of the server [Hz]. */
const RATE = 48000;
/** Time constant of the volume [s]. */
const VOLUME_RAMP_S = 0.02;

export class SoundControl {
  readonly parts: HTMLElement[];
  private readonly button: HTMLButtonElement;
  private readonly volume = element("input", { class: "volume", type: "range", title: "Volume", attributes: { min: "0", max: "1", step: "0.01", value: "0.7", "aria-label": "Volume" } });
  private context: AudioContext | null = null;
  private gain: GainNode | null = null;
  private player: AudioWorkletNode | null = null;
  private on = false;
  /** Films that record the sound: its clock has to go on until they end. */
  private films = 0;

  constructor(
    private readonly send: (message: ClientMessage) => void,
    private readonly notifications: Notifications,
  ) {
    this.button = iconButton("sound", "Sound: off", () => void this.toggle(), "Sound");
    this.button.setAttribute("aria-pressed", "false");
    this.volume.hidden = true;
    this.volume.addEventListener("input", () => this.applyVolume());
    this.parts = [this.button, this.volume];
  }

  /** Asks again after a connection was lost. */
  connected(): void {
    if (this.on) this.send({ type: "sound", on: true });
  }

  play(block: SoundBlock): void {
    if (!this.on) return;
    // A copy: what is handed over is gone here.
    const samples = block.samples.slice();
    this.player?.port.postMessage({ rate: block.rate, samples }, [samples.buffer]);
  }

  async toggle(): Promise<void> {
    if (this.on) {
      this.set(false);
      this.send({ type: "sound", on: false });
      this.rest();
      return;
    }
    this.set(true);
    try {
      await this.open();
    } catch (error) {
      this.set(false);
      this.notifications.notify(`This browser plays no sound: ${error instanceof Error ? error.message : String(error)}`);
      return;
    }
    if (this.on) this.send({ type: "sound", on: true });
  }

  /** Sound as it is heard, for a film; null while it is off. */
  forFilm(): { track: MediaStreamTrack; release(): void } | null {
    const { context, gain } = this;
    if (!this.on || context === null || gain === null) return null;
    const output = new MediaStreamAudioDestinationNode(context, { channelCount: 1 });
    gain.connect(output);
    this.films += 1;
    const release = () => {
      gain.disconnect(output);
      this.films -= 1;
      this.rest();
    };
    return { track: output.stream.getAudioTracks()[0], release };
  }

  /** Stops the sound device when nobody needs it. */
  private rest(): void {
    if (!this.on && this.films === 0) void this.context?.suspend();
  }

  private set(on: boolean): void {
    this.on = on;
    this.volume.hidden = !on;
    this.button.setAttribute("aria-pressed", String(on));
    this.button.title = on ? "Sound: on" : "Sound: off";
    this.button.setAttribute("aria-label", this.button.title);
  }

  /** Opens the sound device, or resumes it; a browser allows it after a click only. */
  private async open(): Promise<void> {
    if (this.context === null) {
      const context = new AudioContext({ latencyHint: "interactive", sampleRate: RATE });
      if (context.audioWorklet === undefined) throw new Error("it needs an address that begins with https: or this machine's own");
      await context.audioWorklet.addModule(workletUrl);
      const player = new AudioWorkletNode(context, "palpate-sound", { numberOfInputs: 0, outputChannelCount: [1] });
      player.port.onmessage = (event: MessageEvent<{ fill: number; underruns: number }>) => {
        const buffered = (1000 * event.data.fill) / RATE;
        const device = 1000 * (context.baseLatency + (context.outputLatency || 0));
        const gaps = event.data.underruns;
        if (this.on) this.button.title = `Sound: on; ${buffered.toFixed(0)} ms in the buffer, ${device.toFixed(0)} ms in the sound device, ${gaps} gaps`;
      };
      this.gain = new GainNode(context, { gain: 0 });
      player.connect(this.gain).connect(context.destination);
      [this.context, this.player] = [context, player];
    }
    await this.context.resume();
    this.applyVolume();
  }

  /** The square of the slider's place: steps sound alike. */
  private applyVolume(): void {
    const volume = Math.min(1, Math.max(0, Number(this.volume.value)));
    if (this.gain !== null && this.context !== null) this.gain.gain.setTargetAtTime(volume * volume, this.context.currentTime, VOLUME_RAMP_S);
  }
}
