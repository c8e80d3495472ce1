// Haply Inverse3, through the WebSocket of Haply's Inverse Service on this computer: on connection an inventory, then a state for each command.
//
// The service has x to the right, y forward and z up; the device frame has y up and z towards the user, so that it is (x, z, −y).

import { reasonOf } from "./posting";

/** Vector [m] or [N]. */
export type Vector = readonly [number, number, number];

/** Reading of the device: position [m, device frame], and pressed buttons, one bit each. */
export interface Reading {
  position: Vector;
  buttons: number;
}

interface Xyz {
  x: number;
  y: number;
  z: number;
}

interface Grip {
  state?: { button?: boolean; buttons?: { a?: boolean; b?: boolean; c?: boolean } };
}

/** Message of the service, as far as it is used. */
export interface ServiceState {
  inverse3?: { device_id: string; config?: { type?: string; basis?: { permutation: string } }; state?: { cursor_position?: Xyz } }[];
  verse_grip?: Grip[];
  wireless_verse_grip?: Grip[];
}

/** Name of this program in the vendor's tools. */
const PROFILE = "palpate:page";
/** Shortest interval between two commands: while the scene does not step, states would come by the ten thousand a second. */
const PERIOD_MS = 0.5;
const RETRY_MS = 1000;
const SILENCE_MS = 1000;
/** Time for the scene to answer a reading. Its own safety takes force away after 20 ms; this is for a scene that has hung. */
const ANSWER_MS = 50;
/** Interval of commands without force while the scene hangs. */
const HELD_BACK_MS = 20;
const NO_FORCE: Vector = [0, 0, 0];

/** Device of an inventory, by its identifier; an error says what is missing. */
export function deviceOf({ inverse3 }: ServiceState): string {
  const device = inverse3?.[0];
  if (device === undefined) throw new Error("the Inverse Service has no Inverse3: connect one, and look at Haply Hub");
  const basis = device.config?.basis?.permutation ?? "XYZ";
  if (basis !== "XYZ") throw new Error(`the service turns its axes to ${basis}: set its basis to XYZ in Haply Hub`);
  return device.device_id;
}

/** Reading of a device, and of the grip with the same index, a wireless one first; null where the message has none. */
export function readingOf(state: ServiceState, device: string): Reading | null {
  const at = state.inverse3?.findIndex(({ device_id }) => device_id === device) ?? -1;
  const cursor = state.inverse3?.[at]?.state?.cursor_position;
  if (cursor === undefined || ![cursor.x, cursor.y, cursor.z].every(Number.isFinite)) return null;
  const grip = (state.wireless_verse_grip?.[at] ?? state.verse_grip?.[at])?.state;
  const { a, b, c } = grip?.buttons ?? {};
  const bits = [a === true || grip?.button === true, b === true, c === true];
  return { position: [cursor.x, cursor.z, -cursor.y], buttons: bits.reduce((sum, pressed, bit) => sum + (pressed ? 1 << bit : 0), 0) };
}

/** Command of a force [N, device frame]. Only the first configures the session. */
export function commandOf(device: string, [x, y, z]: Vector, isFirst: boolean): string {
  const session = isFirst ? { session: { configure: { profile: { name: PROFILE } } } } : {};
  return JSON.stringify({ ...session, inverse3: [{ device_id: device, commands: { set_cursor_force: { vector: { x, y: -z, z: y } } } }] });
}

/** Callbacks of a connection. */
export interface HaplyListener {
  /** A device is there. */
  connected(device: string): void;
  /** Reading of the device, or none that could be read, with its number: [`HaplyConnection.answer`] takes the force for it. */
  read(reading: Reading | null, number: number): void;
  /** The connection is lost, and is tried again. */
  lost(reason: string): void;
}

/**
 * Connection to the service, which is tried again until it is closed. Each reading waits for its answer; without one in time the device is commanded
 * no force until the scene answers again.
 */
