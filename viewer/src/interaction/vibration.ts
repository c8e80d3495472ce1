// Vibration of a phone from the contact force: short pulses where the force changes fast, as when a finger meets an object or slips.
// The Vibration API has no strength, so a stronger impact gives a longer pulse.

/** Time constant of the force that a change is measured from [ms]. */
const FOLLOW_MS = 120;
/** Change of the force from which a pulse begins, as a share of the displayed force range. */
const THRESHOLD = 0.03;
/** Shortest pulse that motors of phones make, and the longest, at a change of the whole range [ms]. */
const PULSE_MS: readonly [number, number] = [8, 40];
/** Time between the beginnings of two pulses [ms]. */
const INTERVAL_MS = 90;

/** Pulses of a force in time. */
export class ImpactPulses {
  private followed = 0;
  private at = 0;
  private pulsedAt = Number.NEGATIVE_INFINITY;

  /** Length of the pulse that begins now [ms], or 0. `force`: share of the displayed force range; `now` [ms]. */
  update(force: number, now: number): number {
    if (!Number.isFinite(force)) return 0;
    const change = Math.abs(force - this.followed);
    const share = 1 - Math.exp(-Math.max(0, now - this.at) / FOLLOW_MS);
    this.followed += share * (force - this.followed);
    this.at = now;
    if (change < THRESHOLD || now - this.pulsedAt < INTERVAL_MS) return 0;
    this.pulsedAt = now;
    // The change is felt: the next pulse is that of a further one.
    this.followed = force;
    const [shortest, longest] = PULSE_MS;
    // The root, so that a touch differs from a push though the range is that of the largest blow.
    return Math.round(shortest + (longest - shortest) * Math.sqrt(Math.min(1, change)));
  }
}

/** Whether this device can vibrate. */
export function canVibrate(): boolean {
  return typeof navigator.vibrate === "function";
}

/** Whether vibration is on at first: on touch screens, unless the system asks for reduced motion. */
export function vibratesAtFirst(isTouchScreen: boolean, reducesMotion: boolean): boolean {
  return isTouchScreen && !reducesMotion;
}

/** Vibration of this device while its fingers press. */
export class Vibration {
  private readonly fingers = new Map<number, ImpactPulses>();

  constructor(public on: boolean) {}

  /** `forces`: share of the displayed force range on each device that this page presses with. */
  animate(forces: ReadonlyMap<number, number>, now: number): void {
    for (const device of this.fingers.keys()) if (!forces.has(device)) this.fingers.delete(device);
    let longest = 0;
    for (const [device, force] of forces) {
      const finger = this.fingers.get(device) ?? new ImpactPulses();
      this.fingers.set(device, finger);
      longest = Math.max(longest, finger.update(force, now));
    }
    if (this.on && longest > 0) navigator.vibrate(longest);
  }
}
