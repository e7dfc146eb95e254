// The page: it sends one request at a time to the server and shows the answers.

import { capital, choice, digits, element, find } from "./elements.js";
import { addSaving, follow } from "./file.js";
import {
  arrowsOf, COLOURS, fieldOf, showFindings, showLegend, showParts, showSupports, showVerdict,
} from "./findings.js";
import { Panel } from "./panel.js";
import { QUESTIONS } from "./questions.js";
import { ask, askInTurn, fetchFile } from "./server.js";
import { Targets } from "./targets.js";
import { Tools } from "./tools.js";
import { Variants } from "./variants.js";
import { Viewer } from "./viewer.js";

const REPLACE_AFTER = 400; // milliseconds, at least, before a newer request replaces one under way
const POOR = 0.3; // of the worst triangle: new triangles are offered below it
const ACTS = {
  undo: "undo", redo: "redo", reset: "reset", stabilise: "stabilise", remesh: "remesh", back: "undo",
};
const ENDING = [...Object.values(ACTS), "recall", "visit"]; // the words about targets are then of another surface
const SHOWS = { mesh: "Mesh", supports: "Supports", walls: "Walls", smooth: "Smooth", grid: "Grid" };
const FORMATS = {
  ".pcmc": "everything", ".3dm": "Rhino", ".obj": "most programs", ".glb": "viewers, AR",
  ".ply": "with the numbers", ".stl": "printing", ".vtp": "ParaView, with the numbers", ".fe": "Surface Evolver",
  ".png": "picture of this view",
};
const prefersDark = matchMedia("(prefers-color-scheme: dark)");

class Page {
  pending = 0; // requests without an answer yet
  choice = "patches";

  async open() {
    const known = new URLSearchParams(location.search).get("session") || sessionStorage.getItem("session");
    // a copy of this tab starts a session of its own
    sessionStorage.removeItem("session");
    addEventListener("pagehide", () => sessionStorage.setItem("session", this.name));
    const answer = await ask("api/open", known ? { session: known } : {})
      .catch((error) => (known && !location.search ? ask("api/open") : Promise.reject(error)));
    this.name = answer.header.session;
    this.startViewer();
    this.addChoices();
    this.variants = new Variants(find("#variants"), (name, body) => this.act(name, body), () => this.viewer?.drawn());
    this.begin(answer);
    this.addExports(answer.header.formats);
    this.addActs();
    follow(find("#watch"), answer.header, () => this.name, () => this.reopen());
    this.showWork();
  }

  /** Everything that depends on the mesh: at the start, and when the file behind the page was saved. */
  begin({ header, arrays }, opened = true) {
    const { size, units, mesh, name: download, title } = header;
    Object.assign(this, { size, units, mesh, download });
    find("#title").textContent = title || "pcmc explore";
    document.title = title ? `${title} – pcmc explore` : "pcmc explore";
    find("#units").textContent = units.given
      ? `Tension in ${units.tension}, pressure in ${units.pressure}.`
      : "Any consistent units. With metres and kilonewtons: tension kN/m, pressure kN/m², curvature 1/m.";
    const piece = { 1: "", 2: "the half", 4: "the quarter" }[header.whole] ?? "the piece";
    const [numbers, whole] = header.whole_files
      ? ["All numbers are", "the picture and the exports show"] : ["All numbers and exports are", "the picture shows"];
    const about = `${numbers} of ${piece} between the mirror planes; ${whole} the whole.`;
    Object.assign(find("#piece"), { hidden: !piece, textContent: about });
    this.underPressure = new Uint8Array(header.vertices);
    arrays.sheet_patch.forEach((p, i) => {
      if (!header.patches[p].wall) this.underPressure[arrays.sheet_vertex[i]] = 1;
    });
    this.sway(false);
    this.viewer?.setMesh(header, arrays);
    this.tools?.begin(header);
    this.panel = new Panel(find("#patches"), header, find("#together"), (final) => this.request(final));
    this.targets = new Targets(find("#targets"), header, (aims) => this.send("meet", aims, true), () => this.act("stop"));
    const varied = header.quantities.find(({ quantity }) => quantity === "margin")?.of ?? [];
    find("#margin-of").replaceChildren(...varied.map((what) => element("option", what)));
    if (header.note && opened) this.targets.say(header.note, header.note_met ? "met" : "missed");
    find("#together-row").hidden = header.patches.length < 2;
    addSaving(find("#save-project"), find("#saving"), header, () => this.name, (text) => this.notify(text));
    this.next = null;
    this.show({ header, arrays }, true);
  }

