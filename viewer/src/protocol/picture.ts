// Pictures: what the server says of one moment, as bytes (docs/viewer-protocol.md, "Pictures").

export const MAGIC = 0x46504c50;
const HEADER_BYTES = 88;
const DEVICE_BYTES = 40;
const CONTACT_BYTES = 32;

export const ENERGY_NAMES = [
  "kinetic",
  "elastic",
  "residual",
  "potential",
  "coupling",
  "input",
  "dissipated",
  "friction",
  "impact",
  "defect",
] as const;
export type EnergyName = (typeof ENERGY_NAMES)[number];

export type Vector = readonly [number, number, number];

/** q [m], and the dents of some nodes: `nodes[i]` is moved by `dents[3i…]·unit` [m, body]. */
export interface ModalShape {
  form: "modal";
  q: Float32Array;
  unit: number;
  nodes: Uint32Array;
  dents: Int8Array;
}

/** The places of all nodes [m, body]. */
export interface VertexShape {
  form: "vertices";
  places: Float32Array;
}

export interface ObjectPicture {
  /** Position of the centre of mass [m], orientation x, y, z, w (world from body). */
  pose: Float32Array;
  shape: ModalShape | VertexShape;
}

export type Doing = "away" | "touches" | "holds";

export interface DevicePicture {
  doing: Doing;
  /** Where the hand is [m]. */
  position: Vector;
  /** Its double that stays outside [m]. */
  proxy: Vector;
  /** Force on the hand [N]. */
  force: Vector;
}

export type Partner = "device" | "obstacle" | "object";

export interface ContactPicture {
  object: number;
  partner: Partner;
  partnerNumber: number;
  /** [m] */
  point: Vector;
  /** Force on the object [N]. */
  force: Vector;
  /** Speed of slip [m/s]. */
  slip: number;
}

export interface Picture {
  form: "modal" | "vertices";
  generation: number;
  step: number;
  /** Time of the simulation [s]. */
  time: number;
  /** [J], in the order of `ENERGY_NAMES`. */
  energies: Float32Array;
  objects: ObjectPicture[];
  /** Poses of the obstacles. */
  obstacles: Float32Array[];
  devices: DevicePicture[];
  contacts: ContactPicture[];
  contactsUnsolved: boolean;
  contactsLeftOut: boolean;
}

export class Unreadable extends Error {}

/** Reads a buffer front to back, and refuses to read beyond its end. */
class Reader {
  private readonly view: DataView;
  constructor(
    private readonly buffer: ArrayBuffer,
    public offset: number,
  ) {
    this.view = new DataView(buffer);
  }

  private take(bytes: number): number {
    const at = this.offset;
    if (bytes > this.buffer.byteLength - at) {
      throw new Unreadable(`${bytes} bytes at ${at}, but the picture has ${this.buffer.byteLength}`);
    }
    this.offset = at + bytes;
    return at;
  }

  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }

  f32(): number {
    return this.view.getFloat32(this.take(4), true);
  }

  f64(): number {
    return this.view.getFloat64(this.take(8), true);
  }

  floats(count: number): Float32Array {
    const at = this.take(4 * count);
    return new Float32Array(this.buffer, at, count);
  }

  finite(count: number): Float32Array {
    const numbers = this.floats(count);
    for (let i = 0; i < count; i++) {
      if (!Number.isFinite(numbers[i])) throw new Unreadable(`a number that is not finite at ${this.offset}`);
    }
    return numbers;
  }

  u16s(count: number): Uint16Array {
    const at = this.take(2 * count);
    this.pad();
    return new Uint16Array(this.buffer, at, count);
  }

  i8s(count: number): Int8Array {
    const at = this.take(count);
    this.pad();
    return new Int8Array(this.buffer, at, count);
  }

  private pad(): void {
    this.take((4 - (this.offset % 4)) % 4);
  }

  room(count: number, bytesEach: number, what: string): void {
    if (count * bytesEach > this.buffer.byteLength - this.offset) {
      throw new Unreadable(`${count} ${what} do not fit into the picture`);
    }
  }
}

/** The numbers of the nodes, from the steps between them: the first step is from 0. */
export function nodesFromSteps(steps: Uint16Array): Uint32Array {
  const nodes = new Uint32Array(steps.length);
  let node = 0;
  for (let i = 0; i < steps.length; i++) {
    node += steps[i];
    nodes[i] = node;
  }
  return nodes;
}

