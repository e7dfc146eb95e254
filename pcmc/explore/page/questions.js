// Questions about the surface shown: the words of their button meanwhile, and what shows the answer.

import { showDiagram } from "./diagram.js";
import { capital, find } from "./elements.js";
import { showCheck } from "./findings.js";

export const QUESTIONS = {
  check: {
    busy: "Solving on finer meshes…",
    show: (page, { check }) => check && showCheck(find("#check-result"), check),
  },
  margin: {
    busy: "Following to the edge…",
    body: () => ({ what: find("#margin-of").value }),
    show(page, { margin }, { vertices }) {
      if (!margin) return;
      page.edge = vertices;
      find("#margin-result .detail").textContent = capital(margin);
      find("#margin-result").hidden = false;
      page.showEdge(false);
    },
  },
  equilibria: {
    busy: "Searching…",
    body: () => ({ what: find("#margin-of").value }),
    show: (page, found) =>
      found.equilibria && showDiagram(find("#equilibria-result"), found, page.units, (number) => page.visit(number)),
  },
  verify: {
    show: (page, { badge, text }) =>
      Object.assign(find("#theorem"), { hidden: false, textContent: capital(badge), title: capital(text) }),
  },
  families: {
    show(page, header, { family }) {
      page.arrays.family = family;
      page.colour();
    },
  },
};