  async reopen(opened = true) {
    this.begin(await ask("api/open", { session: this.name }), opened);
  }

  startViewer() {
    try {
      this.viewer = new Viewer(find("#canvas"), (spacing) => {
        const unit = this.units?.given ? ` ${this.units.length}` : "";
        find("#scale").textContent = spacing ? `grid ${digits(spacing)}${unit}` : "";
      });
      this.tools = new Tools(this.viewer, document, (of) => this.targets.add({ quantity: "height", of }).focus(),
        (name, place, final) => this.panel.movePoint(name, place, final));
    } catch (error) {
      find("#canvas").hidden = true;
      const textContent = error.message === "no WebGL 2"
        ? "This browser cannot show the surface: WebGL 2 is missing or switched off. Everything else works."
        : `The 3D picture cannot be drawn: ${error.message}`;
      Object.assign(find("#no-graphics"), { hidden: false, textContent });
    }
  }

  // -- requests: acts are sent at once, and answered in order; of slider values the newest replace those that wait

  request(final) {
    this.next = { act: final ? "settle" : "follow", values: this.panel.values() };
    this.targets.say(""); // it was about the last surface
    find("#verdict").dataset.busy = "true";
    this.pump();
  }

  act(name, values = {}) {
    if (ENDING.includes(name)) this.targets.say("");
    this.flush();
    return this.send(name, values);
  }

  /** Send the values that wait, unless older ones are under way; these get as long as an answer last took. */
  pump() {
    clearTimeout(this.timer);
    const waited = performance.now() - this.since;
    const patience = Math.max(REPLACE_AFTER, 1.5 * (this.lasted || 0));
    if (this.next && this.pending && waited < patience) {
      this.timer = setTimeout(() => this.pump(), patience - waited);
    } else {
      this.flush();
    }
  }

  flush() {
    const { next } = this;
    this.next = null;
    if (next) this.send(next.act, next.values);
  }

  /** Send a request and show its answer; returns the header. Errors are shown, or thrown if `raise`. */
  async send(act, values, raise = false) {
    const began = performance.now();
    this.pending += 1;
    this.since = began;
    this.showWork();
    try {
      const answer = await askInTurn(`api/${this.name}/${act}`, values);
      const { header } = answer;
      if (act === "follow") this.lasted = performance.now() - began;
      if (!header.superseded && header.number > this.header.number) {
        await this.show(answer, !["follow", "settle"].includes(act) || Boolean(header.way));
      }
      return header;
    } catch (error) {
      if (!this.next) this.panel.show(this.header.values, true);
      if (raise) throw error;
      this.notify(error.message);
      return null;
    } finally {
      this.pending -= 1;
      this.showWork();
      this.pump();
    }
  }

  showWork() {
    const card = find("#verdict");
    const work = card.querySelector(".work");
    card.dataset.busy = String(Boolean(this.pending || this.next));
    if (this.pending && this.slow) return; // it counts already
    clearTimeout(this.slow);
    this.slow = null;
    work.hidden = true;
    card.removeAttribute("aria-busy");
    if (!this.pending) return;
    const tell = async () => {
      const seconds = Math.round((performance.now() - this.since) / 1000);
      work.hidden = false;
      work.textContent = `Working… ${seconds} s`;
      const news = await ask(`api/${this.name}/news`).catch(() => null);
      if (!this.slow) return;
      if (news?.header.progress) work.textContent = `Working… ${seconds} s, ${news.header.progress}`;
      this.slow = setTimeout(tell, 1000);
    };
    this.slow = setTimeout(() => {
      card.setAttribute("aria-busy", "true");
      this.slow = setTimeout(tell, 550);
    }, 250);
  }

