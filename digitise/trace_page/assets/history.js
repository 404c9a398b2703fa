// Steps of the draft, any of which can be undone.

export class History {
  constructor(first) {
    this.steps = [first];
    this.at = 0;
    this.kind = null;
  }

  get now() {
    return this.steps[this.at];
  }

  /** True if a step can be undone, with `by` -1, or redone, with 1. */
  can(by) {
    return this.at + by in this.steps;
  }

  /** False if nothing changed. Consecutive steps of one `kind` are undone together. */
  commit(next, kind = null) {
    if (JSON.stringify(next) === JSON.stringify(this.now)) return false;
    if (kind === null || kind !== this.kind) this.at += 1;
    this.steps.splice(this.at, Infinity, next);
    this.kind = kind;
    return true;
  }

  go(by) {
    if (this.can(by)) this.at += by;
    this.kind = null;
  }
}
