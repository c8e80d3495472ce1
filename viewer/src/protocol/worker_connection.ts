// Connection to a scene that the page runs by itself, in a Web Worker: the same messages as from a server.

import type { FromWorker, HaplyPlace, ToWorker } from "../worker/messages";
import type { ConnectionListener } from "./connection";
import { deliver } from "./deliver";
import type { ClientMessage } from "./messages";
import { scenesAddress, showsLogs, startLogWorker } from "./local_logs";
import { setDataSource } from "./urls";

/** Whether this page runs its scene by itself: a static site says so. */
export function runsInWorker(): boolean {
  return document.documentElement.dataset.transport === "worker";
}

/** Callbacks of a session with a worker. */
export interface WorkerListener extends ConnectionListener {
  /** Progress of a first download: bytes that have come, of how many where it is known. */
  loading(what: string, bytes: number, of: number | null): void;
}

/** Session with a worker. */
export class WorkerConnection {
  private worker: Worker | null = null;
  private requests = new Map<number, (bytes: ArrayBuffer | null) => void>();
  private lastRequest = 0;
  /** Log that is awaited. */
  private log: { done: (log: { bytes: ArrayBuffer; steps: number }) => void; failed: (error: Error) => void } | null = null;

  /** Listener of the Haply device's state. */
  onHaply: (state: "connected" | "lost", text: string) => void = () => undefined;

  constructor(private readonly listener: WorkerListener) {
    setDataSource((path) => this.fetch(path));
  }

  start(): void {
    this.listener.state({ name: "connecting" });
    const logs = showsLogs();
    const worker = logs ? startLogWorker(null) : new Worker(new URL("../worker/scene_worker.ts", import.meta.url), { type: "module" });
    this.worker = worker;
    worker.onmessage = (event: MessageEvent<FromWorker>) => this.receive(event.data);
    worker.onerror = (event) => this.handleLoss(event.message || "the worker cannot be started");
    if (logs) return;
    const scene = new URL(window.location.href).searchParams.get("scene");
    this.post({ kind: "start", base: scenesAddress(), scene });
  }

  beginLog(): void {
    this.post({ kind: "begin_log" });
  }

  endLog(): Promise<{ bytes: ArrayBuffer; steps: number }> {
    return new Promise((done, failed) => {
      this.log = { done, failed };
      this.post({ kind: "end_log" });
    });
  }

  /** Opens a recording as a scene of its own, with what is said about it. */
  openRecording(name: string, bytes: ArrayBuffer, about: string): void {
    this.post({ kind: "recording", name, bytes, about });
  }

  /** Connects a Haply device by the address of its service, or none. */
  setHaply(address: string | null): void {
    this.post({ kind: "haply", address });
  }

  /** Tells where the device is in the scene that is shown. */
  placeHaply(place: HaplyPlace): void {
    this.post({ kind: "haply_place", place });
  }

  send(message: ClientMessage): void {
    this.post({ kind: "message", text: JSON.stringify(message) });
  }

  /** Starts a scene that has ended again. */
  retryNow(): void {
    if (this.worker === null) this.start();
  }

  /** Ends the worker; requests that wait are dropped, as the page is told why. */
  close(): void {
    this.worker?.terminate();
    this.worker = null;
    this.requests.clear();
  }

  private post(message: ToWorker): void {
    this.worker?.postMessage(message);
  }

  private receive(message: FromWorker): void {
    switch (message.kind) {
      case "message":
        this.deliver(message.text);
        break;
      case "frame":
        this.post({ kind: "shown" });
        this.deliver(message.frame);
        break;
      case "sound":
        this.deliver(message.block);
        break;
      case "loading":
        this.listener.loading(message.what, message.bytes, message.of);
        break;
      case "log":
        this.log?.done({ bytes: message.bytes, steps: message.steps });
        this.log = null;
        break;
      case "haply":
        this.onHaply(message.state, message.text);
        break;
      case "no_log":
        this.log?.failed(new Error(message.reason));
        this.log = null;
        break;
      case "data":
        this.requests.get(message.request)?.(message.bytes);
        this.requests.delete(message.request);
        break;
      case "failed":
        this.handleLoss(message.reason);
    }
  }

  private deliver(data: string | ArrayBuffer): void {
    deliver(data, this.listener, (message) => {
      if (message.type === "hello") this.listener.state({ name: "open" });
    });
  }

  private handleLoss(reason: string): void {
    this.close();
    this.log?.failed(new Error(reason));
    this.log = null;
    this.listener.state({ name: "lost", retryAt: Number.POSITIVE_INFINITY, reason });
  }

  private fetch(path: string): Promise<ArrayBuffer> {
    if (this.worker === null) return Promise.reject(new Error("the simulation has ended"));
    const request = ++this.lastRequest;
    return new Promise((done, failed) => {
      this.requests.set(request, (bytes) => (bytes === null ? failed(new Error(`${path}: not found`)) : done(bytes)));
      this.post({ kind: "data", request, path });
    });
  }
}
