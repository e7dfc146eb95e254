// Colour maps that can be told apart with every kind of colour blindness, as tables of 256 colours.

const VIRIDIS = ["440154", "482475", "414487", "355f8d", "2a788e", "21918c", "22a884", "44bf70",
  "7ad151", "bddf26", "fde725"];
const BLUE_RED = ["2166ac", "4393c3", "92c5de", "d1e5f0", "f7f7f7", "fddbc7", "f4a582", "d6604d",
  "b2182b"];

function table(anchors) {
  const known = anchors.map((c) => [0, 2, 4].map((k) => parseInt(c.slice(k, k + 2), 16)));
  const colours = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) {
    const place = (i / 255) * (known.length - 1);
    const below = Math.min(Math.floor(place), known.length - 2);
    for (let k = 0; k < 3; k++) {
      const part = place - below;
      colours[4 * i + k] = Math.round((1 - part) * known[below][k] + part * known[below + 1][k]);
    }
    colours[4 * i + 3] = 255;
  }
  return colours;
}

/** A table of equal steps of constant colour. */
export function steps(hexes) {
  return table(Array.from({ length: 256 }, (_, i) => hexes[Math.floor((i * hexes.length) / 256)]));
}

const gradient = (anchors) => `linear-gradient(to right, ${anchors.map((c) => `#${c}`).join(", ")})`;

export const sequential = { table: table(VIRIDIS), css: gradient(VIRIDIS) };
export const diverging = { table: table(BLUE_RED), css: gradient(BLUE_RED) };

/** Red, green, blue (0..1) of a value within limits. */
export function colourOf(map, value, low, high) {
  const part = high > low ? (value - low) / (high - low) : 0.5;
  const i = 4 * Math.round(255 * Math.min(1, Math.max(0, part)));
  return [map.table[i] / 255, map.table[i + 1] / 255, map.table[i + 2] / 255];
}
