// Ray–triangle picking: nearest front-facing hit by the Möller–Trumbore algorithm (Möller and Trumbore 1997).

export interface Hit {
  triangle: number;
  /** Barycentric weights of the three corners. */
  weights: [number, number, number];
  distance: number;
}

/**
 * Nearest front-facing triangle hit by a ray, or null.
 * `positions`: three numbers per node; `origin` and `direction` in the same coordinates.
 */
export function pick(positions: ArrayLike<number>, indices: Uint32Array, origin: readonly number[], direction: readonly number[]): Hit | null {
  const [ox, oy, oz] = origin;
  const [dx, dy, dz] = direction;
  let best: Hit | null = null;
  for (let t = 0; t < indices.length; t += 3) {
    const a = 3 * indices[t];
    const b = 3 * indices[t + 1];
    const c = 3 * indices[t + 2];
    const ax = positions[a];
    const ay = positions[a + 1];
    const az = positions[a + 2];
    const ux = positions[b] - ax;
    const uy = positions[b + 1] - ay;
    const uz = positions[b + 2] - az;
    const vx = positions[c] - ax;
    const vy = positions[c + 1] - ay;
    const vz = positions[c + 2] - az;
    const px = dy * vz - dz * vy;
    const py = dz * vx - dx * vz;
    const pz = dx * vy - dy * vx;
    const determinant = ux * px + uy * py + uz * pz;
    if (!(determinant > 0)) continue;
    const sx = ox - ax;
    const sy = oy - ay;
    const sz = oz - az;
    const beta = (sx * px + sy * py + sz * pz) / determinant;
    if (beta < 0 || beta > 1) continue;
    const qx = sy * uz - sz * uy;
    const qy = sz * ux - sx * uz;
    const qz = sx * uy - sy * ux;
    const gamma = (dx * qx + dy * qy + dz * qz) / determinant;
    if (gamma < 0 || beta + gamma > 1) continue;
    const distance = (vx * qx + vy * qy + vz * qz) / determinant;
    if (!(distance > 0) || (best !== null && distance >= best.distance)) continue;
    best = { triangle: t / 3, weights: [1 - beta - gamma, beta, gamma], distance };
  }
  return best;
}
