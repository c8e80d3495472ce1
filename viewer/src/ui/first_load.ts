// Progress of the first downloads of a page without a server, until its scene says hello.

import { percent, withUnit } from "../format";
import { element } from "./elements";

/** Text of a download: bytes that have come, of how many where it is known. */
export function downloadText(what: string, bytes: number, of: number | null): string {
  const done = withUnit(bytes, "B");
  return of === null ? `Loading ${what}: ${done}` : `Loading ${what}: ${done} of ${withUnit(of, "B")}, ${percent(bytes / of)}`;
}

/** Text and bar in the place of the scene. */
export class FirstLoad {
  private readonly text = element("span");
  private readonly bar = element("progress", { attributes: { max: "1", "aria-label": "Share that is loaded" } });
  readonly box = element("div", { class: "loading first", role: "status" }, this.text, this.bar);

  constructor() {
    this.text.textContent = "Loading the simulation …";
    this.bar.removeAttribute("value");
  }

  show(what: string, bytes: number, of: number | null): void {
    this.text.textContent = downloadText(what, bytes, of);
    if (of === null) this.bar.removeAttribute("value");
    else this.bar.value = bytes / of;
  }

  end(): void {
    this.box.remove();
  }
}
