// Numeric readout of the force on each active device [N].

import { formatForce } from "../format";
import type { SceneMessage } from "../protocol/messages";
import type { Frame } from "../protocol/frame";
import { element } from "./elements";

export class ForceReadout {
  readonly box = element("div", { class: "force-readout", attributes: { "aria-label": "Force on your hand" } });
  private rows: { row: HTMLElement; number: HTMLElement; name: HTMLElement }[] = [];

  constructor() {
    this.box.hidden = true;
  }

  show(frame: Frame | null, scene: SceneMessage | null, devices: readonly number[]): void {
    const shown = frame === null || scene === null ? [] : devices.filter((device) => device < frame.devices.length);
    this.box.hidden = shown.length === 0;
    while (this.rows.length < shown.length) this.addRow();
    while (this.rows.length > shown.length) this.rows.pop()?.row.remove();
    shown.forEach((device, i) => {
      const force = frame!.devices[device].force;
      this.rows[i].number.textContent = formatForce(Math.hypot(...force));
      this.rows[i].name.textContent = shown.length === 1 ? "force on your hand" : scene!.devices[device].name;
    });
  }

  private addRow(): void {
    const number = element("span", { class: "number" });
    const name = element("span", { class: "name" });
    const row = element("div", {}, number, name);
    this.rows.push({ row, number, name });
    this.box.append(row);
  }
}
