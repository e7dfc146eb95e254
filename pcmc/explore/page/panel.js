// A card for each patch, cable and room, with a slider and a number for each of its values.

import { coordinate, digits, element, numberField } from "./elements.js";

const STEPS = 1000;
const ROOM = 2; // times a value beyond the slider's end: where it ends then
const AXES = ["x", "y", "z"];
export const QUANTITIES = {
  tensions: { label: "Tension α", unit: "tension" },
  pressures: { label: "Pressure p", unit: "pressure" },
  snows: { label: "Snow s", unit: "pressure" },
  weights: { label: "Weight w", unit: "pressure" },
  cables: { label: "Tension τ", unit: "force" },
  cable_weights: { label: "Weight g", unit: "tension" },
  volumes: { label: "Volume V", unit: "volume" },
};

/** Slider positions 0..STEPS for values: by ratio for values that cannot be zero, else evenly. */
class Range {
  constructor(value, evenly, usual) {
    if (evenly || value === 0) this.spread(0, 3 * (value || usual));
    else Object.assign(this, { evenly: false, low: value / 4, high: value * 4 });
  }

  spread(one, other) {
    Object.assign(this, { evenly: true, low: Math.min(one, other), high: Math.max(one, other) });
  }

  /** Make room for a value, and some on its other side; zero and a change of sign need an even scale. */
  widen(value) {
    if (!this.evenly && !(value / this.low > 0)) this.spread(this.low, this.high);
    const beyond = ROOM * value;
    if (this.evenly) {
      if (value < this.low) this.low = beyond;
      if (value > this.high) this.high = beyond;
    } else {
      if (Math.abs(value) < Math.abs(this.low)) this.low = value / ROOM;
      if (Math.abs(value) > Math.abs(this.high)) this.high = beyond;
    }
  }

  /** The value at a position, as the number beside the slider shows it. */
  value(place) {
    const part = place / STEPS;
    const value = this.evenly
      ? this.low + part * (this.high - this.low) : this.low * (this.high / this.low) ** part;
    return Number(value.toPrecision(4));
  }

  place(value) {
    const part = this.evenly
      ? (value - this.low) / (this.high - this.low)
      : Math.log(value / this.low) / Math.log(this.high / this.low);
    return Math.round(STEPS * Math.min(1, Math.max(0, part)));
  }
}

export class Panel {
  /** `changed(final)` is called while a value changes, and with true when the change is done. */
  constructor(root, { controls, patches, size, values, units }, together, changed) {
    Object.assign(this, { size, units, together, changed, rows: [] });
    const tensions = Object.values({ ...values.asked.tensions, ...values.asked.cables });
    this.usual = Math.max(...tensions) || 1;
    root.replaceChildren(...controls.map((group, i) => this.card(group, i, patches, values.asked)));
  }

  card(group, index, patches, asked) {
    const follows = group.patch !== null && !group.kinds.includes("tensions");
    const target = element("span.target", follows ? "follows the sheet above" : "");
    const head = element("span.head", element("span.name", group.name), target);
    if (group.patch !== null) {
      const swatch = element("span.swatch");
      swatch.style.background = `rgb(${patches[group.patch].color.map((c) => Math.round(255 * c)).join(" ")})`;
      head.prepend(swatch);
    }
    return element("fieldset", element("legend", head), ...group.kinds.map((kind) => (kind === "points"
      ? this.point(group, asked) : this.row(group, index, kind, asked[kind][group.name] ?? 0, target))));
  }

  /** A single held point: three numbers, which dragging it in the picture changes, too. */
  point(group, asked) {
    const entry = { group, kind: "points", value: asked.points[group.name] };
    entry.numbers = AXES.map((axis, k) => numberField(`${axis} of ${group.name}`, {
      onchange: ({ target: { valueAsNumber: x } }) =>
        this.movePoint(group.name, Number.isFinite(x) ? entry.value.with(k, x) : entry.value, true),
    }));
    this.rows.push(entry);
    this.put(entry, entry.value);
    return element("div.point", ...entry.numbers.flatMap((number, k) => [element("span", AXES[k]), number]));
  }

