// Asking the server. Answers are one run of bytes: a JSON header and the arrays that it names.

/** Header and arrays of a message; see pcmc/explore/packing.py. */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  let start = 4 + length;
  for (const [name, kind, count] of header.arrays) {
    arrays[name] = kind === "f"
      ? new Float32Array(buffer, start, count) : new Uint32Array(buffer, start, count);
    start += 4 * count;
  }
  return { header, arrays };
}

async function answered(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Error("The program behind this page has ended. Start it again to go on.");
  }
  if (!response.ok) {
    const told = await response.json().catch(() => ({}));
    throw new Error(told.error || `The server answered ${response.status}.`);
  }
  return response;
}

/** Ask with a JSON body; the answer unpacked. */
export async function ask(path, body = {}) {
  const response = await answered(path, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  });
  return unpack(await response.arrayBuffer());
}

/** The body of a file. */
export async function fetchFile(path) {
  return (await answered(path)).blob();
}
