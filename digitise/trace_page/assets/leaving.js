// How the page ends: saved, left, or lost.

import { part } from "./page.js";
import { post } from "./server.js";

export class Leaving {
  /** `ready()`: wait until `missing()` can answer: a sentence on what a save needs, or null; `content()`: what is saved;
   * `changed()`: true if it differs; `lost(fault)`: the server did not answer; `over()`: the page has ended.
   */
  constructor({ ready, missing, content, changed, lost, over }) {
    Object.assign(this, { ready, missing, content, changed, lost, over });
    this.ended = false;
    this.sure = false; // The first press on Quit asks for confirmation, the second leaves.
    part("save").addEventListener("click", () => this.save());
    part("quit").addEventListener("click", () => this.quit());
    part("quit").addEventListener("blur", () => this.unsure());
    part("farewell").addEventListener("cancel", (event) => event.preventDefault());
    window.addEventListener("beforeunload", (event) => {
      if (!this.ended && changed()) event.preventDefault();
    });
  }

  async save() {
    // A field fires its change event only on blur, and Ctrl-S does not blur it.
    if (document.activeElement.matches("input")) document.activeElement.blur();
    await this.ready();
    if (this.ended) return;
    const missing = this.missing();
    part("save-refused").textContent = missing ?? "";
    if (missing) return;
    const show = ({ refused, saved, photos }) => {
      if (refused) part("save-refused").textContent = refused;
      if (saved) this.farewell("Saved", saved.summary, saved.next, photos);
    };
    await post("save", this.content(), show).catch(this.lost);
  }

  async quit() {
    if (this.changed() && !this.sure) {
      this.sure = true;
      part("quit").textContent = "Quit without saving?";
      return;
    }
    const end = () => this.farewell("Nothing was saved", "The trial and the photo are as they were.");
    await post("quit", {}, end).catch(this.lost);
  }

  finished() {
    part("farewell-photos").hidden = true;
    part("farewell-close").hidden = false;
  }

  unsure() {
    this.sure = false;
    part("quit").textContent = "Quit";
  }

  /** Show another photo of the folder; if something is not saved, the first press asks for confirmation. */
  async turn(photo, button) {
    if (!this.ended && this.changed() && button.dataset.sure !== "yes") {
      button.dataset.sure = "yes";
      part("save-refused").textContent = "Save first, or press again to leave this photo as it was.";
      return;
    }
    const show = ({ refused, turned }) => {
      if (refused) part(this.ended ? "farewell-refused" : "save-refused").textContent = refused;
      if (!turned) return;
      this.ended = true;
      this.over();
      window.location.reload();
    };
    await post("turn", { photo }, show).catch(this.lost);
  }

  /** `photos`: those of the folder, to continue with the next. */
  farewell(title, text, next = "", photos = []) {
    this.ended = true;
    this.over();
    part("farewell-title").textContent = title;
    part("farewell-text").textContent = text;
    part("farewell-next").textContent = next;
    part("farewell-next").hidden = !next;
    const waiting = photos.findIndex((photo) => !photo.done);
    part("farewell-close").hidden = photos.length > 0;
    part("farewell-photos").hidden = !photos.length;
    part("next-photo").hidden = waiting < 0;
    if (waiting >= 0) {
      part("next-photo").textContent = `Next photo: ${photos[waiting].name}`;
      part("next-photo").onclick = () => this.turn(waiting, part("next-photo"));
    }
    part("photos-left").textContent = `${photos.filter((photo) => photo.done).length} of ${photos.length} photos are traced.`;
    part("finish").onclick = () => post("quit", {}, () => this.finished()).catch(this.lost);
    part("farewell").showModal();
  }
}
