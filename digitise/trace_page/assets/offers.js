// Lines that may be the crack, outlined and numbered: one click on a number takes that one.

export class Offers {
  /** `take(crack)` when one is chosen. */
  constructor(group, lines, take) {
    Object.assign(this, { group, lines, take });
    this.cracks = [];
  }

  /** Those that a search has found, best first; of one alone there is no choice. */
  found(cracks) {
    this.cracks = cracks.length > 1 ? cracks : [];
    this.group.replaceChildren(...this.cracks.map((crack, index) => this.button(crack, index + 1)));
  }

  show(viewport, wanted) {
    this.group.hidden = !wanted || !this.cracks.length;
    this.lines.setAll("offer", this.group.hidden ? [] : this.cracks.map((crack) => crack.outline_px), true);
    this.cracks.forEach((crack, index) => {
      const [x, y] = viewport.toScreen(crack.middle_px);
      this.group.children[index].style.transform = `translate(${x}px, ${y}px)`;
    });
  }

  /** Take the one with the number of a key; false where none has it. */
  press(key) {
    const crack = this.group.hidden ? null : this.cracks[Number(key) - 1];
    if (crack) this.take(crack);
    return Boolean(crack);
  }

  button(crack, number) {
    const button = document.createElement("button");
    const [[left, top], [right, bottom]] = crack.ends_px.map((end) => end.map(Math.round));
    button.className = "offered";
    button.title = `Take crack ${number} (${number})`;
    button.setAttribute("aria-label", `Take crack ${number}, from x ${left}, y ${top} to x ${right}, y ${bottom}`);
    button.setAttribute("aria-keyshortcuts", String(number));
    button.append(document.createElement("span"));
    button.firstElementChild.textContent = number;
    // A click on the photo would place a point.
    button.addEventListener("pointerdown", (event) => event.stopPropagation());
    button.addEventListener("click", () => this.take(crack));
    return button;
  }
}
