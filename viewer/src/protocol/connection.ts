// WebSocket connection to the server: reconnects automatically and drops what cannot be decoded.

import { sessionUrl } from "./urls";
import { deliver, type MessageListener } from "./deliver";
import type { ClientMessage } from "./messages";

export type ConnectionState =
  | { name: "connecting" }
  | { name: "open" }
  /** `retryAt`: time of the next attempt [ms, performance.now]; `reason`: close reason of the server, may be empty. */
  | { name: "lost"; retryAt: number; reason: string };

/** Callbacks of a connection. */
export interface ConnectionListener extends MessageListener {
  state(state: ConnectionState): void;
}

const FIRST_RETRY_MS = 400;
const MAX_RETRY_MS = 8000;
const SILENCE_TIMEOUT_MS = 5000;
const WATCHDOG_INTERVAL_MS = 1000;
const SEND_BUFFER_BYTES = 1 << 20;

/** Delay before reconnection attempt n = 0, 1, … [ms]: exponential backoff with an upper bound. */
export function retryDelay(attempt: number): number {
  return Math.min(MAX_RETRY_MS, FIRST_RETRY_MS * 2 ** Math.min(attempt, 10));
}

/** Session with the server. */
export class Connection {
  private socket: WebSocket | null = null;
  private attempt = 0;
  private timer = 0;
  private receivedAt = 0;
  private checkedAt = 0;
  private expectsStatus = false;
  private watchdog = 0;

  constructor(private readonly listener: ConnectionListener) {}

  start(): void {
    this.checkedAt = performance.now();
    this.watchdog = window.setInterval(() => this.checkAlive(), WATCHDOG_INTERVAL_MS);
    this.connect();
  }

  send(message: ClientMessage): void {
    const socket = this.socket;
    if (socket?.readyState !== WebSocket.OPEN) return;
    // Backpressure: motions that cannot be sent now are outdated later.
    if (message.type === "move" && socket.bufferedAmount > SEND_BUFFER_BYTES) return;
    socket.send(JSON.stringify(message));
  }

  retryNow(): void {
    if (this.socket === null) this.connect();
  }

  close(): void {
    window.clearInterval(this.watchdog);
    window.clearTimeout(this.timer);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }

  private connect(): void {
    window.clearTimeout(this.timer);
    this.listener.state({ name: "connecting" });
    const socket = new WebSocket(sessionUrl());
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.expectsStatus = false;
    this.receivedAt = performance.now();
    socket.onopen = () => {
      if (this.socket === socket) this.listener.state({ name: "open" });
    };
    socket.onmessage = (event: MessageEvent<unknown>) => {
      if (this.socket === socket) this.receive(event.data);
    };
    socket.onclose = (event) => {
      if (this.socket === socket) this.handleLoss(event.reason || (event.code === 1008 ? "too many messages" : ""));
    };
  }

  private receive(data: unknown): void {
    this.receivedAt = performance.now();
    deliver(data, this.listener, (message) => {
      if (message.type === "hello") this.attempt = 0;
      if (message.type === "status") this.expectsStatus = true;
    });
  }

  private handleLoss(reason: string): void {
    this.socket = null;
    const wait = retryDelay(this.attempt++);
    this.listener.state({ name: "lost", retryAt: performance.now() + wait, reason });
    this.timer = window.setTimeout(() => this.connect(), wait);
  }

  /** Reconnects when a server that sends status messages falls silent. Messages that came while the page was hidden or stalled (suspended computer, slow drawing) are still queued, so silence counts from then. */
  private checkAlive(): void {
    const now = performance.now();
    const stalled = now - this.checkedAt > 2 * WATCHDOG_INTERVAL_MS;
    this.checkedAt = now;
    if (document.hidden || stalled) {
      this.receivedAt = now;
      return;
    }
    const socket = this.socket;
    const connecting = socket?.readyState === WebSocket.CONNECTING;
    if (socket === null || !(this.expectsStatus || connecting)) return;
    if (now - this.receivedAt < (connecting ? 2 * SILENCE_TIMEOUT_MS : SILENCE_TIMEOUT_MS)) return;
    this.handleLoss("the server does not respond");
    socket.close();
  }
}
