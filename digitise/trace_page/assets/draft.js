// What the user has placed so far. Drafts are never changed: every edit gives a new one.

/** A tenth of a pixel is finer than a click. */
export const rounded = ([x, y]) => [Math.round(x * 10) / 10, Math.round(y * 10) / 10];

/** What belongs to one crack, if nothing is placed. */
const NO_CRACK = { ends_px: [null, null], crack: null, via_px: [], walls_px: [], wall: null };

/** A draft without points and numbers, by the keys of the trial file. */
const EMPTY = {
  ...NO_CRACK, roi_px: [], branches: null,
  ruler_px: [], ruler_mm: null, face_corners_px: [], face_mm: [null, null], mm_per_px: null, scale_is: null,
  depth_mm: null, tilt: null, wall_angle_deg: null,
};

export const draftOf = (hints, markers, shape) => ({
  ...EMPTY,
  ...hints,
  ...shape,
  scale: markers ? "markers" : hints.ruler_px ? "ruler" : hints.face_mm ? "face" : hints.mm_per_px ? "mm_per_px" : null,
});

/** The keys of [photo] that the draft gives; an incomplete one is omitted. */
export function hintsOf(draft) {
  const ends = hasEnds(draft);
  const ruler = draft.scale === "ruler" && draft.ruler_px.length === 2 && draft.ruler_mm;
  const number = draft.scale === "mm_per_px" && draft.mm_per_px;
  const frame = draft.scale === "frame" && draft.frame[0];
  const face = (frame || ["face", "markers"].includes(draft.scale)) && draft.face_mm.every(Boolean);
  return withKeys(draft, {
    ends_px: ends,
    via_px: ends && draft.via_px.length,
    walls_px: ends && draft.walls_px.length,
    wall: draft.wall,
    crack: !ends && draft.crack,
    roi_px: draft.roi_px.length >= 2,
    branches: draft.branches,
    ruler_px: ruler,
    ruler_mm: ruler,
    mm_per_px: number,
    scale_is: number && draft.scale_is,
    face_mm: face,
    frame: face && frame,
    face_corners_px: face && draft.face_corners_px.length === 4,
  });
}

/** The keys of [crack] that the draft gives. */
export const shapeOf = (draft) =>
  withKeys(draft, { depth_mm: draft.depth_mm, tilt: draft.tilt, wall_angle_deg: draft.wall_angle_deg !== null });

const withKeys = (draft, wanted) =>
  Object.fromEntries(Object.keys(wanted).filter((key) => wanted[key]).map((key) => [key, draft[key]]));

export const hasEnds = (draft) => draft.ends_px.every(Boolean);

const without = (points, index) => points.filter((_, place) => place !== index);
export const replaced = (points, index, point) => points.map((old, place) => (place === index ? point : old));

const CORNERS = ["Lower left", "Lower right", "Upper right", "Upper left"];

/** Kinds of points in the order in which Tab visits them: kind, key in the draft, short name, and name by number. */
const KINDS = [
  ["end", "ends_px", "End", (number) => (number > 1 ? "End 2" : "End 1, where the nozzle starts")],
  ["via", "via_px", "Via", (number) => `Via point ${number}`],
  ["roi", "roi_px", "Box", (number) => `Corner ${number} of the box`],
  ["ruler", "ruler_px", "Ruler", (number) => `Ruler, point ${number}`],
  ["face", "face_corners_px", "Corner", (number) => `Corner ${number} of the face`],
];

/** Every point on the photo, in the order in which Tab visits them. */
export function pointsOf(draft) {
  return KINDS.flatMap(([kind, key, brief, name]) => {
    const points = draft[key];
    if (["ruler", "face"].includes(kind) && kind !== draft.scale) return [];
    return points.flatMap((point, index) => {
      const corner = kind === "face" && points.length === 4 && CORNERS[index];
      return point ? {
        id: `${kind}-${index}`,
        kind,
        index,
        point,
        brief: corner || `${brief} ${index + 1}`,
        name: corner ? `${corner} corner of the face` : name(index + 1),
        move: (to) => ({ ...draft, [key]: replaced(points, index, to) }),
        remove: () => ({ ...draft, [key]: remaining(kind, points, index) }),
      } : [];
    });
  });
}

