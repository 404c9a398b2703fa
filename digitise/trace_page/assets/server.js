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
