// Scenes: read from TOML, or built of objects whose fields are the keys of a scene file.

import { addressBeside, addressOf, readFile } from "./files.js";
import { alive, Freer, library, load } from "./library.js";
import { namedFiles, withParts } from "./parts.js";
import { Recording } from "./recording.js";
import { toToml, type TomlValue } from "./toml.js";

/** Three numbers: position [m], velocity, force, or normal. */
export type Vector = readonly [number, number, number];

/** Quaternion w, x, y, z. */
export type Quaternion = readonly [number, number, number, number];

/** Motion: rows of t [s], x, y, z [m], optionally qw, qx, qy, qz, linear in between. */
export interface MotionPath {
  rows: readonly (readonly number[])[];
  /** Whether it starts again at its end. */
  repeat?: boolean;
}

/** Elastic body: `[[object]]`. */
export interface SceneObject {
  name: string;
  recording: Recording;
  /** Centre of mass at the start [m]. */
  position?: Vector;
  orientation?: Quaternion;
  /** Velocity at the start [m/s]. */
  velocity?: Vector;
  /** Angular velocity at the start [rad/s]. */
  angular_velocity?: Vector;
  /** Coulomb's coefficient against other objects [1]. */
  friction?: number;
}

/** Hand that holds a point, tip that touches, or prescribed force: `[[device]]`. */
export interface SceneDevice {
  name: string;
  mode: "touch" | "held" | "force";
  /** Point that is held, or that the force acts on [m, body frame]. */
  attach?: { object: string; point: Vector };
  /** Motion; without it {@link Simulation.positions} says where it is. */
  path?: MotionPath;
  /** Radius of the tip [m]. */
  tip_radius?: number;
  /** Radius of the area that a force is spread over [m]. */
  patch_radius?: number;
  friction?: number;
  /** Spring and damper between hand and tip [N/m, N·s/m]. */
  coupling?: { stiffness: number; damping?: number };
}

/** Floor, wall or table: `[[plane]]`. */
export interface ScenePlane {
  name?: string;
  /** Point on it [m]. */
  point?: Vector;
  /** Normal out of the solid side. */
  normal: Vector;
  path?: MotionPath;
  friction?: number;
}

/** Rigid body: `[[obstacle]]`, of one of the shapes. */
export interface SceneObstacle {
  name?: string;
  sphere?: { radius: number };
  box?: { half_extents: Vector };
  /** About the y axis of its frame. */
  capsule?: { radius: number; half_length: number };
  position?: Vector;
  orientation?: Quaternion;
  path?: MotionPath;
  friction?: number;
}

/** Parts and settings of a scene. */
export interface SceneParts {
  objects: readonly SceneObject[];
  devices?: readonly SceneDevice[];
  planes?: readonly ScenePlane[];
  obstacles?: readonly SceneObstacle[];
  /** Gravity [m/s²]; none without it. */
  gravity?: Vector;
  /** Time step [s], 0.001 without it. */
  step?: number;
}

/** Description of a scene that the module sends. */
interface Description {
  step: number;
  duration: number;
  objectNames: string[];
  deviceNames: string[];
  obstacleNames: string[];
  clampNames: string[];
  warnings: string[];
}

const freer = new Freer((handle) => library().exports.scene_free(handle));

/** Scene: recordings among planes, obstacles and devices. */
export class Scene {
  private address: number;
  /** Scene as TOML. */
  readonly toml: string;
  /** Recordings of the objects, in the order of {@link objectNames}. */
  readonly recordings: readonly Recording[];
  private readonly description: Description;

  /** Scene of parts, after {@link load}. */
  constructor(parts: SceneParts) {
    const files = new Files();
    this.toml = textOf(parts, files);
    this.recordings = parts.objects.map((object) => object.recording);
    [this.address, this.description] = read(this.toml, files);
    freer.watch(this, this.address);
  }

