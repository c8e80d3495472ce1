// How far an object is deformed at most, nearly, at once and without asking the GPU: some of its nodes stand for all.

import type { ModalShape } from "../../protocol/picture";
import type { Shapes } from "../../protocol/surface";
import { halfTable } from "./half";

const MOST_NODES = 400;

export class Sample {
  private readonly nodes: number;
  /** Shapes of these nodes, mode by mode. */
  private readonly shapes: Float32Array;

  constructor(
    shapes: Shapes,
    private readonly modes = shapes.modes,
  ) {
    const every = Math.max(1, Math.ceil(shapes.nodes / MOST_NODES));
    const numbers = halfTable();
    this.nodes = Math.ceil(shapes.nodes / every);
    this.shapes = new Float32Array(3 * this.nodes * modes);
    for (let mode = 0; mode < modes; mode++) {
      for (let i = 0; i < this.nodes; i++) {
        for (let k = 0; k < 3; k++) {
          this.shapes[3 * (mode * this.nodes + i) + k] = numbers[shapes.halves[3 * (mode * shapes.nodes + i * every) + k]];
        }
      }
    }
  }

  /** The largest displacement [m] of these nodes by the modes, or of a dent alone. */
  largest(shape: ModalShape): number {
    const moved = new Float32Array(3 * this.nodes);
    for (let mode = 0; mode < Math.min(this.modes, shape.q.length); mode++) {
      const q = shape.q[mode];
      const from = 3 * this.nodes * mode;
      for (let i = 0; i < moved.length; i++) moved[i] += q * this.shapes[from + i];
    }
    let square = 0;
    for (let i = 0; i < moved.length; i += 3) square = Math.max(square, moved[i] ** 2 + moved[i + 1] ** 2 + moved[i + 2] ** 2);
    let dent = 0;
    for (const part of shape.dents) dent = Math.max(dent, Math.abs(part));
    return Math.max(Math.sqrt(square), dent * shape.unit);
  }
}
