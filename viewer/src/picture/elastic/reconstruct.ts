// The deformed surface on the CPU: for the plain stream of vertices, and to check the GPU by a second route.
//
// places  pᵢ = restᵢ + Σₖ qₖ·shapeₖᵢ + dentᵢ·unit    [m, body]
// normals nᵥ ∝ Σ over the ring of (a − p) × (b − p)
// strain  of a triangle with edges E (rest) and e (deformed): the largest |λ| with (½(eᵀe − EᵀE))·x = λ·EᵀE·x,
//         as change of length √(1 + 2λ) − 1; of a vertex: the mean over its ring, weighted by area at rest

import type { ModalShape } from "../../protocol/picture";
import type { Shapes, Surface } from "../../protocol/surface";
import type { Smooth } from "./creases";
import { halfTable } from "./half";

export function placesOf(surface: Surface, shapes: Shapes, shape: ModalShape): Float32Array {
  const places = surface.positions.slice();
  const numbers = halfTable();
  const modes = Math.min(shapes.modes, shape.q.length);
  for (let mode = 0; mode < modes; mode++) {
    const q = shape.q[mode];
    if (q === 0) continue;
    const from = 3 * surface.nodes * mode;
    for (let i = 0; i < places.length; i++) places[i] += q * numbers[shapes.halves[from + i]];
  }
  for (let i = 0; i < shape.nodes.length; i++) {
    const node = 3 * shape.nodes[i];
    for (let k = 0; k < 3; k++) places[node + k] += shape.dents[3 * i + k] * shape.unit;
  }
  return places;
}

/** The change of length of one triangle, of the direction where it is largest; both edges from the same corner. */
export function triangleStrain(rest: readonly number[], now: readonly number[]): number {
  const [E, F, G] = [dot(rest, 0, 0), dot(rest, 0, 3), dot(rest, 3, 3)];
  const [e, f, g] = [dot(now, 0, 0), dot(now, 0, 3), dot(now, 3, 3)];
  const area = E * G - F * F;
  if (!(area > 1e-12 * E * G)) return 0;
  // Eigenvalues of (EᵀE)⁻¹·½(eᵀe − EᵀE) from its trace and determinant.
  const [a, b, c] = [(e - E) / 2, (f - F) / 2, (g - G) / 2];
  const half = (a * G - 2 * b * F + c * E) / area / 2;
  const root = Math.sqrt(Math.max(0, half * half - (a * c - b * b) / area));
  const stretch = (lambda: number) => Math.abs(Math.sqrt(Math.max(0, 1 + 2 * lambda)) - 1);
  return Math.max(stretch(half + root), stretch(half - root));
}

function dot(edges: readonly number[], i: number, j: number): number {
  return edges[i] * edges[j] + edges[i + 1] * edges[j + 1] + edges[i + 2] * edges[j + 2];
}

/** Normal and strain of each vertex, four numbers each. */
export function normalsOf(surface: Surface, smooth: Smooth, places: Float32Array, into: Float32Array): void {
  const rest = surface.positions;
  const [restEdges, edges] = [new Array<number>(6), new Array<number>(6)];
  for (let vertex = 0; vertex < smooth.vertices; vertex++) {
    const node = 3 * smooth.node[vertex];
    let [x, y, z, strain, area] = [0, 0, 0, 0, 0];
    for (let t = smooth.ringStart[vertex]; t < smooth.ringStart[vertex + 1]; t++) {
      const a = 3 * smooth.ring[2 * t];
      const b = 3 * smooth.ring[2 * t + 1];
      for (let k = 0; k < 3; k++) {
        edges[k] = places[a + k] - places[node + k];
        edges[3 + k] = places[b + k] - places[node + k];
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
