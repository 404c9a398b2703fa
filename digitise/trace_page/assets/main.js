// The trace page: points go to the server, lines come back.

import { draftOf, hasEnds, hintsOf, pointsOf, rounded, shapeOf, withoutCrack } from "./draft.js";
import { Findings } from "./findings.js";
import { watch } from "./gestures.js";
import { History } from "./history.js";
import { Leaving } from "./leaving.js";
import { Lines, Offers, Points } from "./marks.js";
import { part } from "./page.js";
import { showCoordinates, showDrawn, showFields, watchFields } from "./panel.js";
import { Tracing, opening } from "./server.js";
import { rove } from "./toolbar.js";
import { TOOLS, addButtons, toolNames } from "./tools.js";
import { Viewport } from "./viewport.js";

const REACH = 8; // Screen pixels from a line within which a click selects it.
const stage = part("stage");
const narrow = window.matchMedia("(max-width: 860px)");

const facts = await opening();
const first = draftOf(facts.hints, facts.markers, facts.shape);
const history = new History(first);
let draft = first; // During a drag it is ahead of the history.
let tool = hasEnds(first) ? "via" : "ends";
let crosshair = [facts.size_px[0] / 2, facts.size_px[1] / 2];
let sketching = false; // A line to the pointer, not part of the draft.

const viewport = new Viewport(stage, part("photo"), {
  size: facts.size_px,
  levels: facts.levels,
  moved: place,
  covered: () => (narrow.matches ? [0, 120] : [0, 0]), // View buttons and notices.
});
const lines = new Lines(part("lines"));
let offered;
const findings = new Findings(lines);
const offers = new Offers(part("offers"), lines, ({ ends_px: ends, wall }) => (wall ? commit({ ...draft, wall }) : take(ends.map(rounded))));
const points = new Points(part("points"), {
  moving: (id, screen) => {
    const { left, top } = stage.getBoundingClientRect();
    draft = pointOf(id).move(rounded(inPhoto(viewport.toPhoto([screen[0] - left, screen[1] - top]))));
    refresh();
    if (hasEnds(draft)) tracing.sketch(hintsOf(draft), { sketch: true, still: true }, "walls");
  },
  moved: () => commit(draft),
  pressed: pressedOnPoint,
});
const tracing = new Tracing(takeAnswer, lost);
const leaving = new Leaving({
  ready: () => tracing.scaled(),
  missing,
  content: () => ({ hints: hintsOf(confirmed()), shape: shapeOf(draft) }),
  changed: () => history.can(-1),
  lost,
  over: () => tracing.forget(),
});
addButtons(part("tools"), toolNames(facts.markers), choose);
const toolbars = [...document.querySelectorAll("[role=toolbar]")].map(rove);

/** Take `next` as the draft, and request what it changes. */
function commit(next, kind = null) {
  draft = next;
  const before = history.now;
  if (history.commit(next, kind)) ask(before);
  refresh();
}

function ask(before) {
  const placed = (draft) => JSON.stringify([hintsOf(draft), draft.ends_px, draft.via_px, draft.walls_px]);
  if (placed(before) === placed(draft) && !sketching) return;
  sketching = false;
  part("refusal").textContent = part("save-refused").textContent = "";
  if (hasEnds(draft) || facts.painted) return trace("walls");
  const searched = offers.cracks.length;
  if (JSON.stringify(before.roi_px) !== JSON.stringify(draft.roi_px)) offers.replace([]);
  const gone = ["ends_px", "via_px"].some((key) => JSON.stringify(before[key]) !== JSON.stringify(draft[key]));
  if (gone) dismiss();
  // Without ends there is nothing to follow; a new box or scale needs another search only after a first one.
  trace(searched && !gone ? "walls" : "scale");
}

function trace(until) {
  stage.dataset.state = "asking";
  say(until !== "scale" && !hasEnds(draft) ? "Searching the photo…" : "");
  tracing.trace(hintsOf(draft), {}, until);
}

function search() {
  commit(withoutCrack(draft));
  dismiss();
  trace("walls");
}

function dismiss() {
  tracing.forget();
  findings.dismiss();
  findings.draw(draft.via_px.length);
}

