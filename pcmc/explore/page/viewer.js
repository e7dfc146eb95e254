// Draws a surface with WebGL 2: sheets, mesh, curves, supports, the plane's grid and arrows.

import { Camera } from "./camera.js";
import { boxOf, dot, normals, plus, roundBelow, scaled, sectionOf, span } from "./geometry.js";
import { programs } from "./shaders.js";

const MESH = [0.12, 0.16, 0.2, 0.3];
const GRID = [0.55, 0.6, 0.65, 0.35];
const MARK = [0.85, 0.1, 0.45, 1];
const MEMBER = [0.88, 0.44, 0, 1];
const WHOLE = [0, 0, 0, 1e30]; // a section that cuts nothing away: (normal, offset)
// lines in the order in which they are drawn, and how far before the surface
const LIFTS = { grid: 0, mesh: 1e-4, curves: 3e-4, arrows: 6e-4, members: 8e-4, section: 6e-4, marks: 2e-3 };

export class Viewer {
  options = { mesh: true, supports: true, walls: true, smooth: false, grid: true };
  cut = WHOLE;
  marks = [];

  /** Throws if the browser has no WebGL 2. `gridChanged` is called with the grid's spacing. */
  constructor(canvas, gridChanged) {
    Object.assign(this, { canvas, gridChanged });
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!this.gl) throw new Error("no WebGL 2");
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
    this.surface = this.parts([[3], [3], [3], [2]]);
    this.elements = gl.createBuffer();
    this.dots = this.parts([[3], [1]]);
    this.lines = {};
    for (const name of Object.keys(LIFTS)) this.lines[name] = this.parts([[3, 3], [4], [2]], true);
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

  /** A vertex array with a buffer for each list of the sizes of attributes. */
  parts(layout, instanced = false) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    let place = 0;
    const buffers = layout.map((sizes) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      const stride = 4 * sizes.reduce((sum, size) => sum + size);
      sizes.forEach((size, k) => {
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, 4 * size * k);
        gl.vertexAttribDivisor(place, instanced ? 1 : 0);
        place += 1;
      });
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
    Object.assign(this, { mesh: { header, ...arrays }, X: null, field: null, arrows: null });
    this.camera.stand(header.up);
    if (!again) this.camera.look("diagonal");
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

  /** The ends of members' straight pieces, two by two, flat. */
  setMembers(ends) {
    this.placeLines("members", ends, MEMBER, [2.2]);
    this.redraw();
  }

  /** Points to mark, and a line from one to the next. */
  setMarks(points) {
    this.marks = points;
    this.fillMarks();
  }

  setOptions(options) {
    Object.assign(this.options, options);
    this.refill();
  }

  /** The corners to draw: shared within a patch, or each triangle's own where its colour is flat. */
  corners() {
    const { sheet_faces: faces, sheet_vertex: vertex, sheet_patch: patch } = this.mesh;
    if (!this.field?.byFace) return { faces, vertex, patch };
    const own = (array) => Uint32Array.from(faces, (corner) => array[corner]);
    return { faces: Uint32Array.from(faces.keys()), vertex: own(vertex), patch: own(patch) };
  }

