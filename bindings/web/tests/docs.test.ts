// Code blocks of docs/web.md, run in a folder with the file that they name.

import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, it, vi } from "vitest";
import * as palpate from "../palpate/index.js";
import { blockBytes, loadPackage } from "./package.js";

let folder: string;
const from = process.cwd();

beforeAll(async () => {
  await loadPackage();
  // A recording under the name that the page gives it.
  folder = mkdtempSync(join(tmpdir(), "palpate-docs-"));
  writeFileSync(join(folder, "ball.palp"), blockBytes());
  process.chdir(folder);
});

afterAll(() => {
  process.chdir(from);
  rmSync(folder, { recursive: true });
});

it("runs every block in JavaScript of docs/web.md", async () => {
  const page = readFileSync(new URL("../../../docs/web.md", import.meta.url), "utf8");
  const blocks = Array.from(page.matchAll(/^```js\n([\s\S]*?)^```/gm), (match) => match[1] ?? "");
  expect(blocks.length).toBeGreaterThan(0);
  const log = vi.spyOn(console, "log").mockImplementation(() => undefined);
  const AsyncFunction = (async () => undefined).constructor as new (...parts: string[]) => (module: typeof palpate) => Promise<void>;
  for (const block of blocks) {
    const body = block.replace(/^import (\{[^}]*\}) from "palpate";$/m, "const $1 = palpate;");
    await new AsyncFunction("palpate", body)(palpate);
  }
  const rows = log.mock.calls.map((row) => row.map(Number));
  vi.restoreAllMocks();
  expect(rows.length).toBe(10);
  expect(rows.every((row) => row.every(Number.isFinite))).toBe(true);
  expect(rows.at(-1)?.[1], "the finger feels the body").toBeGreaterThan(0);
});