/** `sketch`: the drag goes on; `still`: draw only complete answers, so that walls do not flicker under a moving point. */
function takeAnswer(answer, { sketch = false, still = false }) {
  const choices = answer.cracks ?? answer.walls?.choices;
  if (choices) offers.replace(choices);
  offered = choices || (offered && !answer.scale);
  place();
  const kind = findings.take(answer);
  if (answer.scale) showFace();
  if (kind) stage.dataset.state = kind;
  if (answer.refused && !sketch) {
    stage.dataset.state = "refused";
    findings.refused();
    part("refusal").textContent = answer.refused;
    say("");
    place();
  }
  const whole = kind !== "path" || !still;
  if ((kind && whole) || (answer.refused && !sketch) || (answer.done && still)) findings.draw(draft.via_px.length);
  if (kind) checkDepth();
  if (kind !== "walls") return;
  say(`Walls traced: ${part("length").textContent} long, ${part("width").textContent} wide on average.`);
}

/** An answer stopped early: the server has ended, or failed on this request and goes on. */
async function lost() {
  if (leaving.ended) return;
  if (await opening().then(Boolean, () => false)) {
    stage.dataset.state = "refused";
    say("");
    part("refusal").textContent = "An internal error occurred: the terminal shows it. Undo, or continue with other points.";
    return;
  }
  leaving.farewell("The trace has ended", "The command that served this page has stopped. Unsaved points are lost.");
}

function refresh() {
  showCoordinates(pointsOf(draft), {
    edit: (id, to) => commit(pointOf(id).move(inPhoto(to))),
    remove: (id) => commit(pointOf(id).remove()),
  });
  showFields(draft, facts.tables);
  checkDepth();
  part("guide").textContent = TOOLS[tool].guide(draft);
  for (const button of part("tools").children) button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
  part("undo").disabled = !history.can(-1);
  part("redo").disabled = !history.can(1);
  part("swap").disabled = !hasEnds(draft);
  for (const settle of toolbars) settle();
  lines.set("ruler", draft.scale === "ruler" && draft.ruler_px.length === 2 ? draft.ruler_px : null);
  showFace();
  lines.setAll("drawn", draft.walls_px);
  showDrawn(draft, commit);
  lines.set("roi", draft.roi_px.length < 2 ? null : draft.roi_px.length === 2 ? boxed(draft.roi_px) : draft.roi_px, true);
  place();
}

/** The face as clicked, or by the scale. */
function showFace() {
  const corners = draft.face_corners_px;
  if (draft.scale === "face" && corners.length) lines.set("face", corners, corners.length === 4);
  else lines.set("face", findings.scale?.face_px, true);
}

function checkDepth() {
  const { walls } = findings;
  part("shallow").hidden = !(walls?.unit === "mm" && draft.depth_mm && draft.depth_mm < walls.mean_width);
}

/** Move all marks to the photo's current place. */
function place() {
  lines.follow(viewport);
  points.show(pointsOf(draft), viewport);
  offers.show(viewport, offered || !draft.ends_px.some(Boolean));
  const [x, y] = viewport.toScreen(crosshair);
  part("crosshair").style.transform = `translate(${x}px, ${y}px)`;
}

function say(text) {
  part("status").textContent = text;
}

const boxed = ([[x, y], [right, down]]) => [[x, y], [right, y], [right, down], [x, down]];
const pointOf = (id) => pointsOf(draft).find((point) => point.id === id);
const inPhoto = (place) => place.map((value, axis) => Math.min(Math.max(value, 0), facts.size_px[axis] - 1));

watch(stage, viewport, {
  drawing: () => Boolean(TOOLS[tool].draw),
  click: (at) => placeAt(rounded(inPhoto(viewport.toPhoto(at)))),
  hover: (at) => follow(inPhoto(viewport.toPhoto(at))),
  draw: (trail) => {
    // Replaces what the same drag drew before.
    draft = TOOLS[tool].draw(history.now, trail.map((at) => rounded(inPhoto(viewport.toPhoto(at)))));
    refresh();
  },
  drawn: () => commit(draft),
});

function placeAt(point) {
  const near = { path: hasEnds(draft) ? findings.path?.points_px : null, reach: REACH / viewport.zoom };
  const next = TOOLS[tool].place(draft, point, near);
  if (tool === "ends" && !hasEnds(draft) && hasEnds(next)) tool = "via";
  commit(next);
}

