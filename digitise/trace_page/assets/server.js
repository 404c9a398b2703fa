// Questions to the server, relative to the page's own address, which holds the token.

/** The page's first facts: photo, hints, where it saves. */
export async function opening() {
  const answer = await fetch("session");
  if (!answer.ok) throw new Error(`session: ${answer.status}`);
  return answer.json();
}

/** Post `content`; every line of the answer is handed to `heard` as it arrives. */
export async function post(name, content, heard, signal) {
  const answer = await fetch(name, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(content),
    signal,
  });
  if (!answer.ok) {
    const { error } = await answer.json().catch(() => ({ error: "" }));
    throw new Error(`${name}: ${answer.status} ${error}`);
  }
  const reader = answer.body.getReader();
  const decoder = new TextDecoder();
  let rest = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const lines = (rest + decoder.decode(value, { stream: true })).split("\n");
    rest = lines.pop();
    for (const line of lines) heard(JSON.parse(line));
  }
}

/** Asks where the crack is, as often as points move and no oftener than the server answers. */
export class Tracing {
  /** `show` gets every answer with the hints that were asked about; `lost` is told when the server has gone. */
  constructor(show, lost) {
    this.show = show;
    this.lost = lost;
    this.revision = 0;
    this.asking = null;
    this.waiting = null;
  }

  /** A point is under way: as far as `until`, and the last place asked for is the one that counts. */
  sketch(hints, meaning, until) {
    if (this.asking?.sketch) this.waiting = { hints, meaning, until };
    else this.ask({ hints, meaning, until, sketch: true });
  }

  /** At once, as far as `until`: "scale", "path", "glance" or "walls". */
  trace(hints, meaning, until) {
    this.ask({ hints, meaning, until });
  }

  /** Whatever is under way no longer matters. */
  forget() {
    this.waiting = null;
    this.asking?.stop.abort();
    this.asking = null;
  }

  async ask({ hints, meaning, until, sketch = false }) {
    this.forget();
    const asked = { sketch, stop: new AbortController() };
    this.asking = asked;
    // Grows across reloads and tabs, since the server answers the newest only.
    this.revision = Math.max(this.revision + 0.001, performance.timeOrigin + performance.now());
    const question = { hints, revision: this.revision, until };
    const heard = (answer) => this.asking === asked && this.show(answer, meaning);
    try {
      await post("trace", question, heard, asked.stop.signal);
    } catch (fault) {
      if (fault.name !== "AbortError") this.lost(fault);
      return;
    }
    if (this.asking !== asked) return;
    this.asking = null;
    this.show({ done: true }, meaning);
    if (this.waiting) this.ask({ ...this.waiting, sketch: true });
  }
}