  // -- answers -------------------------------------------------------------------------------------

  /** Show an answer; with `values` set the sliders too, which must not happen while one moves. */
  async show({ header, arrays }, values) {
    if (header.mesh !== this.mesh || !this.panel.covers(header.values.shown)) {
      await this.reopen(false); // same file: other triangles or sliders
      return;
    }
    this.header = header;
    this.arrays = { ...arrays, underPressure: this.underPressure };
    const [{ at_rest: atRest, findings, figures, verdict }, { units }] = [header, this];
    showVerdict(find("#verdict"), header, this.size);
    showFindings(find("#findings tbody"), findings, figures, units);
    showParts(find("#parts"), figures, units);
    if (findings.supports) showSupports(find("#supports"), findings, units);
    this.variants.show(header, units);
    if (!this.next) this.panel.show(header.values, values);
    const enabled = { check: atRest, margin: atRest, equilibria: atRest, verify: atRest, undo: header.undo, redo: header.redo };
    for (const [id, on] of Object.entries(enabled)) find(`#${id}`).disabled = !on;
    const shown = {
      "check-result": false, theorem: false, "margin-result": false, // they were about the last surface
      "equilibria-result": this.visiting && !find("#equilibria-result").hidden,
      stabilise: atRest && verdict.name === "saddle",
      remesh: verdict.name === "degenerate" || findings.quality < POOR,
      back: !atRest && header.undo,
      sway: arrays.mode && atRest && this.viewer,
    };
    for (const [id, on] of Object.entries(shown)) find(`#${id}`).hidden = !on;
    if (!this.swaying || !arrays.mode) {
      this.sway(false);
      this.viewer?.setVertices(arrays.vertices);
      this.viewer?.setMembers(arrays.member_ends ?? []);
    }
    this.tools?.show(header.values.shown.points);
    if (header.compared !== this.compared) {
      this.compared = header.compared;
      this.choice = header.compared === null ? "patches" : "difference";
    }
    for (const radio of document.querySelectorAll("#colours input")) {
      radio.checked = radio.value === this.choice;
      radio.parentElement.hidden = radio.value === "difference" && !arrays.difference;
    }
    this.colour();
  }

  colour() {
    if (this.choice === "family" && !this.arrays.family) {
      this.look("families"); // until then the colours stay
      return;
    }
    const field = fieldOf(this.choice, this.arrays);
    const than = this.header.variants[this.header.compared]?.name;
    showLegend(find("#legend"), this.choice, field, this.units, than);
    this.viewer?.setField(field);
    this.viewer?.setArrows(this.choice === "reactions" ? arrowsOf(this.arrays, field, this.size) : null);
  }

  /** Ask about the surface shown; a newer surface leaves the answer behind. */
  async look(name) {
    const [{ busy, body = () => ({}), show }, { header: shown }] = [QUESTIONS[name], this];
    const asking = find(`#${name}`);
    const words = asking?.textContent;
    if (asking) Object.assign(asking, { disabled: true, textContent: busy ?? words });
    try {
      const { header, arrays } = await ask(`api/${this.name}/${name}`, body());
      if (this.header === shown) show(this, header, arrays);
    } catch (error) {
      this.notify(error.message);
    }
    if (asking) Object.assign(asking, { disabled: !this.header.at_rest, textContent: words });
  }

  /** Show a surface of the search for equilibria, whose diagram stays. */
  async visit(number) {
    this.visiting = true;
    await this.act("visit", { number });
    this.visiting = false;
  }

  /** Show the shape at the edge instead of the roof, or the roof again. */
  showEdge(on) {
    find("#margin-result button").setAttribute("aria-pressed", String(on));
    this.sway(false);
    this.viewer?.setVertices(on ? this.edge : this.arrays.vertices);
  }

