// Parts of a scene in the module: recordings and motion paths by the names that its text gives them.

import type { Instance } from "./memory.js";

/** Files that a scene names, as it names them: the recordings of its objects first, in their order. */
export function namedFiles(instance: Instance, toml: string): string[] {
  return instance.withBytes(toml, (at, length) => instance.described<string[]>((exports) => exports.scene_files(at, length)));
}

/** Result of a call with the parts of a scene: handles of recordings, and paths as CSV text. */
export function withParts<T>(instance: Instance, recordings: ReadonlyMap<string, number>, paths: ReadonlyMap<string, string>, use: (parts: number) => T): T {
  const { exports } = instance;
  const parts = exports.parts_new();
  try {
    for (const [name, recording] of recordings) {
      instance.withBytes(name, (at, length) => exports.parts_add_recording(parts, at, length, recording));
    }
    for (const [name, path] of paths) {
      instance.withBytes(name, (at, length) => instance.withBytes(path, (text, textLength) => exports.parts_add_path(parts, at, length, text, textLength)));
    }
    return use(parts);
  } finally {
    exports.parts_free(parts);
  }
}