  /** Loads a scene file (`.toml`) from an address, or, in Node.js, from a path, with the recordings and paths that it names beside it. */
  static async load(url: string | URL): Promise<Scene> {
    const address = addressOf(url);
    const text = async (file: URL) => new TextDecoder().decode(await readFile(file));
    const [toml] = await Promise.all([text(address), load()]);
    const files = new Files();
    await Promise.all(
      [...new Set(namedFiles(library(), toml))].map(async (name) => {
        const file = addressBeside(address, name);
        if (name.endsWith(".csv")) files.paths.set(name, await text(file));
        else files.recordings.set(name, Recording.fromBytes(await readFile(file)));
      }),
    );
    return Scene.fromFiles(toml, files);
  }

  /** Scene of a text and of the files that it names, after {@link load}. */
  static fromToml(toml: string, recordings: Readonly<Record<string, Recording>>, paths: Readonly<Record<string, string>> = {}): Scene {
    const files = new Files();
    for (const [name, recording] of Object.entries(recordings)) files.recordings.set(name, recording);
    for (const [name, path] of Object.entries(paths)) files.paths.set(name, path);
    return Scene.fromFiles(toml, files);
  }

  private static fromFiles(toml: string, files: Files): Scene {
    const [handle, description] = read(toml, files);
    const scene: Scene = Object.create(Scene.prototype) as Scene;
    // The recordings of the objects come first, in their order.
    const recordings = namedFiles(library(), toml).slice(0, description.objectNames.length);
    Object.assign(scene, { address: handle, toml, recordings: recordings.map((name) => files.recordings.get(name)), description });
    freer.watch(scene, handle);
    return scene;
  }

  /** @internal */
  get handle(): number {
    return alive(this.address, "scene");
  }

  /** Time step [s]. */
  get step(): number {
    return this.description.step;
  }

  /** Last time of its paths [s]; 0 without paths. */
  get duration(): number {
    return this.description.duration;
  }

  get objectNames(): readonly string[] {
    return this.description.objectNames;
  }

  get deviceNames(): readonly string[] {
    return this.description.deviceNames;
  }

  get obstacleNames(): readonly string[] {
    return this.description.obstacleNames;
  }

  get clampNames(): readonly string[] {
    return this.description.clampNames;
  }

  /** Warnings about the scene. */
  get warnings(): readonly string[] {
    return this.description.warnings;
  }

  /** Frees its memory now; otherwise it is freed when nobody has it any more. */
  dispose(): void {
    freer.dispose(this, this.address);
    this.address = 0;
  }
}

/** Files of a scene, by the names that its text gives them. */
class Files {
  readonly recordings = new Map<string, Recording>();
  readonly paths = new Map<string, string>();
}

/** Text of parts, whose recordings and paths become files. */
function textOf(parts: SceneParts, files: Files): string {
  const { objects, devices, planes, obstacles, gravity, step } = parts;
  const path = (motion: MotionPath | undefined): TomlValue | undefined => {
    if (motion === undefined) return undefined;
    const file = `path-${files.paths.size + 1}.csv`;
    const columns = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"].slice(0, motion.rows[0]?.length ?? 4);
    files.paths.set(file, [columns.join(","), ...motion.rows.map((row) => row.join(","))].join("\n"));
    return { file, repeat: motion.repeat ?? false };
  };
  const withPath = <P extends { path?: MotionPath }>(part: P) => ({ ...part, path: path(part.path) }) as unknown as Record<string, TomlValue | undefined>;
  const object = (part: SceneObject, at: number) => {
    const recording = `recording-${at + 1}.palp`;
    files.recordings.set(recording, part.recording);
    return { ...part, recording } as unknown as Record<string, TomlValue | undefined>;
  };
  return toToml({
    gravity,
    step,
    object: objects.map(object),
    device: devices?.map(withPath),
    plane: planes?.map(withPath),
    obstacle: obstacles?.map(withPath),
  });
}

/** Handle and description of a scene. */
function read(toml: string, files: Files): [number, Description] {
  const instance = library();
  const recordings = new Map(Array.from(files.recordings, ([name, recording]) => [name, recording.handle]));
  let handle = 0;
  const description = withParts(instance, recordings, files.paths, (parts) =>
    instance.withBytes(toml, (at, length) => instance.described<Description>((exports) => (handle = exports.scene_read(at, length, parts)))),
  );
  return [handle, description];
}
