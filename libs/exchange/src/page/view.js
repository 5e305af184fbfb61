"use strict";
const by = id => document.getElementById(id);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => a.map(x => x / (Math.hypot(...a) || 1));

// What is to be seen, mm: parts of the surface by key, and lines by name.
const parts = new Map(), lines = new Map();
const kWay = [0.41, 0.69, 0.98], kMaxWeight = 128;
let ended = false;  // nothing can be read anew

// What the surface's colors say; maps as in the windows, from low to high.
const kColors = {
  plain: {},
  height: {
    map: "#003070 #32436d #50576c #696b71 #828079 #9d9576 #baac6d #d9c55c #f9e03a",
    range: () => { const box = whole_box(); return [-box.max[2], -box.min[2]]; },
    ends: (low, high) => ["0", (high - low).toPrecision(3) + " mm"],
  },
  confidence: {
    map: "#481d6f #424086 #34608d #297b8e #1f968b #2ab07f #5ac864 #a0da39 #ece51b",
    range: () => [0, Math.max(...[...parts.values()].map(part => part.weight), 1e-3)],
    ends: (low, high) => ["0", high.toPrecision(3) + " keyframes"],
  },
  curvature: {map: "#332f2a #cec6ba #fffdfa", range: () => [0, 1], ends: () => ["hollow", "ridge"]},
};
for (const name in kColors) by("color").add(new Option(name, name));

// Drawing: one program for the lit surface and, with a flat color, for lines and points.
const gl = by("view").getContext("webgl2", {antialias: true});
if (gl) {
  // A phone takes the graphics away from a page that is not in front. All is there again when the page is read anew.
  by("view").addEventListener("webglcontextlost", event => event.preventDefault());
  by("view").addEventListener("webglcontextrestored", () => ended || location.reload());
} else {
  by("view").replaceWith(Object.assign(document.createElement("p"), {
    textContent: "This browser shows no WebGL 2. The mesh can still be saved.",
    style: "position: absolute; inset: auto 1.5em 1em"}));
  for (const id of ["all", "tools"]) by(id).hidden = true;
}
function compile(kind, source) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, "#version 300 es\nprecision highp float;\nprecision highp int;\n" + source);
  gl.compileShader(shader);
  return shader;
}
function link() {
  const made = gl.createProgram();
  gl.attachShader(made, compile(gl.VERTEX_SHADER, `
    layout(location = 0) in vec3 position;
    layout(location = 1) in vec4 normal;
    uniform mat4 clip;
    uniform mat3 turn;
    uniform float point_px;
    uniform int color_by;
    out vec3 toward, place;
    out float number;
    void main() {
      gl_Position = clip * vec4(position, 1.0);
      gl_PointSize = point_px;
      toward = turn * normal.xyz;
      place = turn * position;
      number = color_by == 1 ? -position.z : normal.w * 128.0;
    }`));
  gl.attachShader(made, compile(gl.FRAGMENT_SHADER, `
    in vec3 toward, place;
    in float number;
    uniform vec4 flat_color;
    uniform int color_by;
    uniform vec2 range;
    uniform sampler2D map;
    out vec4 pixel;
    /** Mean curvature, 1/mm: how much the normal turns along the surface, from one pixel to the next. */
    float curvature(vec3 n) {
      vec3 px = dFdx(place), py = dFdy(place), nx = dFdx(n), ny = dFdy(n);
      float e = dot(px, px), f = dot(px, py), g = dot(py, py);
      return 0.5 * (g * dot(px, nx) - f * (dot(px, ny) + dot(py, nx)) + e * dot(py, ny)) / max(e * g - f * f, 1e-12);
    }
    void main() {
      vec3 n = normalize(toward);
      float bend = curvature(n);
      if (flat_color.a > 0.0) { pixel = flat_color; return; }
      vec3 base = vec3(0.81, 0.78, 0.73);
      if (color_by == 1 || color_by == 2)
        base = texture(map, vec2(((number - range.x) / max(range.y - range.x, 1e-6) * 8.0 + 0.5) / 9.0, 0.5)).rgb;
      if (color_by == 3) base *= 0.8 + 0.5 * tanh(0.6 * bend);
      vec3 own = pow(gl_FrontFacing ? base : vec3(0.55, 0.58, 0.63), vec3(2.2));
      if (!gl_FrontFacing) n = -n;
      float key = max(dot(n, normalize(vec3(-0.7, 0.3, 0.6))), 0.0);
      float fill = max(dot(n, normalize(vec3(0.7, -0.2, 0.6))), 0.0);
      float shine = pow(max(dot(n, normalize(vec3(-0.35, 0.15, 0.9))), 0.0), 40.0);
      vec3 light = 0.1 + 1.25 * key * vec3(1.0, 0.97, 0.92) + 0.3 * fill * vec3(0.85, 0.92, 1.0);
      pixel = vec4(pow(own * light + 0.04 * shine, vec3(1.0 / 2.2)), 1.0);
    }`));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const place = {};
  for (const name of ["clip", "turn", "flat_color", "point_px", "color_by", "range"]) place[name] = gl.getUniformLocation(made, name);
  return {made, place};
}
const program = gl && link();
function upload(thing, data, target) {
  const buffer = gl.createBuffer();
  thing.buffers.push(buffer);
  gl.bindBuffer(target, buffer);
  gl.bufferData(target, data, gl.STATIC_DRAW);
}
/** Floats as they are, whole numbers as shares of their largest. */
function attribute(thing, place, data, size) {
  upload(thing, data, gl.ARRAY_BUFFER);
  const type = data instanceof Float32Array ? gl.FLOAT : gl.SHORT;
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, type, type !== gl.FLOAT, 0, 0);
}
function new_thing() {
  const thing = {array: gl.createVertexArray(), buffers: []};
  gl.bindVertexArray(thing.array);
  return thing;
}
function forget(things, key) {
  const old = things.get(key);
  if (!old) return;
  for (const buffer of old.buffers) gl.deleteBuffer(buffer);
  gl.deleteVertexArray(old.array);
  things.delete(key);
}

