// Hands in VR as pointers: the tip of each touches the scene while it is tracked.

import type { Vector3 } from "three";
import type { ClientMessage } from "../protocol/messages";

/** Numbers of the pointers of two hands. */
export const HAND_POINTERS = { first: 13, count: 2 };

export class VrHands {
  private readonly pressed = [false, false];
  private readonly slots: (number | null)[] = [null, null];
  private ready = false;

  constructor(private readonly send: (message: ClientMessage) => void) {}

  /** Device slots of the hands. */
  get devices(): number[] {
    return this.slots.filter((slot) => slot !== null);
  }

  /** Moves the tips of the left and the right hand [world]; null for one that is not tracked. */
  move(tips: readonly (Vector3 | null)[]): void {
    if (!this.ready) return;
    const pointers: { pointer: number; position: [number, number, number] }[] = [];
    tips.forEach((tip, hand) => {
      const pointer = HAND_POINTERS.first + hand;
      if (tip === null) {
        this.release(hand);
      } else if (this.pressed[hand]) {
        pointers.push({ pointer, position: tip.toArray() });
      } else {
        this.pressed[hand] = true;
        this.send({ type: "press", pointer, mode: "touch", position: tip.toArray() });
      }
    });
    if (pointers.length > 0) this.send({ type: "move", pointers });
  }

  /** Takes both hands out of the scene. */
  end(): void {
    this.pressed.forEach((_, hand) => this.release(hand));
  }

  private release(hand: number): void {
    if (this.pressed[hand]) this.send({ type: "release", pointer: HAND_POINTERS.first + hand });
    this.pressed[hand] = false;
    this.slots[hand] = null;
  }

  assign(pointer: number, device: number | null): void {
    const hand = pointer - HAND_POINTERS.first;
    if (this.pressed[hand]) this.slots[hand] = device;
  }

  /** Lets the hands wait for the next frame of a scene that begins: its pointers are free. */
  suspend(): void {
    this.ready = false;
    this.pressed.fill(false);
    this.slots.fill(null);
  }

  resume(): void {
    this.ready = true;
  }
}
