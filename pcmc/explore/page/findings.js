// The verdict, the numbers of the surface, and the fields that colours show.

import { colourOf, diverging, sequential } from "./colours.js";
import { element, tableRow, term } from "./elements.js";
import { familyField, showClasses } from "./families.js";
import { digits } from "./panel.js";

const SIGNS = {
  stable: "✓", neutral: "≈", saddle: "⤢", not_converged: "…", no_equilibrium: "✕", ran_away: "↗",
  undecided: "?", wall_down: "⤓", degenerate: "△", opening: "…",
};

export const COLOURS = {
  patches: { label: "Patches" },
  curvature: { label: "Mean curvature", name: (u) => `Mean curvature H, ${u.curvature} (walls grey)` },
  error: { label: "Curvature error", name: () => "Error (H − H̄) / H̄ of Meyer's mean curvature, %" },
  reactions: { label: "Reactions", name: (u) => `Reaction of the supports, ${u.tension}` },
  family: { label: "Panels" }, // the field has its own name
  difference: { label: "Difference", name: (u, than) => `Distance from ${than}, ${u.length}; positive outside it` },
};

/** The card that is always in view. */
export function showVerdict(root, header) {
  const { verdict, at_rest: atRest } = header;
  const sentence = verdict.name === "not_converged" && !atRest
    ? "pcmc found no surface at rest for these values" : verdict.sentence;
  root.dataset.verdict = verdict.name;
  root.querySelector(".sign").textContent = SIGNS[verdict.name] || "?";
  root.querySelector(".word").textContent = verdict.word;
  root.querySelector(".sentence").textContent = capital(sentence);
  root.querySelector(".detail").textContent = [verdict.detail, atRest ? header.way : drawn(header)]
    .filter(Boolean).map((part) => `${capital(part)}.`).join(" ");
}

/** Which surface the page shows if there is none for the values asked for. */
function drawn({ asked, shown }) {
  const near = (a, b) => Math.abs(a - b) <= 1e-9 * Math.abs(b);
  const values = shown.flatMap((p, i) => [["tension", "α"], ["pressure", "p"]]
    .filter(([kind]) => !near(p[kind], asked[i][kind]))
    .map(([kind, sign]) => `${p.name} ${sign} = ${digits(p[kind])}`));
  if (!values.length) return "Shown: the surface as given";
  const listed = values.slice(0, 3).join(", ") + (values.length > 3 ? ", …" : "");
  return `Shown: the last surface at rest, ${listed}`;
}

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Numbers of the surface shown. */
export function showFindings(body, findings, units) {
  const measured = (x, kind, count) => digits(x, count) + (units.given && x !== null ? ` ${units[kind]}` : "");
  const percent = (x) => (x === null ? "–" : x < 1e-6 ? "below 0.0001 %" : `${digits(100 * x, 3)} %`);
  const rows = [
    ["Rise above the plane", measured(findings.height, "length"), `The largest height above the plane Π, ${units.length}.`],
    ["Area under pressure", measured(findings.area, "area"), `Of all patches except walls, ${units.area}.`],
    ["Volume", measured(findings.volume, "volume"), `Between the patches with pressure and the plane Π, ${units.volume}.`],
    ["Energy", measured(findings.energy, "energy", 6), `Σ α A − Σ p V, ${units.energy}. A surface at rest has no nearby shape of other first-order energy; a stable one has the least.`],
    ["Morse index", findings.index ?? "–", "How many independent changes of shape lower the energy. 0: stable, every small push is resisted. 1 or more: a saddle, which a small push moves away from."],
    ["Load over capacity", percentOf(findings.load_ratio), "The pressure's total push, as a part of the most that the tensions along the supports can carry, when all of them pull straight down. Above 100 % no equilibrium exists: raise tensions or lower pressures."],
    ["Largest error of H", percent(findings.curvature_error), "The mean curvature that balances the forces at each vertex, against H̄ = p / 2α. Exact at rest."],
    ["Error by Meyer's measure", percent(findings.curvature_error_cotangent), "Meyer's measure reads the mean curvature from the angles of the triangles, with Voronoi areas, as in the paper's figures. It differs from H̄ by an error of the mesh, which finer triangles reduce."],
    ["Worst triangle", digits(findings.quality, 3), "4√3 area / Σ edge²: 1 is equilateral, 0 degenerate."],
    ["Residual", digits(findings.residual, 3), "The unbalanced forces, relative to the forces of single triangles. Below 1e-8 the surface counts as at rest."],
  ];
  if (findings.pinched) {
    rows.push(["Pinched wall", `${findings.pinched} vertices`, "Here the valley between two patches has come down to the plane: it rests there, and the wall below it has no height."]);
  }
  for (const room of findings.rooms) {
    rows.push([`Pressure of ${room.room}`, measured(room.pressure, "pressure"), "The volume of this room is prescribed; its pressure is the result."]);
  }
  const open = new Set([...body.querySelectorAll("details[open] summary")].map((s) => s.textContent));
  body.replaceChildren(...rows.map(([name, text, meaning]) => {
    const explained = term(name, meaning);
    explained.open = open.has(name);
    return tableRow(explained, [text]);
  }));
}

