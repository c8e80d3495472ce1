// Force vectors at the points of application: a thick arrow for the resultant of each pair; where contact points are shown, thin ones for each.

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

/** Resultant of all contacts of a pair: the force [N] on `object`. */
export interface Resultant {
  object: number;
  collider: ColliderKind;
  index: number;
  point: Vector3;
  force: Vector3;
  count: number;
}

/**
 * Resultants per pair, at the force-weighted mean of the contact points. Two objects have contacts in both directions, nodes of either on faces of
 * the other: their resultant is the force on the object with the higher number.
 */
export function resultants(frame: Frame): Resultant[] {
  const found = new Map<string, Resultant & { weight: number }>();
  for (const contact of frame.contacts) {
    const { collider } = contact;
    const opposite = collider === "object" && contact.colliderIndex > contact.object;
    const object = opposite ? contact.colliderIndex : contact.object;
    const index = opposite ? contact.object : contact.colliderIndex;
    const key = `${object} ${collider} ${index}`;
    let sum = found.get(key);
    if (sum === undefined) {
      sum = { object, collider, index, point: new Vector3(), force: new Vector3(), count: 0, weight: 0 };
      found.set(key, sum);
    }
    const weight = Math.hypot(...contact.force);
    sum.point.addScaledVector(new Vector3(...contact.point), weight);
    sum.force.addScaledVector(new Vector3(...contact.force), opposite ? -1 : 1);
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

/** Number of contacts with an arrow of their own, strongest first. */
const MAX_CONTACT_ARROWS = 64;

/** Arrows, dots and labels of a frame, with its single contacts where `contactPoints`; an arrow of `range` [N] has the length `longest` [m]. */
export function drawForces(frame: Frame, shown: readonly boolean[], contactPoints: boolean, range: number, longest: number, palette: Palette): ForceDrawing {
  const drawn: ForceDrawing = { arrows: [], dots: [], labels: [] };
  const onObject = new Color(palette.onObject);
  const onDevice = new Color(palette.onDevice);
  const shaftRadius = 0.024 * longest;
  const tip = (from: Vector3, force: Vector3) => from.clone().addScaledVector(force, longest / range);
  const all = resultants(frame);
  for (const contact of contactPoints ? frame.contacts : []) {
    drawn.dots.push({ at: new Vector3(...contact.point), colour: onObject, radius: 0.9 * shaftRadius });
  }
  for (const sum of all) {
    if (sum.force.length() < MIN_FRACTION * range) continue;
    const to = tip(sum.point, sum.force);
    drawn.arrows.push({ from: sum.point, to, colour: onObject, radius: shaftRadius });
    // The device arrow shows this number.
    if (sum.collider !== "device") drawn.labels.push({ at: to, text: formatForce(sum.force.length()), colour: palette.onObject });
  }
  if (contactPoints && frame.contacts.length > all.length) {
    const strongest = frame.contacts
      .map(({ point, force }) => ({ from: new Vector3(...point), force: new Vector3(...force) }))
      .filter(({ force }) => force.length() >= 4 * MIN_FRACTION * range)
      .sort((a, b) => b.force.lengthSq() - a.force.lengthSq())
      .slice(0, MAX_CONTACT_ARROWS);
    for (const { from, force } of strongest) {
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
