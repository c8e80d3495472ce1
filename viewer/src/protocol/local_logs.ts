// Logs that a page without a server plays: checked, kept by the browser, and shown by the same page under the address `?logs`.

import { withUnit } from "../format";
import { keepLogs } from "../worker/kept_logs";
import type { FromWorker, ToWorker } from "../worker/messages";

/** Logs side by side. */
export const MAX_LOGS = 2;
/** Upper limit of the files' length together: the module holds them and their frames. */
const MAX_BYTES = 500e6;

/** Whether this page shows logs. */
export function showsLogs(): boolean {
  return new URL(window.location.href).searchParams.has("logs");
}

/** Address of the live scenes. */
export function scenesAddress(): string {
  return new URL(".", window.location.href).href;
}

/** Starts a worker that plays logs, those that the browser keeps if none are given. */
export function startLogWorker(files: readonly File[] | null): Worker {
  const worker = new Worker(new URL("../worker/log_worker.ts", import.meta.url), { type: "module" });
  const start: ToWorker = { kind: "start_logs", base: scenesAddress(), files };
  worker.postMessage(start);
  return worker;
}

/** Shows logs in place of what the page shows; an error says why one cannot be opened, and the page goes on. */
export async function showLogs(files: readonly File[]): Promise<void> {
  if (files.length > MAX_LOGS) throw new Error(`${files.length} logs: ${MAX_LOGS} can stand side by side`);
  const size = files.reduce((sum, file) => sum + file.size, 0);
  if (size > MAX_BYTES) throw new Error(`${withUnit(size, "B")} of logs: the page holds ${withUnit(MAX_BYTES, "B")}; palpate serve plays longer ones`);
  await check(files);
  await keepLogs(files);
  const address = new URL("?logs", scenesAddress()).href;
  if (showsLogs()) window.location.reload();
  else window.location.assign(address);
}

/** Opens logs for a trial. */
function check(files: readonly File[]): Promise<void> {
  return new Promise((done, failed) => {
    const worker = startLogWorker(files);
    const end = (error: Error | null) => {
      worker.terminate();
      if (error === null) done();
      else failed(error);
    };
    worker.onmessage = (event: MessageEvent<FromWorker>) => {
      if (event.data.kind === "failed") end(new Error(event.data.reason));
      else if (event.data.kind === "message") end(null);
    };
    worker.onerror = (event) => end(new Error(event.message || "the worker cannot be started"));
  });
}
