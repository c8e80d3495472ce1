// Where the numbers of nodes and modes lie in textures.
//
// Node i is texel (i mod width, i div width) of a plane of width × rows. A texture array has few layers (256 at least)
// and few rows (2048 at least), so a layer holds several modes one above the other:
// mode k is in layer k mod layers, from row (k div layers)·rows on.

export interface Limits {
  size: number;
  layers: number;
}

export interface Plane {
  width: number;
  rows: number;
}

export interface ShapeLayout extends Plane {
  layers: number;
  /** Planes one above the other in a layer. */
  planes: number;
}

/** The plane for `count` things, nearly square, as wide as a power of two. */
export function planeFor(count: number, limits: Limits): Plane {
  const side = Math.max(1, Math.ceil(Math.sqrt(count)));
  const width = Math.min(limits.size, 2 ** Math.ceil(Math.log2(side)));
  const rows = Math.max(1, Math.ceil(count / width));
  if (rows > limits.size) throw new Error(`${count} nodes are more than a texture of this machine holds`);
  return { width, rows };
}

/** The layout of `modes` shapes of `nodes` nodes; null if they do not fit into one texture array. */
export function shapeLayout(nodes: number, modes: number, limits: Limits): ShapeLayout | null {
  if (nodes > limits.size * limits.size) return null;
  const plane = planeFor(nodes, limits);
  const layers = Math.max(1, Math.min(modes, limits.layers));
  const planes = Math.max(1, Math.ceil(modes / layers));
  if (planes * plane.rows > limits.size) return null;
  return { ...plane, layers, planes };
}

export function modeAt(mode: number, layout: ShapeLayout): { layer: number; row: number } {
  return { layer: mode % layout.layers, row: Math.floor(mode / layout.layers) * layout.rows };
}

/** The shapes, three half floats per node, as the layers of a texture array. */
export function layShapes(halves: Uint16Array, nodes: number, modes: number, layout: ShapeLayout): Uint16Array<ArrayBuffer> {
  const layerSize = 3 * layout.width * layout.rows * layout.planes;
  const texels = new Uint16Array(layerSize * layout.layers);
  for (let mode = 0; mode < modes; mode++) {
    const { layer, row } = modeAt(mode, layout);
    const from = 3 * nodes * mode;
    texels.set(halves.subarray(from, from + 3 * nodes), layer * layerSize + 3 * row * layout.width);
  }
  return texels;
}

/** Numbers in groups of `from` per thing as groups of `to`, padded to the plane. */
export function spread(numbers: Float32Array, from: number, to: number, plane: Plane): Float32Array<ArrayBuffer> {
  const texels = new Float32Array(to * plane.width * plane.rows);
  for (let i = 0, count = numbers.length / from; i < count; i++) {
    for (let k = 0; k < from; k++) texels[to * i + k] = numbers[from * i + k];
  }
  return texels;
}
