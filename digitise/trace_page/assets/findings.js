// Findings of the server by the current hints, as lines on the photo and figures in the panel.

import { showPath, showScale, showWalls, showWarnings } from "./panel.js";

export class Findings {
  constructor(lines) {
    this.lines = lines;
    this.path = this.walls = this.scale = null;
    this.stale = false; // The path is of an earlier request.
  }

  /** Take one line of an answer; return the kind of finding that it brings, or null. */
  take({ scale, path, walls }) {
    if (scale) {
      this.scale = scale;
      this.stale = true;
      showScale(scale);
      this.lines.setAll("marker", scale.markers_px, true);
    }
    if (path) {
      if (`${path.points_px}` !== `${this.path?.points_px}`) this.walls = null;
      this.path = path;
      this.stale = false;
      return "path";
    }
    if (walls) {
      this.walls = walls;
      return "walls";
    }
    return null;
  }

  /** Drop path and walls if they are of an earlier request. */
  refused() {
    if (this.stale) this.path = this.walls = null;
  }

  dismiss() {
    this.path = this.walls = null;
  }

  /** Why the wall within `reach` px of a place is there. */
  why([x, y], reach) {
    let best;
    for (const side of ["left", "right"])
      this.walls?.[`${side}_px`].forEach((at, i) => {
        const away = Math.hypot(at[0] - x, at[1] - y);
        if (away < reach) [reach, best] = [away, this.walls.why.findLast((it) => it[0] === side && it[1] <= i && i <= it[2])];
      });
    return best?.[3];
  }

  draw(viaCount) {
    const { lines, path, walls, scale } = this;
    lines.set("ring", walls?.outline_px, true);
    lines.setAll("island", walls?.islands_px, true);
    lines.setAll("band", walls?.bands_px, true);
    lines.setAll("branch", walls?.branches_px);
    lines.set("left-wall", walls?.left_px);
    lines.set("right-wall", walls?.right_px);
    lines.set("way", walls ? walls.centreline_px : path?.points_px);
    showWalls(walls);
    this.how = showPath(path, walls, viaCount);
    showWarnings([...(scale?.warnings ?? []), ...(path?.warnings ?? []), ...(walls?.warnings ?? [])]);
  }
}
