// Import graph of the page: no cycles between modules of `src/`.

import { readdirSync, readFileSync } from "node:fs";
import { posix } from "node:path";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";

const ROOT = fileURLToPath(new URL("../../src/", import.meta.url));
const modules = (readdirSync(ROOT, { recursive: true }) as string[]).filter((path) => path.endsWith(".ts"));

/** Modules that a module imports, types included, as paths relative to `src/`. */
function importsOf(module: string): string[] {
  const text = readFileSync(ROOT + module, "utf8");
  const specifiers = [...text.matchAll(/^(?:import|export)\b[^;]*?\bfrom "(\.[^"]+)"/gm)].map((match) => match[1]);
  // A worker's address is imported with a query.
  return specifiers.map((specifier) => `${posix.join(posix.dirname(module), specifier.split("?")[0])}.ts`);
}

/** First import cycle found by depth-first search, or null. */
function findCycle(graph: ReadonlyMap<string, readonly string[]>): string[] | null {
  const finished = new Set<string>();
  const visit = (module: string, path: readonly string[]): string[] | null => {
    if (path.includes(module)) return [...path.slice(path.indexOf(module)), module];
    if (finished.has(module)) return null;
    for (const next of graph.get(module) ?? []) {
      const cycle = visit(next, [...path, module]);
      if (cycle !== null) return cycle;
    }
    finished.add(module);
    return null;
  };
  for (const module of graph.keys()) {
    const cycle = visit(module, []);
    if (cycle !== null) return cycle;
  }
  return null;
}

test("a cycle is found", () => {
  expect(findCycle(new Map([["a", ["b"]], ["b", ["c"]], ["c", ["b"]]]))).toEqual(["b", "c", "b"]);
});

test("modules import one another without cycles", () => {
  const graph = new Map(modules.map((module) => [module, importsOf(module)]));
  expect([...graph.values()].flat().filter((module) => !graph.has(module) && !module.startsWith("../"))).toEqual([]);
  expect([...graph.values()].flat().length).toBeGreaterThan(modules.length);
  expect(findCycle(graph)).toBeNull();
});
