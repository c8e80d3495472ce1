// Physics settings: gravity, friction, virtual coupling, step. Changes apply at once to the current state.

import type { SceneMessage, ClientMessage } from "../protocol/messages";
import type { Vector } from "../protocol/frame";
import { numberField, section } from "./elements";

export class PhysicsPanel {
  readonly section: HTMLElement;
  private direction: Vector = [0, -1, 0];
  private readonly gravity;
  private readonly step;
  private readonly friction;
  private readonly stiffness;
  private readonly damping;

  constructor(send: (message: ClientMessage) => void) {
    this.gravity = numberField("Gravity", "m/s²", "Gravitational acceleration; 9.81 on Earth", { min: 0, max: 100, step: "any" }, (magnitude) =>
      send({ type: "set_physics", gravity: this.direction.map((x) => x * magnitude) as unknown as Vector }),
    );
    this.friction = numberField("Friction", "", "Coulomb friction coefficient of all contacts: 0 is frictionless, 1 is like rubber", { min: 0, max: 5, step: "any" }, (friction) =>
      send({ type: "set_physics", friction }),
    );
    const sendCoupling = () => {
      const [stiffness, damping] = [this.stiffness.value, this.damping.value];
      if (stiffness > 0 && damping >= 0) send({ type: "set_physics", coupling: { stiffness, damping } });
    };
    this.stiffness = numberField(
      "Coupling stiffness",
      "N/m",
      "Spring between your hand (interface point) and the proxy: a stiffer coupling pushes harder",
      { min: 0.1, max: 1e5, step: "any" },
      sendCoupling,
    );
    this.damping = numberField("Coupling damping", "N·s/m", "Damper parallel to the coupling spring", { min: 0, max: 1e4, step: "any" }, sendCoupling);
    this.step = numberField(
      "Time step",
      "ms",
      "Step of the simulation; 1 ms is 1000 steps per second",
      { min: 0.05, max: 20, step: "any" },
      (step) => send({ type: "set_physics", step: step / 1000 }),
    );
    this.section = section(
      "Physics",
      true,
      this.gravity.row,
      this.friction.row,
      this.stiffness.row,
      this.damping.row,
      this.step.row,
    );
  }

  update(scene: SceneMessage): void {
    const magnitude = Math.hypot(...scene.gravity);
    this.direction = magnitude > 0 ? (scene.gravity.map((x) => x / magnitude) as unknown as Vector) : [0, -1, 0];
    this.gravity.value = magnitude;
    this.step.value = 1000 * scene.step_s;
    const pointer = scene.devices.find((device) => device.pointer) ?? scene.devices[0];
    const friction = pointer?.friction ?? scene.obstacles[0]?.friction;
    if (friction !== undefined) this.friction.value = friction;
    const coupling = pointer?.coupling ?? null;
    for (const field of [this.stiffness, this.damping]) field.row.hidden = coupling === null;
    if (coupling !== null) {
      this.stiffness.value = coupling.stiffness;
      this.damping.value = coupling.damping;
    }
  }
}
