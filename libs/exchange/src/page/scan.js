const token = new URLSearchParams(location.search).get("token");
const address = path => token ? path + (path.includes("?") ? "&" : "?") + "token=" + encodeURIComponent(token) : path;
const page = Math.random().toString(36).slice(2);  // pages are told the end one by one
const kOutline = [0.32, 0.83, 0.57], kSensor = [1, 0.59, 0.16];
const kMaxFailures = 300;  // a second each
const kPause_ms = 150, kPictureEvery_ms = 300, kTrailLength = 3000;

let version = 0, newest = 0, state = {}, failures = 0, has_view = false, trail = [], path = [];
const rate = {since: performance.now(), bytes: 0, pictures: 0};

function say(text, tone) {
  by("said").className = "card " + (tone || "gray");
  by("said").textContent = text;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => by("said").textContent = "", 6000);
}

// The surface.
function take_blocks(buffer, at) {
  for (const [key, vertices, corners] of state.blocks) {
    const positions = new Float32Array(buffer, at, 3 * vertices), normals = new Int16Array(buffer, at + 12 * vertices, 4 * vertices);
    at += 20 * vertices;
    put_part(key, positions, normals, new Uint32Array(buffer, at, corners));
    at += 4 * corners;
  }
}
function follow_surface() {
  if (parts.size > 0 && !touched) has_view ? fit() : show_all();
  has_view = parts.size > 0;
}
/** Trials are strips. */
function follow_path({kept, points}) {
  path = path.slice(0, kept).concat(points);
  const strips = [];
  path.forEach(([trial, ...place], i) => {
    if (i === 0 || trial !== path[i - 1][0]) strips.push([]);
    strips.at(-1).push(...place);
  });
  show_way(strips, strips.flat());
}
/** Of tracking without a surface: where the sensor was. */
function follow_trail() {
  const corners = state.touch && state.touch.sensor;
  if (state.surface || !corners || corners.length === 0) return;
  trail.push([0, 1, 2].map(i => (corners[i] + corners[3 + i] + corners[6 + i] + corners[9 + i]) / 4));
  if (trail.length > kTrailLength) trail.shift();
  if (!touched) {
    target = trail[trail.length - 1].slice();
    radius = 20;
    distance = radius / kHalfView;
  }
  show_way([trail.flat()], []);
}
function show_touch() {
  const touch = state.touch, places = touch ? touch.map : [];
  put_lines("touch", places, gl.LINE_LOOP, kOutline, 1, 1, true);
  put_lines("touch points", places, gl.POINTS, kOutline, 3, 1, false);
  put_lines("sensor", touch ? [touch.sensor] : [], gl.LINE_LOOP, kSensor, 1, 3, true);
  put_lines("sensor corners", touch ? [touch.sensor] : [], gl.POINTS, kSensor, 5, 3, true);
  const s = touch && touch.sensor.length > 0 ? touch.sensor : null;
  by("pose").textContent = s ? "Sensor at " + ["x", "y", "z"].map((axis, i) => `${axis} ${((s[i] + s[6 + i]) / 2).toFixed(2)}`).join("  ") + " mm" : "";
}

// What is said.
function show_words() {
  by("banner").className = "card " + state.tone;
  by("headline").textContent = state.headline;
  by("advice").textContent = state.advice || (state.surface === false ? "No surface is made here: the sensor is tracked alone." : "");
  show_warnings(state.warnings || []);
  document.title = state.headline + " – GelSLAM";
  show_figures(state.scan === false ? [["Frames", state.frames]] : state.figures || []);
  by("source").textContent = state.source || "";
  by("stop").hidden = false;
  by("stop").disabled = state.phase === "finishing" || state.phase === "finished";
  by("new").disabled = state.phase === "finishing";
  by("new").hidden = !state.another;
  by("files").hidden = by("color").parentElement.hidden = !state.surface;
  by("empty").textContent = gl && parts.size === 0 && state.surface ? "The surface appears here with the first touch." : "";
}
/** Where the surface can be saved from: in the end from here, for the program ends with the scan. */
async function link_files(is_over) {
  for (const id of ["ply", "glb"]) {
    if (by(id).href.startsWith("blob:")) URL.revokeObjectURL(by(id).href);
    by(id).href = address("mesh." + id);
    if (!is_over || !state.surface) continue;
    const reply = await fetch(by(id).href, {cache: "no-store"});
    if (reply.ok) by(id).href = URL.createObjectURL(await reply.blob());
  }
}
function show_lost(text) {
  ended = state.phase === "finished" || state.phase === "finishing";
  if (!ended) by("banner").className = "card red";
  by("headline").textContent = ended ? "Finished" : text;
  by("advice").textContent = ended ? (state.phase === "finished" ? state.advice + " " : "") + "The program has ended."
    : "gelslam has ended, or cannot be reached. Trying again.";
  for (const id of ["stop", "new"]) by(id).hidden = true;
  by("files").hidden = !by("glb").href.startsWith("blob:");
}