  /** What is drawn of the mesh: all but its places. */
  refill() {
    if (!this.X) return;
    const { gl, mesh: m, options } = this;
    this.sheet = this.corners();
    const { faces, vertex, patch } = this.sheet;
    const { patches } = m.header;
    this.chosen = faces.filter((_, i) => options.walls || !patches[patch[faces[i - (i % 3)]]].wall);
    this.triangles = this.chosen.map((corner) => vertex[corner]);
    this.visible = new Uint8Array(m.header.vertices);
    for (const v of this.triangles) this.visible[v] = 1;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.elements);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.chosen, gl.STATIC_DRAW);
    const colours = new Float32Array(3 * patch.length);
    patch.forEach((p, i) => colours.set(patches[p].color, 3 * i));
    this.fill(this.surface, 2, colours);
    const shown = (ends, ofWall) => (options.walls ? ends : ends.filter((_, i) => !ofWall[i >> 1]));
    this.shownEdges = options.mesh ? shown(m.edges, m.edge_wall) : new Uint32Array(0);
    this.shownCurves = shown(m.curves, m.curve_wall);
    this.held = options.supports ? [...m.fixed, ...m.sliding].filter((v) => this.visible[v]) : [];
    const sliding = new Set(m.sliding);
    this.fill(this.dots, 1, Float32Array.from(this.held, (v) => Number(sliding.has(v))));
    this.fillPlaces();
    this.fillField();
  }

  fillPlaces() {
    const { faces, vertex } = this.sheet;
    const places = this.placesOf(vertex);
    this.fill(this.surface, 0, places);
    this.fill(this.surface, 1, normals(places, faces));
    this.fill(this.dots, 0, this.placesOf(this.held));
    this.dots.count = this.held.length;
    this.placeLines("mesh", this.placesOf(this.shownEdges), MESH, [0.5]);
    this.placeLines("curves", this.placesOf(this.shownCurves), this.colour("color"), [1.1]);
    this.fillMarks();
    this.fillGrid();
    this.fillArrows();
  }

  /** Places of vertices, flat (k,3). */
  placesOf(vertices) {
    const { X } = this;
    const places = new Float32Array(3 * vertices.length);
    vertices.forEach((v, i) => {
      places[3 * i] = X[3 * v];
      places[3 * i + 1] = X[3 * v + 1];
      places[3 * i + 2] = X[3 * v + 2];
    });
    return places;
  }

  /** Lines between the `ends`, two by two; a colour and half the width for all, or for each. */
  placeLines(name, ends, shade, width) {
    const part = this.lines[name];
    part.count = ends.length / 6;
    const spread = (values, size, factor) => {
      const all = new Float32Array(size * part.count);
      for (let i = 0; i < all.length; i++) all[i] = factor * values[i % values.length];
      return all;
    };
    this.fill(part, 0, Float32Array.from(ends));
    this.fill(part, 1, spread(shade, 4, 1));
    this.fill(part, 2, spread(width, 2, 2 * (window.devicePixelRatio || 1)));
  }

  /** A colour of the page's theme, as the canvas has it. */
  colour(property) {
    const parts = getComputedStyle(this.canvas)[property].match(/[\d.]+/g).map(Number);
    return [...parts.slice(0, 3).map((x) => x / 255), 1];
  }

  fillMarks() {
    if (!this.X) return;
    const arm = 0.012 * this.mesh.header.size;
    const crosses = this.marks.flatMap((point) => [0, 1, 2].flatMap((k) => [-arm, arm].flatMap(
      (step) => point.map((x, i) => (i === k ? x + step : x)))));
    const between = this.marks.slice(1).flatMap((point, k) => [...this.marks[k], ...point]);
    this.placeLines("marks", [...crosses, ...between], MARK, [1.2]);
    const section = this.cut === WHOLE ? [] : sectionOf(this.X, this.triangles, this.cut);
    this.placeLines("section", section, MARK, [1.4]);
    this.redraw();
  }

  fillGrid() {
    const { up, first, second } = this.camera;
    const { size, ground } = this.mesh.header;
    const spacing = roundBelow(size / 6);
    const [along, across] = [first, second].map((axis) => {
      const all = this.camera.corners().map((corner) => dot(corner, axis));
      return [Math.floor(Math.min(...all) / spacing - 0.4), Math.ceil(Math.max(...all) / spacing + 0.4)];
    });
    const at = (u, v) => plus(scaled(first, spacing * u), scaled(second, spacing * v), scaled(up, -ground));
    const ends = [];
    for (let u = along[0]; u <= along[1]; u++) ends.push(...at(u, across[0]), ...at(u, across[1]));
    for (let v = across[0]; v <= across[1]; v++) ends.push(...at(along[0], v), ...at(along[1], v));
    this.placeLines("grid", this.options.grid ? ends : [], GRID, [0.5]);
    this.gridChanged(this.options.grid ? spacing : 0);
  }

  fillArrows() {
    if (!this.X) return;
    const [ends, shades, widths, tints] = [[], [], [], new Map()];
    const at = (v) => this.X.subarray(3 * v, 3 * v + 3);
    const add = (from, to, colour, width) => {
      ends.push(...from, ...to);
      shades.push(...colour, 1);
      widths.push(...width);
    };
    for (const [v, vector, colour] of this.arrows || []) {
      if (!this.visible[v]) continue;
      tints.set(v, colour);
      add(at(v), at(v).map((x, k) => x + vector[k]), colour, [2.2, 0.3]);
    }
    // the boundary itself in the same colours
    const curves = this.shownCurves;
    for (let i = 0; i < curves.length; i += 2) {
      const [a, b] = [curves[i], curves[i + 1]];
      if (tints.has(a) && tints.has(b)) add(at(a), at(b), tints.get(a), [2.6, 2.6]);
    }
    this.placeLines("arrows", ends, shades, widths);
    this.redraw();
  }

  fillField() {
    if (!this.X) return;
    const { field, mesh: m, sheet: { vertex, patch } } = this;
    const known = new Float32Array(2 * vertex.length);
    if (field) {
      vertex.forEach((v, i) => {
        const skip = field.linesOnly || (field.skipWalls && m.header.patches[patch[i]].wall);
        const value = field.values[field.byFace ? Math.floor(i / 3) : v];
        if (skip || !Number.isFinite(value)) return;
        known[2 * i] = value;
        known[2 * i + 1] = 1;
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
    const { gl, canvas, camera, cut, dots } = this;
    const ratio = window.devicePixelRatio || 1;
    const screen = [canvas.clientWidth, canvas.clientHeight].map((s) => Math.round(s * ratio));
    const [width, height] = screen;
    if (!width || !height || gl.isContextLost()) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(...this.colour("backgroundColor"));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.X) return;
    camera.aspect = width / height;
    const view = camera.matrix(height);
    const spacing = this.spacing() * camera.pixels / ratio;
    for (const [name, lift] of Object.entries(LIFTS)) {
      const part = this.lines[name];
      if (part.count && (name !== "mesh" || spacing > 5)) {
        const kept = ["grid", "section", "marks"].includes(name) ? WHOLE : cut;
        this.programs.line({ view, screen, lift, cut: kept });
        gl.enable(gl.BLEND);
        gl.bindVertexArray(part.array);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, part.count);
        gl.disable(gl.BLEND);
      }
      if (name === "grid") this.drawSurface(view);
    }
    const size = Math.min(9, 0.62 * spacing) * ratio;
    if (this.arrows || !dots.count || size < 2) return;
    this.programs.dot({ view, size, lift: 4e-4, cut });
    gl.bindVertexArray(dots.array);
    gl.drawArrays(gl.POINTS, 0, dots.count);
  }

  drawSurface(view) {
    const { gl, camera, cut, field } = this;
    const [right, upward, back] = camera.axes();
    this.programs.surface({
      view, cut, eye: camera.eye, up: camera.up, smooth_: this.options.smooth, coloured: Boolean(field),
      sun: plus(scaled(right, 0.45), scaled(upward, 0.6), scaled(back, 0.66)), limits: field?.limits ?? [0, 1],
    });
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.bindVertexArray(this.surface.array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.elements);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.drawElements(gl.TRIANGLES, this.chosen.length, gl.UNSIGNED_INT, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  /** Mean length of the first edges. */
  spacing() {
    const { edges, curves } = this.mesh;
    const ends = this.placesOf((edges.length ? edges : curves).subarray(0, 800));
    let total = 0;
    for (let i = 0; i < ends.length; i += 6) {
      total += Math.hypot(ends[i] - ends[i + 3], ends[i + 1] - ends[i + 4], ends[i + 2] - ends[i + 5]);
    }
    return total / Math.max(ends.length / 6, 1);
  }

  /** The canvas with the picture as it is now. */
  drawn() {
    this.draw();
    return this.canvas;
  }

  /** The picture as a PNG. */
  picture() {
    return new Promise((resolve) => this.drawn().toBlob(resolve, "image/png"));
  }
}
