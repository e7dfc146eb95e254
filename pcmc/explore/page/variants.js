// Variants: surfaces kept side by side, their numbers, and the differences from one of them.

import { button, capital, digits, element, tableOf } from "./elements.js";

export class Variants {
  pictures = new Map();

  /** `act(name, body)` asks the server; `picture()` is the canvas to copy small, or null. */
  constructor(root, act, picture) {
    Object.assign(this, { root, act, picture });
    const name = root.querySelector("form input");
    root.querySelector("form").onsubmit = (event) => {
      event.preventDefault();
      const chosen = name.value.trim() || this.nextName();
      this.pictures.set(chosen, this.thumbnail());
      name.value = "";
      act("keep", { name: chosen });
    };
  }

  nextName() {
    const taken = new Set(this.header.variants.map(({ name }) => name));
    let number = 1;
    while (taken.has(`Variant ${number}`)) number += 1;
    return `Variant ${number}`;
  }

  thumbnail() {
    const canvas = this.picture();
    if (!canvas) return "";
    const small = element("canvas", { width: 160, height: Math.round((160 * canvas.height) / canvas.width) });
    small.getContext("2d").drawImage(canvas, 0, 0, small.width, small.height);
    return small.toDataURL();
  }

  show(header, units) {
    this.header = header;
    const { variants, compared, figures } = header;
    this.root.querySelector("ul").replaceChildren(...variants.map((variant, k) => this.item(variant, k, compared)));
    const differences = this.root.querySelector(".differences");
    differences.replaceChildren();
    if (compared === null) return;
    const other = variants[compared];
    const key = ({ quantity, of, owner }) => `${quantity} ${of} ${owner}`;
    const values = new Map(other.figures.map((row) => [key(row), row.value]));
    const rows = figures.map((row) => ({ ...row, then: values.get(key(row)) }))
      .filter(({ value, then }) => value !== null && then !== null && then !== undefined);
    const changed = rows.filter(({ value, then }) => digits(value) !== digits(then));
    const signed = (x) => `${x > 0 ? "+" : ""}${digits(x, 2)}`;
    const difference = ({ quantity, dimension, value, then }) => {
      const unit = units.given ? [element("span.unit", ` ${units[dimension]}`)] : [];
      const percent = then ? signed((100 * (value - then)) / Math.abs(then)) : "";
      return [element("span", capital(quantity), ...unit),
        [digits(then), digits(value), signed(value - then), percent]];
    };
    const parts = ["", ...new Set(changed.map(({ of }) => of).filter(Boolean))]; // all, then each
    const shown = parts.flatMap((part) => {
      const own = changed.filter(({ of }) => of === part);
      return own.length ? [[element("span.part", part || "all")], ...own.map(difference)] : [];
    });
    const alike = rows.length - changed.length;
    const words = changed.length ? `${alike} more numbers are the same to four digits` : "No number differs in four digits";
    differences.append(tableOf(`Differences from ${other.name}`, [["Variant"], ["Shown"], ["Change"], ["%"]],
      [...shown, ...(alike ? [[element("span.unit", words)]] : [])]));
  }

  item({ name, word, figures }, number, compared) {
    const src = this.pictures.get(name);
    const all = new Map(figures.filter(({ of }) => !of).map(({ quantity, value }) => [quantity, digits(value)]));
    const on = compared === number;
    const compare = button(on ? "Comparing" : "Compare", () => this.act("compare", { number: on ? null : number }),
      `Compare the surface shown with ${name}`);
    compare.setAttribute("aria-pressed", String(on));
    const figuresShown = ["apex", "area", "volume"].map((one) => `${one} ${all.get(one) ?? "–"}`).join(", ");
    return element("li", ...(src ? [element("img", { src, alt: "", width: 80 })] : []), element("div.words",
      element("b", name), element("p", `${word}; ${figuresShown}`),
      element("div.row", compare,
        button("Show", () => this.act("recall", { number }), `Show ${name} again`),
        button("×", () => this.act("forget", { number }), `Remove ${name}`))));
  }
}
