import { expect, test } from "vitest";
import { CHUNK, FrameCache } from "../../src/playback/frame_cache";
import { Player } from "../../src/playback/player";

const settle = () => new Promise((done) => setTimeout(done, 0));

test("frames are fetched in chunks once, and the least recently used are evicted", async () => {
  const asked: number[] = [];
  const fetchFrames = async (from: number, count: number) => {
    asked.push(from);
    return Array.from({ length: count }, () => new ArrayBuffer(100));
  };
  const cache = new FrameCache(fetchFrames, 10 * CHUNK, 250 * CHUNK);
  expect(cache.get(3)).toBeNull();
  expect(cache.get(4)).toBeNull();
  await settle();
  expect(asked).toEqual([0]);
  expect(cache.get(3)?.byteLength).toBe(100);
  cache.get(CHUNK);
  await settle();
  cache.get(0);
  cache.get(2 * CHUNK);
  await settle();
  expect(cache.size).toBe(200 * CHUNK);
  // Chunk 1 was used longest ago.
  expect(cache.get(0)).not.toBeNull();
  expect(cache.get(CHUNK)).toBeNull();
});

test("an incomplete chunk is requested again after a delay", async () => {
  let asked = 0;
  const cache = new FrameCache(async () => (asked++, [new ArrayBuffer(8)]), 50);
  cache.get(0);
  await settle();
  expect(cache.get(0)).not.toBeNull();
  expect(cache.get(7)).toBeNull();
  await settle();
  expect(asked).toBe(1);
});

test("a player stops at the end and restarts from the beginning", () => {
  const player = new Player(1, 0.1);
  player.toggle();
  player.speed = 2;
  player.advance(0.3);
  expect(player.time).toBeCloseTo(0.6, 12);
  player.advance(5);
  expect([player.time, player.playing]).toEqual([1, false]);
  player.toggle();
  expect([player.time, player.playing]).toEqual([0, true]);
  player.stepFrames(3);
  expect([player.frameOf(11, 0.1), player.playing]).toEqual([3, false]);
  player.stepFrames(-10);
  expect(player.time).toBe(0);
  player.changeSpeed(-1);
  expect(player.speed).toBe(1);
});
