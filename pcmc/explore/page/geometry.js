// Small computations on vertices, flat arrays of x, y, z.

/** Least and greatest corner. */
export function boxOf(X) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < X.length; i++) {
    low[i % 3] = Math.min(low[i % 3], X[i]);
    high[i % 3] = Math.max(high[i % 3], X[i]);
  }
  return [low, high];
}

/** Length of a box's diagonal. */
export const span = ([low, high]) => Math.hypot(...high.map((x, k) => x - low[k]));

/** Sum of the area vectors around each corner, flat (k,3). */
export function normals(places, faces) {
  const sums = new Float32Array(places.length);
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [3 * faces[f], 3 * faces[f + 1], 3 * faces[f + 2]];
    const ux = places[b] - places[a], uy = places[b + 1] - places[a + 1], uz = places[b + 2] - places[a + 2];
    const wx = places[c] - places[a], wy = places[c + 1] - places[a + 1], wz = places[c + 2] - places[a + 2];
    const nx = uy * wz - uz * wy, ny = uz * wx - ux * wz, nz = ux * wy - uy * wx;
    for (const i of [a, b, c]) {
      sums[i] += nx;
      sums[i + 1] += ny;
      sums[i + 2] += nz;
    }
  }
  return sums;
}

/** 1, 2 or 5 times a power of ten, at most x. */
export function roundBelow(x) {
  const ten = 10 ** Math.floor(Math.log10(x));
  return ten * (x / ten >= 5 ? 5 : x / ten >= 2 ? 2 : 1);
}
