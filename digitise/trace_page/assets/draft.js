// What the user has placed so far. Drafts are never changed: every edit gives a new one.

/** A tenth of a pixel is finer than a click. */
export const rounded = ([x, y]) => [Math.round(x * 10) / 10, Math.round(y * 10) / 10];

export function draftOf(hints, markers, shape) {
  const [first = null, second = null] = hints.ends_px ?? [];
  return {
    ends: [first, second],
    crack: hints.crack ?? null,
    via: hints.via_px ?? [],
    roi: hints.roi_px ?? [],
    walls: hints.walls_px ?? [],
    scale: markers ? "markers" : hints.ruler_px ? "ruler" : hints.face_mm ? "face" : hints.mm_per_px ? "mm_per_px" : null,
    ruler: hints.ruler_px ?? [],
    rulerMm: hints.ruler_mm ?? null,
    face: hints.face_corners_px ?? [],
    faceMm: hints.face_mm ?? [null, null],
    mmPerPx: hints.mm_per_px ?? null,
    scaleIs: hints.scale_is ?? null,
    branches: hints.branches ?? null,
    depthMm: shape.depth_mm ?? null,
    tilt: shape.tilt ?? null,
    wallAngleDeg: shape.wall_angle_deg ?? null,
  };
}

/** The keys of [photo] that the draft gives; what is half said is left out. */
export function hintsOf(draft) {
  const hints = {};
  if (hasEnds(draft)) {
    hints.ends_px = draft.ends;
    if (draft.via.length) hints.via_px = draft.via;
    if (draft.walls.length) hints.walls_px = draft.walls;
  } else if (draft.crack) hints.crack = draft.crack;
  if (draft.roi.length >= 2) hints.roi_px = draft.roi;
  if (draft.branches) hints.branches = draft.branches;
  if (draft.scale === "ruler" && draft.ruler.length === 2 && draft.rulerMm) {
    hints.ruler_px = draft.ruler;
    hints.ruler_mm = draft.rulerMm;
  }
  if (draft.scale === "mm_per_px" && draft.mmPerPx) {
    hints.mm_per_px = draft.mmPerPx;
    if (draft.scaleIs) hints.scale_is = draft.scaleIs;
  }
  if ((draft.scale === "face" || draft.scale === "markers") && draft.faceMm.every(Boolean)) {
    hints.face_mm = draft.faceMm;
    if (draft.face.length === 4) hints.face_corners_px = draft.face;
  }
  return hints;
}

/** The keys of [crack] that the draft gives. */
export function shapeOf(draft) {
  const shape = {};
  if (draft.depthMm) shape.depth_mm = draft.depthMm;
  if (draft.tilt) shape.tilt = draft.tilt;
  if (draft.wallAngleDeg !== null) shape.wall_angle_deg = draft.wallAngleDeg;
  return shape;
}

/** Volume of the cavity in ml by its mean width: exact for one depth and an even crack; null where it is not known. */
export function volumeOf({ depthMm, tilt, wallAngleDeg }, walls) {
  if (!walls || walls.unit !== "mm" || !depthMm) return null;
  const mean = walls.area / walls.length;
  const closing = Math.tan(((wallAngleDeg ?? 11) * Math.PI) / 180);
  if (tilt === "flare" || tilt === "undercut") return (walls.area + closing * depthMm * walls.length) * depthMm / 1000;
  if (tilt !== "funnel" || !closing) return (walls.area * depthMm) / 1000;
  // Walls that close meet at a depth, below which there is nothing.
  const deep = Math.min(depthMm, mean / (2 * closing));
  return ((mean - closing * deep) * deep * walls.length) / 1000;
}

export const hasEnds = (draft) => draft.ends.every(Boolean);

const without = (points, index) => points.filter((_, place) => place !== index);
const replaced = (points, index, point) => points.map((old, place) => (place === index ? point : old));

const CORNERS = ["Lower left", "Lower right", "Upper right", "Upper left"];

