// Module of logs: the runtime with what reads and writes logs, loaded when a page needs it.

import { Instance, type Exports } from "../../../bindings/web/palpate/memory";
import { download, type DownloadProgress } from "./download";

/** Functions of the module of logs beside those of the runtime. */
export interface LogExports extends Exports {
  logs_new(): number;
  logs_free(logs: number): void;
  logs_add(logs: number, name: number, nameLength: number, address: number, length: number): number;
  logs_greet(logs: number): void;
  logs_advance(logs: number): number;
  logs_data(logs: number, address: number, length: number): number;
  log_maker_new(address: number, length: number, parts: number, inputs: number, inputsLength: number, startS: number): number;
  log_maker_advance(maker: number): number;
  log_maker_steps(maker: number): number;
  log_maker_finish(maker: number): number;
}

/** Loads the module from the folder of the page. */
export async function loadLogModule(base: string, onProgress: DownloadProgress): Promise<Instance> {
  return Instance.load(await download(new URL("palpate-logs.wasm", base), onProgress));
}

/** Functions of the module. */
export function logExports(instance: Instance): LogExports {
  return instance.exports as LogExports;
}