/** Positions are kept by the GPU alone; here only their box and where they face. Normals have a fourth number: weight,
    as a share of kMaxWeight. */
function put_part(key, positions, normals, indices) {
  forget(parts, key);
  if (indices.length === 0) return;
  const part = new_thing();
  attribute(part, 0, positions, 3);
  attribute(part, 1, normals, 4);
  upload(part, indices, gl.ELEMENT_ARRAY_BUFFER);
  part.count = indices.length;
  part.box = box_of(positions);
  part.facing = [0, 0, 0];
  for (let i = 0; i < normals.length; ++i) if (i % 4 < 3) part.facing[i % 4] += normals[i];
  const weights = normals.filter((_, i) => i % 4 === 3).sort();
  part.weight = weights[Math.floor(0.95 * (weights.length - 1))] * kMaxWeight / (normals instanceof Float32Array ? 1 : 32767);
  parts.set(key, part);
}
function box_of(positions) {
  const box = {min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity]};
  for (let i = 0; i < positions.length; ++i) {
    box.min[i % 3] = Math.min(box.min[i % 3], positions[i]);
    box.max[i % 3] = Math.max(box.max[i % 3], positions[i]);
  }
  return box;
}
/** `strips`: chains of places. Faint where the object is in front, with `faint`; `nearer` mm nearer in depth. */
function put_lines(name, strips, kind, color, point_px, nearer, faint) {
  forget(lines, name);
  const chains = strips.filter(strip => strip.length > 0);
  if (chains.length === 0) return;
  const line = new_thing();
  attribute(line, 0, new Float32Array(chains.flat()), 3);
  let first = 0;
  line.chains = chains.map(chain => ({first: (first += chain.length / 3) - chain.length / 3, count: chain.length / 3}));
  lines.set(name, Object.assign(line, {kind, color, point_px, nearer, faint}));
}

