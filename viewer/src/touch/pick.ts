// Which triangle a ray meets first, and where in it: Möller and Trumbore's formula, for faces seen from outside.

export interface Hit {
  triangle: number;
  /** Of its three corners; they add up to 1. */
  weights: [number, number, number];
  distance: number;
}

/** `places` three numbers per node; `origin` and `direction` in the same frame. */
export function pick(places: ArrayLike<number>, corners: Uint32Array, origin: readonly number[], direction: readonly number[]): Hit | null {
  const [ox, oy, oz] = origin;
  const [dx, dy, dz] = direction;
  let best: Hit | null = null;
  for (let t = 0; t < corners.length; t += 3) {
    const a = 3 * corners[t];
    const b = 3 * corners[t + 1];
    const c = 3 * corners[t + 2];
    const ax = places[a];
    const ay = places[a + 1];
    const az = places[a + 2];
    const ux = places[b] - ax;
    const uy = places[b + 1] - ay;
    const uz = places[b + 2] - az;
    const vx = places[c] - ax;
    const vy = places[c + 1] - ay;
    const vz = places[c + 2] - az;
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
