import { expect, test } from "vitest";
import { frontWithDuration, withDuration } from "../../src/share/webm_duration";

const HEADER = [0x1a, 0x45, 0xdf, 0xa3, 0x84, 0x42, 0x86, 0x81, 1];
const UNKNOWN = [0x01, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
const SEGMENT = [0x18, 0x53, 0x80, 0x67];
const SCALE = [0x2a, 0xd7, 0xb1, 0x83, 0x0f, 0x42, 0x40];
const info = (...content: number[]) => [0x15, 0x49, 0xa9, 0x66, 0x80 | content.length, ...content];
const TRACKS = [0x16, 0x54, 0xae, 0x6b, 0x82, 7, 8];

test("a stream gets its duration at the end of Info", () => {
  const front = new Uint8Array([...HEADER, ...SEGMENT, ...UNKNOWN, 0xec, 0x81, 0, ...info(...SCALE), ...TRACKS]);
  const changed = frontWithDuration(front, 2.5);
  const duration = [0x44, 0x89, 0x88, 0x40, 0xa3, 0x88, 0, 0, 0, 0, 0];
  const size = [0x01, 0, 0, 0, 0, 0, 0, SCALE.length + duration.length];
  expect([...(changed ?? [])]).toEqual([...HEADER, ...SEGMENT, ...UNKNOWN, 0xec, 0x81, 0, 0x15, 0x49, 0xa9, 0x66, ...size, ...SCALE, ...duration, ...TRACKS]);
  // A duration that is there stays.
  expect(frontWithDuration(changed ?? front, 3)).toBeNull();
});

test("the duration counts ticks of the file", () => {
  const microseconds = [0x2a, 0xd7, 0xb1, 0x82, 0x03, 0xe8];
  const changed = frontWithDuration(new Uint8Array([...HEADER, ...SEGMENT, ...UNKNOWN, ...info(...microseconds)]), 1.5);
  expect(new DataView((changed as Uint8Array).buffer).getFloat64((changed as Uint8Array).length - 8)).toBe(1.5e6);
});

test("files that know their size, seek tables and other formats stay as they are", async () => {
  const known = new Uint8Array([...HEADER, ...SEGMENT, 0x80 | info(...SCALE).length, ...info(...SCALE)]);
  expect(frontWithDuration(known, 1)).toBeNull();
  const seeks = new Uint8Array([...HEADER, ...SEGMENT, ...UNKNOWN, 0x11, 0x4d, 0x9b, 0x74, 0x80, ...info(...SCALE)]);
  expect(frontWithDuration(seeks, 1)).toBeNull();
  for (const bytes of [[], [0, 0, 0, 0x18], HEADER, [...HEADER, ...SEGMENT, ...UNKNOWN, 0x15, 0x49]]) {
    const film = new Blob([new Uint8Array(bytes)], { type: "video/mp4" });
    const same = await withDuration(film, 1).catch(() => film);
    expect([...new Uint8Array(await same.arrayBuffer())]).toEqual(bytes);
  }
});
