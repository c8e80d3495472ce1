// Table of the force process timing: percentiles of compute time and lateness, overruns.

import { count, micros } from "../format";
import type { Percentiles, Status } from "../protocol/messages";
import { element, section } from "./elements";

export class TimingPanel {
  private readonly rows = element("tbody");
  private readonly summary = element("p", { class: "secondary" });
  readonly section = section(
    "Force process timing",
    true,
    element(
      "table",
      { class: "timing" },
      element(
        "thead",
        {},
        element(
          "tr",
          {},
          element("th", { attributes: { scope: "col" } }),
          ...(
            [
              ["p50", "Median of all steps"],
              ["p99", "99th percentile: one step in 100 is slower"],
              ["p99.9", "99.9th percentile: one step in 1000 is slower"],
              ["max", "Slowest step so far"],
            ] as const
          ).map(([text, title]) => element("th", { text, title, attributes: { scope: "col" } })),
        ),
      ),
      this.rows,
    ),
    this.summary,
  );

  update(status: Status): void {
    const timing = status.force_process ?? null;
    this.section.hidden = timing === null;
    if (timing === null) return;
    const row = (name: string, title: string, values: Percentiles) =>
      element(
        "tr",
        {},
        element("th", { text: name, title, attributes: { scope: "row" } }),
        ...[values.p50, values.p99, values.p999, values.max].map((value) => element("td", { text: micros(value) })),
      );
    this.rows.replaceChildren(
      row("Compute time", "Time to compute one step", timing.compute_us),
      row("Lateness", "Delay of a step's start after its deadline, caused by the operating system", timing.lateness_us),
    );
    const overruns = timing.overruns === 0 ? "none" : `${count(timing.overruns)}, ${count(timing.compute_overruns)} of them by compute time`;
    this.summary.textContent = `Steps: ${count(status.steps)}. Overruns: ${overruns}. ${timing.realtime_priority ? "With" : "Without"} real-time priority.`;
    this.summary.title = "Overrun: a step that ends after the next one should have begun";
  }

  clear(): void {
    this.section.hidden = true;
  }
}
