// Server URLs with the token that the page was opened with.

import { readBody } from "./response_body";
import { token } from "./token";

function here(): URL {
  return new URL(window.location.href);
}

function withToken(url: URL): URL {
  const known = token();
  if (known !== null) url.searchParams.set("token", known);
  return url;
}

/** URL of a path without leading slash, so that a server under a prefix works too. */
export function serverUrl(path: string): string {
  return withToken(new URL(path, here())).href;
}

export function sessionUrl(): string {
  const url = withToken(new URL("session", here()));
  url.protocol = here().protocol === "https:" ? "wss:" : "ws:";
  url.hash = "";
  return url.href;
}

/** Whether `?stream=vertices` asks for nodal positions from the server instead of modal reconstruction here. */
export function prefersVertexStream(): boolean {
  return here().searchParams.get("stream") === "vertices";
}

/** Source of a scene's data in place of the server. */
export type DataSource = (path: string) => Promise<ArrayBuffer>;

let dataSource: DataSource | null = null;

/** Takes the data of scenes from a source in place of the server. */
export function setDataSource(source: DataSource): void {
  dataSource = source;
}

/** Response body with progress reports. Never cached: a restarted server counts generations from 1 again. */
export async function fetchBytes(path: string, signal: AbortSignal, onProgress: (bytes: number) => void): Promise<ArrayBuffer> {
  if (dataSource !== null) {
    const data = await dataSource(path);
    onProgress(data.byteLength);
    return data;
  }
  const response = await fetch(serverUrl(path), { signal, cache: "no-store" });
  if (!response.ok) throw new Error(`${path}: ${response.status} ${response.statusText}`);
  return readBody(response, onProgress);
}
