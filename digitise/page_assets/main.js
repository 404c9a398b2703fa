// The trace page: points go to the server, lines come back.

import { draftOf, hasEnds, hintsOf, pointsOf, rounded } from "./draft.js";
import { watch } from "./gestures.js";
import { History } from "./history.js";
import { Lines, Points } from "./marks.js";
import { showCoordinates, showPath, showScale, showScaleFields, showWalls, showWarnings, typed, watchScaleFields } from "./panel.js";
import { opening, post } from "./server.js";
import { rove } from "./toolbar.js";
import { TOOLS, toolNames } from "./tools.js";
import { Tracing } from "./tracing.js";
import { Viewport } from "./viewport.js";

const part = (id) => document.getElementById(id);
const stage = part("stage");
const narrow = window.matchMedia("(max-width: 860px)");

const facts = await opening();
const first = draftOf(facts.hints, facts.markers);
const history = new History(first);
const found = { path: null, walls: null, scale: null, stale: false }; // Stale: of an earlier question.
let draft = first; // While something is dragged it runs ahead of the history.
let tool = hasEnds(first) ? "via" : "ends";
let crosshair = [facts.size_px[0] / 2, facts.size_px[1] / 2];
let sketching = false; // A line to the pointer is shown, which nobody has asked to keep.
let ended = false;

const viewport = new Viewport(stage, part("photo"), {
  size: facts.size_px,
  levels: facts.levels,
  moved: place,
  covered: () => (narrow.matches ? [0, 120] : [0, 0]), // View buttons and notices.
});
const lines = new Lines(part("lines"));
const points = new Points(part("points"), {
  moving: (id, screen) => {
    const { left, top } = stage.getBoundingClientRect();
    draft = pointOf(id).move(rounded(inPhoto(viewport.toPhoto([screen[0] - left, screen[1] - top]))));
    refresh();
    if (hasEnds(draft)) tracing.sketch(hintsOf(draft), { sketch: true, still: true }, "glance");
  },
  moved: () => commit(draft),
  pressed: pressedOnPoint,
});
const tracing = new Tracing(heard, lost);

// ---- What is asked, and what comes back ----

/** Take `next` as said, and find out what follows from it. */
function commit(next, kind = null) {
  draft = next;
  const before = history.now;
  if (history.commit(next, kind)) ask(before);
  refresh();
}

function ask(before) {
  sketching = false;
  part("refusal").textContent = "";
  if (hasEnds(draft) || facts.painted) {
    part("proposal").hidden = true;
    return trace("walls");
  }
  const gone = ["ends", "via"].some((key) => JSON.stringify(before[key]) !== JSON.stringify(draft[key]));
  if (gone) dismiss();
  // Without ends there is nothing to follow; a new box or scale is worth another search only where one was made.
  trace(found.path?.source === "automatic" ? "walls" : "scale");
}

function trace(until) {
  stage.dataset.state = "asking";
  say(until !== "scale" && !hasEnds(draft) ? "Searching the photo…" : "");
  tracing.trace(hintsOf(draft), {}, until);
}

function search() {
  commit({ ...draft, ends: [null, null], via: [] });
  dismiss();
  trace("walls");
}

/** Take away what was found. */
function dismiss() {
  tracing.forget();
  found.path = found.walls = null;
  part("proposal").hidden = true;
  draw();
}

