// Ticker of the worker's steps: sleeps to a deadline, with a look at the messages of the page before each step.

/** Longest sleep that holds messages up [ms]. */
const MAX_SLEEP_MS = 2;

/**
 * Calls a function again and again, each time at the deadline that it returned [s, performance.now].
 *
 * Timers of a browser wake every 4 ms at best. A wait on shared memory is exact to some tens of microseconds; where a page may have none, steps
 * come in bursts of four.
 */
export class Ticker {
  private readonly cell = sharedCell();
  private readonly channel = new MessageChannel();
  private running = false;
  private round = 0;

  constructor(private readonly tick: () => number) {
    this.channel.port1.onmessage = (event: MessageEvent<number>) => this.run(event.data);
  }

  start(): void {
    if (this.running) return;
    this.running = true;
    // One that was stopped a moment ago may have a call under way.
    this.round += 1;
    this.channel.port2.postMessage(this.round);
  }

  stop(): void {
    this.running = false;
  }

  private run(round: number): void {
    if (!this.running || round !== this.round) return;
    const wait = 1000 * this.tick() - performance.now();
    if (wait > MAX_SLEEP_MS || (this.cell === null && wait > 0)) {
      setTimeout(() => this.channel.port2.postMessage(round), wait - 1);
      return;
    }
    if (wait > 0 && this.cell !== null) Atomics.wait(this.cell, 0, 0, wait);
    this.channel.port2.postMessage(round);
  }
}

/** Shared memory to wait on, or null where the browser gives none. */
function sharedCell(): Int32Array | null {
  try {
    const memory = new WebAssembly.Memory({ initial: 1, maximum: 1, shared: true });
    const cell = new Int32Array(memory.buffer);
    Atomics.wait(cell, 0, 0, 0);
    return cell;
  } catch {
    return null;
  }
}
