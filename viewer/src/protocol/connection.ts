// The WebSocket to the server: it comes back by itself, and what cannot be read is dropped.

import { sessionAddress } from "./address";
import { readMessage, type FromServer, type ToServer } from "./messages";
import { readPicture, type Picture } from "./picture";

export type ConnectionState =
  | { name: "connecting" }
  | { name: "open" }
  /** `retryAt`: when the next attempt is made [ms, performance.now]; `refused`: the server closed it with a reason. */
  | { name: "lost"; retryAt: number; reason: string };

export interface Listener {
  message(message: FromServer): void;
  picture(picture: Picture): void;
  state(state: ConnectionState): void;
  unreadable(what: string): void;
}

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 8000;
const LIVELY_MS = 5000;
const SEND_BUFFER_BYTES = 1 << 20;

/** The wait before attempt n = 0, 1, … [ms]: doubled each time, up to a bound. */
export function waitBefore(attempt: number): number {
  return Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** Math.min(attempt, 10));
}

export class Connection {
  private socket: WebSocket | null = null;
  private attempt = 0;
  private timer = 0;
  private heardAt = 0;
  private expectsStatus = false;
  private watch = 0;

  constructor(private readonly listener: Listener) {}

  begin(): void {
    this.watch = window.setInterval(() => this.checkAlive(), 1000);
    this.connect();
  }

  send(message: ToServer): void {
    const socket = this.socket;
    if (socket?.readyState !== WebSocket.OPEN) return;
    // A server that does not read gets no more motions; they would be old anyway.
    if (message.type === "move" && socket.bufferedAmount > SEND_BUFFER_BYTES) return;
    socket.send(JSON.stringify(message));
  }

  retryNow(): void {
    if (this.socket === null) this.connect();
  }

  end(): void {
    window.clearInterval(this.watch);
    window.clearTimeout(this.timer);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }

  private connect(): void {
    window.clearTimeout(this.timer);
    this.listener.state({ name: "connecting" });
    const socket = new WebSocket(sessionAddress());
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.expectsStatus = false;
    this.heardAt = performance.now();
    socket.onopen = () => {
      if (this.socket === socket) this.listener.state({ name: "open" });
    };
    socket.onmessage = (event: MessageEvent<unknown>) => {
      if (this.socket === socket) this.hear(event.data);
    };
    socket.onclose = (event) => {
      if (this.socket === socket) this.lose(event.reason || (event.code === 1008 ? "it got too many messages" : ""));
    };
  }

  private hear(data: unknown): void {
    this.heardAt = performance.now();
    if (data instanceof ArrayBuffer) {
      let picture: Picture;
      try {
        picture = readPicture(data);
      } catch (error) {
        this.listener.unreadable(error instanceof Error ? error.message : String(error));
        return;
      }
      this.listener.picture(picture);
    } else if (typeof data === "string") {
      const message = readMessage(data);
      if (message === null) {
        this.listener.unreadable("a message of a kind that this page does not know");
        return;
      }
      if (message.type === "hello") this.attempt = 0;
      if (message.type === "status") this.expectsStatus = true;
      this.listener.message(message);
    }
  }

  private lose(reason: string): void {
    this.socket = null;
    const wait = waitBefore(this.attempt++);
    this.listener.state({ name: "lost", retryAt: performance.now() + wait, reason });
    this.timer = window.setTimeout(() => this.connect(), wait);
  }

  /** A server that says how it is twice a second, and then nothing for long, hangs: the connection is begun anew. */
  private checkAlive(): void {
    if (document.hidden) {
      this.heardAt = performance.now();
      return;
    }
    const socket = this.socket;
    const opens = socket?.readyState === WebSocket.CONNECTING;
    if (socket === null || !(this.expectsStatus || opens)) return;
    if (performance.now() - this.heardAt < (opens ? 2 * LIVELY_MS : LIVELY_MS)) return;
    this.lose("it does not answer");
    socket.close();
  }
}
