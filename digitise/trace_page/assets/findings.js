// What the server has found with the hints of the moment, as lines on the photo and figures beside it.

import { showPath, showScale, showWalls, showWarnings } from "./panel.js";

export class Findings {
  constructor(lines) {
    this.lines = lines;
    this.path = this.walls = this.scale = null;
    this.rough = false;
    this.stale = false; // The path is of an earlier question.
  }

  /** Found without ends: a proposal. */
  get automatic() {
    return this.path?.source === "automatic";
  }

  /** Take one line of an answer; gives what is known now, or null where nothing new is. */
  hear({ scale, path, glance, walls }) {
    if (scale) {
      this.scale = scale;
      this.stale = true;
      showScale(scale);
      this.lines.setAll("marker", scale.markers_px, true);
    }
    if (path) {
      this.path = path;
      this.stale = false;
      this.walls = null;
      return "path";
    }
    if (glance || walls) {
      this.walls = walls ?? glance;
      this.rough = !walls;
      return walls ? "walls" : "glance";
    }
    return null;
  }

  /** The way itself was refused, or only its walls. */
  refused() {
    if (this.stale) this.path = null;
    this.walls = null;
  }

  dismiss() {
    this.path = this.walls = null;
  }

  draw(viaCount) {
    const { lines, path, walls, scale } = this;
    lines.sheet.classList.toggle("proposed", this.automatic);
    lines.set("ring", walls?.outline_px, true);
    lines.setAll("island", walls?.islands_px, true);
    lines.setAll("branch", walls?.branches_px);
    lines.set("left-wall", walls?.left_px);
    lines.set("right-wall", walls?.right_px);
    lines.set("way", walls ? walls.centreline_px : path?.points_px);
    showWalls(walls, this.rough);
    showPath(path, walls, viaCount);
    showWarnings([...(scale?.warnings ?? []), ...(path?.warnings ?? []), ...(walls?.warnings ?? [])]);
  }
}