/** Apex, area, volume and largest reaction of each patch. */
export function showPatches(table, measures, units) {
  const columns = [["apex", "Apex", "length"], ["area", "Area", "area"], ["volume", "Volume", "volume"],
    ["reaction", "Reaction", "tension"]];
  const head = element("tr");
  head.append(element("td"), ...columns.map(([, name, kind]) => {
    const th = element("th", "", name);
    th.scope = "col";
    if (kind === "volume") th.title = "Between the patch and the plane Π, straight below it; the volumes of all patches add up to the volume of the roof";
    if (units.given) th.append(element("span", "unit", units[kind]));
    return th;
  }));
  table.tHead.replaceChildren(head);
  const rows = new Map();
  for (const { quantity, of, value } of measures) {
    if (!columns.some(([name]) => name === quantity)) continue;
    if (quantity === "apex") rows.set(of, {});
    if (rows.has(of)) rows.get(of)[quantity] = value;
  }
  if (rows.size === 2) rows.delete(""); // the only patch is all
  table.tBodies[0].replaceChildren(...[...rows].map(([of, row]) => tableRow(of || "all",
    columns.map(([name]) => digits(row[name])))));
}

/** The answer of the mesh check. */
export function showCheck(root, check) {
  root.hidden = false;
  root.dataset.verdict = check.name;
  root.querySelector(".word").textContent = capital(`${check.word}: ${check.sentence}`);
  root.querySelector(".detail").textContent = capital(check.detail);
  root.querySelector("tbody").replaceChildren(...check.rows.flatMap(({ name, value, limit, order }) => {
    const [title, values] = [document.createElement("tr"), document.createElement("tr")];
    values.title = order === null ? "No settled order" : `The error falls with order ${digits(order, 2)} of the edge length`;
    const head = document.createElement("th");
    Object.assign(head, { scope: "rowgroup", colSpan: 2, textContent: capital(name) });
    title.append(head);
    values.append(...[value, limit].map((text) => {
      const cell = document.createElement("td");
      cell.textContent = text;
      return cell;
    }));
    return [title, values];
  }));
}

const percentOf = (x) => (x === null ? "–" : `${digits(100 * x, 3)} %`);

/** Values, limits and colour map of the chosen field; null for the patches' own colours. */
export function fieldOf(choice, arrays) {
  if (choice === "patches" || !arrays[choice]) return null;
  if (choice === "error") {
    const values = arrays.error.map((x) => 100 * x);
    const most = Math.max(1e-4, ...ends(values).map(Math.abs));
    return { values, limits: [-most, most], map: diverging };
  }
  if (choice === "difference") {
    const most = Math.max(1e-12, ...ends(arrays.difference, arrays.underPressure).map(Math.abs));
    return { values: arrays.difference, limits: [-most, most], map: diverging, skipWalls: true };
  }
  if (choice === "family") return familyField(arrays.family);
  if (choice === "reactions") {
    const sizes = (all) => Float32Array.from({ length: all.length / 3 }, (_, v) => Math.hypot(...all.subarray(3 * v, 3 * v + 3)));
    const [values, points] = [sizes(arrays.reactions), sizes(arrays.points)];
    return { values, points, limits: [0, ends(values)[1] || 1], map: sequential, linesOnly: true };
  }
  let [low, high] = ends(arrays.curvature, arrays.underPressure);
  if (high - low <= 1e-5 * Math.max(Math.abs(low), Math.abs(high))) {
    [low, high] = [Math.min(0.9 * low, 1.1 * low), Math.max(0.9 * high, 1.1 * high)];
  }
  return { values: arrays.curvature, limits: [low, high], map: sequential, skipWalls: true };
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

/** The scale beside the surface. */
export function showLegend(root, choice, field, units, than) {
  root.hidden = !field;
  if (!field) return;
  const [low, high] = field.limits;
  const most = ends(field.points ?? [])[1];
  const points = field.points?.some((x) => x > 0) ? `; blue: at points, up to ${digits(most, 3)} ${units.force}` : "";
  root.querySelector(".name").textContent = (field.name ?? COLOURS[choice].name(units, than)) + points;
  showClasses(root.querySelector("ul"), field.scale);
  for (const part of [".bar", ".ends"]) root.querySelector(part).hidden = Boolean(field.scale);
  root.querySelector(".bar").style.background = field.map.css;
  root.querySelector(".low").textContent = digits(low, 3);
  root.querySelector(".middle").textContent = digits((low + high) / 2, 3);
  root.querySelector(".high").textContent = digits(high, 3);
}
