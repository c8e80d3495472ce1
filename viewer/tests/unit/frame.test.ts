import { expect, test } from "vitest";
import { nodesFromDifferences, decodeFrame, splitFrames, DecodeError } from "../../src/protocol/frame";
import { head } from "./bytes";

const POSE = [0.5, 1, 1.5, 0, 0, 0, 1];

test("a modal frame is decoded with its padding", () => {
  const bytes = head(1, [1, 1, 1, 1], 2)
    .f32(...POSE)
    .u32(2)
    .f32(0.25, -0.5)
    .u32(3)
    .f32(0.001)
    .array(Uint16Array.of(4, 1, 65535))
    .array(Int8Array.of(1, -2, 3, 127, -127, 0, 0, 0, 0))
    .f32(...POSE)
    .u32(2)
    .f32(1, 2, 3, 4, 5, 6, 7, 8, 9)
    .u32(1 | (300 << 2) | (5 << 17))
    .f32(1, 2, 3, 0, 10, 0, 0.125);
  const frame = decodeFrame(bytes.buffer);
  expect(frame.generation).toBe(3);
  expect(frame.step).toBe(77);
  expect(frame.time).toBe(1.25);
  expect([...frame.energies]).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
  expect([frame.contactsUnsolved, frame.contactsDropped]).toEqual([false, true]);
  const { pose, shape } = frame.objects[0];
  expect([...pose]).toEqual(POSE);
  if (shape.format !== "modal") throw new Error("not modal");
  expect([...shape.q]).toEqual([0.25, -0.5]);
  expect([...shape.residualNodes]).toEqual([4, 5, 65540]);
  expect([...shape.residuals]).toEqual([1, -2, 3, 127, -127, 0, 0, 0, 0]);
  expect(frame.devices[0]).toEqual({ mode: "held", position: [1, 2, 3], proxy: [4, 5, 6], force: [7, 8, 9] });
  expect(frame.contacts[0]).toEqual({ object: 300, collider: "obstacle", colliderIndex: 5, point: [1, 2, 3], force: [0, 10, 0], slip: 0.125 });
});

test("a vertex frame is decoded", () => {
  const frame = decodeFrame(head(2, [1, 0, 0, 0]).f32(...POSE).u32(2).f32(1, 2, 3, 4, 5, 6).buffer);
  expect(frame.objects[0].shape).toEqual({ format: "vertices", positions: Float32Array.of(1, 2, 3, 4, 5, 6) });
});

test("truncated frames are refused without reading beyond the end", () => {
  const whole = head(1, [1, 0, 1, 0]).f32(...POSE).u32(1).f32(0.5).u32(0).f32(0).u32(0).f32(0, 0, 0, 0, 0, 0, 0, 0, 0).buffer;
  expect(decodeFrame(whole).objects).toHaveLength(1);
  for (let length = 0; length < whole.byteLength; length += 4) {
    expect(() => decodeFrame(whole.slice(0, length)), `${length} bytes`).toThrow(DecodeError);
  }
});

test("bytes that are no frame are refused", () => {
  expect(() => decodeFrame(new ArrayBuffer(200))).toThrow("no frame");
  expect(() => decodeFrame(head(2, [4e9, 0, 0, 0]).buffer)).toThrow("do not fit");
  expect(() => decodeFrame(head(2, [0, 0, 4e9, 0]).buffer)).toThrow("do not fit");
  expect(() => decodeFrame(head(2, [1, 0, 0, 0]).f32(NaN, 0, 0, 0, 0, 0, 1).u32(0).buffer)).toThrow("not finite");
  expect(() => decodeFrame(head(2, [0, 0, 1, 0]).u32(9).f32(0, 0, 0, 0, 0, 0, 0, 0, 0).buffer)).toThrow("unknown mode");
});

test("random bytes after a header are refused or decoded", () => {
  let seed = 1;
  const random = () => (seed = (seed * 48271) % 2147483647);
  for (let round = 0; round < 300; round++) {
    const bytes = head(1, [random() % 3, random() % 3, random() % 3, random() % 3]);
    for (let i = random() % 60; i > 0; i--) bytes.u32(random() % 2 === 0 ? random() % 8 : random());
    try {
      decodeFrame(bytes.buffer);
    } catch (error) {
      expect(error).toBeInstanceOf(DecodeError);
    }
  }
});

test("node indices are sums of their differences", () => {
  expect([...nodesFromDifferences(Uint16Array.of(0, 3, 65535, 65535, 1))]).toEqual([0, 3, 65538, 131073, 131074]);
});

test("frames are split, and truncated frames are refused", () => {
  const bytes = Uint8Array.of(4, 0, 0, 0, 1, 2, 3, 4, 8, 0, 0, 0, 5, 6, 7, 8, 9, 10, 11, 12);
  expect(splitFrames(bytes.buffer).map((frame) => [...new Uint8Array(frame)])).toEqual([
    [1, 2, 3, 4],
    [5, 6, 7, 8, 9, 10, 11, 12],
  ]);
  expect(() => splitFrames(bytes.slice(0, 18).buffer)).toThrow(DecodeError);
  expect(splitFrames(new ArrayBuffer(0))).toEqual([]);
});