/** `sketch`: nobody has let go yet; `still`: draw when all is there, lest walls flicker under a moving point. */
function heard(answer, { sketch = false, still = false }) {
  if (answer.scale) {
    found.scale = answer.scale;
    found.stale = true;
    showScale(answer.scale);
    if (draft.scale !== "face" || !draft.face.length) lines.set("face", answer.scale.face_px, true);
    lines.setAll("marker", answer.scale.markers_px, true);
  }
  if (answer.path) {
    found.path = answer.path;
    found.stale = false;
    found.walls = null;
    stage.dataset.state = "path";
    if (!still) draw();
  }
  if (answer.done && still) draw();
  if (answer.glance) {
    found.walls = answer.glance;
    stage.dataset.state = "glance";
    draw();
  }
  if (answer.walls) {
    found.walls = answer.walls;
    stage.dataset.state = "walls";
    part("proposal").hidden = found.path.source !== "automatic";
    draw();
    say(`Walls found: ${part("length").textContent} long, ${part("width").textContent} wide on average.`);
  }
  if (answer.refused && !sketch) {
    stage.dataset.state = "refused";
    say("");
    part("refusal").textContent = answer.refused;
    found.walls = null;
    if (found.stale) found.path = null; // The way itself was refused, not its walls.
    draw();
  }
}

/** Draw what was found. */
function draw() {
  const { path, walls } = found;
  const automatic = path?.source === "automatic";
  part("lines").classList.toggle("proposed", automatic);
  document.body.classList.toggle("rough", stage.dataset.state !== "walls");
  lines.set("ring", walls?.outline_px, true);
  lines.setAll("island", walls?.islands_px, true);
  lines.setAll("branch", walls?.branches_px);
  lines.set("left-wall", walls?.left_px);
  lines.set("right-wall", walls?.right_px);
  lines.set("way", walls ? walls.centreline_px : path?.points_px);
  showWalls(walls);
  showPath(path, walls, draft.via.length);
  showWarnings([...(found.scale?.warnings ?? []), ...(path?.warnings ?? []), ...(walls?.warnings ?? [])]);
}

/** An answer stopped short: the server has gone, or stumbled over this question and goes on. */
async function lost() {
  if (ended) return;
  if (await opening().then(Boolean, () => false)) {
    stage.dataset.state = "refused";
    say("");
    part("refusal").textContent = "This went wrong by a bug of ours: the terminal shows where. Undo, or go on with other points.";
    return;
  }
  farewell("The trace has ended", "The command that served this page no longer runs. What was not saved is gone.");
}

// ---- What is seen ----

function refresh() {
  showCoordinates(pointsOf(draft), {
    edit: (id, to) => commit(pointOf(id).move(inPhoto(to))),
    remove: (id) => commit(pointOf(id).remove()),
  });
  showScaleFields(draft);
  part("guide").textContent = TOOLS[tool].guide(draft);
  for (const button of part("tools").children) button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
  part("undo").disabled = !history.canUndo;
  part("redo").disabled = !history.canRedo;
  part("swap").disabled = !hasEnds(draft);
  for (const settle of toolbars) settle();
  lines.set("ruler", draft.scale === "ruler" && draft.ruler.length === 2 ? draft.ruler : null);
  if (draft.scale === "face" && draft.face.length > 1) lines.set("face", draft.face, draft.face.length === 4);
  lines.set("roi", draft.roi.length < 2 ? null : draft.roi.length === 2 ? boxed(draft.roi) : draft.roi, true);
  place();
}

/** Put everything where the photo lies now. */
function place() {
  lines.follow(viewport);
  points.show(pointsOf(draft), viewport);
  const [x, y] = viewport.toScreen(crosshair);
  part("crosshair").style.transform = `translate(${x}px, ${y}px)`;
}

function say(text) {
  part("status").textContent = text;
}

const boxed = ([[x, y], [right, down]]) => [[x, y], [right, y], [right, down], [x, down]];
const pointOf = (id) => pointsOf(draft).find((point) => point.id === id);
const inPhoto = (place) => place.map((value, axis) => Math.min(Math.max(value, 0), facts.size_px[axis] - 1));

// ---- Pointer ----

watch(stage, viewport, {
  drawing: () => Boolean(TOOLS[tool].draw),
  click: (at) => placeAt(rounded(inPhoto(viewport.toPhoto(at)))),
  hover: (at) => follow(inPhoto(viewport.toPhoto(at))),
  draw: (from, to) => {
    draft = TOOLS[tool].draw(draft, ...[from, to].map((at) => rounded(inPhoto(viewport.toPhoto(at)))));
    refresh();
  },
  drawn: () => commit(draft),
});

