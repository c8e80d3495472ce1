// Simulations: scenes that the program steps.

import { PalpateError } from "./error.js";
import { alive, Freer, library } from "./library.js";
import { unsigned } from "./memory.js";
import type { Scene, Vector } from "./scene.js";

/** Places of the arrays in the module. */
const enum Place {
  Positions = 0,
  Obstacles = 1,
  Clamps = 2,
  Forces = 3,
  Proxies = 4,
  Poses = 5,
  Velocities = 6,
  ObjectLoads = 7,
  ObstacleLoads = 8,
  ClampLoads = 9,
  Energies = 10,
  Contacts = 11,
}

/** Numbers of a contact in {@link Simulation.contactRows}. */
export const CONTACT_COLUMNS = 14;

/** Contact that carries force. */
export interface Contact {
  /** Point on the object's surface [m]. */
  point: Vector;
  /** Unit normal, out of the object. */
  normal: Vector;
  /** Force on the object [N]. */
  force: Vector;
  /** Gap [m], negative when penetrating. */
  gap: number;
  /** Slip speed [m/s]. */
  slip: number;
  /** Number of the object. */
  object: number;
  /** Other side, and its number. */
  against: { kind: "device" | "obstacle" | "object"; number: number };
}

const KINDS = ["device", "obstacle", "object"] as const;

const freer = new Freer((handle) => library().exports.simulation_free(handle));

let energyNames: readonly string[] | null = null;

/**
 * Simulation of a scene: its state, and arrays in the module's memory.
 *
 * Arrays are views: they are read and written without a copy, and show the last step. Take them from here each time rather than keep them: memory
 * that grows leaves old views empty, and views end with {@link dispose}.
 */
export class Simulation {
  private address: number;
  private readonly views: (Float64Array | undefined)[] = [];

  constructor(readonly scene: Scene) {
    const instance = library();
    this.address = instance.call((exports) => exports.simulation_new(scene.handle));
    freer.watch(this, this.address);
  }

  private get handle(): number {
    return alive(this.address, "simulation");
  }

  /**
   * Advances by one step. Input is in {@link positions}, {@link obstacles} and {@link clamps}; parts with a path in the scene follow it.
   *
   * @param positions Positions of the hands at the end of the step [m], in the order of the devices; the same as writing {@link positions}.
   * @returns Forces on the hands [N], rows of 3.
   */
  step(positions?: ArrayLike<number>): Float64Array {
    if (positions !== undefined) {
      const own = this.positions;
      if (positions.length !== own.length) throw new PalpateError(`${positions.length} numbers for ${own.length / 3} devices, expected 3 for each`);
      own.set(positions);
    }
    library().call((exports) => exports.simulation_step(this.handle));
    return this.forces;
  }

  /** Simulated time [s]. */
  get time(): number {
    return library().exports.simulation_time(this.handle);
  }

  /**
   * Warnings about the steps since the start: positions that look like millimetres, penetration, contacts that were not solved or left out, a tip that
   * begins inside an object, or moved and touched nothing. For looking, not for each step; those of the scene are in {@link Scene.warnings}.
   */
  get warnings(): string[] {
    return library().described<string[]>((exports) => exports.simulation_warnings(this.handle));
  }

  /** Input: positions of the hands at the end of the next step, rows of 3 [m]; of a device of mode "force" its force [N]. NaN: takes no part. */
  get positions(): Float64Array {
    return this.view(Place.Positions);
  }

  /** Input: poses of planes and obstacles at the end of the next step, rows x, y, z [m], qw, qx, qy, qz. */
  get obstacles(): Float64Array {
    return this.view(Place.Obstacles);
  }

  /** Input: frames of the clamps, likewise. */
  get clamps(): Float64Array {
    return this.view(Place.Clamps);
  }

  /** Forces on the hands, rows of 3 [N]. */
  get forces(): Float64Array {
    return this.view(Place.Forces);
  }

  /** Tips, or held points, rows of 3 [m]. */
  get proxies(): Float64Array {
    return this.view(Place.Proxies);
  }

  /** Poses of the objects, rows x, y, z [m], qw, qx, qy, qz. */
  get poses(): Float64Array {
    return this.view(Place.Poses);
  }

  /** Velocities of the objects, rows of 3 [m/s] and 3 [rad/s]. */
  get velocities(): Float64Array {
    return this.view(Place.Velocities);
  }

