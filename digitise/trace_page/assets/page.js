// Find elements of the page by id, and make new ones.

export const part = (id) => document.getElementById(id);

/** A new element; a function among its attributes listens to the event of that name. */
export function made(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}
