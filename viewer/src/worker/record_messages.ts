// Messages between the page and the worker that records a mesh.

/** Mesh, as it is to be recorded. */
export interface MeshRecording {
  /** Name of the file. */
  name: string;
  /** Metres per unit of the file. */
  scale: number;
  /** Young's modulus [Pa], Poisson's ratio, density [kg/m³]. */
  young: number;
  poisson: number;
  density: number;
  modes: number;
  /** About how many nodes a surface is filled with. */
  nodes: number;
}

/** Message to the worker, its only one. */
export interface ToRecorder {
  /** Address of the folder of `palpate-record.wasm`. */
  base: string;
  mesh: MeshRecording;
  file: File;
}

/** Message to the page. */
export type FromRecorder =
  | { kind: "progress"; phase: string; fraction: number | null }
  /** Recording, and what was repaired, in sentences. */
  | { kind: "recorded"; recording: ArrayBuffer; repairs: string[] }
  | { kind: "failed"; reason: string };
