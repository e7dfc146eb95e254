// A card for each patch, with a slider and a number for its tension and its pressure.

const STEPS = 1000;
const QUANTITIES = { tension: "Tension α", pressure: "Pressure p" };

/** Four digits, without trailing zeros. */
export function digits(x, count = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x !== 0 && (Math.abs(x) >= 1e6 || Math.abs(x) < 1e-4)) return x.toExponential(count - 2);
  return String(Number(x.toPrecision(count)));
}

/** Slider positions 0..STEPS for values: by ratio for values that cannot be zero, evenly for walls. */
class Range {
  constructor(value, evenly, usual) {
    this.evenly = evenly || value === 0;
    if (this.evenly) [this.low, this.high] = [0, 3 * (value || usual)];
    else [this.low, this.high] = [value / 4, value * 4];
  }

  widen(value) {
    if (this.evenly) this.high = Math.max(this.high, value);
    else if (value / this.low > 0) {
      const by = value / this.low < 1 || value / this.high > 1;
      if (by && Math.abs(value) < Math.abs(this.low)) this.low = value;
      if (by && Math.abs(value) > Math.abs(this.high)) this.high = value;
    }
  }

  value(place) {
    const part = place / STEPS;
    return this.evenly
      ? this.low + part * (this.high - this.low) : this.low * (this.high / this.low) ** part;
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
  constructor(root, patches, asked, together, changed, units) {
    this.units = units;
    this.patches = patches;
    this.together = together;
    this.changed = changed;
    this.rows = [];
    const usual = Math.max(...asked.map((p) => p.tension));
    root.replaceChildren(...patches.map((patch, i) => this.card(patch, i, asked[i], usual)));
  }

  card(patch, index, asked, usual) {
    const card = document.createElement("fieldset");
    const legend = element("legend", "");
    const head = element("span", "head");
    const swatch = element("span", "swatch");
    swatch.style.background = `rgb(${patch.color.map((c) => Math.round(255 * c)).join(" ")})`;
    const target = element("span", "target");
    head.append(swatch, element("span", "name", patch.name), target);
    legend.append(head);
    card.append(legend);
    const kinds = patch.wall ? ["tension"] : ["tension", "pressure"];
    for (const kind of kinds) {
      card.append(this.row(patch, index, kind, asked[kind], target, usual));
    }
    return card;
  }

  row(patch, index, kind, value, target, usual) {
    const row = element("div", "slider");
    const name = `${QUANTITIES[kind]} of ${patch.name}`;
    const id = `${kind}-${index}`;
    const label = element("label", "", QUANTITIES[kind]);
    label.htmlFor = id;
    label.title = this.units[kind];
    const track = element("span", "track");
    const shown = element("span", "shown");
    shown.hidden = true;
    const slider = input("range", name, { id, min: 0, max: STEPS, step: 1 });
    const number = input("number", `${name}, as a number`, { step: "any" });
    track.append(slider, shown);
    row.append(label, track, number);
    const entry = {
      patch, index, kind, slider, number, shown, target, value,
      range: new Range(value, patch.wall, usual),
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
        const similar = other.kind === entry.kind && other.patch.wall === entry.patch.wall;
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
    if (!moving) {
      entry.range.widen(value);
      entry.slider.value = entry.range.place(value);
    }
    entry.number.value = digits(value);
    entry.slider.setAttribute("aria-valuetext", digits(value));
    const mine = this.rows.filter((r) => r.index === entry.index);
    const [alpha, p] = ["tension", "pressure"].map((k) => mine.find((r) => r.kind === k)?.value);
    entry.target.textContent = p === undefined ? "wall" : `H̄ = p / 2α = ${digits(p / (2 * alpha), 3)}`;
  }

  /** Show these values; where the surface shown has others, mark them. */
  show(asked, shown, all) {
    for (const entry of this.rows) {
      const wanted = asked[entry.index][entry.kind];
      if (all) this.put(entry, wanted);
      const has = shown[entry.index][entry.kind];
      const part = entry.range.place(has) / STEPS;
      entry.shown.hidden = Math.abs(has - wanted) <= 1e-9 * Math.abs(wanted);
      entry.shown.style.left = `calc(8px + ${part} * (100% - 16px) - 1px)`;
      entry.shown.title = `the surface shown has ${digits(has)}`;
    }
  }

  /** The values for the server. */
  values() {
    const values = { tensions: {}, pressures: {} };
    for (const { patch, kind, value } of this.rows) values[`${kind}s`][patch.name] = value;
    return values;
  }
}

function element(tag, kind, text = "") {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  if (text) made.textContent = text;
  return made;
}

function input(type, name, attributes) {
  const made = document.createElement("input");
  made.type = type;
  made.setAttribute("aria-label", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}
