// Surfaces and mode shapes, fetched once per scene (docs/viewer-protocol.md, "Surfaces and mode shapes").

import { DecodeError } from "./frame";

export interface Surface {
  nodes: number;
  /** Rest positions [m, body], three numbers per node. */
  positions: Float32Array;
  /** Three node indices per triangle, counterclockwise seen from outside. */
  indices: Uint32Array;
}

export interface ModeShapes {
  nodes: number;
  modes: number;
  /** Natural frequencies [Hz]. */
  frequencies: Float32Array;
  /** Half floats by mode, three per node. */
  halves: Uint16Array;
}

export function decodeSurface(buffer: ArrayBuffer): Surface {
  if (buffer.byteLength < 8) throw new DecodeError("a surface of less than 8 bytes");
  const [nodes, triangles] = new Uint32Array(buffer, 0, 2);
  if (buffer.byteLength !== 8 + 12 * nodes + 12 * triangles) {
    throw new DecodeError(`a surface of ${nodes} nodes and ${triangles} triangles in ${buffer.byteLength} bytes`);
  }
  const positions = new Float32Array(buffer, 8, 3 * nodes);
  const indices = new Uint32Array(buffer, 8 + 12 * nodes, 3 * triangles);
  for (const corner of indices) {
    if (corner >= nodes) throw new DecodeError(`a triangle of node ${corner} of ${nodes}`);
  }
  return { nodes, positions, indices };
}

export function decodeModeShapes(buffer: ArrayBuffer): ModeShapes {
  if (buffer.byteLength < 8) throw new DecodeError("shapes of less than 8 bytes");
  const [nodes, modes] = new Uint32Array(buffer, 0, 2);
  const bytes = 8 + 4 * modes + 6 * nodes * modes;
  // Padded to a multiple of 4.
  if (buffer.byteLength < bytes || buffer.byteLength > bytes + 3) {
    throw new DecodeError(`${modes} shapes of ${nodes} nodes in ${buffer.byteLength} bytes`);
  }
  const frequencies = new Float32Array(buffer, 8, modes);
  const halves = new Uint16Array(buffer, 8 + 4 * modes, 3 * nodes * modes);
  return { nodes, modes, frequencies, halves };
}
