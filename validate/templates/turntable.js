// Turns the mesh of turntable.py by pointer, finger or key. It needs WebGL 2.
(() => {
  const stage = document.getElementById("turntable");
  const canvas = stage.querySelector("canvas");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!gl) return;

  const model = JSON.parse(document.getElementById("turntable-mesh").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const faces = new Uint16Array(bytes(model.faces).buffer);

  // Parallel projection: equal lengths look equal everywhere.
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, `#version 300 es
      in vec3 place; in vec3 normal; in vec3 colour;
      uniform vec3 low; uniform vec3 middle; uniform float step; uniform mat3 view; uniform vec3 scale;
      out vec3 tint; out vec3 facing;
      void main() {
        facing = view * normal;
        tint = colour;
        gl_Position = vec4(scale * (view * (low + place * step - middle)), 1.0);
      }`],
    [gl.FRAGMENT_SHADER, `#version 300 es
      precision highp float;
      in vec3 tint; in vec3 facing;
      uniform vec3 light; uniform float darkest;
      out vec4 shade;
      void main() {
        float lit = clamp(dot(normalize(facing), light), 0.0, 1.0);
        shade = vec4(tint * (darkest + (1.0 - darkest) * lit), 1.0);
      }`],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
  gl.useProgram(program);

  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, bytes(model.vertices), gl.STATIC_DRAW);
  for (const [name, type, normalised, offset] of [
    ["place", gl.UNSIGNED_SHORT, false, 0],
    ["normal", gl.BYTE, true, 6],
    ["colour", gl.UNSIGNED_BYTE, true, 9],
  ]) {
    const slot = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(slot);
    gl.vertexAttribPointer(slot, 3, type, normalised, 12, offset);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.CULL_FACE);

  const uniform = (name) => gl.getUniformLocation(program, name);
  gl.uniform3fv(uniform("low"), model.low_mm);
  gl.uniform3fv(uniform("middle"), model.middle_mm);
  gl.uniform1f(uniform("step"), model.step_mm);
  gl.uniform3fv(uniform("light"), model.light);
  gl.uniform1f(uniform("darkest"), model.darkest);

  const [STEP_DEG, CLOSER, MARGIN] = [5, 1.2, 1.05];
  const start = { azimuth: model.azimuth_deg, elevation: model.elevation_deg, zoom: 1 };
  const eye = { ...start };
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  const draw = () => {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((length) => length * devicePixelRatio);
    [canvas.width, canvas.height] = [Math.round(width), Math.round(height)];
    gl.viewport(0, 0, canvas.width, canvas.height);
    const [a, e] = [eye.azimuth, eye.elevation].map((degrees) => (degrees * Math.PI) / 180);
    const right = [Math.cos(a), Math.sin(a), 0];
    const toward = [Math.cos(e) * Math.sin(a), -Math.cos(e) * Math.cos(a), Math.sin(e)];
    const up = [-Math.sin(e) * Math.sin(a), Math.sin(e) * Math.cos(a), Math.cos(e)];
    gl.uniformMatrix3fv(uniform("view"), true, [...right, ...up, ...toward]);
    // Farther away if the turned mesh would not fit.
    const across = Math.max(model.reach_mm / 2, MARGIN * reach(right), (MARGIN * reach(up) * width) / height);
    const closeness = eye.zoom / across;
    gl.uniform3f(uniform("scale"), closeness, (closeness * width) / height, -1 / model.reach_mm);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.drawElements(gl.TRIANGLES, faces.length, gl.UNSIGNED_SHORT, 0);
    stage.dataset.view = `${eye.azimuth.toFixed(1)} ${eye.elevation.toFixed(1)} ${eye.zoom.toFixed(2)}`;
  };
  let waiting = 0;
  const show = () => {
    waiting ||= requestAnimationFrame(() => {
      waiting = 0;
      draw();
    });
  };
  const turn = (right, down) => {
    eye.azimuth -= right;
    eye.elevation = clamp(eye.elevation + down, -89, 89);
    show();
  };
  const zoom = (factor) => {
    eye.zoom = clamp(eye.zoom * factor, 0.5, 12);
    show();
  };
  const reset = () => {
    Object.assign(eye, start);
    show();
  };

  // Every 16th vertex is enough to find how far the mesh extends to any side.
  const places = new Uint16Array(bytes(model.vertices).buffer);
  const outposts = [];
  for (let at = 0; at < places.length; at += 6 * 16) {
    outposts.push([0, 1, 2].map((axis) => model.low_mm[axis] + places[at + axis] * model.step_mm - model.middle_mm[axis]));
  }
  const reach = (axis) =>
    outposts.reduce((most, place) => Math.max(most, Math.abs(place.reduce((sum, x, i) => sum + x * axis[i], 0))), 0);

  const pointers = new Map();
  const spread = () => {
    const [one, other] = pointers.values();
    return Math.hypot(one.x - other.x, one.y - other.y);
  };
  const lift = (event) => pointers.delete(event.pointerId);
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const apart = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    // A drag across the picture is half a turn.
    const degrees = 180 / canvas.clientWidth;
    if (apart) zoom(spread() / apart);
    else turn((event.clientX - before.x) * degrees, (event.clientY - before.y) * degrees);
  });
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  // A wheel alone scrolls the page; a pinch on a trackpad comes as a wheel with Ctrl.
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 200));
  });

  const moves = {
    ArrowLeft: () => turn(-STEP_DEG, 0),
    ArrowRight: () => turn(STEP_DEG, 0),
    ArrowUp: () => turn(0, STEP_DEG),
    ArrowDown: () => turn(0, -STEP_DEG),
    "+": () => zoom(CLOSER),
    "-": () => zoom(1 / CLOSER),
    Home: reset,
  };
  canvas.addEventListener("keydown", (event) => {
    if (!moves[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    moves[event.key]();
  });
  for (const button of stage.querySelectorAll("button")) button.addEventListener("click", moves[button.value]);

  canvas.addEventListener("webglcontextlost", () => stage.classList.remove("live"));
  stage.classList.add("live");
  new ResizeObserver(show).observe(canvas);
  draw();
})();