/** Points without one of them; a box of three corners or fewer goes as a whole. */
const remaining = (kind, points, index) =>
  kind === "end" ? replaced(points, index, null) : kind === "roi" && points.length <= 3 ? [] : without(points, index);

/** A via point goes between the neighbours to which it is the smallest detour, along `path` if there is one. */
export function withVia(draft, point, path) {
  const stops = [draft.ends_px[0], ...draft.via_px, draft.ends_px[1]];
  let place = 0;
  if (path && path.length > 1) {
    const at = nearest(path, point);
    while (place < draft.via_px.length && nearest(path, draft.via_px[place]) < at) place += 1;
  } else {
    const detour = (index) => far(stops[index], point) + far(point, stops[index + 1]) - far(stops[index], stops[index + 1]);
    for (let index = 1; index < stops.length - 1; index += 1) if (detour(index) < detour(place)) place = index;
  }
  return { ...draft, via_px: [...draft.via_px.slice(0, place), point, ...draft.via_px.slice(place)] };
}

/** Four corners around the face from its lower left, in whatever order they were clicked. */
export function withCorner(draft, point) {
  const corners = [...(draft.face_corners_px.length === 4 ? [] : draft.face_corners_px), point];
  return { ...draft, scale: "face", face_corners_px: corners.length === 4 ? goneRound(corners) : corners };
}

function goneRound(corners) {
  const middle = [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis], 0) / 4);
  // y runs down, so that falling angles lead from the lower left to the lower right.
  const ring = [...corners].sort((a, b) => angle(b, middle) - angle(a, middle));
  const lowerLeft = ring.reduce((best, corner, index) => (corner[1] - corner[0] > ring[best][1] - ring[best][0] ? index : best), 0);
  return [...ring.slice(lowerLeft), ...ring.slice(0, lowerLeft)];
}

export const MAX_WALLS = 50; // As in digitise/settings.py.

/** `draft` without its crack's ends and walls. */
export const withoutCrack = (draft) => ({ ...draft, ...NO_CRACK });

const MAX_POINTS = 200; // As MAX_WALL_POINTS in digitise/settings.py.

/** A drawn line in as few points as keep it within half a pixel, or within more if there would be too many. */
export function simplified(trail, off = 0.5) {
  const points = thinned(trail, off);
  return points.length > MAX_POINTS ? simplified(trail, 2 * off) : points;
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

/** Distance of a point from the segment between two others. */
function aside([x, y], [left, top], [right, bottom]) {
  const [dx, dy] = [right - left, bottom - top];
  const share = Math.min(1, Math.max(0, ((x - left) * dx + (y - top) * dy) / (dx * dx + dy * dy || 1)));
  return far([x, y], [left + share * dx, top + share * dy]);
}

/** Number of the drawn wall within `reach` of a point; -1 if there is none. */
export function nearestWall(draft, point, reach) {
  const away = (line) => Math.min(...line.map((to, index) => aside(point, line[Math.max(index - 1, 0)], to)));
  return draft.walls_px.findIndex((line) => away(line) <= reach);
}

export const withWall = (draft, line) => ({ ...draft, walls_px: [...draft.walls_px, line] });
export const withoutWall = (draft, index) => (index < 0 ? draft : { ...draft, walls_px: without(draft.walls_px, index) });

const angle = ([x, y], [left, top]) => Math.atan2(y - top, x - left);
const far = ([x, y], [right, down]) => Math.hypot(right - x, down - y);

function nearest(path, point) {
  let best = 0;
  for (let index = 1; index < path.length; index += 1) if (far(path[index], point) < far(path[best], point)) best = index;
  return best;
}
