// Binary frames: the state of a scene at one step (docs/viewer-protocol.md, "Frames").

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

/** Three components x, y, z. */
export type Vector = readonly [number, number, number];

/**
 * Modal coordinates q [m] and residual displacements: node `residualNodes[i]` is displaced by
 * `residuals[3i…3i+2]·residualUnit` [m, body].
 */
export interface ModalShape {
  format: "modal";
  q: Float32Array;
  residualUnit: number;
  residualNodes: Uint32Array;
  residuals: Int8Array;
}

/** Positions of all nodes [m, body]. */
export interface VertexShape {
  format: "vertices";
  positions: Float32Array;
}

/** Pose and shape of an object. */
export interface ObjectFrame {
  /** Position of the centre of mass [m] and orientation x, y, z, w (world from body). */
  pose: Float32Array;
  shape: ModalShape | VertexShape;
}

export type DeviceMode = "inactive" | "touch" | "held";

/** State of a device slot. */
export interface DeviceFrame {
  mode: DeviceMode;
  /** Interface point [m, world]. */
  position: Vector;
  /** Proxy (god-object) position [m, world]. */
  proxy: Vector;
  /** Force on the hand [N, world]. */
  force: Vector;
}

export type ColliderKind = "device" | "obstacle" | "object";

/** Contact that carries force. */
export interface ContactFrame {
  object: number;
  collider: ColliderKind;
  colliderIndex: number;
  /** Contact point [m, world]. */
  point: Vector;
  /** Force on the object [N, world]. */
  force: Vector;
  /** Slip speed [m/s]. */
  slip: number;
}

/** Decoded frame. */
export interface Frame {
  format: "modal" | "vertices";
  generation: number;
  step: number;
  /** Simulation time [s]. */
  time: number;
  /** Energies [J] in the order of `ENERGY_NAMES`. */
  energies: Float32Array;
  objects: ObjectFrame[];
  /** Obstacle poses: position [m], orientation x, y, z, w. */
  obstacles: Float32Array[];
  devices: DeviceFrame[];
  contacts: ContactFrame[];
  contactsUnsolved: boolean;
  contactsDropped: boolean;
}

/** Bytes that do not follow the protocol. */
export class DecodeError extends Error {}

/** Sequential little-endian reader with bounds checks. */
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
      throw new DecodeError(`${bytes} bytes at ${at}, but the frame has ${this.buffer.byteLength}`);
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

  finiteFloats(count: number): Float32Array {
    const numbers = this.floats(count);
    for (let i = 0; i < count; i++) {
      if (!Number.isFinite(numbers[i])) throw new DecodeError(`a number that is not finite at ${this.offset}`);
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

  requireRoom(count: number, bytesEach: number, what: string): void {
    if (count * bytesEach > this.buffer.byteLength - this.offset) {
      throw new DecodeError(`${count} ${what} do not fit into the frame`);
    }
  }
}

/** Node indices from their differences; the first difference is from 0. */
export function nodesFromDifferences(differences: Uint16Array): Uint32Array {
  const nodes = new Uint32Array(differences.length);
  let node = 0;
  for (let i = 0; i < differences.length; i++) {
    node += differences[i];
    nodes[i] = node;
  }
  return nodes;
}

function vector(numbers: Float32Array, at: number): Vector {
  return [numbers[at], numbers[at + 1], numbers[at + 2]];
}

const DEVICE_MODES: readonly DeviceMode[] = ["inactive", "touch", "held"];
const COLLIDER_KINDS: readonly ColliderKind[] = ["device", "obstacle", "object"];

/** Decodes a frame; throws `DecodeError`. The arrays are views into the buffer. */
export function decodeFrame(buffer: ArrayBuffer): Frame {
  if (buffer.byteLength < HEADER_BYTES) throw new DecodeError(`${buffer.byteLength} bytes are no frame`);
  const reader = new Reader(buffer, 0);
  if (reader.u32() !== MAGIC) throw new DecodeError("bytes that are no frame");
  const formatNumber = reader.u32();
  if (formatNumber !== 1 && formatNumber !== 2) throw new DecodeError(`a frame of format ${formatNumber}`);
  const format = formatNumber === 1 ? "modal" : "vertices";
  const generation = reader.u32();
  const step = reader.u32();
  const time = reader.f64();
  if (!Number.isFinite(time)) throw new DecodeError("a time that is not finite");
  const energies = reader.floats(ENERGY_NAMES.length);
  const [objectCount, obstacleCount, deviceCount, contactCount] = [reader.u32(), reader.u32(), reader.u32(), reader.u32()];
  const status = reader.u32();
  reader.u32();

  reader.requireRoom(objectCount, 32, "objects");
  const objects: ObjectFrame[] = [];
  for (let i = 0; i < objectCount; i++) {
    const pose = reader.finiteFloats(7);
    if (format === "modal") {
      const q = reader.finiteFloats(reader.u32());
      const count = reader.u32();
      const residualUnit = reader.f32();
      reader.requireRoom(count, 5, "residual displacements");
      const differences = reader.u16s(count);
      const residuals = reader.i8s(3 * count);
      if (!Number.isFinite(residualUnit)) throw new DecodeError("a residual unit that is not finite");
      objects.push({ pose, shape: { format, q, residualUnit, residualNodes: nodesFromDifferences(differences), residuals } });
    } else {
      objects.push({ pose, shape: { format, positions: reader.finiteFloats(3 * reader.u32()) } });
    }
  }

  reader.requireRoom(obstacleCount, 28, "obstacles");
  const obstacles: Float32Array[] = [];
  for (let i = 0; i < obstacleCount; i++) obstacles.push(reader.finiteFloats(7));

  reader.requireRoom(deviceCount, DEVICE_BYTES, "devices");
  const devices: DeviceFrame[] = [];
  for (let i = 0; i < deviceCount; i++) {
    const mode = DEVICE_MODES[reader.u32()];
    if (mode === undefined) throw new DecodeError("a device of unknown mode");
    const numbers = reader.finiteFloats(9);
    devices.push({ mode, position: vector(numbers, 0), proxy: vector(numbers, 3), force: vector(numbers, 6) });
  }

  reader.requireRoom(contactCount, CONTACT_BYTES, "contacts");
  const contacts: ContactFrame[] = [];
  for (let i = 0; i < contactCount; i++) {
    const packed = reader.u32();
    const numbers = reader.finiteFloats(7);
    const collider = COLLIDER_KINDS[packed & 3];
    if (collider === undefined) throw new DecodeError("a contact with an unknown collider");
    contacts.push({
      object: (packed >>> 2) & 0x7fff,
      collider,
      colliderIndex: packed >>> 17,
      point: vector(numbers, 0),
      force: vector(numbers, 3),
      slip: numbers[6],
    });
  }
  const contactsUnsolved = (status & 1) !== 0;
  const contactsDropped = (status & 2) !== 0;
  return { format, generation, step, time, energies, objects, obstacles, devices, contacts, contactsUnsolved, contactsDropped };
}

/** Splits the response of `/log/K/frames` into length-prefixed frames. */
export function splitFrames(bytes: ArrayBuffer): ArrayBuffer[] {
  const view = new DataView(bytes);
  const frames: ArrayBuffer[] = [];
  let at = 0;
  while (at + 4 <= bytes.byteLength) {
    const length = view.getUint32(at, true);
    if (length > bytes.byteLength - at - 4) throw new DecodeError("truncated frames");
    frames.push(bytes.slice(at + 4, at + 4 + length));
    at += 4 + length;
  }
  return frames;
}
