// What a reader of a page sees: heights, parts that are cut off, words.
() => {
  const [all, before] = [document.documentElement, document.getElementById("appendix")];
  const outside = (inner, outer) => inner.left < outer.left - 1 || inner.right > outer.right + 1;
  const beyond = (inner, outer) => inner.top < outer.top - 1 || inner.bottom > outer.bottom + 1;
  const box = (part) => part.getBoundingClientRect();
  const cutOff = (inner, outer) => outside(inner, outer) || beyond(inner, outer);
  const hides = (part) => getComputedStyle(part).overflowX;
  // True if nobody can bring a part into view: what overflows a box that scrolls is not cut, if the box itself is not.
  const isCut = (part) => {
    for (let outer = part.parentElement; outer && outer !== document.body; outer = outer.parentElement) {
      if (["auto", "scroll"].includes(hides(outer))) {
        if (box(part).left + outer.scrollLeft < box(outer).left - 1) return true;
        part = outer;
      } else if (hides(outer) !== "visible" && outside(box(part), box(outer))) return true;
    }
    return outside(box(part), { left: 0, right: all.clientWidth });
  };
  const isClipped = (part) => ["hidden", "clip"].includes(hides(part)) && part.clientWidth > 1
    && part.scrollWidth > part.clientWidth + 1 && part.textContent.trim() !== "";
  const parts = [...document.querySelectorAll("figure svg, figure img, table, .verdict, .key")]
    .filter((part) => part.getClientRects().length > 0);
  const boxes = [...document.body.querySelectorAll(":not(svg, svg *)")];
  const words = [...document.querySelectorAll("figure svg text")];
  const text = document.body.cloneNode(true);
  text.querySelectorAll("svg, script, #appendix ~ *").forEach((part) => part.remove());
  return {
    height_px: all.scrollHeight,
    before_px: box(before).top + scrollY,
    wider_px: Math.max(all.scrollWidth, document.body.scrollWidth) - all.clientWidth,
    cut: parts.filter(isCut).length + boxes.filter(isClipped).length
      + words.filter((word) => cutOff(box(word), box(word.closest("svg")))).length,
    first_words: document.querySelector("header.first").textContent.trim().split(/\s+/).length,
    words: text.textContent.trim().split(/\s+/).length,
  };
}
