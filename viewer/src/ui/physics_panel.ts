// Physics settings: gravity, friction, virtual coupling, step. Changes apply at once to the current state.

import type { SceneMessage, ClientMessage } from "../protocol/messages";
import type { Vector } from "../protocol/frame";
import { physicsOf } from "./physics_settings";
import { section } from "./elements";
import { numberField, type Bounds, type NumberField } from "./number_field";

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
    this.gravity = this.field("Gravity", "m/s²", "Gravitational acceleration; 9.81 on Earth", { min: 0, max: 100, step: "any" }, (magnitude) => ({
      gravity: this.direction.map((x) => x * magnitude) as unknown as Vector,
    }));
    this.friction = this.field("Friction", "", "Coulomb friction coefficient of all contacts: 0 is frictionless, 1 is like rubber", { min: 0, max: 5, step: "any" }, (friction) => ({ friction }));
    const coupling = () => ({ coupling: { stiffness: this.stiffness.value, damping: this.damping.value } });
    this.stiffness = this.field("Coupling stiffness", "N/m", "Spring between your hand (interface point) and the proxy: a stiffer coupling pushes harder", { min: 0.1, max: 1e5, step: "any" }, coupling);
    this.damping = this.field("Coupling damping", "N·s/m", "Damper parallel to the coupling spring", { min: 0, max: 1e4, step: "any" }, coupling);
    // The server's range.
    this.step = this.field("Time step", "ms", "Step of the simulation; 1 ms is 1000 steps per second", { min: 0.2, max: 10, step: "any" }, (step) => ({ step: step / 1000 }));
    this.section = section("Physics", true, this.gravity.row, this.friction.row, this.stiffness.row, this.damping.row, this.step.row);
  }

  private field(label: string, unit: string, tooltip: string, bounds: Bounds, change: (value: number) => Omit<Extract<ClientMessage, { type: "set_physics" }>, "type">): NumberField {
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
    const magnitude = Math.hypot(...scene.gravity);
    this.direction = magnitude > 0 ? (scene.gravity.map((x) => x / magnitude) as unknown as Vector) : [0, -1, 0];
    this.gravity.value = magnitude;
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