function vector(numbers: Float32Array, at: number): Vector {
  return [numbers[at], numbers[at + 1], numbers[at + 2]];
}

const DOING: readonly Doing[] = ["away", "touches", "holds"];
const PARTNERS: readonly Partner[] = ["device", "obstacle", "object"];

/** Reads a picture; throws `Unreadable` where the bytes are none. Its arrays are views into the buffer. */
export function readPicture(buffer: ArrayBuffer): Picture {
  if (buffer.byteLength < HEADER_BYTES) throw new Unreadable(`${buffer.byteLength} bytes are no picture`);
  const reader = new Reader(buffer, 0);
  if (reader.u32() !== MAGIC) throw new Unreadable("bytes that are no picture");
  const formNumber = reader.u32();
  if (formNumber !== 1 && formNumber !== 2) throw new Unreadable(`a picture of form ${formNumber}`);
  const form = formNumber === 1 ? "modal" : "vertices";
  const generation = reader.u32();
  const step = reader.u32();
  const time = reader.f64();
  if (!Number.isFinite(time)) throw new Unreadable("a time that is not finite");
  const energies = reader.floats(ENERGY_NAMES.length);
  const [objectCount, obstacleCount, deviceCount, contactCount] = [reader.u32(), reader.u32(), reader.u32(), reader.u32()];
  const status = reader.u32();
  reader.u32();

  reader.room(objectCount, 32, "objects");
  const objects: ObjectPicture[] = [];
  for (let i = 0; i < objectCount; i++) {
    const pose = reader.finite(7);
    if (form === "modal") {
      const q = reader.finite(reader.u32());
      const count = reader.u32();
      const unit = reader.f32();
      reader.room(count, 5, "dents");
      const steps = reader.u16s(count);
      const dents = reader.i8s(3 * count);
      if (!Number.isFinite(unit)) throw new Unreadable("a unit of dents that is not finite");
      objects.push({ pose, shape: { form, q, unit, nodes: nodesFromSteps(steps), dents } });
    } else {
      objects.push({ pose, shape: { form, places: reader.finite(3 * reader.u32()) } });
    }
  }

  reader.room(obstacleCount, 28, "obstacles");
  const obstacles: Float32Array[] = [];
  for (let i = 0; i < obstacleCount; i++) obstacles.push(reader.finite(7));

  reader.room(deviceCount, DEVICE_BYTES, "devices");
  const devices: DevicePicture[] = [];
  for (let i = 0; i < deviceCount; i++) {
    const doing = DOING[reader.u32()];
    if (doing === undefined) throw new Unreadable("a device that does nothing known");
    const numbers = reader.finite(9);
    devices.push({ doing, position: vector(numbers, 0), proxy: vector(numbers, 3), force: vector(numbers, 6) });
  }

  reader.room(contactCount, CONTACT_BYTES, "contacts");
  const contacts: ContactPicture[] = [];
  for (let i = 0; i < contactCount; i++) {
    const who = reader.u32();
    const numbers = reader.finite(7);
    const partner = PARTNERS[(who >>> 8) & 0xff];
    if (partner === undefined) throw new Unreadable("a contact with nothing known");
    contacts.push({
      object: who & 0xff,
      partner,
      partnerNumber: who >>> 16,
      point: vector(numbers, 0),
      force: vector(numbers, 3),
      slip: numbers[6],
    });
  }
  const contactsUnsolved = (status & 1) !== 0;
  const contactsLeftOut = (status & 2) !== 0;
  return { form, generation, step, time, energies, objects, obstacles, devices, contacts, contactsUnsolved, contactsLeftOut };
}

/** Splits what `/log/K/frames` answers: pictures, each after its length. */
export function splitFrames(bytes: ArrayBuffer): ArrayBuffer[] {
  const view = new DataView(bytes);
  const frames: ArrayBuffer[] = [];
  let at = 0;
  while (at + 4 <= bytes.byteLength) {
    const length = view.getUint32(at, true);
    if (length > bytes.byteLength - at - 4) throw new Unreadable("frames that break off");
    frames.push(bytes.slice(at + 4, at + 4 + length));
    at += 4 + length;
  }
  return frames;
}