function placeAt(point) {
  const next = TOOLS[tool].place(draft, point, hasEnds(draft) ? found.path?.points_px : null);
  if (tool === "ends" && !hasEnds(draft) && hasEnds(next)) tool = "via";
  commit(next);
}

/** With one end placed, the line to the pointer is shown as it moves. */
function follow(point) {
  const [from, to] = draft.ends;
  if (tool !== "ends" || Boolean(from) === Boolean(to)) return;
  sketching = true;
  const ends = draft.ends.map((end) => end ?? rounded(point));
  tracing.sketch({ ...hintsOf(draft), ends_px: ends }, { sketch: true }, "path");
}

stage.addEventListener("pointerleave", () => {
  if (!sketching) return;
  sketching = false;
  dismiss();
});

// ---- Keyboard ----

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function pressedOnPoint(id, event) {
  const point = pointOf(id);
  if (event.key in ARROWS && !event.ctrlKey && !event.metaKey && !event.altKey) {
    const step = event.shiftKey ? 10 : 1;
    const to = rounded(inPhoto(point.point.map((value, axis) => value + step * ARROWS[event.key][axis])));
    commit(point.move(to), `nudge ${id}`);
    viewport.reveal(to);
  } else if (event.key === "Delete" || event.key === "Backspace") {
    const place = pointsOf(draft).findIndex((other) => other.id === id);
    commit(point.remove());
    const left = pointsOf(draft);
    if (left.length) points.focus(left[Math.min(place, left.length - 1)].id);
    else stage.focus();
  } else return;
  event.preventDefault();
  event.stopPropagation();
}

stage.addEventListener("keydown", (event) => {
  if (event.target !== stage) return;
  if (event.key in ARROWS && !event.ctrlKey && !event.metaKey && !event.altKey) {
    // In screen pixels, so that it goes as far to the eye at any zoom.
    const step = (event.shiftKey ? 64 : 8) / viewport.zoom;
    crosshair = inPhoto(crosshair.map((value, axis) => value + step * ARROWS[event.key][axis]));
    part("crosshair").hidden = false;
    viewport.reveal(crosshair);
    place();
    follow(crosshair);
    say(`Crosshair at x ${Math.round(crosshair[0])}, y ${Math.round(crosshair[1])}`);
  } else if (event.key === "Enter" || event.key === " ") placeAt(rounded(crosshair));
  else return;
  event.preventDefault();
});
stage.addEventListener("focus", () => {
  part("crosshair").hidden = !stage.matches(":focus-visible");
});
stage.addEventListener("blur", () => {
  part("crosshair").hidden = true;
});

const VIEW_KEYS = { "+": () => viewport.zoomBy(1.5), "=": () => viewport.zoomBy(1.5), "-": () => viewport.zoomBy(1 / 1.5), 0: () => viewport.fit() };

document.addEventListener("keydown", (event) => {
  const key = event.key.toLowerCase();
  if (event.ctrlKey || event.metaKey) {
    if (key === "s") {
      event.preventDefault();
      save();
    } else if ((key === "z" || key === "y") && !event.target.matches("input")) {
      event.preventDefault();
      step(key === "y" || event.shiftKey ? "redo" : "undo");
    }
    return;
  }
  if (event.altKey || event.target.matches("input") || ended) return;
  if (event.key in VIEW_KEYS) VIEW_KEYS[event.key]();
  const named = toolNames(facts.markers).find((name) => TOOLS[name].key === key);
  if (named) choose(named);
});

function step(direction) {
  const before = history.now;
  history[direction]();
  draft = history.now;
  if (draft !== before) ask(before);
  if (tool === "via" && !hasEnds(draft)) tool = "ends";
  refresh();
}

// ---- Buttons and fields ----

