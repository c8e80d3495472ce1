// Instance of the WebAssembly module: its memory, what it sends, and calls with texts and bytes.

import { PalpateError } from "./error.js";
import { readFile } from "./files.js";

/** Kinds of what the module sends. */
export const enum Sent {
  Error = 0,
  Json = 1,
  Text = 2,
  Frame = 3,
  Data = 4,
  Sound = 5,
}

/** Functions of the module; handles and addresses are numbers. */
export interface Exports {
  readonly memory: WebAssembly.Memory;
  allocate(length: number): number;
  deallocate(address: number, length: number): void;
  describe_library(): void;
  recording_read(address: number, length: number): number;
  recording_free(recording: number): void;
  recording_describe(recording: number): void;
  recording_positions(recording: number): number;
  recording_triangles(recording: number): number;
  recording_rescaled(recording: number, young: number, density: number): number;
  scene_files(address: number, length: number): void;
  parts_new(): number;
  parts_free(parts: number): void;
  parts_add_recording(parts: number, name: number, nameLength: number, recording: number): void;
  parts_add_path(parts: number, name: number, nameLength: number, path: number, pathLength: number): void;
  scene_read(address: number, length: number, parts: number): number;
  scene_free(scene: number): void;
  simulation_new(scene: number): number;
  simulation_free(simulation: number): void;
  simulation_reset(simulation: number): void;
  simulation_step(simulation: number): number;
  simulation_time(simulation: number): number;
  simulation_warnings(simulation: number): void;
  simulation_array(simulation: number, array: number): number;
  simulation_array_length(simulation: number, array: number): number;
  simulation_surface(simulation: number, object: number): number;
  simulation_surface_length(simulation: number): number;
  simulation_grasp(simulation: number, device: number, object: number, x: number, y: number, z: number): number;
  simulation_release(simulation: number, device: number): number;
}

/** Source of the module: an address, its bytes, or a compiled module. */
export type ModuleSource = string | URL | BufferSource | WebAssembly.Module;

/** Receiver of messages: `bytes` is valid during the call only. */
export type Receiver = (kind: Sent, bytes: Uint8Array) => void;

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** Text of bytes of the module. */
export function textOf(bytes: Uint8Array): string {
  return decoder.decode(bytes);
}

/** Address of the module, which WebAssembly hands over as a signed number. */
export function unsigned(address: number): number {
  return address >>> 0;
}

/** Instance of the module. */
export class Instance {
  /** Receives what is neither an error nor JSON. */
  receiver: Receiver = () => undefined;
  private own: Exports | null = null;
  private error: string | null = null;
  private json: unknown = null;
  /** Reason that the module has stopped for good: it ran out of memory, or has a bug. */
  stopped: string | null = null;

  private constructor() {}

  /** Compiles and starts a module; `now` reads a clock that never goes back [s]. */
  static async load(source: ModuleSource, now: () => number = () => performance.now() / 1000): Promise<Instance> {
    const made = new Instance();
    const send = (kind: Sent, address: number, length: number) => made.receive(kind, new Uint8Array(made.exports.memory.buffer, unsigned(address), unsigned(length)));
    const instance = await WebAssembly.instantiate(await compile(source), { palpate: { send, now } });
    made.own = instance.exports as unknown as Exports;
    return made;
  }

  /** Functions of the module; an error once it has stopped. */
  get exports(): Exports {
    if (this.own === null || this.stopped !== null) throw new PalpateError(this.stopped ?? "the module is not loaded");
    return this.own;
  }

  /** Result of a call of the module; the error that it sends is thrown. */
  call<T>(run: (exports: Exports) => T): T {
    this.error = null;
    const result = this.guard(() => run(this.exports));
    if (this.error !== null) throw new PalpateError(this.error);
    return result;
  }

  /** Result of a call of the module, which stops for good where it traps: what is left in its memory is of no use. */
  guard<T>(run: () => T): T {
    try {
      return run();
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      this.stopped = `WebAssembly has stopped (${error.message}): it ran out of memory, or has a bug`;
      throw new PalpateError(this.stopped);
    }
  }

  /** JSON that a call of the module sends. */
  described<T>(run: (exports: Exports) => unknown): T {
    this.json = null;
    this.call(run);
    return this.takeJson() as T;
  }

  /** Last JSON that was sent since it was taken, or null. */
  takeJson(): unknown {
    const json = this.json;
    this.json = null;
    return json;
  }

  /** Result of a call with bytes, or with a text in UTF-8, in the module's memory. */
  withBytes<T>(content: Uint8Array | string, use: (address: number, length: number) => T): T {
    const bytes = typeof content === "string" ? encoder.encode(content) : content;
    const address = unsigned(this.exports.allocate(bytes.byteLength));
    if (address === 0) throw new PalpateError(`there is no memory for ${bytes.byteLength} bytes`);
    try {
      new Uint8Array(this.exports.memory.buffer, address, bytes.byteLength).set(bytes);
      return use(address, bytes.byteLength);
    } finally {
      if (this.stopped === null) this.exports.deallocate(address, bytes.byteLength);
    }
  }

  private receive(kind: Sent, bytes: Uint8Array): void {
    if (kind === Sent.Error) this.error = textOf(bytes);
    else if (kind === Sent.Json) this.json = JSON.parse(textOf(bytes));
    else this.receiver(kind, bytes);
  }
}

async function compile(source: ModuleSource): Promise<WebAssembly.Module> {
  if (source instanceof WebAssembly.Module) return source;
  if (typeof source !== "string" && !(source instanceof URL)) return WebAssembly.compile(source);
  // A file server may not know the type that streaming asks for.
  return WebAssembly.compile(await readFile(new URL(source, import.meta.url)));
}
