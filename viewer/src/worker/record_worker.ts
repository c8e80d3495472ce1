// Web Worker that records one mesh by finite elements; whoever started it ends it.

import { Sent, textOf } from "../../../bindings/web/palpate/memory";
import { reasonOf } from "./posting";
import { loadRecordModule, recordExports } from "./record_module";
import type { FromRecorder, ToRecorder } from "./record_messages";

function post(message: FromRecorder, transfer: Transferable[] = []): void {
  (self as unknown as { postMessage(message: FromRecorder, transfer: Transferable[]): void }).postMessage(message, transfer);
}

async function record({ base, mesh, file }: ToRecorder): Promise<void> {
  const progress = (phase: string, fraction: number | null) => post({ kind: "progress", phase, fraction });
  try {
    const [instance, content] = await Promise.all([
      loadRecordModule(base, (bytes, of) => progress("loading the recorder", of === null ? null : bytes / of)),
      file.arrayBuffer(),
    ]);
    let recording: ArrayBuffer | null = null;
    instance.receiver = (kind, bytes) => {
      if (kind === Sent.Data) recording = bytes.slice().buffer as ArrayBuffer;
      else if (kind === Sent.Text) {
        const { phase, fraction } = JSON.parse(textOf(bytes)) as { phase: string; fraction: number | null };
        progress(phase, fraction);
      }
    };
    const repairs = instance.withBytes(JSON.stringify(mesh), (about, aboutLength) =>
      instance.withBytes(new Uint8Array(content), (address, length) =>
        instance.described<string[]>(() => recordExports(instance).mesh_record(about, aboutLength, address, length)),
      ),
    );
    if (recording === null) throw new Error("the recording did not come");
    post({ kind: "recorded", recording, repairs }, [recording]);
  } catch (error) {
    post({ kind: "failed", reason: reasonOf(error) });
  }
}

self.onmessage = (event: MessageEvent<ToRecorder>) => void record(event.data);
