// The findings and fields beside the photo.

const part = (id) => document.getElementById(id);

/** A number as somebody typed it, with a point or a comma; null where it is none or not above zero. */
export function typed(text) {
  const number = Number(text.trim().replace(",", "."));
  return text.trim() !== "" && Number.isFinite(number) && number > 0 ? number : null;
}

const inUnit = (value, digits, unit) => {
  const whole = Math.abs(value) >= 10_000;
  return `${value.toLocaleString("en", { maximumFractionDigits: whole ? 0 : digits, minimumFractionDigits: whole ? 0 : digits })} ${unit}`;
};

/** With its 95 % interval, where it is fitted. */
const meanWidth = ({ mean_width, width_95, unit }, digits) => {
  const interval = width_95 ? ` (95 %: ${width_95.map((end) => inUnit(end, digits, "").trim()).join(" to ")})` : "";
  return inUnit(mean_width, digits, unit) + interval;
};

/** `rough`: measured at a glance only. */
export function showWalls(walls, rough) {
  const { unit } = walls ?? {};
  part("length").closest("dl").classList.toggle("rough", rough);
  const digits = unit === "px" ? [0, 1, 0] : [1, 2, 0];
  part("length").textContent = walls ? inUnit(walls.length, digits[0], unit) : "–";
  part("width").textContent = walls && walls.width_source !== "none" ? meanWidth(walls, digits[1]) : "–";
  part("area").textContent = walls ? inUnit(walls.area, digits[2], `${unit}²`) : "–";
}

/** Depth and tilt of the walls, and the volume that follows from them; `tables`: keys of which the trial has one. */
export function showShape(draft, tables, volumeMl) {
  for (const [id, value] of [["depth-mm", draft.depthMm], ["wall-angle", draft.wallAngleDeg]]) {
    const field = part(id);
    if (document.activeElement !== field) field.value = value ?? "";
  }
  part("tilt").value = draft.tilt ?? "lean";
  part("depth-mm").disabled = tables.includes("depth_mm");
  part("wall-angle").disabled = draft.tilt === "vertical" || tables.includes("wall_angle_deg");
  part("keep-branches").checked = draft.branches === "keep";
  part("volume").textContent = volumeMl === null || tables.length ? "–" : inUnit(volumeMl, 2, "ml");
}

/** `change(edit)` with a function from draft to draft. */
export function watchShape(change) {
  const watch = (id, read, edit) =>
    part(id).addEventListener("change", ({ target }) => {
      const value = read(target.value);
      target.setAttribute("aria-invalid", String(target.value.trim() !== "" && value === null));
      if (value !== null || target.value.trim() === "") change((draft) => edit(draft, value));
    });
  const angle = (text) => (Number(text.trim().replace(",", ".")) === 0 && text.trim() ? 0 : typed(text));
  watch("depth-mm", typed, (draft, depthMm) => ({ ...draft, depthMm }));
  watch("wall-angle", angle, (draft, wallAngleDeg) => ({ ...draft, wallAngleDeg }));
  watch("tilt", (text) => text, (draft, tilt) => ({ ...draft, tilt }));
  part("keep-branches").addEventListener("change", ({ target }) =>
    change((draft) => ({ ...draft, branches: target.checked ? "keep" : "drop" })));
}

const SOURCES = {
  ends: () => "Between your two ends",
  via: (count) => `Between your two ends, past ${count} via point${count === 1 ? "" : "s"}`,
  automatic: () => "Found automatically: a proposal",
  mask: () => "As painted in the mask",
};

export function showPath(path, walls, viaCount) {
  const ends = walls && (walls.ends[0] === walls.ends[1] ? `both ends ${walls.ends[0]}` : `ends ${walls.ends.join(" and ")}`);
  part("how").textContent = path ? [SOURCES[path.source](viaCount), ends].filter(Boolean).join("; ") + "." : "";
}

export function showWarnings(warnings) {
  part("warnings").replaceChildren(
    ...[...new Set(warnings)].map((warning) => {
      const line = document.createElement("li");
      line.textContent = warning;
      return line;
    }),
  );
}

export function showScale(scale) {
  const facts = [];
  if (scale?.mm_per_px) {
    const measured = scale.uncertainty != null; // Else it is a number that was given, as the source says.
    facts.push(measured ? `${scale.mm_per_px.toPrecision(3)} mm/px, ${scale.source}` : scale.source);
    if (measured) facts.push(`uncertain by ${(100 * scale.uncertainty).toPrecision(2)} %`);
    if (scale.residual_mm != null) facts.push(`residual ${scale.residual_mm.toFixed(3)} mm`);
    if (scale.camera_tilt_deg != null) facts.push(`camera tilted ${scale.camera_tilt_deg.toFixed(1)}°`);
  }
  part("scale-found").textContent = facts.length ? `${facts.join("; ")}.` : "No scale yet: lengths are in pixels.";
  part("scale-refused").textContent = scale?.refused ?? "";
}

