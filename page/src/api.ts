/** Every answer of the server, by its path below `/api`; a static export holds the same answers in the page itself. */

/** Return the address of a path; the cookie that the server gave the page goes with every request. */
export function address(path: string, scheme = ""): string {
  const url = new URL(`api/${path}`, location.href.split(/[?#]/)[0]);
  if (scheme) url.protocol = location.protocol === "https:" ? `${scheme}s:` : `${scheme}:`;
  return url.href;
}

/** Return the answer of a path, or throw an error that says why there is none. */
export async function get<T>(path: string): Promise<T> {
  const answers = await exported();
  if (answers) {
    if (!(path in answers)) throw new Error(`This export does not hold ${path}.`);
    return answers[path] as T;
  }
  const response = await fetch(address(path), { credentials: "same-origin" });
  if (!response.ok) throw new Error(await reason(response));
  return (await response.json()) as T;
}

/** Return an address that an image element can show. */
export async function picture(run: string, sha256: string): Promise<string> {
  const path = `runs/${run}/images/${sha256}`;
  return (await exported()) ? await get<string>(path) : address(path);
}

/** Whether this page is a static export, without a server. */
export const isExport = () => document.getElementById("khala-data") !== null;

let opened: Promise<Record<string, unknown> | null> | undefined;

function exported(): Promise<Record<string, unknown> | null> {
  return (opened ??= unpack(document.getElementById("khala-data")?.textContent ?? ""));
}

async function unpack(text: string): Promise<Record<string, unknown> | null> {
  if (!text) return null;
  const bytes = await inflate(text.trim(), "gzip");
  return JSON.parse(new TextDecoder().decode(bytes)) as Record<string, unknown>;
}

/** Return the bytes of compressed data in base64. */
export async function inflate(base64: string, format: "gzip" | "deflate"): Promise<Uint8Array> {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream(format));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function reason(response: Response): Promise<string> {
  const text = await response.text();
  try {
    return String((JSON.parse(text) as { error?: unknown }).error ?? text);
  } catch {
    return text || `The server answered ${response.status}.`;
  }
}
