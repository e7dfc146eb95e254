// A card for each patch, cable and room, with a slider and a number for each of its values.

import { element, input } from "./elements.js";

const STEPS = 1000;
const ROOM = 2; // times a value beyond the slider's end: where it ends then
const AXES = ["x", "y", "z"];
const QUANTITIES = {
  tensions: { label: "Tension α", unit: "tension" },
  pressures: { label: "Pressure p", unit: "pressure" },
  snows: { label: "Snow s", unit: "pressure" },
  weights: { label: "Weight w", unit: "pressure" },
  cables: { label: "Tension τ", unit: "force" },
  volumes: { label: "Volume V", unit: "volume" },
};

/** Four digits, without trailing zeros. */
export function digits(x, count = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x !== 0 && (Math.abs(x) >= 1e6 || Math.abs(x) < 1e-4)) return x.toExponential(count - 2);
  return String(Number(x.toPrecision(count)));
}

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
  constructor(root, { controls, patches, values, units }, together, changed) {
    Object.assign(this, { units, together, changed, rows: [] });
    const tensions = Object.values({ ...values.asked.tensions, ...values.asked.cables });
    this.usual = Math.max(...tensions) || 1;
    root.replaceChildren(...controls.map((group, i) => this.card(group, i, patches, values.asked)));
  }

  card(group, index, patches, asked) {
    const card = element("fieldset");
    const legend = element("legend");
    const head = element("span", "head");
    const target = element("span", "target");
    if (group.patch !== null) {
      const swatch = element("span", "swatch");
      const { color } = patches[group.patch];
      swatch.style.background = `rgb(${color.map((c) => Math.round(255 * c)).join(" ")})`;
      head.append(swatch);
    }
    head.append(element("span", "name", group.name), target);
    legend.append(head);
    card.append(legend, ...group.kinds.map((kind) => (kind === "points" ? this.point(group, asked)
      : this.row(group, index, kind, asked[kind][group.name], target))));
    return card;
  }

  /** A single held point: three numbers, which dragging it in the picture changes, too. */
  point(group, asked) {
    const row = element("div", "point");
    const entry = { group, kind: "points", value: asked.points[group.name] };
    entry.numbers = AXES.map((axis, k) => {
      const number = input("number", `${axis} of ${group.name}`, { step: "any" });
      number.addEventListener("change", () => {
        const place = entry.value.map((x, i) => (i === k && Number.isFinite(number.valueAsNumber) ? number.valueAsNumber : x));
        this.movePoint(group.name, place, true);
      });
      return number;
    });
    row.append(...entry.numbers.flatMap((number, k) => [element("span", "", AXES[k]), number]));
    this.rows.push(entry);
    this.put(entry, entry.value);
    return row;
  }

  movePoint(name, place, final) {
    this.put(this.rows.find((row) => row.kind === "points" && row.group.name === name), place);
    this.changed(final);
  }

  row(group, index, kind, value, target) {
    const row = element("div", "slider");
    const { label: text, unit } = QUANTITIES[kind];
    const name = `${text} of ${group.name}`;
    const id = `${kind}-${index}`;
    const label = element("label", "", text);
    label.htmlFor = id;
    label.title = this.units[unit];
    const track = element("span", "track");
    const shown = element("span", "shown");
    shown.hidden = true;
    const slider = input("range", name, { id, min: 0, max: STEPS, step: 1 });
    const number = input("number", `${name}, as a number`, { step: "any" });
    track.append(slider, shown);
    row.append(label, track, number);
    const evenly = group.wall || kind === "cables";
    const entry = {
      group, index, kind, slider, number, shown, target, value, range: new Range(value, evenly, this.usual),
    };
    this.rows.push(entry);
    slider.addEventListener("input", () => this.change(entry, entry.range.value(slider.value), false));
    slider.addEventListener("change", () => this.changed(true));
    number.addEventListener("change", () => {
      if (number.value.trim() === "" || !Number.isFinite(number.valueAsNumber)) {
        this.put(entry, entry.value);
      } else {
        this.change(entry, number.valueAsNumber, true);
      }
    });
    return row;
  }

  /** The user changes a value; similar patches change by the same ratio if the box is checked. */
  change(entry, value, final) {
    const ratio = entry.value ? value / entry.value : 1;
    if (this.together.checked) {
      for (const other of this.rows) {
        const similar = other.kind === entry.kind && other.group.wall === entry.group.wall;
        if (similar && other !== entry) {
          this.put(other, entry.value ? other.value * ratio : value);
        }
      }
    }
    this.put(entry, value, !final);
    this.changed(final);
  }

  put(entry, value, moving = false) {
    entry.value = value;
    if (entry.numbers) {
      entry.numbers.forEach((number, k) => { number.value = digits(value[k], 6); });
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
    const curved = alpha !== undefined && p !== undefined && w === undefined;
    entry.target.textContent = entry.group.wall ? "wall" : curved ? `${s ? `p − s = ${digits(p - s)}, H̄ =` : "H̄ = p / 2α ="} ${digits((p - (s ?? 0)) / (2 * alpha), 3)}` : "";
  }

  /** Show the values asked for; where the surface shown has others, mark them. */
  show({ asked, shown }, all) {
    for (const entry of this.rows) {
      const wanted = asked[entry.kind][entry.group.name];
      const has = shown[entry.kind][entry.group.name];
      if (wanted === undefined || has === undefined) continue; // a patch without pressure has become a wall
      if (all) this.put(entry, wanted);
      if (entry.numbers) continue;
      const part = entry.range.place(has) / STEPS;
      entry.shown.hidden = Math.abs(has - wanted) <= 1e-9 * Math.abs(wanted);
      entry.shown.style.left = `calc(8px + ${part} * (100% - 16px) - 1px)`;
      entry.shown.title = `the surface shown has ${digits(has)}`;
    }
  }

  /** The values for the server. */
  values() {
    const values = {};
    for (const { group, kind, value } of this.rows) (values[kind] ??= {})[group.name] = value;
    return values;
  }
}
