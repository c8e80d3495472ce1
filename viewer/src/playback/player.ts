// Playback state of logs: time, speed, play and pause.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

export class Player {
  /** Time since the start of the log [s]. */
  time = 0;
  playing = false;
  speed = 1;

  constructor(
    public duration: number,
    public frameSeconds: number,
  ) {}

  get atEnd(): boolean {
    return this.time >= this.duration - 1e-9;
  }

  toggle(): void {
    if (!this.playing && this.atEnd) this.time = 0;
    this.playing = !this.playing;
  }

  seek(time: number): void {
    this.time = Math.min(this.duration, Math.max(0, time));
  }

  /** Pauses and seeks by `count` frames. */
  stepFrames(count: number): void {
    this.playing = false;
    this.seek((Math.round(this.time / this.frameSeconds) + count) * this.frameSeconds);
  }

  changeSpeed(direction: 1 | -1): void {
    const at = SPEEDS.findIndex((speed) => speed >= this.speed - 1e-9);
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + direction))];
  }

  /** Advances by wall-clock seconds times the speed. */
  advance(seconds: number): void {
    if (!this.playing) return;
    this.seek(this.time + seconds * this.speed);
    if (this.atEnd) this.playing = false;
  }

  frameOf(frames: number, frameSeconds: number): number {
    return Math.max(0, Math.min(frames - 1, Math.round(this.time / frameSeconds)));
  }
}
