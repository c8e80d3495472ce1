// What is written over a picture: numbers at arrows, the colour bar, the time. On a canvas of its own, so that it is
// in the pictures of `palpate render` too.

import type { PerspectiveCamera, Vector3 } from "three";
import { digits, seconds, withUnit } from "../format";
import { RAMP, type ColourMode, type Palette } from "./colours";
import type { Label } from "./forces";

export const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", sans-serif';

export interface Rectangle {
  x: number;
  y: number;
  width: number;
  height: number;
}

const MARGIN = 14;

/** What is written grows a little with the picture. */
function sizeIn(view: Rectangle): number {
  return Math.min(1.6, Math.max(1, view.height / 850));
}
const BAR_WIDTH = 168;
const BAR_HEIGHT = 10;

function haloed(pen: CanvasRenderingContext2D, text: string, x: number, y: number, colour: string, palette: Palette): void {
  pen.lineJoin = "round";
  pen.lineWidth = 3.5;
  pen.strokeStyle = palette.halo;
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

/** Numbers at the ends of arrows; those that would lie on others move up, or are left out. */
export function drawLabels(
  pen: CanvasRenderingContext2D,
  labels: readonly Label[],
  camera: PerspectiveCamera,
  view: Rectangle,
  palette: Palette,
  keepOut: readonly Rectangle[],
): void {
  const size = sizeIn(view);
  pen.font = `600 ${14 * size}px ${FONT}`;
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  const taken: Rectangle[] = [...keepOut];
  for (const label of labels) {
    const at = (label.at.clone() as Vector3).project(camera);
    if (Math.max(Math.abs(at.x), Math.abs(at.y), Math.abs(at.z)) > 1) continue;
    const width = pen.measureText(label.text).width;
    const x = Math.min(view.x + view.width - width - 6, Math.max(view.x + 6, view.x + (0.5 + 0.5 * at.x) * view.width + 9));
    let y = Math.min(view.y + view.height - 12, Math.max(view.y + 12, view.y + (0.5 - 0.5 * at.y) * view.height - 9));
    let box = { x: x - 3, y: y - 10 * size, width: width + 6, height: 20 * size };
    for (let tries = 0; tries < 4 && taken.some((other) => overlap(box, other)); tries++) {
      y -= 20 * size;
      box = { ...box, y: y - 10 * size };
    }
    if (y < view.y + 10 || taken.some((other) => overlap(box, other))) continue;
    taken.push(box);
    haloed(pen, label.text, x, y, label.colour, palette);
  }
}

function overlap(a: Rectangle, b: Rectangle): boolean {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

const TITLES: Record<ColourMode, string> = { plain: "", displacement: "moved from its shape at rest", strain: "stretch of the surface" };

function reading(mode: ColourMode, value: number): string {
  return mode === "strain" ? `${digits(100 * value, 2)}\u202f%` : withUnit(value, "m", 0, 2);
}

/** The colour bar at the lower left; says how much room it has taken. */
export function drawColourBar(pen: CanvasRenderingContext2D, mode: ColourMode, range: number, view: Rectangle, palette: Palette): number {
  if (mode === "plain" || !(range > 0)) return 0;
  const size = sizeIn(view);
  const width = BAR_WIDTH * size;
  const height = BAR_HEIGHT * size;
  const x = view.x + MARGIN;
  const y = view.y + view.height - MARGIN - 16 * size;
  const gradient = pen.createLinearGradient(x, 0, x + width, 0);
  RAMP.forEach((colour, i) => gradient.addColorStop(i / (RAMP.length - 1), colour));
  pen.font = `500 ${12 * size}px ${FONT}`;
  pen.textBaseline = "alphabetic";
  pen.textAlign = "left";
  haloed(pen, TITLES[mode], x, y - height - 6 * size, palette.text, palette);
  pen.fillStyle = gradient;
  pen.beginPath();
  pen.roundRect(x, y - height, width, height, 3);
  pen.fill();
  pen.strokeStyle = "#00000040";
  pen.lineWidth = 1;
  pen.stroke();
  for (const [share, align] of [
    [0, "left"],
    [0.5, "center"],
    [1, "right"],
  ] as const) {
    pen.textAlign = align;
    haloed(pen, share === 0 ? "0" : reading(mode, share * range), x + share * width, y + 14 * size, palette.text, palette);
  }
  return height + 44 * size;
}

/** How long an arrow of how many newtons is. `pixels` per newton, where the camera looks. */
export function drawArrowScale(pen: CanvasRenderingContext2D, newtons: number, pixels: number, view: Rectangle, above: number, palette: Palette): void {
  const length = Math.min(pixels, 0.4 * view.width);
  const share = length / pixels;
  const x = view.x + MARGIN;
  const y = view.y + view.height - MARGIN - above - 4;
  pen.strokeStyle = pen.fillStyle = palette.onObject;
  pen.lineWidth = 3;
  pen.beginPath();
  pen.moveTo(x, y);
  pen.lineTo(x + length - 8, y);
  pen.stroke();
  pen.beginPath();
  pen.moveTo(x + length, y);
  pen.lineTo(x + length - 11, y - 5);
  pen.lineTo(x + length - 11, y + 5);
  pen.fill();
  pen.font = `500 ${12 * sizeIn(view)}px ${FONT}`;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  haloed(pen, withUnit(share * newtons, "N", 0, 2), x + length + 8, y + 0.5, palette.text, palette);
}

/** Time and title, in pictures that have nothing around them. */
export function drawTime(pen: CanvasRenderingContext2D, time: number, title: string, view: Rectangle, palette: Palette): void {
  pen.textBaseline = "top";
  pen.textAlign = "left";
  pen.font = `600 ${16 * sizeIn(view)}px ${FONT}`;
  haloed(pen, title, view.x + MARGIN, view.y + MARGIN, palette.text, palette);
  pen.textAlign = "right";
  haloed(pen, seconds(time), view.x + view.width - MARGIN, view.y + MARGIN, palette.text, palette);
}
