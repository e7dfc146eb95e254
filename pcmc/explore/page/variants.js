// Variants: surfaces kept side by side, their numbers, and the differences from one of them.

import { button, capital, element, tableRow } from "./elements.js";
import { digits } from "./panel.js";

/** The row that begins the rows of a patch, or of all, across the table. */
function heading(text, kind = "part") {
  const row = tableRow(element("span", kind, text), []);
  row.firstChild.colSpan = 5;
  return row;
}

export class Variants {
  /** `act(name, body)` asks the server; `picture()` is the canvas to copy small, or null. */
  constructor(root, act, picture) {
    Object.assign(this, { root, act, picture, pictures: new Map() });
    const form = root.querySelector("form");
    const name = form.querySelector("input");
    form.onsubmit = (event) => {
      event.preventDefault();
      const chosen = name.value.trim() || this.nextName();
      this.pictures.set(chosen, this.thumbnail());
      name.value = "";
      act("keep", { name: chosen });
    };
  }

  nextName() {
    const taken = new Set(this.header.variants.map((v) => v.name));
    let number = 1;
    while (taken.has(`Variant ${number}`)) number += 1;
    return `Variant ${number}`;
  }

  thumbnail() {
    const canvas = this.picture();
    if (!canvas) return "";
    const small = element("canvas");
    small.width = 160;
    small.height = Math.round((160 * canvas.height) / canvas.width);
    small.getContext("2d").drawImage(canvas, 0, 0, small.width, small.height);
    return small.toDataURL();
  }

  show(header, units) {
    this.header = header;
    const { variants, compared, figures } = header;
    this.root.querySelector("ul").replaceChildren(...variants.map((variant, k) => this.item(variant, k, compared)));
    const table = this.root.querySelector("table");
    table.hidden = compared === null;
    if (compared === null) return;
    const other = variants[compared];
    table.querySelector("caption").textContent = `Differences from ${other.name}`;
    const key = (row) => `${row.quantity} ${row.of} ${row.owner}`;
    const before = new Map(other.figures.map((row) => [key(row), row.value]));
    const rows = figures.filter((row) => before.has(key(row)) && row.value !== null && before.get(key(row)) !== null);
    const changed = rows.filter((row) => digits(row.value) !== digits(before.get(key(row))));
    const difference = (row) => {
      const then = before.get(key(row));
      const change = row.value - then;
      const signed = (x) => `${x > 0 ? "+" : ""}${digits(x, 2)}`;
      const head = element("span", "", capital(row.quantity));
      if (units.given) head.append(element("span", "unit", ` ${units[row.dimension]}`));
      return tableRow(head, [
        digits(then), digits(row.value), signed(change), then ? signed((100 * change) / Math.abs(then)) : "",
      ]);
    };
    const parts = ["", ...new Set(changed.map((row) => row.of).filter(Boolean))]; // all, then each
    const shown = parts.flatMap((part) => {
      const own = changed.filter((row) => row.of === part);
      return own.length ? [heading(part || "all"), ...own.map(difference)] : [];
    });
    const alike = rows.length - changed.length;
    const words = changed.length ? `${alike} more numbers are the same to four digits` : "No number differs in four digits";
    table.querySelector("tbody").replaceChildren(...shown, ...(alike ? [heading(words, "unit")] : []));
  }

  item(variant, number, compared) {
    const item = element("li");
    const picture = this.pictures.get(variant.name);
    if (picture) item.append(Object.assign(element("img"), { src: picture, alt: "", width: 80 }));
    const words = element("div", "words");
    const all = new Map(variant.figures.filter((row) => !row.of).map((row) => [row.quantity, row.value]));
    words.append(
      element("b", "", variant.name),
      element("p", "", `${variant.word}; apex ${digits(all.get("apex"))}, area ${digits(all.get("area"))}, volume ${digits(all.get("volume"))}`),
    );
    const on = compared === number;
    const compare = button(on ? "Comparing" : "Compare", () => this.act("compare", { number: on ? null : number }),
      `Compare the surface shown with ${variant.name}`);
    compare.setAttribute("aria-pressed", String(on));
    const acts = element("div", "row");
    acts.append(compare,
      button("Show", () => this.act("recall", { number }), `Show ${variant.name} again`),
      button("×", () => this.act("forget", { number }), `Remove ${variant.name}`));
    words.append(acts);
    item.append(words);
    return item;
  }
}
