// Pace of a scene against real time, from the number of steps in its status messages:
//   pace = slowdown · step · Δsteps / Δwall

import type { Status } from "../protocol/messages";
import { digits, slowdownLabel } from "../format";

/** Time over which it is measured [s]: longer than the scatter of messages. */
const WINDOW_S = 3;
/** Silence after which it begins again [s]: the page stalled, and messages that waited would look like a slow scene. */
const MAX_GAP_S = 1.2;
/** Pace below which the page tells it. */
const SLOW = 0.95;

interface Sample {
  wall: number;
  steps: number;
}

/** Measurement of the pace. */
export class Pace {
  private samples: Sample[] = [];
  private valid = "";

  /** Adds a status that came at the time `now` [s]; returns the pace, 1 in real time, or null if it is not known. */
  update(status: Pick<Status, "generation" | "paused" | "slowdown" | "steps">, step_s: number, now: number): number | null {
    const { generation, paused, slowdown, steps } = status;
    const valid = `${generation} ${slowdown} ${step_s}`;
    const gap = now - (this.samples.at(-1)?.wall ?? now);
    if (paused || valid !== this.valid || gap > MAX_GAP_S) this.samples = [];
    this.valid = valid;
    if (paused) return null;
    this.samples.push({ wall: now, steps });
    while (this.samples.length > 2 && this.samples[1].wall <= now - WINDOW_S) this.samples.shift();
    const [first] = this.samples;
    const wall = now - first.wall;
    return wall < WINDOW_S || steps < first.steps ? null : (slowdown * step_s * (steps - first.steps)) / wall;
  }
}

/** Text of a pace that is slower than it should be; null otherwise. */
export function paceText(pace: number | null, slowdown: number): string | null {
  if (pace === null || pace >= SLOW) return null;
  const share = `${digits(pace, pace < 0.1 ? 1 : 2)}×`;
  return slowdown === 1 ? `${share} real time` : `${share} of ${slowdownLabel(slowdown)}`;
}
