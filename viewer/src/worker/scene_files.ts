// Scenes of a static site: a list, and a folder for each with its scene file, recordings and paths.

import { addressBeside } from "../../../bindings/web/palpate/files";
import type { Instance } from "../../../bindings/web/palpate/memory";
import { namedFiles } from "../../../bindings/web/palpate/parts";
import type { SceneSummary } from "../protocol/messages";
import { download, respond, type DownloadProgress } from "./download";

/** Files of a scene. */
export interface SceneFiles {
  summary: SceneSummary;
  text: string;
  recordings: Map<string, Uint8Array>;
  paths: Map<string, string>;
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
    const address = addressBeside(folder, name);
    if (name.endsWith(".csv")) files.paths.set(name, await respond(address).then((response) => response.text()));
    else files.recordings.set(name, await download(address, onProgress));
  }
  return files;
}
