// What the page is opened for: a live scene, logs, or pictures for `palpate render`.

import type { Granted, Hello, Progress, SceneMessage, Status } from "./protocol/messages";
import type { Picture } from "./protocol/picture";

export interface Kind {
  hello(hello: Hello): void;
  scene(scene: SceneMessage): void;
  pictureCame(picture: Picture): void;
  status(status: Status): void;
  granted(granted: Granted): void;
  progress(progress: Progress): void;
  /** The server has gone. */
  lost(): void;
  /** The page is hidden, or seen again. */
  visibility(): void;
  /** The graphics card has forgotten everything. */
  reload(): void;
  /** Once per animation frame [ms]. */
  frame(now: number): void;
  /** Light or dark has changed. */
  dress(): void;
  /** True if the key meant something. */
  key(event: KeyboardEvent): boolean;
}
