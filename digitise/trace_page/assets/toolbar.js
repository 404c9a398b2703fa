// One stop of the Tab key for a row of buttons; arrow keys move along it.

export function rove(toolbar) {
  const usable = () => [...toolbar.querySelectorAll("button")].filter((button) => !button.disabled);
  const stopAt = (stop) => {
    for (const button of toolbar.querySelectorAll("button")) button.tabIndex = button === stop ? 0 : -1;
  };
  toolbar.addEventListener("keydown", (event) => {
    const buttons = usable();
    const place = buttons.indexOf(document.activeElement);
    const to = { ArrowRight: place + 1, ArrowLeft: place - 1, Home: 0, End: buttons.length - 1 }[event.key];
    if (to === undefined) return;
    const next = buttons.at(to % buttons.length);
    stopAt(next);
    next.focus();
    event.preventDefault();
  });
  toolbar.addEventListener("focusin", (event) => stopAt(event.target));
  for (const button of toolbar.querySelectorAll("button")) button.tabIndex = -1;
  /** Call after buttons were enabled or disabled: the stop must be an enabled one. */
  return () => {
    const buttons = usable();
    if (!buttons.some((button) => button.tabIndex === 0)) stopAt(buttons[0]);
  };
}
