// Elements of the page, made in one line each.

export function element(tag, kind = "", text = "") {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  if (text !== "") made.textContent = text;
  return made;
}

export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

export function input(type, name, attributes = {}) {
  const made = element("input");
  made.type = type;
  made.setAttribute("aria-label", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

export function button(text, clicked, name = "") {
  const made = element("button", "", text);
  made.type = "button";
  if (name) made.setAttribute("aria-label", name);
  made.addEventListener("click", clicked);
  return made;
}

export function select(name, options) {
  const made = element("select");
  made.setAttribute("aria-label", name);
  made.append(...options.map(([value, text]) => Object.assign(element("option", "", text), { value })));
  return made;
}

/** A row of a table: its head, and a cell for each further text or node. */
export function tableRow(head, cells, title = "") {
  const row = element("tr");
  const th = element("th");
  th.scope = "row";
  th.append(head);
  if (title) row.title = title;
  row.append(th, ...cells.map((cell) => {
    const td = element("td");
    td.append(cell);
    return td;
  }));
  return row;
}

/** A term whose meaning opens below it, by mouse and keys. */
export function term(name, meaning) {
  const details = element("details", "term");
  details.append(element("summary", "", name), element("p", "", meaning));
  return details;
}
