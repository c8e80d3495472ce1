// Frames of a log: fetched in chunks, kept while they are near, with a bound on memory.

export type FetchFrames = (from: number, count: number) => Promise<ArrayBuffer[]>;

export const CHUNK = 60;
const MOST_BYTES = 192e6;
const RETRY_MS = 400;

export class FrameCache {
  /** By number of the chunk; the oldest use first. */
  private readonly chunks = new Map<number, ArrayBuffer[]>();
  private readonly underWay = new Map<number, Promise<void>>();
  private readonly notBefore = new Map<number, number>();
  private bytes = 0;
  onFrames: () => void = () => undefined;
  onFailure: (error: unknown) => void = () => undefined;

  constructor(
    private readonly fetchFrames: FetchFrames,
    public frames: number,
    private readonly mostBytes = MOST_BYTES,
  ) {}

  get size(): number {
    return this.bytes;
  }

  /** A frame if it is here; if not, it is fetched. */
  get(frame: number): ArrayBuffer | null {
    const number = Math.floor(frame / CHUNK);
    const chunk = this.chunks.get(number);
    const found = chunk?.[frame % CHUNK] ?? null;
    if (chunk !== undefined) {
      this.chunks.delete(number);
      this.chunks.set(number, chunk);
    }
    if (found === null) this.want(number);
    return found;
  }

  /** Fetches ahead, in the direction of play. */
  prefetch(frame: number, direction: 1 | -1): void {
    const next = Math.floor(frame / CHUNK) + direction;
    if (next >= 0 && next * CHUNK < this.frames && !this.chunks.has(next)) this.want(next);
  }

  private want(number: number): void {
    if (this.underWay.has(number) || performance.now() < (this.notBefore.get(number) ?? 0)) return;
    const from = number * CHUNK;
    const count = Math.min(CHUNK, this.frames - from);
    if (count <= 0) return;
    const fetched = this.fetchFrames(from, count)
      .then((frames) => {
        // Fewer than asked for: the log is still being computed again.
        if (frames.length < count) this.notBefore.set(number, performance.now() + RETRY_MS);
        if (frames.length > 0) {
          this.put(number, frames);
          this.onFrames();
        }
      })
      .catch((error: unknown) => {
        this.notBefore.set(number, performance.now() + 4 * RETRY_MS);
        this.onFailure(error);
      })
      .finally(() => this.underWay.delete(number));
    this.underWay.set(number, fetched);
  }

  private put(number: number, frames: ArrayBuffer[]): void {
    this.drop(number);
    this.chunks.set(number, frames);
    this.bytes += bytesOf(frames);
    for (const oldest of this.chunks.keys()) {
      if (this.bytes <= this.mostBytes || oldest === number) break;
      this.drop(oldest);
    }
  }

  private drop(number: number): void {
    const frames = this.chunks.get(number);
    if (frames === undefined) return;
    this.bytes -= bytesOf(frames);
    this.chunks.delete(number);
  }
}

function bytesOf(frames: readonly ArrayBuffer[]): number {
  return frames.reduce((sum, frame) => sum + frame.byteLength, 0);
}
