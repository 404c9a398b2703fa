// What the tests ask of a page, beside what a user sees. Runs before the page's own scripts.

window.probe = {
  /** Screen coordinates of a place of the photo. */
  onScreen([x, y]) {
    const point = new DOMPoint(x, y).matrixTransform(document.querySelector("#lines g").getScreenCTM());
    return [point.x, point.y];
  },

  /** The place of the photo at screen coordinates. */
  onPhoto([x, y]) {
    const place = new DOMPoint(x, y).matrixTransform(document.querySelector("#lines g").getScreenCTM().inverse());
    return [place.x, place.y];
  },

  /** Screen pixels per pixel of the photo. */
  zoom() {
    return document.querySelector("#lines g").getScreenCTM().a;
  },

  /** How bright the photo is painted at a place of it, 0 to 255. */
  shade(place) {
    const canvas = document.getElementById("photo");
    const { left, top } = canvas.getBoundingClientRect();
    const [x, y] = this.onScreen(place);
    const at = [x - left, y - top].map((distance) => Math.floor(distance * devicePixelRatio));
    this.pen ??= document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    this.pen.drawImage(canvas, ...at, 1, 1, 0, 0, 1, 1);
    return this.pen.getImageData(0, 0, 1, 1).data[1];
  },

  within(part, whole) {
    const [inner, outer] = [part, whole].map((one) => document.querySelector(one).getBoundingClientRect());
    return outer.left <= inner.left && inner.right <= outer.right && outer.top <= inner.top && inner.bottom <= outer.bottom;
  },

  /** What has the focus, and how far it reaches below the upper edge of the panel's footer. */
  focused() {
    const [part, footer] = [document.activeElement, document.querySelector(".panel footer")];
    return { id: part.id, below_footer_px: part.getBoundingClientRect().bottom - footer.getBoundingClientRect().top };
  },

  line(name) {
    const points = document.getElementById(name).getAttribute("d").slice(1).split("L");
    return points.map((point) => point.split(" ").map(Number));
  },

  number(id) {
    return parseFloat(document.getElementById(id).innerText.replace(",", ""));
  },

  /** Notes when the photo was last clicked, and when each state came first after that; in ms. */
  startClock() {
    const stage = document.getElementById("stage");
    this.clock = {};
    stage.addEventListener("pointerup", () => (this.clock = { click: performance.now() }), true);
    const note = () => (this.clock[stage.dataset.state] ??= performance.now());
    new MutationObserver(note).observe(stage, { attributes: true, attributeFilter: ["data-state"] });
  },

  /** Parts that reach past the left or right edge of the window. */
  stickingOut() {
    return [...document.querySelectorAll(".panel *, .toolbar, .toolbar *, .guide, .status, .notices *")]
      .filter((part) => part.checkVisibility() && part.getBoundingClientRect().width > 1)
      .filter((part) => {
        const { left, right } = part.getBoundingClientRect();
        return left < -0.5 || right > innerWidth + 0.5;
      })
      .map((part) => part.id || part.className || part.tagName);
  },

  /** Buttons too small to be hit. */
  smallButtons(least) {
    return [...document.querySelectorAll("button")]
      .filter((part) => part.checkVisibility())
      .filter((part) => Math.min(part.getBoundingClientRect().width, part.getBoundingClientRect().height) < least)
      .map((part) => part.id || part.innerText);
  },

  moving() {
    return [...document.querySelectorAll("*")].filter((part) => parseFloat(getComputedStyle(part).transitionDuration) > 0)
      .length;
  },
};
