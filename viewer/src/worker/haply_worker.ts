// Worker of a Haply device: a scene that hangs does not leave its last force behind.

import { HaplyConnection } from "./haply_device";
import type { FromHaply, ToHaply } from "./haply_messages";
import { reasonOf } from "./posting";

const scope = self as unknown as { postMessage(message: FromHaply): void; close(): void };
let connection: HaplyConnection | null = null;

function connect(address: string): void {
  try {
    connection = new HaplyConnection(address, {
      connected: (device) => scope.postMessage({ kind: "connected", device }),
      read: (reading, number) => scope.postMessage({ kind: "reading", number, reading }),
      lost: (reason) => scope.postMessage({ kind: "lost", reason }),
    });
  } catch (error) {
    scope.postMessage({ kind: "lost", reason: reasonOf(error) });
  }
}

self.onmessage = ({ data }: MessageEvent<ToHaply>) => {
  if (data.kind === "connect") connect(data.address);
  else if (data.kind === "force") connection?.answer(data.number, data.force);
  else {
    connection?.close();
    scope.close();
  }
};
