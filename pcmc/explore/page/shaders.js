// The programs that run on the graphics card.

const HEAD = `#version 300 es
precision highp float;
`;

// A surface seen from both sides. Where a field is shown, `field` holds (value, 1), or (0, 0) where
// there is none, so that a triangle takes the values of the corners that have one.
const surfaceVertex = `${HEAD}
uniform mat4 view;
in vec3 position, normal, colour;
in vec2 field;
out vec3 place, upright, tint;
out vec2 known;
void main() {
  place = position; upright = normal; tint = colour; known = field;
  gl_Position = view * vec4(position, 1.0);
}`;

const surfaceFragment = `${HEAD}
uniform vec3 eye, sun, up;
uniform bool smooth_, coloured;
uniform vec4 cut;
uniform vec2 limits;
uniform sampler2D map;
in vec3 place, upright, tint;
in vec2 known;
out vec4 result;
void main() {
  if (dot(cut.xyz, place) > cut.w) discard;
  vec3 flat_ = normalize(cross(dFdx(place), dFdy(place)));
  vec3 towards = normalize(eye - place);
  vec3 n = smooth_ ? normalize(upright) : flat_;
  if (dot(n, towards) < 0.0) n = -n;
  vec3 base = tint;
  if (coloured) {
    float part = (known.x / max(known.y, 1e-6) - limits.x) / max(limits.y - limits.x, 1e-30);
    base = known.y > 0.01 ? texture(map, vec2(clamp(part, 0.0, 1.0), 0.5)).rgb : vec3(0.86);
  }
  float light = 0.62 + 0.28 * max(dot(n, sun), 0.0) + 0.14 * (0.5 + 0.5 * dot(n, up));
  float rim = pow(1.0 - abs(dot(n, towards)), 3.0);
  result = vec4(min(base * light * (1.0 - 0.12 * rim), vec3(1.0)), 1.0);
}`;

// A line is a strip of four corners, as wide as it should be on the screen.
const lineVertex = `${HEAD}
uniform mat4 view;
uniform vec2 screen;
uniform float lift;
in vec3 from_, to_;
in vec4 shade;
in vec2 width;
out vec4 tint;
out vec3 place;
void main() {
  vec4 a = view * vec4(from_, 1.0), b = view * vec4(to_, 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * screen;
  vec2 across = length(along) > 1e-6 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  bool end = (gl_VertexID & 1) == 1;
  float side = (gl_VertexID & 2) == 2 ? 1.0 : -1.0;
  gl_Position = end ? b : a;
  place = end ? to_ : from_;
  gl_Position.xy += side * across * (end ? width.y : width.x) / screen * gl_Position.w;
  gl_Position.z -= lift * gl_Position.w;
  tint = shade;
}`;

const lineFragment = `${HEAD}
uniform vec4 cut;
in vec4 tint;
in vec3 place;
out vec4 result;
void main() {
  if (dot(cut.xyz, place) > cut.w) discard;
  result = tint;
}`;

// Supports: squares that hold, discs that slide.
const dotVertex = `${HEAD}
uniform mat4 view;
uniform float size, lift;
in vec3 position;
in float sliding;
uniform vec4 cut;
out float disc;
void main() {
  bool away = dot(cut.xyz, position) > cut.w;
  gl_Position = away ? vec4(2.0, 2.0, 2.0, 1.0) : view * vec4(position, 1.0);
  gl_Position.z -= lift * gl_Position.w;
  gl_PointSize = size;
  disc = sliding;
}`;

const dotFragment = `${HEAD}
in float disc;
out vec4 result;
void main() {
  vec2 p = 2.0 * gl_PointCoord - 1.0;
  float r = disc > 0.5 ? length(p) : max(abs(p.x), abs(p.y));
  if (r > 1.0) discard;
  vec3 tint = disc > 0.5 ? vec3(0.12, 0.31, 0.75) : vec3(0.78, 0.06, 0.18);
  result = vec4(r > 0.72 ? vec3(1.0) : tint, 1.0);
}`;

const settersOf = (gl) => ({
  [gl.FLOAT]: "uniform1f", [gl.FLOAT_VEC2]: "uniform2fv", [gl.FLOAT_VEC3]: "uniform3fv", [gl.FLOAT_VEC4]: "uniform4fv",
  [gl.BOOL]: "uniform1i", [gl.SAMPLER_2D]: "uniform1i",
});

/** A program, its attributes numbered in the order of `names`; `use(values)` sets its uniforms by their names. */
function program(gl, vertex, fragment, names) {
  const made = gl.createProgram();
  const check = (works, log) => {
    if (!works && !gl.isContextLost()) throw new Error(log);
  };
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    check(gl.getShaderParameter(shader, gl.COMPILE_STATUS), gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  names.forEach((name, place) => gl.bindAttribLocation(made, place, name));
  gl.linkProgram(made);
  check(gl.getProgramParameter(made, gl.LINK_STATUS), gl.getProgramInfoLog(made));
  const [set, setters] = [{}, settersOf(gl)];
  for (let i = 0; i < (gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS) || 0); i++) {
    const { name, type } = gl.getActiveUniform(made, i);
    const place = gl.getUniformLocation(made, name);
    set[name] = type === gl.FLOAT_MAT4
      ? (value) => gl.uniformMatrix4fv(place, false, value) : (value) => gl[setters[type]](place, value);
  }
  return (values) => {
    gl.useProgram(made);
    for (const [name, value] of Object.entries(values)) set[name]?.(value);
  };
}

/** The three programs. */
export const programs = (gl) => ({
  surface: program(gl, surfaceVertex, surfaceFragment, ["position", "normal", "colour", "field"]),
  line: program(gl, lineVertex, lineFragment, ["from_", "to_", "shade", "width"]),
  dot: program(gl, dotVertex, dotFragment, ["position", "sliding"]),
});
