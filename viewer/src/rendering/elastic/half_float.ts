// Decoding of half floats (IEEE 754 binary16).

let table: Float32Array | null = null;

function decode(half: number): number {
  const sign = half & 0x8000 ? -1 : 1;
  const exponent = (half >> 10) & 0x1f;
  const fraction = half & 0x3ff;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 31) return fraction === 0 ? sign * Infinity : NaN;
  return sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

/** Values of all 65,536 bit patterns. */
export function halfFloatTable(): Float32Array {
  if (table === null) {
    table = new Float32Array(65536);
    for (let half = 0; half < 65536; half++) table[half] = decode(half);
  }
  return table;
}
