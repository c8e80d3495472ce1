// Plot of one quantity of several logs over each other, with the difference of two.

import { seconds, withUnit } from "../format";
import type { Series } from "../protocol/messages";
import { align, curveOf, largestAt, type Quantity } from "../playback/comparison";
import { element, section } from "./elements";
import { Plot } from "./plot";

export class ComparisonPlot {
  readonly section: HTMLDetailsElement;
  readonly plot: Plot;
  private readonly select = element("select");
  private readonly choice: HTMLElement;
  private readonly summary = element("p", { class: "secondary" });
  private quantities: readonly Quantity[] = [];
  private logs: { name: string; series: Series }[] = [];

  constructor(
    title: string,
    private readonly unit: "N" | "J",
    height: number,
  ) {
    this.plot = new Plot(unit, height, []);
    this.select.addEventListener("change", () => this.draw());
    this.choice = element("label", { class: "field" }, element("span", { class: "name", text: "Curves of" }), this.select);
    this.section = section(title, true, this.choice, this.plot.box, this.summary);
    this.section.addEventListener("toggle", () => this.draw());
  }

  /** Shows a quantity of all logs: the one that was chosen, else the one with the largest values. */
  show(logs: { name: string; series: Series }[], quantities: readonly Quantity[]): void {
    const chosen = this.select.value;
    this.logs = logs;
    this.quantities = quantities;
    this.select.replaceChildren(...quantities.map(({ name, title }) => element("option", { text: name, title, attributes: { value: name } })));
    this.choice.hidden = quantities.length < 2;
    this.select.value = quantities.some(({ name }) => name === chosen) ? chosen : (largestOf(logs, quantities)?.name ?? "");
    this.draw();
  }

  /** Draws anew, with the current theme. */
  draw(): void {
    const quantity = this.quantities.find(({ name }) => name === this.select.value);
    if (quantity === undefined) return;
    const { times, values, difference } = align(this.logs.map(({ series }) => curveOf(series, quantity)));
    const curves = this.logs.map(({ name }) => ({ name, title: `${quantity.title}, ${name}` }));
    const [first, second] = this.logs;
    if (difference !== null) curves.push({ name: "Difference", title: `${second.name} minus ${first.name}` });
    this.plot.setSeries(curves.map((curve, i) => ({ ...curve, dashed: i === this.logs.length })));
    this.plot.setData([times, ...values, ...(difference === null ? [] : [difference])], null);
    const at = difference === null ? -1 : largestAt(difference);
    this.summary.hidden = at < 0;
    if (difference !== null && at >= 0) this.summary.textContent = `Largest difference: ${withUnit(difference[at] ?? 0, this.unit, 1e-9)} at ${seconds(times[at])}.`;
  }
}

function largestOf(logs: readonly { series: Series }[], quantities: readonly Quantity[]): Quantity | null {
  let [best, largest] = [quantities[0] ?? null, 0];
  for (const quantity of quantities) {
    for (const { series } of logs) {
      const value = quantity.of(series).reduce((most, x) => Math.max(most, Math.abs(x)), 0);
      if (value > largest) [best, largest] = [quantity, value];
    }
  }
  return best;
}