/** Every point on the photo, in the order in which Tab visits them. */
export function pointsOf(draft) {
  const points = [];
  const add = (kind, index, point, brief, name, move, remove) =>
    points.push({ id: `${kind}-${index}`, kind, index, point, brief, name, move, remove });
  draft.ends.forEach((point, index) => {
    if (!point) return;
    add("end", index, point, `End ${index + 1}`, index ? "End 2" : "End 1, where the nozzle starts",
      (to) => ({ ...draft, ends: replaced(draft.ends, index, to) }),
      () => ({ ...draft, ends: replaced(draft.ends, index, null) }));
  });
  draft.via.forEach((point, index) =>
    add("via", index, point, `Via ${index + 1}`, `Via point ${index + 1}`,
      (to) => ({ ...draft, via: replaced(draft.via, index, to) }),
      () => ({ ...draft, via: without(draft.via, index) })));
  draft.roi.forEach((point, index) =>
    add("roi", index, point, `Box ${index + 1}`, `Corner ${index + 1} of the box`,
      (to) => ({ ...draft, roi: replaced(draft.roi, index, to) }),
      () => ({ ...draft, roi: draft.roi.length > 3 ? without(draft.roi, index) : [] })));
  if (draft.scale === "ruler") {
    draft.ruler.forEach((point, index) =>
      add("ruler", index, point, `Ruler ${index + 1}`, `Ruler, point ${index + 1}`,
        (to) => ({ ...draft, ruler: replaced(draft.ruler, index, to) }),
        () => ({ ...draft, ruler: without(draft.ruler, index) })));
  }
  if (draft.scale === "face") {
    const whole = draft.face.length === 4;
    draft.face.forEach((point, index) =>
      add("face", index, point, whole ? CORNERS[index] : `Corner ${index + 1}`,
        whole ? `${CORNERS[index]} corner of the face` : `Corner ${index + 1} of the face`,
        (to) => ({ ...draft, face: replaced(draft.face, index, to) }),
        () => ({ ...draft, face: without(draft.face, index) })));
  }
  return points;
}

/** A via point goes between the neighbours to which it is the smallest detour, along `path` where there is one. */
export function withVia(draft, point, path) {
  const stops = [draft.ends[0], ...draft.via, draft.ends[1]];
  let place = 0;
  if (path && path.length > 1) {
    const at = nearest(path, point);
    while (place < draft.via.length && nearest(path, draft.via[place]) < at) place += 1;
  } else {
    const detour = (index) => far(stops[index], point) + far(point, stops[index + 1]) - far(stops[index], stops[index + 1]);
    for (let index = 1; index < stops.length - 1; index += 1) if (detour(index) < detour(place)) place = index;
  }
  return { ...draft, via: [...draft.via.slice(0, place), point, ...draft.via.slice(place)] };
}

/** Four corners round the face from its lower left, whatever the order in which they were clicked. */
export function withCorner(draft, point) {
  const face = [...(draft.face.length === 4 ? [] : draft.face), point];
  return { ...draft, scale: "face", face: face.length === 4 ? goneRound(face) : face };
}

function goneRound(corners) {
  const middle = [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / 4);
  // y runs down, so that falling angles go round from the lower left by the lower right.
  const ring = [...corners].sort((a, b) => angle(b, middle) - angle(a, middle));
  const lowerLeft = ring.reduce((best, corner, index) => (corner[1] - corner[0] > ring[best][1] - ring[best][0] ? index : best), 0);
  return [...ring.slice(lowerLeft), ...ring.slice(0, lowerLeft)];
}

const MOST_POINTS = 200; // As MOST_WALL_POINTS in digitise/settings.py.

/** A drawn line in as few points as keep it within half a pixel, or within more where they would be too many. */
export function simplified(trail, off = 0.5) {
  const kept = thinned(trail, off);
  return kept.length > MOST_POINTS ? simplified(trail, 2 * off) : kept;
}

/** Douglas and Peucker's: a line's points farther than `off` from its chord, and so on in its parts. */
function thinned(line, off) {
  const last = line.length - 1;
  let worst = 0;
  for (let index = 1; index < last; index += 1)
    if (aside(line[index], line[0], line[last]) > aside(line[worst], line[0], line[last])) worst = index;
  if (!worst || aside(line[worst], line[0], line[last]) <= off) return [line[0], line[last]];
  return [...thinned(line.slice(0, worst + 1), off).slice(0, -1), ...thinned(line.slice(worst), off)];
}

/** Distance of a point from the piece between two others. */
function aside([x, y], [left, top], [right, bottom]) {
  const [dx, dy] = [right - left, bottom - top];
  const share = Math.min(1, Math.max(0, ((x - left) * dx + (y - top) * dy) / (dx * dx + dy * dy || 1)));
  return far([x, y], [left + share * dx, top + share * dy]);
}

/** Number of the drawn wall within `reach` of a point; -1 where there is none. */
export function nearestWall(draft, point, reach) {
  const away = (line) => Math.min(...line.slice(1).map((to, index) => aside(point, line[index], to)));
  return draft.walls.findIndex((line) => away(line) <= reach);
}

export const withoutWall = (draft, index) => (index < 0 ? draft : { ...draft, walls: without(draft.walls, index) });

const angle = ([x, y], [left, top]) => Math.atan2(y - top, x - left);
const far = ([x, y], [right, down]) => Math.hypot(right - x, down - y);

function nearest(path, point) {
  let best = 0;
  for (let index = 1; index < path.length; index += 1) if (far(path[index], point) < far(path[best], point)) best = index;
  return best;
}