  /** Net forces and torques on the objects, without their weight, rows of 3 [N] and 3 [N·m]. */
  get objectLoads(): Float64Array {
    return this.view(Place.ObjectLoads);
  }

  /** Net forces and torques on planes and obstacles, rows of 3 [N] and 3 [N·m]. */
  get obstacleLoads(): Float64Array {
    return this.view(Place.ObstacleLoads);
  }

  /** Reactions on the clamps, rows of 3 [N] and 3 [N·m]. */
  get clampLoads(): Float64Array {
    return this.view(Place.ClampLoads);
  }

  /** Energies by name [J]. */
  get energy(): Record<string, number> {
    energyNames ??= library().described<{ energies: string[] }>((exports) => exports.describe_library()).energies;
    const values = this.view(Place.Energies);
    return Object.fromEntries(energyNames.map((name, at) => [name, values[at] ?? 0]));
  }

  /** Contacts that carry force, rows of {@link CONTACT_COLUMNS}: point, normal, force, gap, slip, object, kind of the other side, its number. */
  get contactRows(): Float64Array {
    const { exports } = library();
    const length = exports.simulation_array_length(this.handle, Place.Contacts);
    return new Float64Array(exports.memory.buffer, unsigned(exports.simulation_array(this.handle, Place.Contacts)), length);
  }

  /** Contacts that carry force, as objects: for looking, not for each step. */
  get contacts(): Contact[] {
    const rows = this.contactRows;
    const contacts: Contact[] = [];
    for (let at = 0; at < rows.length; at += CONTACT_COLUMNS) {
      const vector = (from: number): Vector => [rows[at + from] ?? 0, rows[at + from + 1] ?? 0, rows[at + from + 2] ?? 0];
      const number = (from: number) => rows[at + from] ?? 0;
      const against = { kind: KINDS[number(12)] ?? "object", number: number(13) };
      contacts.push({ point: vector(0), normal: vector(3), force: vector(6), gap: number(9), slip: number(10), object: number(11), against });
    }
    return contacts;
  }

  /**
   * Positions of the nodes of an object's deformed surface, rows of 3 [m, world]: a view for a vertex buffer, overwritten by the next call. Costs
   * nodes × modes: once per frame, not per step.
   */
  surface(object: string | number): Float32Array {
    const { exports } = library();
    const number = this.objectNumber(object);
    const address = unsigned(exports.simulation_surface(this.handle, number));
    return new Float32Array(exports.memory.buffer, address, exports.simulation_surface_length(this.handle));
  }

  /** Lets a device hold the point of an object's surface that is nearest to a position [m]. From now on its row of {@link positions} moves it, also where it has a path. */
  grasp(device: string | number, object: string | number, point: Vector): void {
    const [own, other] = [this.deviceNumber(device), this.objectNumber(object)];
    library().call((exports) => exports.simulation_grasp(this.handle, own, other, ...point));
  }

  /** Lets a device go: it touches with its tip from now on. */
  release(device: string | number): void {
    const own = this.deviceNumber(device);
    library().call((exports) => exports.simulation_release(this.handle, own));
  }

  /** Back to the start of the scene. */
  reset(): void {
    library().call((exports) => exports.simulation_reset(this.handle));
  }

  /** Frees its memory now; otherwise it is freed when nobody has it any more. */
  dispose(): void {
    freer.dispose(this, this.address);
    this.address = 0;
  }

  private view(place: Place): Float64Array {
    const { exports } = library();
    const { handle } = this;
    const known = this.views[place];
    if (known !== undefined && known.buffer === exports.memory.buffer) return known;
    const length = exports.simulation_array_length(handle, place);
    const view = new Float64Array(exports.memory.buffer, unsigned(exports.simulation_array(handle, place)), length);
    this.views[place] = view;
    return view;
  }

  private objectNumber(object: string | number): number {
    return place(object, this.scene.objectNames, "object");
  }

  private deviceNumber(device: string | number): number {
    return place(device, this.scene.deviceNames, "device");
  }
}

/** Number of a part, by its name or its number. */
function place(part: string | number, names: readonly string[], kind: string): number {
  const number = typeof part === "string" ? names.indexOf(part) : part;
  if (Number.isInteger(number) && number >= 0 && number < names.length) return number;
  throw new PalpateError(`there is no ${kind} ${JSON.stringify(part)}; the scene has ${names.join(", ") || "none"}`);
}
