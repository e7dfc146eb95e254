// The verdict, the numbers of the surface, and the fields that colours show.

import { colourOf, diverging, sequential } from "./colours.js";
import { capital, element, tableRow, term } from "./elements.js";
import { familyField, showClasses } from "./families.js";
import { digits } from "./panel.js";

const SIGNS = {
  stable: "✓", neutral: "≈", saddle: "⤢", not_converged: "…", no_equilibrium: "✕", ran_away: "↗",
  none_found: "↗", undecided: "?", wall_down: "⤓", degenerate: "△", opening: "…",
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

/** Numbers of the surface shown. */
export function showFindings(body, findings, figures, units) {
  const of = (name) => figures.find(({ owner, quantity }) => owner === "roof" && quantity === name)?.value;
  const measured = (x, kind, count) => digits(x, count) + (units.given && x !== null ? ` ${units[kind]}` : "");
  const percent = (x) => (x === null ? "–" : x < 1e-6 ? "below 0.0001 %" : `${digits(100 * x, 3)} %`);
  const rows = [
    ["Rise above the plane", measured(of("apex"), "length"), `The largest height above the plane Π, ${units.length}.`],
    ["Area under pressure", measured(of("area"), "area"), `Of all patches except walls, ${units.area}.`],
    ["Volume", measured(findings.volume, "volume"), `Between the patches with pressure and the plane Π, ${units.volume}.`],
    ["Energy", measured(findings.energy, "energy", 6), `Σ α A − Σ p V, ${units.energy}. A surface at rest has no nearby shape of other first-order energy; a stable one has the least.`],
    ["Morse index", findings.index ?? "–", "How many independent changes of shape lower the energy. 0: stable, every small push is resisted. 1 or more: a saddle, which a small push moves away from."],
    ["Load over capacity", percentOf(findings.load_ratio), "The pressure's total push, as a part of the most that the tensions along the supports can carry, when all of them pull straight down. Above 100 % no smooth surface stands on fixed edges alone: raise tensions or lower pressures."],
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

const COLUMNS = { // of the parts of a roof, in the order of their tables
  patch: ["apex", "area", "volume", "reaction per length", "snow", "net pressure"],
  wall: ["area", "lean"], cable: ["force", "length", "sag"], room: ["volume"],
};
const SHORT = { "reaction per length": "Reaction", "net pressure": "Net p" };

/** A table for the patches, the walls, the cables and the rooms, each with those of its quantities that are known. */
export function showParts(root, figures, units) {
  root.replaceChildren(...Object.entries(COLUMNS).flatMap(([owner, wanted]) => {
    const own = figures.filter((one) => one.owner === owner || (owner === "patch" && one.owner === "roof"));
    const parts = [...new Set(own.map(({ of }) => of))];
    if (parts.filter(Boolean).length < 1) return [];
    if (parts.length === 2 && parts.includes("")) parts.splice(parts.indexOf(""), 1); // the only patch is all
    const columns = wanted.filter((name) => own.some(({ quantity }) => quantity === name));
    const value = (of, name) => own.find((one) => one.of === of && one.quantity === name)?.value;
    return [tableOf(`${capital(owner)}${owner === "patch" ? "es" : "s"}`, columns.map((name) => {
      const { dimension } = own.find(({ quantity }) => quantity === name);
      return [SHORT[name] ?? capital(name), units.given ? units[dimension] : ""];
    }), parts.map((of) => [of || "all", columns.map((name) => digits(value(of, name)))]))];
  }));
}

/** The forces of the supports, whose rows add up to the loads. */
export function showSupports(root, { supports, balance }, units) {
  const rows = [...supports, ...balance.filter(({ of }) => of !== "supports")];
  const axes = ["x", "y", "z"];
  const most = Math.max(...rows.flatMap((row) => axes.map((axis) => Math.abs(row[`force_${axis}`]))));
  const force = (x) => digits(Math.abs(x) > 1e-4 * most ? x : 0, 3);
  root.replaceChildren(...(supports.length ? [tableOf("Forces of the supports",
    [["Length", units.given ? units.length : ""], ...axes.map((axis) => [axis, units.given ? units.force : ""])],
    rows.map((row) => [row.of ? capital(row.of) : `${row.support} ${row.name === row.support ? row.kind : row.name}`, [
      row.length ? digits(row.length, 3) : "",
      ...axes.map((axis) => force(row[`force_${axis}`]))]]))] : []));
}

/** A table with a heading; columns are [name, unit], rows [name, texts]. */
function tableOf(title, columns, rows) {
  const table = element("table", "parts");
  const head = element("tr");
  head.append(element("td"), ...columns.map(([name, unit]) => {
    const th = element("th", "", name);
    th.scope = "col";
    if (unit) th.append(element("span", "unit", unit));
    return th;
  }));
  table.createCaption().textContent = title;
  table.createTHead().append(head);
  table.createTBody().append(...rows.map(([name, texts]) => tableRow(name, texts)));
  return table;
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
