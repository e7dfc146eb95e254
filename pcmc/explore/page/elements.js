// Elements of the page, made in one line each.

/** An element: "tag.class", then objects of properties, attributes and listeners, texts and nodes. */
export function element(name, ...parts) {
  const [tag, className = ""] = name.split(".");
  const made = Object.assign(document.createElement(tag), className && { className });
  for (const part of parts) {
    if (typeof part !== "object" || part instanceof Node) {
      made.append(part);
    } else {
      for (const [key, value] of Object.entries(part)) {
        if (key in made) made[key] = value;
        else made.setAttribute(key, value);
      }
    }
  }
  return made;
}

export const find = (selector) => document.querySelector(selector);
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Four digits, without trailing zeros. */
export function digits(x, count = 4) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  if (x !== 0 && (Math.abs(x) >= 1e6 || Math.abs(x) < 1e-4)) return x.toExponential(count - 1).replace(/\.?0+e/, "e");
  return String(Number(x.toPrecision(count)));
}

/** A coordinate in something of a size, to 1e-4 of it or finer: far from 0, digits of the number would not tell. */
export const coordinate = (x, size, count = 4) =>
  String(Number(x.toFixed(Math.max(0, count - Math.floor(Math.log10(size))))));

/** A field of one number, with a decimal point or comma: the browser's own makes 32 of "3,2" in English. */
export function numberField(name, attributes = {}) {
  const field = element("input.number", { type: "text", inputMode: "decimal", "aria-label": name }, attributes);
  const read = () => (field.value.trim() ? Number(field.value.replace(",", ".")) : NaN);
  return Object.defineProperty(field, "valueAsNumber", { get: read });
}

export const button = (text, onclick, name = text) =>
  element("button", { type: "button", onclick, ...(name !== text && { "aria-label": name }) }, text);

export const select = (name, options) =>
  element("select", { "aria-label": name },
    ...options.map(([value, text]) => element("option", { value }, text)));

/** A box or a radio button with its label; `chosen(checked)` is called when it changes. */
export function choice(type, label, checked, chosen, attributes) {
  const onchange = (event) => chosen(event.target.checked);
  return element("label", element("input", { type, checked, onchange }, attributes), label);
}

/** A row of a table: its head, across the table where there are no cells, and a cell for each text or node. */
export const tableRow = (head, cells = []) =>
  element("tr", element("th", { scope: "row", colSpan: cells.length ? 1 : 9 }, head),
    ...cells.map((cell) => element("td", cell)));

/** A table with a heading; columns are [name, unit], rows [name, texts], or [name] across the table. */
export function tableOf(title, columns, rows) {
  const heads = columns.map(([name, unit]) =>
    element("th", { scope: "col" }, name, ...(unit ? [element("span.unit", unit)] : [])));
  return element("table.parts", element("caption", title),
    element("thead", element("tr", element("td"), ...heads)),
    element("tbody", ...rows.map((row) => tableRow(...row))));
}
