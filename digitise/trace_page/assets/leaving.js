// How the page ends: saved, left, or lost.

import { post } from "./server.js";

const part = (id) => document.getElementById(id);

export class Leaving {
  /** `missing()`: what must be given before a save, or null; `content()`: what is saved; `changed()`: is there any;
   * `lost(fault)`: the server did not answer; `over()`: the page has ended.
   */
  constructor({ missing, content, changed, lost, over }) {
    Object.assign(this, { missing, content, changed, lost, over });
    this.ended = false;
    this.sure = false; // The first press on Quit asks, the second leaves.
    part("save").addEventListener("click", () => this.save());
    part("quit").addEventListener("click", () => this.quit());
    part("quit").addEventListener("blur", () => this.unsure());
    part("farewell").addEventListener("cancel", (event) => event.preventDefault());
    window.addEventListener("beforeunload", (event) => {
      if (!this.ended && changed()) event.preventDefault();
    });
  }

  async save() {
    if (this.ended) return;
    const missing = this.missing();
    part("save-refused").textContent = missing ?? "";
    if (missing) return;
    const heard = ({ refused, saved }) => {
      if (refused) part("save-refused").textContent = refused;
      if (saved) this.farewell("Saved", saved.summary, saved.next);
    };
    await post("save", this.content(), heard).catch(this.lost);
  }

  async quit() {
    if (this.changed() && !this.sure) {
      this.sure = true;
      part("quit").textContent = "Quit without saving?";
      return;
    }
    const left = () => this.farewell("Nothing was saved", "The trial and the photo are as they were.");
    await post("quit", {}, left).catch(this.lost);
  }

  unsure() {
    this.sure = false;
    part("quit").textContent = "Quit";
  }

  farewell(title, text, next = "") {
    this.ended = true;
    this.over();
    part("farewell-title").textContent = title;
    part("farewell-text").textContent = text;
    part("farewell-next").textContent = next;
    part("farewell-next").hidden = !next;
    part("farewell").showModal();
  }
}
