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
  const headers = { "Content-Type": "application/json", "X-Token": token };
  const response = await fetch(path, { ...options, headers }).catch(() => {
    throw new Error("The program behind this page has stopped. Start it again and reload the page.");
  });
  if (response.ok) return response;
  const answer = await response.json().catch(() => ({}));
  throw new Error(answer.error || `The server answered ${response.status}.`);
}

/** POST a JSON body; returns the unpacked answer. */
export async function ask(path, body = {}) {
  const response = await request(path, { method: "POST", body: JSON.stringify(body) });
  return unpack(await response.arrayBuffer());
}

/** GET a file; returns its body. */
export const fetchFile = async (path) => (await request(path)).blob();
