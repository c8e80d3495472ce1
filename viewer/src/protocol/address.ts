// Addresses of the server, with the token that the page was opened with.

function here(): URL {
  return new URL(window.location.href);
}

function withToken(url: URL): URL {
  const token = here().searchParams.get("token");
  if (token !== null) url.searchParams.set("token", token);
  return url;
}

/** `path` without a slash in front, so that a server under a prefix works too. */
export function address(path: string): string {
  return withToken(new URL(path, here())).href;
}

export function sessionAddress(): string {
  const url = withToken(new URL("session", here()));
  url.protocol = here().protocol === "https:" ? "wss:" : "ws:";
  url.hash = "";
  return url.href;
}

/** `?stream=vertices`: take places from the server instead of summing modes here. */
export function wantsVertices(): boolean {
  return here().searchParams.get("stream") === "vertices";
}

/** Fetches bytes, and says how far it is. Never from a cache: generations count from 1 again when a server begins anew. */
export async function fetchBytes(path: string, signal: AbortSignal, heard: (bytes: number) => void): Promise<ArrayBuffer> {
  const response = await fetch(address(path), { signal, cache: "no-store" });
  if (!response.ok) throw new Error(`${path}: ${response.status} ${response.statusText}`);
  if (response.body === null) return response.arrayBuffer();
  const parts: Uint8Array[] = [];
  let bytes = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    bytes += value.byteLength;
    heard(value.byteLength);
  }
  const whole = new Uint8Array(bytes);
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.byteLength;
  }
  return whole.buffer;
}
