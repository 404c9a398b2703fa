// Marks on the photo: detected lines, points that the user placed, and lines to choose from.

import { made } from "./page.js";

const SVG = "http://www.w3.org/2000/svg";

export class Lines {
  constructor(svg) {
    this.sheet = document.createElementNS(SVG, "g");
    svg.append(this.sheet);
    this.shown = new Map();
  }

  /** `points` in photo pixels; without points the line is removed. */
  set(name, points, closed = false) {
    if (!points?.length) {
      this.shown.get(name)?.remove();
      this.shown.delete(name);
      return;
    }
    let line = this.shown.get(name);
    if (!line) {
      line = document.createElementNS(SVG, "path");
      line.id = name;
      line.classList.add(name.replace(/-\d+$/, ""));
      this.sheet.append(line);
      this.shown.set(name, line);
    }
    // A line to itself, with round caps, is a dot.
    if (points.length === 1) points = [...points, ...points];
    line.setAttribute("d", `M${points.map(([x, y]) => `${x} ${y}`).join("L")}${closed ? "Z" : ""}`);
  }

  /** A numbered line for each of `lists`. */
  setAll(name, lists, closed) {
    for (const shown of [...this.shown.keys()]) if (shown.startsWith(`${name}-`)) this.set(shown, null);
    (lists ?? []).forEach((points, number) => this.set(`${name}-${number}`, points, closed));
  }

  follow(viewport) {
    const [x, y] = viewport.toScreen([0, 0]);
    this.sheet.setAttribute("transform", `matrix(${viewport.zoom} 0 0 ${viewport.zoom} ${x} ${y})`);
  }
}

export class Points {
  /** `moving(id, screen)` while one is dragged, `moved(id)` at its end, `pressed(id, event)` for a key. */
  constructor(group, { moving, moved, pressed }) {
    Object.assign(this, { group, moving, moved, pressed });
    this.shown = new Map();
  }

  show(points, viewport) {
    const wanted = new Set(points.map(({ id }) => id));
    for (const [id, button] of this.shown) {
      if (wanted.has(id)) continue;
      button.remove();
      this.shown.delete(id);
    }
    points.forEach((point, place) => {
      const button = this.shown.get(point.id) ?? this.button(point);
      if (this.group.children[place] !== button) this.group.insertBefore(button, this.group.children[place] ?? null);
      const [x, y] = viewport.toScreen(point.point);
      button.style.transform = `translate(${x}px, ${y}px)`;
      button.firstElementChild.textContent = point.kind === "end" ? point.index + 1 : "";
      const [right, down] = point.point.map((place) => Math.round(place * 10) / 10);
      button.setAttribute("aria-label", `${point.name}, x ${right}, y ${down}`);
    });
  }

  focus(id) {
    this.shown.get(id)?.focus();
  }

  button({ id, kind }) {
    const button = made("button", {
      id,
      class: `point ${kind}`,
      "aria-roledescription": "movable point",
      keydown: (event) => this.pressed(id, event),
      pointerdown: (event) => this.grab(id, button, event),
    }, made("span"));
    this.shown.set(id, button);
    return button;
  }

  grab(id, button, event) {
    if (event.button !== 0) return;
    event.stopPropagation();
    button.setPointerCapture(event.pointerId);
    const box = button.getBoundingClientRect();
    const off = [event.clientX - (box.left + box.width / 2), event.clientY - (box.top + box.height / 2)];
    const start = [event.clientX, event.clientY];
    let dragged = false;
    const move = (now) => {
      dragged ||= Math.hypot(now.clientX - start[0], now.clientY - start[1]) > 2;
      if (dragged) this.moving(id, [now.clientX - off[0], now.clientY - off[1]]);
    };
    const end = () => {
      button.removeEventListener("pointermove", move);
      button.removeEventListener("pointerup", end);
      button.removeEventListener("pointercancel", end);
      if (dragged) this.moved(id);
    };
    button.addEventListener("pointermove", move);
    button.addEventListener("pointerup", end);
    button.addEventListener("pointercancel", end);
  }
}

/** Lines that may be the crack, outlined and numbered: a click on a number takes it. */
export class Offers {
  /** `take(crack)` when one is chosen. */
  constructor(group, lines, take) {
    Object.assign(this, { group, lines, take });
    this.cracks = [];
  }

  /** Offer lines, best first. */
  replace(cracks) {
    this.cracks = cracks;
    this.group.replaceChildren(...this.cracks.map((crack, index) => this.button(crack, index + 1)));
  }

  /** Show or hide them. */
  show(viewport, shown) {
    this.group.hidden = !shown || !this.cracks.length;
    this.lines.setAll("offer", this.group.hidden ? [] : this.cracks.map((crack) => crack.outline_px), true);
    this.cracks.forEach((crack, index) => {
      const [x, y] = viewport.toScreen(crack.middle_px);
      this.group.children[index].style.transform = `translate(${x}px, ${y}px)`;
    });
  }

  /** Take the line with the number of a key; false if there is none. */
  press(key) {
    const crack = this.group.hidden ? null : this.cracks[Number(key) - 1];
    if (crack) this.take(crack);
    return Boolean(crack);
  }

  button(crack, number) {
    const [[left, top], [right, bottom]] = crack.ends_px.map((end) => end.map(Math.round));
    return made("button", {
      class: "offered",
      title: `Take line ${number} (${number})`,
      "aria-label": `Take line ${number}, from x ${left}, y ${top} to x ${right}, y ${bottom}`,
      "aria-keyshortcuts": number,
      // A click on the photo would place a point.
      pointerdown: (event) => event.stopPropagation(),
      click: () => this.take(crack),
    }, made("span", {}, number));
  }
}
