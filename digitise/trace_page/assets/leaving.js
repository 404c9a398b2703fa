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
    const show = ({ refused, saved }) => {
      if (refused) part("save-refused").textContent = refused;
      if (saved) this.farewell("Saved", saved.summary, saved.next);
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
