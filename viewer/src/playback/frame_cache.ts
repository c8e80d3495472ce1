// Frame cache of a log: fetches chunks and evicts the least recently used ones above a memory limit.

export type FetchFrames = (from: number, count: number) => Promise<ArrayBuffer[]>;

export const CHUNK = 60;
const MAX_BYTES = 192e6;
const RETRY_MS = 400;

export class FrameCache {
  /** Chunks by number, least recently used first. */
  private readonly chunks = new Map<number, ArrayBuffer[]>();
  private readonly pending = new Map<number, Promise<void>>();
  private readonly notBefore = new Map<number, number>();
  private bytes = 0;
  onFrames: () => void = () => undefined;
  onFailure: (error: unknown) => void = () => undefined;

  constructor(
    private readonly fetchFrames: FetchFrames,
    public frames: number,
    private readonly maxBytes = MAX_BYTES,
  ) {}

  get size(): number {
    return this.bytes;
  }

  /** Cached frame, or null; a missing frame is requested. */
  get(frame: number): ArrayBuffer | null {
    const number = Math.floor(frame / CHUNK);
    const chunk = this.chunks.get(number);
    const found = chunk?.[frame % CHUNK] ?? null;
    if (chunk !== undefined) {
      this.chunks.delete(number);
      this.chunks.set(number, chunk);
    }
    if (found === null) this.request(number);
    return found;
  }

  /** Requests the next chunk in the playback direction. */
  prefetch(frame: number, direction: 1 | -1): void {
    const next = Math.floor(frame / CHUNK) + direction;
    if (next >= 0 && next * CHUNK < this.frames && !this.chunks.has(next)) this.request(next);
  }

  private request(number: number): void {
    if (this.pending.has(number) || performance.now() < (this.notBefore.get(number) ?? 0)) return;
    const from = number * CHUNK;
    const count = Math.min(CHUNK, this.frames - from);
    if (count <= 0) return;
    const fetched = this.fetchFrames(from, count)
      .then((frames) => {
        // Fewer than requested: the log is still being recomputed.
        if (frames.length < count) this.notBefore.set(number, performance.now() + RETRY_MS);
        if (frames.length > 0) {
          this.store(number, frames);
          this.onFrames();
        }
      })
      .catch((error: unknown) => {
        this.notBefore.set(number, performance.now() + 4 * RETRY_MS);
        this.onFailure(error);
      })
      .finally(() => this.pending.delete(number));
    this.pending.set(number, fetched);
  }

  private store(number: number, frames: ArrayBuffer[]): void {
    this.remove(number);
    this.chunks.set(number, frames);
    this.bytes += bytesOf(frames);
    for (const oldest of this.chunks.keys()) {
      if (this.bytes <= this.maxBytes || oldest === number) break;
      this.remove(oldest);
    }
  }

  private remove(number: number): void {
    const frames = this.chunks.get(number);
    if (frames === undefined) return;
    this.bytes -= bytesOf(frames);
    this.chunks.delete(number);
  }
}

function bytesOf(frames: readonly ArrayBuffer[]): number {
  return frames.reduce((sum, frame) => sum + frame.byteLength, 0);
}
