// Families of congruent panels: a colour for each of a few, or for how many panels are alike.

import { steps } from "./colours.js";
import { element } from "./elements.js";

const FEW = ["0072b2", "e69f00", "009e73", "cc79a7", "56b4e9", "d55e00", "f0e442", "6b6b6b"]; // Okabe and Ito
const SIZES = [1, 2, 5, 10, 30]; // least number of panels of a class
const SIZE_COLOURS = ["fde725", "5ec962", "21918c", "3b528b", "440154"];

/** The field to draw from the family (m) of each triangle, counted from 1; NaN for walls. */
export function familyField(family) {
  const panels = []; // of each family
  for (const k of family) if (k > 0) panels[k - 1] = (panels[k - 1] ?? 0) + 1;
  const few = panels.length <= FEW.length;
  const classOf = few ? panels.map((_, k) => k) : panels.map((size) => SIZES.findLastIndex((least) => size >= least));
  const classes = few ? FEW.slice(0, panels.length) : SIZE_COLOURS;
  const values = Float32Array.from(family, (k) => (k > 0 ? classOf[k - 1] + 0.5 : NaN));
  const total = panels.reduce((sum, size) => sum + size, 0);
  const inClass = classes.map((_, c) => panels.reduce((sum, size, k) => sum + (classOf[k] === c ? size : 0), 0));
  const words = few ? classes.map((_, c) => `family ${c + 1}`) : SIZES.map(sizeWords);
  const scale = classes.map((colour, c) => ({ colour: `#${colour}`, text: `${words[c]}: ${count(inClass[c])}` }))
    .filter((_, c) => inClass[c]);
  const largest = Math.max(0, ...panels);
  const name = `${panels.length === 1 ? "One family" : `${panels.length} families`} of congruent panels, ${count(total)} in all, `
    + `${largest} in the largest; edges alike within 1 % of the mean edge`;
  return { values, limits: [0, classes.length], map: { table: steps(classes) }, byFace: true, scale, name };
}

const count = (panels) => `${panels} panel${panels === 1 ? "" : "s"}`;

function sizeWords(least, c) {
  if (least === 1) return "one of a kind";
  return c + 1 < SIZES.length ? `${least} to ${SIZES[c + 1] - 1} alike` : `${least} or more alike`;
}

/** The scale of a field in classes: a colour and its words for each. */
export function showClasses(list, scale) {
  list.replaceChildren(...(scale ?? []).map(({ colour, text }) => {
    const item = element("li");
    const swatch = element("span");
    swatch.style.background = colour;
    item.append(swatch, text);
    return item;
  }));
}
