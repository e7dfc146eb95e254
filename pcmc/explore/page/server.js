// Requests to the server. An answer is one run of bytes: a JSON header and the arrays that it names.

/** Header and arrays of a message; see pcmc/explore/listening.py. */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  let start = 4 + length;
  for (const [name, kind, count] of header.arrays) {
    arrays[name] = new (kind === "f" ? Float32Array : Uint32Array)(buffer, start, count);
    start += 4 * count;
  }
  return { header, arrays };
}

const token = new URLSearchParams(location.search).get("token") ?? "";

async function request(path, options = {}) {
  const headers = { "Content-Type": "application/json", "X-Token": token, ...options.headers };
  const response = await fetch(path, { ...options, headers }).catch(() => {
    throw new Error("The program behind this page has stopped. Start it again and reload the page.");
  });
  if (response.ok) return response;
  const answer = await response.json().catch(() => ({}));
  throw new Error(answer.error || `The server answered ${response.status}.`);
}

/** POST a JSON body; returns the unpacked answer. */
export async function ask(path, body = {}, headers = {}) {
  const response = await request(path, { method: "POST", body: JSON.stringify(body), headers });
  return unpack(await response.arrayBuffer());
}

const page = Math.random().toString(36).slice(2, 12);
let turns = 0;

/** As `ask`, for acts: the server does them in the order in which they were sent, on whichever connections. */
export const askInTurn = (path, body) => ask(path, body, { "X-Turn": `${page} ${turns++}` });

/** GET a file; returns its body, and a note about it. */
export async function fetchFile(path) {
  const response = await request(path);
  return [await response.blob(), decodeURIComponent(response.headers.get("X-Note"))];
}