// The camera's picture, with the border of the contact.
const picture = new Image();
let pictured = -1, pictured_at = 0, loads = false;
function look_at_picture() {
  if (loads || state.frame === null || state.frame === undefined || state.frame === pictured) return;
  if (performance.now() - pictured_at < kPictureEvery_ms) return;
  pictured_at = performance.now();
  loads = true;
  pictured = state.frame;
  const touch = state.touch;
  picture.onload = () => {
    loads = false;
    const canvas = by("picture"), pen = canvas.getContext("2d");
    if (canvas.width !== picture.naturalWidth || canvas.height !== picture.naturalHeight) {
      canvas.width = picture.naturalWidth;
      canvas.height = picture.naturalHeight;
      canvas.style.aspectRatio = canvas.width + " / " + canvas.height;
    }
    pen.drawImage(picture, 0, 0);
    pen.strokeStyle = "#52d392";
    pen.lineWidth = canvas.width / 110;
    for (const border of touch ? touch.picture : []) {
      pen.beginPath();
      for (let i = 0; i < border.length; i += 2) pen.lineTo(border[i] * canvas.width, border[i + 1] * canvas.height);
      pen.closePath();
      pen.stroke();
    }
  };
  picture.onerror = () => loads = false;
  picture.src = address("picture.jpg?frame=" + state.frame);
}

function show_rate() {
  const now = performance.now(), seconds = (now - rate.since) / 1000;
  if (seconds < 2) return;
  by("rate").textContent = ended ? "" : `${Math.round(rate.bytes / seconds / 1000)} kB/s, pictures at ${Math.round((pictures - rate.pictures) / seconds)} Hz`;
  Object.assign(rate, {since: now, bytes: 0, pictures});
}

async function look() {
  const reply = await fetch(address(`changes?since=${version}&map=${state.map}&page=${page}&phase=${state.phase}${document.hidden ? "&hidden=1" : ""}`), {cache: "no-store", signal: AbortSignal.timeout(10000)});
  if (!reply.ok) throw new Error((await reply.text()).trim());
  const buffer = await reply.arrayBuffer(), size = new DataView(buffer).getUint32(0, true);
  rate.bytes += buffer.byteLength;
  const phase = state.phase;
  state = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  version = state.version;
  newest = state.newest;
  if (gl) {
    if (state.cleared) for (const key of [...parts.keys()]) forget(parts, key);
    take_blocks(buffer, 4 + size);
    if (state.blocks.length > 0) follow_surface();
    if (state.path) follow_path(state.path);
    follow_trail();
    show_touch();
    if (state.phase === "finished" && phase !== "finished" && !touched) show_all();
    redraw();
  }
  show_words();
  look_at_picture();
  if ((state.phase === "finished") !== (phase === "finished")) await link_files(state.phase === "finished");
}
async function watch() {
  for (;;) {
    try {
      await look();
      failures = 0;
    } catch (error) {
      if (++failures > 2 || !(error instanceof TypeError)) show_lost(error instanceof TypeError || error.name === "TimeoutError" ? "Connection lost" : error.message);
    }
    show_rate();
    if (failures > 2 && state.phase === "finished") return;
    if (failures > kMaxFailures) return by("advice").textContent = "gelslam has ended, or cannot be reached. Reload the page to try again.";
    const pause_ms = failures > 0 ? 1000 : document.hidden || version < newest ? 0 : kPause_ms;
    if (pause_ms > 0) await new Promise(go_on => setTimeout(go_on, pause_ms));
  }
}

// What a person may ask for; the end of something asks first.
async function send_command(path) {
  try {
    const reply = await fetch(address(path), {method: "POST"});
    say((await reply.text()).trim(), reply.ok ? "green" : "amber");
  } catch {
    say("The program does not answer.", "red");
  }
}
function ask(question, meaning, answer, path) {
  by("asked").textContent = question;
  by("means").textContent = meaning;
  by("yes").textContent = answer;
  by("yes").onclick = () => { by("question").close(); send_command(path); };
  by("question").showModal();
}
by("no").onclick = () => by("question").close();
by("stop").onclick = () => state.scan
  ? ask("Stop the scan?", "Loops are closed and the mesh is made" + (state.run_folder ? ", and everything is saved in " + state.run_folder + "." : ", but nothing is kept (no -o)."), "Stop", "stop")
  : ask("Stop tracking?", "The program ends.", "Stop", "stop");
by("new").onclick = () => ask("Start a new scan?", "This one is finished and saved first.", "Save and start", "new");
by("more").textContent = " Green: what is touched now. Orange: the sensor. Stop makes the final mesh, and the page keeps it.";
link_files(false);
by("headline").textContent = "Connecting";
if (gl) {
  show_all();
  listen();
}
watch();
