// 2D overlay: force labels, colour bar, force scale, time. On its own canvas, so that `palpate render` includes it.

import type { PerspectiveCamera, Vector3 } from "three";
import { digits, seconds, withUnit } from "../format";
import { RAMP, type ColourMode, type Palette } from "./colours";
import type { Label } from "./force_arrows";

export const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", sans-serif';

export interface Rectangle {
  x: number;
  y: number;
  width: number;
  height: number;
}

const MARGIN = 14;

/** Text scale, growing with the viewport height. */
function textScale(viewport: Rectangle): number {
  return Math.min(1.6, Math.max(1, viewport.height / 850));
}
const BAR_WIDTH = 168;
const BAR_HEIGHT = 10;

function outlinedText(context: CanvasRenderingContext2D, text: string, x: number, y: number, colour: string, palette: Palette): void {
  context.lineJoin = "round";
  context.lineWidth = 3.5;
  context.strokeStyle = palette.halo;
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

/** Labels at arrow tips; overlapping labels move up or are omitted. */
export function drawLabels(
  context: CanvasRenderingContext2D,
  labels: readonly Label[],
  camera: PerspectiveCamera,
  viewport: Rectangle,
  palette: Palette,
  keepOut: readonly Rectangle[],
): void {
  const size = textScale(viewport);
  context.font = `600 ${14 * size}px ${FONT}`;
  context.textBaseline = "middle";
  context.textAlign = "left";
  const taken: Rectangle[] = [...keepOut];
  for (const label of labels) {
    const at = (label.at.clone() as Vector3).project(camera);
    if (Math.max(Math.abs(at.x), Math.abs(at.y), Math.abs(at.z)) > 1) continue;
    const width = context.measureText(label.text).width;
    const x = Math.min(viewport.x + viewport.width - width - 6, Math.max(viewport.x + 6, viewport.x + (0.5 + 0.5 * at.x) * viewport.width + 9));
    let y = Math.min(viewport.y + viewport.height - 12, Math.max(viewport.y + 12, viewport.y + (0.5 - 0.5 * at.y) * viewport.height - 9));
    let box = { x: x - 3, y: y - 10 * size, width: width + 6, height: 20 * size };
    for (let tries = 0; tries < 4 && taken.some((other) => overlap(box, other)); tries++) {
      y -= 20 * size;
      box = { ...box, y: y - 10 * size };
    }
    if (y < viewport.y + 10 || taken.some((other) => overlap(box, other))) continue;
    taken.push(box);
    outlinedText(context, label.text, x, y, label.colour, palette);
  }
}

function overlap(a: Rectangle, b: Rectangle): boolean {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

const TITLES: Record<ColourMode, string> = { plain: "", displacement: "Displacement", strain: "Max. principal strain" };

function rangeLabel(mode: ColourMode, value: number): string {
  return mode === "strain" ? `${digits(100 * value, 2)}\u202f%` : withUnit(value, "m", 0, 2);
}

/** Colour bar at the lower left of a viewport [px]. */
export function colourBarBox(viewport: Rectangle): Rectangle {
  const size = textScale(viewport);
  const height = BAR_HEIGHT * size;
  return { x: viewport.x + MARGIN, y: viewport.y + viewport.height - MARGIN - 16 * size - height, width: BAR_WIDTH * size, height };
}

/** Draws the colour bar; returns its height with captions [px]. */
export function drawColourBar(context: CanvasRenderingContext2D, mode: ColourMode, range: number, viewport: Rectangle, palette: Palette): number {
  if (mode === "plain" || !(range > 0)) return 0;
  const size = textScale(viewport);
  const { x, y: top, width, height } = colourBarBox(viewport);
  const y = top + height;
  const gradient = context.createLinearGradient(x, 0, x + width, 0);
  RAMP.forEach((colour, i) => gradient.addColorStop(i / (RAMP.length - 1), colour));
  context.font = `500 ${12 * size}px ${FONT}`;
  context.textBaseline = "alphabetic";
  context.textAlign = "left";
  outlinedText(context, TITLES[mode], x, y - height - 6 * size, palette.text, palette);
  context.fillStyle = gradient;
  context.beginPath();
  context.roundRect(x, y - height, width, height, 3);
  context.fill();
  context.strokeStyle = "#00000040";
  context.lineWidth = 1;
  context.stroke();
  for (const [share, align] of [
    [0, "left"],
    [0.5, "center"],
    [1, "right"],
  ] as const) {
    context.textAlign = align;
    outlinedText(context, share === 0 ? "0" : rangeLabel(mode, share * range), x + share * width, y + 14 * size, palette.text, palette);
  }
  return height + 44 * size;
}

/** Force scale: the arrow length of `newtons`, `pixels` long at the camera target. */
export function drawArrowScale(context: CanvasRenderingContext2D, newtons: number, pixels: number, viewport: Rectangle, above: number, palette: Palette): void {
  const length = Math.min(pixels, 0.4 * viewport.width);
  const share = length / pixels;
  const x = viewport.x + MARGIN;
  const y = viewport.y + viewport.height - MARGIN - above - 4;
  context.strokeStyle = context.fillStyle = palette.onObject;
  context.lineWidth = 3;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + length - 8, y);
  context.stroke();
  context.beginPath();
  context.moveTo(x + length, y);
  context.lineTo(x + length - 11, y - 5);
  context.lineTo(x + length - 11, y + 5);
  context.fill();
  context.font = `500 ${12 * textScale(viewport)}px ${FONT}`;
  context.textAlign = "left";
  context.textBaseline = "middle";
  outlinedText(context, withUnit(share * newtons, "N", 0, 2), x + length + 8, y + 0.5, palette.text, palette);
}

/** Title and time, for images without page. */
export function drawTime(context: CanvasRenderingContext2D, time: number, title: string, viewport: Rectangle, palette: Palette): void {
  context.textBaseline = "top";
  context.textAlign = "left";
  context.font = `600 ${16 * textScale(viewport)}px ${FONT}`;
  outlinedText(context, title, viewport.x + MARGIN, viewport.y + MARGIN, palette.text, palette);
  context.textAlign = "right";
  outlinedText(context, seconds(time), viewport.x + viewport.width - MARGIN, viewport.y + MARGIN, palette.text, palette);
}
