// Physics settings: gravity, friction, virtual coupling, step. Changes apply at once to the current state.

import type { SceneMessage, ClientMessage } from "../protocol/messages";
import type { Vector } from "../protocol/frame";
import { downOf } from "../rendering/gravity_direction";
import { physicsOf, SETTING_FIELDS, type SettingField } from "./physics_settings";
import { section } from "./elements";
import { numberField, type NumberField } from "./number_field";

export class PhysicsPanel {
  readonly section: HTMLElement;
  private direction: Vector = [0, -1, 0];
  private scene: SceneMessage | null = null;
  private readonly gravity;
  private readonly step;
  private readonly friction;
  private readonly stiffness;
  private readonly damping;
  /** Field whose change the server has not answered yet. */
  private unanswered: NumberField | null = null;

  constructor(private readonly send: (message: ClientMessage) => void) {
    this.gravity = this.field(SETTING_FIELDS.gravity, "Gravitational acceleration; 9.81 on Earth", (magnitude) => ({
      gravity: this.direction.map((x) => x * magnitude) as unknown as Vector,
    }));
    this.friction = this.field(SETTING_FIELDS.friction, "Coulomb friction coefficient of all contacts: 0 is frictionless, 1 is like rubber", (friction) => ({ friction }));
    const coupling = () => ({ coupling: { stiffness: this.stiffness.value, damping: this.damping.value } });
    this.stiffness = this.field(SETTING_FIELDS.stiffness, "Spring between your hand (interface point) and the proxy: a stiffer coupling pushes harder", coupling);
    this.damping = this.field(SETTING_FIELDS.damping, "Damper parallel to the coupling spring", coupling);
    this.step = this.field(SETTING_FIELDS.step, "Step of the simulation; 1 ms is 1000 steps per second", (step) => ({ step: step / 1000 }));
    this.section = section("Physics", true, this.gravity.row, this.friction.row, this.stiffness.row, this.damping.row, this.step.row);
  }

  private field({ label, unit, bounds }: SettingField, tooltip: string, change: (value: number) => Omit<Extract<ClientMessage, { type: "set_physics" }>, "type">): NumberField {
    const field = numberField(label, unit, tooltip, bounds, (value) => {
      this.unanswered = field;
      this.send({ type: "set_physics", ...change(value) });
    });
    return field;
  }

  /** Takes back a change that the server refused. */
  refused(text: string): void {
    const field = this.unanswered;
    if (field === null) return;
    this.unanswered = null;
    if (this.scene !== null) this.show(this.scene);
    field.refuse(text);
  }

  /** Shows the settings of a scene. */
  update(scene: SceneMessage): void {
    this.scene = scene;
    this.unanswered = null;
    this.show(scene);
  }

  private show(scene: SceneMessage): void {
    this.direction = downOf(scene);
    this.gravity.value = Math.hypot(...scene.gravity);
    this.step.value = 1000 * scene.step_s;
    const { friction, coupling } = physicsOf(scene);
    if (friction !== null) this.friction.value = friction;
    for (const field of [this.stiffness, this.damping]) field.row.hidden = coupling === null;
    if (coupling !== null) {
      this.stiffness.value = coupling.stiffness;
      this.damping.value = coupling.damping;
    }
  }
}
