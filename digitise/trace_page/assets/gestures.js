// Fingers, mouse and wheel on the photo: click, pan, pinch, or draw.

const STILL = 4; // Screen pixels that a click may move; a finger may move twice as far.

/** `drawing()`: true if a drag draws; `click(at)`, `hover(at)`, `draw(trail)`, `drawn()`, with screen points. */
export function watch(stage, viewport, { drawing, click, hover, draw, drawn }) {
  const down = new Map();
  let began = null; // Place at which a single pointer went down, and its gesture: "still", "pan" or "draw".
  let spread = null; // Distance and middle of two fingers.

  const at = (event) => {
    const { left, top } = stage.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };

  const pinched = () => {
    const [[x, y], [right, below]] = [...down.values()];
    return { distance: Math.hypot(right - x, below - y), middle: [(x + right) / 2, (y + below) / 2] };
  };

  stage.addEventListener("pointerdown", (event) => {
    if (event.button > 1) return;
    event.preventDefault();
    stage.focus({ preventScroll: true });
    stage.setPointerCapture(event.pointerId);
    down.set(event.pointerId, at(event));
    if (down.size === 1) began = { place: at(event), last: at(event), trail: [at(event)], what: "still", pans: event.button === 1 || !drawing() };
    if (down.size === 2) {
      if (began?.what === "draw") drawn();
      began = null;
      spread = pinched();
    }
  });

  stage.addEventListener("pointermove", (event) => {
    const here = at(event);
    if (!down.has(event.pointerId)) {
      if (event.target === stage) hover(here);
      return;
    }
    down.set(event.pointerId, here);
    if (down.size === 2 && spread) {
      const now = pinched();
      viewport.panBy([now.middle[0] - spread.middle[0], now.middle[1] - spread.middle[1]]);
      viewport.zoomBy(now.distance / Math.max(spread.distance, 1), now.middle);
      spread = now;
      return;
    }
    if (!began) return;
    const slip = event.pointerType === "touch" ? 2 * STILL : STILL;
    if (began.what === "still" && Math.hypot(here[0] - began.place[0], here[1] - began.place[1]) > slip) {
      began.what = began.pans ? "pan" : "draw";
    }
    if (began.what === "pan") viewport.panBy([here[0] - began.last[0], here[1] - began.last[1]]);
    if (began.what === "draw") {
      began.trail.push(here);
      draw(began.trail);
    }
    began.last = here;
  });

  const up = (event) => {
    if (!down.delete(event.pointerId)) return;
    spread = null;
    if (down.size) return;
    if (began?.what === "draw") drawn();
    if (began?.what === "still" && event.type === "pointerup" && event.button === 0) click(at(event));
    began = null;
  };
  stage.addEventListener("pointerup", up);
  stage.addEventListener("pointercancel", up);

  stage.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      // A wheel's notch is about 100; a trackpad sends many small steps.
      const steps = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY * 33 : event.deltaY;
      viewport.zoomBy(Math.exp(-Math.max(-300, Math.min(300, steps)) / 500), at(event));
    },
    { passive: false },
  );
}
