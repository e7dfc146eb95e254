// Colour maps that can be told apart with every kind of colour blindness, as tables of 256 colours.

const VIRIDIS = ["440154", "482475", "414487", "355f8d", "2a788e", "21918c", "22a884", "44bf70",
  "7ad151", "bddf26", "fde725"];
const BLUE_RED = ["2166ac", "4393c3", "92c5de", "d1e5f0", "f7f7f7", "fddbc7", "f4a582", "d6604d",
  "b2182b"];
const FEW = ["0072b2", "e69f00", "009e73", "cc79a7", "56b4e9", "d55e00", "f0e442", "6b6b6b"]; // Okabe and Ito
const SIZES = [1, 2, 5, 10, 30]; // least number of panels of a class
const SIZE_COLOURS = ["fde725", "5ec962", "21918c", "3b528b", "440154"];

function table(anchors) {
  const known = anchors.map((c) => [0, 2, 4].map((k) => parseInt(c.slice(k, k + 2), 16)));
  return Uint8Array.from({ length: 256 * 4 }, (_, i) => {
    const [place, k] = [((i >> 2) / 255) * (known.length - 1), i & 3];
    const below = Math.min(Math.floor(place), known.length - 2);
    const part = place - below;
    return k === 3 ? 255 : Math.round((1 - part) * known[below][k] + part * known[below + 1][k]);
  });
}

const ramp = (anchors) => ({
  table: table(anchors), css: `linear-gradient(to right, ${anchors.map((c) => `#${c}`).join(", ")})`,
});

export const sequential = ramp(VIRIDIS);
export const diverging = ramp(BLUE_RED);

/** Red, green, blue (0..1) of a value within limits. */
export function colourOf(map, value, low, high) {
  const part = high > low ? (value - low) / (high - low) : 0.5;
  const i = 4 * Math.round(255 * Math.min(1, Math.max(0, part)));
  return Array.from(map.table.subarray(i, i + 3), (c) => c / 255);
}

const count = (panels) => `${panels} panel${panels === 1 ? "" : "s"}`;
const SIZE_WORDS = SIZES.map((least, c) => (least === 1 ? "one of a kind"
  : c + 1 < SIZES.length ? `${least} to ${SIZES[c + 1] - 1} alike` : `${least} or more alike`));

/** The field to draw from the family (m) of each triangle, counted from 1; NaN for walls.
 *
 * A colour for each of a few families of congruent panels, or for how many panels are alike. */
export function familyField(family) {
  const panels = []; // of each family
  for (const k of family) if (k > 0) panels[k - 1] = (panels[k - 1] ?? 0) + 1;
  const few = panels.length <= FEW.length;
  const classOf = few ? panels.map((_, k) => k) : panels.map((size) => SIZES.findLastIndex((least) => size >= least));
  const classes = few ? FEW.slice(0, panels.length) : SIZE_COLOURS;
  const values = Float32Array.from(family, (k) => (k > 0 ? classOf[k - 1] + 0.5 : NaN));
  const total = panels.reduce((sum, size) => sum + size, 0);
  const inClass = classes.map((_, c) => panels.reduce((sum, size, k) => sum + (classOf[k] === c ? size : 0), 0));
  const words = few ? classes.map((_, c) => `family ${c + 1}`) : SIZE_WORDS;
  const scale = classes.map((colour, c) => ({ colour: `#${colour}`, text: `${words[c]}: ${count(inClass[c])}` }))
    .filter((_, c) => inClass[c]);
  const name = `${panels.length === 1 ? "One family" : `${panels.length} families`} of congruent panels, ${count(total)} in all, `
    + `${Math.max(0, ...panels)} in the largest; edges alike within 1 % of the mean edge`;
  const steps = Array.from({ length: 256 }, (_, i) => classes[Math.floor((i * classes.length) / 256)]);
  return { values, limits: [0, classes.length], map: { table: table(steps) }, byFace: true, scale, name };
}
