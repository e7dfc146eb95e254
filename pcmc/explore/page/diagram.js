// The branches of equilibria over the quantity that varies, and the equilibria at its present value.

import { capital, digits, element } from "./elements.js";

const [WIDTH, HEIGHT, LEFT, BOTTOM, PAD] = [320, 200, 44, 30, 10];
const SVG = "http://www.w3.org/2000/svg";

/** An element of SVG. */
function drawn(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Least and greatest, with a little room. */
function range(values) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const room = 0.05 * (high - low || Math.abs(high) || 1);
  return [low - room, high + room];
}

/** Two to seven round numbers between these, the same distance apart. */
function ticks(low, high) {
  const unit = 10 ** Math.floor(Math.log10((high - low) / 3));
  const step = unit * [1, 2, 5].findLast((times) => times * unit <= (high - low) / 2.5);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, k) => (first + k) * step);
}

const kind = (index) => (index === 0 ? "stable" : `saddle, index ${index}`);

/** Draw the diagram and list the equilibria; `visit(number)` shows one, or a point of a branch. */
export function showDiagram(root, { parameter, value, pieces, equilibria, beside, words }, units, visit) {
  const along = pieces.flatMap(({ points }) => points);
  const [x0, x1] = range([value, ...along.map(([p]) => p)]);
  const [y0, y1] = range([...equilibria.map(({ height }) => height), ...along.map(([, h]) => h)]);
  const x = (p) => LEFT + ((p - x0) / (x1 - x0)) * (WIDTH - LEFT - PAD);
  const y = (h) => HEIGHT - BOTTOM - ((h - y0) / (y1 - y0)) * (HEIGHT - BOTTOM - PAD);
  const unit = units.given ? `, ${units.length}` : "";
  const svg = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": `Height over ${parameter}` });
  const line = (className, ...[a, b, c, d]) => drawn("line", { class: className, x1: a, y1: b, x2: c, y2: d });
  svg.append(
    line("axis", LEFT, PAD, LEFT, HEIGHT - BOTTOM), line("axis", LEFT, HEIGHT - BOTTOM, WIDTH - PAD, HEIGHT - BOTTOM),
    line("now", x(value), PAD, x(value), HEIGHT - BOTTOM),
    drawn("text", { x: WIDTH - PAD, y: HEIGHT - 4, "text-anchor": "end" }, parameter),
    drawn("text", { x: 2, y: PAD + 2 }, `height${unit}`),
  );
  const label = (value, span, at) => {
    const count = 2 + Math.ceil(Math.log10(Math.abs(value) / span)); // that tell it from the next
    return drawn("text", { "text-anchor": "end", ...at }, digits(value, Math.max(4, count)));
  };
  svg.append(
    ...ticks(x0, x1).map((p) => label(p, x1 - x0, { x: x(p), y: HEIGHT - BOTTOM + 13, "text-anchor": "middle" })),
    ...ticks(y0, y1).map((h) => label(h, y1 - y0, { x: LEFT - 4, y: y(h) + 4 })),
  );
  const shown = (number) => {
    for (const one of svg.querySelectorAll("circle")) one.setAttribute("aria-current", one.dataset.number === String(number));
    visit(number);
  };
  const point = (number, at, { height, index }, look) => {
    const words = `${parameter} ${digits(at)}, height ${digits(height)}: ${kind(index)}`;
    const button = { tabindex: 0, role: "button", "aria-label": words, "data-number": number };
    const circle = drawn("circle", { cx: x(at), cy: y(height), ...look, ...button });
    circle.append(drawn("title", {}, words));
    circle.onclick = () => shown(number);
    circle.onkeydown = ({ key }) => { if (key === "Enter" || key === " ") shown(number); };
    svg.append(circle);
  };
  for (const { stable, points } of pieces) {
    const line = points.map(([p, h]) => `${x(p)},${y(h)}`).join(" ");
    svg.append(drawn("polyline", { points: line, class: stable ? "" : "saddle" }));
  }
  beside.forEach((row, k) => point(equilibria.length + k, row.parameter, row, { r: 4, class: "way" }));
  equilibria.forEach((row, k) => point(k, value, row, { r: 5 }));
  root.querySelector(".diagram").replaceChildren(svg);
  root.querySelector("ol").replaceChildren(...equilibria.map(({ index, energy }, k) => element("li",
    element("button", { type: "button", onclick: () => shown(k) },
      `${kind(index)}, E = ${digits(energy, 5)}${units.given ? ` ${units.energy}` : ""}`))));
  root.querySelector(".detail").replaceChildren(
    element("p", "Solid: stable. Dashed: saddles. Click a point to see the roof there."),
    ...words.map((text) => element("p", `${capital(text)}.`.replace("..", "."))));
  root.hidden = false;
}
