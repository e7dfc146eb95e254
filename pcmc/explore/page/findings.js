// The verdict, the numbers of the surface, and the fields that colours show.

import { colourOf, diverging, familyField, sequential } from "./colours.js";
import { capital, coordinate, digits, element, tableOf, tableRow } from "./elements.js";
import { QUANTITIES } from "./panel.js";

const SIGNS = {
  stable: "✓", neutral: "≈", saddle: "⤢", not_converged: "…", no_equilibrium: "✕", ran_away: "↗",
  none_found: "↗", undecided: "?", wall_down: "⤓", degenerate: "△", opening: "…",
};

export const COLOURS = {
  patches: { label: "Patches" },
  curvature: { label: "Mean curvature", name: (u) => `Mean curvature H, ${u.curvature} (walls grey)` },
  error: { label: "Meyer's curvature error", name: () => "Error (H − H̄) / H̄ of Meyer's mean curvature, %" },
  reactions: { label: "Reactions", name: (u) => `Reaction of the supports, ${u.tension}` },
  family: { label: "Panels" }, // the field has its own name
  difference: { label: "Difference", name: (u, than) => `Distance from ${than}, ${u.length}; positive outside it` },
};

/** The card that is always in view. */
export function showVerdict(root, header, size) {
  const { verdict, at_rest: atRest } = header;
  const sentence = verdict.name === "not_converged" && !atRest
    ? "pcmc found no surface at rest for these values" : verdict.sentence;
  root.dataset.verdict = verdict.name;
  root.querySelector(".sign").textContent = SIGNS[verdict.name] || "?";
  root.querySelector(".word").textContent = verdict.word;
  root.querySelector(".sentence").textContent = capital(sentence);
  root.querySelector(".detail").textContent = [verdict.detail, atRest ? header.way : drawn(header, size)]
    .filter(Boolean).map((part) => `${capital(part)}.`).join(" ");
}

/** Which surface the page shows if there is none for the values asked for. */
function drawn({ values: { asked, shown } }, size) {
  const near = (a, b) => Math.abs(a - b) <= 1e-9 * Math.abs(b);
  const values = Object.entries(QUANTITIES).flatMap(([kind, { label }]) => Object.entries(shown[kind])
    .filter(([name, has]) => !near(has, asked[kind][name] ?? 0))
    .map(([name, has]) => `${name} ${label.split(" ").pop()} = ${digits(has)}`));
  values.push(...Object.entries(shown.points)
    .filter(([name, at]) => at.some((x, k) => !near(x, asked.points[name][k])))
    .map(([name, at]) => `${name} at (${at.map((x) => coordinate(x, size)).join(", ")})`));
  if (!values.length) return "Shown: the surface as given";
  const listed = values.slice(0, 3).join(", ") + (values.length > 3 ? ", …" : "");
  return `Shown: the last surface at rest, ${listed}`;
}

const percent = (x) => (x === null ? "–" : `${digits(100 * x, 3)} %`);
const smallPercent = (x) => (x !== null && x < 1e-6 ? "below 0.0001 %" : percent(x));

