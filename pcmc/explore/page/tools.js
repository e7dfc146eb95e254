// What the picture is asked for: measures between its points, a section, and single points that are moved.

import { button, coordinate, digits, element } from "./elements.js";
import { dot, hit, minus, plus, scaled } from "./geometry.js";

const STILL = 5; // pixels that a click may move
const NEAR = 14; // pixels from a point that is meant
const STEPS = 1000;

export class Tools {
  picked = [];
  points = {};

  /** `addHeight(point)` adds a target for the height there; `move(name, place, final)` moves a single point. */
  constructor(viewer, root, addHeight, move) {
    Object.assign(this, { viewer, addHeight, move });
    const [measure, axis, place] = [".measure", "#section select", "#section input"].map((one) => root.querySelector(one));
    this.told = document.querySelector("#measured");
    measure.onclick = () => {
      this.measuring = !this.measuring;
      measure.setAttribute("aria-pressed", String(this.measuring));
      viewer.canvas.classList.toggle("picking", this.measuring);
      this.pick(null);
      if (this.measuring) this.told.textContent = "Click a point of the surface, then another; or turn it with the arrow keys and press Enter for the point in the middle.";
    };
    this.section = () => this.cut(axis.value, place);
    axis.onchange = this.section;
    place.oninput = this.section;
    viewer.grab = (event) => this.grab(event);
    viewer.canvas.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && this.measuring) this.mark([0, 0]);
    });
  }

  /** Another mesh: its frame and units. */
  begin({ origin, axes, foot, mirrors, size, units }) {
    Object.assign(this, { origin, axes, foot, mirrors, size, unit: units.given ? ` ${units.length}` : "" });
    this.pick(null);
    this.section();
  }

  /** The single points of the surface shown, by name. */
  show(points) {
    this.points = points;
    this.section();
  }

  /** In the coordinates of Π: along it, and the height above it. */
  local(point) {
    const from = minus(plus(point, this.origin), this.foot);
    return this.axes.map((axis) => dot(axis, from));
  }

  /** The place on the piece itself of a point that is on one of its mirror images. */
  folded(point) {
    return this.mirrors.reduce((place, [foot, normal]) => {
      const beyond = (at) => dot(normal, minus(plus(at, this.origin), foot));
      const far = beyond(place) * beyond([0, 0, 0]) < 0 ? 2 * beyond(place) : 0;
      return minus(place, scaled(normal, far));
    }, point);
  }

  /** From -1 to 1 in the picture. */
  placeOf(event) {
    const { left, top, width, height } = this.viewer.canvas.getBoundingClientRect();
    return [(2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height];
  }

  /** Pixels between a point and a place in the picture. */
  away(point, [x, y]) {
    const [u, v] = this.viewer.camera.seen(point);
    return Math.hypot((u - x) * this.viewer.canvas.clientWidth, (v - y) * this.viewer.canvas.clientHeight) / 2;
  }

  /** The point of the surface at a place in the picture, a vertex if one is near; or null. */
  at(place) {
    const { X, triangles, camera, cut } = this.viewer;
    const found = hit(X, triangles, camera.ray(...place), cut);
    return found && (found.corners.find((corner) => this.away(corner, place) < NEAR) ?? found.point);
  }

  /** A press on the picture: it drags a single point, or marks one where it does not move. */
  grab(event) {
    const { viewer: { camera, canvas }, origin } = this;
    const from = this.placeOf(event);
    if (this.measuring) {
      canvas.addEventListener("pointerup", (now) => {
        const still = Math.hypot(now.clientX - event.clientX, now.clientY - event.clientY) < STILL;
        if (still) this.mark(this.placeOf(now));
      }, { once: true });
      return null;
    }
    const [name, start] = Object.entries(this.points).map(([one, point]) => [one, minus(point, origin)])
      .find(([, point]) => this.away(point, from) < NEAR) ?? [];
    return start ? (now, final) => { // parallel to the screen
      const [right, upward] = camera.axes();
      const tall = Math.tan(camera.angle / 2) * camera.seen(start)[2];
      const [x, y] = minus(this.placeOf(now), from).map((part) => part * tall);
      this.move(name, plus(start, scaled(right, x * camera.aspect), scaled(upward, y), origin), final);
    } : null;
  }

  mark(place) {
    const point = this.at(place);
    if (point) this.pick(point);
    else this.told.textContent = "There is no point of the surface.";
  }

  /** Mark a point of the surface; two are measured, and null takes the marks away. */
  pick(point) {
    this.picked = point ? [...(this.picked.length < 2 ? this.picked : []), point] : [];
    this.viewer.setMarks(this.picked);
    this.told.replaceChildren();
    if (!point) return;
    const [last, first] = this.picked.map((one) => this.local(one)).reverse();
    const shown = (x) => `${digits(x)}${this.unit}`;
    if (!first) {
      const place = () => this.local(this.folded(point)).slice(0, 2).map((x) => Number(coordinate(x, this.size, 6)));
      const [x, y] = last.map((one) => coordinate(one, this.size));
      this.told.append(element("span", `Height ${shown(last[2])} at (${x}, ${y})`),
        button("Target here", () => this.addHeight(place())));
      return;
    }
    const [x, y, z] = minus(last, first);
    this.told.textContent = `Distance ${shown(Math.hypot(x, y, z))}, in plan ${shown(Math.hypot(x, y))}, in height ${shown(z)}`;
  }

  cut(axis, place) {
    const { viewer } = this;
    place.disabled = axis === "";
    if (axis === "" || !viewer.X) {
      viewer.setCut(null);
      return;
    }
    const normal = this.axes[Number(axis)];
    const across = viewer.camera.corners().map((corner) => dot(normal, corner));
    const [low, high] = [Math.min(...across), Math.max(...across)];
    const offset = low + (high - low) * (place.value / STEPS + 1e-4); // beside a wall in the middle
    const shown = coordinate(this.local(normal.map((x) => offset * x))[Number(axis)], this.size);
    place.setAttribute("aria-valuetext", `${shown}${this.unit}`);
    place.title = `${"xyz"[Number(axis)]} = ${shown}${this.unit}`;
    viewer.setCut([...normal, offset]);
  }
}
