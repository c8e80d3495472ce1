// Box of the stand-in: surface, and mode shapes from products of cosines. Not a finite element model: it serves to
// develop and test the page without the engine.

/** Surface of a box of `cells` cells per edge, counterclockwise seen from outside. */
export function boxSurface(size, cells) {
  const numbers = new Map();
  const positions = [];
  const node = (i, j, k) => {
    const key = (i * (cells + 1) + j) * (cells + 1) + k;
    let number = numbers.get(key);
    if (number === undefined) {
      number = positions.length / 3;
      numbers.set(key, number);
      positions.push((i / cells - 0.5) * size, (j / cells - 0.5) * size, (k / cells - 0.5) * size);
    }
    return number;
  };
  const indices = [];
  const n = cells;
  for (let a = 0; a < n; a++) {
    for (let b = 0; b < n; b++) {
      const quads = [
        [node(n, a, b), node(n, a + 1, b), node(n, a + 1, b + 1), node(n, a, b + 1)],
        [node(0, a, b), node(0, a, b + 1), node(0, a + 1, b + 1), node(0, a + 1, b)],
        [node(a, n, b), node(a, n, b + 1), node(a + 1, n, b + 1), node(a + 1, n, b)],
        [node(a, 0, b), node(a + 1, 0, b), node(a + 1, 0, b + 1), node(a, 0, b + 1)],
        [node(a, b, n), node(a + 1, b, n), node(a + 1, b + 1, n), node(a, b + 1, n)],
        [node(a, b, 0), node(a, b + 1, 0), node(a + 1, b + 1, 0), node(a + 1, b, 0)],
      ];
      for (const [p, q, r, s] of quads) indices.push(...((a + b) % 2 === 0 ? [p, q, r, p, r, s] : [p, q, s, q, r, s]));
    }
  }
  return { positions: Float32Array.from(positions), indices: Uint32Array.from(indices) };
}

/** First `count` cosine modes: wave numbers per axis and direction of displacement. */
export function waves(count) {
  const all = [];
  for (let i = 0; i < 9; i++)
    for (let j = 0; j < 9; j++)
      for (let k = 0; k < 9; k++)
        if (i + j + k > 0) for (let axis = 0; axis < 3; axis++) all.push({ i, j, k, axis, square: i * i + j * j + k * k });
  return all.sort((a, b) => a.square - b.square || a.axis - b.axis).slice(0, count);
}

export function shapeAt(wave, x, y, z, size) {
  return (
    Math.cos(wave.i * Math.PI * (x / size + 0.5)) * Math.cos(wave.j * Math.PI * (y / size + 0.5)) * Math.cos(wave.k * Math.PI * (z / size + 0.5))
  );
}

const scratch = new Float32Array(1);
const scratchBits = new Uint32Array(scratch.buffer);

/** Nearest half float (binary16 bits). */
export function toHalf(value) {
  scratch[0] = value;
  const bits = scratchBits[0];
  const sign = (bits >>> 16) & 0x8000;
  const exponent = ((bits >>> 23) & 0xff) - 112;
  if (exponent <= 0) {
    if (exponent < -10) return sign;
    const fraction = (bits & 0x7fffff) | 0x800000;
    const shift = 14 - exponent;
    return sign | ((fraction + (1 << (shift - 1))) >>> shift);
  }
  return sign | Math.min(0x7c00, ((exponent << 10) | ((bits & 0x7fffff) >>> 13)) + ((bits >>> 12) & 1));
}

export function surfaceBytes({ positions, indices }) {
  const head = Uint32Array.of(positions.length / 3, indices.length / 3);
  return Buffer.concat([head, positions, indices].map((part) => Buffer.from(part.buffer, part.byteOffset, part.byteLength)));
}

export function shapesBytes({ positions }, list, size) {
  const nodes = positions.length / 3;
  const halves = new Uint16Array(3 * nodes * list.length);
  list.forEach((wave, k) => {
    for (let n = 0; n < nodes; n++) {
      halves[3 * (k * nodes + n) + wave.axis] = toHalf(shapeAt(wave, positions[3 * n], positions[3 * n + 1], positions[3 * n + 2], size));
    }
  });
  const head = Uint32Array.of(nodes, list.length);
  const frequencies = Float32Array.from(list, (wave) => 6 * Math.sqrt(wave.square));
  const bytes = Buffer.concat([head, frequencies, halves].map((part) => Buffer.from(part.buffer, part.byteOffset, part.byteLength)));
  return Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4)]);
}