/** Numbers of the surface shown: [name, text, meaning]; the meaning opens below the name. */
export function showFindings(body, findings, figures, units) {
  const of = (name) => figures.find(({ owner, quantity }) => owner === "roof" && quantity === name)?.value;
  const measured = (x, kind, count) => digits(x, count) + (units.given && x !== null ? ` ${units[kind]}` : "");
  const rows = [
    ["Rise above the plane", measured(of("apex"), "length"), `The largest height above the plane Π, ${units.length}.`],
    ["Area of the roof", measured(of("area"), "area"), `Of all patches except walls, ${units.area}.`],
    ["Volume", measured(findings.volume, "volume"), `Between the patches with pressure and the plane Π, ${units.volume}.`],
    ["Energy", measured(findings.energy, "energy", 6), `Σ α A − Σ p V, ${units.energy}. A surface at rest has no nearby shape of other first-order energy; a stable one has the least.`],
    ["Morse index", findings.index ?? "–", "How many independent changes of shape lower the energy. 0: stable, every small push is resisted. 1 or more: a saddle, which a small push moves away from."],
    ["Load over capacity", percent(findings.load_ratio), "The pressure's total push, as a part of the most that the tensions along the supports can carry, when all of them pull straight down. Above 100 % no smooth surface stands on fixed edges alone: raise tensions or lower pressures."],
    ["Largest error of H", smallPercent(findings.curvature_error), "The mean curvature that balances the forces at each vertex, against H̄ = p / 2α. Exact at rest."],
    ["Error by Meyer's measure", smallPercent(findings.curvature_error_cotangent), "Meyer's measure reads the mean curvature from the angles of the triangles, with Voronoi areas, as in the paper's figures. It differs from H̄ by an error of the mesh, which finer triangles reduce."],
    ["Worst triangle", digits(findings.quality, 3), "4√3 area / Σ edge²: 1 is equilateral, 0 degenerate."],
    ["Residual", digits(findings.residual, 3), "The unbalanced forces, relative to the forces of single triangles. Below 1e-8 the surface counts as at rest."],
    ...(findings.pinched ? [["Pinched wall", `${findings.pinched} vertices`, "Here the valley between two patches has come down to the plane: it rests there, and the wall below it has no height."]] : []),
    ...findings.rooms.map(({ room, pressure }) =>
      [`Pressure of ${room}`, measured(pressure, "pressure"),
        "The volume of this room is prescribed; its pressure is the result."]),
  ];
  const known = new Set([...body.querySelectorAll("details[open] summary")].map((s) => s.textContent));
  body.replaceChildren(...rows.map(([name, text, meaning]) => tableRow(
    element("details.term", { open: known.has(name) }, element("summary", name), element("p", meaning)), [text])));
}

const COLUMNS = { // of the parts of a roof, in the order of their tables
  patch: ["apex", "area", "volume", "reaction per length", "snow", "net pressure"],
  wall: ["area", "lean"], cable: ["force", "length", "sag"], room: ["volume"], member: ["least N", "largest N"],
};
const SHORT = { "reaction per length": "Reaction", "net pressure": "Net p" };

/** A table for the patches, the walls, the cables, the rooms and the members, each with those of its quantities that are known. */
export function showParts(root, figures, units) {
  root.replaceChildren(...Object.entries(COLUMNS).flatMap(([owner, wanted]) => {
    const own = figures.filter((one) => one.owner === owner || (owner === "patch" && one.owner === "roof"));
    const parts = [...new Set(own.map(({ of }) => of))];
    if (!parts.some(Boolean)) return [];
    if (parts.length === 2 && parts.includes("")) parts.splice(parts.indexOf(""), 1); // the only patch is all
    const columns = wanted.filter((name) => own.some(({ quantity }) => quantity === name));
    const heads = columns.map((name) => [SHORT[name] ?? capital(name),
      units.given ? units[own.find(({ quantity }) => quantity === name).dimension] : ""]);
    const value = (of, name) => own.find((one) => one.of === of && one.quantity === name)?.value;
    return [tableOf(`${capital(owner)}${owner === "patch" ? "es" : "s"}`, heads,
      parts.map((of) => [of || "all", columns.map((name) => digits(value(of, name)))]))];
  }));
}

/** The forces of the supports, whose rows add up to the loads. */
export function showSupports(root, { supports, balance }, units) {
  const rows = [...supports, ...balance.filter(({ of }) => of !== "supports")];
  const forces = (row) => ["x", "y", "z"].map((axis) => row[`force_${axis}`]);
  const most = Math.max(...rows.flatMap(forces).map(Math.abs));
  const name = ({ of, support, name: own, kind }) =>
    (of ? capital(of) : `${support} ${own === support ? kind : own}`);
  const unit = (kind) => (units.given ? units[kind] : "");
  const heads = [["Length", unit("length")], ...["x", "y", "z"].map((axis) => [axis, unit("force")])];
  const texts = (row) => [row.length ? digits(row.length, 3) : "",
    ...forces(row).map((x) => digits(Math.abs(x) > 1e-4 * most ? x : 0, 3))];
  root.replaceChildren(...(supports.length
    ? [tableOf("Forces of the supports", heads, rows.map((row) => [name(row), texts(row)]))] : []));
}

