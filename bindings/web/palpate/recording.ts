// Recordings: the impulse responses of one body, made by `palpate record`.

import { addressOf, readFile } from "./files.js";
import { alive, Freer, library, load } from "./library.js";
import { unsigned } from "./memory.js";

interface Description {
  source: string;
  nodes: number;
  triangles: number;
  mass: number;
  frequencies: number[];
  dampingRatios: number[];
  certificate: string[];
  forceError: number | null;
}

const freer = new Freer((handle) => library().exports.recording_free(handle));

/** Recording of an elastic body: its surface, modes and residual compliance. */
export class Recording {
  private readonly description: Description;

  private address: number;

  /** @internal */
  constructor(handle: number) {
    this.address = handle;
    this.description = library().described((exports) => exports.recording_describe(handle));
    freer.watch(this, handle);
  }

  /** @internal */
  get handle(): number {
    return alive(this.address, "recording");
  }

  /** Loads a recording file (`.palp`) from an address, or, in Node.js, from a path. */
  static async load(url: string | URL): Promise<Recording> {
    const [bytes] = await Promise.all([readFile(addressOf(url)), load()]);
    return Recording.fromBytes(bytes);
  }

  /** Reads the bytes of a recording file, after {@link load}. */
  static fromBytes(bytes: Uint8Array): Recording {
    const instance = library();
    return new Recording(instance.withBytes(bytes, (address, length) => instance.call((exports) => exports.recording_read(address, length))));
  }

  /** Primitive or mesh file that was recorded. */
  get source(): string {
    return this.description.source;
  }

  /** Mass [kg]. */
  get mass(): number {
    return this.description.mass;
  }

  /** Frequencies of the modes [Hz], ascending. */
  get frequencies(): readonly number[] {
    return this.description.frequencies;
  }

  /** Damping ratios of the modes [1]. */
  get dampingRatios(): readonly number[] {
    return this.description.dampingRatios;
  }

  /** Largest relative error of the force in a smooth press, measured when it was recorded; null if it was not. */
  get forceError(): number | null {
    return this.description.forceError;
  }

  /** Certificate of the recording's errors, a line per statement. */
  get certificate(): readonly string[] {
    return this.description.certificate;
  }

  /** Positions of the surface's nodes at rest [m, body frame], rows of 3. */
  get positions(): Float64Array {
    const { exports } = library();
    return new Float64Array(exports.memory.buffer, unsigned(exports.recording_positions(this.handle)), 3 * this.description.nodes).slice();
  }

  /** Nodes of the surface's triangles, rows of 3, counter-clockwise from outside. */
  get triangles(): Uint32Array {
    const { exports } = library();
    return new Uint32Array(exports.memory.buffer, unsigned(exports.recording_triangles(this.handle)), 3 * this.description.triangles).slice();
  }

  /**
   * Recording of the same free body in another material with the same Poisson's ratio, without FEM: exact, since stiffness is proportional to
   * Young's modulus and mass to density.
   *
   * @param young Young's modulus [Pa].
   * @param density Density [kg/m³].
   */
  rescaled(young: number, density: number): Recording {
    return new Recording(library().call((exports) => exports.recording_rescaled(this.handle, young, density)));
  }

  /** Frees its memory now; otherwise it is freed when nobody has it any more. */
  dispose(): void {
    freer.dispose(this, this.address);
    this.address = 0;
  }
}
