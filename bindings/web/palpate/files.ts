// Files: fetched by a browser, read from the disk by Node.js, which fetches no `file:` addresses.

import { PalpateError } from "./error.js";

/** Address of a file: relative to the page, in Node.js to the working directory. */
export function addressOf(file: string | URL): URL {
  const folder = () => builtIn("node:url").pathToFileURL(`${process.cwd()}/`).href;
  return new URL(file, globalThis.location?.href ?? folder());
}

/** Address of a file that a scene names, relative to the scene; a name may hold characters that mean something in an address. */
export function addressBeside(scene: URL, name: string): URL {
  const isAddress = /^[a-z][a-z\d+.-]+:\/\//i.test(name);
  return new URL(isAddress ? name : name.split("/").map(encodeURIComponent).join("/"), scene);
}

/** Content of a file. */
export async function readFile(address: URL): Promise<Uint8Array<ArrayBuffer>> {
  if (address.protocol === "file:") {
    const reading = builtIn("node:fs").promises.readFile(address);
    return new Uint8Array(
      await reading.catch((error: Error) => {
        throw new PalpateError(error.message);
      }),
    );
  }
  const response = await fetch(address);
  if (!response.ok) throw new PalpateError(`${address.href}: ${response.status} ${response.statusText}`);
  return new Uint8Array(await response.arrayBuffer());
}

/** Module of Node.js; bundlers for browsers see no import. */
function builtIn<Id extends "node:fs" | "node:url">(id: Id): ReturnType<typeof process.getBuiltinModule<Id>> {
  const getBuiltinModule = globalThis.process?.getBuiltinModule;
  if (getBuiltinModule === undefined) throw new PalpateError("a browser reads no files of the disk: serve them by HTTP");
  return getBuiltinModule(id);
}
