const run = JSON.parse(by("run").textContent);
const bytes_of = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));

// The mesh, a binary PLY (meters, map frame) whose vertices have floats only.
const ply = bytes_of(by("mesh").textContent), numbers = new DataView(ply.buffer);
const header = new TextDecoder("latin1").decode(ply.subarray(0, 1000)).split("end_header\n")[0];
const count_of = element => +header.match(`element ${element} (\\d+)`)[1];
const names = [...header.matchAll(/property float (\w+)/g)].map(match => match[1]);
const vertices = count_of("vertex"), first_vertex = header.length + "end_header\n".length;
function column(first_name, width) {
  const first = names.indexOf(first_name);
  if (first < 0) return null;
  return Float32Array.from({length: width * vertices}, (_, i) =>
    numbers.getFloat32(first_vertex + 4 * (Math.floor(i / width) * names.length + first + i % width), true));
}
const positions = column("x", 3).map(meters => 1000 * meters), confidence = column("confidence", 1);
const first_face = first_vertex + 4 * names.length * vertices, kFaceBytes = 13;
const indices = Uint32Array.from({length: 3 * count_of("face")}, (_, i) =>
  numbers.getInt32(first_face + kFaceBytes * Math.floor(i / 3) + 1 + 4 * (i % 3), true));

/** By area. */
function find_normals() {
  const normals = new Float32Array(positions.length);
  for (let t = 0; t < indices.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map(k => positions.subarray(3 * indices[t + k], 3 * indices[t + k] + 3));
    const n = cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    for (let k = 0; k < 9; ++k) normals[3 * indices[t + Math.floor(k / 3)] + k % 3] += n[k % 3];
  }
  return normals;
}
/** With the confidence behind each. */
function packed_normals() {
  const normals = column("nx", 3) || find_normals(), packed = new Float32Array(4 * vertices);
  for (let i = 0; i < vertices; ++i) {
    packed.set(unit([...normals.subarray(3 * i, 3 * i + 3)]), 4 * i);
    packed[4 * i + 3] = confidence ? confidence[i] / kMaxWeight : 0;
  }
  return packed;
}

document.title = run.name + " – GelSLAM";
by("headline").textContent = run.name;
show_warnings(run.warnings);
show_figures(run.figures);
for (const id of ["stop", "new", "picture", "glb"]) by(id).hidden = true;
if (!confidence) by("color").querySelector("[value=confidence]").remove();
by("color").value = run.color;
by("path").disabled = run.strips.length === 0;
by("ply").onclick = () => {
  by("ply").href = URL.createObjectURL(new Blob([ply]));
  by("ply").download = run.name + ".ply";
};
if (gl) {
  put_part("mesh", positions, packed_normals(), indices);
  show_all();
  listen();
  show_way(run.strips.map(strip => strip.map(meters => 1000 * meters)), run.keyframes.map(meters => 1000 * meters));
}
