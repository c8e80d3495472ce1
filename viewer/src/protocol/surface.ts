// Surfaces and mode shapes, which a page gets once per scene (docs/viewer-protocol.md, "Surfaces and shapes").

import { Unreadable } from "./picture";

export interface Surface {
  nodes: number;
  /** At rest [m, body]. */
  positions: Float32Array;
  /** Three nodes per triangle, counterclockwise seen from outside. */
  corners: Uint32Array;
}

export interface Shapes {
  nodes: number;
  modes: number;
  /** [Hz] */
  frequencies: Float32Array;
  /** Half floats, mode by mode, three per node. */
  halves: Uint16Array;
}

export function readSurface(buffer: ArrayBuffer): Surface {
  if (buffer.byteLength < 8) throw new Unreadable("a surface of less than 8 bytes");
  const [nodes, triangles] = new Uint32Array(buffer, 0, 2);
  if (buffer.byteLength !== 8 + 12 * nodes + 12 * triangles) {
    throw new Unreadable(`a surface of ${nodes} nodes and ${triangles} triangles in ${buffer.byteLength} bytes`);
  }
  const positions = new Float32Array(buffer, 8, 3 * nodes);
  const corners = new Uint32Array(buffer, 8 + 12 * nodes, 3 * triangles);
  for (const corner of corners) {
    if (corner >= nodes) throw new Unreadable(`a triangle of node ${corner} of ${nodes}`);
  }
  return { nodes, positions, corners };
}

export function readShapes(buffer: ArrayBuffer): Shapes {
  if (buffer.byteLength < 8) throw new Unreadable("shapes of less than 8 bytes");
  const [nodes, modes] = new Uint32Array(buffer, 0, 2);
  const bytes = 8 + 4 * modes + 6 * nodes * modes;
  // The end may be padded to a multiple of 4.
  if (buffer.byteLength < bytes || buffer.byteLength > bytes + 3) {
    throw new Unreadable(`${modes} shapes of ${nodes} nodes in ${buffer.byteLength} bytes`);
  }
  const frequencies = new Float32Array(buffer, 8, modes);
  const halves = new Uint16Array(buffer, 8 + 4 * modes, 3 * nodes * modes);
  return { nodes, modes, frequencies, halves };
}
