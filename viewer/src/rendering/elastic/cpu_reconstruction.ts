// Deformed surface on the CPU: used for the vertex stream, and to verify the GPU reconstruction.
//
// positions  pᵢ = Xᵢ + Σₖ qₖ·φₖᵢ + rᵢ·unit, with rest position X, mode shapes φ, residual displacement r  [m, body]
// normals    nᵥ ∝ Σ over the one-ring of (a − p) × (b − p)
// strain     Green–Lagrange strain of a triangle with edges E (rest) and e (deformed): the largest |λ| with
//            ½(eᵀe − EᵀE)·x = λ·EᵀE·x, given as relative elongation √(1 + 2λ) − 1; of a vertex: the mean over its
//            one-ring, weighted by rest area

import type { ModalShape } from "../../protocol/frame";
import type { ModeShapes, Surface } from "../../protocol/surface";
import type { SplitMesh } from "./split_mesh";
import { halfFloatTable } from "./half_float";

/** Nodal positions from modes and residual displacement [m, body], three numbers per node. */
export function nodalPositions(surface: Surface, shapes: ModeShapes, shape: ModalShape): Float32Array {
  const positions = surface.positions.slice();
  const numbers = halfFloatTable();
  const modes = Math.min(shapes.modes, shape.q.length);
  for (let mode = 0; mode < modes; mode++) {
    const q = shape.q[mode];
    if (q === 0) continue;
    const from = 3 * surface.nodes * mode;
    for (let i = 0; i < positions.length; i++) positions[i] += q * numbers[shapes.halves[from + i]];
  }
  for (let i = 0; i < shape.residualNodes.length; i++) {
    const node = 3 * shape.residualNodes[i];
    for (let k = 0; k < 3; k++) positions[node + k] += shape.residuals[3 * i + k] * shape.residualUnit;
  }
  return positions;
}

/** Largest relative elongation of a triangle; `rest` and `now`: two edges from the same corner, six numbers each. */
export function triangleStrain(rest: readonly number[], now: readonly number[]): number {
  const [E, F, G] = [dot(rest, 0, 0), dot(rest, 0, 3), dot(rest, 3, 3)];
  const [e, f, g] = [dot(now, 0, 0), dot(now, 0, 3), dot(now, 3, 3)];
  const area = E * G - F * F;
  if (!(area > 1e-12 * E * G)) return 0;
  // Eigenvalues of (EᵀE)⁻¹·½(eᵀe − EᵀE) from trace and determinant.
  const [a, b, c] = [(e - E) / 2, (f - F) / 2, (g - G) / 2];
  const half = (a * G - 2 * b * F + c * E) / area / 2;
  const root = Math.sqrt(Math.max(0, half * half - (a * c - b * b) / area));
  const elongation = (lambda: number) => Math.abs(Math.sqrt(Math.max(0, 1 + 2 * lambda)) - 1);
  return Math.max(elongation(half + root), elongation(half - root));
}

function dot(edges: readonly number[], i: number, j: number): number {
  return edges[i] * edges[j] + edges[i + 1] * edges[j + 1] + edges[i + 2] * edges[j + 2];
}

/** Unit normal and strain of each vertex, four numbers each. */
export function vertexNormals(surface: Surface, splitMesh: SplitMesh, positions: Float32Array, into: Float32Array): void {
  const rest = surface.positions;
  const [restEdges, edges] = [new Array<number>(6), new Array<number>(6)];
  for (let vertex = 0; vertex < splitMesh.vertices; vertex++) {
    const node = 3 * splitMesh.node[vertex];
    let [x, y, z, strain, area] = [0, 0, 0, 0, 0];
    for (let t = splitMesh.ringStart[vertex]; t < splitMesh.ringStart[vertex + 1]; t++) {
      const a = 3 * splitMesh.ring[2 * t];
      const b = 3 * splitMesh.ring[2 * t + 1];
      for (let k = 0; k < 3; k++) {
        edges[k] = positions[a + k] - positions[node + k];
        edges[3 + k] = positions[b + k] - positions[node + k];
        restEdges[k] = rest[a + k] - rest[node + k];
        restEdges[3 + k] = rest[b + k] - rest[node + k];
      }
      x += edges[1] * edges[5] - edges[2] * edges[4];
      y += edges[2] * edges[3] - edges[0] * edges[5];
      z += edges[0] * edges[4] - edges[1] * edges[3];
      const weight = Math.sqrt(Math.max(0, dot(restEdges, 0, 0) * dot(restEdges, 3, 3) - dot(restEdges, 0, 3) ** 2));
      strain += weight * triangleStrain(restEdges, edges);
      area += weight;
    }
    const length = Math.hypot(x, y, z) || 1;
    into[4 * vertex] = x / length;
    into[4 * vertex + 1] = y / length;
    into[4 * vertex + 2] = z / length;
    into[4 * vertex + 3] = area > 0 ? strain / area : 0;
  }
}
