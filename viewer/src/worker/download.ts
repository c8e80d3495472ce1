// Downloads of a static site, with their progress.

import { readBody } from "../protocol/response_body";

/** Progress of a download: bytes that have come, and their number, where it is known. */
export type DownloadProgress = (bytes: number, of: number | null) => void;

/** Response of an address; an error says what was not found. */
export async function respond(url: URL): Promise<Response> {
  const response = await fetch(url).catch((error: unknown) => {
    throw new Error(`${url.pathname} did not come (${error instanceof Error ? error.message : String(error)})`);
  });
  if (!response.ok) throw new Error(`${url.pathname}: ${response.status} ${response.statusText}`);
  return response;
}

/** Content of an address. */
export async function download(url: URL, onProgress: DownloadProgress): Promise<Uint8Array<ArrayBuffer>> {
  const response = await respond(url);
  const length = Number(response.headers.get("content-length") ?? Number.NaN);
  let bytes = 0;
  try {
    const body = await readBody(response, (part) => {
      bytes += part;
      // A compressed response states the length of what is sent.
      onProgress(bytes, bytes <= length ? length : null);
    });
    return new Uint8Array(body);
  } catch (error) {
    throw new Error(`${url.pathname} broke off after ${bytes} bytes (${error instanceof Error ? error.message : String(error)})`);
  }
}
