// Messages between the page and the worker that runs its scene.

/** Place of a haptic device in a scene: that of its first reading [m, world], orientation of its frame (w, x, y, z), metres per metre. */
export interface HaplyPlace {
  start: readonly [number, number, number];
  orientation: readonly [number, number, number, number];
  scale: number;
}

/** Message to the worker. */
export type ToWorker =
  /** Start: address of the folder of `palpate.wasm` and `scenes/`, and the scene to open, or the first. */
  | { kind: "start"; base: string; scene: string | null }
  /** Start of a worker that plays logs, those that the browser keeps if none are given. */
  | { kind: "start_logs"; base: string; files: readonly File[] | null }
  /** Recording to open as a scene, with the name of its file and what is said about it. */
  | { kind: "recording"; name: string; bytes: ArrayBuffer; about: string }
  /** Begin and end of a record for a log. */
  | { kind: "begin_log" }
  | { kind: "end_log" }
  /** Haply device of the Inverse Service at an address, or none; and where it is in the scene. */
  | { kind: "haply"; address: string | null }
  | { kind: "haply_place"; place: HaplyPlace }
  /** Message of the viewer protocol, as JSON. */
  | { kind: "message"; text: string }
  /** A frame was shown. */
  | { kind: "shown" }
  /** Request for data, by the path that the server would answer. */
  | { kind: "data"; request: number; path: string };

/** Message to the page. */
export type FromWorker =
  /** Progress of a first download: bytes that have come, of how many where it is known. */
  | { kind: "loading"; what: string; bytes: number; of: number | null }
  | { kind: "message"; text: string }
  | { kind: "frame"; frame: ArrayBuffer }
  /** Block of sound. */
  | { kind: "sound"; block: ArrayBuffer }
  /** Log of a record, or the reason that there is none. */
  | { kind: "log"; steps: number; bytes: ArrayBuffer }
  | { kind: "no_log"; reason: string }
  /** State of the Haply device, for its user. */
  | { kind: "haply"; state: "connected" | "lost"; text: string }
  /** Answer to a request; null if there is no such data. */
  | { kind: "data"; request: number; bytes: ArrayBuffer | null }
  /** The scene has ended. */
  | { kind: "failed"; reason: string };
