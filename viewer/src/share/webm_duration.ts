// Duration of a WebM file that was recorded as a stream: recorders leave it out, and players then show no length.
//
// Matroska (RFC 9559): EBML header, then a segment of unknown size, whose Info gets the element Duration [ticks of TimestampScale].

const EBML = 0x1a45dfa3;
const SEGMENT = 0x18538067;
const INFO = 0x1549a966;
const TIMESTAMP_SCALE = 0x2ad7b1;
const DURATION = 0x4489;
/** Void elements may stand anywhere. */
const VOID = 0xec;

/** Ticks of a file that names none [ns]. */
const DEFAULT_SCALE_NS = 1e6;

/** Bytes at the front of a file that hold its Info. */
const FRONT_BYTES = 4096;

interface EbmlElement {
  id: number;
  /** Offset of the content, and its length; null if unknown. */
  content: number;
  length: number | null;
}

/** Variable-length number at an offset: its bytes, and its value with or without the length marker. */
function readNumber(bytes: Uint8Array, at: number, keepsMarker: boolean): { width: number; value: number; isUnknown: boolean } {
  const first = bytes[at];
  if (first === undefined || first === 0) throw new Error("no EBML number");
  const width = Math.clz32(first) - 23;
  if (at + width > bytes.length) throw new Error("an EBML number is cut off");
  let value = keepsMarker ? first : first & (0xff >> width);
  let ones = (first | (0xff00 >> width)) & 0xff;
  for (const byte of bytes.subarray(at + 1, at + width)) {
    value = 256 * value + byte;
    ones &= byte;
  }
  return { width, value, isUnknown: ones === 0xff };
}

function readElement(bytes: Uint8Array, at: number): EbmlElement {
  const id = readNumber(bytes, at, true);
  const size = readNumber(bytes, at + id.width, false);
  return { id: id.value, content: at + id.width + size.width, length: size.isUnknown ? null : size.value };
}

/** The front of a WebM file with its duration [s]; null if it has one, or is no plain stream. */
export function frontWithDuration(front: Uint8Array, seconds: number): Uint8Array | null {
  const header = readElement(front, 0);
  if (header.id !== EBML || header.length === null) return null;
  const segment = readElement(front, header.content + header.length);
  // A segment of known size may hold offsets, too, which would no longer be right.
  if (segment.id !== SEGMENT || segment.length !== null) return null;
  for (let at = segment.content; at < front.length; ) {
    const element = readElement(front, at);
    if (element.length === null || element.content + element.length > front.length) return null;
    if (element.id === INFO) return insertDuration(front, at, element.content, element.content + element.length, seconds);
    if (element.id !== VOID) return null;
    at = element.content + element.length;
  }
  return null;
}

/** Info [at, end) with a Duration at its end. */
function insertDuration(front: Uint8Array, at: number, content: number, end: number, seconds: number): Uint8Array | null {
  let scale = DEFAULT_SCALE_NS;
  for (let inner = content; inner < end; ) {
    const { id, content: begin, length } = readElement(front, inner);
    if (id === DURATION || length === null) return null;
    if (id === TIMESTAMP_SCALE) scale = front.subarray(begin, begin + length).reduce((value, byte) => 256 * value + byte, 0);
    inner = begin + length;
  }
  const old = front.subarray(content, end);
  // Id of Info, its size in eight bytes, what it had, and the duration as a double.
  const info = new Uint8Array(4 + 8 + old.length + 3 + 8);
  const view = new DataView(info.buffer);
  view.setUint32(0, INFO);
  view.setUint32(4, 0x01000000);
  view.setUint32(8, old.length + 11);
  info.set(old, 12);
  view.setUint16(12 + old.length, DURATION);
  view.setUint8(14 + old.length, 0x88);
  view.setFloat64(15 + old.length, (1e9 * seconds) / scale);
  const changed = new Uint8Array(at + info.length + front.length - end);
  changed.set(front.subarray(0, at));
  changed.set(info, at);
  changed.set(front.subarray(end), at + info.length);
  return changed;
}

/** A recorded film with its duration [s]; other files as they are. */
export async function withDuration(film: Blob, seconds: number): Promise<Blob> {
  const front = new Uint8Array(await film.slice(0, FRONT_BYTES).arrayBuffer());
  const changed = frontWithDuration(front, seconds);
  return changed === null ? film : new Blob([changed as Uint8Array<ArrayBuffer>, film.slice(FRONT_BYTES)], { type: film.type });
}
