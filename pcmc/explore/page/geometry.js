// Small computations on vectors [x, y, z], and on vertices, flat arrays of these.

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const scaled = (a, s) => a.map((x) => x * s);
export const plus = (...all) => all.reduce((a, b) => a.map((x, k) => x + b[k]));
export const minus = (a, b) => a.map((x, k) => x - b[k]);
export const unit = (a) => scaled(a, 1 / Math.hypot(...a));

/** Least and greatest corner. */
export function boxOf(X) {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
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
    for (const i of [a, b, c]) {
      sums[i] += uy * wz - uz * wy;
      sums[i + 1] += uz * wx - ux * wz;
      sums[i + 2] += ux * wy - uy * wx;
    }
  }
  return sums;
}

/** 1, 2 or 5 times a power of ten, at most x. */
export function roundBelow(x) {
  const ten = 10 ** Math.floor(Math.log10(x));
  return ten * (x / ten >= 5 ? 5 : x / ten >= 2 ? 2 : 1);
}

const vertexOf = (X, v) => [X[3 * v], X[3 * v + 1], X[3 * v + 2]];

/** The first point of a ray on triangles (flat indices) that is not cut away, and its triangle; or null. */
export function hit(X, triangles, [eye, way], cut) {
  let [nearest, found] = [Infinity, null];
  for (let f = 0; f < triangles.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => vertexOf(X, triangles[f + k]));
    const [u, w, from] = [minus(b, a), minus(c, a), minus(eye, a)];
    const across = cross(way, w);
    const volume = dot(u, across);
    if (!volume) continue;
    const s = dot(from, across) / volume;
    const turned = cross(from, u);
    const t = dot(way, turned) / volume;
    const far = dot(w, turned) / volume;
    if (s < 0 || t < 0 || s + t > 1 || far <= 0 || far >= nearest) continue;
    const point = eye.map((x, k) => x + far * way[k]);
    if (dot(cut, point) > cut[3]) continue;
    nearest = far;
    found = { point, corners: [a, b, c] };
  }
  return found;
}

/** The line in which triangles (flat indices) meet a plane: the ends of its pieces, two by two, flat. */
export function sectionOf(X, triangles, cut) {
  const ends = [];
  for (let f = 0; f < triangles.length; f += 3) {
    const corners = [0, 1, 2].map((k) => vertexOf(X, triangles[f + k]));
    const above = corners.map((p) => dot(cut, p) - cut[3]);
    const met = [0, 1, 2].filter((k) => above[k] > 0 !== above[(k + 1) % 3] > 0);
    met.forEach((k) => {
      const part = above[k] / (above[k] - above[(k + 1) % 3]);
      ends.push(...corners[k].map((x, i) => x + part * (corners[(k + 1) % 3][i] - x)));
    });
  }
  return ends;
}
