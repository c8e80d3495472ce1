// Code blocks of docs/web.md, run against a file server.

import { readFileSync } from "node:fs";
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { afterAll, beforeAll, expect, it, vi } from "vitest";
import * as palpate from "../palpate/index.js";
import { blockBytes, loadPackage } from "./package.js";

let server: Server;

beforeAll(async () => {
  await loadPackage();
  // A recording under the name that the page gives it.
  server = createServer((_, response) => response.end(blockBytes()));
  await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
});

afterAll(() => {
  server.close();
});

it("runs every block in JavaScript of docs/web.md", async () => {
  const page = readFileSync(new URL("../../../docs/web.md", import.meta.url), "utf8");
  const blocks = Array.from(page.matchAll(/^```js\n([\s\S]*?)^```/gm), (match) => match[1] ?? "");
  expect(blocks.length).toBeGreaterThan(0);
  const base = `http://127.0.0.1:${(server.address() as AddressInfo).port}/`;
  const { fetch } = globalThis;
  vi.stubGlobal("fetch", (url: string | URL) => fetch(new URL(url, base)));
  const log = vi.spyOn(console, "log").mockImplementation(() => undefined);
  const AsyncFunction = (async () => undefined).constructor as new (...parts: string[]) => (module: typeof palpate) => Promise<void>;
  for (const block of blocks) {
    const body = block.replace(/^import (\{[^}]*\}) from "palpate";$/m, "const $1 = palpate;");
    await new AsyncFunction("palpate", body)(palpate);
  }
  const rows = log.mock.calls.map((row) => row.map(Number));
  vi.restoreAllMocks();
  vi.unstubAllGlobals();
  expect(rows.length).toBe(10);
  expect(rows.every((row) => row.every(Number.isFinite))).toBe(true);
  expect(rows.at(-1)?.[1], "the finger feels the body").toBeGreaterThan(0);
});