for (const name of toolNames(facts.markers)) {
  const { key, label, icon } = TOOLS[name];
  const button = document.createElement("button");
  button.dataset.tool = name;
  button.title = `${label} (${key.toUpperCase()})`;
  button.setAttribute("aria-keyshortcuts", key.toUpperCase());
  button.innerHTML = `<svg viewBox="0 0 24 24"><path d="${icon}"/></svg>`;
  const text = document.createElement("span");
  text.textContent = label;
  button.append(text);
  button.addEventListener("click", () => choose(name));
  part("tools").append(button);
}

const toolbars = [...document.querySelectorAll("[role=toolbar]")].map(rove);
for (const button of document.querySelectorAll("[role=toolbar] button")) button.tabIndex = -1;

function choose(name) {
  tool = name;
  const kind = { ruler: "ruler", face: "face" }[name];
  if (kind && draft.scale !== kind) commit({ ...draft, scale: kind });
  refresh();
}

part("undo").addEventListener("click", () => step("undo"));
part("redo").addEventListener("click", () => step("redo"));
part("closer").addEventListener("click", () => viewport.zoomBy(1.5));
part("farther").addEventListener("click", () => viewport.zoomBy(1 / 1.5));
part("fit").addEventListener("click", () => viewport.fit());
part("swap").addEventListener("click", () =>
  commit({ ...draft, ends: [...draft.ends].reverse(), via: [...draft.via].reverse() }));
part("search").addEventListener("click", search);
part("accept").addEventListener("click", () => {
  const line = found.path.points_px;
  tool = "via";
  commit({ ...draft, ends: [line[0], line.at(-1)].map(rounded) });
  stage.focus();
});
part("reject").addEventListener("click", () => {
  dismiss();
  stage.focus();
});
watchScaleFields((edit) => commit(edit(draft)));

// ---- Leaving ----

function unready() {
  if (!hasEnds(draft) && !facts.painted) return "Give the two ends first: a line that was found automatically stays a proposal.";
  if (facts.needs_depth && typed(part("depth-mm").value) === null) return "Give the measured depth first, in mm.";
  if (facts.needs_depth && !found.scale?.mm_per_px) return "Give a scale first: ruler, face or mm/px.";
  return null;
}

async function save() {
  if (ended) return;
  const missing = unready();
  part("save-refused").textContent = missing ?? "";
  if (missing) return;
  const content = { hints: hintsOf(draft), depth_mm: facts.needs_depth ? typed(part("depth-mm").value) : null };
  try {
    await post("save", content, (answer) => {
      if (answer.refused) part("save-refused").textContent = answer.refused;
      if (answer.saved) farewell("Saved", answer.saved.summary, answer.saved.next);
    });
  } catch (fault) {
    lost(fault);
  }
}

let sure = false; // The first press on Quit asks, the second leaves.

async function quit() {
  if (history.canUndo && !sure) {
    sure = true;
    part("quit").textContent = "Quit without saving?";
    return;
  }
  await post("quit", {}, () => farewell("Nothing was saved", "The trial and the photo are as they were.")).catch(lost);
}

part("quit").addEventListener("blur", () => {
  sure = false;
  part("quit").textContent = "Quit";
});
part("save").addEventListener("click", save);
part("quit").addEventListener("click", quit);
window.addEventListener("beforeunload", (event) => {
  if (!ended && history.canUndo) event.preventDefault();
});

function farewell(title, text, next) {
  ended = true;
  tracing.forget();
  part("farewell-title").textContent = title;
  part("farewell-text").textContent = text;
  part("farewell-next").textContent = next ?? "";
  part("farewell-next").hidden = !next;
  part("farewell").addEventListener("cancel", (event) => event.preventDefault());
  part("farewell").showModal();
}

// ---- Beginning ----

document.title = `${facts.name} · trace`;
part("name").textContent = facts.name;
part("about").textContent = `${facts.size_px.join(" × ")} px`;
stage.setAttribute("aria-label", `Photo ${facts.name}`);
part("depth-section").hidden = !facts.needs_depth;
part("save-where").textContent = facts.saves_to;
refresh();
trace("walls");
