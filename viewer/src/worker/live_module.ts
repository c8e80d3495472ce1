// Module of a live scene: the runtime with the viewer's protocol.

import { Instance, type Exports } from "../../../bindings/web/palpate/memory";
import { download, type DownloadProgress } from "./download";

/** Functions of the module beside those of the runtime. */
export interface LiveExports extends Exports {
  recording_falling_scene(recording: number, name: number, nameLength: number): void;
  live_open(address: number, length: number, parts: number, about: number, aboutLength: number): number;
  live_replace(live: number, address: number, length: number, parts: number, about: number, aboutLength: number): number;
  live_greet(live: number, address: number, length: number): void;
  live_receive(live: number, address: number, length: number): void;
  live_begin_record(live: number): number;
  live_end_record(live: number): number;
  live_advance(live: number): number;
  live_attach_device(live: number, place: number): number;
  live_detach_device(live: number): void;
  live_exchange(live: number, isRead: number, x: number, y: number, z: number, buttons: number): number;
  live_data(live: number, address: number, length: number): number;
}

/** Loads the module from the folder of the page. */
export async function loadLiveModule(base: string, onProgress: DownloadProgress): Promise<Instance> {
  return Instance.load(await download(new URL("palpate.wasm", base), onProgress));
}

/** Functions of the module. */
export function liveExports(instance: Instance): LiveExports {
  return instance.exports as LiveExports;
}
