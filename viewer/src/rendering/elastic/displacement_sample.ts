// Estimate of the largest displacement of an object on the CPU, from a subset of its nodes.

import type { ModalShape } from "../../protocol/frame";
import type { ModeShapes } from "../../protocol/surface";
import { halfFloatTable } from "./half_float";

const MAX_NODES = 400;

export class DisplacementSample {
  private readonly nodes: number;
  /** Mode shapes of the sampled nodes, by mode. */
  private readonly shapes: Float32Array;

  constructor(
    shapes: ModeShapes,
    private readonly modes = shapes.modes,
  ) {
    const every = Math.max(1, Math.ceil(shapes.nodes / MAX_NODES));
    const numbers = halfFloatTable();
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

  /** Largest modal displacement of the sampled nodes, or largest residual displacement component [m]. */
  largest(shape: ModalShape): number {
    const moved = new Float32Array(3 * this.nodes);
    for (let mode = 0; mode < Math.min(this.modes, shape.q.length); mode++) {
      const q = shape.q[mode];
      const from = 3 * this.nodes * mode;
      for (let i = 0; i < moved.length; i++) moved[i] += q * this.shapes[from + i];
    }
    let square = 0;
    for (let i = 0; i < moved.length; i += 3) square = Math.max(square, moved[i] ** 2 + moved[i + 1] ** 2 + moved[i + 2] ** 2);
    let residual = 0;
    for (const part of shape.residuals) residual = Math.max(residual, Math.abs(part));
    return Math.max(Math.sqrt(square), residual * shape.residualUnit);
  }
}
