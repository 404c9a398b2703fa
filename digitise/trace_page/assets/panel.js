// The panel of findings and fields.

import { replaced, withoutWall } from "./draft.js";
import { made, part } from "./page.js";

const numberOf = (text) => Number(text.trim().replace(",", ".") || NaN);

/** A number as somebody typed it, with a point or a comma; null unless it is above zero. */
const typed = (text) => (numberOf(text) > 0 && Number.isFinite(numberOf(text)) ? numberOf(text) : null);

const inUnit = (value, digits, unit) => {
  const shown = Math.abs(value) >= 10_000 ? 0 : digits;
  return `${value.toLocaleString("en", { maximumFractionDigits: shown, minimumFractionDigits: shown })} ${unit}`;
};

const meanWidth = ({ mean_width, width_95, unit }, digits) => {
  const interval = width_95 ? ` (95 %: ${width_95.map((end) => inUnit(end, digits, "").trim()).join(" to ")})` : "";
  return inUnit(mean_width, digits, unit) + interval;
};

export function showWalls(walls) {
  const { unit } = walls ?? {};
  const digits = unit === "px" ? [0, 1, 0] : [1, 2, 0];
  part("length").textContent = walls ? inUnit(walls.length, digits[0], unit) : "–";
  part("width").textContent = walls && walls.width_source !== "none" ? meanWidth(walls, digits[1]) : "–";
  part("doubtful").hidden = !walls?.doubtful;
  part("area").textContent = walls ? inUnit(walls.area, digits[2], `${unit}²`) : "–";
}

const SOURCES = {
  ends: () => "Between your two ends",
  via: (count) => `Between your two ends, past ${count} via point${count === 1 ? "" : "s"}`,
  found: () => "Along the line that is probably the crack",
  choice: () => "Along the line with this number",
  mask: () => "As painted in the mask",
};

export function showPath(path, walls, viaCount) {
  const ends = walls && (walls.ends[0] === walls.ends[1] ? `both ends ${walls.ends[0]}` : `ends ${walls.ends.join(" and ")}`);
  return (part("how").textContent = path ? [SOURCES[path.source](viaCount), ends].filter(Boolean).join("; ") + "." : "");
}

export function showWarnings(warnings) {
  part("warnings").replaceChildren(...[...new Set(warnings)].map((warning) => made("li", {}, warning)));
}

export function showScale(scale) {
  const facts = [];
  if (scale?.mm_per_px) {
    const measured = scale.uncertainty != null; // Otherwise the number was given, as the source states.
    facts.push(measured ? `${scale.mm_per_px.toPrecision(3)} mm/px, ${scale.source}` : scale.source);
    if (measured) facts.push(`uncertain by ${(100 * scale.uncertainty).toPrecision(2)} %`);
    if (scale.residual_mm != null) facts.push(`residual ${scale.residual_mm.toFixed(3)} mm`);
    if (scale.camera_tilt_deg != null) facts.push(`camera tilted ${scale.camera_tilt_deg.toFixed(1)}°`);
  }
  part("scale-found").textContent = facts.length ? `${facts.join("; ")}.` : "No scale yet: lengths are in pixels.";
  part("scale-refused").textContent = scale?.refused ?? "";
}

/** Rows of coordinates, one a point; `edit(id, [x, y])` and `remove(id)`. A row that is being edited is not changed. */
export function showCoordinates(points, { edit, remove }) {
  const list = part("coordinates");
  const rows = new Map([...list.children].map((row) => [row.dataset.point, row]));
  for (const [id, row] of rows) if (!points.some((point) => point.id === id)) row.remove();
  points.forEach((point, place) => {
    const row = rows.get(point.id) ?? coordinateRow(point.id, edit, remove);
    if (list.children[place] !== row) list.insertBefore(row, list.children[place] ?? null);
    const [name, x, y, gone] = row.children;
    name.textContent = point.brief;
    for (const [field, axis, value] of [[x, "x", point.point[0]], [y, "y", point.point[1]]]) {
      field.setAttribute("aria-label", `${point.name}, ${axis} in px`);
      if (document.activeElement !== field) field.value = String(Math.round(value * 10) / 10);
    }
    gone.setAttribute("aria-label", `Remove ${point.name}`);
  });
}

