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

  get canUndo() {
    return this.at > 0;
  }

  get canRedo() {
    return this.at < this.steps.length - 1;
  }

  /** False where nothing changed. Steps of one `kind` in a row are taken back together. */
  commit(next, kind = null) {
    if (JSON.stringify(next) === JSON.stringify(this.now)) return false;
    if (kind === null || kind !== this.kind) this.at += 1;
    this.steps.splice(this.at, Infinity, next);
    this.kind = kind;
    return true;
  }

  undo() {
    if (this.canUndo) this.at -= 1;
    this.kind = null;
  }

  redo() {
    if (this.canRedo) this.at += 1;
    this.kind = null;
  }
}
