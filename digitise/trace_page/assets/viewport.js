// View of the photo: the visible part, its zoom, and its tiles.
// Photo coordinates count from the centre of the first pixel, x right, y down.

const TILE = 512;
const MAX_ZOOM = 40; // Screen pixels per pixel: a crack's edge then fills the screen.
const MARGIN = 28; // Around the whole photo, in screen pixels.
const KEPT_TILES = 240; // 60 million pixels at most: more than any screen, less than a tab's memory.

export class Viewport {
  /** `covered()`: heights of the stage, at its top and bottom, that other elements cover. */
  constructor(stage, canvas, { size, levels, moved, covered }) {
    Object.assign(this, { stage, canvas, size, levels, moved, covered });
    this.tiles = new Map();
    this.zoom = 1;
    this.centre = [size[0] / 2, size[1] / 2];
    this.fitted = true;
    new ResizeObserver(() => this.resized()).observe(stage);
    this.resized();
  }

  resized() {
    const { width, height } = this.stage.getBoundingClientRect();
    this.extent = [width, height];
    this.density = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * this.density);
    this.canvas.height = Math.round(height * this.density);
    if (this.fitted) this.fit();
    else this.refresh();
  }

  toScreen([x, y]) {
    return [(x - this.centre[0]) * this.zoom + this.extent[0] / 2, (y - this.centre[1]) * this.zoom + this.extent[1] / 2];
  }

  toPhoto([x, y]) {
    return [(x - this.extent[0] / 2) / this.zoom + this.centre[0], (y - this.extent[1] / 2) / this.zoom + this.centre[1]];
  }

  get fitZoom() {
    const free = [this.extent[0], this.extent[1] - this.covered().reduce((sum, side) => sum + side)];
    return Math.min(...this.size.map((side, axis) => Math.max(free[axis] - 2 * MARGIN, 40) / side));
  }

  fit() {
    this.zoom = this.fitZoom;
    const [above, below] = this.covered();
    this.centre = [(this.size[0] - 1) / 2, (this.size[1] - 1 + (below - above) / this.zoom) / 2];
    this.fitted = true;
    this.refresh();
  }

  /** The screen point `at` stays fixed. */
  zoomBy(factor, at = [this.extent[0] / 2, this.extent[1] / 2]) {
    const fixed = this.toPhoto(at);
    const least = Math.min(this.fitZoom, 1) / 2;
    this.zoom = Math.min(Math.max(this.zoom * factor, least), MAX_ZOOM);
    this.centre = fixed.map((place, axis) => place - (at[axis] - this.extent[axis] / 2) / this.zoom);
    this.fitted = false;
    this.refresh();
  }

  panBy([right, down]) {
    const centre = [this.centre[0] - right / this.zoom, this.centre[1] - down / this.zoom];
    // Part of the photo stays visible.
    this.centre = centre.map((place, axis) => Math.min(Math.max(place, 0), this.size[axis] - 1));
    this.fitted = false;
    this.refresh();
  }

  /** Move only as far as is needed to see `point`. */
  reveal(point) {
    const inset = Math.min(60, ...this.extent.map((side) => side / 4));
    const off = this.toScreen(point).map((place, axis) => place - Math.min(Math.max(place, inset), this.extent[axis] - inset));
    if (off.some(Boolean)) this.panBy(off.map((distance) => -distance));
  }

  refresh() {
    if (this.drawing) return;
    this.drawing = requestAnimationFrame(() => {
      this.drawing = null;
      this.draw();
      this.moved();
    });
  }

  draw() {
    const pen = this.canvas.getContext("2d", { alpha: false });
    pen.fillStyle = getComputedStyle(this.stage).backgroundColor;
    pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
    // Pixels of four screen pixels or more are not smoothed.
    pen.imageSmoothingEnabled = this.zoom * this.density < 4;
    pen.imageSmoothingQuality = "high";
    const wanted = Math.floor(Math.log2(1 / (this.zoom * this.density)));
    const level = Math.min(Math.max(wanted, 0), this.levels - 1);
    // The coarsest level first: it loads at once, and fills gaps of the finer one.
    for (const shown of new Set([this.levels - 1, level])) this.drawLevel(pen, shown);
  }

  drawLevel(pen, level) {
    const side = TILE * 2 ** level;
    const [left, top] = this.toPhoto([0, 0]);
    const [right, bottom] = this.toPhoto(this.extent);
    const last = this.size.map((length) => Math.ceil(length / side) - 1);
    const from = [left, top].map((edge) => Math.max(0, Math.floor((edge + 0.5) / side)));
    const to = [right, bottom].map((edge, axis) => Math.min(last[axis], Math.floor((edge + 0.5) / side)));
    for (let row = from[1]; row <= to[1]; row += 1) {
      for (let column = from[0]; column <= to[0]; column += 1) {
        const tile = this.tile(level, column, row);
        if (!tile.complete || !tile.naturalWidth) continue;
        const start = [column * side - 0.5, row * side - 0.5];
        const end = [start[0] + tile.naturalWidth * 2 ** level, start[1] + tile.naturalHeight * 2 ** level];
        // Whole screen pixels: fractions would leave seams.
        const [x, y] = this.toScreen(start).map((place) => Math.round(place * this.density));
        const [beyond, below] = this.toScreen(end).map((place) => Math.round(place * this.density));
        pen.drawImage(tile, x, y, beyond - x, below - y);
      }
    }
  }

  tile(level, column, row) {
    const name = `photo/${level}/${column}/${row}.jpg`;
    const tile = this.tiles.get(name) ?? new Image();
    if (!tile.src) {
      tile.onload = () => this.refresh();
      tile.src = name;
    }
    // Tiles are in the order of their last use; the oldest is dropped.
    this.tiles.delete(name);
    this.tiles.set(name, tile);
    if (this.tiles.size > KEPT_TILES) this.tiles.delete(this.tiles.keys().next().value);
    return tile;
  }
}
