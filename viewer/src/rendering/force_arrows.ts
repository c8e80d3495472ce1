// Force arrows at the points of application: a thick arrow for the resultant of each pair, thin ones per contact.

import { Color, Vector3 } from "three";
import { formatForce } from "../format";
import type { ColliderKind, Frame } from "../protocol/frame";
import type { Arrow } from "./arrows";
import type { Palette } from "./colours";

export interface Label {
  at: Vector3;
  text: string;
  colour: string;
}

export interface Resultant {
  object: number;
  collider: ColliderKind;
  index: number;
  point: Vector3;
  force: Vector3;
  count: number;
}

/** Resultants per object and collider, at the force-weighted mean of the contact points. */
export function resultants(frame: Frame): Resultant[] {
  const found = new Map<string, Resultant & { weight: number }>();
  for (const contact of frame.contacts) {
    const key = `${contact.object} ${contact.collider} ${contact.colliderIndex}`;
    let sum = found.get(key);
    if (sum === undefined) {
      const { object, collider, colliderIndex: index } = contact;
      sum = { object, collider, index, point: new Vector3(), force: new Vector3(), count: 0, weight: 0 };
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

/** Largest displayed force [N]; sets the arrow scale. */
export function largestForce(frame: Frame): number {
  const onDevices = frame.devices.map((device) => Math.hypot(...device.force));
  return Math.max(0, ...onDevices, ...resultants(frame).map((sum) => sum.force.length()));
}

export interface ForceDrawing {
  arrows: Arrow[];
  dots: { at: Vector3; colour: Color; radius: number }[];
  labels: Label[];
}

/** Forces below this fraction of the range are not drawn. */
const MIN_FRACTION = 0.004;

/** Arrows, dots and labels of a frame; an arrow of `range` [N] has the length `longest` [m]. */
export function drawForces(frame: Frame, shown: readonly boolean[], range: number, longest: number, palette: Palette): ForceDrawing {
  const drawn: ForceDrawing = { arrows: [], dots: [], labels: [] };
  const onObject = new Color(palette.onObject);
  const onDevice = new Color(palette.onDevice);
  const shaftRadius = 0.024 * longest;
  const tip = (from: Vector3, force: Vector3) => from.clone().addScaledVector(force, longest / range);
  const all = resultants(frame);
  for (const contact of frame.contacts) {
    drawn.dots.push({ at: new Vector3(...contact.point), colour: onObject, radius: 0.9 * shaftRadius });
  }
  for (const sum of all) {
    if (sum.force.length() < MIN_FRACTION * range) continue;
    const to = tip(sum.point, sum.force);
    drawn.arrows.push({ from: sum.point, to, colour: onObject, radius: shaftRadius });
    // The device arrow shows this number.
    if (sum.collider !== "device") drawn.labels.push({ at: to, text: formatForce(sum.force.length()), colour: palette.onObject });
  }
  if (frame.contacts.length > all.length) {
    for (const contact of frame.contacts) {
      const from = new Vector3(...contact.point);
      const force = new Vector3(...contact.force);
      if (force.length() < 4 * MIN_FRACTION * range) continue;
      drawn.arrows.push({ from, to: tip(from, force), colour: onObject, radius: 0.4 * shaftRadius });
    }
  }
  frame.devices.forEach((device, i) => {
    const force = new Vector3(...device.force);
    if (!shown[i] || force.length() < MIN_FRACTION * range) return;
    const from = new Vector3(...device.proxy);
    const to = tip(from, force);
    drawn.arrows.push({ from, to, colour: onDevice, radius: shaftRadius });
    drawn.labels.push({ at: to, text: formatForce(force.length()), colour: palette.onDevice });
  });
  return drawn;
}