// The camera turns about a target: rows of `turn` are right, up and toward the viewer.
const kHalfView = Math.tan(Math.PI / 12);
let turn, target = [0, 0, 0], distance = 40, radius = 10, background = [0.047, 0.055, 0.067], waiting = false;
function whole_box() {
  const box = {min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity]};
  for (const part of parts.values())
    for (let i = 0; i < 3; ++i) {
      box.min[i] = Math.min(box.min[i], part.box.min[i]);
      box.max[i] = Math.max(box.max[i], part.box.max[i]);
    }
  return box;
}
function show_all() {
  const facing = [0, 0, 0];
  for (const part of parts.values()) part.facing.forEach((x, i) => facing[i] += x);
  const back = Math.hypot(...facing) > 0 ? unit(facing) : [0, 0, -1];
  const side = Math.abs(back[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  const right = unit(side.map((x, i) => x - dot(side, back) * back[i]));
  turn = [right, cross(back, right), back];
  turn_by(-0.35, 0.6);
  fit();
}
/** Target and distance, so that all is in sight. */
function fit() {
  if (parts.size === 0) return;
  const box = whole_box();
  target = box.min.map((low, i) => (low + box.max[i]) / 2);
  radius = Math.max(Math.hypot(...box.min.map((low, i) => box.max[i] - low)) / 2, 1e-3);
  distance = 1.1 * radius / kHalfView / Math.min(1, by("view").clientWidth / by("view").clientHeight || 1);
}
function turn_by(about_up, about_right) {
  const rotate = (a, b, angle) => {
    const [u, v] = [turn[a], turn[b]], c = Math.cos(angle), s = Math.sin(angle);
    turn[a] = unit(u.map((x, i) => c * x + s * v[i]));
    turn[b] = unit(v.map((x, i) => c * x - s * u[i]));
  };
  rotate(0, 2, about_up);
  rotate(2, 1, about_right);
}
const mm_per_px = () => 2 * kHalfView * distance / by("view").clientHeight;
function move_by(dx_px, dy_px) {
  for (let i = 0; i < 3; ++i) target[i] += mm_per_px() * (dy_px * turn[1][i] - dx_px * turn[0][i]);
}
function zoom_by(factor) { distance = Math.min(Math.max(distance * factor, radius / 50), radius * 40); }

/** Depth is that of places `nearer` mm nearer to the viewer. */
function clip_matrix(width, height, nearer) {
  const far = distance + 4 * radius, near = Math.max(distance - 4 * radius, distance / 50);
  const scale = [height / width / kHalfView, 1 / kHalfView];
  const [right, up, back] = turn, matrix = new Float32Array(16);
  const shift = [-dot(right, target), -dot(up, target), -dot(back, target) - distance];
  for (let i = 0; i < 4; ++i) {
    const at = row => i < 3 ? turn[row][i] : shift[row];
    matrix.set([scale[0] * at(0), scale[1] * at(1),
                -(far + near) / (far - near) * (at(2) + (i === 3 ? nearer : 0)) - (i === 3 ? 2 * far * near / (far - near) : 0),
                -at(2)], 4 * i);
  }
  return matrix;
}
function draw_line(line, opacity) {
  const view = by("view");
  gl.uniformMatrix4fv(program.place.clip, false, clip_matrix(view.width, view.height, line.nearer));
  gl.uniform4fv(program.place.flat_color, [...line.color, opacity]);
  gl.uniform1f(program.place.point_px, line.point_px * devicePixelRatio);
  gl.bindVertexArray(line.array);
  for (const chain of line.chains) gl.drawArrays(line.kind, chain.first, chain.count);
}
function draw_lines(opacity) {
  for (const line of lines.values())
    if (opacity === 1 || line.faint) draw_line(line, opacity);
}
let pictures = 0;  // drawn so far
function draw() {
  waiting = false;
  ++pictures;
  const view = by("view");
  const width = Math.round(view.clientWidth * devicePixelRatio), height = Math.round(view.clientHeight * devicePixelRatio);
  if (view.width !== width || view.height !== height) Object.assign(view, {width, height});
  gl.viewport(0, 0, view.width, view.height);
  gl.clearColor(...background, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.useProgram(program.made);
  gl.uniformMatrix4fv(program.place.clip, false, clip_matrix(view.width, view.height, 0));
  gl.uniformMatrix3fv(program.place.turn, true, turn.flat());
  gl.uniform4fv(program.place.flat_color, [0, 0, 0, 0]);
  gl.uniform1i(program.place.color_by, by("color").selectedIndex < 0 ? 0 : Object.keys(kColors).indexOf(by("color").value));
  gl.uniform2fv(program.place.range, show_legend());
  gl.enable(gl.DEPTH_TEST);
  for (const part of parts.values()) {
    gl.bindVertexArray(part.array);
    gl.drawElements(gl.TRIANGLES, part.count, gl.UNSIGNED_INT, 0);
  }
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  gl.disable(gl.DEPTH_TEST);
  draw_lines(0.12);
  gl.disable(gl.BLEND);
  gl.enable(gl.DEPTH_TEST);
  draw_lines(1);
  show_scale();
  const box = whole_box();
  by("size").textContent = parts.size > 0 ? "Size: " + box.min.map((low, i) => (box.max[i] - low).toFixed(1)).join(" × ") + " mm" : "";
}
function recolor() {
  const {map} = kColors[by("color").value];
  if (!map) return redraw();
  const levels = map.split(" ").flatMap(color => [1, 3, 5].map(i => parseInt(color.slice(i, i + 2), 16)));
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, levels.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array(levels));
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  by("bar").style.background = `linear-gradient(90deg, ${map.split(" ").join(", ")})`;
  redraw();
}
/** Returns the numbers at its ends. */
function show_legend() {
  const {map, range, ends} = kColors[by("color").value];
  by("legend").hidden = !map || parts.size === 0;
  if (by("legend").hidden) return [0, 1];
  [by("low").textContent, by("high").textContent] = ends(...range());
  return range();
}
/** A bar of a round length. */
function show_scale() {
  const most_mm = mm_per_px() * 160, power = 10 ** Math.floor(Math.log10(most_mm));
  const length_mm = power * [5, 2, 1].find(n => n * power <= most_mm);
  by("scale").style.width = length_mm / mm_per_px() + "px";
  by("scale").textContent = +length_mm.toPrecision(1) + " mm";
}
function redraw() {
  if (!waiting && gl) requestAnimationFrame(draw);
  waiting = true;
}

/** The sensor's center lies up to 2 mm below what is pressed in. */
let way = [[], []];  // strips and keyframes, mm
function show_way(...now) {
  if (now.length > 0) way = now;
  const [strips, keyframes] = by("path").checked ? way : [[], []];
  put_lines("way", strips, gl.LINE_STRIP, kWay, 1, 2, true);
  put_lines("keyframes", [keyframes], gl.POINTS, kWay, 4, 2, true);
  redraw();
}

// What is said beside the view.
function show_warnings(warnings) {
  const cards = warnings.map(text => Object.assign(document.createElement("div"), {className: "card amber", textContent: text}));
  if (cards.length > 1) {
    const more = document.createElement("details"), open = by("warnings").querySelector("details")?.open;
    more.append(Object.assign(document.createElement("summary"), {textContent: `${cards.length - 1} more`}), ...cards.splice(1));
    more.open = Boolean(open);
    cards.push(more);
  }
  by("warnings").replaceChildren(...cards);
}
function show_figures(figures) {
  by("figures").replaceChildren(...figures.map(([name, value, tone]) => {
    const box = document.createElement("div");
    box.className = (tone || "gray") + (String(value).length > 12 ? " wide" : "");
    box.append(Object.assign(document.createElement("small"), {textContent: name}), Object.assign(document.createElement("b"), {textContent: value}));
    return box;
  }));
}
by("help").onclick = () => by("explained").showModal();

// Mouse, fingers and keys.
const fingers = new Map();
let touched = false;  // somebody has chosen a view
function on_move(event) {
  const before = fingers.get(event.pointerId);
  if (!before) return;
  const dx = event.clientX - before.x, dy = event.clientY - before.y, now = {x: event.clientX, y: event.clientY, moves: before.moves};
  if (fingers.size === 2) {
    const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
    const apart = p => Math.hypot(p.x - other.x, p.y - other.y) || 1;
    zoom_by(apart(before) / apart(now));
    move_by(dx / 2, dy / 2);
  } else if (before.moves) {
    move_by(dx, dy);
  } else {
    turn_by(dx * 0.008, dy * 0.008);
  }
  fingers.set(event.pointerId, now);
  touched = true;
  redraw();
}
const kKeys = {
  ArrowLeft: () => turn_by(-0.1, 0), ArrowRight: () => turn_by(0.1, 0), ArrowUp: () => turn_by(0, -0.1),
  ArrowDown: () => turn_by(0, 0.1), "+": () => zoom_by(0.9), "-": () => zoom_by(1.1),
};
function listen() {
  const view = by("view");
  view.onpointerdown = event => {
    view.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, {x: event.clientX, y: event.clientY, moves: event.button !== 0 || event.shiftKey});
  };
  view.onpointermove = on_move;
  view.onpointerup = view.onpointercancel = event => fingers.delete(event.pointerId);
  view.oncontextmenu = event => event.preventDefault();
  view.addEventListener("wheel", event => {
    event.preventDefault();
    zoom_by(Math.exp(0.001 * event.deltaY * (event.deltaMode === 1 ? 30 : 1)));
    touched = true;
    redraw();
  }, {passive: false});
  view.onkeydown = event => {
    if (!kKeys[event.key]) return;
    kKeys[event.key]();
    event.preventDefault();
    touched = true;
    redraw();
  };
  by("color").onchange = recolor;
  by("path").onchange = () => show_way();
  recolor();
  by("all").onclick = view.ondblclick = () => { touched = false; show_all(); redraw(); };
  new ResizeObserver(redraw).observe(view);
}
