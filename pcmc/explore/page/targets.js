// Targets: quantities and the values wanted for them, and the tensions that may change for these.

import { button, capital, choice, digits, element, numberField, select } from "./elements.js";

const WORDS = {
  "reaction per length": "Largest reaction", pressure: "Pressure of a room", length: "Length of a cable",
  force: "Force in a cable",
};
const LIMITS = [["value", "="], ["at_most", "at most"], ["at_least", "at least"]];

export class Targets {
  rows = [];

  /** `meet(aims)` is called to meet them, `stop()` to give up. */
  constructor(root, { controls, quantities, aims, units }, meet, stop) {
    const [list, message, vary, add, meeting, stopping] = [".list", ".message", ".vary", ".add", ".meet", ".stop"]
      .map((one) => root.querySelector(one));
    Object.assign(this, { list, message, meeting, stopping, units, meet, choices: quantities });
    list.replaceChildren();
    const given = aims.targets.length ? aims.targets : [{ quantity: "apex", of: quantities[0].of[1] }];
    given.forEach((target) => this.add(target));
    const tensions = controls.filter(({ kinds }) => kinds.includes("tensions") || kinds.includes("cables"));
    const possible = tensions.map(({ name, patch, wall }) => ({
      label: name, usual: patch !== null && !wall, parameter: { patch: name, kind: patch === null ? "cable" : "tension" },
    }));
    for (const { label, parameter } of aims.vary) {
      const same = ({ parameter: { kind, patch } }) =>
        kind === parameter.kind && String(patch) === String(parameter.patch);
      const known = possible.find(same);
      if (known) Object.assign(known, { parameter, given: true });
      else possible.push({ label, parameter, given: true }); // such as a pressure, or several tied
    }
    this.vary = possible.map(({ label: text, parameter, given: aimed, usual }) => {
      const one = { parameter };
      const checked = Boolean(aims.vary.length ? aimed : usual);
      one.label = choice("checkbox", text, checked, (on) => on && this.release(one),
        { "aria-label": `${text} may change` });
      one.box = one.label.firstChild;
      return one;
    });
    vary.replaceChildren(...this.vary.map(({ label }) => label));
    add.onclick = () => this.add({ quantity: "apex", of: null }).focus();
    meeting.onclick = () => this.send();
    stopping.onclick = stop;
    this.say(aims.targets.length ? "Targets of the project." : "");
  }

  /** A tension varies once, alone or tied to others: let go of those that a chosen one has a patch of. */
  release(chosen) {
    const names = [chosen.parameter.patch].flat();
    for (const other of this.vary) {
      const shared = [other.parameter.patch].flat().some((name) => names.includes(name));
      if (other !== chosen && shared && other.parameter.kind === chosen.parameter.kind) other.box.checked = false;
    }
  }

  /** A row for a target; returns its first control. The height at a point is picked in the picture. */
  add(target) {
    const point = target.quantity === "height";
    const quantity = point
      ? element("span.fixed", target.label ?? `height at (${target.of.join(", ")})`)
      : select("Quantity", this.choices.map((one) => [one.quantity, WORDS[one.quantity] ?? capital(one.quantity)]));
    const [of, limit, unit] = [select("Of", []), select("Relation", LIMITS), element("span.unit")];
    const number = numberField("Value wanted", { required: true });
    const entry = { target, point, quantity, of, limit, number };
    const remove = button("×", () => {
      this.rows.splice(this.rows.indexOf(entry), 1);
      row.remove();
    }, "Remove this target");
    const choose = () => {
      const { of: names, dimension } = this.choices.find((one) => one.quantity === quantity.value)
        ?? { of: [], dimension: "length" };
      const before = of.value;
      of.replaceChildren(...names.map((name) => new Option(name || "all", `=${name}`)));
      if (names.includes(before.slice(1))) of.value = before;
      unit.textContent = this.units.given ? this.units[dimension] ?? "" : "";
    };
    if (!point) Object.assign(quantity, { value: target.quantity, onchange: choose });
    choose();
    if (target.of !== undefined) of.value = `=${target.of ?? ""}`;
    const [key] = LIMITS.find(([name]) => typeof target[name] === "number") ?? ["value"];
    limit.value = key;
    if (typeof target[key] === "number") number.value = digits(target[key], 10);
    const row = element("div.target-row", quantity, ...(point ? [] : [of]), limit, number, unit, remove);
    this.list.append(row);
    this.rows.push(entry);
    return point ? number : quantity;
  }

  say(text, state = "") {
    this.message.textContent = text;
    this.message.dataset.state = state;
  }

  working(on) {
    this.meeting.disabled = on;
    this.stopping.hidden = !on;
  }

  async send() {
    const empty = this.rows.find(({ number }) => !Number.isFinite(number.valueAsNumber));
    const vary = this.vary.filter(({ box }) => box.checked).map(({ parameter }) => parameter);
    if (!this.rows.length || empty || !vary.length) {
      const missing = empty || !this.rows.length;
      const words = missing ? "Give each target a number." : "Choose at least one tension that may change.";
      this.say(words, "missed");
      empty?.number.focus();
      return;
    }
    const targets = this.rows.map(({ target, point, quantity, of, limit, number }) => ({
      quantity: point ? "height" : quantity.value,
      of: point ? target.of : of.value.slice(1) || null,
      name: target.name ?? "",
      [limit.value]: number.valueAsNumber,
    }));
    this.say("Searching for the tensions…");
    this.working(true);
    try {
      const header = await this.meet({ targets, vary });
      if (!header || header.superseded) this.say("Stopped.");
      else this.say(header.message, header.met ? "met" : "missed");
    } catch (error) {
      this.say(error.message, "missed");
    }
    this.working(false);
  }
}
