// The force on each finger that presses, as large as a scale shows it.

import { forceReading } from "../format";
import type { SceneMessage } from "../protocol/messages";
import type { Picture } from "../protocol/picture";
import { element } from "./element";

export class ForceReading {
  readonly box = element("div", { class: "reading", attributes: { "aria-label": "Force on your finger" } });
  private rows: { row: HTMLElement; number: HTMLElement; name: HTMLElement }[] = [];

  constructor() {
    this.box.hidden = true;
  }

  show(picture: Picture | null, scene: SceneMessage | null, devices: readonly number[]): void {
    const shown = picture === null || scene === null ? [] : devices.filter((device) => device < picture.devices.length);
    this.box.hidden = shown.length === 0;
    while (this.rows.length < shown.length) this.addRow();
    while (this.rows.length > shown.length) this.rows.pop()?.row.remove();
    shown.forEach((device, i) => {
      const force = picture!.devices[device].force;
      this.rows[i].number.textContent = forceReading(Math.hypot(...force));
      this.rows[i].name.textContent = shown.length === 1 ? "on your finger" : scene!.devices[device].name;
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
