"use strict";
// Plays a replay: surfaces, contact forces and stress, drawn by WebGL2. The bytes are those of `packed.rs`.
(async () => {
  const by = (id) => document.getElementById(id);
  const canvas = by("replay");
  const fail = (why) => { by("hint").textContent = why; };
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl || typeof DecompressionStream === "undefined") return fail("This browser shows no replay: it has no WebGL2.");

  // --- the bytes
  const packed = Uint8Array.from(atob(by("replay-data").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = await new Response(stream).arrayBuffer();
  const size = new DataView(bytes).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, size)));
  let at = 4 + size;
  const take = (Kind, count) => { const got = new Kind(bytes, at, count); at += got.byteLength; return got; };
  const frames = head.times.length;
  // A direction given with y up, in the world.
  const upright = (v) => head.up === "z" ? [v[2], v[0], v[1]] : v;
  const isIn = (mesh, f) => mesh.first <= f && f < mesh.end;
  const rigid = head.meshes.filter((m) => !m.soft), soft = head.meshes.filter((m) => m.soft);
  for (const mesh of head.meshes) mesh.index = take(Uint32Array, 3 * mesh.triangles);
  for (const mesh of rigid) mesh.rest = take(Float32Array, 3 * mesh.vertices);
  const poses = take(Float32Array, 7 * rigid.length * frames);
  const counts = take(Uint32Array, frames);
  const starts = new Uint32Array(frames + 1);
  counts.forEach((count, k) => { starts[k + 1] = starts[k] + count; });
  const contacts = take(Float32Array, 6 * starts[frames]);
  const points = soft.reduce((sum, m) => { m.first = sum; return sum + m.vertices; }, 0);
  const axes = [0, 1, 2].map(() => take(Uint16Array, points * frames));
  const stresses = take(Uint8Array, points * frames);
  // Differences in time become values.
  for (const values of [...axes, stresses]) for (let k = points; k < values.length; k++) values[k] += values[k - points];

  // --- drawing
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    ["place", "value"].forEach((name, k) => gl.bindAttribLocation(made, k, name));
    gl.linkProgram(made);
    return made;
  };
  const surface = program(
    `in vec3 place; in float value; uniform mat4 view, model; out vec3 world; out float shade;
     void main() { vec4 w = model * vec4(place, 1.0); world = w.xyz; shade = value; gl_Position = view * w; }`,
    `in vec3 world; in float shade; uniform vec3 color, eye, sun; uniform float coloured; out vec4 result;
     vec3 heat(float t) {
       vec3 a = vec3(.29, .50, .71), b = vec3(.50, .77, .63), c = vec3(.95, .82, .29), d = vec3(.85, .28, .17);
       return t < .33 ? mix(a, b, t / .33) : t < .67 ? mix(b, c, (t - .33) / .34) : mix(c, d, (t - .67) / .33);
     }
     void main() {
       vec3 n = normalize(cross(dFdx(world), dFdy(world)));
       if (dot(n, eye - world) < 0.0) n = -n;
       float light = .45 + .4 * max(dot(n, normalize(sun)), 0.0) + .15 * max(dot(n, normalize(eye - world)), 0.0);
       result = vec4(mix(color, heat(shade * shade), coloured) * light, 1.0);
     }`);
  const line = program(`in vec3 place; uniform mat4 view; void main() { gl_Position = view * vec4(place, 1.0); }`,
    `out vec4 result; void main() { result = vec4(.75, .1, .35, 1.0); }`);
  const uniform = (of, name) => gl.getUniformLocation(of, name);
  const array = (values, mode) => { const b = gl.createBuffer(); gl.bindBuffer(gl.ARRAY_BUFFER, b); gl.bufferData(gl.ARRAY_BUFFER, values, mode); return b; };
  for (const mesh of head.meshes) {
    mesh.array = gl.createVertexArray();
    gl.bindVertexArray(mesh.array);
    mesh.places = array(mesh.soft ? 12 * mesh.vertices : mesh.rest, mesh.soft ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    if (mesh.soft) {
      mesh.now = new Float32Array(3 * mesh.vertices);
      mesh.shades = new Uint8Array(mesh.vertices);
      mesh.values = array(mesh.vertices, gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(1);
      gl.vertexAttribPointer(1, 1, gl.UNSIGNED_BYTE, true, 0, 0);
    }
    const index = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.index, gl.STATIC_DRAW);
  }
  const arrows = gl.createVertexArray();
  gl.bindVertexArray(arrows);
  const ends = array(0, gl.DYNAMIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);

  const sum = (a, b, t) => a.map((v, k) => v + t * b[k]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const s = 1 / (Math.hypot(...a) || 1); return a.map((v) => v * s); };
  const turned = ([x, y, z], [i, j, k, w]) => {
    const t = cross([i, j, k], [x, y, z]).map((v) => 2 * v), u = cross([i, j, k], t);
    return [x + w * t[0] + u[0], y + w * t[1] + u[1], z + w * t[2] + u[2]];
  };
  const model = (p) => {
    const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => turned(axis, p.slice(3)));
    return [...x, 0, ...y, 0, ...z, 0, p[0], p[1], p[2], 1];
  };

  // --- what is looked at: all that moves
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const include = (p) => p.forEach((v, k) => { low[k] = Math.min(low[k], v); high[k] = Math.max(high[k], v); });
  if (points) { include(head.least); include(head.largest); }
  rigid.forEach((mesh, m) => {
    if (mesh.fixed && (points || rigid.some((other) => !other.fixed))) return;
    for (const f of [0, frames - 1]) {
      const pose = [...poses.subarray(7 * (f * rigid.length + m), 7 * (f * rigid.length + m) + 7)];
      for (let v = 0; v < mesh.vertices; v++) include(sum(turned([...mesh.rest.subarray(3 * v, 3 * v + 3)], pose.slice(3)), pose, 1));
    }
  });
  const middle = low.map((v, k) => 0.5 * (v + high[k])), reach = Math.hypot(...low.map((v, k) => high[k] - v)) / 2 || 1;
  let yaw = 0.6, pitch = 0.35, distance = 2.6 * reach;
  const view = () => {
    const eye = sum(middle, upright([Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch), Math.cos(pitch) * Math.cos(yaw)]), distance);
    const z = unit(sum(eye, middle, -1)), x = unit(cross(upright([0, 1, 0]), z)), y = cross(z, x);
    const f = 1 / Math.tan(0.4), aspect = canvas.width / canvas.height, near = distance * 0.02, far = distance * 40;
    const rows = [sum([0, 0, 0], x, f / aspect), sum([0, 0, 0], y, f), z];
    const a = (far + near) / (near - far), b = (2 * far * near) / (near - far), m = new Array(16).fill(0);
    for (let k = 0; k < 3; k++) { m[4 * k] = rows[0][k]; m[4 * k + 1] = rows[1][k]; m[4 * k + 2] = a * z[k]; m[4 * k + 3] = -z[k]; }
    m[12] = -dot(rows[0], eye); m[13] = -dot(rows[1], eye); m[14] = -a * dot(z, eye) + b; m[15] = dot(z, eye);
    return [m, eye];
  };
  const paint = ["#5b8def", "#e08a4f", "#58a36c", "#b06fc4", "#c9a227", "#4fb0b5"].map((c) => [1, 3, 5].map((k) => parseInt(c.slice(k, k + 2), 16) / 255));
  const largestForce = contacts.reduce((most, _, k) => (k % 6 === 3 ? Math.max(most, Math.hypot(contacts[k], contacts[k + 1], contacts[k + 2])) : most), 0);

  const draw = (time) => {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    let f = head.times.findIndex((t) => t > time) - 1;
    if (f < 0) f = time <= head.times[0] ? 0 : frames - 1;
    const g = Math.min(f + 1, frames - 1), t = g === f ? 0 : (time - head.times[f]) / (head.times[g] - head.times[f]);
    const [matrix, eye] = view();
    gl.viewport(0, 0, w, h);
    gl.clearColor(0.81, 0.84, 0.88, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(surface);
    gl.uniformMatrix4fv(uniform(surface, "view"), false, matrix);
    gl.uniform3fv(uniform(surface, "eye"), eye);
    gl.uniform3fv(uniform(surface, "sun"), upright([-0.4, 0.8, 0.45]));
    rigid.forEach((mesh, m) => {
      if (!isIn(mesh, f)) return;
      const of = (k) => poses.subarray(7 * (k * rigid.length + m), 7 * (k * rigid.length + m) + 7);
      const [p, q] = [[...of(f)], [...of(g)]], same = dot(p.slice(3), q.slice(3)) + p[6] * q[6] < 0 ? -1 : 1;
      const mixed = p.map((v, k) => v + t * ((k > 2 ? same : 1) * q[k] - v));
      const pose = [...mixed.slice(0, 3), ...unit(mixed.slice(3))];
      gl.uniformMatrix4fv(uniform(surface, "model"), false, model(pose));
      gl.uniform3fv(uniform(surface, "color"), mesh.fixed ? [0.62, 0.65, 0.69] : [0.45, 0.47, 0.52]);
      gl.uniform1f(uniform(surface, "coloured"), 0);
      gl.bindVertexArray(mesh.array);
      gl.drawElements(gl.TRIANGLES, mesh.index.length, gl.UNSIGNED_INT, 0);
    });
    gl.uniformMatrix4fv(uniform(surface, "model"), false, model([0, 0, 0, 0, 0, 0, 1]));
    gl.uniform1f(uniform(surface, "coloured"), by("stress").checked && head.stress > 0 ? 1 : 0);
    soft.forEach((mesh, m) => {
      if (!isIn(mesh, f)) return;
      for (let v = 0; v < mesh.vertices; v++) {
        const [i, j] = [f * points + mesh.first + v, g * points + mesh.first + v];
        for (let k = 0; k < 3; k++) {
          const share = axes[k][i] + t * (axes[k][j] - axes[k][i]);
          mesh.now[3 * v + k] = head.least[k] + (share / 65535) * (head.largest[k] - head.least[k]);
        }
        mesh.shades[v] = stresses[i] + t * (stresses[j] - stresses[i]);
      }
      gl.bindVertexArray(mesh.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.places);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, mesh.now);
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.values);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, mesh.shades);
      gl.uniform3fv(uniform(surface, "color"), paint[m % paint.length]);
      gl.drawElements(gl.TRIANGLES, mesh.index.length, gl.UNSIGNED_INT, 0);
    });
    if (by("forces").checked && counts[f] > 0 && largestForce > 0) {
      const tips = new Float32Array(6 * counts[f]);
      for (let c = 0; c < counts[f]; c++) {
        const own = contacts.subarray(6 * (starts[f] + c), 6 * (starts[f] + c) + 6);
        // Lengths by the root: small forces are to be seen beside large ones.
        const size = Math.hypot(own[3], own[4], own[5]), long = (0.6 * reach * Math.sqrt(size / largestForce)) / (size || 1);
        for (let k = 0; k < 3; k++) { tips[6 * c + k] = own[k]; tips[6 * c + 3 + k] = own[k] + long * own[3 + k]; }
      }
      gl.useProgram(line);
      gl.uniformMatrix4fv(uniform(line, "view"), false, matrix);
      gl.bindVertexArray(arrows);
      gl.bindBuffer(gl.ARRAY_BUFFER, ends);
      gl.bufferData(gl.ARRAY_BUFFER, tips, gl.DYNAMIC_DRAW);
      gl.disable(gl.DEPTH_TEST);
      gl.drawArrays(gl.LINES, 0, 2 * counts[f]);
    }
  };

  // --- time and hands
  const end = head.times[frames - 1] || 1;
  let time = 0, playing = false, before = 0, wanted = true;
  const show = () => { by("clock").textContent = time.toFixed(2) + " s"; by("time").value = (1000 * time) / end; wanted = true; };
  const play = (on) => { playing = on; by("play").textContent = on ? "Stop" : "Play"; if (on && time >= end) time = 0; };
  by("play").addEventListener("click", () => play(!playing));
  by("time").addEventListener("input", () => { play(false); time = (by("time").value / 1000) * end; show(); });
  for (const id of ["forces", "stress"]) by(id).addEventListener("change", () => { wanted = true; });
  const turn = (x, y) => { yaw -= x; pitch = Math.max(-1.5, Math.min(1.5, pitch + y)); wanted = true; };
  const nearer = (by) => { distance = Math.max(0.05 * reach, Math.min(40 * reach, distance * by)); wanted = true; };
  canvas.addEventListener("pointerdown", (e) => canvas.setPointerCapture(e.pointerId));
  canvas.addEventListener("pointermove", (e) => { if (e.buttons) turn(e.movementX * 0.008, e.movementY * 0.008); });
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); nearer(Math.exp(e.deltaY * 0.001)); }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const act = { ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
      "+": () => nearer(0.9), "-": () => nearer(1.1), " ": () => play(!playing) }[e.key];
    if (act) { e.preventDefault(); act(); }
  });
  window.addEventListener("resize", () => { wanted = true; });
  by("largest").textContent = head.stress > 0 ? (head.stress / 1000).toPrecision(3) + " kPa (von Mises)" : "no stress";
  const tick = (now) => {
    if (playing) {
      time = Math.min(end, time + (Math.min(now - before, 100) / 1000) * Number(by("speed").value));
      if (time >= end) play(false);
      show();
    }
    before = now;
    if (wanted) { draw(time); wanted = false; }
    requestAnimationFrame(tick);
  };
  // Short scenes begin in slow motion: they last a second at least.
  const slow = [...by("speed").options].map((option) => Number(option.value)).find((speed) => end / speed >= 1);
  by("speed").value = String(slow || 0.01);
  // A time to begin at: page.html#t=1.5
  const asked = Number((location.hash.match(/t=([\d.]+)/) || [])[1]);
  if (asked > 0) time = Math.min(asked, end);
  show();
  requestAnimationFrame(tick);
  document.body.dataset.replay = "ready";
  // What pictures take, told on the console: page.html#measure. First without waiting for the display, then as it goes.
  if (location.hash === "#measure") {
    const begun = performance.now();
    for (let f = 0; f < frames; f++) draw(head.times[f]);
    const script = (performance.now() - begun) / frames;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits until all is drawn
    const from = performance.now();
    let pictures = 0;
    const count = (now) => {
      draw((pictures++ * 0.016) % end);
      if (now - from < 3000) requestAnimationFrame(count);
      else console.log(`replay: ${script.toFixed(3)} ms of script a picture, ${(pictures / (now - from) * 1000).toFixed(1)} pictures per second`);
    };
    requestAnimationFrame(count);
  }
})().catch((error) => { document.getElementById("hint").textContent = "The replay cannot be shown: " + error.message; document.body.dataset.replay = "failed"; });