  /** Move slowly along the softest mode and back. */
  sway(on) {
    this.swaying = on;
    find("#sway").setAttribute("aria-pressed", String(on));
    cancelAnimationFrame(this.frame);
    const start = performance.now();
    const step = (time) => {
      const { vertices, mode } = this.arrays;
      if (!this.swaying || !mode) return;
      const part = 0.05 * this.size * Math.sin((time - start) / 450);
      this.viewer.setVertices(vertices.map((x, i) => x + part * mode[i]));
      this.frame = requestAnimationFrame(step);
    };
    if (on) this.frame = requestAnimationFrame(step);
  }

  /** Show one line for a few seconds. */
  notify(text) {
    const note = find("#note");
    Object.assign(note, { textContent: text, hidden: false });
    clearTimeout(this.noted);
    this.noted = setTimeout(() => { note.hidden = true; }, 8000);
  }

  // -- controls ------------------------------------------------------------------------------------

  addChoices() {
    find("#colours").append(...Object.entries(COLOURS).map(([value, { label }]) => choice(
      "radio", label, false, () => { this.choice = value; this.colour(); }, { name: "colour", value })));
    find("#shows").append(...Object.entries(SHOWS).map(([name, label]) => choice(
      "checkbox", label, this.viewer?.options[name], (on) => this.viewer?.setOptions({ [name]: on }),
      { name, value: name })));
  }

  addExports(formats) {
    const menu = find("#export");
    const kinds = Object.entries(FORMATS).filter(([suffix]) => suffix === ".png" || formats.includes(suffix));
    menu.querySelector("div").replaceChildren(...kinds.map(([value, words]) => element("button",
      { type: "button", value, onclick: () => this.save(value) }, element("b", value), ` ${words}`)));
    menu.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !menu.open) return;
      menu.open = false;
      menu.querySelector("summary").focus();
    });
    addEventListener("pointerdown", (event) => {
      if (!menu.contains(event.target)) menu.open = false;
    });
  }

  async save(suffix) {
    find("#export").open = false;
    find("#export summary").focus(); // the button that had it is gone
    try {
      const [body, note] = suffix === ".png"
        ? [await this.viewer.picture(), ""] : await fetchFile(`api/${this.name}/export?suffix=${suffix}`);
      const link = element("a", { href: URL.createObjectURL(body), download: `${this.download}${suffix}` });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
      const other = "Saved: the surface shown, with its own values, not those you asked for. ";
      const words = (this.header.at_rest ? "" : other) + capital(note);
      if (words) this.notify(words);
    } catch (error) {
      this.notify(error.message);
    }
  }

  addActs() {
    const clicks = {
      "#margin-result button": ({ currentTarget }) =>
        this.showEdge(currentTarget.getAttribute("aria-pressed") !== "true"),
      "#sway": () => {
        if (this.swaying) this.viewer.setVertices(this.arrays.vertices);
        this.sway(!this.swaying);
      },
      "#theme": () => {
        const { style } = document.documentElement;
        const now = style.colorScheme || (prefersDark.matches ? "dark" : "light");
        style.colorScheme = now === "dark" ? "light" : "dark";
        this.viewer?.setOptions({});
      },
    };
    for (const [id, act] of Object.entries(ACTS)) clicks[`#${id}`] = () => this.act(act);
    for (const name of ["check", "margin", "equilibria", "verify"]) clicks[`#${name}`] = () => this.look(name);
    for (const [selector, clicked] of Object.entries(clicks)) find(selector).onclick = clicked;
    for (const view of document.querySelectorAll("#views [data-view]")) {
      view.onclick = () => this.viewer?.camera.look(view.dataset.view);
    }
    prefersDark.addEventListener("change", () => this.viewer?.setOptions({}));
    addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.target.matches("input.number")) return;
      const key = event.key.toLowerCase();
      const act = key === "y" || (key === "z" && event.shiftKey) ? "redo" : key === "z" ? "undo" : "";
      if (!act) return;
      event.preventDefault();
      if (!find(`#${act}`).disabled) this.act(act);
    });
  }
}

const page = new Page();
window.pcmc = page; // for the console, and for tests
page.open().catch((error) => {
  find("#verdict .word").textContent = "Cannot open";
  find("#verdict .sentence").textContent = error.message;
});
