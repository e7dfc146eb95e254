// The verdict, the numbers of the surface, and the fields that colours show.

import { colourOf, diverging, sequential } from "./colours.js";
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
  root.querySelector(".detail").textContent = [verdict.detail, atRest ? "" : drawn(header)]
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
    ["Rise above the plane", measured(findings.height, "length"), `Largest height above the plane Π, ${units.length}`],
    ["Area under pressure", measured(findings.area, "area"), `Of all patches except walls, ${units.area}`],
    ["Volume", measured(findings.volume, "volume"), `Under the patches with pressure, ${units.volume}`],
    ["Energy", measured(findings.energy, "energy", 6), `Σ α A − Σ p V, ${units.energy}`],
    ["Morse index", findings.index ?? "–", "Independent changes of shape that lower the energy; 0 is stable"],
    ["Load over capacity", percentOf(findings.load_ratio), "The pressure, as a part of the most that the tension of the boundary can carry; above 100 % no equilibrium exists"],
    ["Largest error of H", percent(findings.curvature_error), "Variational mean curvature against p / 2α; exact at rest"],
    ["… by Meyer's measure", percent(findings.curvature_error_cotangent), "As in the paper's figures; smaller on finer meshes"],
    ["Worst triangle", digits(findings.quality, 3), "4√3 area / Σ edge²: 1 is equilateral, 0 degenerate"],
    ["Residual", digits(findings.residual, 3), "Unbalanced forces, relative to the forces of single triangles"],
  ];
  if (findings.pinched) {
    rows.push(["Wall resting on the plane", `${findings.pinched} vertices`, "Here the valley touches the plane and the wall has no height"]);
  }
  body.replaceChildren(...rows.map(([name, text, title]) => {
    const row = document.createElement("tr");
    row.title = title;
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = name;
    const cell = document.createElement("td");
    cell.textContent = text;
    row.append(head, cell);
    return row;
  }));
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
  if (choice === "reactions") {
    const values = new Float32Array(arrays.reactions.length / 3);
    for (let v = 0; v < values.length; v++) {
      values[v] = Math.hypot(...arrays.reactions.subarray(3 * v, 3 * v + 3));
    }
    return { values, limits: [0, ends(values)[1] || 1], map: sequential, linesOnly: true };
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

/** Arrows of the reactions per length, the longest an eighth of the surface's size. */
export function arrowsOf(arrays, field, size) {
  const arrows = [];
  const stretch = (0.125 * size) / field.limits[1];
  field.values.forEach((x, v) => {
    if (!Number.isFinite(x) || x <= 0.005 * field.limits[1]) return;
    const vector = Array.from(arrays.reactions.subarray(3 * v, 3 * v + 3), (c) => c * stretch);
    arrows.push([v, vector, colourOf(field.map, x, ...field.limits)]);
  });
  return arrows;
}

/** The scale beside the surface. */
export function showLegend(root, choice, field, units) {
  root.hidden = !field;
  if (!field) return;
  const [low, high] = field.limits;
  root.querySelector(".name").textContent = COLOURS[choice].name(units);
  root.querySelector(".bar").style.background = field.map.css;
  root.querySelector(".low").textContent = digits(low, 3);
  root.querySelector(".middle").textContent = digits((low + high) / 2, 3);
  root.querySelector(".high").textContent = digits(high, 3);
}
