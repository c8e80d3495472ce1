// The built package, and files that the tests share.

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { load, Recording } from "../palpate/index.js";

const root = new URL("../../../", import.meta.url);

/** Loads the module that the build has put into `dist`. */
export async function loadPackage(): Promise<void> {
  await load(new URL("../dist/palpate.wasm", import.meta.url));
}

/** A free block of the test kit. */
export function block(): Recording {
  return Recording.fromBytes(readFileSync(new URL("crates/palpate-testkit/recordings/free.palp", root)));
}

/** Bytes of that block. */
export function blockBytes(): Uint8Array {
  return readFileSync(new URL("crates/palpate-testkit/recordings/free.palp", root));
}

/** Steps of a scene by `palpate run`, by the columns of its CSV. */
export function runNatively(toml: string, files: Record<string, string | Uint8Array>): Map<string, number[]> {
  const folder = mkdtempSync(join(tmpdir(), "palpate-web-"));
  try {
    for (const [name, content] of Object.entries({ ...files, "scene.toml": toml })) writeFileSync(join(folder, name), content);
    const program = process.env.PALPATE;
    if (program === undefined) throw new Error("PALPATE is the path of the program: run the tests by `cargo xtask test --only web`");
    execFileSync(program, ["run", join(folder, "scene.toml"), "--csv", join(folder, "steps.csv")], { stdio: ["ignore", "ignore", "ignore"] });
    const [head, ...rows] = readFileSync(join(folder, "steps.csv"), "utf8").trim().split("\n");
    const numbers = rows.map((row) => row.split(",").map(Number));
    return new Map((head ?? "").split(",").map((name, at) => [name, numbers.map((row) => row[at] ?? Number.NaN)]));
  } finally {
    rmSync(folder, { recursive: true });
  }
}