  movePoint(name, place, final) {
    this.put(this.rows.find((row) => row.kind === "points" && row.group.name === name), place);
    this.changed(final);
  }

  row(group, index, kind, value, target) {
    const { label: text, unit } = QUANTITIES[kind];
    const [name, id] = [`${text} of ${group.name}`, `${kind}-${index}`];
    const shown = element("span.shown", { hidden: true });
    const range = new Range(value, group.wall || kind === "cables", this.usual);
    const entry = { group, index, kind, shown, target, value, range };
    entry.slider = element("input", {
      type: "range", "aria-label": name, id, min: 0, max: STEPS, step: 1,
      oninput: () => this.change(entry, range.value(entry.slider.value), false),
      onchange: () => this.changed(true),
    });
    entry.number = numberField(`${name}, as a number`, {
      onchange: ({ target: { valueAsNumber: x } }) =>
        (Number.isFinite(x) ? this.change(entry, x, true) : this.put(entry, entry.value)),
    });
    this.rows.push(entry);
    return element("div.slider", element("label", { htmlFor: id, title: this.units[unit] }, text),
      element("span.track", entry.slider, shown), entry.number);
  }

  /** The user changes a value; similar patches change by the same ratio if the box is checked. */
  change(entry, value, final) {
    const ratio = entry.value ? value / entry.value : 1;
    if (this.together.checked) {
      for (const other of this.rows) {
        const similar = other.kind === entry.kind && other.group.wall === entry.group.wall;
        if (similar && other !== entry) this.put(other, entry.value ? other.value * ratio : value);
      }
    }
    this.put(entry, value, !final);
    this.changed(final);
  }

  put(entry, value, moving = false) {
    entry.value = value;
    if (entry.numbers) {
      entry.numbers.forEach((number, k) => { number.value = coordinate(value[k], this.size, 6); });
      return;
    }
    if (!moving) {
      entry.range.widen(value);
      entry.slider.value = entry.range.place(value);
    }
    entry.number.value = digits(value, 6);
    entry.slider.setAttribute("aria-valuetext", digits(value, 6));
    const mine = this.rows.filter((r) => r.index === entry.index);
    const [alpha, p, s, w] = ["tensions", "pressures", "snows", "weights"]
      .map((k) => mine.find((r) => r.kind === k)?.value);
    if (alpha === undefined) return;
    const curved = p !== undefined && w === undefined;
    const net = s ? `p − s = ${digits(p - s)}, H̄ =` : "H̄ = p / 2α =";
    entry.target.textContent = entry.group.wall ? "wall"
      : curved ? `${net} ${digits((p - (s ?? 0)) / (2 * alpha), 3)}` : "";
  }

  /** Show the values asked for; where the surface shown has others, mark them. */
  show({ asked, shown }, all) {
    for (const entry of this.rows) {
      const [wanted, has] = [asked, shown].map((values) => values[entry.kind][entry.group.name] ?? 0);
      if (all) this.put(entry, wanted);
      if (entry.numbers) continue;
      const part = entry.range.place(has) / STEPS;
      entry.shown.hidden = Math.abs(has - wanted) <= 1e-9 * Math.abs(wanted);
      entry.shown.style.left = `calc(8px + ${part} * (100% - 16px) - 1px)`;
      entry.shown.title = `the surface shown has ${digits(has)}`;
    }
  }

  /** Whether each of these values has its row: a snow or weight of zero has none. */
  covers(values) {
    return Object.entries(values).every(([kind, named]) => Object.keys(named).every(
      (name) => this.rows.some((row) => row.kind === kind && row.group.name === name)));
  }

  /** The values for the server. */
  values() {
    const values = {};
    for (const { group, kind, value } of this.rows) (values[kind] ??= {})[group.name] = value;
    return values;
  }
}
