// Web Worker that plays logs: they are computed again in WebAssembly, and the page fetches frames as from a server.

import { Sent, textOf, type Instance } from "../../../bindings/web/palpate/memory";
import { keptLogs } from "./kept_logs";
import { loadLogModule, logExports } from "./log_module";
import type { ToWorker } from "./messages";
import { post, reasonOf, tell } from "./posting";

/** Logs in the module. */
class LogRunner {
  private readonly logs: number;
  private readonly channel = new MessageChannel();

  constructor(private readonly instance: Instance) {
    this.logs = instance.call(() => logExports(instance).logs_new());
    instance.receiver = (kind, bytes) => {
      if (kind === Sent.Text) post({ kind: "message", text: textOf(bytes) });
    };
    this.channel.port1.onmessage = () => this.advance();
  }

  /** Adds a log; returns its warning, or null. */
  add(name: string, content: Uint8Array): string | null {
    const { instance } = this;
    return instance.withBytes(name, (at, length) =>
      instance.withBytes(content, (address, bytes) => instance.described<string | null>(() => logExports(instance).logs_add(this.logs, at, length, address, bytes))),
    );
  }

  /** Greets the page, and computes the logs between its requests. */
  start(): void {
    logExports(this.instance).logs_greet(this.logs);
    this.channel.port2.postMessage(null);
  }

  answer(request: number, path: string): void {
    const { instance } = this;
    let bytes: ArrayBuffer | null = null;
    const before = instance.receiver;
    try {
      instance.receiver = (_, data) => (bytes = data.slice().buffer);
      instance.withBytes(path, (address, length) => instance.call(() => logExports(instance).logs_data(this.logs, address, length)));
    } finally {
      instance.receiver = before;
    }
    post({ kind: "data", request, bytes }, bytes === null ? [] : [bytes]);
  }

  private advance(): void {
    try {
      const isMore = this.instance.guard(() => logExports(this.instance).logs_advance(this.logs));
      if (isMore !== 0) this.channel.port2.postMessage(null);
    } catch (error) {
      post({ kind: "failed", reason: reasonOf(error) });
    }
  }
}

let runner: LogRunner | null = null;

async function start(base: string, given: readonly File[] | null): Promise<void> {
  try {
    const [instance, files] = await Promise.all([
      loadLogModule(base, (bytes, of) => post({ kind: "loading", what: "the reader of logs", bytes, of })),
      given ?? keptLogs(),
    ]);
    if (files.length === 0) throw new Error("no log is kept here any more: drop it again");
    const made = new LogRunner(instance);
    const warnings: (string | null)[] = [];
    // One after the other: each needs its memory twice.
    for (const file of files) {
      try {
        warnings.push(made.add(file.name, new Uint8Array(await file.arrayBuffer())));
      } catch (error) {
        // An error of its scene names the scene only.
        const reason = reasonOf(error);
        throw new Error(reason.startsWith(file.name) ? reason : `${file.name}: ${reason}`);
      }
    }
    runner = made;
    runner.start();
    for (const text of warnings) if (text !== null) tell({ type: "info", text });
  } catch (error) {
    post({ kind: "failed", reason: reasonOf(error) });
  }
}

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if (message.kind === "start_logs") void start(message.base, message.files);
  else if (message.kind === "data") runner?.answer(message.request, message.path);
};
