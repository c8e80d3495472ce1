import { expect, test } from "vitest";
import { nodesFromSteps, readPicture, splitFrames, Unreadable } from "../../src/protocol/picture";
import { head } from "./bytes";

const POSE = [0.5, 1, 1.5, 0, 0, 0, 1];

test("a modal picture is read with its padding", () => {
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
    .u32(0 | (1 << 8) | (5 << 16))
    .f32(1, 2, 3, 0, 10, 0, 0.125);
  const picture = readPicture(bytes.buffer);
  expect(picture.generation).toBe(3);
  expect(picture.step).toBe(77);
  expect(picture.time).toBe(1.25);
  expect([...picture.energies]).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
  expect([picture.contactsUnsolved, picture.contactsLeftOut]).toEqual([false, true]);
  const { pose, shape } = picture.objects[0];
  expect([...pose]).toEqual(POSE);
  if (shape.form !== "modal") throw new Error("not modal");
  expect([...shape.q]).toEqual([0.25, -0.5]);
  expect([...shape.nodes]).toEqual([4, 5, 65540]);
  expect([...shape.dents]).toEqual([1, -2, 3, 127, -127, 0, 0, 0, 0]);
  expect(picture.devices[0]).toEqual({ doing: "holds", position: [1, 2, 3], proxy: [4, 5, 6], force: [7, 8, 9] });
  expect(picture.contacts[0]).toEqual({ object: 0, partner: "obstacle", partnerNumber: 5, point: [1, 2, 3], force: [0, 10, 0], slip: 0.125 });
});

test("a picture of vertices is read", () => {
  const picture = readPicture(head(2, [1, 0, 0, 0]).f32(...POSE).u32(2).f32(1, 2, 3, 4, 5, 6).buffer);
  expect(picture.objects[0].shape).toEqual({ form: "vertices", places: Float32Array.of(1, 2, 3, 4, 5, 6) });
});

test("whatever is cut off, is refused and does not read beyond the end", () => {
  const whole = head(1, [1, 0, 1, 0]).f32(...POSE).u32(1).f32(0.5).u32(0).f32(0).u32(0).f32(0, 0, 0, 0, 0, 0, 0, 0, 0).buffer;
  expect(readPicture(whole).objects).toHaveLength(1);
  for (let length = 0; length < whole.byteLength; length += 4) {
    expect(() => readPicture(whole.slice(0, length)), `${length} bytes`).toThrow(Unreadable);
  }
});

test("bytes that are no picture are refused", () => {
  expect(() => readPicture(new ArrayBuffer(200))).toThrow("no picture");
  expect(() => readPicture(head(2, [4e9, 0, 0, 0]).buffer)).toThrow("do not fit");
  expect(() => readPicture(head(2, [0, 0, 4e9, 0]).buffer)).toThrow("do not fit");
  expect(() => readPicture(head(2, [1, 0, 0, 0]).f32(NaN, 0, 0, 0, 0, 0, 1).u32(0).buffer)).toThrow("not finite");
  expect(() => readPicture(head(2, [0, 0, 1, 0]).u32(9).f32(0, 0, 0, 0, 0, 0, 0, 0, 0).buffer)).toThrow("nothing known");
});

test("random bytes after a head never do anything but be refused or read", () => {
  let seed = 1;
  const random = () => (seed = (seed * 48271) % 2147483647);
  for (let round = 0; round < 300; round++) {
    const bytes = head(1, [random() % 3, random() % 3, random() % 3, random() % 3]);
    for (let i = random() % 60; i > 0; i--) bytes.u32(random() % 2 === 0 ? random() % 8 : random());
    try {
      readPicture(bytes.buffer);
    } catch (error) {
      expect(error).toBeInstanceOf(Unreadable);
    }
  }
});

test("nodes are sums of their steps", () => {
  expect([...nodesFromSteps(Uint16Array.of(0, 3, 65535, 65535, 1))]).toEqual([0, 3, 65538, 131073, 131074]);
});

test("frames are split, and frames that break off are refused", () => {
  const bytes = Uint8Array.of(4, 0, 0, 0, 1, 2, 3, 4, 8, 0, 0, 0, 5, 6, 7, 8, 9, 10, 11, 12);
  expect(splitFrames(bytes.buffer).map((frame) => [...new Uint8Array(frame)])).toEqual([
    [1, 2, 3, 4],
    [5, 6, 7, 8, 9, 10, 11, 12],
  ]);
  expect(() => splitFrames(bytes.slice(0, 18).buffer)).toThrow(Unreadable);
  expect(splitFrames(new ArrayBuffer(0))).toEqual([]);
});
