// Interface of the page modes: live scene, log playback, image rendering for `palpate render`.

import type { DeviceAssigned, Hello, Progress, SceneMessage, Status } from "../protocol/messages";
import type { Frame } from "../protocol/frame";
import type { SoundBlock } from "../sound/sound_block";

/** Handlers of server messages and browser events. */
export interface PageMode {
  hello(hello: Hello): void;
  scene(scene: SceneMessage): void;
  frameReceived(frame: Frame): void;
  soundReceived?(block: SoundBlock): void;
  status(status: Status): void;
  assigned(message: DeviceAssigned): void;
  progress(progress: Progress): void;
  /** The connection to the server is lost. */
  connectionLost(): void;
  /** The page was hidden or shown. */
  visibilityChanged(): void;
  /** The WebGL context was restored and holds no data. */
  contextRestored(): void;
  /** Called once per animation frame with the time [ms]. */
  animate(now: number): void;
  /** The light or dark theme has changed. */
  applyTheme(): void;
  /** Returns true if the key was handled. */
  handleKey(event: KeyboardEvent): boolean;
}
