// Texture layout of nodal data and mode shapes.
//
// Node i is texel (i mod width, i div width) of a grid of width × rows. WebGL 2 guarantees 256 layers and 2048 rows of
// a texture array, so a layer may hold several modes: mode k is in layer k mod layers, from row (k div layers)·rows on.

export interface TextureLimits {
  size: number;
  layers: number;
}

export interface TextureGrid {
  width: number;
  rows: number;
}

export interface ShapeLayout extends TextureGrid {
  layers: number;
  /** Grids stacked in one layer. */
  planes: number;
}

/** Grid for `count` texels, nearly square, with a power of two as width. */
export function gridFor(count: number, limits: TextureLimits): TextureGrid {
  const side = Math.max(1, Math.ceil(Math.sqrt(count)));
  const width = Math.min(limits.size, 2 ** Math.ceil(Math.log2(side)));
  const rows = Math.max(1, Math.ceil(count / width));
  if (rows > limits.size) throw new Error(`${count} nodes are more than a texture of this machine holds`);
  return { width, rows };
}

/** Layout of `modes` mode shapes of `nodes` nodes; null if they exceed one texture array. */
export function shapeLayout(nodes: number, modes: number, limits: TextureLimits): ShapeLayout | null {
  if (nodes > limits.size * limits.size) return null;
  const plane = gridFor(nodes, limits);
  const layers = Math.max(1, Math.min(modes, limits.layers));
  const planes = Math.max(1, Math.ceil(modes / layers));
  if (planes * plane.rows > limits.size) return null;
  return { ...plane, layers, planes };
}

export function modeOffset(mode: number, layout: ShapeLayout): { layer: number; row: number } {
  return { layer: mode % layout.layers, row: Math.floor(mode / layout.layers) * layout.rows };
}

/** Mode shapes, three half floats per node, as layers of a texture array. */
export function packModeShapes(halves: Uint16Array, nodes: number, modes: number, layout: ShapeLayout): Uint16Array<ArrayBuffer> {
  const layerSize = 3 * layout.width * layout.rows * layout.planes;
  const texels = new Uint16Array(layerSize * layout.layers);
  for (let mode = 0; mode < modes; mode++) {
    const { layer, row } = modeOffset(mode, layout);
    const from = 3 * nodes * mode;
    texels.set(halves.subarray(from, from + 3 * nodes), layer * layerSize + 3 * row * layout.width);
  }
  return texels;
}

/** Texels of `to` numbers from groups of `from` numbers, padded to the grid. */
export function padTexels(numbers: Float32Array, from: number, to: number, plane: TextureGrid): Float32Array<ArrayBuffer> {
  const texels = new Float32Array(to * plane.width * plane.rows);
  for (let i = 0, count = numbers.length / from; i < count; i++) {
    for (let k = 0; k < from; k++) texels[to * i + k] = numbers[from * i + k];
  }
  return texels;
}
