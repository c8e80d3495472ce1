// Gravity, step, friction and how hard a hand pushes: taken over at once, where the objects are.

import type { SceneMessage, ToServer } from "../protocol/messages";
import type { Vector } from "../protocol/picture";
import { numberField, section } from "./element";

export class LawsPanel {
  readonly section: HTMLElement;
  private direction: Vector = [0, -1, 0];
  private readonly gravity;
  private readonly step;
  private readonly friction;
  private readonly stiffness;
  private readonly damping;

  constructor(send: (message: ToServer) => void) {
    this.gravity = numberField("Gravity", "m/s²", "How strongly everything is pulled down; 9.81 on Earth, 0 in space", { min: 0, max: 100, step: "any" }, (size) =>
      send({ type: "set", gravity: this.direction.map((x) => x * size) as unknown as Vector }),
    );
    this.friction = numberField("Friction", "", "Coulomb's coefficient of fingers and surfaces: 0 is ice, 1 is rubber", { min: 0, max: 5, step: "any" }, (friction) =>
      send({ type: "set", friction }),
    );
    const couple = () => {
      const [stiffness, damping] = [this.stiffness.value, this.damping.value];
      if (stiffness > 0 && damping >= 0) send({ type: "set", coupling: { stiffness, damping } });
    };
    this.stiffness = numberField(
      "Hand's stiffness",
      "N/m",
      "Your finger hangs on your hand by a spring: the stiffer, the harder it pushes when it is held back",
      { min: 0.1, max: 1e5, step: "any" },
      couple,
    );
    this.damping = numberField("Hand's damping", "N·s/m", "How much that spring is damped", { min: 0, max: 1e4, step: "any" }, couple);
    this.step = numberField(
      "Step",
      "ms",
      "Time between two computations of the force; 1 ms is 1000 a second",
      { min: 0.05, max: 20, step: "any" },
      (step) => send({ type: "set", step: step / 1000 }),
    );
    this.section = section(
      "Laws",
      true,
      this.gravity.row,
      this.friction.row,
      this.stiffness.row,
      this.damping.row,
      this.step.row,
    );
  }

  take(scene: SceneMessage): void {
    const size = Math.hypot(...scene.gravity);
    this.direction = size > 0 ? (scene.gravity.map((x) => x / size) as unknown as Vector) : [0, -1, 0];
    this.gravity.value = size;
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
