// Requests to the server, relative to the page's own address, which contains the token.

/** The page's initial facts: photo, hints, and the file that it saves to. */
export async function opening() {
  const answer = await fetch("session");
  if (!answer.ok) throw new Error(`session: ${answer.status}`);
  return answer.json();
}

/** Post `content`; every line of the answer is passed to `each` as it arrives. */
export async function post(name, content, each, signal) {
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
    for (const line of lines) each(JSON.parse(line));
  }
}

/** Requests the crack whenever points move, but one request at a time. */
export class Tracing {
  /** `show` gets every answer with the meaning of its request; `lost` is called if a request fails. */
  constructor(show, lost) {
    this.show = show;
    this.lost = lost;
    this.revision = 0;
    this.asking = null;
    this.waiting = null;
  }

  /** A point is being moved: request as far as `until`; of waiting requests only the last counts. */
  sketch(hints, meaning, until) {
    if (this.asking?.sketch) this.waiting = { hints, meaning, until };
    else this.ask({ hints, meaning, until, sketch: true });
  }

  /** Request at once, as far as `until`: "scale", "path" or "walls". */
  trace(hints, meaning, until) {
    this.ask({ hints, meaning, until });
  }

  /** Wait until the newest request has answered its scale, which comes first, or has failed. */
  async scaled() {
    for (let first; first !== this.asking?.first; ) {
      first = this.asking?.first;
      await first;
    }
  }

  /** Drop the request in progress and the waiting one. */
  forget() {
    this.waiting = null;
    this.asking?.stop.abort();
    this.asking = null;
  }

  async ask({ hints, meaning, until, sketch = false }) {
    this.forget();
    let begun;
    const first = new Promise((resolve) => (begun = resolve));
    const request = { sketch, stop: new AbortController(), first };
    this.asking = request;
    // Increases across reloads and tabs, since the server answers the newest request only.
    this.revision = Math.max(this.revision + 0.001, performance.timeOrigin + performance.now());
    const question = { hints, revision: this.revision, until };
    const each = (answer) => {
      if (this.asking === request) this.show(answer, meaning);
      begun();
    };
    try {
      await post("trace", question, each, request.stop.signal);
    } catch (fault) {
      if (fault.name !== "AbortError") this.lost(fault);
      return;
    } finally {
      begun();
    }
    if (this.asking !== request) return;
    this.asking = null;
    this.show({ done: true }, meaning);
    if (this.waiting) this.ask({ ...this.waiting, sketch: true });
  }
}
