// Arrows of forces: each begins where the force acts. What many contacts with one partner add up to is one thick arrow.

import { Color, Vector3 } from "three";
import { forceReading } from "../format";
import type { Partner, Picture } from "../protocol/picture";
import type { Arrow } from "./arrows";
import type { Palette } from "./colours";

export interface Label {
  at: Vector3;
  text: string;
  colour: string;
}

export interface Resultant {
  object: number;
  partner: Partner;
  number: number;
  point: Vector3;
  force: Vector3;
  count: number;
}

/** The forces of all contacts of one object with one partner, at the mean of their points weighted by force. */
export function resultants(picture: Picture): Resultant[] {
  const found = new Map<string, Resultant & { weight: number }>();
  for (const contact of picture.contacts) {
    const key = `${contact.object} ${contact.partner} ${contact.partnerNumber}`;
    let sum = found.get(key);
    if (sum === undefined) {
      const { object, partner, partnerNumber: number } = contact;
      sum = { object, partner, number, point: new Vector3(), force: new Vector3(), count: 0, weight: 0 };
      found.set(key, sum);
    }
    const weight = Math.hypot(...contact.force);
    sum.point.addScaledVector(new Vector3(...contact.point), weight);
    sum.force.add(new Vector3(...contact.force));
    sum.weight += weight;
    sum.count++;
  }
  return [...found.values()].map(({ weight, ...sum }) => {
    if (weight > 0) sum.point.divideScalar(weight);
    return sum;
  });
}

/** The largest force that is drawn [N]: the arrows' scale follows it. */
export function largestForce(picture: Picture): number {
  const onHands = picture.devices.map((device) => Math.hypot(...device.force));
  return Math.max(0, ...onHands, ...resultants(picture).map((sum) => sum.force.length()));
}

export interface Drawn {
  arrows: Arrow[];
  dots: { at: Vector3; colour: Color; radius: number }[];
  labels: Label[];
}

const FAINTEST = 0.004;

/** `longest` [m] is how long an arrow of `range` newtons is. */
export function drawForces(picture: Picture, shown: readonly boolean[], range: number, longest: number, palette: Palette): Drawn {
  const drawn: Drawn = { arrows: [], dots: [], labels: [] };
  const onObject = new Color(palette.onObject);
  const onHand = new Color(palette.onHand);
  const thick = 0.024 * longest;
  const tip = (from: Vector3, force: Vector3) => from.clone().addScaledVector(force, longest / range);
  const all = resultants(picture);
  for (const contact of picture.contacts) {
    drawn.dots.push({ at: new Vector3(...contact.point), colour: onObject, radius: 0.9 * thick });
  }
  for (const sum of all) {
    if (sum.force.length() < FAINTEST * range) continue;
    const to = tip(sum.point, sum.force);
    drawn.arrows.push({ from: sum.point, to, colour: onObject, radius: thick });
    // The same number stands at the finger.
    if (sum.partner !== "device") drawn.labels.push({ at: to, text: forceReading(sum.force.length()), colour: palette.onObject });
  }
  if (picture.contacts.length > all.length) {
    for (const contact of picture.contacts) {
      const from = new Vector3(...contact.point);
      const force = new Vector3(...contact.force);
      if (force.length() < 4 * FAINTEST * range) continue;
      drawn.arrows.push({ from, to: tip(from, force), colour: onObject, radius: 0.4 * thick });
    }
  }
  picture.devices.forEach((device, i) => {
    const force = new Vector3(...device.force);
    if (!shown[i] || force.length() < FAINTEST * range) return;
    const from = new Vector3(...device.proxy);
    const to = tip(from, force);
    drawn.arrows.push({ from, to, colour: onHand, radius: thick });
    drawn.labels.push({ at: to, text: forceReading(force.length()), colour: palette.onHand });
  });
  return drawn;
}
