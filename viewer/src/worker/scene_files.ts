// Scenes of a static site: a list, and a folder for each with its scene file, recordings and paths.

import type { Instance } from "../../../bindings/web/palpate/memory";
import type { SceneSummary } from "../protocol/messages";

/** Files of a scene. */
export interface SceneFiles {
  summary: SceneSummary;
  text: string;
  recordings: Map<string, Uint8Array>;
  paths: Map<string, string>;
}

/** Progress of a download: share of the bytes, where their number is known. */
export type DownloadProgress = (fraction: number | null) => void;

async function respond(url: URL): Promise<Response> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url.pathname}: ${response.status} ${response.statusText}`);
  return response;
}

/** Scenes of a site, in the order of its list. */
export async function fetchScenes(base: string): Promise<SceneSummary[]> {
  return (await respond(new URL("scenes/index.json", base)).then((response) => response.json())) as SceneSummary[];
}

/** Fetches the files of a scene. */
export async function fetchScene(instance: Instance, base: string, summary: SceneSummary, onProgress: DownloadProgress): Promise<SceneFiles> {
  const folder = new URL(`scenes/${encodeURIComponent(summary.id)}/`, base);
  const text = await respond(new URL("scene.toml", folder)).then((response) => response.text());
  const names = instance.withBytes(text, (address, length) => instance.described<string[]>((exports) => exports.scene_files(address, length)));
  const files: SceneFiles = { summary, text, recordings: new Map(), paths: new Map() };
  for (const name of new Set(names)) {
    const response = await respond(new URL(name, folder));
    if (name.endsWith(".csv")) files.paths.set(name, await response.text());
    else files.recordings.set(name, await download(response, onProgress));
  }
  return files;
}

async function download(response: Response, onProgress: DownloadProgress): Promise<Uint8Array> {
  const length = Number(response.headers.get("content-length") ?? Number.NaN);
  if (response.body === null) return new Uint8Array(await response.arrayBuffer());
  const parts: Uint8Array[] = [];
  let bytes = 0;
  const reader = response.body.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    bytes += value.byteLength;
    // A compressed response states the length of what is sent.
    onProgress(bytes <= length ? bytes / length : null);
  }
  const whole = new Uint8Array(bytes);
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.byteLength;
  }
  return whole;
}