/** A row for each wall that was drawn or chosen; `change(next)` with the draft without it. */
export function showDrawn(draft, change) {
  const walls = draft.walls_px.map(([[x, y]], index) => [`Wall from x ${Math.round(x)}, y ${Math.round(y)}`, withoutWall(draft, index)]);
  if (draft.wall) walls.push([`Wall ${draft.wall} of the band`, { ...draft, wall: null }]);
  const rows = walls.map(([name, next]) => {
    const gone = made("button", { "aria-label": `Erase ${name}`, click: () => change(next) }, "×");
    return made("div", { class: "drawn" }, made("span", {}, name), gone);
  });
  part("drawn-section").hidden = !rows.length;
  part("drawn").replaceChildren(...rows);
}

function coordinateRow(id, edit, remove) {
  const changed = () => {
    const place = fields.map(({ value }) => numberOf(value));
    fields.forEach((input, axis) => input.setAttribute("aria-invalid", String(!Number.isFinite(place[axis]))));
    if (place.every(Number.isFinite)) edit(id, place);
  };
  const fields = ["x", "y"].map(() => made("input", { inputmode: "decimal", autocomplete: "off", change: changed }));
  return made("div", { "data-point": id }, made("span"), ...fields, made("button", { click: () => remove(id) }, "×"));
}

/** Fields by their element: key in the draft, place in a pair, how a text is read, and if a wrong one changes nothing. */
const FIELDS = {
  "ruler-mm": { key: "ruler_mm" },
  "face-width-mm": { key: "face_mm", place: 0 },
  "face-height-mm": { key: "face_mm", place: 1 },
  "marker-mm": { key: "frame", place: 0 },
  "frame-ruler-mm": { key: "frame", place: 3 },
  "mm-per-px": { key: "mm_per_px" },
  "depth-mm": { key: "depth_mm", keeps: true },
  "wall-angle": { key: "wall_angle_deg", read: (text) => (numberOf(text) === 0 ? 0 : typed(text)), keeps: true },
};
const TICKS = { assumed: ["scale_is", "assumed", "measured"], "keep-branches": ["branches", "keep", "drop"] };

/** Scale and shape as the draft has them; a field that is being edited is not changed. `tables`: keys with a table. */
export function showFields(draft, tables) {
  for (const [id, { key, place }] of Object.entries(FIELDS)) {
    const value = place === undefined ? draft[key] : draft[key][place];
    if (document.activeElement !== part(id)) part(id).value = value ?? "";
  }
  for (const [id, [key, ticked]] of Object.entries(TICKS)) part(id).checked = draft[key] === ticked;
  part("tilt").value = draft.tilt ?? "lean";
  part("depth-mm").disabled = tables.includes("depth_mm");
  part("wall-angle").disabled = draft.tilt === "vertical" || tables.includes("wall_angle_deg");
  part("scale-kinds").hidden = draft.scale === "markers";
  for (const kind of ["ruler", "face", "mm_per_px", "frame"]) {
    part(`scale-${kind}`).hidden = draft.scale !== kind && !(kind === "face" && draft.scale === "frame");
    document.querySelector(`input[name="scale"][value="${kind}"]`).checked = draft.scale === kind;
  }
}

/** `change(edit)` with a function from draft to draft. */
export function watchFields(change) {
  const watch = (field, edit) => field.addEventListener("change", () => change((draft) => ({ ...draft, ...edit(draft) })));
  for (const [id, { key, place, read = typed, keeps }] of Object.entries(FIELDS)) {
    Object.assign(part(id), { inputMode: "decimal", autocomplete: "off" });
    part(id).addEventListener("change", ({ target }) => {
      const value = read(target.value);
      const wrong = target.value.trim() !== "" && value === null;
      target.setAttribute("aria-invalid", String(wrong));
      if (wrong && keeps) return;
      change((draft) => ({ ...draft, [key]: place === undefined ? value : replaced(draft[key], place, value) }));
    });
  }
  for (const [id, [key, ticked, not]] of Object.entries(TICKS)) watch(part(id), () => ({ [key]: part(id).checked ? ticked : not }));
  watch(part("tilt"), () => ({ tilt: part("tilt").value }));
  for (const choice of document.querySelectorAll('input[name="scale"]')) watch(choice, () => ({ scale: choice.value }));
}
