// Delivery of what a server or a worker sends: decoded, or reported as undecodable.

import { decodeSound, isSound, type SoundBlock } from "../sound/sound_block";
import { decodeFrame, type Frame } from "./frame";
import { parseMessage, type ServerMessage } from "./messages";

/** Receiver of decoded messages. */
export interface MessageListener {
  message(message: ServerMessage): void;
  frame(frame: Frame): void;
  sound(block: SoundBlock): void;
  decodeFailed(what: string): void;
}

/** Delivers a text or binary message; `before` gets a text message first. */
export function deliver(data: unknown, listener: MessageListener, before: (message: ServerMessage) => void): void {
  if (data instanceof ArrayBuffer) {
    let frame: Frame;
    try {
      if (isSound(data)) {
        listener.sound(decodeSound(data));
        return;
      }
      frame = decodeFrame(data);
    } catch (error) {
      listener.decodeFailed(error instanceof Error ? error.message : String(error));
      return;
    }
    listener.frame(frame);
  } else if (typeof data === "string") {
    const message = parseMessage(data);
    if (message === null) {
      listener.decodeFailed("a message of unknown type");
      return;
    }
    before(message);
    listener.message(message);
  }
}
