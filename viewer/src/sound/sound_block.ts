// Blocks of sound: samples of a scene (docs/viewer-protocol.md, "Sound").

export const SOUND_MAGIC = 0x53504c50;
const HEADER_BYTES = 16;

export interface SoundBlock {
  generation: number;
  /** Samples per second [Hz]. */
  rate: number;
  samples: Float32Array;
}

/** Whether a binary message is a block of sound. */
export function isSound(data: ArrayBuffer): boolean {
  return data.byteLength >= HEADER_BYTES && new DataView(data).getUint32(0, true) === SOUND_MAGIC;
}

/** Decodes a block; throws when its length is wrong. */
export function decodeSound(data: ArrayBuffer): SoundBlock {
  const header = new DataView(data);
  const count = header.getUint32(12, true);
  if (data.byteLength !== HEADER_BYTES + 4 * count) throw new Error("a block of sound has the wrong length");
  return { generation: header.getUint32(4, true), rate: header.getUint32(8, true), samples: new Float32Array(data, HEADER_BYTES, count) };
}
