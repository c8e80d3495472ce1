// Module that records meshes: the finite elements, loaded when a page needs them.

import { Instance, type Exports } from "../../../bindings/web/palpate/memory";
import { download, type DownloadProgress } from "./download";

/** Function of the module beside those of the runtime. */
export interface RecordExports extends Exports {
  mesh_record(about: number, aboutLength: number, address: number, length: number): number;
}

/** Loads the module from the folder of the page. */
export async function loadRecordModule(base: string, onProgress: DownloadProgress): Promise<Instance> {
  return Instance.load(await download(new URL("palpate-record.wasm", base), onProgress));
}

/** Functions of the module. */
export function recordExports(instance: Instance): RecordExports {
  return instance.exports as RecordExports;
}
