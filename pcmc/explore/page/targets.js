// Targets: quantities and the values wanted for them, and the tensions that may change for these.

import { button, capital, element, input, select } from "./elements.js";
import { digits } from "./panel.js";

const WORDS = { "reaction per length": "Largest reaction", pressure: "Pressure of a room", length: "Length of a cable", force: "Force in a cable" };
const LIMITS = [["value", "="], ["at_most", "at most"], ["at_least", "at least"]];

export class Targets {
  /** `meet(aims)` is called to meet them, `stop()` to give up. */
  constructor(root, { controls, quantities, aims, units }, meet, stop) {
    Object.assign(this, { root, units, meet, choices: quantities });
    this.list = root.querySelector(".list");
    this.message = root.querySelector(".message");
    this.list.replaceChildren();
    this.rows = [];
    const given = aims.targets.length ? aims.targets : [{ quantity: "apex", of: quantities[0].of[1] }];
    given.forEach((target) => this.add(target));
    const tensions = controls.filter((g) => g.kinds.includes("tensions") || g.kinds.includes("cables"));
    const possible = tensions.map(({ name, patch, wall }) => ({
      label: name, usual: patch !== null && !wall, parameter: { patch: name, kind: patch === null ? "cable" : "tension" },
    }));
    const same = (a, b) => a.kind === b.kind && String(a.patch) === String(b.patch);
    for (const { label, parameter } of aims.vary) {
      const known = possible.find((p) => same(p.parameter, parameter));
      if (known) Object.assign(known, { parameter, given: true });
      else possible.push({ label, parameter, given: true }); // such as a pressure, or several tied
    }
    this.vary = possible.map((one) => this.parameter(one, aims.vary.length ? one.given : one.usual));
    root.querySelector(".vary").replaceChildren(...this.vary.map(({ label }) => label));
    root.querySelector(".add").onclick = () => this.add({ quantity: "apex", of: null }).focus();
    root.querySelector(".meet").onclick = () => this.send();
    root.querySelector(".stop").onclick = stop;
    this.say(aims.targets.length ? "Targets of the project." : "");
  }

  /** A box for a tension, or another parameter, that may change. */
  parameter({ label: text, parameter }, checked) {
    const label = element("label");
    const box = input("checkbox", `${text} may change`);
    box.checked = Boolean(checked);
    label.append(box, text);
    const one = { label, box, parameter };
    box.addEventListener("change", () => box.checked && this.release(one));
    return one;
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
    const row = element("div", "target-row");
    const point = target.quantity === "height";
    const quantity = point
      ? element("span", "fixed", target.label ?? `height at (${target.of.join(", ")})`)
      : select("Quantity", this.choices.map((one) => [one.quantity, WORDS[one.quantity] ?? capital(one.quantity)]));
    const of = select("Of", []);
    const limit = select("Relation", LIMITS);
    const number = input("number", "Value wanted", { step: "any", required: "" });
    const unit = element("span", "unit");
    const entry = { row, target, point, quantity, of, limit, number };
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
    if (!point) {
      quantity.value = target.quantity;
      quantity.addEventListener("change", choose);
    }
    choose();
    if (target.of !== undefined) of.value = `=${target.of ?? ""}`;
    const [key] = LIMITS.find(([name]) => typeof target[name] === "number") ?? ["value"];
    limit.value = key;
    if (typeof target[key] === "number") number.value = digits(target[key], 10);
    row.append(quantity, ...(point ? [] : [of]), limit, number, unit, remove);
    this.list.append(row);
    this.rows.push(entry);
    return point ? number : quantity;
  }

  say(text, state = "") {
    this.message.textContent = text;
    this.message.dataset.state = state;
  }

  working(on) {
    this.root.querySelector(".meet").disabled = on;
    this.root.querySelector(".stop").hidden = !on;
  }

  async send() {
    const empty = this.rows.find(({ number }) => !Number.isFinite(number.valueAsNumber));
    const vary = this.vary.filter(({ box }) => box.checked).map(({ parameter }) => parameter);
    if (!this.rows.length || empty) {
      this.say("Give each target a number.", "missed");
      empty?.number.focus();
      return;
    }
    if (!vary.length) {
      this.say("Choose at least one tension that may change.", "missed");
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