export class HaplyConnection {
  private socket: WebSocket | null = null;
  private device: string | null = null;
  private isFirst = true;
  /** Time of the last command [ms, performance.now]. */
  private sentAt = Number.NEGATIVE_INFINITY;
  private timer: ReturnType<typeof setTimeout> | undefined;
  /** Number of readings so far, of the one that the scene has not answered, and whether it is too late for that. */
  private readings = 0;
  private awaited: number | null = null;
  private isLate = false;
  private answerTimer: ReturnType<typeof setTimeout> | undefined;
  private heldBackTimer: ReturnType<typeof setTimeout> | undefined;
  private isClosed = false;

  constructor(
    private readonly address: string,
    private readonly listener: HaplyListener,
  ) {
    this.connect();
  }

  /** Answers the last reading with a force [N, device frame]. The force for one that is too old, or of a lost connection, is not commanded. */
  answer(number: number, force: Vector): void {
    if (number !== this.awaited) return;
    clearTimeout(this.answerTimer);
    const isLate = this.isLate;
    this.awaited = null;
    this.isLate = false;
    // The state after the next command asks the scene again.
    if (!isLate) this.command(force);
  }

  /** Commands zero force and closes the connection, which ends the session. */
  close(): void {
    this.isClosed = true;
    clearTimeout(this.timer);
    this.forgetReading();
    this.command(NO_FORCE);
    this.socket?.close();
  }

  private connect(): void {
    this.device = null;
    this.isFirst = true;
    const socket = new WebSocket(this.address);
    this.socket = socket;
    socket.onmessage = ({ data }: MessageEvent<unknown>) => {
      if (socket !== this.socket) return;
      this.watch();
      if (performance.now() - this.sentAt < PERIOD_MS) setTimeout(() => this.receive(socket, data), 1);
      else this.receive(socket, data);
    };
    socket.onclose = () => {
      if (socket === this.socket) this.lose(this.device === null ? `no Inverse Service answers at ${this.address}: start Haply Hub` : "the Inverse Service is gone");
    };
    this.watch();
  }

  /** Answers a message with a command. One that cannot be read is no reading; an inventory without a device is a failure. */
  private receive(socket: WebSocket, data: unknown): void {
    if (socket !== this.socket) return;
    let reading: Reading | null = null;
    try {
      const state = JSON.parse(String(data)) as ServiceState;
      if (this.device === null) {
        this.device = deviceOf(state);
        this.listener.connected(this.device);
      }
      reading = readingOf(state, this.device);
    } catch (error) {
      if (this.device === null) this.lose(reasonOf(error));
    }
    if (this.device === null) return;
    if (this.isLate) {
      clearTimeout(this.heldBackTimer);
      this.heldBackTimer = setTimeout(() => this.command(NO_FORCE), HELD_BACK_MS);
    }
    if (this.awaited !== null) return;
    this.readings += 1;
    this.awaited = this.readings;
    this.answerTimer = setTimeout(() => {
      this.isLate = true;
      this.command(NO_FORCE);
    }, ANSWER_MS);
    this.listener.read(reading, this.awaited);
  }

  private forgetReading(): void {
    clearTimeout(this.answerTimer);
    clearTimeout(this.heldBackTimer);
    this.awaited = null;
    this.isLate = false;
  }

  private command(force: Vector): void {
    const { socket, device } = this;
    if (device === null || socket?.readyState !== WebSocket.OPEN) return;
    socket.send(commandOf(device, force, this.isFirst));
    this.isFirst = false;
    this.sentAt = performance.now();
  }

  /** Gives a service up that falls silent. */
  private watch(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.lose("the Inverse Service does not answer"), SILENCE_MS);
  }

  private lose(reason: string): void {
    clearTimeout(this.timer);
    this.forgetReading();
    const { socket } = this;
    this.socket = null;
    socket?.close();
    if (this.isClosed) return;
    this.listener.lost(reason);
    this.timer = setTimeout(() => this.connect(), RETRY_MS);
  }
}
