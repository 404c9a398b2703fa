// What was said, step by step, so that any step can be taken back.

export class History {
  constructor(first) {
    this.steps = [first];
    this.at = 0;
    this.kind = null;
  }

  get now() {
    return this.steps[this.at];
  }

  /** True if there is a step to take back, `by` -1, or to take again, 1. */
  can(by) {
    return this.at + by in this.steps;
  }

  /** False where nothing changed. Steps of one `kind` in a row are taken back together. */
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