/** Show why a wall is here and, with one end placed, the line to the pointer. */
function follow(point) {
  part("how").textContent = findings.why(point, REACH / viewport.zoom) ?? findings.how ?? "";
  const [from, to] = draft.ends_px;
  if (tool !== "ends" || Boolean(from) === Boolean(to)) return;
  sketching = true;
  const ends = draft.ends_px.map((end) => end ?? rounded(point));
  tracing.sketch({ ...hintsOf(draft), ends_px: ends }, { sketch: true }, "path");
}

stage.addEventListener("pointerleave", () => {
  if (!sketching) return;
  sketching = false;
  dismiss();
});

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
    const others = pointsOf(draft);
    if (others.length) points.focus(others[Math.min(place, others.length - 1)].id);
    else stage.focus();
  } else return;
  event.preventDefault();
  event.stopPropagation();
}

stage.addEventListener("keydown", (event) => {
  if (event.target !== stage) return;
  if (event.key in ARROWS && !event.ctrlKey && !event.metaKey && !event.altKey) {
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
      leaving.save();
    } else if ((key === "z" || key === "y") && !event.target.matches("input")) {
      event.preventDefault();
      step(key === "y" || event.shiftKey ? 1 : -1);
    }
    return;
  }
  if (event.altKey || event.target.matches("input") || leaving.ended) return;
  if (event.key in VIEW_KEYS) VIEW_KEYS[event.key]();
  if (offers.press(key)) return;
  const named = toolNames(facts.markers).find((name) => TOOLS[name].key === key);
  if (named) choose(named);
});

function step(by) {
  const before = history.now;
  history.go(by);
  draft = history.now;
  if (draft !== before) ask(before);
  if (tool === "via" && !hasEnds(draft)) tool = "ends";
  refresh();
}

/** Make the ends of a detected line the user's. */
function take(ends) {
  tool = "via";
  commit({ ...withoutCrack(draft), ends_px: ends });
  stage.focus();
}

function choose(name) {
  tool = name;
  const kind = { ruler: "ruler", face: "face" }[name];
  if (kind && draft.scale !== kind) commit({ ...draft, scale: kind });
  refresh();
}

const PRESSED = {
  undo: () => step(-1),
  redo: () => step(1),
  closer: VIEW_KEYS["+"],
  farther: VIEW_KEYS["-"],
  fit: VIEW_KEYS[0],
  swap: () => commit({ ...draft, ends_px: [...draft.ends_px].reverse(), via_px: [...draft.via_px].reverse() }),
  search,
};
for (const [id, press] of Object.entries(PRESSED)) part(id).addEventListener("click", press);
watchFields((edit) => commit(edit(draft)));

/** The draft; a line that the search took and the user saves gives its ends. */
function confirmed() {
  const points = findings.path?.source === "found" && findings.path.points_px;
  return points ? { ...draft, ends_px: [points[0], points.at(-1)].map(rounded) } : draft;
}

/** A sentence on all that a save still needs, or null. */
function missing() {
  const lacks = [];
  if (!hasEnds(confirmed()) && !facts.painted) lacks.push("both ends");
  const unasked = facts.path_only || facts.tables.includes("depth_mm");
  if (!draft.depth_mm && !unasked) lacks.push("the measured depth in mm");
  if (facts.is_new && !findings.scale?.mm_per_px) lacks.push("a scale (ruler, face or mm/px)");
  return lacks.length ? `First give ${lacks.join(", ")}.` : null;
}

const measureFooter = () => document.documentElement.style.setProperty("--footer", `${part("footer").offsetHeight}px`);
new ResizeObserver(measureFooter).observe(part("footer"));
document.title = `${facts.name} · trace`;
part("name").textContent = facts.name;
part("seen").textContent = `Markers (${facts.seen} seen)`;
part("seen").parentElement.hidden = !facts.seen;
part("about").textContent = `${facts.size_px.join(" × ")} px`;
stage.setAttribute("aria-label", `Photo ${facts.name}`);
part("tables").hidden = !facts.tables.length;
part("save-where").textContent = facts.saves_to;
refresh();
trace("walls");
