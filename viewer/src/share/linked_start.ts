// Start from a link: opens its scene, gives it the settings and materials, and hands out the viewpoint. Once.

import type { ClientMessage, Hello, SceneMessage } from "../protocol/messages";
import type { Viewpoint } from "../rendering/orbit_camera";
import { changeTo, physicsOf, SETTING_FIELDS, valuesOf, type SettingName } from "../ui/physics_settings";
import { LONGEST_QUOTE, readLink, sameMaterial } from "./link";

/** Difference of Poisson's ratios by the rounding of a link. */
const RATIO_ROUNDING = 1e-6;

export class LinkedStart {
  private phase: "waiting" | "asked" | "changing" | "over" = "waiting";
  private readonly link;
  private readonly leftOut: string[];
  private offered: Pick<Hello, "scenes" | "records"> = { scenes: [], records: false };
  private viewpoint: Viewpoint | null = null;
  /** Changes that are left to send, one for each start of the scene: a server makes one recording at a time. */
  private changes: ClientMessage[] = [];

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

  /** Notes the scenes that can be opened, and whether materials are recorded. */
  hello(hello: Pick<Hello, "scenes" | "records">): void {
    this.offered = hello;
  }

  /** Gives a scene that has just been loaded the link's settings, or asks for the link's scene. */
  scene(scene: SceneMessage): void {
    if (this.phase === "over") return;
    if (this.phase !== "changing") {
      const { link } = this;
      if (link.scene !== null && link.scene !== scene.id) {
        if (this.phase === "waiting" && this.offered.scenes.some(({ id }) => id === link.scene)) {
          this.phase = "asked";
          this.send({ type: "open_scene", scene: link.scene });
          return;
        }
        this.end();
        this.notify(`The scene ${JSON.stringify(link.scene.slice(0, LONGEST_QUOTE))} of the link is not here; the link was left out.`);
        return;
      }
      this.viewpoint = link.viewpoint;
      const physics = this.physicsChange(scene);
      this.changes = [...(physics === null ? [] : [physics]), ...this.materialChanges(scene)];
      if (this.leftOut.length > 0) this.notify(`Left out of the link: ${this.leftOut.join(" ")}`);
      this.phase = "changing";
    }
    const next = this.changes.shift();
    if (this.changes.length === 0) this.end();
    if (next !== undefined) this.send(next);
  }

  private physicsChange(scene: SceneMessage): ClientMessage | null {
    const { values } = this.link;
    const has = valuesOf(physicsOf(scene));
    for (const name of Object.keys(values) as SettingName[]) {
      if (has[name] === undefined) this.leftOut.push(`${SETTING_FIELDS[name].label}: this scene has none.`);
    }
    return changeTo(values, scene);
  }

  private materialChanges({ objects }: SceneMessage): ClientMessage[] {
    return this.link.materials.flatMap(({ object: name, ...material }): ClientMessage[] => {
      const object = objects.findIndex((candidate) => candidate.name === name);
      const now = objects[object]?.material ?? null;
      if (now === null || !objects[object].recordable) {
        this.leftOut.push(`Material of ${JSON.stringify(name.slice(0, LONGEST_QUOTE))}: ${object < 0 ? "this scene has no such object" : "it cannot be changed here"}.`);
        return [];
      }
      const sameRatio = Math.abs(material.poisson - now.poisson) < RATIO_ROUNDING;
      const wanted = this.offered.records && !sameRatio ? material : { ...material, poisson: now.poisson };
      if (!this.offered.records && !sameRatio) this.leftOut.push(`Poisson's ratio of ${JSON.stringify(name)}: another one needs a recording.`);
      return sameMaterial(wanted, now) ? [] : [{ type: "set_material", object, ...wanted }];
    });
  }

  /** Viewpoint of the link for that scene; null from the second call on. */
  takeViewpoint(): Viewpoint | null {
    const { viewpoint } = this;
    this.viewpoint = null;
    return viewpoint;
  }

  /** Leaves the rest out, as a change was refused. */
  refused(): void {
    if (this.phase === "changing") this.end();
  }

  /** Ends it: the user has chosen a scene. */
  end(): void {
    if (this.phase === "over") return;
    this.phase = "over";
    this.onEnd();
  }
}
