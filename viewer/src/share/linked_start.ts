// Start from a link: opens its scene, gives it the settings, and hands out the viewpoint. Once.

import type { ClientMessage, SceneMessage, SceneSummary } from "../protocol/messages";
import type { Viewpoint } from "../rendering/orbit_camera";
import { changeTo, physicsOf, SETTING_FIELDS, valuesOf, type SettingName } from "../ui/physics_settings";
import { LONGEST_QUOTE, readLink } from "./link";

export class LinkedStart {
  private phase: "waiting" | "asked" | "over" = "waiting";
  private readonly link;
  private readonly leftOut: string[];
  private scenes: readonly SceneSummary[] = [];
  private viewpoint: Viewpoint | null = null;

  /** `query` of the page's address; `notify` gets a sentence on what was left out, `onEnd` is called when nothing is left to do. */
  constructor(
    query: string,
    private readonly send: (message: ClientMessage) => void,
    private readonly notify: (text: string) => void,
    private readonly onEnd: () => void,
  ) {
    const { link, leftOut } = readLink(query);
    this.link = link;
    this.leftOut = leftOut;
  }

  /** Notes the scenes that can be opened. */
  hello(scenes: readonly SceneSummary[]): void {
    this.scenes = scenes;
  }

  /** Gives a scene that has just been loaded the link's settings, or asks for the link's scene. */
  scene(scene: SceneMessage): void {
    if (this.phase === "over") return;
    const { link, leftOut } = this;
    if (link.scene !== null && link.scene !== scene.id) {
      if (this.phase === "waiting" && this.scenes.some(({ id }) => id === link.scene)) {
        this.phase = "asked";
        this.send({ type: "open_scene", scene: link.scene });
        return;
      }
      this.end();
      this.notify(`The scene ${JSON.stringify(link.scene.slice(0, LONGEST_QUOTE))} of the link is not here; the link was left out.`);
      return;
    }
    const now = physicsOf(scene);
    const has = valuesOf(now);
    for (const name of Object.keys(link.values) as SettingName[]) {
      if (has[name] === undefined) leftOut.push(`${SETTING_FIELDS[name].label}: this scene has none.`);
    }
    this.viewpoint = link.viewpoint;
    this.end();
    const change = changeTo(link.values, now);
    if (change !== null) this.send(change);
    if (leftOut.length > 0) this.notify(`Left out of the link: ${leftOut.join(" ")}`);
  }

  /** Viewpoint of the link for that scene; null from the second call on. */
  takeViewpoint(): Viewpoint | null {
    const { viewpoint } = this;
    this.viewpoint = null;
    return viewpoint;
  }

  /** Ends it: the user has chosen a scene. */
  end(): void {
    if (this.phase === "over") return;
    this.phase = "over";
    this.onEnd();
  }
}
