// Tools: what a click on the photo places, and what a drag draws.

import { MAX_WALLS, hasEnds, nearestWall, simplified, withCorner, withVia, withWall, withoutWall } from "./draft.js";
import { made } from "./page.js";

const MAX_VIA = 50; // As in digitise/settings.py: more would draw the crack.

const far = ([x, y], [right, down]) => Math.hypot(right - x, down - y);

const canDraw = (draft) => hasEnds(draft) && draft.walls_px.length < MAX_WALLS;

export const TOOLS = {
  ends: {
    key: "e",
    setting: "ends_px",
    icon: "M6 18 18 6M6 18m-3 0a3 3 0 1 0 6 0 3 3 0 1 0-6 0M18 6m-3 0a3 3 0 1 0 6 0 3 3 0 1 0-6 0",
    guide: (draft) => {
      if (hasEnds(draft)) return "Drag an end, or click where the nearer one should be.";
      return draft.ends_px.some(Boolean) ? "Click the other end of the crack." : "Click one end of the crack: the nozzle starts there.";
    },
    place: (draft, point) => {
      const free = draft.ends_px.indexOf(null);
      const [first, second] = draft.ends_px;
      const index = free >= 0 ? free : Number(far(second, point) < far(first, point));
      return { ...draft, ends_px: draft.ends_px.map((end, place) => (place === index ? point : end)) };
    },
  },
  via: {
    key: "v",
    setting: "via_px",
    icon: "M3 19c5 0 4-7 9-7s4-7 9-7M12 12m-3 0a3 3 0 1 0 6 0 3 3 0 1 0-6 0",
    guide: (draft) => {
      if (draft.via_px.length >= MAX_VIA) return "No more via points: paint the crack in a mask instead.";
      return hasEnds(draft) ? "Click where the crack passes, if the line takes another way." : "Give both ends first.";
    },
    place: (draft, point, { path }) =>
      hasEnds(draft) && draft.via_px.length < MAX_VIA ? withVia(draft, point, path) : draft,
  },
  wall: {
    key: "w",
    setting: "walls_px",
    icon: "M3 8c4 0 4 3 8 3s5-4 10-4M3 16c5 0 6-2 9-2M15 21l1-4 5-5 3 3-5 5z",
    guide: (draft) => {
      if (!hasEnds(draft)) return "Give both ends first.";
      if (!canDraw(draft)) return "No more of these: paint the crack in a mask instead.";
      return draft.walls_px.length ? "Draw along the true wall. Click a drawn stretch to erase it." : "Draw along the true wall, from the line back to it.";
    },
    place: (draft, point, { reach }) => withoutWall(draft, nearestWall(draft, point, reach)),
    draw: (draft, trail) => (canDraw(draft) ? withWall(draft, simplified(trail)) : draft),
  },
  ruler: {
    key: "r",
    setting: "ruler_px",
    icon: "m3 16 13-13 5 5L8 21zM7 12l2 2M10 9l2 2M13 6l2 2",
    guide: (draft) =>
      draft.ruler_px.length < 2 ? "Drag along a ruler, or click two of its marks." : "Drag the ruler's two points to its marks; give their distance.",
    place: (draft, point) => ({ ...draft, scale: "ruler", ruler_px: [...(draft.ruler_px.length < 2 ? draft.ruler_px : []), point] }),
    draw: (draft, trail) => ({ ...draft, scale: "ruler", ruler_px: [trail[0], trail.at(-1)] }),
  },
  face: {
    key: "f",
    setting: "face_corners_px",
    icon: "M4 7 19 5l1 13L5 20zM4 7h.01M19 5h.01M20 18h.01M5 20h.01",
    guide: (draft) =>
      draft.face_corners_px.length === 4 ? "Drag the corners onto those of the sample's face." : `Click the four corners of the sample's face: ${4 - draft.face_corners_px.length} to go.`,
    place: (draft, point) => withCorner(draft, point),
  },
  box: {
    key: "b",
    setting: "roi_px",
    icon: "M4 4h4M10 4h4M16 4h4M4 20h4M10 20h4M16 20h4M4 6v4M4 12v4M20 6v4M20 12v4",
    guide: () => "Drag a box: the crack is searched for inside it only.",
    place: (draft, point) => ({ ...draft, roi_px: [...(draft.roi_px.length < 2 ? draft.roi_px : []), point] }),
    draw: (draft, trail) => ({ ...draft, roi_px: [trail[0], trail.at(-1)] }),
  },
};

/** A button for each of `names` in `toolbar`. */
export function addButtons(toolbar, names, choose) {
  for (const name of names) {
    const { key, icon, setting } = TOOLS[name];
    const label = name[0].toUpperCase() + name.slice(1);
    const shortcut = key.toUpperCase();
    const attributes = { "data-tool": name, title: `${label}: ${setting} (${shortcut})`, "aria-keyshortcuts": shortcut };
    const button = made("button", { ...attributes, click: () => choose(name) });
    button.innerHTML = `<svg viewBox="0 0 24 24"><path d="${icon}"/></svg><span>${label}</span>`;
    toolbar.append(button);
  }
}

/** Names of the tools; those for a scale are omitted if markers give it. */
export const toolNames = (markers) => Object.keys(TOOLS).filter((name) => !markers || !["ruler", "face"].includes(name));
