// Splits the nodes of a surface where it has edges, so that a cube is shaded as a cube and a liver as a liver.
//
// A *vertex* is a node as one smooth part of the surface sees it: the triangles around a node that meet one another at
// less than the crease angle (at rest) share a vertex. Its *ring* is these triangles; the normal of the deformed
// surface is the sum of their area vectors.

import type { Surface } from "../../protocol/surface";

export interface Smooth {
  vertices: number;
  /** The node of each vertex. */
  node: Uint32Array;
  /** Three vertices per triangle. */
  corners: Uint32Array;
  /** Where the ring of each vertex begins in `ring`, in triangles; one more at the end. */
  ringStart: Uint32Array;
  /** Per triangle of a ring the other two nodes, counterclockwise after the vertex. */
  ring: Uint32Array;
  /** Pairs of vertices: each edge of the mesh once. */
  edges: Uint32Array;
}

export const CREASE_ANGLE = (40 * Math.PI) / 180;

/** Unit normals of the triangles (0 where a triangle has no area). */
export function triangleNormals(positions: Float32Array, corners: Uint32Array): Float32Array {
  const normals = new Float32Array(corners.length);
  for (let t = 0; t < corners.length; t += 3) {
    const a = 3 * corners[t];
    const b = 3 * corners[t + 1];
    const c = 3 * corners[t + 2];
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

/** Follows the parents of a forest to its root, and shortens the way. */
function rootOf(parent: Uint32Array, item: number): number {
  let root = item;
  while (parent[root] !== root) root = parent[root];
  while (parent[item] !== root) [parent[item], item] = [root, parent[item]];
  return root;
}

export function smoothParts(surface: Surface, creaseAngle = CREASE_ANGLE): Smooth {
  const { nodes, positions, corners } = surface;
  const normals = triangleNormals(positions, corners);
  const flat = Math.cos(creaseAngle);

  // A half edge, from the corner h of a triangle to its next one, joins its triangle with the one across.
  // Corners of one node that are joined over smooth edges are one vertex.
  const parent = Uint32Array.from(corners, (_, corner) => corner);
  const next = (corner: number) => (corner % 3 === 2 ? corner - 2 : corner + 1);
  const across = new Map<number, number>();
  let edgeCount = 0;
  for (let h = 0; h < corners.length; h++) across.set(corners[h] * nodes + corners[next(h)], h);
  for (let h = 0; h < corners.length; h++) {
    const other = across.get(corners[next(h)] * nodes + corners[h]);
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
  const vertexOf = new Uint32Array(corners.length);
  for (let corner = 0; corner < corners.length; corner++) {
    const root = rootOf(parent, corner);
    let vertex = vertexOfRoot.get(root);
    if (vertex === undefined) {
      vertex = node.length;
      vertexOfRoot.set(root, vertex);
      node.push(corners[corner]);
    }
    vertexOf[corner] = vertex;
  }

  const ringStart = new Uint32Array(node.length + 1);
  for (const vertex of vertexOf) ringStart[vertex + 1]++;
  for (let vertex = 0; vertex < node.length; vertex++) ringStart[vertex + 1] += ringStart[vertex];
  const filled = ringStart.slice(0, node.length);
  const ring = new Uint32Array(2 * corners.length);
  const edges = new Uint32Array(2 * edgeCount);
  let edge = 0;
  for (let corner = 0; corner < corners.length; corner++) {
    const [b, c] = [next(corner), next(next(corner))];
    const place = filled[vertexOf[corner]]++;
    ring[2 * place] = corners[b];
    ring[2 * place + 1] = corners[c];
    const other = across.get(corners[b] * nodes + corners[corner]);
    if (other === undefined || other <= corner) {
      edges[edge++] = vertexOf[corner];
      edges[edge++] = vertexOf[b];
    }
  }
  return { vertices: node.length, node: Uint32Array.from(node), corners: vertexOf, ringStart, ring, edges: edges.subarray(0, edge) };
}
