// Scenes of a static site: a list, and a folder for each with its scene file, recordings and paths.

import { addressBeside } from "../../../bindings/web/palpate/files";
import type { Instance } from "../../../bindings/web/palpate/memory";
import { namedFiles } from "../../../bindings/web/palpate/parts";
import type { SceneSummary } from "../protocol/messages";
import { readBody } from "../protocol/response_body";

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
  const files: SceneFiles = { summary, text, recordings: new Map(), paths: new Map() };
  for (const name of new Set(namedFiles(instance, text))) {
    const response = await respond(addressBeside(folder, name));
    if (name.endsWith(".csv")) files.paths.set(name, await response.text());
    else files.recordings.set(name, await download(response, onProgress));
  }
  return files;
}

async function download(response: Response, onProgress: DownloadProgress): Promise<Uint8Array> {
  const length = Number(response.headers.get("content-length") ?? Number.NaN);
  let bytes = 0;
  const body = await readBody(response, (part) => {
    bytes += part;
    // A compressed response states the length of what is sent.
    onProgress(bytes <= length ? bytes / length : null);
  });
  return new Uint8Array(body);
}
