// Vertex splitting at creases: nodes on sharp edges get one vertex per smoothing group, so that edges are shaded sharp.
//
// Triangles around a node that meet at less than the crease angle (at rest) share a *vertex*. These triangles are its
// *one-ring*; the normal of the deformed surface is the sum of their area vectors.

import type { Surface } from "../../protocol/surface";

export interface SplitMesh {
  vertices: number;
  /** Node index of each vertex. */
  node: Uint32Array;
  /** Three vertex indices per triangle. */
  indices: Uint32Array;
  /** Offset of each vertex's ring in `ring` [triangles]; one more at the end. */
  ringStart: Uint32Array;
  /** The other two nodes of each ring triangle, counterclockwise after the vertex. */
  ring: Uint32Array;
  /** Vertex pairs: each mesh edge once. */
  edges: Uint32Array;
}

export const CREASE_ANGLE = (40 * Math.PI) / 180;

/** Unit normals of the triangles; 0 for degenerate ones. */
export function triangleNormals(positions: Float32Array, indices: Uint32Array): Float32Array {
  const normals = new Float32Array(indices.length);
  for (let t = 0; t < indices.length; t += 3) {
    const a = 3 * indices[t];
    const b = 3 * indices[t + 1];
    const c = 3 * indices[t + 2];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(x, y, z);
    if (length > 0) {
      normals[t] = x / length;
      normals[t + 1] = y / length;
      normals[t + 2] = z / length;
    }
  }
  return normals;
}

/** Union–find root with path compression. */
function rootOf(parent: Uint32Array, item: number): number {
  let root = item;
  while (parent[root] !== root) root = parent[root];
  while (parent[item] !== root) [parent[item], item] = [root, parent[item]];
  return root;
}

export function splitAtCreases(surface: Surface, creaseAngle = CREASE_ANGLE): SplitMesh {
  const { nodes, positions, indices } = surface;
  const normals = triangleNormals(positions, indices);
  const flat = Math.cos(creaseAngle);

  // Half edge h goes from corner h of a triangle to the next corner; its opposite belongs to the neighbour.
  // Corners of one node that are connected across smooth edges share a vertex.
  const parent = Uint32Array.from(indices, (_, corner) => corner);
  const next = (corner: number) => (corner % 3 === 2 ? corner - 2 : corner + 1);
  const across = new Map<number, number>();
  let edgeCount = 0;
  for (let h = 0; h < indices.length; h++) across.set(indices[h] * nodes + indices[next(h)], h);
  for (let h = 0; h < indices.length; h++) {
    const other = across.get(indices[next(h)] * nodes + indices[h]);
    if (other === undefined) {
      edgeCount++;
      continue;
    }
    if (other > h) continue;
    edgeCount++;
    const [s, t] = [h - (h % 3), other - (other % 3)];
    const cosine = normals[s] * normals[t] + normals[s + 1] * normals[t + 1] + normals[s + 2] * normals[t + 2];
    if (cosine < flat) continue;
    parent[rootOf(parent, h)] = rootOf(parent, next(other));
    parent[rootOf(parent, next(h))] = rootOf(parent, other);
  }

  const vertexOfRoot = new Map<number, number>();
  const node: number[] = [];
  const vertexOf = new Uint32Array(indices.length);
  for (let corner = 0; corner < indices.length; corner++) {
    const root = rootOf(parent, corner);
    let vertex = vertexOfRoot.get(root);
    if (vertex === undefined) {
      vertex = node.length;
      vertexOfRoot.set(root, vertex);
      node.push(indices[corner]);
    }
    vertexOf[corner] = vertex;
  }

  const ringStart = new Uint32Array(node.length + 1);
  for (const vertex of vertexOf) ringStart[vertex + 1]++;
  for (let vertex = 0; vertex < node.length; vertex++) ringStart[vertex + 1] += ringStart[vertex];
  const filled = ringStart.slice(0, node.length);
  const ring = new Uint32Array(2 * indices.length);
  const edges = new Uint32Array(2 * edgeCount);
  let edge = 0;
  for (let corner = 0; corner < indices.length; corner++) {
    const [b, c] = [next(corner), next(next(corner))];
    const place = filled[vertexOf[corner]]++;
    ring[2 * place] = indices[b];
    ring[2 * place + 1] = indices[c];
    const other = across.get(indices[b] * nodes + indices[corner]);
    if (other === undefined || other <= corner) {
      edges[edge++] = vertexOf[corner];
      edges[edge++] = vertexOf[b];
    }
  }
  return { vertices: node.length, node: Uint32Array.from(node), indices: vertexOf, ringStart, ring, edges: edges.subarray(0, edge) };
}
