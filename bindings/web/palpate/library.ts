// The one instance of the module that recordings, scenes and simulations share.

import { PalpateError } from "./error.js";
import { Instance, type ModuleSource } from "./memory.js";

let loading: Promise<Instance> | null = null;
let loaded: Instance | null = null;

/**
 * Loads the WebAssembly module, once. {@link Recording.load} and {@link Scene.load} do it where it is needed.
 *
 * @param source Address, bytes or compiled module; `palpate.wasm` beside this package's files without it.
 */
export async function load(source: ModuleSource = new URL("./palpate.wasm", import.meta.url)): Promise<void> {
  loading ??= Instance.load(source).catch((error: unknown) => {
    loading = null;
    throw error;
  });
  loaded = await loading;
}

/** The instance; an error before {@link load} has ended. */
export function library(): Instance {
  if (loaded === null) throw new PalpateError("the module is not loaded: await load() first");
  return loaded;
}

/** Handle in the module that was not given back yet. */
export function alive(handle: number, kind: string): number {
  if (handle === 0) throw new PalpateError(`the ${kind} was disposed of`);
  return handle;
}

/** Frees the memory behind objects that nobody has any more. */
export class Freer {
  private readonly registry: FinalizationRegistry<number>;

  constructor(private readonly free: (handle: number) => void) {
    this.registry = new FinalizationRegistry((handle) => this.free(handle));
  }

  /** Frees a handle when its owner is collected, or disposed of. */
  watch(owner: object, handle: number): void {
    this.registry.register(owner, handle, owner);
  }

  /** Frees the handle of an owner now. */
  dispose(owner: object, handle: number): void {
    if (this.registry.unregister(owner)) this.free(handle);
  }
}
