// Draws a surface with WebGL 2: sheets, mesh, curves, supports, the plane's grid and arrows.

import { Camera } from "./camera.js";
import { boxOf, normals, roundBelow, sectionOf, span } from "./geometry.js";
import { programs } from "./shaders.js";

const MESH = [0.12, 0.16, 0.2, 0.3];
const GRID = [0.55, 0.6, 0.65, 0.35];
const MARK = [0.85, 0.1, 0.45, 1];
const WHOLE = [0, 0, 0, 1e30]; // a section that cuts nothing away: (normal, offset)

export class Viewer {
  /** Throws if the browser has no WebGL 2. `gridChanged` is called with the grid's spacing. */
  constructor(canvas, gridChanged) {
    this.canvas = canvas;
    this.gridChanged = gridChanged;
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!this.gl) throw new Error("no WebGL 2");
    this.options = { mesh: true, supports: true, walls: true, smooth: false, grid: true };
    this.waiting = false;
    this.cut = WHOLE;
    this.marks = [];
    this.camera = new Camera(() => this.redraw());
    this.camera.attach(canvas, (event) => this.grab?.(event));
    this.prepare();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { this.prepare(); this.refill(); });
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }

  prepare() {
    const { gl } = this;
    this.programs = programs(gl);
    this.surface = this.parts([3, 3, 3, 2]);
    this.elements = gl.createBuffer();
    this.dots = this.parts([3, 1]);
    this.lines = {};
    for (const name of ["grid", "mesh", "curves", "arrows", "section", "marks"]) {
      this.lines[name] = this.parts([3, 3, 4, 2], true);
    }
    this.map = gl.createTexture();
    this.setMap(new Uint8Array(256 * 4));
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.polygonOffset(1, 1);
  }

  setMap(table) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  }

  /** A vertex array with a buffer for each attribute. */
  parts(sizes, instanced = false) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = sizes.map((size, place) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
      if (instanced) gl.vertexAttribDivisor(place, 1);
      return buffer;
    });
    gl.bindVertexArray(null);
    return { array, buffers, count: 0 };
  }

  fill(part, place, data) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, part.buffers[place]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
  }

  /** Everything that stays the same while the surface moves. */
  setMesh(header, arrays) {
    const again = Boolean(this.mesh);
    this.mesh = { header, ...arrays };
    this.camera.stand(header.up);
    if (!again) this.camera.look("diagonal");
    this.X = null;
    this.field = null;
    this.arrows = null;
  }

  /** Vertices (n,3), flat. The view is fitted to the first, and again when they outgrow it. */
  setVertices(X) {
    const first = !this.X;
    this.X = X;
    const box = boxOf(X);
    if (first || span(box) > 1.3 * span(this.camera.box)) this.camera.box = box;
    if (first) this.refill();
    else this.fillPlaces();
  }

  /** Values by vertex, or by face, with limits and a colour map; or null for the patches' colours. */
  setField(field) {
    const apart = Boolean(field?.byFace) !== Boolean(this.field?.byFace);
    this.field = field;
    if (apart) this.refill();
    else this.fillField();
  }

  /** The corners to draw: shared within a patch, or each triangle's own where its colour is flat. */
  corners() {
    const { sheet_faces: faces, sheet_vertex: vertex, sheet_patch: patch } = this.mesh;
    if (!this.field?.byFace) return { faces, vertex, patch };
    const own = (array) => Uint32Array.from(faces, (corner) => array[corner]);
    return { faces: Uint32Array.from(faces.keys()), vertex: own(vertex), patch: own(patch) };
  }

  /** Arrows as [vertex, vector, colour], or null. */
  setArrows(arrows) {
    this.arrows = arrows;
    this.fillArrows();
  }

  /** Cut away what is beyond a plane, (normal, offset); null shows the whole. */
  setCut(cut) {
    this.cut = cut ?? WHOLE;
    this.fillMarks();
  }

  /** Points to mark, and a line from one to the next. */
  setMarks(points) {
    this.marks = points;
    this.fillMarks();
  }

  fillMarks() {
    if (!this.X) return;
    const [from, to] = [[], []];
    const arm = 0.012 * this.mesh.header.size;
    for (const point of this.marks) {
      for (const k of [0, 1, 2]) {
        from.push(...point.map((x, i) => x - (i === k ? arm : 0)));
        to.push(...point.map((x, i) => x + (i === k ? arm : 0)));
      }
    }
    this.marks.slice(1).forEach((point, k) => { from.push(...this.marks[k]); to.push(...point); });
    this.placeLines("marks", from, to, () => MARK, () => [1.2, 1.2]);
    const line = this.cut === WHOLE ? [[], []] : sectionOf(this.X, this.triangles, this.cut);
    this.placeLines("section", ...line, () => MARK, () => [1.4, 1.4]);
    this.redraw();
  }

  setOptions(options) {
    Object.assign(this.options, options);
    if (this.X) this.refill();
  }

  refill() {
    if (!this.X) return;
    const { gl } = this;
    const m = this.mesh;
    this.sheet = this.corners();
    const { faces, vertex, patch } = this.sheet;
    const wall = m.header.patches.map((p) => p.wall);
    const chosen = [];
    const onSheet = new Uint8Array(m.header.vertices);
    for (let f = 0; f < faces.length; f += 3) {
      const isWall = wall[patch[faces[f]]];
      if (isWall && !this.options.walls) continue;
      for (let k = 0; k < 3; k++) {
        chosen.push(faces[f + k]);
        onSheet[vertex[faces[f + k]]] = 1;
      }
    }
    this.chosen = new Uint32Array(chosen);
    this.triangles = this.chosen.map((corner) => vertex[corner]);
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.elements);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.chosen, gl.STATIC_DRAW);
    const colours = new Float32Array(3 * patch.length);
    patch.forEach((p, i) => colours.set(m.header.patches[p].color, 3 * i));
    this.fill(this.surface, 2, colours);
    this.visible = onSheet;
    const shown = (ends, ofWall) => this.options.walls
      ? ends : ends.filter((_, i) => !ofWall[i >> 1]);
    this.shownEdges = this.options.mesh ? shown(m.edges, m.edge_wall) : new Uint32Array(0);
    this.shownCurves = shown(m.curves, m.curve_wall);
    this.held = this.options.supports
      ? [...m.fixed, ...m.sliding].filter((v) => onSheet[v]) : [];
    const sliding = new Set(m.sliding);
    this.fill(this.dots, 1, Float32Array.from(this.held, (v) => (sliding.has(v) ? 1 : 0)));
    this.fillPlaces();
    this.fillField();
  }

  fillPlaces() {
    const { X, sheet: { faces, vertex } } = this;
    const places = new Float32Array(3 * vertex.length);
    vertex.forEach((v, i) => {
      places[3 * i] = X[3 * v];
      places[3 * i + 1] = X[3 * v + 1];
      places[3 * i + 2] = X[3 * v + 2];
    });
    this.fill(this.surface, 0, places);
    this.fill(this.surface, 1, normals(places, faces));
    const dots = new Float32Array(3 * this.held.length);
    this.held.forEach((v, i) => dots.set(X.subarray(3 * v, 3 * v + 3), 3 * i));
    this.fill(this.dots, 0, dots);
    this.dots.count = this.held.length;
    this.fillLines("mesh", this.shownEdges, MESH, 0.5);
    this.fillLines("curves", this.shownCurves, this.colour("color"), 1.1);
    this.fillMarks();
    this.fillGrid();
    this.fillArrows();
    this.redraw();
  }

  /** Lines between pairs of vertices, half as wide as they will be. */
  fillLines(name, pairs, shade, width) {
    const from = [];
    const to = [];
    for (let i = 0; i < pairs.length; i += 2) {
      const [a, b] = [3 * pairs[i], 3 * pairs[i + 1]];
      from.push(this.X[a], this.X[a + 1], this.X[a + 2]);
      to.push(this.X[b], this.X[b + 1], this.X[b + 2]);
    }
    this.placeLines(name, from, to, (i) => shade, () => [width, width]);
  }

  placeLines(name, from, to, shade, width) {
    const part = this.lines[name];
    part.count = from.length / 3;
    this.fill(part, 0, new Float32Array(from));
    this.fill(part, 1, new Float32Array(to));
    const shades = new Float32Array(4 * part.count);
    const widths = new Float32Array(2 * part.count);
    const ratio = window.devicePixelRatio || 1;
    for (let i = 0; i < part.count; i++) {
      shades.set(shade(i), 4 * i);
      widths.set(width(i).map((w) => w * 2 * ratio), 2 * i);
    }
    this.fill(part, 2, shades);
    this.fill(part, 3, widths);
  }

  /** A colour of the page's theme, as the canvas has it. */
  colour(property) {
    const parts = getComputedStyle(this.canvas)[property].match(/[\d.]+/g).map(Number);
    return [...parts.slice(0, 3).map((x) => x / 255), 1];
  }

  fillGrid() {
    const { up, first, second, box } = this.camera;
    const { size, ground } = this.mesh.header;
    const spacing = roundBelow(size / 6);
    const sides = [first, second].map((axis) => {
      const all = this.camera.corners().map((c) => c[0] * axis[0] + c[1] * axis[1] + c[2] * axis[2]);
      return [Math.floor(Math.min(...all) / spacing - 0.4), Math.ceil(Math.max(...all) / spacing + 0.4)];
    });
    const at = (u, v) => [0, 1, 2].map(
      (k) => spacing * (u * first[k] + v * second[k]) - ground * up[k]);
    const from = [];
    const to = [];
    if (this.options.grid && box) {
      for (let u = sides[0][0]; u <= sides[0][1]; u++) {
        from.push(...at(u, sides[1][0]));
        to.push(...at(u, sides[1][1]));
      }
      for (let v = sides[1][0]; v <= sides[1][1]; v++) {
        from.push(...at(sides[0][0], v));
        to.push(...at(sides[0][1], v));
      }
    }
    this.placeLines("grid", from, to, () => GRID, () => [0.5, 0.5]);
    this.gridChanged(this.options.grid ? spacing : 0);
  }

  fillArrows() {
    if (!this.X) return;
    const from = [];
    const to = [];
    const shades = [];
    const widths = [];
    const tints = new Map();
    const at = (v) => this.X.subarray(3 * v, 3 * v + 3);
    for (const [v, vector, colour] of this.arrows || []) {
      if (!this.visible[v]) continue;
      tints.set(v, colour);
      from.push(...at(v));
      to.push(...at(v).map((x, k) => x + vector[k]));
      shades.push([...colour, 1]);
      widths.push([2.2, 0.3]);
    }
    // the boundary itself in the same colours
    const curves = this.shownCurves;
    for (let i = 0; i < curves.length; i += 2) {
      const [a, b] = [curves[i], curves[i + 1]];
      if (!tints.has(a) || !tints.has(b)) continue;
      from.push(...at(a));
      to.push(...at(b));
      shades.push([...tints.get(a), 1]);
      widths.push([2.6, 2.6]);
    }
    this.placeLines("arrows", from, to, (i) => shades[i], (i) => widths[i]);
    this.redraw();
  }

  fillField() {
    if (!this.X) return;
    const { field, mesh: m, sheet: { vertex, patch } } = this;
    const known = new Float32Array(2 * vertex.length);
    if (field) {
      vertex.forEach((v, i) => {
        const wall = m.header.patches[patch[i]].wall;
        const skip = field.linesOnly || (field.skipWalls && wall);
        const value = field.values[field.byFace ? Math.floor(i / 3) : v];
        if (!skip && Number.isFinite(value)) {
          known[2 * i] = value;
          known[2 * i + 1] = 1;
        }
      });
      this.setMap(field.map.table);
    }
    this.fill(this.surface, 3, known);
    this.redraw();
  }

  /** Draw before the browser shows its next frame. */
  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.waiting = false;
    const { gl, canvas, camera } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((s) => Math.round(s * ratio));
    if (!width || !height || gl.isContextLost()) return;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.clearColor(...this.colour("backgroundColor"));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.X) return;
    camera.aspect = width / height;
    const view = camera.matrix(height);
    this.drawLines("grid", view, width, height, 0);
    this.drawSurface(view);
    const spacing = this.spacing() * camera.pixels / ratio;
    if (spacing > 5) this.drawLines("mesh", view, width, height, 1e-4);
    this.drawLines("curves", view, width, height, 3e-4);
    this.drawLines("arrows", view, width, height, 6e-4);
    this.drawLines("section", view, width, height, 6e-4);
    this.drawLines("marks", view, width, height, 2e-3);
    if (!this.arrows) this.drawDots(view, Math.min(9, 0.62 * spacing) * ratio);
  }

  drawSurface(view) {
    const { gl, camera } = this;
    const { made, uniforms } = this.programs.surface;
    const [right, upward, back] = camera.axes();
    const sun = [0, 1, 2].map((k) => 0.45 * right[k] + 0.6 * upward[k] + 0.66 * back[k]);
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, view);
    gl.uniform3fv(uniforms.eye, camera.eye);
    gl.uniform4fv(uniforms.cut, this.cut);
    gl.uniform3fv(uniforms.sun, sun);
    gl.uniform3fv(uniforms.up, camera.up);
    gl.uniform1i(uniforms.smooth_, this.options.smooth ? 1 : 0);
    gl.uniform1i(uniforms.coloured, this.field ? 1 : 0);
    gl.uniform2fv(uniforms.limits, this.field ? this.field.limits : [0, 1]);
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.bindVertexArray(this.surface.array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.elements);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.drawElements(gl.TRIANGLES, this.chosen.length, gl.UNSIGNED_INT, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  drawLines(name, view, width, height, lift) {
    const { gl } = this;
    const { made, uniforms } = this.programs.line;
    const part = this.lines[name];
    if (!part.count) return;
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, view);
    gl.uniform2f(uniforms.screen, width, height);
    gl.uniform1f(uniforms.lift, lift);
    gl.uniform4fv(uniforms.cut, ["grid", "section", "marks"].includes(name) ? WHOLE : this.cut);
    gl.enable(gl.BLEND);
    gl.bindVertexArray(part.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, part.count);
    gl.disable(gl.BLEND);
  }

  drawDots(view, size) {
    const { gl } = this;
    const { made, uniforms } = this.programs.dot;
    if (!this.dots.count || size < 2) return;
    gl.useProgram(made);
    gl.uniformMatrix4fv(uniforms.view, false, view);
    gl.uniform1f(uniforms.size, size);
    gl.uniform1f(uniforms.lift, 4e-4);
    gl.uniform4fv(uniforms.cut, this.cut);
    gl.bindVertexArray(this.dots.array);
    gl.drawArrays(gl.POINTS, 0, this.dots.count);
  }

  /** Mean length of the first edges. */
  spacing() {
    const { X } = this;
    const ends = this.mesh.edges.length ? this.mesh.edges : this.mesh.curves;
    const count = Math.min(ends.length / 2, 400);
    let total = 0;
    for (let i = 0; i < count; i++) {
      const [a, b] = [3 * ends[2 * i], 3 * ends[2 * i + 1]];
      total += Math.hypot(X[a] - X[b], X[a + 1] - X[b + 1], X[a + 2] - X[b + 2]);
    }
    return total / Math.max(count, 1);
  }

  /** The picture as a PNG. */
  picture() {
    this.draw();
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }
}