/** The answer of the mesh check. */
export function showCheck(root, check) {
  root.hidden = false;
  root.dataset.verdict = check.name;
  root.querySelector(".word").textContent = capital(`${check.word}: ${check.sentence}`);
  root.querySelector(".detail").textContent = capital(check.detail);
  root.querySelector("tbody").replaceChildren(...check.rows.flatMap(({ name, value, limit, order }) => {
    const title = order === null
      ? "No settled order" : `The error falls with order ${digits(order, 2)} of the edge length`;
    return [element("tr", element("th", { scope: "rowgroup", colSpan: 2 }, capital(name))),
      element("tr", { title }, element("td", value), element("td", limit))];
  }));
}

const FIELDS = {
  error({ error }) {
    const values = error.map((x) => 100 * x);
    return { values, ...centred(values, 1e-4) };
  },
  difference: ({ difference, underPressure }) =>
    ({ values: difference, ...centred(difference, 1e-12, underPressure), skipWalls: true }),
  family: ({ family }) => familyField(family),
  reactions(arrays) {
    const sizes = (all) => Float32Array.from({ length: all.length / 3 }, (_, v) => Math.hypot(...all.subarray(3 * v, 3 * v + 3)));
    const [values, points] = [sizes(arrays.reactions), sizes(arrays.points)];
    return { values, points, limits: [0, ends(values)[1] || 1], map: sequential, linesOnly: true };
  },
  curvature({ curvature, underPressure }) {
    let [low, high] = ends(curvature, underPressure);
    if (high - low <= 1e-5 * Math.max(Math.abs(low), Math.abs(high))) {
      [low, high] = [Math.min(0.9 * low, 1.1 * low), Math.max(0.9 * high, 1.1 * high)];
    }
    return { values: curvature, limits: [low, high], map: sequential, skipWalls: true };
  },
};

/** Values, limits and colour map of the chosen field; null for the patches' own colours. */
export const fieldOf = (choice, arrays) => (arrays[choice] ? FIELDS[choice](arrays) : null);

/** Limits as far on either side of zero, and a colour map with a middle. */
function centred(values, least, chosen) {
  const most = Math.max(least, ...ends(values, chosen).map(Math.abs));
  return { limits: [-most, most], map: diverging };
}

/** Least and greatest of the finite values. */
function ends(values, chosen = null) {
  let [low, high] = [Infinity, -Infinity];
  values.forEach((x, i) => {
    if (!Number.isFinite(x) || (chosen && !chosen[i])) return;
    low = Math.min(low, x);
    high = Math.max(high, x);
  });
  return low <= high ? [low, high] : [0, 1];
}

/** Arrows of the reactions per length, and blue ones of forces at points; the longest of each an eighth of the size. */
export function arrowsOf(arrays, field, size) {
  const arrows = [];
  const add = (sizes, vectors, most, colour) => sizes.forEach((x, v) => {
    if (!(x > 0.005 * most)) return;
    arrows.push([v, Array.from(vectors.subarray(3 * v, 3 * v + 3), (c) => (0.125 * size * c) / most), colour(x)]);
  });
  add(field.values, arrays.reactions, field.limits[1], (x) => colourOf(field.map, x, ...field.limits));
  add(field.points, arrays.points, ends(field.points)[1], () => [0.13, 0.4, 0.67]);
  return arrows;
}

/** The scale beside the surface: a bar, or a colour and its words for each class. */
export function showLegend(root, choice, field, units, than) {
  root.hidden = !field;
  if (!field) return;
  const [bar, limits] = [".bar", ".ends"].map((part) => root.querySelector(part));
  const [low, high] = field.limits;
  const most = ends(field.points ?? [])[1];
  const points = field.points?.some((x) => x > 0) ? `; blue: at points, up to ${digits(most, 3)} ${units.force}` : "";
  root.querySelector(".name").textContent = (field.name ?? COLOURS[choice].name(units, than)) + points;
  root.querySelector("ul").replaceChildren(...(field.scale ?? []).map(({ colour, text }) => {
    const item = element("li", element("span"), text);
    item.firstChild.style.background = colour;
    return item;
  }));
  bar.hidden = limits.hidden = Boolean(field.scale);
  bar.style.background = field.map.css;
  [low, (low + high) / 2, high].forEach((x, k) => { limits.children[k].textContent = digits(x, 3); });
}
