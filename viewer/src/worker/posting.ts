// Messages of a worker to its page.

import type { ServerMessage } from "../protocol/messages";
import type { FromWorker } from "./messages";

export function post(message: FromWorker, transfer: Transferable[] = []): void {
  (self as unknown as { postMessage(message: FromWorker, transfer: Transferable[]): void }).postMessage(message, transfer);
}

/** Sends a message of the viewer protocol. */
export function tell(message: ServerMessage): void {
  post({ kind: "message", text: JSON.stringify(message) });
}

/** Text of anything that was thrown. */
export function reasonOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
