// The camera, and how mouse, fingers and keys move it.

import { cross, dot, minus, plus, scaled, unit } from "./geometry.js";

// azimuth, elevation and angle of view in degrees; a narrow angle keeps parallels parallel
const NAMED = { diagonal: [-60, 28, 28], elevation: [-90, 0, 1], plan: [-90, 89.9, 1] };

export class Camera {
  /** `changed` is called after every turn. */
  constructor(changed) {
    this.changed = changed;
    this.up = [0, 0, 1];
    this.box = [[-1, -1, -1], [1, 1, 1]];
    this.aspect = 1;
    this.look("diagonal");
  }

  /** Stand upright on a plane with this normal. */
  stand(up) {
    this.up = unit(up);
    const first = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].find((e) => Math.abs(dot(e, this.up)) < 0.9);
    this.first = unit(plus(first, scaled(this.up, -dot(first, this.up))));
    this.second = cross(this.up, this.first);
  }

  look(name) {
    [this.azimuth, this.elevation, this.angle] = NAMED[name].map((a) => (a * Math.PI) / 180);
    this.zoom = 1;
    this.shift = [0, 0];
    this.changed();
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(1.569, Math.max(-1.569, this.elevation + up));
    this.changed();
  }

  /** Move by parts of the picture's height. */
  move(right, up) {
    const tall = 2 * Math.tan(this.angle / 2);
    this.shift = [this.shift[0] + tall * right, this.shift[1] + tall * up];
    this.changed();
  }

  closer(factor) {
    this.zoom = Math.min(40, Math.max(0.2, this.zoom * factor));
    this.changed();
  }

  /** Right, upward and backward unit vectors. */
  axes() {
    const away = plus(scaled(this.first, Math.cos(this.azimuth)), scaled(this.second, Math.sin(this.azimuth)));
    const back = plus(scaled(away, Math.cos(this.elevation)), scaled(this.up, Math.sin(this.elevation)));
    const right = cross(this.up, away);
    return [right, cross(back, right), back];
  }

  /** The box's eight corners, so that the view can hold them all. */
  corners() {
    return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [0, 1, 2].map((k) => this.box[(i >> k) & 1][k]));
  }

  /** Column-major matrix from space to clip coordinates; also sets eye and pixels per length. */
  matrix(height) {
    const [right, upward, back] = this.axes();
    const tall = Math.tan(this.angle / 2);
    const wide = tall * this.aspect;
    const middle = scaled(plus(...this.box), 0.5);
    // as near as the box allows: each corner must lie within all four sides of the view
    let distance = 0;
    for (const corner of this.corners()) {
      const p = minus(corner, middle);
      distance = Math.max(distance, dot(p, back) + Math.abs(dot(p, right)) / (0.9 * wide),
        dot(p, back) + Math.abs(dot(p, upward)) / (0.76 * tall));
    }
    const reach = Math.hypot(...minus(this.box[1], this.box[0]));
    distance /= this.zoom;
    const target = plus(middle, scaled(right, -this.shift[0] * distance),
      scaled(upward, -this.shift[1] * distance + 0.03 * reach / this.zoom));
    this.eye = plus(target, scaled(back, distance));
    this.pixels = height / (2 * tall * distance);
    const near = Math.max(0.02 * distance, distance - 2 * reach);
    const far = distance + 3 * reach;
    const [a, b] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const columns = [0, 1, 2].map((k) => [right[k] / wide, upward[k] / tall, a * back[k], -back[k]]);
    const eye = [right, upward, back].map((axis) => dot(axis, this.eye));
    return Float32Array.from([...columns, [-eye[0] / wide, -eye[1] / tall, b - a * eye[2], eye[2]]].flat());
  }

  /** The eye, and the direction through a place of the picture, x and y from -1 to 1. */
  ray(x, y) {
    const [right, upward, back] = this.axes();
    const tall = Math.tan(this.angle / 2);
    return [this.eye, plus(scaled(right, x * tall * this.aspect), scaled(upward, y * tall), scaled(back, -1))];
  }

  /** Where a point is in the picture, x and y from -1 to 1, and how far before the eye. */
  seen(point) {
    const [right, upward, back] = this.axes();
    const from = minus(point, this.eye);
    const depth = -dot(from, back);
    const tall = Math.tan(this.angle / 2) * depth;
    return [dot(from, right) / (tall * this.aspect), dot(from, upward) / tall, depth];
  }

  /** Mouse, touch and keys on an element. `grab(event)` may take a drag: it returns what a move calls. */
  attach(element, grab) {
    const held = new Map();
    let dragged = null;
    const span = () => {
      const [a, b] = [...held.values()];
      return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      dragged = held.size ? null : grab(event);
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    element.addEventListener("pointermove", (event) => {
      if (!held.has(event.pointerId)) return;
      if (dragged) {
        dragged(event, false);
        return;
      }
      const before = held.get(event.pointerId);
      const old = held.size === 2 ? span() : null;
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      const part = 1 / element.clientHeight;
      const [right, down] = [(event.clientX - before.x) * part, (event.clientY - before.y) * part];
      if (old) {
        const now = span();
        this.move((now.x - old.x) * part, (old.y - now.y) * part);
        this.closer(now.apart / Math.max(old.apart, 1));
      } else if (event.shiftKey || event.buttons & 6) {
        this.move(right, -down);
      } else {
        this.turn(5 * right, 5 * down);
      }
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      element.addEventListener(end, (event) => {
        held.delete(event.pointerId);
        dragged?.(event, true);
        dragged = null;
      });
    }
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("dblclick", () => this.look("diagonal"));
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      this.closer(Math.exp(-0.0012 * lines * event.deltaY));
    }, { passive: false });
    const arrows = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    const zooms = { "+": 1.15, "=": 1.15, "-": 1 / 1.15 };
    element.addEventListener("keydown", (event) => {
      const { key } = event;
      const known = key in arrows || key in zooms || key === "Home";
      if (event.ctrlKey || event.metaKey || event.altKey || !known) return;
      event.preventDefault();
      if (key === "Home") this.look("diagonal");
      else if (key in zooms) this.closer(zooms[key]);
      else if (event.shiftKey) this.move(...scaled(arrows[key], 0.3));
      else this.turn(...arrows[key]);
    });
  }
}