/** Rows of coordinates, one a point; `edit(id, [x, y])` and `remove(id)`. A row that is typed into is left alone. */
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

/** The folder's photos; `turn(index, button)` shows another one. */
export function showPhotos(photos, turn) {
  part("photos-section").hidden = !photos.length;
  part("photos").replaceChildren(
    ...photos.map(({ name, done, here }, index) => {
      const row = document.createElement("li");
      const button = document.createElement("button");
      const state = document.createElement("span");
      state.className = "state";
      state.textContent = done ? "traced" : "open";
      button.append(name, state);
      if (here) button.setAttribute("aria-current", "true");
      else button.addEventListener("click", () => turn(index, button));
      row.append(button);
      return row;
    }),
  );
}

/** A row for each stretch of wall that was drawn; `erase(index)`. */
export function showDrawn(walls, erase) {
  part("drawn-section").hidden = !walls.length;
  part("drawn").replaceChildren(
    ...walls.map((line, index) => {
      const row = document.createElement("div");
      const name = document.createElement("span");
      const gone = document.createElement("button");
      const [x, y] = line[0].map(Math.round);
      name.textContent = `Wall ${index + 1}, from x ${x}, y ${y}`;
      gone.textContent = "×";
      gone.setAttribute("aria-label", `Erase drawn wall ${index + 1}`);
      gone.addEventListener("click", () => erase(index));
      row.append(name, gone);
      return row;
    }),
  );
}

function coordinateRow(id, edit, remove) {
  const row = document.createElement("div");
  row.dataset.point = id;
  const name = document.createElement("span");
  const fields = ["x", "y"].map(() => {
    const field = document.createElement("input");
    field.inputMode = "decimal";
    field.autocomplete = "off";
    field.addEventListener("change", () => {
      const place = fields.map(({ value }) => Number(value.trim().replace(",", ".") || NaN));
      fields.forEach((input, axis) => input.setAttribute("aria-invalid", String(!Number.isFinite(place[axis]))));
      if (place.every(Number.isFinite)) edit(id, place);
    });
    return field;
  });
  const gone = document.createElement("button");
  gone.textContent = "×";
  gone.addEventListener("click", () => remove(id));
  row.append(name, ...fields, gone);
  return row;
}

/** Fields of the scale as the draft has them; one that is typed into is left alone. */
export function showScaleFields(draft) {
  part("scale-kinds").hidden = draft.scale === "markers";
  for (const kind of ["ruler", "face", "mm_per_px"]) {
    part(`scale-${kind}`).hidden = draft.scale !== kind;
    document.querySelector(`input[name="scale"][value="${kind}"]`).checked = draft.scale === kind;
  }
  const values = {
    "ruler-mm": draft.rulerMm,
    "face-width-mm": draft.faceMm[0],
    "face-height-mm": draft.faceMm[1],
    "mm-per-px": draft.mmPerPx,
  };
  for (const [id, value] of Object.entries(values)) {
    const field = part(id);
    if (document.activeElement !== field) field.value = value ?? "";
  }
  part("assumed").checked = draft.scaleIs === "assumed";
}

/** `change(edit)` with a function from draft to draft. */
export function watchScaleFields(change) {
  const number = (id, edit) =>
    part(id).addEventListener("change", ({ target }) => {
      const value = typed(target.value);
      target.setAttribute("aria-invalid", String(target.value.trim() !== "" && value === null));
      change((draft) => edit(draft, value));
    });
  number("ruler-mm", (draft, rulerMm) => ({ ...draft, rulerMm }));
  number("face-width-mm", (draft, width) => ({ ...draft, faceMm: [width, draft.faceMm[1]] }));
  number("face-height-mm", (draft, height) => ({ ...draft, faceMm: [draft.faceMm[0], height] }));
  number("mm-per-px", (draft, mmPerPx) => ({ ...draft, mmPerPx }));
  part("assumed").addEventListener("change", ({ target }) =>
    change((draft) => ({ ...draft, scaleIs: target.checked ? "assumed" : "measured" })));
  for (const choice of document.querySelectorAll('input[name="scale"]')) {
    choice.addEventListener("change", () => change((draft) => ({ ...draft, scale: choice.value })));
  }
}
